"""The figure of the study ``bilenne-table-2``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from surefix.core.checks import FloatArray
from surefix.plots import style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# One inside the other, so that all three show where they coincide.
MARKS = {"f0": ("o", 15, "#0072B2"), "f0/2": ("s", 9, "#E69F00"), "f0/4": ("D", 4, "#000000")}
NAMES = {"f0": "f₀ = 5 Hz", "f0/2": "f₀/2", "f0/4": "f₀/4"}


def make_figure(
    table: dict[str, FloatArray], T0: float, paper: Sequence[float], fit: dict[str, Any]
) -> Figure:
    """Left: the three estimators with their standard errors. Right: standard errors, the paper's
    and the fitted ones."""
    figure = style.new_figure(10.0, 4.2)
    left, right = figure.subplots(1, 2)
    time = T0 * table["T/T0"]
    for name, (marker, size, colour) in MARKS.items():
        left.errorbar(
            time, table[f"estimate {name}"], table[f"standard_error {name}"], fmt=marker,
            color=colour, markersize=size, markerfacecolor="white" if size > 4 else colour,
            markeredgewidth=1.6, elinewidth=size / 4, capsize=size / 2, label=NAMES[name],
        )  # fmt: skip
    left.set_title("Three rates of estimation, one estimate (simulated)", fontsize=10)
    left.set_ylabel("speed and standard error (m/s)")
    right.plot(time, paper, "k_", markersize=16, markeredgewidth=2.2, label="paper, table 2")
    for key, line, colour, label in (
        ("jerk_as_stated", ".--", "#D55E00", "regular readings, jerk {:.2f} as stated"),
        ("jerk_free", ".--", "#009E73", "regular readings, jerk free: {:.2f}"),
        ("irregular", ".:", "#0072B2", "irregular readings, jerk {:.2f}"),
    ):
        best = fit[key]
        within = f" (within {best['max_relative_deviation']:.2%})"
        right.plot(
            time, best["standard_error"], line, color=colour, markersize=8, linewidth=1,
            label=label.format(best["jerk"]) + within,
        )  # fmt: skip
    right.set_title("Standard errors of the paper, fitted (not reproduced)", fontsize=10)
    right.set_ylabel("standard error of speed (m/s)")
    low, high = min(paper), max(paper)
    right.set_ylim(low - 0.03, high + 0.7 * (high - low))
    for axes in (left, right):
        style.clean(axes)
        axes.set_xlabel("time (s)")
        axes.set_xticks(np.asarray(time))
        axes.legend(frameon=False, fontsize=9, loc="upper left")
    return figure
