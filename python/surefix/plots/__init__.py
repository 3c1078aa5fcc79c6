"""Figures of results, with matplotlib: no pyplot, no state, no display needed."""

from surefix.plots.drift import draw_drift
from surefix.plots.panels import Event
from surefix.plots.raim import draw_availability, draw_raim, draw_stanford
from surefix.plots.result import plot_result
from surefix.plots.robust import plot_robust

__all__ = [
    "Event",
    "draw_availability",
    "draw_drift",
    "draw_raim",
    "draw_stanford",
    "plot_result",
    "plot_robust",
]
