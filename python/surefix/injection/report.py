"""What ``challenge`` found: as lines of text, and as a figure."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from surefix.injection.challenge import WARM_UP
from surefix.injection.fault import KINDS
from surefix.injection.judge import GOOD, KMH
from surefix.plots import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MARKERS = "oDs^vP*X"
LOW = 1e-3  # m/s; what is below is drawn there
SOON = 0.02  # s; the same

NOTE = (
    f"outside: share of the estimates whose limits, claimed at that risk, miss the reference (the "
    f"first {WARM_UP:g} s are left out); width and availability at the smallest risk: share with "
    "both limits within 2 km/h, and within what ETCS allows an odometer. Found after: median; "
    f"excluded: share of readings within {GOOD:g} of the reference, no fault in them, that were "
    "rejected."
)


def report(numbers: dict[str, Any]) -> list[str]:
    """A table: as recorded, and a line for every sensor and kind of fault."""
    risks = [f"{risk:.2g}".replace("e-0", "e-") for risk in numbers["risks"]]
    head = "".join(f"{risk:>9}" for risk in risks)
    lines = [
        f"{'outside at':<26}{head}{'width':>8}{'2 km/h':>8}{'ETCS':>7}{'found':>7}{'after':>9}"
        f"{'excluded':>10}"
    ]
    for name, found in (("as recorded", numbers["recorded"]), *numbers["injected"].items()):
        shares = "".join(f"{row['misleading_fraction']:>9.2%}" for row in found["risks"])
        row = found["risks"][-1]
        line = f"{name:<26}{shares}{_number(row['mean_width'], '.2f'):>8}"
        line += f"{row['within_2kmh']:>8.0%}{row['within_etcs']:>7.0%}"
        if "found" in found:
            after = f"{found['delay']:.1f} s" if found["delay"] < math.inf else "never"
            line += f"{found['found']:>7.0%}{after:>9}"
        else:
            line += " " * 16
        lines.append(line + f"{_number(found['false_exclusion'], '.2%'):>10}")
    return [*lines, "", NOTE]


def _number(value: float, form: str) -> str:
    return "—" if math.isnan(value) else format(value, form)


def make_figure(numbers: dict[str, Any], title: str) -> Figure:
    """Left, the integrity diagram: limit against error of every estimate at the smallest risk.
    Right, how long every fault took to be found, by its kind and sensor."""
    figure = style.new_figure(13.0, 6.0)
    left, right = figure.subplots(1, 2, width_ratios=(1, 1.1))
    _integrity(left, numbers)
    _delays(right, numbers)
    left.set_title(f"{title}\nlimits at a risk of {min(numbers['risks']):g}", fontsize=10)
    right.set_title("from the fault's start to the first estimate that says so", fontsize=10)
    return figure


def _integrity(axes: Axes, numbers: dict[str, Any]) -> None:
    points = numbers["points"]
    finite = np.concatenate([limit[np.isfinite(limit)] for _, limit in points.values()])
    high = 2.0 * max(float(finite.max(initial=1.0)), 10.0)
    low = 0.3 * min(float(finite.min(initial=1.0)), 1.0)
    axes.fill_between([LOW, high], [LOW, high], LOW, color=style.GRID, zorder=0)
    axes.plot([LOW, high], [LOW, high], color=style.ESTIMATE, linewidth=1.0, zorder=1)
    axes.text(high * 0.7, 2 * low, "misleading: the truth\nis outside", ha="right", fontsize=9)
    axes.axhline(2 * KMH, color=style.REFERENCE, linewidth=1.0, linestyle="--", zorder=1)
    axes.text(high / 1.2, 2 * KMH * 1.08, "2 km/h", ha="right", fontsize=9, color=style.REFERENCE)
    colours = {"recorded": style.SHADE, **dict(zip(KINDS, style.PALETTE, strict=False))}
    for i, (kind, (error, limit)) in enumerate(points.items()):
        shown = np.clip(np.stack([error, limit]), LOW, high)
        axes.plot(
            *shown, MARKERS[i], color=colours[kind], markersize=3.5, alpha=0.6, linewidth=0,
            label="as recorded" if kind == "recorded" else kind, zorder=3 if i == 0 else 2,
            rasterized=True,
        )  # fmt: skip
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlim(LOW, high)
    axes.set_ylim(low, high)
    axes.set_xlabel("error of the estimate [m/s]")
    axes.set_ylabel("distance of the limit on that side [m/s]")
    style.clean(axes)
    legend = axes.legend(loc="upper left", fontsize=9, ncols=2, framealpha=0.9)
    for handle in legend.legend_handles:
        if handle is not None:
            handle.set_alpha(1.0)


def _delays(axes: Axes, numbers: dict[str, Any]) -> None:
    faults = numbers["faults"]
    kinds = [kind for kind in KINDS if any(fault["kind"] == kind for fault in faults)]
    sensors = list(dict.fromkeys(fault["sensor"] for fault in faults))
    colours = style.sensor_colours(tuple(sensors))
    found = [fault["delay"] for fault in faults if math.isfinite(fault["delay"])]
    never = 2.0 * max([numbers["sizes"]["duration"], *found])
    for s, sensor in enumerate(sensors):
        some = [fault for fault in faults if fault["sensor"] == sensor]
        delay = np.array([fault["delay"] for fault in some])
        delay = np.where(np.isinf(delay), never, np.clip(delay, SOON, None))
        row = np.array([kinds.index(fault["kind"]) for fault in some], float)
        row += 0.6 * ((s + 1) / (len(sensors) + 1) - 0.5)
        axes.plot(
            delay, row, MARKERS[s % len(MARKERS)], color=colours[sensor], markersize=6,
            alpha=0.7, linewidth=0, label=style.literal(sensor),
        )  # fmt: skip
    axes.axvline(never, color=style.ALARM, linewidth=1.0, linestyle="--")
    axes.set_xscale("log")
    axes.set_xlim(0.8 * SOON, 1.3 * never)
    axes.set_ylim(len(kinds) - 0.4, -0.6)
    axes.set_yticks(range(len(kinds)), kinds)
    axes.text(never, -0.62, "never", ha="center", va="bottom", fontsize=9, color=style.ALARM)
    axes.set_xlabel("found after [s]")
    style.clean(axes)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=3, frameon=False, fontsize=9)
