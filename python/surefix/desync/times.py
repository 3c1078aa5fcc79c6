"""When estimates are made: at a rate, at given times, or at every measurement."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from surefix import _core
from surefix.core import checks
from surefix.core.checks import NANOSECONDS, to_nanoseconds
from surefix.core.sensor import Sensor
from surefix.errors import ConfigError
from surefix.log import NO_TIME, Log

Nanoseconds = npt.NDArray[np.int64]

MAX_ESTIMATES = 20_000_000
"""Most estimates that a rate may ask for: some GiB, and more than any journey needs."""


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
    wanted = checks.nanoseconds_array("times", times)
    if len(wanted) == 0:
        raise ConfigError("times: expected 1 or more times, got none")
    return wanted


def _at_rate(start: int, last: int, hertz: float) -> Nanoseconds:
    """start + k/rate, k = 1, 2, …, until the last measurement is used."""
    period = NANOSECONDS / hertz
    wanted = (last - start) / period
    if wanted > MAX_ESTIMATES:
        raise ConfigError(
            f"rate: {hertz:g} a second from {start / NANOSECONDS:g} s to {last / NANOSECONDS:g} s "
            f"are {np.ceil(wanted):.12g} estimates, expected at most {MAX_ESTIMATES}; "
            "is the unit of time the second, is a stamp far off?"
        )
    count = max(int(np.ceil(wanted)), 1)
    if float(np.rint(count * period)) < last - start:
        count += 1  # the quotient above may round down onto a whole number
    end = start / NANOSECONDS + count / hertz
    if end > _core.MAX_SECONDS:
        raise ConfigError(
            f"rate: at {hertz:g} a second the last estimate would be at {end:g} s, "
            f"expected at most {_core.MAX_SECONDS:g} s"
        )
    offsets: Nanoseconds = np.rint(np.arange(1, count + 1) * period).astype(np.int64)
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
