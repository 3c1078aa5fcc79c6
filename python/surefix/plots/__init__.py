"""Figures of results, with matplotlib: no pyplot, no state, no display needed."""

from surefix.plots.panels import Event
from surefix.plots.result import plot_result
from surefix.plots.robust import plot_robust

__all__ = ["Event", "plot_result", "plot_robust"]
