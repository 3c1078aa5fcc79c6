"""The figure of the studies ``sigalov-example-1`` and ``sigalov-example-2``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from surefix.core.checks import FloatArray
from surefix.plots import style
from surefix.studies.sigalov_examples import NAMES

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Those that practically coincide are drawn one inside the other.
LINES = {
    "linear": (style.PALETTE[1], "-", 1.5),
    "as_printed": (style.ALARM, "-", 1.5),
    "one_step": (style.PALETTE[0], "-", 3.0),
    "imm3": (style.PALETTE[2], "-", 2.0),
    "imm4": (style.PALETTE[3], "--", 1.2),
    "augmented": (style.PALETTE[4], "--", 1.2),
    "augmented_imm": ("#000000", ":", 1.5),
}


def make_figure(table: dict[str, FloatArray], numbers: dict[str, Any]) -> Figure:
    """Left: the paper's figure 1, errors over the genie's against time, with bands of 95 % around
    the solid lines. Right: over all the steps that count."""
    figure = style.new_figure(12.0, 5.0)
    left, right = figure.subplots(1, 2, width_ratios=(1.5, 1.0))
    names = [name for name in LINES if name in table]
    for name in names:
        colour, line, width = LINES[name]
        left.plot(table["step"], table[name], line, color=colour, lw=width, label=NAMES[name])
        if line == "-":
            band = table[f"{name}_low"], table[f"{name}_high"]
            left.fill_between(table["step"], *band, color=colour, alpha=0.18, linewidth=0)
    first, last = numbers["steps"]
    left.axvspan(first, last, color=style.SHADE, alpha=0.15, linewidth=0)
    left.set_xlabel("step")
    left.set_ylabel("mean squared error over the genie's")
    left.set_title(f"By step, {numbers['runs']:,} runs, bands of 95 % (solid lines)", fontsize=10)
    left.set_xlim(0, table["step"][-1])
    places = np.arange(len(names))[::-1]
    for name, place in zip(names, places, strict=True):
        value, (low, high) = numbers["mse_ratio"][name], numbers["mse_ratio_interval"][name]
        right.barh(place, value - 1, left=1, height=0.6, color=LINES[name][0], alpha=0.75)
        right.errorbar(
            value, place, xerr=[[value - low], [high - value]], color="black", capsize=4, lw=1.2
        )
        right.annotate(
            f"{value:.3f}", (high, place), xytext=(5, 0), textcoords="offset points", va="center",
            fontsize=9,
        )  # fmt: skip
    right.set_yticks(places, [NAMES[name] for name in names])
    right.set_xlim(1.0, 1.0 + 1.15 * (max(numbers["mse_ratio"].values()) - 1.0))
    right.set_xlabel("mean squared error over the genie's")
    right.set_title(f"Steps {first} to {last} (shaded), intervals of 95 %", fontsize=10)
    for axes in (left, right):
        style.clean(axes)
    style.legend_above(figure, left, f"The paper: {numbers['paper']}")
    return figure
