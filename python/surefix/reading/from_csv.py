"""Columns of a CSV file; what is wrong is named by line and column."""

from __future__ import annotations

import csv
import gzip
import io
import zlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from surefix.errors import ConfigError
from surefix.reading.columns import Progress, TableColumn

if TYPE_CHECKING:
    import _csv


def read_csv(
    path: Path, numbers: Sequence[str], names: str | None, progress: Progress | None
) -> dict[str, TableColumn]:
    """The columns ``numbers``, and ``names``, one of texts; a file *.gz is decompressed."""
    kinds: dict[str, Callable[[str], Any]] = dict.fromkeys(numbers, _number)
    if names is not None:
        kinds[names] = _name
    with _rows(path) as rows:
        table = _parse(path, rows, kinds, path.stat().st_size, progress)
    return {
        name: TableColumn(
            np.array(cells, dtype=np.str_ if name == names else np.float64),  # NaN for None
            np.array([cell is None for cell in cells], dtype=np.bool_),
        )
        for name, cells in table.items()
    }


def csv_columns(path: Path) -> list[str]:
    """Names of the columns that a file has."""
    with _rows(path) as rows:
        return _header(path, rows)


@contextmanager
def _rows(path: Path) -> Iterator[_csv.Reader]:
    """Rows of a file; what is no CSV becomes an error that names it."""
    try:
        raw = (gzip.open if path.suffix == ".gz" else open)(path, "rb")
    except OSError as error:
        raise ConfigError(f"{path}: {error.strerror}") from None
    with raw:
        lines = io.TextIOWrapper(raw, encoding="utf-8-sig", newline="")
        try:
            yield csv.reader(lines)
        except (UnicodeDecodeError, csv.Error, gzip.BadGzipFile, EOFError, zlib.error) as error:
            raise ConfigError(f"{path}: not a readable CSV file: {error}") from None


def _header(path: Path, rows: _csv.Reader) -> list[str]:
    header = next(rows, None)
    if header is None:
        raise ConfigError(f"{path}: expected a header line, got an empty file")
    return [name.strip() for name in header]


def _parse(
    path: Path,
    rows: _csv.Reader,
    kinds: dict[str, Callable[[str], Any]],
    size: int,
    progress: Progress | None,
) -> dict[str, list[Any]]:
    header = _header(path, rows)
    for column in kinds:
        if column not in header:
            raise ConfigError(f"{path}, line 1: no column {column!r}; it has {header}")
    table: dict[str, list[Any]] = {column: [] for column in kinds}
    places = [(table[c].append, header.index(c), read, c) for c, read in kinds.items()]
    seen = 0
    for count, row in enumerate(rows, start=2):
        line = rows.line_num
        if not row:
            continue  # a blank line, usually the last
        if len(row) != len(header):
            raise ConfigError(f"{path}, line {line}: expected {len(header)} fields, got {len(row)}")
        for append, place, read, column in places:
            try:
                append(read(row[place]))
            except ValueError as error:
                place_in_file = f"{path}, line {line}, column {column!r}"
                raise ConfigError(f"{place_in_file}: {error}, got {row[place]!r}") from None
        seen += sum(map(len, row)) + len(row)
        if progress is not None and count % 20_000 == 0:
            progress(min(seen, size), size)
    if progress is not None:
        progress(size, size)
    return table


def _number(cell: str) -> float | None:
    """None for an empty cell."""
    try:
        if "_" in cell:  # which Python takes for a separator of digits
            raise ValueError
        return float(cell)
    except ValueError:
        if not cell.strip():
            return None
        raise ValueError("expected a number") from None


def _name(cell: str) -> str:
    name = cell.strip()
    if not name or "\0" in name:
        raise ValueError("expected a name")
    return name
