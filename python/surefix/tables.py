"""Tables and dictionaries as CSV and JSON. Numbers are written with the fewest digits that read
back as the same float; NaN is ``nan`` in CSV and null in JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

Columns = Mapping[str, npt.NDArray[Any]]

ROWS_AT_ONCE = 20_000


def write_csv(
    path: Path, columns: Columns, progress: Callable[[int, int], None] | None = None
) -> None:
    """Writes named columns of one length."""
    total = len(next(iter(columns.values())))
    with path.open("w", encoding="utf-8", newline="") as file:
        file.write(",".join(map(_quoted, columns)) + "\n")
        for start in range(0, total, ROWS_AT_ONCE):
            part = [_cells(column[start : start + ROWS_AT_ONCE]) for column in columns.values()]
            file.write("\n".join(map(",".join, zip(*part, strict=True))) + "\n")
            if progress is not None:
                progress(min(start + ROWS_AT_ONCE, total), total)


def write_columns_json(path: Path, columns: Columns) -> None:
    """Writes ``{"name": [...], ...}``."""
    plain(path, {name: column.tolist() for name, column in columns.items()}, indent=None)


def plain(path: Path, data: Mapping[str, Any], indent: int | None = 2) -> None:
    """Writes a dictionary as JSON."""
    path.write_text(as_json(data, indent) + "\n", encoding="utf-8")


def as_json(data: Any, indent: int | None = 2) -> str:
    """JSON text, with null for NaN and infinity."""
    separators = (",", ":") if indent is None else None
    try:
        return json.dumps(data, indent=indent, allow_nan=False, separators=separators)
    except ValueError:
        return json.dumps(_finite(data), indent=indent, allow_nan=False, separators=separators)


def flattened(data: Any, prefix: str = "") -> dict[str, Any]:
    """Nested dictionaries and lists as one, with keys ``outer.inner`` and ``list.0``."""
    if isinstance(data, Mapping):
        pairs = list(data.items())
    elif isinstance(data, list):
        pairs = [(str(i), entry) for i, entry in enumerate(data)]
    else:
        return {prefix: data}
    flat: dict[str, Any] = {}
    for key, value in pairs:
        flat.update(flattened(value, f"{prefix}.{key}" if prefix else str(key)))
    return flat


def write_flat_csv(path: Path, data: Mapping[str, Any]) -> None:
    """Writes a nested dictionary as lines ``key,value``."""
    lines = ["key,value"]
    for key, value in flattened(data).items():
        text = "" if value is None else repr(value) if isinstance(value, float) else str(value)
        lines.append(f"{_quoted(key)},{_quoted(text)}")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _cells(column: npt.NDArray[Any]) -> list[str]:
    values = column.tolist()
    if column.dtype.kind in "fiu":
        return [*map(repr, values)]
    known = {value: _quoted(str(value)) for value in set(values)}
    return [known[value] for value in values]


def _quoted(text: str) -> str:
    if any(mark in text for mark in ',"\r\n'):
        return '"' + text.replace('"', '""') + '"'
    return text


def _finite(data: Any) -> Any:
    if isinstance(data, float):
        return data if math.isfinite(data) else None
    if isinstance(data, Mapping):
        return {key: _finite(value) for key, value in data.items()}
    if isinstance(data, (list, tuple, np.ndarray)):
        return [_finite(value) for value in data]
    return data
