"""Files of measurements: logs and single columns, from CSV or Parquet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from surefix.errors import ConfigError
from surefix.log import Log
from surefix.reading.columns import Progress, TableColumn
from surefix.reading.from_csv import read_csv
from surefix.reading.from_parquet import read_parquet


def read_log(
    path: str | Path,
    *,
    time: str = "time_s",
    sensor: str = "sensor",
    value: str = "value",
    sigma: str | None = None,
    columns: Mapping[str, str] | None = None,
    progress: Progress | None = None,
) -> Log:
    """Reads a log from CSV (also .csv.gz) or Parquet.

    ``time``, ``sensor``, ``value`` name the columns of a long table, ``sigma`` one with standard
    deviations of the readings, if there is one (an empty cell: the sensor's own). For a wide table
    give ``columns``, from sensor to column: each such column becomes the rows of one sensor, empty
    cells are left out. NaN, and an empty value in a long table, are counted when the log is run.
    Times are seconds; in Parquet they may be timestamps. Raises ConfigError naming the file, the
    line and the column of what cannot be read.
    """
    path = Path(path)
    if columns:
        if sigma is not None:
            raise ConfigError(f"sigma: expected none with a wide table, got {sigma!r}")
        return _wide(path, time, columns, progress)
    numbers = [value] if sigma is None else [value, sigma]
    table = read_columns(path, time, numbers, sensor, progress)
    if len(table[time].values) == 0:
        raise ConfigError(f"{path}: expected at least one measurement, got an empty log")
    spread = None if sigma is None else table[sigma].values
    return Log(table[time].values, table[sensor].values, table[value].values, spread)


def read_columns(
    path: Path,
    time: str,
    numbers: Sequence[str],
    names: str | None = None,
    progress: Progress | None = None,
) -> dict[str, TableColumn]:
    """The columns of that name, each (rows,), in the order of the file: ``time``, ``numbers``, and
    ``names``, a column of texts."""
    if path.suffix == ".parquet":
        return read_parquet(path, time, numbers, names)
    return read_csv(path, [time, *numbers], names, progress)


def _wide(path: Path, time: str, columns: Mapping[str, str], progress: Progress | None) -> Log:
    table = read_columns(path, time, list(columns.values()), None, progress)
    cells = [table[column] for column in columns.values()]
    present = ~np.concatenate([cell.empty for cell in cells])
    if not present.any():
        empty = ", ".join(columns.values())
        raise ConfigError(f"{path}: expected numbers in {empty}, got an empty log")
    stamps = np.concatenate([table[time].values] * len(columns))[present]
    values = np.concatenate([cell.values for cell in cells])[present]
    sensors = np.repeat(np.array(list(columns)), len(table[time].values))[present]
    order = np.argsort(stamps, kind="stable")
    return Log(stamps[order], sensors[order], values[order])
