"""A fault that is put into a log."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from surefix.core import checks
from surefix.core.checks import FloatArray
from surefix.errors import ConfigError
from surefix.log import Log

KINDS = ("freeze", "jump", "ramp", "scale", "interruption")


@dataclass(frozen=True, kw_only=True)
class InjectedFault:
    """What happens to the readings of ``sensor`` from ``start`` to ``end`` [s], end excluded.

    ``kind``, with ``size``:
    'freeze', they repeat the first of them;
    'jump', ``size`` is added [unit of the reading];
    'ramp', ``size`` times the time since the start is added [unit / s];
    'scale', they are multiplied by 1 + ``size``;
    'interruption', they are noise alone, N(0, size²) (Sigalov & Oshman, γ = 0), from ``seed``.
    Raises ConfigError for an unknown kind and times out of order.
    """

    sensor: str
    kind: str
    start: float
    end: float
    size: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        if not isinstance(self.sensor, str) or not self.sensor:
            raise ConfigError(f"sensor: expected its name, got {self.sensor!r}")
        checks.one_of("kind", self.kind, KINDS)
        for name in ("start", "end", "size"):
            object.__setattr__(self, name, checks.number(name, getattr(self, name)))
        if self.start >= self.end:
            raise ConfigError(f"end: expected later than start, {self.start:g}, got {self.end:g}")
        if self.kind == "interruption" and self.size <= 0:
            raise ConfigError(f"size: expected a deviation > 0, got {self.size:g}")
        checks.whole("seed", self.seed, 0, 2**32 - 1)

    def rows(self, log: Log) -> npt.NDArray[np.intp]:
        """The rows of a log that it changes, in order of time: readings that are numbers."""
        inside = (log.time >= self.start) & (log.time < self.end) & np.isfinite(log.value)
        found = np.flatnonzero((log.sensor == self.sensor) & inside)
        return found[np.argsort(log.time[found], kind="stable")]

    def apply(self, log: Log) -> Log:
        """A log with the fault in it. Raises ConfigError if it has no row to change."""
        rows = self.rows(log)
        if len(rows) == 0:
            raise ConfigError(
                f"log: expected readings of {self.sensor!r} from {self.start:g} to "
                f"{self.end:g} s, got none"
            )
        value = log.value.copy()
        with np.errstate(over="ignore"):
            value[rows] = self._changed(value[rows], log.time[rows] - self.start)
        if not np.isfinite(value[rows]).all():
            raise ConfigError(f"size: expected one that leaves finite readings, got {self.size:g}")
        return Log(log.time, log.sensor, value, log.sigma)

    def _changed(self, value: FloatArray, since: FloatArray) -> FloatArray:
        if self.kind == "freeze":
            return np.full(len(value), value[0])
        if self.kind == "jump":
            return value + self.size
        if self.kind == "ramp":
            return value + self.size * since
        if self.kind == "scale":
            return value * (1 + self.size)
        return self.size * np.random.RandomState(self.seed).standard_normal(len(value))
