"""Logs of measurements: one row per measurement."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from surefix import _core
from surefix.core.checks import NANOSECONDS, FloatArray, read_only, to_nanoseconds_array
from surefix.errors import ConfigError, ShapeError

NO_TIME = np.iinfo(np.int64).min
"""What the engine takes for a time that is NaN, infinite or out of range."""


class Log:
    """Measurements in long format: ``time`` (N,) [s], ``sensor`` (N,) names, ``value`` (N,), and,
    of sensors that say how good each reading is, ``sigma`` (N,): its standard deviation, NaN for
    the sensor's own.

    Rows may come in any order; NaN and infinite entries are kept and counted when the log is run,
    not dropped in silence. ``time`` may also be timestamps (datetime64, seconds since 1970) or
    durations (timedelta64): their nanoseconds are kept. ``names``: the sensors' names in order of
    first appearance; ``code`` (N,): index into them; ``stamp`` (N,) [ns]. All arrays are read-only
    copies. Raises ShapeError if the lengths differ, ConfigError for an empty log or for entries
    that are no numbers.
    """

    def __init__(
        self,
        time: npt.ArrayLike,
        sensor: Sequence[str] | npt.NDArray[Any],
        value: npt.ArrayLike,
        sigma: npt.ArrayLike | None = None,
    ) -> None:
        self.time, self.stamp = _times(time)
        self.value = _column("value", value)
        self.sigma = None if sigma is None else _column("sigma", sigma)
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
        if self.sigma is not None and len(self.sigma) != len(self.time):
            raise ShapeError(
                f"log, sigma: expected shape ({len(self.time)},), got {self.sigma.shape}"
            )
        if len(self.time) == 0:
            raise ConfigError("log: expected at least one measurement, got an empty log")
        self.names, self.code = _factorised(labels)
        self._codes: dict[tuple[str, ...], npt.NDArray[np.int32]] = {}

    def __len__(self) -> int:
        return len(self.time)

    def __repr__(self) -> str:
        return f"Log({len(self)} measurements of {', '.join(self.names)})"

    @property
    def sensor(self) -> npt.NDArray[np.str_]:
        """Name of the sensor of every row (N,)."""
        return np.asarray(self.names, dtype=np.str_)[self.code]

    def with_value(self, value: npt.ArrayLike) -> Log:
        """The same measurements, to the nanosecond, with other values (N,)."""
        column = _column("value", value)
        if len(column) != len(self):
            raise ShapeError(f"log, value: expected shape ({len(self)},), got {column.shape}")
        other = copy.copy(self)
        other.value = column
        return other

    def factors(self, names: Sequence[str], sigma: Sequence[float]) -> FloatArray | None:
        """Of every row (N,), its standard deviation in units of its sensor's, ``sigma`` of the
        sensors ``names``; None where no row says anything else. The engine counts rows with a
        factor outside 1e-6 to 1e6 as not finite."""
        if self.sigma is None:
            return None
        own = np.append(np.asarray(sigma, dtype=np.float64), 1.0)[self.codes_for(names)]
        return np.where(np.isnan(self.sigma), 1.0, self.sigma / own)

    def codes_for(self, names: Sequence[str]) -> npt.NDArray[np.int32]:
        """Index of every row's sensor in ``names`` (N,), −1 where it is not among them."""
        wanted = tuple(names)
        if wanted not in self._codes:  # a log is often run more than once
            table = [wanted.index(n) if n in wanted else -1 for n in self.names]
            self._codes = {wanted: read_only(np.array(table, np.int32)[self.code])}
        return self._codes[wanted]


def _column(name: str, values: npt.ArrayLike) -> FloatArray:
    try:
        column = np.array(values, dtype=np.float64, order="C")
    except (TypeError, ValueError):
        raise ConfigError(f"log, {name}: expected numbers, got {values!r}") from None
    if column.ndim != 1:
        raise ShapeError(f"log, {name}: expected shape (any,), got {column.shape}")
    return read_only(column)


def _factorised(labels: npt.NDArray[Any]) -> tuple[tuple[str, ...], npt.NDArray[np.int32]]:
    found, first, code = np.unique(labels, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty(len(order), np.int32)
    rank[order] = np.arange(len(order), dtype=np.int32)
    return tuple(str(found[i]) for i in order), read_only(rank[code.reshape(-1)])


def _times(values: npt.ArrayLike) -> tuple[FloatArray, npt.NDArray[np.int64]]:
    """Seconds and the nearest nanosecond, as the engine rounds; NO_TIME where there is none."""
    try:
        given = np.asarray(values)
    except ValueError:  # rows of several lengths
        given = _column("time", values)
    if given.dtype.kind not in "mM":
        time = _column("time", given)
        good = np.abs(time) <= _core.MAX_SECONDS  # false for NaN
        stamp = np.where(good, to_nanoseconds_array(np.where(good, time, 0.0)), NO_TIME)
        return time, read_only(stamp)
    kind = given.dtype.kind
    whole = given.astype(f"{kind}8[s]").astype(np.int64)  # NaT is the smallest integer
    good = (whole >= -_core.MAX_SECONDS) & (whole < _core.MAX_SECONDS)
    exact = np.where(good, given, np.zeros((), given.dtype)).astype(f"{kind}8[ns]")
    stamp = np.where(good, exact.astype(np.int64), NO_TIME)
    time = np.where(good, stamp / NANOSECONDS, np.where(np.isnat(given), np.nan, whole))
    return _column("time", time), read_only(stamp)
