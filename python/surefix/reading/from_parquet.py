"""Columns of a Parquet file; what is wrong is named by row and column."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from surefix.errors import ConfigError, SurefixError
from surefix.reading.columns import TableColumn


def read_parquet(
    path: Path, time: str, numbers: Sequence[str], names: str | None
) -> dict[str, TableColumn]:
    """The columns ``time``, numbers or timestamps, ``numbers``, and ``names``, one of texts."""
    try:
        import pyarrow as pa
        import pyarrow.parquet as parquet
    except ImportError:
        raise SurefixError(
            f"{path}: reading Parquet needs pyarrow: pip install surefix[io]"
        ) from None
    try:
        with parquet.ParquetFile(path) as file:
            table = file.read()
    except (OSError, ValueError) as error:
        raise ConfigError(f"{path}: not a readable Parquet file: {error}") from None

    def column(name: str) -> Any:
        if name not in table.column_names:
            raise ConfigError(f"{path}: no column {name!r}; it has {table.column_names}")
        cells = table.column(table.column_names.index(name))
        coded = pa.types.is_dictionary(cells.type)
        return cells.cast(cells.type.value_type) if coded else cells

    def numeric(name: str, expected: str = "numbers") -> TableColumn:
        cells, is_ = column(name), pa.types
        kinds = (is_.is_integer, is_.is_floating, is_.is_decimal, is_.is_null)
        if not any(kind(cells.type) for kind in kinds):
            raise ConfigError(f"{path}, column {name!r}: expected {expected}, got {cells.type}")
        return TableColumn(
            cells.cast(pa.float64(), safe=False).to_numpy(), cells.is_null().to_numpy()
        )

    def times(name: str) -> TableColumn:
        cells, is_ = column(name), pa.types
        if not any(kind(cells.type) for kind in (is_.is_timestamp, is_.is_date, is_.is_duration)):
            return numeric(name, "seconds or timestamps")
        return TableColumn(cells.to_numpy(), cells.is_null().to_numpy())

    def texts(name: str) -> TableColumn:
        cells = column(name)
        if not (pa.types.is_string(cells.type) or pa.types.is_large_string(cells.type)):
            raise ConfigError(f"{path}, column {name!r}: expected names, got {cells.type}")
        found = cells.to_pylist()
        for row, text in enumerate(found, start=1):
            if not text or "\0" in text:
                raise ConfigError(
                    f"{path}, row {row}, column {name!r}: expected a name, got {text!r}"
                )
        return TableColumn(np.array(found, dtype=np.str_), np.zeros(len(found), np.bool_))

    read = {time: times(time), **{name: numeric(name) for name in numbers}}
    return read if names is None else {**read, names: texts(names)}
