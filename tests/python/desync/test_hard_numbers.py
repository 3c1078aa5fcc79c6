"""The filter where numbers are at their worst, against sixty digits: noise from 1e-9 to 1e9, steps
from a nanosecond to a year, condition numbers to 1e12.

An error may be 1e-10 (standard deviations, correlations) or as large as eight times what rounding x
and P to doubles, and nothing else, has done so far (`docs/numerics.md`, `oracle.hard_speed`).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
import pytest
from numpy.typing import NDArray

import surefix as sf
from oracle.hard_speed import Drive, errors, estimates, sensitivity
from oracle.step import Array

Stamps: TypeAlias = NDArray[np.int64]  # [ns]

YEAR = 31_557_600 * 10**9  # [ns]
TIMES_SENSITIVITY = 8.0


def random_drive(seed: int, count: int = 60) -> tuple[Drive, Stamps]:
    """Every decade of noise and of duration as likely as the others; times in whole nanoseconds."""
    rng = np.random.default_rng(seed)
    gaps = np.exp(rng.uniform(0.0, np.log(YEAR), count)).astype(np.int64) + 1
    return drive(rng, gaps, 10.0 ** rng.uniform(-9.0, 9.0, count)), np.cumsum(gaps)


def hostile_drive(seed: int, count: int = 60) -> tuple[Drive, Stamps]:
    """A year, then readings of 1e-9 a microsecond apart, one of 1e9, and so on."""
    rng = np.random.default_rng(seed)
    gaps = np.resize([YEAR, 1_000, 2_000, 1, 10**9, 1_000], count).astype(np.int64)
    return drive(rng, gaps, np.resize([1e-9, 1e-9, 1e9, 1e-6, 1.0], count)), np.cumsum(gaps)


def conditioned_drive(seed: int, count: int = 60) -> tuple[Drive, Stamps]:
    """No process noise and a prior of twelve decades."""
    rng = np.random.default_rng(seed)
    gaps = rng.integers(10**6, 10**9, count)
    P0 = np.array([[1e12, 0.0], [0.0, 1.0]])
    return drive(rng, gaps, np.full(count, 1e-6), jerk=0.0, P0=P0), np.cumsum(gaps)


def drive(
    rng: np.random.Generator,
    gaps: Stamps,
    sigma: Array,
    jerk: float = 0.08,
    P0: Array | None = None,
) -> Drive:
    """A journey that the model could make."""
    duration: Array = np.asarray(gaps * 1e-9)
    v, a, value = 20.0, 0.1, []
    for h, s in zip(duration, sigma, strict=True):
        change = jerk * np.sqrt(h) * rng.normal()
        v, a = v + h * (a + change / 2), a + change
        value.append(v + s * rng.normal())
    x0 = np.array([20.0, 0.1])
    return Drive(jerk, x0, np.eye(2) if P0 is None else P0, duration, sigma, np.array(value))


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("make", [random_drive, hostile_drive, conditioned_drive])
def test_against_sixty_digits(make: Callable[[int], tuple[Drive, Stamps]], seed: int) -> None:
    given, stamps = make(seed)
    # The deviation of a reading may be 1e-6 to 1e6 of its sensor's: two sensors span all.
    sensors = [sf.Sensor("fine", 1e-5), sf.Sensor("coarse", 1e5)]
    which = np.where(given.sigma < 1.0, "fine", "coarse")
    log = sf.Log(stamps.astype("timedelta64[ns]"), which, given.value, given.sigma)
    filter = sf.DesyncFilter(
        sf.ConstantAcceleration(given.jerk), sensors, given.x0, given.P0, start=0.0
    )
    result = filter.run(log, noise=None)
    assert len(result.x) == len(given.value)
    x, P = estimates(given)
    of_x, of_P = errors(result.x, result.P, x, P)
    moved = sensitivity(given, range(5))
    for name, error, allowed in (("x", of_x, moved[0]), ("P", of_P, moved[1])):
        ratio = error / np.maximum(1e-10, TIMES_SENSITIVITY * allowed)
        worst = int(np.argmax(ratio))
        assert ratio[worst] <= 1.0, f"{name}: {error[worst]:.1e}, moved {allowed[worst]:.1e}"
