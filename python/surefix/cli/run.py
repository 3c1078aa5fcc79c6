"""``surefix run``: filters a log as a configuration says and writes what was found."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from surefix import tables
from surefix.cli import outputs, report
from surefix.cli.summary import event_table, summarise
from surefix.cli.terminal import phases, reports_errors
from surefix.config import Config, Output, check_output, load_config
from surefix.errors import ConfigError
from surefix.plots import plot_result

ALERT = 3


@reports_errors
def run(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="Log: .csv, .csv.gz or .parquet.")],
    config: Annotated[Path, typer.Option(help="Configuration, TOML.")],
    out: Annotated[Path, typer.Option(help="Folder for what is written.")],
    json: Annotated[bool, typer.Option("--json", help="Summary as JSON on stdout.")] = False,
    rate: Annotated[float | None, typer.Option(help="Estimates a second, Hz.")] = None,
    risk: Annotated[float | None, typer.Option(help="Risk of the interval, per estimate.")] = None,
) -> None:
    """Fuse a log: estimates, intervals, what does not fit. Exit code 3 if a row was flagged."""
    settings = load_config(config)
    output = _overridden(settings.output, rate, risk)
    settings = dataclasses.replace(settings, output=output)
    with phases() as shown:
        with shown.phase("reading") as advance:
            measurements = settings.read_log(log, advance)
            known = None if settings.reference is None else settings.reference.read(log.parent)
        with shown.phase("filtering"):
            result = settings.make_filter().run(
                measurements, rate=output.rate, noise=output.noise, delay=output.delay
            )
        with shown.phase("writing") as advance:
            summary = {"log": str(log), "config": str(config)}
            summary.update(summarise(result, settings, known))
            events = event_table(result, output.false_alarm)
            outputs.write_tables(out, result.columns(), events, summary, progress=advance)
        if outputs.can_plot():
            with shown.phase("plotting"):
                figure = plot_result(
                    result, reference=known, false_alarm=output.false_alarm, title=log.name
                )
                outputs.save_figure(figure, out / "plot.png")
    if json:
        typer.echo(tables.as_json(summary))
    else:
        _print(Console(highlight=False), settings, summary, out)
    if summary["flagged"]:
        raise typer.Exit(ALERT)


def _overridden(output: Output, rate: float | None, risk: float | None) -> Output:
    """The configuration's output with the options of the command line."""
    given = {name: v for name, v in (("rate", rate), ("risk", risk)) if v is not None}
    output = dataclasses.replace(output, **given)  # type: ignore[arg-type]
    try:
        check_output(output)
    except ConfigError as error:
        raise typer.BadParameter(str(error)) from None
    return output


def _print(console: Console, config: Config, summary: dict[str, Any], out: Path) -> None:
    head = f"[bold]{summary['log']}[/], {summary['duration_s']:.0f} s, {config.model!r}\n"
    console.print(head, soft_wrap=True)
    report.print_sensors(console, summary)
    console.print()
    report.print_estimates(console, summary)
    if summary.get("reference", {}).get("compared"):
        report.print_claims(console, summary["reference"])
    console.print(f"\nwritten to {out}", soft_wrap=True)
