"""Thresholds and tails: every number that decides something comes from a stated probability.

Outside their domains the distributions give NaN.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from surefix import _core
from surefix.core import checks
from surefix.core.checks import FloatArray

Values: TypeAlias = Any
"""A float of numbers, an array of arrays that broadcast."""


def two_sided_quantile(risk: float) -> float:
    """K with P(|X| > K) = ``risk`` for a standard normal X; ``risk`` from 1e-15 to below 1."""
    return float(_core.normal_two_sided(checks.probability("risk", risk)))


def chi_squared_p_value(sse: npt.ArrayLike, degrees: npt.ArrayLike) -> FloatArray:
    """P(X > sse) for χ² with ``degrees`` degrees of freedom; NaN where there are none."""
    k = np.asarray(degrees, dtype=np.float64)
    p: FloatArray = np.asarray(_core.chi_squared_tail(sse, np.maximum(k, 1.0)), dtype=np.float64)
    return np.where(k > 0, p, np.nan)


def noncentral_chi_squared_tail(
    x: npt.ArrayLike, degrees: npt.ArrayLike, noncentrality: npt.ArrayLike
) -> Values:
    """P(X > x) of the noncentral χ² distribution, with its relative precision however small. Beyond
    a noncentrality of 1e6, by a normal approximation."""
    return _core.noncentral_chi_squared_tail(x, degrees, noncentrality)


def noncentral_chi_squared_cdf(
    x: npt.ArrayLike, degrees: npt.ArrayLike, noncentrality: npt.ArrayLike
) -> Values:
    """P(X <= x), with its relative precision however small."""
    return _core.noncentral_chi_squared_cdf(x, degrees, noncentrality)


def noncentral_chi_squared_density(
    x: npt.ArrayLike, degrees: npt.ArrayLike, noncentrality: npt.ArrayLike
) -> Values:
    """The density at x."""
    return _core.noncentral_chi_squared_density(x, degrees, noncentrality)
