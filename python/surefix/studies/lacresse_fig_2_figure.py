"""The figure of the study ``lacresse-fig-2``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from surefix.plots import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LINES = {
    "": (style.PALETTE[0], "-", "the paper: least squares, ‖W‖‖R‖"),
    "_tight": (style.PALETTE[4], "--", "least squares, max ‖W E(l)‖"),
    "_minimax": (style.PALETTE[2], "-", "minimax, ‖W‖‖R‖"),
    "_minimax_tight": (style.PALETTE[1], "--", "minimax, max ‖W E(l)‖"),
}
DRAWN = {"e1": "missed, any fault", "e2": "false alarms"}
STYLES = ("-", "--", ":")  # of the skies
LEAST = 1e-7  # e₁ shown by the choice of λ


def make_figure(numbers: dict[str, Any]) -> Figure:
    """e₁ and e₂ of the first sky, the choices of λ, and all skies."""
    figure = style.new_figure(12.0, 8.6)
    axes = figure.subplots(2, 2)
    first = numbers["skies"][0]
    _bounds(axes[0, 0], numbers, "e1", numbers["missed"], "γ")
    axes[0, 0].plot(
        numbers["v"], numbers["e1_satellite"], "-", color=style.ALARM, lw=1.6,
        label="one satellite, the real worst",
    )  # fmt: skip
    axes[0, 0].set_title(f"e₁ at λ of a fault missed with γ, {_named(first)}", fontsize=10)
    _bounds(axes[0, 1], numbers, "e2", numbers["false_alarm"], "α")
    axes[0, 1].set_title(f"e₂ at λ = 0, {_named(first)}", fontsize=10)
    for panel in axes[0]:
        panel.legend(frameon=False, fontsize=8, loc="lower right")
    _choices(axes[1, 0], numbers)
    _skies(axes[1, 1], numbers)
    for panel in axes.flat:
        panel.set_xlabel("amplitude v of the track (m)")
        panel.set_xlim(numbers["v"][0], numbers["v"][-1])
        style.clean(panel)
    return figure


def _named(sky: dict[str, Any]) -> str:
    return f"{sky['name']}, n = {sky['satellites']}"


def _bounds(axes: Axes, numbers: dict[str, Any], name: str, limit: float, letter: str) -> None:
    for suffix, (colour, line, label) in LINES.items():
        axes.loglog(numbers["v"], numbers[name + suffix], line, color=colour, lw=1.8, label=label)
    rows = [r for r in numbers["skies"][0]["measured"] if r["what"] == DRAWN[name]]
    value = np.array([r["value"] for r in rows]) - limit
    axes.errorbar(
        [r["v"] for r in rows], value, yerr=[3 * r["error"] for r in rows], fmt="o", ms=4,
        color=style.ESTIMATE, capsize=3, label="drawn at the worst l, ± 3 standard errors",
    )  # fmt: skip
    axes.axhline(limit, color="#555555", lw=1, ls=":")
    axes.text(numbers["v"][0] * 1.1, limit * 1.2, f"{letter} = {limit:g}", fontsize=9)
    axes.set_ylim(limit / 300, 2)


def _choices(axes: Axes, numbers: dict[str, Any]) -> None:
    for name, colour, label in (
        ("e1_supremum", style.PALETTE[3], "largest at any λ (section 4.3)"),
        ("e1", style.PALETTE[0], "λ of a fault missed with γ"),
        ("e1_lambda_max", style.PALETTE[2], "λ_max = max ‖W v*‖² (section 5.3)"),
    ):
        for k, sky in enumerate(numbers["skies"]):
            values = np.array(sky["indicators"][name])
            axes.loglog(
                sky["indicators"]["v"], np.where(values > 0, values, np.nan), STYLES[k],
                color=colour, lw=1.6, label=label if k == 0 else "_",
            )  # fmt: skip
    for sky, line in zip(numbers["skies"], STYLES, strict=False):
        axes.plot([], [], line, color="#555555", lw=1.6, label=_named(sky))
    axes.axhline(numbers["missed"], color="#555555", lw=1, ls=":")
    axes.set_ylim(LEAST, 2)
    axes.set_title("e₁ of the paper's bound, by the choice of λ", fontsize=10)
    axes.legend(frameon=False, fontsize=8, loc="lower right", bbox_to_anchor=(0.97, 0.0))


def _skies(axes: Axes, numbers: dict[str, Any]) -> None:
    for sky, colour in zip(numbers["skies"], style.PALETTE, strict=False):
        of = sky["indicators"]
        e1 = np.array(of["e1_tight"]) / numbers["missed"]
        e2 = np.array(of["e2_tight"]) / numbers["false_alarm"]
        axes.loglog(of["v"], e1, "-", color=colour, lw=1.8, label=f"e₁/γ, {_named(sky)}")
        axes.loglog(of["v"], e2, "--", color=colour, lw=1.8, label=f"e₂/α, {_named(sky)}")
    axes.axhline(1.0, color="#555555", lw=1, ls=":")
    axes.set_ylim(0.03, 3e3)
    axes.set_title("Least squares, max ‖W E(l)‖", fontsize=10)
    axes.legend(frameon=False, fontsize=8, loc="upper left")
