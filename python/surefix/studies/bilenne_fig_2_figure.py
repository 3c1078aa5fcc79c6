"""The figure of the study ``bilenne-fig-2``."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

import surefix as sf
from surefix.plots import style
from surefix.studies import scenarios
from surefix.studies.journey_panel import draw_journey, shade

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DRIFT, DECELERATION = 1.0, 1.0  # m/s², of the journeys that are drawn
LINES = {
    "10Hz outage": ("outage alone, 10 Hz", "#0072B2", "o-"),
    "1.25Hz outage": ("outage alone, 1.25 Hz", "#0072B2", "o--"),
    "1.25Hz anew": ("drawn anew, 1.25 Hz", "#E69F00", "s--"),
    "10Hz carried": ("carried, 10 Hz", "#009E73", "D-"),
    "1.25Hz carried": ("carried, 1.25 Hz", "#009E73", "D--"),
}
WINDOW = (8.0, 24.0)  # s


def make_figure(
    numbers: dict[str, Any], make_filter: Callable[[str], sf.RobustFilter], seed: int
) -> Figure:
    """Four filters on one failure, the last one on a train that brakes, and all in numbers."""
    figure = style.new_figure(12.0, 11.0)
    axes = figure.subplots(3, 2)
    failing = scenarios.collapse(seed, DRIFT)
    what = f"radars 1 and 3 collapse, 2 drifts by {DRIFT:g} m/s²"
    for panel, rate, kind, name in (
        (axes[0, 0], 10.0, "outage", "Outage alone (paper), 10 Hz"),
        (axes[0, 1], 1.25, "outage", "Outage alone (paper), 1.25 Hz"),
        (axes[1, 0], 1.25, "carried", "Drift carried, 1.25 Hz"),
    ):
        result = make_filter(kind).run(failing.log, times=failing.times(rate))
        draw_journey(panel, result, failing.truth, WINDOW)
        panel.set_title(f"{name}: {what}", fontsize=10)
    brakes = scenarios.braking(seed, DECELERATION, 1.0)
    result = make_filter("carried").run(brakes.log, times=brakes.times(1.25))
    draw_journey(axes[1, 1], result, brakes.truth, WINDOW)
    axes[1, 1].set_title(
        f"Drift carried, 1.25 Hz: healthy radars, the train brakes by {DECELERATION:g} m/s²",
        fontsize=10,
    )
    for panel in (axes[0, 0], axes[0, 1], axes[1, 0]):
        panel.set_ylim(20.0, 36.0)
        shade(panel, (scenarios.FAIL, scenarios.HEAL), "all three radars fail")
    axes[1, 1].set_ylim(20.0, 36.0)
    shade(axes[1, 1], (scenarios.FAIL, scenarios.FAIL + scenarios.BRAKING), "the train brakes")
    _summary(axes[2, 0], numbers, "misleading_fraction", 100.0)
    axes[2, 0].set_ylabel("share of the time (%)")
    axes[2, 0].set_title("Limits claimed at 1 − 1e-11 that miss the truth", fontsize=10)
    _summary(axes[2, 1], numbers, "mean_width", 1.0)
    axes[2, 1].set_ylabel("mean width (m/s)")
    axes[2, 1].set_title("What it costs: width of the limits", fontsize=10)
    axes[2, 1].set_ylim(0.0, None)
    axes[2, 0].legend(frameon=False, fontsize=9)
    style.legend_above(figure, axes[0, 1], None)
    return figure


def _summary(axes: Axes, numbers: dict[str, Any], what: str, factor: float) -> None:
    drifts = sorted(
        float(key.split()[-1])
        for key in numbers
        if key.startswith("1.25Hz carried ") and len(key.split()) == 3
    )
    for name, (label, colour, line) in LINES.items():
        values = np.array([numbers[f"{name} {drift:g}"][what] for drift in drifts], dtype=float)
        axes.plot(drifts, factor * values, line, color=colour, label=label, markersize=5)
    axes.set_xlabel("drift of radar 2 (m/s²)")
    style.clean(axes)
