"""The interval of Clopper and Pearson for a share."""

from __future__ import annotations

import math

CONFIDENCE = 0.95


def share_interval(found: int, runs: int, confidence: float = CONFIDENCE) -> tuple[float, float]:
    """(low, high), two-sided, of the share that ``found`` of ``runs`` come from."""
    rest = (1 - confidence) / 2
    low = 0.0 if found == 0 else _solve(found - 1, runs, 1 - rest)
    high = 1.0 if found == runs else _solve(found, runs, rest)
    return low, high


def _solve(found: int, runs: int, level: float) -> float:
    """p with P(at most ``found`` of ``runs``) = ``level``."""
    low, high = 0.0, 1.0
    for _ in range(60):
        p = (low + high) / 2
        low, high = (p, high) if _at_most(found, runs, p) > level else (low, p)
    return (low + high) / 2


def _at_most(found: int, runs: int, p: float) -> float:
    if p <= 0 or p >= 1:
        return 1.0 if p <= 0 else 0.0
    total = 0.0
    for k in range(found + 1):
        choose = math.lgamma(runs + 1) - math.lgamma(k + 1) - math.lgamma(runs - k + 1)
        total += math.exp(choose + k * math.log(p) + (runs - k) * math.log1p(-p))
    return total
