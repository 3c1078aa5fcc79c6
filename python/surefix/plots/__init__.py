"""Figures of results, with matplotlib: no pyplot, no state, no display needed."""

from surefix.plots.panels import Event
from surefix.plots.result import plot_result

__all__ = ["Event", "plot_result"]
