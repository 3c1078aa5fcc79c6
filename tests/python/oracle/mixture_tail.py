"""Tails of a mixture of Gaussians and its alert limits, with fifty decimal digits.

In ``decimal``, as ``precise`` is: nothing cancels, nothing underflows, and no library has to be
believed. The normal tail Q(x) comes from the series of the distribution function near zero and from
Laplace's continued fraction further out (Abramowitz & Stegun 26.2.11 and 26.2.14).
"""

from __future__ import annotations

from collections.abc import Sequence
from decimal import Decimal, localcontext
from math import ceil, inf

from oracle.precise import DIGITS, TWO_PI

GUARD = 10  # digits more while computing


def normal_tail(x: Decimal) -> Decimal:
    """Q(x), the probability that a standard normal variable is above x."""
    with localcontext() as context:
        context.prec = DIGITS + GUARD
        if x < 0:
            return 1 - normal_tail(-x)
        density = (-x * x / 2).exp() / TWO_PI.sqrt()
        if x < 4:
            term, total, k = x, x, 1
            while term > total * Decimal(10) ** -context.prec:
                k += 2
                term *= x * x / k
                total += term
            return Decimal("0.5") - density * total
        fraction = x
        for k in range(ceil((5 * context.prec / float(x)) ** 2 / 8) + 20, 0, -1):
            fraction = x + k / fraction
        return density / fraction


def upper_tail(
    t: Decimal, weights: Sequence[float], means: Sequence[float], sigmas: Sequence[float]
) -> Decimal:
    """Probability of the mixture above t. A sigma of zero is a point, not above itself."""
    with localcontext() as context:
        context.prec = DIGITS + GUARD
        total = Decimal(0)
        for w, m, s in zip(weights, means, sigmas, strict=True):
            if s > 0.0:
                total += Decimal(w) * normal_tail((t - Decimal(m)) / Decimal(s))
            elif Decimal(m) > t:
                total += Decimal(w)
        return total


def alert_limits(
    weights: Sequence[float],
    means: Sequence[float],
    sigmas: Sequence[float],
    risk: float,
    lost: float = 0.0,
) -> tuple[float, float]:
    """Lower and upper limit, with a probability of (risk - lost) / 2 outside each.

    ``lost`` is the probability of components that are not in the list: they may lie anywhere. The
    weights are taken as they are. Where ``lost`` uses up the risk, nothing is excluded.
    """
    if risk <= lost:
        return -inf, inf
    with localcontext() as context:
        context.prec = DIGITS + GUARD
        share = (Decimal(risk) - Decimal(lost)) / 2
    mirrored = [-m for m in means]
    return -_upper(weights, mirrored, sigmas, share), _upper(weights, means, sigmas, share)


def _upper(
    weights: Sequence[float], means: Sequence[float], sigmas: Sequence[float], share: Decimal
) -> float:
    """The t above which the mixture has the probability ``share``, by bisection."""
    k = 1.0
    while normal_tail(Decimal(k)) >= share:
        k *= 2.0
    with localcontext() as context:
        context.prec = DIGITS + GUARD
        low = Decimal(min(m - k * s for m, s in zip(means, sigmas, strict=True)))
        high = Decimal(max(m + k * s for m, s in zip(means, sigmas, strict=True)))
        while high - low > Decimal(10) ** -DIGITS * max(abs(low), abs(high), Decimal(1)):
            middle = (low + high) / 2
            if upper_tail(middle, weights, means, sigmas) > share:
                low = middle
            else:
                high = middle
        return float(high)
