"""Simulated journeys with failing speed sensors, in place of the recordings behind Bilenne's
figures 1 and 2, which are not public. Here the truth is known, so that limits can be judged."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

import surefix as sf
from surefix.core.checks import FloatArray

SPEED = 30.0  # m/s, of the train of figure 2 while it does not brake
RADARS = {"radar 1": 2.0, "radar 2": 1.0, "radar 3": 0.5}  # σ, m/s
FAIL, HEAL, END = 12.0, 16.0, 24.0  # s
STUCK_NOISE = 0.05  # m/s, of a radar that lost the ground
BRAKING = 6.0  # s, how long the brakes stay on

TUNNEL_SENSORS = {"wheel": 1.0, "radar": 2.0, "gps": 0.5}  # σ, m/s
TUNNEL_HZ = 10.0  # of wheel and radar
TUNNEL_TIME = (1575.0, 1640.0)  # s
ENTRY, EXIT = 1597.0, 1622.0  # s: the GPS repeats one value in between
OUTLIER_AT, OUTLIER = 1600.0, 103 / 3.6  # s, m/s: one value of the radar
SLOW, FAST, UNTIL_FAST = 15.0, 30.0, (1601.0, 1626.0)  # m/s, m/s, s

Truth = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True, eq=False)
class Scene:
    """A ``log`` of measurements from ``start`` to ``end`` [s]; ``truth``: speed [m/s] at a time."""

    log: sf.Log
    start: float
    end: float
    truth: Truth

    def times(self, rate: float) -> FloatArray:
        """Times of estimation [s] at ``rate`` [Hz]."""
        steps = int((self.end - self.start) * rate + 1e-9)
        return self.start + np.arange(1.0, steps + 1) / rate


def collapse(seed: int, drift: float) -> Scene:
    """Bilenne, fig. 2: the train keeps its speed. From ``FAIL`` on, radar 2 leaves it by ``drift``
    [m/s²] until ``HEAL``; radars 1 and 3 show at once where that will end."""
    random = np.random.RandomState(seed)

    def radar(name: str, sigma: float, time: FloatArray) -> FloatArray:
        since = time - FAIL if name == "radar 2" else HEAL - FAIL
        stuck = SPEED - drift * since + STUCK_NOISE * random.normal(size=len(time))
        failed = (time >= FAIL) & (time < HEAL)
        return np.where(failed, stuck, SPEED + sigma * random.normal(size=len(time)))

    return _radars(random, lambda time: np.full(len(time), SPEED), radar)


def common_drift(seed: int, drift: float) -> Scene:
    """The train keeps its speed, but from ``FAIL`` to ``HEAL`` all radars show one that brakes by
    ``drift`` [m/s²], with the noise of healthy radars."""
    random = np.random.RandomState(seed)

    def radar(name: str, sigma: float, time: FloatArray) -> FloatArray:
        since = np.where((time >= FAIL) & (time < HEAL), time - FAIL, 0.0)
        return SPEED - drift * since + sigma * random.normal(size=len(time))

    return _radars(random, lambda time: np.full(len(time), SPEED), radar)


def braking(seed: int, deceleration: float, ramp: float) -> Scene:
    """Healthy radars; the train brakes from ``FAIL`` on for ``BRAKING`` s with ``deceleration``
    [m/s²], which is reached after ``ramp`` s and ends at once."""
    random = np.random.RandomState(seed)

    def truth(time: FloatArray) -> FloatArray:
        return SPEED - deceleration * _applied(np.clip(time - FAIL, 0.0, BRAKING), ramp)

    return _radars(
        random, truth, lambda _, sigma, time: truth(time) + sigma * random.normal(size=len(time))
    )


def tunnel(seed: int, gps_rate: float) -> Scene:
    """Bilenne, fig. 1: the GPS (``gps_rate`` in Hz) repeats its last value while the train gathers
    speed in a tunnel, one value of the radar is 103 km/h, after the tunnel all is well again.

    At 30 m/s, 103 km/h would not stand out from noise of 2 m/s: the train is at 15 m/s then.
    """
    random = np.random.RandomState(seed)
    start, end = TUNNEL_TIME
    rows = []
    for name, sigma in TUNNEL_SENSORS.items():
        time = _regular(random, start, end, gps_rate if name == "gps" else TUNNEL_HZ)
        value = tunnel_speed(time) + sigma * random.normal(size=len(time))
        if name == "gps":
            inside = np.flatnonzero((time >= ENTRY) & (time < EXIT))
            value[inside] = value[inside[0] - 1]
        if name == "radar":
            value[np.argmin(np.abs(time - OUTLIER_AT))] = OUTLIER
        rows += [(float(t), name, float(v)) for t, v in zip(time, value, strict=True)]
    return Scene(_log(rows), start, end, tunnel_speed)


def tunnel_speed(time: FloatArray) -> FloatArray:
    """From ``SLOW`` to ``FAST``, the acceleration built up and down within 2 s each."""
    first, last = UNTIL_FAST
    gathered = _applied(np.maximum(time - first, 0.0), 2.0)
    gathered = gathered - _applied(np.maximum(time - last + 2.0, 0.0), 2.0)
    return SLOW + (FAST - SLOW) * gathered / (last - first - 2.0)


def _applied(time: FloatArray, ramp: float) -> FloatArray:
    """Speed after ``time`` >= 0 [s] of an acceleration that grows to 1 m/s² within ``ramp`` s."""
    building = np.minimum(time, ramp)
    grown: FloatArray = time - building + (building**2 / (2 * ramp) if ramp > 0 else 0.0)
    return grown


def _radars(
    random: np.random.RandomState,
    truth: Truth,
    radar: Callable[[str, float, FloatArray], FloatArray],
) -> Scene:
    rows = []
    for name, sigma in RADARS.items():
        time = _regular(random, 0.0, END, 10.0)
        value = radar(name, sigma, time)
        rows += [(float(t), name, float(v)) for t, v in zip(time, value, strict=True)]
    return Scene(_log(rows), 0.0, END, truth)


def _regular(random: np.random.RandomState, start: float, end: float, rate: float) -> FloatArray:
    """Times [s] at ``rate`` [Hz], from a random one within the first period."""
    first = start + random.uniform(0.0, 1.0) / rate
    return np.asarray(np.round(np.arange(first, end, 1 / rate), 9))


def _log(rows: list[tuple[float, str, float]]) -> sf.Log:
    time, sensor, value = zip(*sorted(rows), strict=True)
    return sf.Log(time, sensor, value)
