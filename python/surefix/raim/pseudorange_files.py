"""Pseudoranges from CSV files."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from surefix.core import checks
from surefix.errors import ConfigError
from surefix.raim.pseudoranges import Pseudoranges
from surefix.reading.columns import Progress
from surefix.reading.from_csv import csv_columns, read_csv

LETTERS = re.compile(r"([A-Z])\d+")
"""RINEX names of satellites: G03, E11, C06."""


def read_pseudoranges(
    path: str | Path,
    *,
    time: str = "t_s",
    satellite: str = "sat",
    position: Sequence[str] = ("sat_x_m", "sat_y_m", "sat_z_m"),
    pseudorange: str = "pr_corr_m",
    sigma: str | float = 1.0,
    system: str | None = None,
    progress: Progress | None = None,
) -> Pseudoranges:
    """Pseudoranges from a CSV file (also .csv.gz), one row for every satellite and epoch.

    The arguments name columns; ``sigma`` [m] may be a number for all. ``system`` None: the column
    'system' if there is one, else the letter of the satellites' names where all are of the form
    G03, else one system. Empty cells are NaN and not used. Raises ConfigError naming file, line and
    column.
    """
    path = Path(path)
    where = tuple(position)
    if len(where) != 3:
        raise ConfigError(f"position: expected three names of columns, got {list(where)}")
    numbers = [time, *where, pseudorange]
    if isinstance(sigma, str):
        numbers.append(sigma)
    else:
        checks.positive("sigma", sigma)
    table = read_csv(path, numbers, satellite, progress)
    names = table[satellite].values
    if len(names) == 0:
        raise ConfigError(f"{path}: expected at least one pseudorange, got an empty file")
    for k in np.flatnonzero(~np.isfinite(table[time].values))[:1]:
        raise ConfigError(
            f"{path}, row {k + 1}, column {time!r}: expected a finite number, "
            f"got {table[time].values[k]}"
        )
    return Pseudoranges(
        table[time].values,
        names,
        np.column_stack([table[name].values for name in where]),
        table[pseudorange].values,
        table[sigma].values if isinstance(sigma, str) else float(sigma),
        _systems(path, system, names),
    )


def _systems(
    path: Path, column: str | None, names: npt.NDArray[np.str_]
) -> npt.NDArray[np.str_] | None:
    wanted = "system" if column is None else column
    if column is not None or wanted in csv_columns(path):
        return read_csv(path, [], wanted, None)[wanted].values
    found = [LETTERS.fullmatch(str(name)) for name in names]
    if not all(found):
        return None
    return np.array([match.group(1) for match in found if match])
