"""What ``surefix drift`` found, as text for people."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from rich.console import Console
from rich.text import Text

from surefix.cli.report import new_table, print_unused

Fault = Mapping[str, Any]

STYLES = {"detected": "red", "not detected": "green", "undetectable": "yellow"}


def show(console: Console, found: Mapping[str, Any]) -> None:
    """Prints everything."""
    head = Text.assemble((found["log"], "bold"), f", {found['duration_s']:.0f} s\n")
    console.print(head, soft_wrap=True)
    print_faults(console, found)
    for text in found["warnings"]:
        console.print(Text.assemble(("warning: ", "bold yellow"), text), soft_wrap=True)
    print_unused(console, found)
    console.print()
    print_fit(console, found)
    console.print()
    print_searches(console, found["searched"])


def print_faults(console: Console, found: Mapping[str, Any]) -> None:
    """The faults, each with what is as likely; or that there are none, or none can be seen."""
    faults = found["faults"]
    alarm = found["settings"]["false_alarm"]
    if not faults:
        statuses = {one["status"] for one in found["searched"]}
        if statuses == {"undetectable"}:
            text = (
                "Nothing can be said: a fault of any course looked for would not show in this log."
            )
        else:
            text = f"Nothing found that a healthy log would not show (false alarm {alarm:g})."
            if "undetectable" in statuses:
                text += " Some faults would not show: see below."
        console.print(text, markup=False, soft_wrap=True)
        return
    columns: dict[str, Callable[[Fault], str]] = {
        "sensor": lambda one: one["sensor"],
        "fault": lambda one: one["kind"],
        "": _when,
        "amplitude": _amplitude,
        "drop": lambda one: f"{one['drop']:.1f}",
        "p": lambda one: f"{one['p_value']:.1e}",
    }
    cells = {name: [cell(one) for one in faults] for name, cell in columns.items()}
    table = new_table(*cells)
    for row in zip(*cells.values(), strict=True):
        table.add_row(*(Text(cell) for cell in row))
    console.print(table)
    console.print()
    for fault in faults:
        console.print(_compared(fault), markup=False, soft_wrap=True)


def print_fit(console: Console, found: Mapping[str, Any]) -> None:
    """How the model explains the log, and what every sensor sends, before and after the repair."""
    whens = ("before", "after") if found["faults"] else ("before",)
    last = found[whens[-1]]
    table = new_table("fit", "rows used", *(f"NIS {when}" for when in whens), "correlation")
    table.add_row(
        "all",
        f"{last['measurements']}",
        *(_number(found[when]["nis"], ".3f") for when in whens),
        "",
    )
    for name, one in last["sensors"].items():
        sizes = (found[when]["sensors"][name]["nis"] for when in whens)
        table.add_row(
            Text(name), f"{one['measurements']}", *(_number(nis, ".3f") for nis in sizes),
            _number(one["correlation"], ".2f"),
        )  # fmt: skip
    console.print(table)
    changed = ", after the repair ".join(f"{found[when]['inconsistency']:.1f}" for when in whens)
    text = f"inconsistency {changed}. NIS per measurement is 1, correlation 0 if the model holds."
    console.print(text, markup=False, soft_wrap=True)


def print_searches(console: Console, searched: Sequence[Mapping[str, Any]]) -> None:
    """Every search in the log as it was, and why some could find nothing."""
    table = new_table("searched", "fault", "", "drop", "p", "largest at")
    for one in searched:
        at = _with(one["since_s"], ".2f", "s") or _with(one["frequency_hz"], ".5g", "Hz")
        table.add_row(
            Text(one["sensor"]), one["kind"], Text(one["status"], STYLES[one["status"]]),
            _number(one["drop"], ".1f"), _number(one["p_value"], ".1e"), at,
        )  # fmt: skip
    console.print(table)
    reasons: dict[str, list[str]] = {}
    for one in searched:
        if one["reason"]:
            reasons.setdefault(one["reason"], []).append(f"{one['sensor']} {one['kind']}")
    for reason, names in reasons.items():
        text = f"undetectable: {', '.join(names)}: {reason}"
        console.print(text, markup=False, soft_wrap=True)


def _compared(fault: Fault) -> str:
    """A line on the next best explanation."""
    name, second = f"{fault['sensor']}, {fault['kind']}", fault["runner_up"]
    if fault["as_likely"]:
        others = " or ".join(f"{one['sensor']}, {one['kind']}" for one in fault["as_likely"])
        return f"{name}: hardly to be told from {others}"
    if second is None:
        return f"{name}: no other explanation was looked for"
    less = fault["score"] - second["score"]
    return f"{name}: next best is {second['sensor']}, {second['kind']}, its score {less:.1f} lower"


def _when(one: Fault) -> str:
    if one["frequency_hz"] is not None:
        return f"{one['frequency_hz']:.5g} Hz"
    if one["until_s"] is not None:
        return f"{one['since_s']:.2f} to {one['until_s']:.2f} s"
    return f"since {one['since_s']:.2f} s"


def _amplitude(fault: Fault) -> str:
    se, value = fault["amplitude_se"], fault["amplitude"]
    return f"{value:.3g} ± {se:.2g} {fault['unit']}"


def _with(value: float | None, form: str, unit: str) -> str:
    return "" if value is None else f"{value:{form}} {unit}"


def _number(value: float | None, form: str) -> str:
    return "–" if value is None else f"{value:{form}}"
