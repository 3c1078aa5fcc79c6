"""The figure of a result: estimate and interval, normalised noise, p-value of every step."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from surefix.core.checks import FloatArray
from surefix.desync.result import Result
from surefix.errors import ConfigError
from surefix.plots import panels, style
from surefix.plots.panels import Event, View

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def plot_result(
    result: Result,
    *,
    reference: tuple[npt.ArrayLike, npt.ArrayLike] | None = None,
    events: Sequence[Event | tuple[float, float, str]] | None = None,
    false_alarm: float = 0.01,
    window: tuple[float, float] | None = None,
    title: str | None = None,
    ylabel: str | None = None,
) -> Figure:
    """Measurements, estimate, interval, what was flagged; below, noise and p-values.

    ``reference``: time (R,) [s] and the true output (R,). ``events``: (start, end, label) [s] of
    what is to be shaded. ``false_alarm``: see ``Result.flagged``. ``window``: from, to [s]; by
    default the whole result. ``ylabel``: by default the name of the output with m/s if it is a
    speed. Measurements far off the estimate are drawn as triangles at the edge of the panel, and
    dots of long logs are thinned out, which the legend says.
    """
    view = _view(result, window, false_alarm)
    with_noise, with_error = len(result.noise) > 0, reference is not None
    heights = [4.0] + [1.4] * with_error + [1.4] * with_noise + [1.2]
    figure = style.new_figure(10.0, 1.2 + 0.8 * sum(heights))
    axes = list(figure.subplots(len(heights), 1, sharex=True, height_ratios=heights))
    main, name = axes[0], result.state_names[result.output]
    unit = " (m/s)" if name == "speed" else ""
    panels.draw_estimates(main, view)
    main.set_ylabel(ylabel or name + unit)
    if reference is not None:
        truth = np.asarray(reference[0], np.float64), np.asarray(reference[1], np.float64)
        panels.draw_reference(main, view, truth)
        panels.draw_error(axes[1], view, truth)
        axes[1].set_ylabel("error" + unit, fontsize=9)
    _limit(main, view)
    if with_noise:
        panels.draw_noise(axes[-2], view)
    panels.draw_p_values(axes[-1], view)
    panels.draw_events(axes, view, [Event(*event) for event in events or ()])
    axes[-1].set_xlabel("time (s)")
    for panel in axes:
        style.clean(panel)
    main.set_xlim(*view.window)
    style.legend_above(figure, main, title)
    figure.align_ylabels(axes)
    return figure


def _view(result: Result, window: tuple[float, float] | None, false_alarm: float) -> View:
    time = result.log.time
    if window is None:
        finite = np.concatenate([time[np.isfinite(time)], result.time])
        window = float(finite.min(initial=np.inf)), float(finite.max(initial=-np.inf))
        if not len(finite):
            window = 0.0, 1.0
        window = window if window[1] > window[0] else (window[0] - 0.5, window[1] + 0.5)
    if not window[0] < window[1]:
        raise ConfigError(f"window: expected (from, to) with from < to, got {window}")
    flagged = np.zeros(len(time), np.bool_)
    if len(result.noise):
        flagged = result.flagged(false_alarm)
    with np.errstate(invalid="ignore"):
        rows = (time >= window[0]) & (time <= window[1]) & np.isfinite(result.log.value)
    steps = (result.time >= window[0]) & (result.time <= window[1])
    return View(result, window, rows, steps, flagged, false_alarm)


def _limit(axes: Axes, view: View) -> None:
    """Limits by estimate, interval and the bulk of the measurements; a triangle for the rest."""
    result, log = view.result, view.result.log
    values: FloatArray = log.value[view.rows]
    bulk = np.percentile(values, [0.2, 99.8]) if len(values) else np.zeros(0)
    inside = np.concatenate([result.lower[view.steps], result.upper[view.steps], bulk])
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
