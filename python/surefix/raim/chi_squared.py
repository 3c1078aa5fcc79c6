"""What a χ² test detects (Lacresse, Grall & Nikiforov 2005, eqs. 5-6): each tail as such, never
1 - the other. Numbers, or arrays that broadcast; NaN outside the domains."""

from __future__ import annotations

import numpy.typing as npt

from surefix import _core
from surefix.core.distributions import Values


def threshold(false_alarm: npt.ArrayLike, degrees: npt.ArrayLike) -> Values:
    """h(α) with P(χ² > h) = ``false_alarm``."""
    return _core.chi_squared_threshold(false_alarm, degrees)


def power(
    noncentrality: npt.ArrayLike, degrees: npt.ArrayLike, false_alarm: npt.ArrayLike
) -> Values:
    """β(λ), the probability that a fault of that noncentrality is detected (6)."""
    h = _core.chi_squared_threshold(false_alarm, degrees)
    return _core.noncentral_chi_squared_tail(h, degrees, noncentrality)


def missed(
    noncentrality: npt.ArrayLike, degrees: npt.ArrayLike, false_alarm: npt.ArrayLike
) -> Values:
    """1 - β(λ), with its relative precision however small."""
    h = _core.chi_squared_threshold(false_alarm, degrees)
    return _core.noncentral_chi_squared_cdf(h, degrees, noncentrality)


def noncentrality(
    missed: npt.ArrayLike, degrees: npt.ArrayLike, false_alarm: npt.ArrayLike
) -> Values:
    """λ of the fault that is missed with that probability; 0 where nothing at all is missed as
    rarely."""
    h = _core.chi_squared_threshold(false_alarm, degrees)
    return _core.noncentrality_for(missed, h, degrees)
