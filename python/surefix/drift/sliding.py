"""Slow faults in the last measurements, while a filter runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from surefix import _core
from surefix.core import checks
from surefix.core.checks import NANOSECONDS, FloatArray
from surefix.core.sensor import make_system
from surefix.desync.filter import DesyncFilter, Status
from surefix.desync.stream import check_estimated, factor_of, float_or_nan
from surefix.drift.direction import weights
from surefix.drift.onset import OnsetDetector
from surefix.errors import ConfigError
from surefix.log import NO_TIME

MAX_WINDOW = 1_000_000


@dataclass(frozen=True, eq=False)
class SlidingFinding:
    """What one search found in the window; every number is None where it is 'undetectable'."""

    detector: OnsetDetector
    status: str
    onset: float | None = None
    amplitude: float | FloatArray | None = None
    amplitude_se: float | FloatArray | None = None
    drop: float | None = None
    p_bound: float | None = None
    """Number of onsets times P(χ² > drop): what the risk of a false alarm is at most."""
    onsets: int = 0


@dataclass(frozen=True, eq=False)
class SlidingEstimate:
    """The filter's estimate, and what each search found in the window at its time."""

    time: float
    x: FloatArray
    P: FloatArray
    findings: tuple[SlidingFinding, ...]

    @property
    def detected(self) -> tuple[SlidingFinding, ...]:
        return tuple(found for found in self.findings if found.status == "detected")


class SlidingDetector:
    """A filter with a window of its last ``window`` measurements, searched at every estimate.

    ``filter``: a DesyncFilter, whose settings are taken and which itself stays as it is.
    ``detectors``: OnsetDetectors, each with its profile, channel (by default every sensor in turn)
    and false alarm, which here is per estimate and kept by the bound over all onsets of the window.
    Memory is fixed, a step takes O(window). What is found is what an OnsetDetector finds in the
    same measurements, for a filter that begins with the belief before the first of them; only, a
    sensor that repeats one value is not told apart here (``Frozen`` of a ``RobustFilter`` is for
    that).

    Raises ShapeError or ConfigError for what does not fit.
    """

    def __init__(
        self, filter: DesyncFilter, window: int, detectors: Sequence[OnsetDetector]
    ) -> None:
        self.filter = checks.instance("filter", filter, DesyncFilter)
        self.window = checks.whole("window", window, 2, MAX_WINDOW)
        given = checks.tuple_of("detectors", detectors, OnsetDetector, "OnsetDetectors")
        self.names = tuple(sensor.name for sensor in filter.sensors)
        self.sensors = filter.sensors
        self.detectors = tuple(one for each in given for one in _of_each(each, self.names))
        if not 1 <= len(self.detectors) <= _core.MAX_SEARCHES:
            raise ConfigError(
                f"detectors: expected 1 to {_core.MAX_SEARCHES} searches, one for each channel, "
                f"got {len(self.detectors)}"
            )
        start = None if filter.start is None else checks.nanoseconds("start", filter.start)
        self._engine = _core.SlidingEngine(
            make_system(filter.model, filter.sensors), filter.x0, filter.P0, start,
            filter.capacity, self.window,
        )  # fmt: skip
        self._pushes = 0
        for one in self.detectors:
            direction = weights(one.channel, self.names)
            status = self._engine.add(one.profile.engine, direction, one.false_alarm)
            if status != "ok":
                raise ConfigError(f"detectors: refused by the engine: {status}")

    def push(self, time: float, sensor: str, value: float, sigma: float | None = None) -> Status:
        """As ``DesyncFilter.push``."""
        known = isinstance(sensor, str) and sensor in self.names
        index = self.names.index(sensor) if known else -1
        seconds = float_or_nan(time)
        inside = abs(seconds) <= _core.MAX_SECONDS
        stamp = checks.to_nanoseconds(seconds) if inside else NO_TIME
        factor = factor_of(sigma, self.sensors, index)
        status = Status(self._engine.push(stamp, index, float_or_nan(value), self._pushes, factor))
        self._pushes += 1
        return status

    def estimate(self, time: float) -> SlidingEstimate:
        """Ends the step at ``time`` [s] and looks through the window; as ``DesyncFilter.estimate``,
        with the same errors."""
        stamp = checks.nanoseconds("time", time)
        status, x, P = self._engine.estimate(stamp)
        check_estimated(status, time)
        found = tuple(self._look(k, one) for k, one in enumerate(self.detectors))
        return SlidingEstimate(stamp / NANOSECONDS, x, P, found)

    @property
    def measurements(self) -> int:
        """How many are in the window."""
        return self._engine.size

    def clear(self) -> None:
        """Empties the window, as after a repair."""
        self._engine.clear()

    def _look(self, k: int, detector: OnsetDetector) -> SlidingFinding:
        status, onset, drop, p_bound, amplitude, deviation, onsets = self._engine.look(k)
        if status == "undetectable":
            return SlidingFinding(detector, status)
        alone = len(amplitude) == 1
        return SlidingFinding(
            detector, status, onset / NANOSECONDS,
            float(amplitude[0]) if alone else amplitude,
            float(deviation[0]) if alone else deviation, drop, p_bound, onsets,
        )  # fmt: skip


def _of_each(detector: OnsetDetector, names: Sequence[str]) -> list[OnsetDetector]:
    """The detector, or one for each sensor if it has no channel."""
    if detector.ends:
        raise ConfigError("detectors: expected none with ends=True in a window")
    if detector.channel is not None:
        return [detector]
    return [
        OnsetDetector(detector.profile, name, detector.false_alarm, False, detector.samples)
        for name in names
    ]
