"""Proposals for runs in which gross errors are likelier, and what the weighted runs say.

A run is drawn from one of several proposals, in fixed numbers. Its weight is its density under the
scenario over that under the mixture of all proposals (the balance heuristic): exact, because the
modes of a simulated run are known, and bounded, because the scenario is a proposal too.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist
from typing import Any

import numpy as np
import numpy.typing as npt

from surefix.core.checks import FloatArray
from surefix.intervals import CONFIDENCE
from surefix.validation.scenario import Modes, Scenario, raised, stationary, transition

LEAST_EFFECTIVE = 10.0  # runs; an estimate from fewer is none


@dataclass(frozen=True)
class Proposal:
    """Of ``share`` of the runs: in the last ``steps`` faults begin ``factor`` times as often, and
    the shared drift ``shared`` times (0: as the others)."""

    share: float
    steps: int = 0
    factor: float = 1.0
    shared: float = 0.0


PROPOSALS = (
    Proposal(0.35),
    Proposal(0.2, steps=4, factor=10.0),
    Proposal(0.15, steps=5, factor=20.0),
    Proposal(0.15, steps=7, factor=10.0),
    Proposal(0.15, steps=10, factor=4.0),
)
FEW_PROPOSALS = (Proposal(0.8), Proposal(0.2, steps=6, factor=6.0))
SHARED_PROPOSALS = (
    Proposal(0.4),
    Proposal(0.2, steps=3, shared=30.0),
    Proposal(0.2, steps=5, shared=20.0),
    Proposal(0.2, steps=10, shared=10.0),
)


def counts(proposals: Sequence[Proposal], runs: int) -> list[int]:
    """Runs of each proposal; at least two."""
    found = [max(2, round(p.share * runs)) for p in proposals]
    found[0] = max(2, found[0] + runs - sum(found))
    return found


def chains(scenario: Scenario, proposal: Proposal) -> list[list[FloatArray]]:
    """Of each chain, its distribution in the first step (1, M) and the transition of every later
    one (M, M)."""
    tables = []
    for c, G in enumerate(scenario.chains()):
        shared = c == len(scenario.sensors) and proposal.shared > 0
        factor = proposal.shared if shared else proposal.factor
        usual = transition(G, scenario.step)
        more = transition(raised(G, factor), scenario.step)
        first = scenario.steps - proposal.steps
        start = stationary(G)
        table = [(start @ more if first <= 0 else start)[None, :]]
        table += [more if k >= first else usual for k in range(1, scenario.steps)]
        tables.append(table)
    return tables


def draw_modes(
    tables: Sequence[Sequence[FloatArray]], runs: int, random: np.random.RandomState
) -> Modes:
    """Modes (runs, chains, T)."""
    modes = np.zeros((runs, len(tables), len(tables[0])), dtype=np.int8)
    for c, table in enumerate(tables):
        now = np.zeros(runs, dtype=np.int64)
        for k, probability in enumerate(table):
            edges = np.cumsum(probability[now], axis=1)
            edges[:, -1] = 1.0
            now = (random.uniform(size=(runs, 1)) >= edges).sum(axis=1)
            modes[:, c, k] = now
    return modes


def effective(weighted: FloatArray) -> float:
    """(Σy)² / Σy²: how many equal runs would say as much."""
    total = float((weighted**2).sum())
    return float(weighted.sum()) ** 2 / total if total > 0 else 0.0


def estimate(weighted: FloatArray, weight: FloatArray, runs: Sequence[int]) -> dict[str, Any]:
    """Mean of one number per run, weighted (N,), with its 95 % interval, from the spread within
    each proposal's runs. The interval is one of the logarithm: a risk is positive and skewed.

    The weights are known to have the mean one: what they miss of it is taken out by regression.
    ``effective`` below ``LEAST_EFFECTIVE``: the runs do not say it, and there is no number.
    """
    n_eff = effective(weighted)
    found: dict[str, Any] = {"effective": n_eff, "measured": None, "low": None, "high": None}
    if n_eff < LEAST_EFFECTIVE:
        return found
    within = np.repeat(np.arange(len(runs)), runs)
    w, y = _centred(weight, within), _centred(weighted, within)
    square = float(w @ w)
    slope = float(w @ y) / square if square > 0 else 0.0
    mean = float(weighted.mean()) - slope * (float(weight.mean()) - 1)
    off = math.sqrt(float(((y - slope * w) ** 2).sum())) / len(weighted)
    if mean <= 0:
        return found
    spread = math.exp(NormalDist().inv_cdf((1 + CONFIDENCE) / 2) * off / mean)
    found.update(measured=mean, low=mean / spread, high=mean * spread)
    return found


def error(value: FloatArray, runs: Sequence[int]) -> float:
    """Standard error of a mean of one number per run."""
    spread = _centred(value, np.repeat(np.arange(len(runs)), runs))
    return math.sqrt(float((spread**2).sum())) / len(value)


def _centred(value: FloatArray, within: npt.NDArray[np.int64]) -> FloatArray:
    """``value`` less its mean within each proposal's runs."""
    centres = np.bincount(within, value) / np.bincount(within)
    return value - centres[within]
