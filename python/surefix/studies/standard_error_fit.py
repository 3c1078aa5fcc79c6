"""Which regular schedule of the sensors would give the standard errors of Bilenne's table 2?

They do not depend on the measured values, only on the schedule, the covariance at the start and
the jerk. The paper states neither schedule nor start. The search fits, it reproduces nothing: a
handful of numbers is chosen to match eight.
"""

from __future__ import annotations

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

Axes = list[tuple[float, float]]

# Ranges searched: log σ of speed (m/s) and of acceleration (m/s²) at the start, their correlation.
START: Axes = [(np.log(0.2), np.log(2.0)), (np.log(0.1), np.log(2.0)), (-0.2, 0.98)]
JERKS = (np.log(0.04), np.log(2.0))


def search(target: FloatArray, T0: float) -> dict[str, Any]:
    """The best fits to standard errors ``target`` (8,) [m/s] every ``T0`` [s]: with the stated
    jerk, and with the jerk free."""
    stated = (np.log(STATED_JERK), np.log(STATED_JERK))
    fits = {"jerk_as_stated": stated, "jerk_free": JERKS}
    return {
        "kind": "a fit, not a reproduction",
        **{name: _best(target, T0, [*START, jerk]) for name, jerk in fits.items()},
    }


def describe(fit: dict[str, Any]) -> list[str]:
    """The fits as lines of text."""
    lines = ["standard errors of the paper, fitted (not reproduced) with regular schedules:"]
    for name, text in (("jerk_as_stated", "jerk 0.08 as stated"), ("jerk_free", "jerk free")):
        best = fit[name]
        lines.append(
            f"  {text}: within {best['max_relative_deviation']:.1%}; jerk {best['jerk']:.2f}, wheel "
            f"{best['wheel_hz']} Hz, radar {best['radar_hz']} Hz, GPS 1 Hz, first at "
            f"{best['gps_at_s']} s"
        )
    return lines


def standard_errors(
    parameters: FloatArray, wheel_hz: int, radar_hz: int, gps_at: float, T0: float, steps: int
) -> FloatArray:
    """Standard error of the speed at T₀, 2 T₀, … (steps, C) for candidates ``parameters`` (4, C):
    log σ of speed, log σ of acceleration, correlation, log jerk."""
    s, a, c, jerk = parameters
    vv, va, aa = np.exp(2 * s), c * np.exp(s + a), np.exp(2 * a)
    q = np.exp(2 * jerk)
    now, out = 0.0, []
    for time, variance in _schedule(wheel_hz, radar_hz, gps_at, T0, steps):
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


def _schedule(
    wheel_hz: int, radar_hz: int, gps_at: float, T0: float, steps: int
) -> list[tuple[float, float]]:
    """(time [s], variance) in order; an infinite variance stands for an estimate."""
    end = steps * T0 + 1e-9
    events = [(T0 * (k + 1), np.inf) for k in range(steps)]
    for rate, variance in ((wheel_hz, VARIANCES[0]), (radar_hz, VARIANCES[1])):
        events += [((i + 0.5) / rate, variance) for i in range(int(end * rate))]
    events += [(t, VARIANCES[2]) for t in (gps_at, gps_at + 1.0) if t <= end]
    return sorted((round(time, 9), variance) for time, variance in events)


def _best(target: FloatArray, T0: float, ranges: Axes) -> dict[str, Any]:
    """Over all schedules: a grid over ``ranges``, narrowed around its best point each round."""
    best: dict[str, Any] = {"max_relative_deviation": np.inf}
    for wheel in WHEEL_HZ:
        for radar in RADAR_HZ:
            for gps_at in GPS_AT:
                near = ranges
                for _ in range(ROUNDS):
                    axes = [np.linspace(*r, POINTS if r[1] > r[0] else 1) for r in near]
                    grid = np.array([axis.reshape(-1) for axis in np.meshgrid(*axes)])
                    errors = standard_errors(grid, wheel, radar, gps_at, T0, len(target))
                    worst = np.abs(errors / target[:, None] - 1).max(axis=0)
                    i = int(worst.argmin())
                    if worst[i] < best["max_relative_deviation"]:
                        best = _found(
                            grid[:, i], errors[:, i], float(worst[i]), wheel, radar, gps_at
                        )
                    near = [_narrowed(r, float(x)) for r, x in zip(near, grid[:, i], strict=True)]
    return best


def _narrowed(old: tuple[float, float], centre: float) -> tuple[float, float]:
    half = 1.5 * (old[1] - old[0]) / (POINTS - 1)
    return centre - half, centre + half


def _found(
    at: FloatArray, errors: FloatArray, worst: float, wheel: int, radar: int, gps_at: float
) -> dict[str, Any]:
    return {
        "max_relative_deviation": worst,
        "standard_error": errors.tolist(),
        "wheel_hz": wheel,
        "radar_hz": radar,
        "gps_hz": 1,
        "gps_at_s": gps_at,
        "start_sigma_speed": float(np.exp(at[0])),
        "start_sigma_acceleration": float(np.exp(at[1])),
        "start_correlation": float(at[2]),
        "jerk": float(np.exp(at[3])),
    }
