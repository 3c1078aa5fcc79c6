"""True positions beside the track, for what ``surefix raim`` says of errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from surefix.config_raim_tables import TruthTable
from surefix.core.checks import FloatArray
from surefix.errors import ConfigError
from surefix.raim.track import Track
from surefix.raim.track_files import CARTESIAN
from surefix.reading.columns import TableColumn
from surefix.reading.from_csv import csv_columns, read_csv

ALONG = "along_m"
TIME = "t_s"


@dataclass(frozen=True, eq=False)
class Truth:
    """At every epoch (T,) the true mileage ``along`` [m], NaN before and after the file's times;
    ``beside`` [m]: how far that is from the track, None of a file of mileages."""

    along: FloatArray
    beside: FloatArray | None


def read_truth(
    path: Path, names: TruthTable, time: str | None, track: Track, at: FloatArray
) -> Truth:
    """The truth at the epochs' times ``at`` (T,), interpolated linearly; of the nearest point of
    the track if the file has positions. Rows with an empty cell are left out. A file of one row
    without times is of a receiver that stands still. Raises ConfigError naming file and column."""
    columns = _columns(path, names)
    times, values = _read(path, TIME if time is None else time, columns)
    if times is None:
        there = np.repeat(values, len(at), axis=0)
    else:
        one = [np.interp(at, times, column, left=np.nan, right=np.nan) for column in values.T]
        there = np.column_stack(one)
    if len(columns) == 1:
        return Truth(there[:, 0], None)
    place = track.project(there)
    return Truth(place.along, np.hypot(place.across, place.up))


def _columns(path: Path, names: TruthTable) -> Sequence[str]:
    if names.along is not None:
        return [names.along]
    if names.position is not None:
        return names.position
    for columns in (CARTESIAN, (ALONG,)):
        if _has(path, columns):
            return columns
    raise ConfigError(
        f"{path}, line 1: expected columns {', '.join(CARTESIAN)} or {ALONG}, or their names in "
        "[truth] of --config"
    )


def _has(path: Path, columns: Sequence[str]) -> bool:
    return set(columns) <= set(csv_columns(path))


def _read(path: Path, time: str, columns: Sequence[str]) -> tuple[FloatArray | None, FloatArray]:
    """Times (R,), or None of one row that has none, and the columns (R, c)."""
    if not _has(path, [time]):
        table = read_csv(path, columns, None, None)
        values = _values(path, table, columns)
        if len(values) != 1:
            raise ConfigError(f"{path}, line 1: no column {time!r}, expected in more than one row")
        return None, values
    table = read_csv(path, [time, *columns], None, None)
    full = ~np.any([column.empty for column in table.values()], axis=0)
    kept = {
        name: TableColumn(column.values[full], column.empty[full]) for name, column in table.items()
    }
    times, values = kept[time].values, _values(path, kept, columns)
    if not np.isfinite(times).all() or (np.diff(times) <= 0).any():
        raise ConfigError(f"{path}, column {time!r}: expected finite times in order, each once")
    return times, values


def _values(path: Path, table: dict[str, TableColumn], columns: Sequence[str]) -> FloatArray:
    values = np.column_stack([table[name].values for name in columns])
    if len(values) == 0:
        raise ConfigError(f"{path}: expected at least one row")
    for row, column in np.argwhere(~np.isfinite(values))[:1]:
        raise ConfigError(
            f"{path}, column {columns[column]!r}: expected finite numbers, "
            f"got {values[row, column]}"
        )
    return values
