"""What the figures of all filters have in common: the panels of the estimate and of its error, the
window of time, the limits of the axes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from surefix.core import checks
from surefix.core.checks import FloatArray
from surefix.errors import ConfigError, ShapeError
from surefix.log import Log
from surefix.plots import panels, style
from surefix.plots.panels import Event, Mask, View

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Reference = tuple[npt.ArrayLike, npt.ArrayLike]
Events = Sequence[Event | tuple[float, float, str]]


class Panel(NamedTuple):
    """A panel below the others: its height, relative to 4 of the first, and what is drawn."""

    height: float
    draw: Callable[[Axes], None]


def compose(
    view: View,
    below: Sequence[Panel],
    *,
    reference: Reference | None,
    events: Events | None,
    title: str | None,
    ylabel: str | None,
) -> Figure:
    """Estimate and measurements, the error if there is a reference, then the panels ``below``."""
    truth = None if reference is None else _checked(reference)
    heights = [4.0, *([] if truth is None else [1.4]), *(panel.height for panel in below)]
    figure = style.new_figure(10.0, 1.2 + 0.8 * sum(heights))
    axes = list(figure.subplots(len(heights), 1, sharex=True, height_ratios=heights, squeeze=False))
    axes = [row[0] for row in axes]
    main, name = axes[0], view.result.state_names[view.result.output]
    unit = " (m/s)" if name == "speed" else ""
    panels.draw_estimates(main, view)
    main.set_ylabel(ylabel or style.literal(name + unit))
    if truth is not None:
        panels.draw_reference(main, view, truth)
        panels.draw_error(axes[1], view, truth)
        axes[1].set_ylabel("error" + unit, fontsize=9)
    _limit(main, view)
    for panel, where in zip(below, axes[len(axes) - len(below) :], strict=True):
        panel.draw(where)
    panels.draw_events(axes, view, [Event(*event) for event in events or ()])
    axes[-1].set_xlabel("time (s)")
    for where in axes:
        style.clean(where)
    main.set_xlim(*view.window)
    style.legend_above(figure, main, None if title is None else style.literal(title))
    figure.align_ylabels(axes)
    return figure


def shown_rows(
    log: Log, time: FloatArray, window: tuple[float, float] | None
) -> tuple[tuple[float, float], Mask, Mask]:
    """The window, by default all of it, and which rows (N,) and which of the estimates at ``time``
    (T,) it shows."""
    if window is None:
        finite = np.concatenate([log.time[np.isfinite(log.time)], time])
        window = float(finite.min(initial=np.inf)), float(finite.max(initial=-np.inf))
        if not len(finite):
            window = 0.0, 1.0
        window = window if window[1] > window[0] else (window[0] - 0.5, window[1] + 0.5)
    if not window[0] < window[1]:
        raise ConfigError(f"window: expected (from, to) with from < to, got {window}")
    with np.errstate(invalid="ignore"):
        rows = (log.time >= window[0]) & (log.time <= window[1]) & np.isfinite(log.value)
    return window, rows, (time >= window[0]) & (time <= window[1])


def _checked(reference: Reference) -> tuple[FloatArray, FloatArray]:
    try:
        time, value = reference
    except (TypeError, ValueError):
        raise ShapeError(f"reference: expected (time, value), got {reference!r}") from None
    times = checks.array("reference time", time, (None,))
    if len(times) == 0 or (np.diff(times) < 0).any():
        raise ConfigError(f"reference time: expected 1 or more times in order, got {times}")
    return times, checks.array("reference value", value, (len(times),))


def _limit(axes: Axes, view: View) -> None:
    """Limits by estimate, interval and the bulk of the measurements; a triangle for the rest."""
    result, log = view.result, view.result.log
    values: FloatArray = log.value[view.rows]
    bulk = np.percentile(values, [0.2, 99.8]) if len(values) else np.zeros(0)
    inside = np.concatenate([result.lower[view.steps], result.upper[view.steps], bulk])
    inside = inside[np.isfinite(inside)]
    if len(inside) == 0:
        return
    low, high = float(inside.min()), float(inside.max())
    margin = 0.06 * (high - low) or 1.0
    low, high = low - margin, high + margin
    axes.set_ylim(low, high)
    for marker, beyond, edge in (("v", log.value < low, low), ("^", log.value > high, high)):
        for code, name in enumerate(log.names):
            rows = view.rows & beyond & (log.code == code)
            for mask, colour in (
                (rows & ~view.flagged, view.colours[name]), (rows & view.flagged, style.ALARM),
            ):  # fmt: skip
                time = log.time[mask]
                time = time[:: -(-len(time) // panels.MOST_DOTS) or 1]
                (drawn,) = axes.plot(
                    time, np.full(len(time), edge), marker, color=colour, markersize=5,
                    markeredgewidth=0, clip_on=False, zorder=7,
                )  # fmt: skip
                drawn.set_in_layout(False)
