"""The Stanford diagram: errors against the protection levels that were claimed for them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from surefix.core import checks
from surefix.core.checks import FloatArray
from surefix.plots import style
from surefix.stanford import Regions, regions

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BINS = 120
MOST = 2.0  # limits, the largest value that has room
COLOURS = {
    "available": "#FFFFFF",
    "misleading": "#F6D9A8",
    "hazardous": "#F2B8A0",
    "unavailable": "#E4E4E4",
    "unavailable_misleading": "#EFE0C6",
}
NAMES = {
    "available": "available",
    "misleading": "misleading",
    "hazardous": "hazardously misleading",
    "unavailable": "not available",
    "unavailable_misleading": "not available,\nmisleading",
}


def draw_stanford(
    error: npt.ArrayLike, protection: npt.ArrayLike, limit: float, *, title: str | None = None
) -> Figure:
    """Epochs by |error| and protection level, both (T,) [m], about the alert ``limit`` [m]: density
    in logarithmic colours, regions with their counts. What is beyond the axes is on their edges;
    epochs with a NaN are left out."""
    parts = regions(error, protection, limit)
    e, level = np.abs(checks.floats("error", error)), checks.floats("protection", protection)
    known = ~np.isnan(e) & ~np.isnan(level)
    e, level = e[known], level[known]
    figure = style.new_figure(7.2, 6.2)
    axes: Axes = figure.subplots()
    end = _end(e, level, limit)
    _draw_regions(axes, parts, limit, end)
    if len(e):
        _draw_density(figure, axes, e, level, end)
    axes.plot([0, end], [0, end], color="#333333", linewidth=0.9)
    axes.axhline(limit, color="#333333", linewidth=0.9, linestyle="--")
    axes.plot([limit, limit], [0, limit], color="#333333", linewidth=0.9, linestyle="--")
    axes.set(xlim=(0, end), ylim=(0, end))
    axes.set_xlabel(_named("|error| (m)", e, end))
    axes.set_ylabel(_named("protection level (m)", level, end))
    style.clean(axes)
    axes.grid(False)
    axes.set_aspect("equal")
    several = f"{len(e)} epochs, alert limit {limit:g} m"
    named = several if title is None else f"{style.literal(title)}\n{several}"
    axes.set_title(named, loc="left", fontsize=10)
    return figure


def _named(name: str, values: FloatArray, end: float) -> str:
    """With how many are beyond the axis."""
    beyond = int((values > end).sum())
    return name + (f"; {beyond} beyond {end:g} are drawn there" if beyond else "")


def _end(e: FloatArray, level: FloatArray, limit: float) -> float:
    """Where the axes end: they hold the limit and nearly all that is finite, up to ``MOST``
    limits."""
    bulk = [
        float(np.percentile(v[np.isfinite(v)], 99.5)) for v in (e, level) if np.isfinite(v).any()
    ]
    return min(max(1.15 * max(bulk, default=0.0), 1.3 * limit), MOST * limit)


def _draw_regions(axes: Axes, parts: Regions, limit: float, end: float) -> None:
    corners = {
        "available": [(0, 0), (limit, limit), (0, limit)],
        "misleading": [(0, 0), (limit, 0), (limit, limit)],
        "hazardous": [(limit, 0), (end, 0), (end, limit), (limit, limit)],
        "unavailable": [(0, limit), (limit, limit), (end, end), (0, end)],
        "unavailable_misleading": [(limit, limit), (end, limit), (end, end)],
    }
    middle = (limit + end) / 2
    places = {
        "available": (0.88 * limit, 0.94 * limit, "right"),
        "misleading": (0.97 * limit, 0.06 * limit, "right"),
        "hazardous": (middle, 0.5 * limit, "center"),
        "unavailable": (0.97 * limit, middle, "right"),
        "unavailable_misleading": (end * 0.99, limit + 0.24 * (end - limit), "right"),
    }
    for name, count in parts.counts.items():
        axes.fill(*zip(*corners[name], strict=True), color=COLOURS[name], linewidth=0, zorder=0)
        x, y, side = places[name]
        axes.text(
            x, y, f"{NAMES[name]}\n{count}", ha=side, va="center", fontsize=9, zorder=5,
            fontweight="bold" if count and "misleading" in NAMES[name] else "normal",
            rotation=90 if name == "hazardous" else 0,
        )  # fmt: skip


def _draw_density(figure: Figure, axes: Axes, e: FloatArray, level: FloatArray, end: float) -> None:
    from matplotlib.colors import LogNorm

    edges = np.linspace(0.0, end, BINS + 1)
    inside = np.clip(e, 0.0, end), np.clip(level, 0.0, end)
    count, _, _ = np.histogram2d(*inside, bins=[edges, edges])
    mesh = axes.pcolormesh(
        edges, edges, np.where(count > 0, count, np.nan).T, cmap="viridis", zorder=2,
        norm=LogNorm(1, max(10.0, float(count.max()))), rasterized=True,
    )  # fmt: skip
    figure.colorbar(mesh, ax=axes, label="epochs", shrink=0.85, pad=0.02)
