"""The panels of a diagnosis' figure, one function each. ``Axes`` in, artists drawn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from surefix.core.checks import FloatArray
from surefix.drift.fault import Fault
from surefix.plots import style
from surefix.plots.drift_curves import ENDS, Curve, Residual
from surefix.plots.panels import MOST_DOTS, MOST_POINTS

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MEANS = 80  # over the window
MOST_BEYOND = 3.0  # size of a fault, relative to what is left of it, that is shown in full


def draw_residual(axes: Axes, residual: Residual, colour: str, unit: str | None) -> None:
    """Innovations as dots, their means, what the faults do to them, the faults dashed."""
    time, value, faults = residual.time, residual.value, residual.faults
    stride = -(-len(time) // MOST_DOTS) or 1
    name = style.literal(residual.sensor)
    axes.plot(
        time[::stride], value[::stride], ".", color=colour, alpha=0.45, markersize=2.6,
        markeredgewidth=0, label=f"{name}: measurement − prediction", rasterized=True,
    )  # fmt: skip
    span = (time[-1] - time[0]) / MEANS if len(time) > 4 * MEANS else 0.0
    fastest = max((fault.frequency or 0.0 for fault in faults), default=0.0)
    if span > 0 and 4 * fastest * span < 1:
        axes.plot(*_means(time, value), color=colour, linewidth=1.3, label=f"mean of {span:.2g} s")
    low, high = np.percentile(value, [0.5, 99.5]) if len(value) else (0.0, 0.0)
    if faults:
        several = len(faults) > 2
        named = f"{len(faults)} faults" if several else " and ".join(map(_named, faults))
        label = f"effect of {named}"
        many = 4 * fastest * span > 1  # waves: the dots should be seen through them
        axes.plot(
            time, residual.effect, color=style.ALARM, linewidth=0.8 if many else 1.4,
            alpha=0.6 if many else 1.0, label=label, zorder=4,
        )  # fmt: skip
        low, high = min(low, residual.effect.min()), max(high, residual.effect.max())
        low, high = _draw_courses(axes, residual, low, high)
    margin = 0.06 * (high - low) or 1.0
    axes.set_ylim(low - margin, high + margin)
    axes.set_ylabel("residual" + ("" if unit in (None, "unit") else f" ({unit})"), fontsize=9)


def draw_curves(axes: Axes, curves: Sequence[Curve], colours: Mapping[str, str], of: str) -> None:
    """Drop of 𝓛 of one search of every sensor, thresholds dashed."""
    for order, one in enumerate(curves):
        colour = colours[one.sensor]
        axes.plot(
            *_outline(one.at, one.drop), color=colour, linewidth=1.1,
            label=f"{style.literal(one.sensor)}: {one.kind}", zorder=3 - 0.1 * order,
        )  # fmt: skip
        if one.threshold is not None:
            axes.axhline(one.threshold, color=colour, linewidth=0.9, linestyle="--")
    axes.plot([], [], "--", color="#555555", linewidth=0.9, label="threshold")
    axes.set_ylabel(f"drop of $\\mathcal{{L}}$\nover {of}", fontsize=9)
    axes.set_ylim(bottom=0.0)


def _draw_courses(axes: Axes, residual: Residual, low: float, high: float) -> tuple[float, float]:
    """The faults that begin, and limits that hold them unless nothing else could be seen then."""
    begun = [fault for fault in residual.faults if fault.onset is not None]
    if not begun:
        return low, high
    edges = [t for fault in begun for t in (fault.onset, fault.end) if t is not None]
    around = [t for edge in edges for t in (np.nextafter(edge, -np.inf), edge)]
    time = np.unique([*np.linspace(residual.time[0], residual.time[-1], 2000), *around])
    course = np.sum([fault.value(time) for fault in begun], axis=0)
    axes.plot(
        time, course, "--", color=style.ALARM, linewidth=1.1, zorder=4, scaley=False,
        label="fault itself" if len(begun) == 1 else "faults themselves",
    )  # fmt: skip
    if np.abs(course).max() > MOST_BEYOND * max(high, -low):
        return low, high
    return min(low, float(course.min())), max(high, float(course.max()))


def _named(fault: Fault) -> str:
    if fault.frequency is not None:
        return f"{fault.kind} of {fault.frequency:.4g} Hz"
    until = "" if fault.end is None else f" until {fault.end:.2f} s"
    return f"{fault.kind.removesuffix(ENDS)} since {fault.onset:.2f} s{until}"


def _means(time: FloatArray, value: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Means of ``MEANS`` equal spans of time; NaN where there is no value."""
    edges = np.linspace(time[0], time[-1], MEANS + 1)
    which = np.clip(np.searchsorted(edges, time, side="right") - 1, 0, MEANS - 1)
    count = np.bincount(which, minlength=MEANS)
    total = np.bincount(which, value, minlength=MEANS)
    mean = np.where(count > 0, total / np.maximum(count, 1), np.nan)
    return (edges[1:] + edges[:-1]) / 2, mean


def _outline(at: FloatArray, drop: FloatArray) -> tuple[FloatArray, FloatArray]:
    """No more points than a line can show: of equal parts the largest each, so no peak is lost."""
    size = -(-len(at) // MOST_POINTS) or 1
    starts = np.arange(0, len(at), size)
    if size == 1:
        return at, drop
    filled = np.where(np.isfinite(drop), drop, -1.0)
    largest = [start + int(np.argmax(filled[start : start + size])) for start in starts]
    return at[largest], drop[largest]
