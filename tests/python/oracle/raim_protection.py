"""Protection by solution separation: every set of satellites left out, and solved without.

A fault J that is in the data moves the estimate by no more than the separation it may have without
an alarm, T_J, from an estimate that knows nothing of it:

    P(|l^ - l| > PL)
        <=  2 Q(PL / sigma - c) + sum_J p_f^|J| min(1, 2 Q((PL - T_J) / sigma_J - c))

An estimate is a projection of the data on a vector as long as its deviation: what the tangent
leaves of a track that bends, no longer than c once the clocks are out, moves it by c deviations.

sigma_J is the deviation of the estimate without J, infinite where there is none. Where J has no
part in the estimate (one satellite alone has its system's clock to itself), a fault of it is as
good as none, and the first term has it: no fault and harmless ones together are at most certain.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
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
    return width * np.array([w.separation_sigma for w in all_])


def harmless(s: Solution, w: Without) -> bool:
    return bool(w.separation_sigma < HARMLESS * s.sigma)


def budget(n: int, demand: Demand, excluded: int = 0) -> float:
    """The risk that one outcome may use, with n satellites in view. More than max_faults faulty
    ones are covered by nothing, whatever the outcome; of what they leave of the risk, half is for
    no exclusion, the other half in equal shares for every set that could have been taken out."""
    covered = demand.risk - float(binom.sf(demand.max_faults, n, demand.fault_probability))
    if demand.max_excluded == 0:
        return covered
    outcomes = sum(comb(n, k) for k in range(1, demand.max_excluded + 1))
    return covered / 2 if excluded == 0 else covered / 2 / outcomes


def outside(
    half: float, s: Solution, all_: list[Without], T: Array, demand: Demand, bend: float
) -> float:
    """The right side of the formula above."""
    prior = np.array([demand.fault_probability ** len(w.gone) for w in all_])
    sigma = np.array([w.sigma for w in all_])
    blind = np.isinf(sigma)
    beyond = np.where(blind, 0.0, half - T) / np.where(blind, 1.0, sigma) - bend
    harms = np.array([not harmless(s, w) for w in all_])
    terms = prior * np.minimum(2.0 * norm.sf(beyond), 1.0)
    return 2.0 * float(norm.sf(half / s.sigma - bend)) + float(terms[harms].sum())


@dataclass(frozen=True)
class Question:
    """How wide the interval about s must be; n satellites in view before any exclusion; ``bend``:
    c [sigma]."""

    s: Solution
    n: int
    demand: Demand
    bend: float = 0.0

    @property
    def budget(self) -> float:
        return budget(self.n, self.demand, self.n - len(self.s.r))

    @cached_property
    def sets(self) -> tuple[list[Without], Array]:
        """All, and T_J."""
        all_ = every_without(self.s, min(self.demand.max_faults, len(self.s.r)))
        return all_, separation_thresholds(all_, self.demand.false_alarm)

    def risk(self, half: float) -> float:
        return outside(half, self.s, *self.sets, self.demand, self.bend)

    @property
    def answer(self) -> float:
        """Half-width [m], infinite where none is wide enough."""
        finite = [t + (45.0 + self.bend) * w.sigma for w, t in zip(*self.sets, strict=True)
                  if np.isfinite(w.sigma)]  # fmt: skip
        far, left = max([(45.0 + self.bend) * self.s.sigma, *finite]), self.budget
        if left <= 0.0 or self.risk(far) >= left:
            return np.inf

        def excess(half: float) -> float:
            return float(np.log(max(self.risk(half), 1e-200) / left))

        return float(brentq(excess, 0.0, far, xtol=1e-10, rtol=1e-13))
