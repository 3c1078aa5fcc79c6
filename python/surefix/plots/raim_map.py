"""Where along a track the monitor is available: the line on a map, and strips over the mileage."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from surefix.core.checks import FloatArray
from surefix.plots import style
from surefix.raim.availability import AvailabilityMap
from surefix.raim.geodesy import local_axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import LineCollection
    from matplotlib.figure import Figure

STATES = {
    "available": "#0072B2",
    "available only without $e_1$": "#E69F00",
    "not available": "#D55E00",
}
NONE = "#BBBBBB"
SMALLEST = 1e-12  # probability that is drawn


def draw_availability(
    availability: AvailabilityMap, *, missed: float | None = None, title: str | None = None
) -> Figure:
    """The line coloured by availability and by protection level; over the mileage p* and p* + e₁,
    and the satellites in view. ``missed``: γ, up to which it is available, drawn dashed."""
    figure = style.new_figure(11.0, 8.4)
    grid = figure.add_gridspec(3, 2, height_ratios=(4.0, 1.6, 1.0))
    left, right = figure.add_subplot(grid[0, 0]), figure.add_subplot(grid[0, 1])
    above, below = figure.add_subplot(grid[1, :]), figure.add_subplot(grid[2, :])
    state = states(availability)
    place = local_metres(availability)
    _draw_line(left, place).set_color([[*STATES.values()][k] for k in _worst(state)])
    _draw_protection(figure, right, place, availability.protection)
    middle = len(availability.along) // 2
    at = f"{availability.latitude[middle]:.5f}°, {availability.longitude[middle]:.5f}°"
    for axes in (left, right):
        axes.set(xlabel=f"east of {at} (m)", ylabel="north (m)")
        axes.set_aspect("equal", adjustable="datalim")
        style.clean(axes)
    _draw_probability(above, availability, missed)
    _draw_in_view(below, availability)
    _shade((above, below), availability.along, state)
    for axes in (above, below):
        axes.set_xlim(*_ends(availability.along))
        style.clean(axes)
    above.tick_params(labelbottom=False)
    figure.align_ylabels([above, below])
    _legend(figure, state, title)
    return figure


def states(availability: AvailabilityMap) -> npt.NDArray[np.intp]:
    """(K,): the index in ``STATES``."""
    order = [availability.available_with_e1, availability.available]
    return np.asarray(np.select(order, [0, 1], 2), dtype=np.intp)


def local_metres(availability: AvailabilityMap) -> FloatArray:
    """(K, 2): metres east and north of the middle of the line."""
    middle = len(availability.along) // 2
    axes = local_axes(availability.latitude[middle], availability.longitude[middle])
    position = availability.track.position(availability.along)
    return np.asarray(((position - position[middle]) @ axes.T)[:, :2])


def _worst(values: npt.NDArray[np.intp]) -> npt.NDArray[np.intp]:
    """Of the two ends of every segment (K - 1,)."""
    return np.maximum(values[1:], values[:-1])


def _draw_line(axes: Axes, place: FloatArray) -> LineCollection:
    from matplotlib.collections import LineCollection

    pieces = LineCollection(
        list(np.stack([place[:-1], place[1:]], axis=1)), linewidth=3.5, capstyle="round", zorder=3
    )
    axes.add_collection(pieces)
    axes.update_datalim(place)
    axes.margins(0.06)
    axes.autoscale_view()
    return pieces


def _draw_protection(figure: Figure, axes: Axes, place: FloatArray, level: FloatArray) -> None:
    """Grey where there is no protection level."""
    _draw_line(axes, place).set_color(NONE)
    worst = np.maximum(level[1:], level[:-1])
    there = np.isfinite(worst)
    if not there.any():
        axes.set_title("no protection level anywhere", loc="left", fontsize=9)
        return
    pieces = _draw_line(axes, place)
    pieces.set_array(np.where(there, worst, np.nan))
    pieces.set_cmap("viridis")
    low, high = np.percentile(worst[there], [0, 99])
    pieces.set_clim(float(low), float(high) if high > low * 1.001 else float(low) + 1.0)
    label = "protection level (m)" + ("" if there.all() else ", grey: none")
    beyond = "max" if worst[there].max() > pieces.get_clim()[1] else "neither"
    figure.colorbar(pieces, ax=axes, label=label, shrink=0.9, pad=0.02, extend=beyond)


def _draw_probability(axes: Axes, availability: AvailabilityMap, missed: float | None) -> None:
    along = availability.along
    alone, both = availability.p_star, availability.p_star + availability.e1
    axes.plot(along, np.maximum(alone, SMALLEST), color="#555555", linewidth=1.1, label="$p^*$")
    axes.plot(
        along, np.maximum(both, SMALLEST), color="#000000", linewidth=1.4, label="$p^* + e_1$"
    )
    if missed is not None:
        axes.axhline(missed, color=style.ALARM, linestyle="--", linewidth=0.9, label="$\\gamma$")
    axes.set_yscale("log")
    values = np.concatenate([both, alone])
    known = values[np.isfinite(values) & (values > SMALLEST)]
    wanted = [missed or 1.0, *known.tolist()]
    axes.set_ylim(max(min(wanted) / 3, SMALLEST), 3.0)
    clipped = f"\n(≥ {SMALLEST:.0e})" if (alone < SMALLEST).any() else ""
    axes.set_ylabel(f"missed{clipped}", fontsize=9)
    axes.legend(
        loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, frameon=False, fontsize=9,
        borderaxespad=0.1, handlelength=1.6,
    )  # fmt: skip


def _draw_in_view(axes: Axes, availability: AvailabilityMap) -> None:
    along = availability.along
    axes.step(along, availability.satellites, where="mid", color="#000000", linewidth=1.2)
    axes.set_ylim(0, 1.2 * max(1, int(availability.satellites.max())))
    axes.set_ylabel("satellites\nin view", fontsize=9)
    axes.set_xlabel("along (m)")


def _shade(panels: tuple[Axes, ...], along: FloatArray, state: npt.NDArray[np.intp]) -> None:
    """The states' colours behind the strips."""
    cuts = np.flatnonzero(np.diff(state)) + 1
    first, last = _ends(along)
    edges = [first, *((along[cuts] + along[cuts - 1]) / 2).tolist(), last]
    colours = [*STATES.values()]
    for begin, end, k in zip(edges[:-1], edges[1:], state[[0, *cuts.tolist()]], strict=True):
        for axes in panels:
            axes.axvspan(begin, end, color=colours[k], alpha=0.18, linewidth=0, zorder=0)


def _ends(along: FloatArray) -> tuple[float, float]:
    low, high = float(along.min()), float(along.max())
    return (low, high) if low < high else (low - 0.5, high + 0.5)


def _legend(figure: Figure, state: npt.NDArray[np.intp], title: str | None) -> None:
    """Above all panels, with each state's share of the line."""
    from matplotlib.lines import Line2D

    shares = np.bincount(state, minlength=len(STATES)) / len(state)
    handles = [
        Line2D([], [], color=colour, linewidth=3.5, label=f"{name}: {share:.1%}")
        for (name, colour), share in zip(STATES.items(), shares, strict=True)
    ]
    figure.legend(
        handles=handles, loc="outside upper left", ncols=3, frameon=False, fontsize=9,
        title=None if title is None else style.literal(title), alignment="left",
        title_fontproperties={"size": 11, "weight": "bold"},
    )  # fmt: skip
