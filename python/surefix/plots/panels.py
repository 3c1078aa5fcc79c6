"""The panels of a result's figure, one function each. ``Axes`` in, artists drawn, nothing returned.

``View`` is what they share: the result, its colours and the window of time that is shown.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from surefix.core.checks import FloatArray
from surefix.desync.result import Result
from surefix.plots import style
from surefix.robust.result import RobustResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Mask = npt.NDArray[np.bool_]

MOST_DOTS = 4000  # per sensor and panel
MOST_POINTS = 20_000  # per line
SMALLEST_P = 1e-16


class Event(NamedTuple):
    """Something to mark: from ``start`` to ``end`` [s], equal for a single instant."""

    start: float
    end: float
    label: str


@dataclass(frozen=True, eq=False)
class View:
    """``rows`` (N,): rows of the log that are shown; ``steps`` (T,): estimates that are shown;
    ``flagged`` (N,): rows to be marked; ``flagged_as``, ``limits_as``: names in the legend."""

    result: Result | RobustResult
    window: tuple[float, float]
    rows: Mask
    steps: Mask
    flagged: Mask
    flagged_as: str
    limits_as: str

    @property
    def colours(self) -> dict[str, str]:
        return style.sensor_colours(self.result.log.names)

    def sensor_rows(self, code: int) -> tuple[npt.NDArray[np.intp], int]:
        """Rows of one sensor that were not flagged, thinned out, and the stride."""
        found = np.flatnonzero(self.rows & ~self.flagged & (self.result.log.code == code))
        stride = -(-len(found) // MOST_DOTS) or 1
        return found[::stride], stride

    def line_steps(self) -> tuple[npt.NDArray[np.intp], int]:
        """Estimates that a line goes through, and their stride."""
        found = np.flatnonzero(self.steps)
        stride = -(-len(found) // MOST_POINTS) or 1
        return found[::stride], stride


def draw_estimates(axes: Axes, view: View) -> None:
    """Estimate as a thick line, its interval dotted, the measurements as dots, flagged ones as
    crosses (as in Bilenne's figures 1 and 2)."""
    result, log = view.result, view.result.log
    for code, name in enumerate(log.names):
        rows, stride = view.sensor_rows(code)
        label = style.literal(name)
        label = label if stride == 1 else f"{label} (every {_ordinal(stride)} shown)"
        size = 4.0 if len(rows) < 1500 else 2.6
        axes.plot(
            log.time[rows], log.value[rows], ".", color=view.colours[name], alpha=0.5,
            markersize=size, markeredgewidth=0, label=label, rasterized=True, zorder=2,
        )  # fmt: skip
    at, stride = view.line_steps()
    time, dense = result.time[at], len(at) > 8000
    axes.plot(
        time, result.estimate[at], color=style.ESTIMATE, zorder=4,
        linewidth=1.0 if dense else 1.6 if len(at) > 1500 else 2.2,
        label="estimate" if stride == 1 else f"estimate (every {_ordinal(stride)} shown)",
    )  # fmt: skip
    label = f"{view.limits_as}, risk {result.risk:.0e}".replace("e-0", "e-")
    for i, bound in enumerate((result.lower, result.upper)):
        axes.plot(
            time, bound[at], ":", color=style.ESTIMATE, linewidth=0.6 if dense else 1.0, zorder=4,
            label=label if i == 0 else "_",
        )  # fmt: skip
    marked = view.rows & view.flagged
    if marked.any():
        axes.plot(
            log.time[marked], log.value[marked], "x", color=style.ALARM, markersize=4.5,
            markeredgewidth=1.0, zorder=5, label=view.flagged_as,
        )  # fmt: skip


def draw_reference(axes: Axes, view: View, reference: tuple[FloatArray, FloatArray]) -> None:
    """The true output as a thin line."""
    time, value = np.asarray(reference[0]), np.asarray(reference[1])
    inside = (time >= view.window[0]) & (time <= view.window[1])
    axes.plot(
        time[inside], value[inside], color=style.REFERENCE, linewidth=1.1, label="truth", zorder=6
    )


def draw_error(axes: Axes, view: View, reference: tuple[FloatArray, FloatArray]) -> None:
    """Estimate minus truth between the ends of the interval, relative to the estimate."""
    result, (at, _) = view.result, view.line_steps()
    time = result.time[at]
    truth = np.interp(time, *reference, left=np.nan, right=np.nan)
    axes.plot(time, result.estimate[at] - truth, color=style.REFERENCE, linewidth=1.1)
    for bound in (result.lower, result.upper):
        axes.plot(time, (bound - result.estimate)[at], ":", color=style.ESTIMATE, linewidth=1.0)


def draw_events(panels: Sequence[Axes], view: View, events: Sequence[Event]) -> None:
    """Shades periods in all panels and names them above the first, where instants get a tick."""
    first, last = view.window
    shown = sorted(event for event in events if event.end >= first and event.start <= last)
    instants = [event.start for event in shown if event.end <= event.start]
    if instants:
        panels[0].plot(
            instants, np.full(len(instants), 0.985), "|", color="#555555", markersize=7,
            markeredgewidth=1.3, transform=panels[0].get_xaxis_transform(), label="single event",
        )  # fmt: skip
    named_until, level = -np.inf, 0
    for event in shown:
        if event.end <= event.start:
            continue
        for axes in panels:
            axes.axvspan(event.start, event.end, color=style.SHADE, alpha=0.35, linewidth=0)
        middle = (max(event.start, first) + min(event.end, last)) / 2
        level = 1 - level if middle - named_until < 0.09 * (last - first) else 0
        named_until = middle
        label = style.literal(event.label)
        panels[0].annotate(
            label, (middle, 1.0), xycoords=("data", "axes fraction"), ha="center",
            xytext=(0, 5 + 10 * level), textcoords="offset points", fontsize=8, color="#555555",
        )  # fmt: skip


def draw_noise(axes: Axes, view: View, result: Result, false_alarm: float) -> None:
    """Normalised noise of every measurement and the threshold beyond which it is flagged."""
    log, noise = result.log, result.normalised_noise
    for code, name in enumerate(log.names):
        rows, _ = view.sensor_rows(code)
        axes.plot(
            log.time[rows], noise[rows], ".", color=view.colours[name], alpha=0.5,
            markersize=3.0, markeredgewidth=0, rasterized=True,
        )  # fmt: skip
    marked = view.rows & view.flagged
    axes.plot(log.time[marked], noise[marked], "x", color=style.ALARM, markersize=3.5)
    threshold = result.flagged_beyond(false_alarm)
    for level in (-threshold, threshold):
        axes.axhline(level, color=style.ALARM, linewidth=0.9, linestyle="--")
    axes.set_ylabel("noise / σ", fontsize=9)
    largest = np.abs(noise[marked]).max(initial=1.6 * threshold)
    axes.set_ylim(-1.08 * largest, 1.08 * largest)


def draw_p_values(axes: Axes, view: View, result: Result, false_alarm: float) -> None:
    """p-value of every step (χ² of its SSE), and the level that a healthy run keeps above."""
    counted = np.isfinite(result.p_value)
    axes.set_ylabel("p of step", fontsize=9)
    if not (view.steps & counted).any():
        return
    p = np.maximum(np.where(counted, result.p_value, 1.0), SMALLEST_P)
    level = false_alarm / max(int(counted.sum()), 1)
    shown = view.steps & counted
    low = shown & (p < level)
    found = np.flatnonzero(shown & ~low)
    found = found[:: -(-len(found) // MOST_DOTS) or 1]
    axes.semilogy(result.time[found], p[found], ".", color="#666666", markersize=2.0, alpha=0.5)
    axes.semilogy(result.time[low], p[low], "x", color=style.ALARM, markersize=3.5)
    axes.axhline(level, color=style.ALARM, linewidth=0.9, linestyle="--")
    smallest = float(p[shown].min(initial=level))
    axes.set_ylim(max(smallest, SMALLEST_P) / 30, 5.0)
    if smallest <= SMALLEST_P:
        axes.set_ylabel(f"p of step\n(≥ {SMALLEST_P:.0e})", fontsize=9)


def _ordinal(n: int) -> str:
    endings = {1: "st", 2: "nd", 3: "rd"}
    return f"{n}{'th' if n % 100 in (11, 12, 13) else endings.get(n % 10, 'th')}"
