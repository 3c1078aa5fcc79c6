"""Figures of results, with matplotlib: no pyplot, no state, no display needed."""

from surefix.plots.result import Event, plot_result

__all__ = ["Event", "plot_result"]
