"""The figure of a robust result: what was rejected, alert limits, which sensor is in which mode."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from surefix.core.checks import FloatArray
from surefix.plots import style
from surefix.plots.frame import Events, Panel, Reference, compose, shown_rows
from surefix.plots.panels import View
from surefix.robust.result import RobustResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

NARROWEST = 1 / 600  # of the window: a single step must not vanish in a long run
SMALLEST = 1e-2  # probability that is drawn
ROW = 0.8  # height of a sensor's strip; they are 1 apart


def plot_robust(
    result: RobustResult,
    *,
    reference: Reference | None = None,
    events: Events | None = None,
    window: tuple[float, float] | None = None,
    title: str | None = None,
    ylabel: str | None = None,
) -> Figure:
    """Measurements, those rejected as crosses, estimate, dotted alert limits; below, the error if
    there is a ``reference``, and the probability of every sensor's fault modes.

    The arguments are those of ``plot_result``. Times at which no limits can be claimed are shaded
    in the colour of the crosses.
    """
    window, rows, steps = shown_rows(result.log, result.time, window)
    view = View(
        result, window, rows, steps, result.rejected,
        flagged_as="rejected", limits_as="alert limits",
    )  # fmt: skip
    height = 0.5 + 0.36 * len(result.sensor_names)
    modes = Panel(height, partial(draw_modes, view=view, result=result))
    return compose(view, [modes], reference=reference, events=events, title=title, ylabel=ylabel)


def draw_modes(axes: Axes, view: View, result: RobustResult) -> None:
    """A strip for every sensor: the probabilities of its fault modes over time, on each other."""
    from matplotlib.collections import PolyCollection

    spans = _spans(result.time, view.window)
    names = result.sensor_names
    colours = style.mode_colours(name for modes in result.mode_names for name in modes[1:])
    corners: dict[str, list[FloatArray]] = {}
    for s, modes in enumerate(result.mode_names):
        base = np.full(len(spans), len(names) - 1.0 - s)
        for m, mode in enumerate(modes[1:], start=1):
            probability = result.mode_probability[:, s, m]
            shown = view.steps & (probability >= SMALLEST)
            top = base + ROW * probability
            found = _rectangles(spans[shown], base[shown], top[shown])
            corners.setdefault(mode, []).append(found)
            base = top
    for mode, colour in colours.items():
        axes.add_collection(
            PolyCollection(
                list(np.concatenate(corners[mode])), facecolors=colour, linewidths=0, zorder=3
            ),
            autolim=False,
        )
        axes.plot([], [], "s", color=colour, markersize=7, label=mode)
    _draw_unavailable(axes, view, result, spans)
    middle = [len(names) - 1.0 - s + ROW / 2 for s in range(len(names))]
    for y in middle:
        axes.axhspan(y - ROW / 2, y + ROW / 2, color=style.GRID, alpha=0.45, linewidth=0, zorder=0)
    axes.set_ylim(-0.15, len(names) - 1 + ROW + 0.15)
    axes.set_yticks(middle, [style.literal(name) for name in names])
    axes.tick_params(axis="y", length=0)
    axes.set_ylabel("fault\nprobability" if len(names) > 1 else "p (fault)", fontsize=9)
    axes.legend(
        loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=8, frameon=False, fontsize=9,
        borderaxespad=0.1, handletextpad=0.2, columnspacing=1.4,
    )  # fmt: skip


def _draw_unavailable(axes: Axes, view: View, result: RobustResult, spans: FloatArray) -> None:
    from matplotlib.collections import PolyCollection

    shown = spans[view.steps & ~result.available]
    if len(shown) == 0:
        return
    axes.add_collection(
        PolyCollection(
            list(_rectangles(shown, np.zeros(len(shown)), np.ones(len(shown)))),
            transform=axes.get_xaxis_transform(), facecolors=style.ALARM, alpha=0.25, linewidths=0,
        ),
        autolim=False,
    )  # fmt: skip
    axes.plot([], [], "s", color=style.ALARM, alpha=0.25, markersize=7, label="no limits")


def _spans(time: FloatArray, window: tuple[float, float]) -> FloatArray:
    """Begin and end of every step (T, 2), none narrower than ``NARROWEST``."""
    first = 2 * time[:1] - time[1:2] if len(time) > 1 else time[:1]
    begin = np.concatenate([first, time[:-1]])
    short = np.maximum(NARROWEST * (window[1] - window[0]) - (time - begin), 0) / 2
    spans: FloatArray = np.stack([begin - short, time + short], axis=1)
    return spans


def _rectangles(spans: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Corners (n, 4, 2) of rectangles."""
    x, y = spans[:, [0, 0, 1, 1]], np.stack([low, high, high, low], axis=1)
    corners: FloatArray = np.stack([x, y], axis=2)
    return corners
