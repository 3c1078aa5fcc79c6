"""The truth to which a run is compared, where it is known."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from surefix.core.checks import FloatArray
from surefix.errors import ConfigError
from surefix.log import Log
from surefix.reading.log import read_columns


@dataclass(frozen=True)
class Reference:
    """The true output over time, in a file beside the log: names of the file and its columns."""

    file: str
    time: str = "time_s"
    value: str = "value"

    def read(self, folder: Path) -> tuple[FloatArray, FloatArray]:
        """Time [s] and value, each (R,), in order of time; rows without a value are left out.

        Raises ConfigError, naming file, row and column, for times out of order and for numbers that
        are not finite: a truth that has holes must not look like an error of the estimate.
        """
        path = folder / self.file
        table = read_columns(path, self.time, [self.value])
        times, values = table[self.time].values, table[self.value].values
        rows = np.flatnonzero(~table[self.value].empty)
        if len(rows) == 0:
            raise ConfigError(f"{path}, column {self.value!r}: expected numbers, got empty cells")
        log = Log(times[rows], ["reference"] * len(rows), values[rows])
        backwards = np.diff(log.time, prepend=-np.inf) < 0
        for name, column, wrong, expected in (
            (self.time, log.time, ~np.isfinite(log.time), "a finite number"),
            (self.value, log.value, ~np.isfinite(log.value), "a finite number"),
            (self.time, log.time, backwards, "times in order"),
        ):
            for i in np.flatnonzero(wrong)[:1]:
                where = f"{path}, row {rows[i] + 1}, column {name!r}"
                raise ConfigError(f"{where}: expected {expected}, got {column[i]}")
        return log.time, log.value
