"""Sigalov & Oshman, example 2: γ is not Markov, but Lemma 2 holds.

The nonlinear filters take (29) for the transitions of γ, as in the paper; the augmented ones have
the chain that (α, β) is: α = 0, then α = 1 with β = 1 and with β = 0.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import surefix as sf
from surefix.studies import sigalov_comparison
from surefix.studies.sigalov_examples import (
    DELTA,
    DELTA_TRANSITION,
    RUNS,
    Example,
    chain,
    p,
)

q = 0.7  # Pr(α = 1)


def make_example() -> Example:
    """β is drawn anew in every step."""
    p11 = (1 - q * (1 - p**2)) / (1 - q * (1 - p))  # (29)
    beta = np.array([[p, 1 - p], [p, 1 - p]])
    gamma = np.array([[p11, 1 - p11], [p, 1 - p]])
    channels = np.array([[1.0, 0.0, 0.0], [0.0, p, 1 - p], [0.0, p, 1 - p]])
    exact = sf.ModeChain(
        [(level, delta) for level in (1, 1, 0) for delta in DELTA],
        np.kron(channels, DELTA_TRANSITION),
        initial=np.kron([1 - q, q * p, q * (1 - p)], DELTA_TRANSITION[0]),
    )
    said = "the linear filter is superior to the one-step filter"
    return Example("sigalov-example-2", q, beta, chain(gamma), exact, p11, said)


def run(out: Path, progress: Callable[[int, int], None], runs: int = RUNS) -> dict[str, Any]:
    """Writes table.csv, study.json and figure.png; returns the numbers."""
    return sigalov_comparison.compare(make_example(), out, progress, runs)
