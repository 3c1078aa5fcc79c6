"""Faults of one satellite: which are critical, and how often they are missed (section 5.2-5.3).

Every quantity is computed from what it means: a bias is put on a satellite and projected, the
critical one is where the probability of leaving the interval is the risk over the fault's own.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.optimize import brentq
from scipy.stats import norm

from oracle import raim_distributions as distributions
from oracle.raim_solution import Epoch, Solution, Track, linearised, solve
from oracle.step import Array

HARMLESS = 1e-9  # of the largest effect on the mileage: rounding


@dataclass(frozen=True)
class Demand:
    length: float  # L [m]
    false_alarm: float = 1e-5
    missed: float = 1e-3
    risk: float = 1e-7
    fault_probability: float = 1e-4
    max_faults: int = 2
    max_excluded: int = 2


def outside(half: float, shift: float, sigma: float) -> float:
    """P(|X| > half), X normal about ``shift``."""
    return float(norm.sf((half - shift) / sigma) + norm.sf((half + shift) / sigma))


def critical_shift(half: float, sigma: float, demand: Demand) -> float:
    """mu*, the largest shift of the estimate with P(outside) p_f <= p_r; zero where there is none,
    infinite where no shift is too large."""
    allowed = demand.risk / demand.fault_probability
    if allowed >= 1.0:
        return np.inf
    if outside(half, 0.0, sigma) >= allowed:
        return 0.0

    def excess(shift: float) -> float:
        return float(np.log(max(outside(half, shift, sigma), 1e-250) / allowed))

    return float(brentq(excess, 0.0, half + 40.0 * sigma, xtol=1e-13 * sigma, rtol=1e-14))


def critical_biases(s: Solution, sigma: Array, half: float, demand: Demand) -> Array:
    """v_i* (n,) [m], infinite of a satellite that does not move the estimate."""
    effect = np.abs(s.gain) / sigma  # of a metre on the pseudorange
    moves = effect * sigma > HARMLESS * np.abs(s.gain).max()
    shift = critical_shift(half, s.sigma, demand)
    return np.array([shift / e if m else np.inf for e, m in zip(effect, moves, strict=True)])


def noncentralities(s: Solution, sigma: Array, bias: Array) -> Array:
    """Of each satellite's bias alone, (n,): what is left of it beside J, by least squares."""
    found = []
    for i, v in enumerate(bias):
        e = np.zeros(len(sigma))
        e[i] = v / sigma[i] if np.isfinite(v) else 0.0
        rest = e - s.J @ np.linalg.lstsq(s.J, e, rcond=None)[0]
        found.append(float(rest @ rest) if np.isfinite(v) else np.inf)
    return np.array(found)


def missed(noncentrality: Array, loss: float, degrees: int, false_alarm: float) -> Array:
    """P(no alarm) where the error of linearisation hides ``loss`` of the root of lambda, (n,). Less
    than Q(root lambda - root h), for one component is enough; below Q(14) = 1e-44 it is zero."""
    out = np.zeros(len(noncentrality))
    h = float(distributions.threshold(false_alarm, degrees))
    most = np.sqrt(h) + 14.0
    for i, lam in enumerate(noncentrality):
        root = max(np.sqrt(lam) - loss, 0.0)
        if root < most:
            out[i] = distributions.lower_in_doubles(h, degrees, root**2)
    return out


def at_half_length(
    s: Solution, sigma: Array, half: float, loss: float, demand: Demand
) -> tuple[Array, float]:
    """p(i, v_i*) (n,) and max_i of it with the loss, which is p* + e_1, of an interval +- half."""
    lam = noncentralities(s, sigma, critical_biases(s, sigma, half, demand))
    p = missed(lam, 0.0, s.degrees, demand.false_alarm)
    least = np.array([lam.min()])  # what is missed falls with lambda
    return p, float(missed(least, loss, s.degrees, demand.false_alarm)[0])


def protection_chi2(
    s: Solution, sigma: Array, loss: float, demand: Demand, bend: float = 0.0
) -> float:
    """The smallest half-width at which p* + e_1 <= gamma and the fault-free risk is met; infinite
    where there is none. ``bend``: by how many sigma the track's bend may move the estimate."""
    off = bend * s.sigma
    least = float(s.sigma * norm.isf(demand.risk / 2))

    def excess(half: float) -> float:
        lam = noncentralities(s, sigma, critical_biases(s, sigma, half, demand))
        worst = missed(np.array([lam.min()]), loss, s.degrees, demand.false_alarm)[0]
        return float(np.log(max(worst, 1e-250) / demand.missed))

    if excess(least) <= 0.0:
        return least + off
    far = 2.0 * least
    while excess(far) > 0.0:
        far *= 2.0
        if far > 1e6 * least:
            return np.inf
    return float(brentq(excess, far / 2.0, far, xtol=1e-9, rtol=1e-12)) + off


def linearisation_error(
    epoch: Epoch, track: Track, s: Solution, mileage: Array, whole: bool = False
) -> Array:
    """||W E(l)|| (k,) at mileages (k,), E(l) = d(l) - d(l^) - d'(l^) (l - l^), by projection;
    ``whole``: of E without what the clocks take, the mileage's direction in it."""
    clocks = s.J[:, 1:]
    rest = np.eye(epoch.n) - (clocks @ np.linalg.pinv(clocks) if whole else s.hat)
    here, slope = linearised(epoch, track, s.along)[0], s.J[:, 0]
    found = []
    for at in mileage:
        moved = here - linearised(epoch, track, float(at))[0] - slope * (at - s.along)
        found.append(np.linalg.norm(rest @ moved))
    return np.array(found)


def exclusions(
    epoch: Epoch, track: Track, near: float, demand: Demand
) -> Iterable[tuple[int, tuple[int, ...], float, float, int]]:
    """For every number k left out: k, the best set, its statistic, the second best's, the degrees;
    every set's own solution iterated to its end."""
    for k in range(1, demand.max_excluded + 1):
        tried = []
        for gone in combinations(range(epoch.n), k):
            rest = epoch.without(gone)
            if rest.n > 1 + len(rest.systems):
                s = solve(rest, track, near)
                tried.append((s.statistic, gone, s.degrees))
        tried.sort()
        if tried:
            second = tried[1][0] if len(tried) > 1 else np.inf
            yield k, tried[0][1], tried[0][0], second, tried[0][2]
