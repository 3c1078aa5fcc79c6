"""The constant-acceleration filter with sixty digits (mpmath): where doubles are asked for most.

State [speed, acceleration], white jerk of root density w, sensors of the speed. Times are whole
nanoseconds; nothing is rounded between the doubles that come in and those that go out.

A filter whose state is x and P in doubles rounds them at each prediction and each update. What that
alone does to the answer is found by moving each of them, there, by half a unit in the last place.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from mpmath import mp, mpf  # type: ignore[import-untyped]

from oracle.compare import covariance_error, state_error
from oracle.step import Array

DIGITS = 60
EPS = float(np.finfo(np.float64).eps)


@dataclass(frozen=True)
class Drive:
    """Readings of the speed, one after another."""

    jerk: float
    x0: Array  # (2,)
    P0: Array  # (2, 2)
    duration: Array  # (T,) [s] from the reading before
    sigma: Array  # (T,) [m/s]
    value: Array  # (T,) [m/s]


def estimates(drive: Drive, seed: int | None = None) -> tuple[Array, Array]:
    """x (T, 2) and P (T, 2, 2) after each reading; with a seed, moved as by rounding."""
    rng = np.random.default_rng(seed)

    def stored(*numbers: mpf) -> tuple[mpf, ...]:
        if seed is None:
            return numbers
        return tuple(n * (1 + mpf(EPS / 2) * int(rng.choice([-1, 1]))) for n in numbers)

    x, P = np.empty((len(drive.value), 2)), np.empty((len(drive.value), 2, 2))
    with mp.workdps(DIGITS):
        w = mpf(drive.jerk) ** 2
        v, a = (mpf(value) for value in drive.x0)
        p, c, d = mpf(drive.P0[0, 0]), mpf(drive.P0[0, 1]), mpf(drive.P0[1, 1])
        for k, (duration, sigma, value) in enumerate(
            zip(drive.duration, drive.sigma, drive.value, strict=True)
        ):
            h = mpf(duration)
            v += h * a
            p += 2 * h * c + h * h * d + w * h**3 / 3
            c += h * d + w * h * h / 2
            v, a, p, c, d = stored(v, a, p, c, d + w * h)
            S = p + mpf(sigma) ** 2
            innovation = mpf(value) - v
            v, a = v + p / S * innovation, a + c / S * innovation
            p, c, d = p * mpf(sigma) ** 2 / S, c * mpf(sigma) ** 2 / S, d - c * c / S
            v, a, p, c, d = stored(v, a, p, c, d)
            x[k] = float(v), float(a)
            P[k] = [[float(p), float(c)], [float(c), float(d)]]
    return x, P


def sensitivity(drive: Drive, seeds: range) -> tuple[Array, Array]:
    """Largest errors (T,) of x and of P up to each reading that rounding alone makes."""
    x, P = estimates(drive)
    moved = np.array([errors(*estimates(drive, seed), x, P) for seed in seeds])
    of_x, of_P = np.maximum.accumulate(moved.max(axis=0), axis=1)
    return of_x, of_P


def errors(x: Array, P: Array, true_x: Array, true_P: Array) -> tuple[Array, Array]:
    """Of x in standard deviations, of P in correlations, reading by reading."""
    of_x = [state_error(a, b, c) for a, b, c in zip(x, true_x, true_P, strict=True)]
    of_P = [covariance_error(a, b) for a, b in zip(P, true_P, strict=True)]
    return np.array(of_x), np.array(of_P)
