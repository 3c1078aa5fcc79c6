"""Sigalov & Oshman, example 1: γ is a Markov chain that rather changes than stays.

Lemma 2 does not hold: the linear filter is not the optimal linear one here.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from surefix.studies import sigalov_comparison
from surefix.studies.sigalov_examples import RUNS, Example, chain, p


def make_example() -> Example:
    """q = 1: γ is β."""
    beta = np.array([[1 - p, p], [p, 1 - p]])
    said = "the linear filter's errors are higher than the one-step filter's"
    return Example("sigalov-example-1", 1.0, beta, chain(beta), None, 1 - p, said)


def run(out: Path, progress: Callable[[int, int], None], runs: int = RUNS) -> dict[str, Any]:
    """Writes table.csv, study.json and figure.png; returns the numbers."""
    return sigalov_comparison.compare(make_example(), out, progress, runs)
