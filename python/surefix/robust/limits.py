"""Alert limits of a Gaussian mixture, exact on the mixture (Bilenne 2004, section 3.2)."""

from __future__ import annotations

import numpy.typing as npt

from surefix import _core
from surefix.core import checks
from surefix.errors import ConfigError

SIDES = {"both": 0, "lower": 1, "upper": 2}


def alert_limits(
    weights: npt.ArrayLike,
    means: npt.ArrayLike,
    sigmas: npt.ArrayLike,
    risk: float,
    *,
    sides: str = "both",
) -> tuple[float, float]:
    """(lower, upper) that the mixture lies outside of with probability ``risk``.

    ``weights`` (K,) ≥ 0 with a sum of one, ``means`` (K,), ``sigmas`` (K,) ≥ 0. ``sides``: 'both',
    half the risk on each; 'lower' or 'upper', all of it on one and no limit on the other. Right to
    1e-9 down to a risk of 1e-15 and far below: tails are never a difference from one.

    Raises ConfigError for a risk outside (0, 1) and weights that are no distribution.
    """
    w = checks.array("weights", weights, (None,))
    m = checks.array("means", means, (len(w),))
    s = checks.array("sigmas", sigmas, (len(w),))
    if (w < 0).any() or not abs(w.sum() - 1) <= 1e-9:
        raise ConfigError(f"weights: expected numbers >= 0 that sum to 1, got sum {float(w.sum())}")
    if (s < 0).any():
        raise ConfigError(f"sigmas: expected numbers >= 0, got {float(s.min())}")
    return _core.alert_limits(w, m, s, checks.probability("risk", risk), side("sides", sides))


def side(name: str, sides: str) -> int:
    """The engine's number for a side."""
    return SIDES[checks.one_of(name, sides, tuple(SIDES))]


def risk_per_estimate(risk_per_hour: float, exposures_per_hour: float) -> float:
    """The risk of one estimate that leaves ``risk_per_hour`` over an hour.

    ``exposures_per_hour``: number of effective independent exposures, at most the number of
    estimates; estimates closer together than the errors are correlated are one exposure. All the
    estimates of an hour is the safe choice: 1e-9 per hour at 10 Hz is 2.8e-14 per estimate.
    """
    risk = checks.probability("risk_per_hour", risk_per_hour)
    return _core.per_estimate(risk, checks.positive("exposures_per_hour", exposures_per_hour))
