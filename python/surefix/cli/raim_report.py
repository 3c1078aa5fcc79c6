"""What ``surefix raim`` found, as text for people."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rich.console import Console
from rich.text import Text

from surefix.cli.report import new_table, print_lines

STYLES = {"ok": "green", "excluded": "yellow", "alarm": "red"}
MEANING = {
    "ok": "ok: no alarm",
    "excluded": "excluded: alarm, ended by taking satellites out",
    "alarm": "alarm: remains whichever are taken out",
}
MOST_NAMED = 8  # satellites


def show(console: Console, found: Mapping[str, Any]) -> None:
    """Prints everything."""
    size = (
        f", {found['epochs']} epochs in {found['duration_s']:.0f} s, "
        f"{_satellites(found['satellites'])} satellites, "
        f"{found['track']['length_m']:.0f} m of track\n"
    )
    console.print(Text.assemble((found["pseudoranges"], "bold"), size), soft_wrap=True)
    print_counts(console, found)
    for text in found["warnings"]:
        console.print(Text.assemble(("warning: ", "bold yellow"), text), soft_wrap=True)
    console.print()
    print_lines(console, {
        "alarms": _alarms(found), "available": _available(found["availability"], "epochs"),
        **_protection(found),
    })  # fmt: skip
    if found["excluded"]:
        print_lines(console, {"excluded": _excluded(found["excluded"])})
    if "errors" in found:
        console.print()
        print_errors(console, found)
    if "map" in found:
        console.print()
        one = found["map"]
        print_lines(console, {"map": f"{_available(one, 'the track')}, at {one['time_s']:g} s"})


def print_counts(console: Console, found: Mapping[str, Any]) -> None:
    """How many epochs were declared what."""
    table = new_table("declared", "epochs", "share")
    for name, count in found["counts"].items():
        if name == "not available":
            continue  # its reasons follow
        table.add_row(
            Text(MEANING.get(name, name), STYLES.get(name, "dim")), f"{count}",
            f"{count / found['epochs']:.2%}",
        )  # fmt: skip
    console.print(table)
    for key, why in (("rows_not_finite", "no finite number"), ("rows_below_mask", "too low")):
        if found[key]:
            console.print(f"[yellow]not used: {found[key]} rows, {why}[/]")


def print_errors(console: Console, found: Mapping[str, Any]) -> None:
    """Errors of the positions that may be used, against the levels that were claimed."""
    errors = found["errors"]
    if not errors["compared"]:
        console.print("no position that may be used lies within the truth's time")
        return
    text = (
        f"rms {errors['rms_m']:.3g} m, median {errors['median_m']:.3g} m, "
        f"max {errors['max_m']:.3g} m, {errors['compared']} epochs"
    )
    print_lines(console, {"error": text})
    table = new_table(f"risk {errors['risk']:g}", "beyond its level", "misleading", "hazardously")
    for name, key in (("protection", ""), ("by the χ² test", "_chi2")):
        share, regions = errors[f"beyond_protection{key}"], errors[f"stanford{key}"]
        colour = "red" if share and share * errors["compared"] > 1 else "green"
        table.add_row(
            name, "–" if share is None else f"[{colour}]{share:.3%}[/]",
            f"{regions['misleading'] + regions['unavailable_misleading']}",
            f"{regions['hazardous']}",
        )  # fmt: skip
    console.print(table)


def _alarms(found: Mapping[str, Any]) -> str:
    alarms, settings = found["alarms"], found["settings"]
    if not alarms["tested"]:
        return "no epoch could be tested"
    return (
        f"{alarms['snapshot']} of {alarms['tested']} tested epochs by the snapshot "
        f"({alarms['snapshot_rate']:.2g}, healthy {settings['false_alarm']:g}), "
        f"{alarms['separation']} by separation"
    )


def _available(shares: Mapping[str, Any], of: str) -> str:
    return f"{shares['with_e1']:.2%} of {of}, {shares['without_e1']:.2%} without e1"


def _protection(found: Mapping[str, Any]) -> dict[str, str]:
    lines = {}
    for name, key in (("protection", "protection_m"), ("by χ²", "protection_chi2_m")):
        one = found[key]
        none = f", none in {one['none']} epochs" if one["none"] else ""
        lines[name] = f"median {_metres(one['median'])}, 95 % {_metres(one['p95'])}{none}"
    return lines


def _metres(value: float | None) -> str:
    return "–" if value is None else f"{value:.1f} m"


def _excluded(names: Mapping[str, int]) -> str:
    shown = [f"{name} ({count})" for name, count in [*names.items()][:MOST_NAMED]]
    return ", ".join([*shown, *(["…"] if len(names) > MOST_NAMED else [])])


def _satellites(one: Mapping[str, Any]) -> str:
    return f"{one['least']}" if one["least"] == one["most"] else f"{one['least']}-{one['most']}"
