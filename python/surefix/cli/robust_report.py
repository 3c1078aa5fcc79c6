"""The summary of a robust run as text for people."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rich.console import Console
from rich.text import Text

from surefix.cli import report


def print_robust_sensors(console: Console, summary: Mapping[str, Any]) -> None:
    """Rows of every sensor, how many were rejected, how long it was held to be in which mode."""
    table = report.new_table("sensor", "rows", "used", "rate", "rejected", "held to be")
    for name, sensor in summary["sensors"].items():
        rate, rejected = sensor["rate_hz"], sensor["rejected"]
        held = "–"  # a sensor that is not in the configuration
        if "modes_s" in sensor:
            modes = sensor["modes_s"].items()
            held = ", ".join(f"{mode} {lasted:.4g} s" for mode, lasted in modes if lasted)
            held = held or "healthy"
        table.add_row(
            Text(name, style="" if sensor["rows"] else "yellow"), f"{sensor['rows']}",
            f"{sensor['used']}", "–" if rate is None else f"{rate:.1f} Hz",
            f"[red]{rejected}[/]" if rejected else "0", held,
        )  # fmt: skip
    console.print(table)
    report.print_unused(console, summary)


def print_limits(console: Console, summary: Mapping[str, Any]) -> None:
    """How many estimates, how tight their limits are, and whether these hold the reference."""
    lines = {"estimates": report.how_many(summary)}
    available, width = summary["available_share"], summary["mean_width"]
    if available is not None:
        lines["limits"] = f"at risk {summary['risk']:g} for {_share(available)} of the estimates"
        if width is not None:
            lines["limits"] += f", {width:.3g} wide, at most {summary['largest_width']:.3g}"
    lines["left out"] = (
        f"probability of at most {summary['largest_discarded_mass']:.1e}, taken from the risk"
    )
    lines["rejected"] = f"{summary['rejected']} rows"
    lines.update(report.how_far_off(summary))
    reference = summary.get("reference", {})
    if reference.get("compared"):
        (claim,) = reference["claims"]
        total, share = reference["compared"], claim["share_outside"]
        colour = "red" if share else "green"
        lines["misleading"] = (
            f"the reference is outside the limits of [{colour}]{round(share * total)}[/] of "
            f"{total} estimates ({_share(share)})"
        )
    report.print_lines(console, lines)


def _share(share: float) -> str:
    return f"{100 * share:.4g} %"
