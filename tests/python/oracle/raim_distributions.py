"""The noncentral chi-squared distribution with forty digits (Lacresse et al. 2005, eq. 6).

chi2(k, lambda) is a mixture: of chi2(k + 2 j), j Poisson with mean lambda / 2. Both tails are sums
of positive terms, so nothing cancels in either, however small it is:

    P(X > x)  = sum_j  e^(-lambda/2) (lambda/2)^j / j!  Q(k/2 + j, x/2),   P(X <= x) with P for Q
    Q(a + 1, y) = Q(a, y) + y^a e^-y / Gamma(a + 1),   P(a, y) = P(a + 1, y) + the same

``upper_in_doubles`` and its like are the same sums by NumPy, to about 1e-12: for searches.

The density is the paper's own form, f_0(z) e^(-lambda/2) 0F1(k/2; lambda z/4), which has no part in
the tails: that its integral is one of them tests both.
"""

from __future__ import annotations

from functools import cache
from typing import Any, TypeAlias

import numpy as np
from mpmath import mp  # type: ignore[import-untyped]
from scipy import special, stats

from oracle.step import Array

DIGITS = 40
# Once terms at least halve, so many more make the rest smaller than 1e-33 of the sum.
HALVINGS = 110

Number: TypeAlias = float | int
Digits: TypeAlias = Any  # mpmath's mpf, whose library has no types


def upper(x: Number | Digits, degrees: Number, noncentrality: Number | Digits) -> Digits:
    """P(X > x)."""
    with mp.workdps(DIGITS):
        y, a, mean = mp.mpf(x) / 2, mp.mpf(degrees) / 2, mp.mpf(noncentrality) / 2
        if y == 0:
            return mp.mpf(1)
        tail = mp.gammainc(a, y, mp.inf, regularized=True)
        step = mp.exp(a * mp.log(y) - y - mp.loggamma(a + 1))
        weight, total = mp.exp(-mean), mp.mpf(0)
        for j in range(_terms(y, a, mean)):
            total += weight * tail
            weight *= mean / (j + 1)
            tail += step
            step *= y / (a + j + 1)
        return total


def lower(x: Number | Digits, degrees: Number, noncentrality: Number | Digits) -> Digits:
    """P(X <= x)."""
    with mp.workdps(DIGITS):
        y, a, mean = mp.mpf(x) / 2, mp.mpf(degrees) / 2, mp.mpf(noncentrality) / 2
        if y == 0:
            return mp.mpf(0)
        J = _terms(y, a, mean)
        cdf = mp.gammainc(a + J, 0, y, regularized=True)
        step = mp.exp((a + J) * mp.log(y) - y - mp.loggamma(a + J + 1))
        if mean == 0:
            return mp.gammainc(a, 0, y, regularized=True)
        weight, total = mp.exp(J * mp.log(mean) - mean - mp.loggamma(J + 1)), mp.mpf(0)
        for j in range(J, -1, -1):
            total += weight * cdf
            weight *= j / mean
            step *= (a + j) / y
            cdf += step
        return total


def _terms(y: Digits, a: Digits, mean: Digits) -> int:
    """Q(a + 1, y) <= Q(a, y) (1 + y/a), so a term is at most mean / (j + 1) (1 + y / (a + j)) times
    the one before (with P for Q the second factor is below one)."""
    j = 1
    while mean * (a + j + y) > (j + 1) * (a + j) / 2:
        j += 1 + j // 8
    return j + HALVINGS


def upper_in_doubles(x: float, degrees: float, noncentrality: float) -> float:
    j, weight = _poisson(noncentrality / 2.0)
    return float(weight @ special.gammaincc(degrees / 2.0 + j, x / 2.0))


def lower_in_doubles(x: float, degrees: float, noncentrality: float) -> float:
    j, weight = _poisson(noncentrality / 2.0)
    return float(weight @ special.gammainc(degrees / 2.0 + j, x / 2.0))


def _poisson(mean: float) -> tuple[Array, Array]:
    """Numbers and their weights, from none to far beyond the mean."""
    j = np.arange(np.ceil(mean + 12.0 * np.sqrt(mean)) + 60.0)
    exponent = special.xlogy(j, mean) - mean - special.gammaln(j + 1.0)
    return j, np.exp(np.maximum(exponent, -700.0))


def density(x: Number, degrees: Number, noncentrality: Number) -> Digits:
    """f_lambda(x), the formula below the paper's (6)."""
    with mp.workdps(DIGITS):
        z, a, mean = mp.mpf(x), mp.mpf(degrees) / 2, mp.mpf(noncentrality) / 2
        central = z ** (a - 1) * mp.exp(-z / 2) / (2**a * mp.gamma(a))
        return central * mp.exp(-mean) * mp.hyp0f1(a, mean * z / 2)


@cache
def threshold(false_alarm: Number, degrees: Number) -> Digits:
    """h with P(chi2(k) > h) = alpha (the paper's equation below (5))."""
    with mp.workdps(DIGITS):
        log_alpha, a = mp.log(mp.mpf(false_alarm)), mp.mpf(degrees) / 2
        near = float(stats.chi2.isf(false_alarm, degrees))  # where to start, no more

        def excess(h: Digits) -> Digits:
            return mp.log(mp.gammainc(a, h / 2, mp.inf, regularized=True)) - log_alpha

        return mp.findroot(excess, (mp.mpf(near), mp.mpf(near) * (1 + mp.mpf(10) ** -9)))


def power(noncentrality: Number | Digits, degrees: Number, false_alarm: Number) -> Digits:
    """beta(lambda) of the paper's (6)."""
    return upper(threshold(false_alarm, degrees), degrees, noncentrality)


def missed(noncentrality: Number | Digits, degrees: Number, false_alarm: Number) -> Digits:
    """1 - beta(lambda), with all its digits where it is small."""
    return lower(threshold(false_alarm, degrees), degrees, noncentrality)


@cache
def noncentrality(missed_: Number, degrees: Number, false_alarm: Number) -> Digits:
    """lambda with P(chi2(k, lambda) <= h(alpha)) = missed_, zero where even the central one is
    missed less often. In the root of lambda, the logarithm of the tail is nearly a parabola."""
    with mp.workdps(DIGITS):
        h, wanted = threshold(false_alarm, degrees), mp.log(mp.mpf(missed_))

        def excess(root: Digits) -> Digits:
            return mp.log(lower(h, degrees, root**2)) - wanted

        if excess(mp.mpf(0)) <= 0:
            return mp.mpf(0)
        far = mp.mpf(1)
        while excess(far) > 0:
            far *= 2
        root = mp.findroot(excess, (far / 2 if far > 1 else mp.mpf(0), far), solver="anderson",
                           tol=mp.mpf(10) ** -60)  # fmt: skip
        return root**2
