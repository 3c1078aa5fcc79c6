"""How the figures look: colours that colour-blind readers can tell apart, light axes, legends that
stand beside the data."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from surefix.errors import SurefixError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Okabe and Ito (2008), in an order in which neighbours differ in lightness too.
PALETTE = ("#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#F0E442")
ESTIMATE = "#000000"
ALARM = "#D55E00"
REFERENCE = "#7A0177"
SHADE = "#BBBBBB"
GRID = "#E6E6E6"
# Fault modes, from Paul Tol's muted scheme: none that a sensor has.
MODES = {
    "outage": "#882255",
    "frozen": "#332288",
    "drifting": "#DDAA33",
    "noisy": "#44AA99",
    "interrupted": "#999933",
}


def sensor_colours(names: tuple[str, ...]) -> dict[str, str]:
    """A colour for every sensor."""
    return {name: PALETTE[i % len(PALETTE)] for i, name in enumerate(names)}


def mode_colours(labels: Iterable[str]) -> dict[str, str]:
    """A colour for every fault mode named, in the order of ``MODES``."""
    named = set(labels)
    return {mode: colour for mode, colour in MODES.items() if mode in named}


def literal(text: str) -> str:
    """A name or a path as it is: matplotlib takes what stands between dollars for a formula."""
    return text.replace("$", r"\$")


def new_figure(width: float, height: float) -> Figure:
    """An empty figure [inch]; SurefixError if matplotlib is missing."""
    try:
        from matplotlib.figure import Figure
    except ImportError:
        raise SurefixError("plotting needs matplotlib: pip install surefix[plot]") from None
    return Figure(figsize=(width, height), layout="constrained")


def clean(axes: Axes) -> None:
    """Light grid behind the data, no frame on top and on the right."""
    axes.grid(True, color=GRID, linewidth=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.tick_params(labelsize=9)


def legend_above(figure: Figure, axes: Axes, title: str | None) -> None:
    """One legend for ``axes``, above all panels, so that it covers no data; ``title`` over it."""
    from matplotlib.lines import Line2D

    handles, labels = axes.get_legend_handles_labels()
    legend = figure.legend(
        handles, labels, loc="outside upper left", ncols=4, frameon=False, fontsize=9,
        handlelength=1.8, columnspacing=1.6, title=title, alignment="left",
        title_fontproperties={"size": 11, "weight": "bold"},
    )  # fmt: skip
    for handle in legend.legend_handles:
        if isinstance(handle, Line2D):
            handle.set_alpha(1.0)
            if handle.get_marker() == ".":
                handle.set_markersize(9.0)
