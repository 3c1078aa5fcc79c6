"""What can be wrong with a sensor: the fault modes of the robust filter.

Some modes only change the noise covariance Upsilon of the sensor's measurements. The others remove
the sensor's rows from the composite step and give every removed value a density of its own, which
does not depend on the state. Every density has the unit 1 / unit of the reading.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import log, pi
from typing import TypeAlias

import numpy as np

from oracle.step import Array


@dataclass(frozen=True)
class Healthy:
    """z = h x + v, v of variance sigma^2."""


@dataclass(frozen=True)
class Outage:
    """Bilenne 2004, sec. 4: the value is uniform on an interval that surely contains it."""

    span: float  # length of the interval, in the unit of the reading


@dataclass(frozen=True)
class Noisy:
    """Sigalov & Oshman, delta = C: cov(v | delta) = R delta."""

    factor: float  # C, of the variance


@dataclass(frozen=True)
class Interrupted:
    """Sigalov & Oshman, gamma = 0: the value is noise about zero, of variance R delta."""

    factor: float = 1.0  # delta, of the variance


@dataclass(frozen=True)
class Frozen:
    """The reading repeats itself with probability 1 - epsilon, and is uniform otherwise."""

    epsilon: float
    resolution: float  # q, the step between neighbouring readings
    span: float


@dataclass(frozen=True)
class Drifting:
    """A bias of unknown size, b(tau) = b(0) + bq w(tau), w a Wiener process."""

    b0: float  # standard deviation of b(0), in the unit of the reading
    bq: float  # in that unit per sqrt(s)
    factor: float = 1.0  # of the variance of v, which may be larger while the sensor drifts


Mode: TypeAlias = Healthy | Outage | Noisy | Interrupted | Frozen | Drifting


@dataclass(frozen=True)
class FallibleSensor:
    """A sensor that reads z = h x + v, and the modes that it can be in; mode 0 must be healthy."""

    h: Array  # (n,)
    sigma: float  # standard deviation of v
    modes: tuple[Mode, ...] = (Healthy(),)
    prior: tuple[float, ...] = (1.0,)  # probability of each mode, where no chain gives it

    def __post_init__(self) -> None:
        if not isinstance(self.modes[0], Healthy) or len(self.modes) != len(self.prior):
            raise ValueError("mode 0 must be healthy, and every mode needs a prior")


def log_removed(mode: Mode, sigma: float, value: float, last: float | None) -> float | None:
    """Log-density of a value that ``mode`` removes from the step; None if the value stays.

    ``last`` is the sensor's value before this one, in this step or earlier; None if there is none.
    """
    if isinstance(mode, Outage):
        return -log(mode.span)
    if isinstance(mode, Interrupted):
        variance = mode.factor * sigma**2
        return -0.5 * (log(2.0 * pi * variance) + value**2 / variance)
    if isinstance(mode, Frozen):
        if last is not None and abs(value - last) <= 0.5 * mode.resolution:
            return log((1.0 - mode.epsilon) / mode.resolution)
        return log(mode.epsilon / mode.span) if mode.epsilon > 0.0 else -np.inf
    return None


def noise_variance(mode: Mode, sigma: float) -> float:
    """Variance of the white noise of a measurement that stays in the step."""
    return sigma**2 * (mode.factor if isinstance(mode, Noisy | Drifting) else 1.0)
