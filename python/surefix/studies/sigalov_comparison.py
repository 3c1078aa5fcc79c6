"""What the studies ``sigalov-example-1`` and ``-2`` count, write and say."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

import surefix as sf
from surefix import tables
from surefix.core.checks import FloatArray
from surefix.studies import sigalov_examples as setup
from surefix.studies.sigalov_examples import NAMES, Example, Simulated
from surefix.studies.sigalov_figure import make_figure

FIRST, LAST = 10, 60  # steps that count
PAIRS = (
    ("one_step", "linear"),
    ("imm4", "one_step"),
    ("augmented", "one_step"),
    ("augmented_imm", "imm4"),
    ("as_printed", "linear"),
)

NOTE = (
    "The paper states no values. Ahead of the linear filter in both examples is the one-step "
    "filter with predicted moments in (9) and the merged covariance; with (7) and (9) taken "
    "literally it is so in example 1 only, as in the paper."
)


def compare(
    example: Example, out: Path, progress: Callable[[int, int], None], runs: int
) -> dict[str, Any]:
    """Simulates, filters, writes table.csv, study.json and figure.png; returns the numbers."""
    made = setup.simulate(example, runs)
    progress(1, 4)
    squared = setup.errors(example, made)
    progress(2, 4)
    table = _table(squared)
    numbers = {
        "study": example.name,
        "note": NOTE,
        "paper": example.said,
        "runs": runs,
        "steps": [FIRST, LAST],
        **_ratios(squared),
        "p11": _p11(example, made),
        "linear_condition": asdict(_condition(example)),
    }
    numbers["report"] = _report(numbers)
    progress(3, 4)
    tables.write_csv(out / "table.csv", table)
    tables.plain(out / "study.json", numbers)
    make_figure(table, numbers).savefig(out / "figure.png", dpi=150)
    progress(4, 4)
    return numbers


def ratio(over: FloatArray, under: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Ratio of the means over runs, (runs, ...) each, and the half width of its 95 % interval:
    runs are independent, and over − ratio · under has mean zero (delta method)."""
    mean = under.mean(axis=0)
    found = over.mean(axis=0) / mean
    deviation = (over - found * under).std(axis=0, ddof=1) / np.sqrt(len(over))
    return found, sf.two_sided_quantile(0.05) * deviation / mean


def _ratios(squared: dict[str, FloatArray]) -> dict[str, Any]:
    """Mean squared errors over the genie's, and differences of two such ratios, with intervals."""
    counted = {name: e[:, FIRST : LAST + 1].mean(axis=1) for name, e in squared.items()}
    late = {name: e[:, FIRST:].mean(axis=1) for name, e in squared.items()}
    names = [name for name in NAMES if name in squared]
    found = {name: ratio(counted[name], counted["genie"]) for name in names}
    gaps = {
        f"{one} - {other}": ratio(counted[one] - counted[other], counted["genie"])
        for one, other in PAIRS
        if one in squared
    }
    return {
        "genie_mse": float(counted["genie"].mean()),
        "mse_ratio": {name: float(value) for name, (value, _) in found.items()},
        "mse_ratio_interval": {name: _around(*pair) for name, pair in found.items()},
        "mse_ratio_all_steps": {
            name: float(ratio(late[name], late["genie"])[0]) for name in names
        },
        "difference": {name: float(value) for name, (value, _) in gaps.items()},
        "difference_interval": {name: _around(*pair) for name, pair in gaps.items()},
    }  # fmt: skip


def _table(squared: dict[str, FloatArray]) -> dict[str, FloatArray]:
    """By step, from 1 on (the genie knows x_0): the genie's error, and ratios with intervals."""
    genie = squared["genie"][:, 1:]
    steps = np.arange(1, genie.shape[1] + 1)
    table = {"step": steps, "genie_mse": genie.mean(axis=0)}
    for name in NAMES:
        if name in squared:
            value, half = ratio(squared[name][:, 1:], genie)
            table |= {name: value, f"{name}_low": value - half, f"{name}_high": value + half}
    return table


def _p11(example: Example, made: Simulated) -> dict[str, Any]:
    """Pr(γ_{k+1} = 1 | γ_k = 1): the paper's, and the share that was drawn."""
    before, both = made.gamma[:, :-1], made.gamma[:, :-1] & made.gamma[:, 1:]
    share, half = ratio(both.mean(axis=1), before.mean(axis=1))
    return {"paper": example.p11, "measured": float(share), "interval": _around(share, half)}


def _condition(example: Example) -> sf.LinearCondition:
    """Lemma 2 for the chain that the linear filter has."""
    engine = sf.LinearOptimalFilter(setup.system(), example.exact or example.switching)
    return engine.condition(setup.STEPS)


def _around(value: FloatArray, half: FloatArray) -> list[float]:
    return [float(value - half), float(value + half)]


def _report(numbers: dict[str, Any]) -> list[str]:
    lines = [
        f"mean squared error over the genie's ({numbers['genie_mse']:.4f}), {numbers['runs']:,} "
        f"runs, steps {FIRST} to {LAST}; intervals of 95 %"
    ]
    for name, value in numbers["mse_ratio"].items():
        low, high = numbers["mse_ratio_interval"][name]
        lines.append(f"{NAMES[name]:<36}{value:>8.3f}   {low:.3f} to {high:.3f}")
    lines += ["", "differences on the same runs"]
    for name, value in numbers["difference"].items():
        low, high = numbers["difference_interval"][name]
        lines.append(f"{name:<36}{value:>+8.4f}   {low:+.4f} to {high:+.4f}")
    p11, lemma = numbers["p11"], sf.LinearCondition(**numbers["linear_condition"])
    return [
        *lines,
        "",
        f"Pr(γ = 1 after γ = 1): {p11['paper']:.4f} by the paper, {p11['measured']:.4f} measured "
        f"({p11['interval'][0]:.4f} to {p11['interval'][1]:.4f})",
        str(lemma),
        f"the paper: {numbers['paper']}",
        numbers["note"],
    ]
