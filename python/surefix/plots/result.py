"""The figure of a result: estimate and interval, normalised noise, p-value of every step."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from surefix.desync.result import Result
from surefix.plots import panels
from surefix.plots.frame import Events, Panel, Reference, compose, shown_rows
from surefix.plots.panels import View

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def plot_result(
    result: Result,
    *,
    reference: Reference | None = None,
    events: Events | None = None,
    false_alarm: float = 0.01,
    window: tuple[float, float] | None = None,
    title: str | None = None,
    ylabel: str | None = None,
) -> Figure:
    """Measurements, estimate, interval, what was flagged; below, noise and p-values.

    ``reference``: time (R,) [s], in order, and the true output (R,). ``events``: (start, end,
    label) [s] of what is to be shaded. ``false_alarm``: see ``Result.flagged``. ``window``: from,
    to [s]; by default the whole result. ``ylabel``: by default the name of the output with m/s if
    it is a speed. Measurements far off the estimate are drawn as triangles at the edge of the
    panel, and dots of long logs are thinned out, which the legend says.
    """
    window, rows, steps = shown_rows(result.log, result.time, window)
    with_noise = len(result.noise) > 0
    flagged = result.flagged(false_alarm) if with_noise else np.zeros(len(rows), np.bool_)
    view = View(
        result, window, rows, steps, flagged,
        flagged_as=f"flagged (false alarm {false_alarm:g} a run)", limits_as="interval",
    )  # fmt: skip
    draw_noise = partial(panels.draw_noise, view=view, result=result, false_alarm=false_alarm)
    draw_p = partial(panels.draw_p_values, view=view, result=result, false_alarm=false_alarm)
    noise = [Panel(1.4, draw_noise)] if with_noise else []
    return compose(
        view,
        [*noise, Panel(1.2, draw_p)],
        reference=reference,
        events=events,
        title=title,
        ylabel=ylabel,
    )
