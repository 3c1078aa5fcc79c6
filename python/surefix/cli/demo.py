"""``surefix demo``: twelve minutes of a train with known faults, and what is made of them."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.text import Text

import surefix
from surefix import tables
from surefix.cli import findings, outputs, report
from surefix.cli.faults import found_faults, read_faults, split_by_faults
from surefix.cli.terminal import phases, reports_errors
from surefix.config import load_config
from surefix.plots import Event

DATA = Path(surefix.__file__).parent / "data" / "demo"


@reports_errors
def demo(
    out: Annotated[Path, typer.Option(help="Folder for what is written.")] = Path("surefix-demo"),
    json: Annotated[bool, typer.Option("--json", help="Summary as JSON on stdout.")] = False,
    linear: Annotated[bool, typer.Option("--linear", help="Take no account of faults.")] = False,
) -> None:
    """Fuse the packaged journey and compare it with the truth and the injected faults."""
    began = time.perf_counter()
    files = ["estimates.csv", "events.csv", "summary.json"]
    outputs.spare_inputs(out, files, DATA.iterdir())
    with phases() as shown:
        with shown.phase("reading") as advance:
            config = load_config(DATA / "config.toml")
            config = config.without_faults() if linear else config
            log = config.read_log(DATA / "log.csv", advance)
            truth = None if config.reference is None else config.reference.read(DATA)
            faults = read_faults(DATA / "events.csv")
        with shown.phase("filtering"):
            result = config.run(log)
        found, events = findings.find(result, config, truth)
        summary = {"log": "the packaged demo", **found}
        if truth is not None:
            latency = {sensor.name: sensor.latency for sensor in config.sensors}
            summary["faults"] = split_by_faults(result, truth, faults, latency)
        summary["injected"] = found_faults(log, findings.marked(result, config), faults)
        with shown.phase("writing") as advance:
            outputs.write_tables(
                out, result.columns(), events, summary, both=False, progress=advance
            )
    console = Console(highlight=False)
    if not json:
        _print(console, summary, linear)
    marked = [Event(f.start, f.end, f"{f.sensor} {f.kind}") for f in faults]
    figures = _LINEAR_FIGURES if linear else _FIGURES
    with phases() as shown, shown.phase("plotting") as advance:
        for i, (name, (window, title)) in enumerate(figures.items() if outputs.can_plot() else ()):
            advance(i, len(figures))
            figure = findings.draw(
                result, config, reference=truth, events=marked, window=window, title=title
            )
            outputs.save_figure(figure, out / f"{name}.png")
            files.append(f"{name}.png")
    if json:
        typer.echo(tables.as_json(summary))
        return
    seconds = time.perf_counter() - began
    console.print(
        f"{seconds:.1f} s; written to {out}: {', '.join(files)}\n"
        f"your own log: surefix run LOG --config FILE --out DIR; example: {DATA / 'config.toml'}",
        markup=False, soft_wrap=True,
    )  # fmt: skip


_FIGURES = {
    "plot": (None, "Twelve minutes of a train: wheel sensor, Doppler radar, GPS"),
    "plot-tunnel": (
        (262.0, 345.0), "In the tunnel the GPS repeats its last speed; its readings are rejected",
    ),
    "plot-departure": (
        (400.0, 445.0), "One radar reading 28.6 m/s off, then the wheels slip on departure",
    ),
}  # fmt: skip
"""Name of the file: window [s] and title."""
_LINEAR_FIGURES = {
    **_FIGURES,
    "plot-tunnel": (
        (262.0, 345.0), "In the tunnel the GPS repeats its last speed; a linear filter follows it",
    ),
}  # fmt: skip


def _print(console: Console, summary: dict[str, Any], linear: bool) -> None:
    console.print("[bold]A train journey of 12 minutes[/], simulated, with known faults\n")
    findings.show(console, summary)
    if not linear:
        console.print()
    if "faults" in summary:
        _print_split(console, summary["faults"])
    _print_faults(console, summary["injected"], "flagged" if linear else "rejected")
    console.print(_LINEAR_ENDING if linear else _ENDING, soft_wrap=True)


_ENDING = """
Every step weighs all combinations of the sensors' fault modes; the limits come
from their mixture, for at the claimed risk it matters what is merely possible.
Rejected are all rows that a sensor held faulty delivered in that step.
For comparison, a filter without faults: surefix demo --linear
"""
_LINEAR_ENDING = """
A linear filter reports faults, it cannot reject them: while a sensor lies, the
truth lies outside far more often than claimed. To reject them: surefix demo
"""


def _print_split(console: Console, parts: dict[str, Any]) -> None:
    risks = [claim["risk"] for part in parts.values() for claim in part.get("claims", ())]
    shown = [risk for risk in (0.1, 1e-3, 1e-11) if risk in risks]
    table = report.new_table(
        "truth outside, claimed", "steps", "rms m/s", "max m/s",
        *(f"{risk:g}" for risk in shown), "mean width",
    )  # fmt: skip
    for name, part in parts.items():
        claims = {claim["risk"]: claim for claim in part["claims"]}
        table.add_row(
            name.replace("_", " "), f"{part['compared']}", f"{part['rms_error']:.2f}",
            f"{part['max_error']:.2f}", *(f"{claims[r]['share_outside']:.2%}" for r in shown),
            f"{claims[shown[-1]]['mean_width']:.2f}",
        )  # fmt: skip
    console.print(table)
    console.print()


def _print_faults(console: Console, injected: dict[str, Any], word: str) -> None:
    table = report.new_table("injected", "from", "to", "its rows", word, "first after")
    outliers = injected["outliers"]
    table.add_row("single outliers", "", "", f"{outliers['injected']}", f"{outliers['found']}", "")
    for fault in injected["periods"]:
        first = fault["first_found_after_s"]
        table.add_row(
            Text(f"{fault['sensor']} {fault['kind']}"), f"{fault['start_s']:.0f} s",
            f"{fault['end_s']:.0f} s", f"{fault['rows']}", f"{fault['found']}",
            "–" if first is None else f"{first:.1f} s",
        )  # fmt: skip
    table.add_row("good rows, fault within 5 s", "", "", "", f"{injected['found_beside']}", "")
    table.add_row("good rows, other times", "", "", "", f"{injected['found_elsewhere']}", "")
    console.print(table)
