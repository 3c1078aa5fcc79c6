"""Which schedule of the sensors would give the standard errors of Bilenne's table 2?

They do not depend on the measured values, only on the schedule, the covariance at the start and
the jerk. The paper states neither schedule nor start. The search fits, it reproduces nothing: a
handful of numbers is chosen to match eight. An irregular schedule, chosen step by step, is put
beside it: it fits better still, so that the eight numbers do not tell the schedule.
"""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from surefix.core.checks import FloatArray

WHEEL_HZ = (5, 10, 20, 40)
RADAR_HZ = (5, 10, 20)
GPS_AT = (0.1, 0.2)  # s after the start, then every second
STATED_JERK = 0.08  # m/s³/√Hz
VARIANCES = (1.0, 4.0, 0.25)  # m²/s², wheel, radar, GPS
ROUNDS = 4
POINTS = 9

Ranges = list[tuple[float, float]]
Events = list[tuple[float, float]]

# Ranges searched: log σ of speed (m/s) and of acceleration (m/s²) at the start, their correlation.
START: Ranges = [(np.log(0.2), np.log(2.0)), (np.log(0.1), np.log(2.0)), (-0.2, 0.98)]
JERKS = (np.log(0.04), np.log(2.0))


# Readings in every step, evenly spread: found by a beam search over 150,000 starts, with up to 4
# wheel and 2 radar readings a step. Many others come as near.
IRREGULAR_WHEEL = (3, 3, 4, 4, 4, 4, 2, 2)
IRREGULAR_RADAR = (0, 0, 1, 1, 0, 0, 1, 1)
IRREGULAR_GPS = (0.06, 1.12)  # s
IRREGULAR_START = (np.log(0.34226), np.log(0.75040), 0.05573)


def search(target: FloatArray, T0: float) -> dict[str, Any]:
    """The best fits to standard errors ``target`` (8,) [m/s] every ``T0`` [s]: with the stated
    jerk, with the jerk free, and with the stated jerk and irregular readings."""
    stated = (np.log(STATED_JERK), np.log(STATED_JERK))
    return {
        "kind": "a fit, not a reproduction",
        "jerk_as_stated": _best(target, T0, [*START, stated]),
        "jerk_free": _best(target, T0, [*START, JERKS]),
        "irregular": _irregular(target, T0),
    }


def describe(fit: dict[str, Any]) -> list[str]:
    """The fits as lines of text."""
    lines = ["standard errors of the paper, fitted (not reproduced):"]
    for name, text in (("jerk_as_stated", "jerk 0.08 as stated"), ("jerk_free", "jerk free")):
        best = fit[name]
        lines.append(
            f"  {text}, regular: within {best['max_relative_deviation']:.2%}; "
            f"jerk {best['jerk']:.2f}, wheel {best['wheel_hz']} Hz, radar {best['radar_hz']} Hz, "
            f"GPS 1 Hz, first at {best['gps_at_s']} s"
        )
    within = fit["irregular"]["max_relative_deviation"]
    lines.append(f"  jerk 0.08 as stated, irregular readings: within {within:.2%}")
    return lines


def standard_errors(parameters: FloatArray, events: Events) -> FloatArray:
    """Standard error of the speed at every estimate (T, C) for candidates ``parameters`` (4, C):
    log σ of speed, log σ of acceleration, their correlation, log jerk."""
    s, a, c, jerk = parameters
    vv, va, aa = np.exp(2 * s), c * np.exp(s + a), np.exp(2 * a)
    q = np.exp(2 * jerk)
    now, out = 0.0, []
    for time, variance in events:
        d = time - now
        vv, va, aa = (
            vv + d * (2 * va + d * aa) + q * d**3 / 3, va + d * aa + q * d**2 / 2, aa + q * d,
        )  # fmt: skip
        now = time
        if variance == np.inf:
            out.append(np.sqrt(vv))
        else:
            S = vv + variance
            vv, va, aa = vv * variance / S, va * variance / S, aa - va * va / S
    return np.array(out)


def _events(wheel: FloatArray, radar: FloatArray, gps: FloatArray, T0: float, steps: int) -> Events:
    """(time [s], variance) in order; an infinite variance stands for an estimate."""
    events = [(T0 * (k + 1), np.inf) for k in range(steps)]
    for times, variance in zip((wheel, radar, gps), VARIANCES, strict=True):
        events += [(float(t), variance) for t in times if t <= steps * T0 + 1e-9]
    return sorted((round(time, 9), variance) for time, variance in events)


def _irregular(target: FloatArray, T0: float) -> dict[str, Any]:
    def spread(counts: tuple[int, ...]) -> FloatArray:
        steps = [(k + (np.arange(n) + 0.5) / n) * T0 for k, n in enumerate(counts) if n]
        return np.concatenate(steps)

    wheel, radar = spread(IRREGULAR_WHEEL), spread(IRREGULAR_RADAR)
    events = _events(wheel, radar, np.array(IRREGULAR_GPS), T0, len(target))
    start = np.array([*IRREGULAR_START, np.log(STATED_JERK)])
    errors = standard_errors(start[:, None], events)[:, 0]
    worst = float(np.abs(errors / target - 1).max())
    return {
        **_found(start, errors, worst),
        "wheel_s": wheel.tolist(),
        "radar_s": radar.tolist(),
        "gps_s": list(IRREGULAR_GPS),
    }


def _best(target: FloatArray, T0: float, ranges: Ranges) -> dict[str, Any]:
    """Over all regular schedules: a grid over ``ranges``, narrowed around its best point."""
    best: dict[str, Any] = {"max_relative_deviation": np.inf}
    for wheel, radar, gps_at in itertools.product(WHEEL_HZ, RADAR_HZ, GPS_AT):
        end = len(target) * T0
        events = _events(
            (np.arange(end * wheel) + 0.5) / wheel, (np.arange(end * radar) + 0.5) / radar,
            np.array([gps_at, gps_at + 1.0]), T0, len(target),
        )  # fmt: skip
        near = ranges
        for _ in range(ROUNDS):
            axes = [np.linspace(*r, POINTS if r[1] > r[0] else 1) for r in near]
            grid = np.array([axis.reshape(-1) for axis in np.meshgrid(*axes)])
            errors = standard_errors(grid, events)
            worst = np.abs(errors / target[:, None] - 1).max(axis=0)
            i = int(worst.argmin())
            if worst[i] < best["max_relative_deviation"]:
                schedule = {"wheel_hz": wheel, "radar_hz": radar, "gps_hz": 1, "gps_at_s": gps_at}
                best = {**_found(grid[:, i], errors[:, i], float(worst[i])), **schedule}
            near = [
                _narrowed(*part) for part in zip(near, grid[:, i].tolist(), ranges, strict=True)
            ]
    return best


def _narrowed(
    old: tuple[float, float], centre: float, limits: tuple[float, float]
) -> tuple[float, float]:
    half = 1.5 * (old[1] - old[0]) / (POINTS - 1)
    return max(centre - half, limits[0]), min(centre + half, limits[1])


def _found(at: FloatArray, errors: FloatArray, worst: float) -> dict[str, Any]:
    return {
        "max_relative_deviation": worst,
        "standard_error": errors.tolist(),
        "start_sigma_speed": float(np.exp(at[0])),
        "start_sigma_acceleration": float(np.exp(at[1])),
        "start_correlation": float(at[2]),
        "jerk": float(np.exp(at[3])),
    }
