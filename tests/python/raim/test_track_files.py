"""Tracks from files: the same line in every form."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import surefix as sf
from oracle import raim_geodesy as geodesy
from raim.scenes import winding_points

WINDING = winding_points()


@cache
def geodetic() -> list[tuple[float, float, float]]:
    return [geodesy.ecef_to_geodetic(p) for p in WINDING]


def written(kind: str, folder: Path) -> Path:
    points = WINDING
    rows = geodetic()
    lines = [[lon, lat, height] for lat, lon, height in rows]
    one = {"type": "LineString", "coordinates": lines}
    documents: dict[str, Any] = {
        "line.geojson": one,
        "lines.json": {"type": "MultiLineString", "coordinates": [lines[:20], lines[20:]]},
        "feature.json": {"type": "Feature", "properties": {}, "geometry": one},
        "features.geojson": {"type": "FeatureCollection", "features": [
            {"type": "Feature", "properties": None,
             "geometry": {"type": "LineString", "coordinates": part}}
            for part in (lines[:20], lines[19:])
        ]},
    }  # fmt: skip
    path = folder / kind
    if kind in documents:
        path.write_text(json.dumps(documents[kind]))
    elif kind == "xyz.csv":
        text = ["x_m,y_m,z_m", *(",".join(map(repr, p)) for p in points.tolist())]
        path.write_text("\n".join(text) + "\n")
    else:
        text = ["name,lat_deg,lon_deg,height_m", *(",".join(["p", *map(repr, r)]) for r in rows)]
        path.write_text("\n".join(text) + "\n")
    return path


@pytest.mark.parametrize(
    "kind",
    ["xyz.csv", "geodetic.csv", "line.geojson", "lines.json", "feature.json", "features.geojson"],
)
def test_read(kind: str, tmp_path: Path) -> None:
    found = sf.raim.read_track(written(kind, tmp_path), start=30.0)
    known = sf.raim.Track(WINDING, start=30.0)
    assert found.low == 30.0
    assert found.length == pytest.approx(known.length, abs=1e-6)
    l = np.linspace(known.low, known.high, 400)  # noqa: E741
    np.testing.assert_allclose(found.position(l), known.position(l), atol=1e-6)


def test_read_refuses(tmp_path: Path) -> None:
    for name, text, message in (
        ("a.csv", "t,v\n1,2\n", "x_m"),
        ("b.json", '{"type": "Point", "coordinates": [1, 2]}', "no line"),
        ("c.json", "{", "c.json"),
        ("d.csv", "x_m,y_m,z_m\n1,2,three\n4,5,6\n", "three"),
        ("e.txt", "x_m,y_m,z_m\n", "e.txt"),
    ):
        (tmp_path / name).write_text(text)
        with pytest.raises(sf.SurefixError, match=message):
            sf.raim.read_track(tmp_path / name)
