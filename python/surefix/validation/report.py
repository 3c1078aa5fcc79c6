"""What ``validate`` found: as lines of text, and as a figure of measured against claimed risk."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from surefix.plots import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MARKERS = "osD^vP*X"
KNOWN = ("linear", "exact")
FLOOR = 0.1  # of the smallest claimed risk: nothing is drawn below

NOTE = (
    "One number per run, of its last estimate; 95 % intervals by run. Effective: how many equal "
    "runs say as much; below 10 there is no number, importance sampling is then not effective."
)


def report(numbers: dict[str, Any]) -> list[str]:
    """A block of lines for every setting."""
    lines = []
    for name, found in numbers["settings"].items():
        weight = found["weight"]
        lines += [
            f"{name}: {found['title']}",
            f"  weights: mean {weight['mean']:.3f} ± {weight['error']:.3f}, "
            f"largest {weight['largest']:.1f}, effective {weight['effective']:.0f} "
            f"of {numbers['runs']} runs",
            f"  {'claimed':>8} {'measured':>9}   {'95 % interval':<20} {'effective':>9}  "
            f"{'available':>9}  verdict",
        ]
        for row in found["risks"]:
            if row["measured"] is None:
                shown = f"{'—':>9}   {'not effective':<20}"
            else:
                interval = f"{row['low']:.2e} … {row['high']:.2e}"
                shown = f"{row['measured']:9.2e}   {interval:<20}"
            plain = ""
            if row["plain"] is not None:
                plain = (
                    f"; plain {row['plain']:.2e} ({row['plain_low']:.1e} … {row['plain_high']:.1e})"
                )
            available = f"{row['available']:.1%}"
            lines.append(
                f"  {row['claimed']:8.0e} {shown} {row['effective']:9.0f}  {available:>9}  "
                f"{row['verdict']}{plain}"
            )
        lines.append("")
    return [*lines, NOTE]


def make_figure(numbers: dict[str, Any]) -> Figure:
    """Measured against claimed risk with 95 % intervals and the diagonal; below, their ratio where
    the claim is to hold."""
    figure = style.new_figure(8.0, 9.5)
    axes, ratio = figure.subplots(2, 1, height_ratios=(3, 1), sharex=True)
    settings = numbers["settings"]
    claimed = [row["claimed"] for found in settings.values() for row in found["risks"]]
    low, high = FLOOR * min(claimed), max(claimed) / FLOOR**0.5
    axes.plot([low, high], [low, high], color=style.ESTIMATE, linewidth=1.0, zorder=1)
    axes.fill_between([low, high], [low, high], low, color=style.GRID, alpha=0.6, zorder=0)
    axes.text(high * 0.6, low * 3, "the claim holds", ha="right", fontsize=9, color="#666666")
    ratio.axhline(1.0, color=style.ESTIMATE, linewidth=1.0, zorder=1)
    ratio.axhspan(0.0, 1.0, color=style.GRID, alpha=0.6, zorder=0)
    colours = (*style.PALETTE[:5], style.ALARM, style.REFERENCE)
    holding = [name for name in settings if name in KNOWN or name == "own"]
    for i, name in enumerate(sorted(settings, key=lambda name: name in KNOWN)):
        rows = [row for row in settings[name]["risks"] if row["measured"] is not None]
        known, colour = name in KNOWN, colours[i % len(colours)]
        missing = len(settings[name]["risks"]) - len(rows)
        label = settings[name]["title"] + (f" ({missing} not measured)" if missing else "")
        look: dict[str, Any] = {
            "fmt": MARKERS[i % len(MARKERS)], "color": colour, "capsize": 3, "linewidth": 1.3,
            "markersize": 9 if known else 6,
            "markerfacecolor": "none" if known else colour,
        }  # fmt: skip
        _errorbar(axes, rows, 1.0, False, look, f"{name}: {label}", known or name == "own")
        if name in holding:
            offset = 1.2 ** (holding.index(name) - (len(holding) - 1) / 2)
            _errorbar(ratio, rows, offset, True, look, None, True)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlim(low, high)
    axes.set_ylim(low, 1.0)
    axes.set_ylabel("measured risk, 95 % interval")
    ratio.set_xlabel("claimed risk, per estimate")
    ratio.set_ylabel("measured / claimed")
    ratio.set_ylim(0.0, None)
    for panel in (axes, ratio):
        style.clean(panel)
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="outside upper left", ncols=1, frameon=False, fontsize=9,
        title="Measured against claimed risk of the alert limits", alignment="left",
        title_fontproperties={"size": 11, "weight": "bold"},
    )  # fmt: skip
    return figure


def _errorbar(
    axes: Axes,
    rows: list[dict[str, Any]],
    offset: float,
    relative: bool,
    look: dict[str, Any],
    label: str | None,
    alone: bool,
) -> None:
    unit = [row["claimed"] if relative else 1.0 for row in rows]
    error = (
        [(row["measured"] - row["low"]) / u for row, u in zip(rows, unit, strict=True)],
        [(row["high"] - row["measured"]) / u for row, u in zip(rows, unit, strict=True)],
    )
    axes.errorbar(
        [offset * row["claimed"] for row in rows],
        [row["measured"] / u for row, u in zip(rows, unit, strict=True)],
        yerr=error, linestyle="none" if alone else ":", label=label, **look,
    )  # fmt: skip
