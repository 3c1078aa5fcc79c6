"""When estimates are made: at a rate, at given times, or at every measurement."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from surefix import _core
from surefix.core import checks
from surefix.core.checks import NANOSECONDS, to_nanoseconds, to_nanoseconds_array
from surefix.core.sensor import Sensor
from surefix.errors import ConfigError
from surefix.log import NO_TIME, Log

Nanoseconds = npt.NDArray[np.int64]


def estimation_times(
    log: Log,
    sensors: Sequence[Sensor],
    start: float | None,
    rate: float | None,
    times: npt.ArrayLike | None,
) -> Nanoseconds | None:
    """Estimation times [ns]; None for one at every measurement."""
    if rate is not None and times is not None:
        raise ConfigError("run: expected rate or times, got both")
    if rate is not None:
        first, last = _span(log, sensors)
        begin = first if start is None else to_nanoseconds(start)
        return _at_rate(begin, max(last, begin), checks.positive("rate", rate))
    if times is None:
        return None
    wanted = checks.array("times", times, (None,))
    if len(wanted) == 0 or np.abs(wanted).max() > _core.MAX_SECONDS:
        raise ConfigError(f"times: expected 1 or more times, got {wanted!r}")
    return to_nanoseconds_array(wanted)


def _at_rate(start: int, last: int, hertz: float) -> Nanoseconds:
    """start + k/rate, k = 1, 2, …, until the last measurement is used."""
    count = int(np.ceil((last - start) * hertz / NANOSECONDS))
    if start + round(count * NANOSECONDS / hertz) < last:
        count += 1  # the product above may round down onto a whole number
    steps = np.arange(1, max(count, 1) + 1)
    offsets: Nanoseconds = np.rint(steps * (NANOSECONDS / hertz)).astype(np.int64)
    return offsets + start


def _span(log: Log, sensors: Sequence[Sensor]) -> tuple[int, int]:
    """First and last validity [ns] of the rows that can be used."""
    code = log.codes_for([sensor.name for sensor in sensors])
    usable = (code >= 0) & (log.stamp != NO_TIME) & np.isfinite(log.value)
    if not usable.any():
        raise ConfigError("log: no row has a known sensor, a finite time and a finite value")
    latency = np.array(
        [checks.nanoseconds("latency", sensor.latency) for sensor in sensors], dtype=np.int64
    )
    valid = log.stamp[usable] - latency[code[usable]]
    return int(valid.min()), int(valid.max())
