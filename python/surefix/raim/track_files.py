"""Tracks from files: CSV and GeoJSON."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from surefix.core import checks
from surefix.core.checks import FloatArray
from surefix.errors import ConfigError
from surefix.raim.geodesy import geodetic_to_ecef
from surefix.raim.track import Track
from surefix.reading.columns import TableColumn
from surefix.reading.from_csv import csv_columns, read_csv

CARTESIAN = ("x_m", "y_m", "z_m")
GEODETIC = ("lat_deg", "lon_deg", "height_m")
COLLECTIONS = {"FeatureCollection": "features", "GeometryCollection": "geometries"}


def read_track(
    path: str | Path,
    *,
    columns: Sequence[str] | None = None,
    height: float = 0.0,
    tolerance: float = 0.0,
    start: float = 0.0,
) -> Track:
    """A track from .csv (.csv.gz) or .geojson (.json).

    CSV: ``columns`` are three Cartesian ones, fixed to the Earth [m], or latitude, longitude
    [degrees] and, if there is one, ellipsoidal height [m] (names with 'lat'); by default x_m, y_m,
    z_m or lat_deg, lon_deg, height_m, those that are there. GeoJSON: the LineString, or the parts
    of a MultiLineString or of several features one after the other, longitude first. ``height``:
    of all points of a file that has none. ``tolerance``, ``start``: as of ``Track``. Raises
    ConfigError naming file, line and column.
    """
    path = Path(path)
    level = checks.number("height", height)
    json_file = path.suffix.lower() in (".geojson", ".json")
    try:
        points = _from_geojson(path, level) if json_file else _from_csv(path, columns, level)
        return Track(points, tolerance=tolerance, start=start)
    except ConfigError as error:
        named = str(error).startswith(str(path)) or str(error).startswith("columns:")
        raise error if named else ConfigError(f"{path}: {error}") from None


def _from_csv(path: Path, columns: Sequence[str] | None, height: float) -> FloatArray:
    names = tuple(columns) if columns is not None else _present(path)
    if len(names) not in (2, 3):
        raise ConfigError(f"columns: expected two or three names, got {list(names)}")
    table = read_csv(path, names, None, None)
    values = [_filled(path, name, table[name]) for name in names]
    if "lat" in names[0].lower():
        return geodetic_to_ecef(*values, *([height] if len(names) == 2 else []))
    if len(names) != 3:
        raise ConfigError(f"columns: expected x, y and z, got {list(names)}")
    return np.column_stack(values)


def _present(path: Path) -> tuple[str, ...]:
    """Those of the usual columns that the file has."""
    there = csv_columns(path)
    for names in (CARTESIAN, GEODETIC, GEODETIC[:2]):
        if set(names) <= set(there):
            return names
    raise ConfigError(
        f"{path}, line 1: expected columns {', '.join(CARTESIAN)} or {', '.join(GEODETIC[:2])}"
    )


def _filled(path: Path, name: str, column: TableColumn) -> FloatArray:
    for k in np.flatnonzero(~np.isfinite(column.values))[:1]:
        raise ConfigError(
            f"{path}, row {k + 1}, column {name!r}: expected a finite number, "
            f"got {column.values[k]}"
        )
    return np.asarray(column.values, dtype=np.float64)


def _from_geojson(path: Path, height: float) -> FloatArray:
    try:
        given = json.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise ConfigError(f"{path}: {error.strerror}") from None
    except (UnicodeDecodeError, json.JSONDecodeError, RecursionError) as error:
        raise ConfigError(f"{path}: not a readable GeoJSON file: {error}") from None
    points: list[tuple[float, float, float]] = []
    for line in _lines(path, given):
        for point in line if isinstance(line, list) else [line]:
            if not (isinstance(point, list) and len(point) >= 2):
                raise ConfigError(f"{path}: expected [longitude, latitude], got {point!r}")
            place = f"{path}, point {len(points) + 1}"
            lon, lat = (checks.number(place, v) for v in point[:2])
            points.append(
                (
                    lat,
                    lon,
                    height if not point[2:] or point[2] is None else checks.number(place, point[2]),
                )
            )
    if not points:
        raise ConfigError(f"{path}: expected a LineString, got no line")
    return geodetic_to_ecef(*np.array(points).T)


def _lines(path: Path, given: Any) -> list[Any]:
    """Coordinates of all lines in an object of GeoJSON; what is no line, stations for example, is
    left out."""
    kind = given.get("type") if isinstance(given, dict) else None
    if isinstance(kind, str) and kind in COLLECTIONS:
        return [
            line for part in _list(path, given, COLLECTIONS[kind]) for line in _lines(path, part)
        ]
    if kind == "Feature":
        return _lines(path, given["geometry"]) if given.get("geometry") else []
    if kind == "LineString":
        return [_list(path, given, "coordinates")]
    if kind == "MultiLineString":
        return _list(path, given, "coordinates")
    if kind in ("Point", "MultiPoint"):
        return []
    raise ConfigError(f"{path}: expected a LineString, got {kind!r}")


def _list(path: Path, given: dict[str, Any], key: str) -> list[Any]:
    found = given.get(key)
    if not isinstance(found, list):
        raise ConfigError(f"{path}: expected a list of {key}, got {found!r}")
    return found
