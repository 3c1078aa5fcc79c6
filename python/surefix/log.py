"""Logs of measurements: one row per measurement, from arrays, CSV or Parquet."""

from __future__ import annotations

import csv
import gzip
import io
import zlib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from surefix import _core
from surefix.core.checks import FloatArray, to_nanoseconds_array
from surefix.errors import ConfigError, ShapeError, SurefixError

if TYPE_CHECKING:
    import _csv

NO_TIME = np.iinfo(np.int64).min
"""What the engine takes for a time that is NaN, infinite or out of range."""

Progress = Callable[[int, int], None]
"""Called now and then with (done, total)."""


class Log:
    """Measurements in long format: ``time`` (N,) [s], ``sensor`` (N,) names, ``value`` (N,).

    Rows may come in any order; NaN and infinite entries are kept and counted when the log is run,
    not dropped in silence. ``names``: the sensors' names in order of first appearance; ``code``
    (N,): index into them. Raises ShapeError if the lengths differ, ConfigError for an empty log or
    for entries that are no numbers.
    """

    def __init__(
        self, time: npt.ArrayLike, sensor: Sequence[str] | npt.NDArray[Any], value: npt.ArrayLike
    ) -> None:
        self.time = _column("time", time)
        self.value = _column("value", value)
        labels = np.asarray(sensor)
        if labels.ndim != 1:
            raise ShapeError(f"log, sensor: expected shape (any,), got {labels.shape}")
        if not all(isinstance(label, str) for label in labels.tolist()):
            raise ConfigError(f"log, sensor: expected names, got {labels.tolist()[:3]!r}…")
        if not len(labels) == len(self.time) == len(self.value):
            raise ShapeError(
                "log: expected time, sensor and value of one length, got "
                f"{len(self.time)}, {len(labels)} and {len(self.value)}"
            )
        if len(self.time) == 0:
            raise ConfigError("log: expected at least one measurement, got an empty log")
        self.names, self.code = _factorised(labels)
        self.stamp = _stamps(self.time)
        self._codes: dict[tuple[str, ...], npt.NDArray[np.int32]] = {}

    def __len__(self) -> int:
        return len(self.time)

    def __repr__(self) -> str:
        return f"Log({len(self)} measurements of {', '.join(self.names)})"

    @property
    def sensor(self) -> npt.NDArray[np.str_]:
        """Name of the sensor of every row (N,)."""
        return np.asarray(self.names, dtype=np.str_)[self.code]

    def codes_for(self, names: Sequence[str]) -> npt.NDArray[np.int32]:
        """Index of every row's sensor in ``names`` (N,), −1 where it is not among them."""
        wanted = tuple(names)
        if wanted not in self._codes:  # a log is often run more than once
            table = [wanted.index(n) if n in wanted else -1 for n in self.names]
            self._codes = {wanted: np.array(table, np.int32)[self.code]}
        return self._codes[wanted]


def read_log(
    path: str | Path,
    *,
    time: str = "time_s",
    sensor: str = "sensor",
    value: str = "value",
    columns: Mapping[str, str] | None = None,
    progress: Progress | None = None,
) -> Log:
    """Reads a log from CSV (also .csv.gz) or Parquet.

    ``time``, ``sensor``, ``value`` name the columns of a long table. For a wide table give
    ``columns``, from sensor to column: each such column becomes the rows of one sensor, empty cells
    are left out. An empty value in a long table is a NaN, counted when the log is run. Raises
    ConfigError naming the file, the line and the column of what cannot be read.
    """
    path = Path(path)
    wanted = [time, *columns.values()] if columns else [time, sensor, value]
    if path.suffix == ".parquet":
        table = _read_parquet(path, wanted)
    else:
        texts = {} if columns else {sensor}
        table = _read_csv(path, wanted, set(texts), progress)
    if len(table[time]) == 0:
        raise ConfigError(f"{path}: expected at least one measurement, got an empty log")
    if columns and all(np.isnan(table[column]).all() for column in columns.values()):
        empty = ", ".join(columns.values())
        raise ConfigError(f"{path}: expected numbers in {empty}, got an empty log")
    if not columns:
        return Log(table[time], table[sensor], table[value])
    stamps = np.concatenate([table[time]] * len(columns))
    values = np.concatenate([table[column] for column in columns.values()])
    sensors = np.repeat(np.array(list(columns)), len(table[time]))
    present = ~np.isnan(values)
    order = np.argsort(stamps[present], kind="stable")
    return Log(stamps[present][order], sensors[present][order], values[present][order])


def _read_parquet(path: Path, wanted: list[str]) -> dict[str, Any]:
    try:
        import pyarrow.parquet as parquet
    except ImportError:
        raise SurefixError(
            f"{path}: reading Parquet needs pyarrow: pip install surefix[io]"
        ) from None
    try:
        table = parquet.read_table(path, columns=None)
    except (OSError, ValueError) as error:
        raise ConfigError(f"{path}: not a readable Parquet file: {error}") from None
    for column in wanted:
        if column not in table.column_names:
            raise ConfigError(f"{path}: no column {column!r}; it has {table.column_names}")
    return {column: table[column].to_numpy() for column in wanted}


def _read_csv(
    path: Path, wanted: list[str], texts: set[str], progress: Progress | None
) -> dict[str, Any]:
    try:
        raw = (gzip.open if path.suffix == ".gz" else open)(path, "rb")
    except OSError as error:
        raise ConfigError(f"{path}: {error.strerror}") from None
    with raw:
        size = path.stat().st_size
        lines = io.TextIOWrapper(raw, encoding="utf-8-sig", newline="")
        try:
            return _parse(path, csv.reader(lines), wanted, texts, size, progress)
        except (UnicodeDecodeError, csv.Error, gzip.BadGzipFile, EOFError, zlib.error) as error:
            raise ConfigError(f"{path}: not a readable CSV file: {error}") from None


def _parse(
    path: Path,
    rows: _csv.Reader,
    wanted: list[str],
    texts: set[str],
    size: int,
    progress: Progress | None,
) -> dict[str, Any]:
    header = next(rows, None)
    if header is None:
        raise ConfigError(f"{path}: expected a header line, got an empty file")
    header = [name.strip() for name in header]
    for column in wanted:
        if column not in header:
            raise ConfigError(f"{path}, line 1: no column {column!r}; it has {header}")
    places = [(column, header.index(column), column in texts) for column in wanted]
    table: dict[str, list[Any]] = {column: [] for column in wanted}
    seen = 0
    for count, row in enumerate(rows, start=2):
        line = rows.line_num
        if not row:
            continue  # a blank line, usually the last
        if len(row) != len(header):
            raise ConfigError(f"{path}, line {line}: expected {len(header)} fields, got {len(row)}")
        for column, place, is_text in places:
            cell = row[place]
            table[column].append(cell.strip() if is_text else _number(path, line, column, cell))
        seen += sum(map(len, row)) + len(row)
        if progress is not None and count % 20_000 == 0:
            progress(min(seen, size), size)
    if progress is not None:
        progress(size, size)
    return {c: np.asarray(v, dtype=np.str_ if c in texts else None) for c, v in table.items()}


def _number(path: Path, line: int, column: str, cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        if not cell.strip():
            return float("nan")
        raise ConfigError(
            f"{path}, line {line}, column {column!r}: expected a number, got {cell!r}"
        ) from None


def _column(name: str, values: npt.ArrayLike) -> FloatArray:
    try:
        column = np.ascontiguousarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise ConfigError(f"log, {name}: expected numbers, got {values!r}") from None
    if column.ndim != 1:
        raise ShapeError(f"log, {name}: expected shape (any,), got {column.shape}")
    return column


def _factorised(labels: npt.NDArray[Any]) -> tuple[tuple[str, ...], npt.NDArray[np.int32]]:
    found, first, code = np.unique(labels, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty(len(order), np.int32)
    rank[order] = np.arange(len(order), dtype=np.int32)
    return tuple(str(found[i]) for i in order), rank[code.reshape(-1)]


def _stamps(time: FloatArray) -> npt.NDArray[np.int64]:
    """Nearest nanosecond, as the engine rounds; NO_TIME where there is none."""
    good = np.abs(time) <= _core.MAX_SECONDS  # false for NaN
    return np.where(good, to_nanoseconds_array(np.where(good, time, 0.0)), NO_TIME)
