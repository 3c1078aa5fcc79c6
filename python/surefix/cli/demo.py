"""``surefix demo``: twelve minutes of a train with known faults, fused by the linear filter."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

import surefix
from surefix.cli import outputs, report
from surefix.cli.faults import found_faults, read_faults, split_by_faults
from surefix.cli.summary import event_table, summarise
from surefix.cli.terminal import phases, reports_errors
from surefix.config import load_config
from surefix.plots import Event, plot_result

DATA = Path(surefix.__file__).parent / "data" / "demo"


@reports_errors
def demo(
    out: Annotated[Path, typer.Option(help="Folder for what is written.")] = Path("surefix-demo"),
) -> None:
    """Fuse the packaged journey and compare it with the truth and the injected faults."""
    began = time.perf_counter()
    with phases() as shown:
        with shown.phase("reading") as advance:
            config = load_config(DATA / "config.toml")
            log = config.read_log(DATA / "log.csv", advance)
            truth = None if config.reference is None else config.reference.read(DATA)
            faults = read_faults(DATA / "events.csv")
        with shown.phase("filtering"):
            result = config.make_filter().run(log, rate=config.output.rate)
        false_alarm = config.output.false_alarm
        summary = {"log": "the packaged demo", **summarise(result, config, truth)}
        if truth is not None:
            latency = {sensor.name: sensor.latency for sensor in config.sensors}
            summary["faults"] = split_by_faults(result, truth, faults, latency)
        summary["injected"] = found_faults(result, faults, false_alarm)
        with shown.phase("writing") as advance:
            events = event_table(result, false_alarm)
            outputs.write_tables(
                out, result.columns(), events, summary, both=False, progress=advance
            )
    console = Console(highlight=False)
    _print(console, summary)
    files = ["estimates.csv", "events.csv", "summary.json"]
    marked = [Event(f.start, f.end, f"{f.sensor} {f.kind}") for f in faults]
    with phases() as shown, shown.phase("plotting") as advance:
        for i, (name, (window, title)) in enumerate(_FIGURES.items() if outputs.can_plot() else ()):
            advance(i, len(_FIGURES))
            figure = plot_result(
                result, reference=truth, events=marked, false_alarm=false_alarm,
                window=window, title=title,
            )  # fmt: skip
            outputs.save_figure(figure, out / f"{name}.png")
            files.append(f"{name}.png")
    seconds = time.perf_counter() - began
    console.print(f"{seconds:.1f} s; written to {out}: {', '.join(files)}", soft_wrap=True)
    console.print(
        f"your own log: surefix run LOG --config FILE --out DIR; example: {DATA / 'config.toml'}",
        soft_wrap=True,
    )


_FIGURES = {
    "plot": (None, "Twelve minutes of a train: wheel sensor, Doppler radar, GPS"),
    "plot-tunnel": (
        (262.0, 345.0), "In the tunnel the GPS repeats its last speed; a linear filter follows it",
    ),
    "plot-departure": (
        (400.0, 445.0), "One radar reading 28.6 m/s off, then the wheels slip on departure",
    ),
}  # fmt: skip
"""Name of the file: window [s] and title."""


def _print(console: Console, summary: dict[str, Any]) -> None:
    console.print("[bold]A train journey of 12 minutes[/], simulated, with known faults\n")
    report.print_sensors(console, summary)
    console.print()
    report.print_estimates(console, summary)
    if "faults" in summary:
        _print_split(console, summary["faults"])
    _print_faults(console, summary["injected"])
    console.print(
        "\nA linear filter reports faults, it cannot reject them: while a sensor lies, the\n"
        "truth lies outside far more often than claimed. Rejecting takes a robust filter.\n",
        soft_wrap=True,
    )


def _print_split(console: Console, parts: dict[str, Any]) -> None:
    shown = (0.1, 1e-3, 1e-11)
    table = report.new_table(
        "truth outside, claimed", "steps", "rms m/s", "max m/s",
        *(f"{risk:g}" for risk in shown),
    )  # fmt: skip
    for name, part in parts.items():
        shares = {claim["risk"]: claim["share_outside"] for claim in part["claims"]}
        table.add_row(
            name.replace("_", " "), f"{part['compared']}", f"{part['rms_error']:.2f}",
            f"{part['max_error']:.2f}", *(f"{shares[risk]:.2%}" for risk in shown),
        )  # fmt: skip
    console.print(table)
    console.print()


def _print_faults(console: Console, injected: dict[str, Any]) -> None:
    table = report.new_table("injected", "from", "to", "its rows", "flagged", "first after")
    outliers = injected["outliers"]
    table.add_row(
        "single outliers", "", "", f"{outliers['injected']}", f"{outliers['flagged']}", ""
    )
    for fault in injected["periods"]:
        first = fault["first_flagged_after_s"]
        table.add_row(
            f"{fault['sensor']} {fault['kind']}", f"{fault['start_s']:.0f} s",
            f"{fault['end_s']:.0f} s", f"{fault['rows']}", f"{fault['flagged']}",
            "–" if first is None else f"{first:.1f} s",
        )  # fmt: skip
    table.add_row("good rows, fault within 5 s", "", "", "", f"{injected['flagged_beside']}", "")
    table.add_row("good rows, other times", "", "", "", f"{injected['flagged_elsewhere']}", "")
    console.print(table)
