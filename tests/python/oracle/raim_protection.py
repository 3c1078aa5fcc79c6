"""Protection by solution separation: every set of satellites left out, and solved without.

A fault J that is in the data moves the estimate by no more than the separation it may have without
an alarm, T_J, from an estimate that knows nothing of it:

    P(|l^ - l| > PL)  <=  2 Q(PL / sigma) + sum_J p_f^|J| min(1, 2 Q((PL - T_J) / sigma_J))

sigma_J is the deviation of the estimate without J, infinite where there is none. Where J has no
part in the estimate (one satellite alone has its system's clock to itself), a fault of it is as good
as none, and the first term has it: what is there without faults and with harmless ones together is
no more than certain.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from math import comb

import numpy as np
from scipy.optimize import brentq
from scipy.stats import binom, norm

from oracle.raim_monitor import HARMLESS, Demand
from oracle.raim_solution import Solution, estimable
from oracle.step import Array


@dataclass(frozen=True)
class Without:
    """The solution without a set of satellites, by the linear model at the full one."""

    gone: tuple[int, ...]
    separation: float  # l^ - l^_J [m], nan where there is no solution
    sigma: float  # [m], infinite where there is none
    separation_sigma: float  # [m], of l^ - l^_J with no fault


def without(s: Solution, gone: tuple[int, ...]) -> Without:
    kept = np.array([i for i in range(len(s.r)) if i not in gone], dtype=int)
    J, r = s.J[kept], s.r[kept]
    J = J[:, [0, *(c for c in range(1, J.shape[1]) if np.any(J[:, c] != 0.0))]]
    if not estimable(J):
        return Without(gone, np.nan, np.inf, np.inf)
    inverse = np.linalg.pinv(J)
    # the difference of two linear estimates of the same noise, weight by weight
    weights = s.gain.copy()
    weights[kept] -= inverse[0]
    moved = np.linalg.lstsq(J, r, rcond=None)[0]
    return Without(gone, -float(moved[0]), float(np.linalg.norm(inverse[0])),
                   float(np.linalg.norm(weights)))  # fmt: skip


def every_without(s: Solution, most: int) -> list[Without]:
    n = len(s.r)
    sets = (gone for k in range(1, most + 1) for gone in combinations(range(n), k))
    return [without(s, gone) for gone in sets]


def separation_thresholds(all_: list[Without], false_alarm: float) -> Array:
    """T_J, the false alarm in equal shares."""
    width = float(norm.isf(false_alarm / (2 * len(all_))))
    return np.array([width * w.separation_sigma for w in all_])


def harmless(s: Solution, w: Without) -> bool:
    return bool(w.separation_sigma < HARMLESS * s.sigma)


def budget(n: int, demand: Demand, excluded: int = 0) -> float:
    """What of the risk is left for sets of at most max_faults, for one of the outcomes: half of it
    for no exclusion, half in equal shares for the sets that could have been taken out of n."""
    share = demand.risk
    if demand.max_excluded > 0:
        outcomes = sum(comb(n, k) for k in range(1, demand.max_excluded + 1))
        share = demand.risk / 2 if excluded == 0 else demand.risk / 2 / outcomes
    remaining = n - excluded
    return share - float(binom.sf(demand.max_faults, remaining, demand.fault_probability))


def outside(half: float, s: Solution, all_: list[Without], T: Array, demand: Demand) -> float:
    """The right side of the formula above."""
    total = 2.0 * float(norm.sf(half / s.sigma))
    for w, t in zip(all_, T, strict=True):
        if harmless(s, w):
            continue
        tail = 2.0 * float(norm.sf((half - t) / w.sigma)) if np.isfinite(w.sigma) else 1.0
        total += demand.fault_probability ** len(w.gone) * min(tail, 1.0)
    return total


def protection(s: Solution, n: int, demand: Demand) -> float:
    """Half-width [m], infinite where none is wide enough; n satellites before any exclusion."""
    all_ = every_without(s, min(demand.max_faults, len(s.r)))
    T = separation_thresholds(all_, demand.false_alarm)
    left = budget(n, demand, n - len(s.r))
    solvable = [t + 45.0 * w.sigma for w, t in zip(all_, T, strict=True) if np.isfinite(w.sigma)]
    far = max([45.0 * s.sigma, *solvable])
    if left <= 0.0 or outside(far, s, all_, T, demand) >= left:
        return np.inf

    def excess(half: float) -> float:
        return float(np.log(max(outside(half, s, all_, T, demand), 1e-200) / left))

    return float(brentq(excess, 0.0, far, xtol=1e-10, rtol=1e-13))
