"""One journey as Bilenne's figures show it: measurements as dots, those rejected as crosses, the
estimate as a thick line, alert limits dotted; and the truth, which the paper did not have."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from surefix.core.checks import FloatArray
from surefix.desync.result import Result
from surefix.misleading import outside
from surefix.plots import style
from surefix.robust.result import RobustResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def draw_journey(
    axes: Axes,
    result: Result | RobustResult,
    truth: Callable[[FloatArray], FloatArray],
    window: tuple[float, float],
) -> None:
    """All estimates and measurements in ``window`` [s]."""
    log = result.log
    names = tuple(sorted(log.names, reverse="wheel" in log.names))
    colours = style.sensor_colours(names)
    inside = (log.time >= window[0]) & (log.time <= window[1])
    rejected = result.rejected if isinstance(result, RobustResult) else np.zeros(len(log), np.bool_)
    for name in names:
        rows = inside & (log.code == log.names.index(name))
        for mask, marker, size in ((rows & ~rejected, ".", 5.0), (rows & rejected, "x", 4.0)):
            axes.plot(
                log.time[mask], log.value[mask], marker, color=colours[name], markersize=size,
                markeredgewidth=0 if marker == "." else 0.8, alpha=0.55 if marker == "." else 0.9,
                linestyle="none", label=name if marker == "." else "_", zorder=2,
            )  # fmt: skip
    axes.plot(
        [], [], "x", color="#555555", markersize=5, label="rejected by the likeliest hypothesis"
    )
    shown = (result.time >= window[0]) & (result.time <= window[1])
    time = result.time[shown]
    axes.plot(
        time,
        result.estimate[shown],
        color=style.ESTIMATE,
        linewidth=2.2,
        label="estimate",
        zorder=4,
    )
    for i, bound in enumerate((result.lower, result.upper)):
        axes.plot(
            time, bound[shown], ":", color=style.ESTIMATE, linewidth=1.2, zorder=4,
            label=f"limits, risk {result.risk:.0e}" if i == 0 else "_",
        )  # fmt: skip
    fine = np.linspace(*window, 1000)
    axes.plot(fine, truth(fine), color=style.REFERENCE, linewidth=1.3, label="truth", zorder=5)
    missed = shown & outside(result, truth)
    axes.plot(
        result.time[missed], truth(result.time[missed]), "o", color=style.ALARM, markersize=3.5,
        markeredgewidth=0, label="truth outside the limits", zorder=6,
    )  # fmt: skip
    axes.set_xlim(*window)
    axes.set_xlabel("time (s)")
    axes.set_ylabel("speed (m/s)")
    style.clean(axes)


def shade(axes: Axes, span: tuple[float, float], label: str) -> None:
    """Shades a period [s] and says what it is, at the bottom."""
    axes.axvspan(*span, color=style.SHADE, alpha=0.3, linewidth=0, zorder=0)
    axes.annotate(
        label, ((span[0] + span[1]) / 2, 0.02), xycoords=("data", "axes fraction"), ha="center",
        fontsize=8, color="#444444",
    )  # fmt: skip
