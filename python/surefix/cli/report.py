"""A summary as text for people."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table
from rich.text import Text

# What the engine's statuses mean to the reader of a report.
STATUSES = {
    "not_finite": "no finite time or value",
    "unknown_sensor": "sensor not in the configuration",
    "too_late": "too late for their step",
    "repeated": "repeated",
    "buffer_full": "no room in the step",
    "off_grid": "between the model's periods",
    "numerical": "not representable",
    "waiting": "after the last estimate",
}


def new_table(first: str, *others: str) -> Table:
    """A table with a column of names and columns of numbers."""
    table = Table(box=SIMPLE_HEAD, pad_edge=False, show_edge=False)
    table.add_column(first, no_wrap=True)
    for heading in others:
        table.add_column(heading, justify="right")
    return table


def print_sensors(console: Console, summary: Mapping[str, Any]) -> None:
    """Rows, rates and noise of every sensor, yellow if it has none, and what was not used."""
    table = new_table("sensor", "rows", "used", "rate", "noise / σ (rms)", "flagged")
    for name, sensor in summary["sensors"].items():
        rate, rms = sensor["rate_hz"], sensor["rms_normalised_noise"]
        shown = Text(name, style="" if sensor["rows"] else "yellow")
        table.add_row(
            shown, f"{sensor['rows']}", f"{sensor['used']}",
            "–" if rate is None else f"{rate:.1f} Hz", "–" if rms is None else f"{rms:.2f}",
            f"[red]{sensor['flagged']}[/]" if sensor["flagged"] else "0",
        )  # fmt: skip
    console.print(table)
    print_unused(console, summary)


def print_unused(console: Console, summary: Mapping[str, Any]) -> None:
    """How many rows were not used, and why."""
    for name, rows in summary["counts"].items():
        if name != "ok":
            console.print(f"[yellow]not used: {rows} rows, {STATUSES.get(name, name)}[/]")


def print_estimates(console: Console, summary: Mapping[str, Any]) -> None:
    """How many estimates, how they fit, their errors to the reference."""
    steps = summary["steps"]
    print_lines(console, {
        "estimates": how_many(summary),
        "flagged": f"{summary['flagged']} rows, {steps['count']} steps with p < "
        f"{steps['p_value_below']:.1e} (false alarm {summary['false_alarm']:g} per run)",
        **how_far_off(summary),
    })  # fmt: skip
    console.print()


def print_lines(console: Console, lines: Mapping[str, str]) -> None:
    """Lines of text, each with a name in front."""
    for name, text in lines.items():
        console.print(f"{name:<11}{text}", soft_wrap=True)


def how_many(summary: Mapping[str, Any]) -> str:
    """How many estimates there are and how they fit."""
    rate = summary["rate_hz"]
    how = f"{rate:g} a second" if rate else "one per measurement"
    if summary["estimates"]:
        how += f", mean σ {summary['mean_sigma']:.3g}"
        how += f", log-likelihood {summary['log_likelihood']:.6g}"
    return f"{summary['estimates']}, {how}"


def how_far_off(summary: Mapping[str, Any]) -> dict[str, str]:
    """A line on the errors to the reference, if there is one."""
    reference = summary.get("reference", {})
    if reference.get("compared"):
        text = (
            f"rms {reference['rms_error']:.3g}, mean {reference['mean_absolute_error']:.3g}, "
            f"max {reference['max_error']:.3g} to the reference"
        )
        return {"error": text}
    return {"error": "no estimate lies within the reference's time"} if reference else {}


def print_claims(console: Console, reference: Mapping[str, Any]) -> None:
    """How often the reference lies outside the interval; red where far too often."""
    table = new_table("claimed risk", "reference outside", "mean width")
    total = reference["compared"]
    for claim in reference["claims"]:
        share, risk = claim["share_outside"], claim["risk"]
        colour = "red" if share * total > 5 * risk * total + 1 else "green"
        table.add_row(f"{risk:g}", f"[{colour}]{share:.3%}[/]", f"{claim['mean_width']:.3g}")
    console.print(table)
