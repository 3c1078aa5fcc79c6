"""The panels of a monitor's figure, one function each. ``Axes`` in, artists drawn.

``RaimView`` is what they share: the result, the truth, and where lines are broken.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from surefix.core.checks import FloatArray
from surefix.plots import style
from surefix.plots.panels import MOST_DOTS
from surefix.raim.result import RaimResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHADES = {"excluded": "#F6D9A8", "alarm": "#F2B8A0", "not available": "#CFCFCF"}
"""What is declared, and the colour behind it."""
NAMES = {"excluded": "satellites excluded", "alarm": "alarm", "not available": "not available"}
GAP = 3.5  # intervals between epochs beyond which a line is broken
PROTECTION, CHI2 = "#0072B2", "#009E73"
SHOWN = 97.0  # percentile of the levels that is shown in full


@dataclass(frozen=True, eq=False)
class RaimView:
    """``truth`` (T,): true mileages [m], NaN where there is none, or None."""

    result: RaimResult
    truth: FloatArray | None

    @property
    def edges(self) -> tuple[FloatArray, FloatArray]:
        """From when to when [s] every epoch (T,) is shown: half way to its neighbours, and in a gap
        no farther than where there is none."""
        time = self.result.time
        apart = np.diff(time)
        usual = float(np.median(apart)) if len(apart) else 1.0
        half = np.minimum(apart, GAP * usual) / 2
        return time - np.append(usual / 2, half), time + np.append(half, usual / 2)

    def line(self, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Time and values (T,), broken where epochs are missing; NaN breaks it anyway."""
        time = self.result.time
        apart = np.diff(time)
        usual = float(np.median(apart)) if len(apart) else 0.0
        breaks = np.flatnonzero(apart > GAP * usual) + 1
        return np.insert(time, breaks, np.nan), np.insert(values, breaks, np.nan)


def shade(panels: Sequence[Axes], view: RaimView) -> None:
    """Epochs that were not simply ok, in all panels."""
    start, end = view.edges
    for name, colour in SHADES.items():
        for number, axes in enumerate(panels):
            spans = _spans(view.result.declared == name, start, end)
            if spans:
                axes.broken_barh(
                    spans, (0.0, 1.0), transform=axes.get_xaxis_transform(), facecolor=colour,
                    linewidth=0, zorder=0, label=NAMES[name] if number == 0 else "_",
                )  # fmt: skip


def draw_along(axes: Axes, view: RaimView) -> None:
    """Mileage, the protection level on either side, and the truth."""
    result, usable = view.result, view.result.usable
    if view.truth is not None:
        axes.plot(
            *view.line(view.truth), color=style.REFERENCE, linewidth=1.1, zorder=5, label="truth"
        )
    at, along = view.line(np.where(usable, result.along, np.nan))
    _, level = view.line(np.where(np.isfinite(result.protection), result.protection, np.nan))
    axes.fill_between(
        at, along - level, along + level, color=PROTECTION, alpha=0.2, linewidth=0, zorder=2
    )
    axes.plot(
        at, along, ".", color=style.ESTIMATE, markersize=_size(result), markeredgewidth=0, zorder=4,
        label="position along the track", rasterized=True,
    )  # fmt: skip
    alarm = result.declared == "alarm"
    axes.plot(
        result.time[alarm], result.along[alarm], "x", color=style.ALARM, markersize=3.5, zorder=3,
        label="position with an alarm" if alarm.any() else "_",
    )  # fmt: skip
    limits = [along, view.truth if view.truth is not None else along]
    shown = np.concatenate([values[np.isfinite(values)] for values in limits])
    if len(shown):
        low, high = float(shown.min()), float(shown.max())
        widest = _percentile(level, SHOWN)
        axes.set_ylim(low - 1.3 * widest, high + 1.3 * widest)
    axes.set_ylabel("along (m)", fontsize=9)


def draw_levels(axes: Axes, view: RaimView) -> None:
    """Protection levels, on both sides of the error where the truth is known; half the protection
    interval dashed."""
    result, sides = view.result, (1.0,) if view.truth is None else (1.0, -1.0)
    highest = result.length / 2
    for values, colour, name in (
        (result.protection, PROTECTION, "protection level"),
        (result.protection_chi2, CHI2, "by the χ² test"),
    ):
        shown = np.where(result.usable & np.isfinite(values), values, np.nan)
        for side in sides:
            axes.plot(
                *view.line(side * shown), color=colour, linewidth=1.2, zorder=3,
                label=name if side > 0 else "_",
            )  # fmt: skip
        highest = max(highest, _percentile(shown, SHOWN))
    for side in sides:
        axes.axhline(
            side * result.length / 2, color="#555555", linewidth=0.9, linestyle="--",
            label="half the interval, L / 2" if side > 0 else "_",
        )  # fmt: skip
    lowest = 0.0
    if view.truth is not None:
        lowest = -highest
        error = result.along - view.truth
        axes.plot(
            result.time, np.where(result.usable, error, np.nan), ".", color=style.REFERENCE,
            markersize=_size(result), markeredgewidth=0, zorder=5, label="error", rasterized=True,
        )  # fmt: skip
        draw_misleading(axes, view, error, highest)
    axes.set_ylim(1.08 * lowest, 1.08 * highest)
    axes.set_ylabel("error (m)" if view.truth is not None else "level (m)", fontsize=9)


def draw_misleading(axes: Axes, view: RaimView, error: FloatArray, most: float) -> None:
    """Crosses where the error is beyond the protection level, at ``most`` where it is larger."""
    result = view.result
    beyond = result.usable & (np.abs(error) > result.protection)
    if beyond.any():
        axes.plot(
            result.time[beyond], np.clip(error[beyond], -most, most), "x", color=style.ALARM,
            markersize=5, zorder=6,
            label="error beyond the level",
        )  # fmt: skip


def draw_statistic(axes: Axes, view: RaimView) -> None:
    """The statistic of all satellites in view as dots, those with an alarm as crosses, and the
    threshold, which moves with their number."""
    result = view.result
    stride = -(-len(result.time) // MOST_DOTS) or 1
    tested = np.isfinite(result.statistic) & (result.degrees > 0)
    calm = np.flatnonzero(tested & ~result.alarm)[::stride]
    axes.plot(
        result.time[calm], result.statistic[calm], ".", color="#555555", markersize=2.8,
        markeredgewidth=0, rasterized=True,
    )  # fmt: skip
    loud = tested & result.alarm
    axes.plot(result.time[loud], result.statistic[loud], "x", color=style.ALARM, markersize=3.5)
    axes.plot(*view.line(result.threshold), color=style.ALARM, linewidth=0.9, linestyle="--")
    axes.set_ylabel("statistic", fontsize=9)
    positive = result.statistic[tested & (result.statistic > 0)]
    if len(positive):
        axes.set_yscale("log")
        largest = max(float(positive.max()), float(np.nanmax(result.threshold)))
        axes.set_ylim(max(_percentile(positive, 1.0), largest * 1e-6) / 2, 2.5 * largest)


def draw_satellites(axes: Axes, view: RaimView) -> None:
    """Satellites that the solution uses, and above them those that were taken out."""
    result, (start, end) = view.result, view.edges
    edges = np.unique(np.concatenate([start, end]))
    epoch = np.searchsorted(start, edges[:-1], side="right") - 1
    shown = edges[:-1] < end[epoch]  # not a gap
    used = np.where(shown, result.used[epoch], 0)
    out = np.where(shown, result.excluded_count[epoch], 0)
    axes.stairs(used + out, edges, fill=True, color=style.ALARM, linewidth=0)
    axes.stairs(used, edges, fill=True, color="#B5B5B5", linewidth=0)
    axes.set_ylim(0.0, 1.15 * max(1, int((used + out).max(initial=0))))
    axes.set_ylabel("satellites", fontsize=9)


def _size(result: RaimResult) -> float:
    """Of a dot."""
    return 4.5 if len(result.time) < 600 else 3.2


def _spans(
    inside: npt.NDArray[np.bool_], start: FloatArray, end: FloatArray
) -> list[tuple[float, float]]:
    """(from, width) of the epochs inside, those that touch joined."""
    at = np.flatnonzero(inside)
    if len(at) == 0:
        return []
    cut = np.flatnonzero((np.diff(at) > 1) | (start[at[1:]] > end[at[:-1]] + 1e-9)) + 1
    return [
        (float(start[part[0]]), float(end[part[-1]] - start[part[0]]))
        for part in np.split(at, cut)
    ]  # fmt: skip


def _percentile(values: FloatArray, share: float) -> float:
    """Of those that are finite; 0 where none is."""
    finite = values[np.isfinite(values)]
    return float(np.percentile(finite, share)) if len(finite) else 0.0
