"""Figures of a monitor along a track: over time, on the map, error against protection level."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy.typing as npt

from surefix.core import checks
from surefix.errors import ShapeError
from surefix.plots import raim_panels as panels
from surefix.plots import style
from surefix.plots.raim_map import draw_availability
from surefix.plots.stanford import draw_stanford
from surefix.raim.result import RaimResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["draw_availability", "draw_raim", "draw_stanford"]

HEIGHTS = 3.2, 2.4, 2.0, 1.0  # of position, levels, statistic, satellites


def draw_raim(
    result: RaimResult, truth: npt.ArrayLike | None = None, *, title: str | None = None
) -> Figure:
    """Over time: the position with its protection level on either side; the protection levels
    (those of positions that may be used), about the error if ``truth`` (T,), true mileages [m], is
    given; the statistic with its threshold; the satellites used and excluded. Epochs with an
    exclusion, an alarm or no answer are shaded."""
    known = None if truth is None else checks.floats("truth", truth)
    if known is not None and known.shape != result.time.shape:
        raise ShapeError(f"truth: expected shape {result.time.shape}, got {known.shape}")
    view = panels.RaimView(result, known)
    figure = style.new_figure(10.0, 0.9 + sum(HEIGHTS))
    grid = figure.subplots(len(HEIGHTS), 1, sharex=True, height_ratios=HEIGHTS, squeeze=False)
    axes: list[Axes] = [row[0] for row in grid]
    panels.draw_along(axes[0], view)
    panels.draw_levels(axes[1], view)
    panels.draw_statistic(axes[2], view)
    panels.draw_satellites(axes[3], view)
    panels.shade(axes[:-1], view)
    start, end = view.edges
    axes[0].set_xlim(start[0], end[-1])
    axes[-1].set_xlabel("time (s)")
    for where in axes:
        style.clean(where)
    axes[1].legend(
        loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=5, frameon=False, fontsize=9,
        borderaxespad=0.1, handlelength=1.6, columnspacing=1.4, markerscale=1.6,
    )  # fmt: skip
    style.legend_above(figure, axes[0], None if title is None else style.literal(title))
    figure.align_ylabels(axes)
    return figure
