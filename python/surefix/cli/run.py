"""``surefix run``: filters a log as a configuration says and writes what was found."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.text import Text

from surefix import tables
from surefix.cli import findings, outputs, report
from surefix.cli.terminal import phases, reports_errors
from surefix.config import Config, Output, check_output, load_config
from surefix.errors import ConfigError

ALERT = 3


@reports_errors
def run(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="Log: .csv, .csv.gz or .parquet.")],
    config: Annotated[Path, typer.Option(help="Configuration, TOML.")],
    out: Annotated[Path, typer.Option(help="Folder for what is written.")],
    json: Annotated[bool, typer.Option("--json", help="Summary as JSON on stdout.")] = False,
    rate: Annotated[float | None, typer.Option(help="Estimates a second, Hz.")] = None,
    risk: Annotated[float | None, typer.Option(help="Risk of the limits, per estimate.")] = None,
    linear: Annotated[bool, typer.Option("--linear", help="Take no account of faults.")] = False,
) -> None:
    """Fuse a log: estimates, limits, what does not fit. Exit code 3 if something does not.

    If the configuration gives sensors faults, the robust filter finds and rejects them; otherwise
    the linear filter flags what does not fit.
    """
    settings = load_config(config)
    output = _overridden(settings.output, rate, risk)
    settings = dataclasses.replace(settings, output=output)
    settings = settings.without_faults() if linear else settings
    files = [f"{stem}.{end}" for stem in outputs.TABLES for end in ("csv", "json")]
    inputs = [log, config]
    if settings.reference is not None:
        inputs.append(log.parent / settings.reference.file)
    outputs.spare_inputs(out, [*files, "plot.png"], inputs)
    with phases() as shown:
        with shown.phase("reading") as advance:
            measurements = settings.read_log(log, advance)
            known = None if settings.reference is None else settings.reference.read(log.parent)
        with shown.phase("filtering"):
            result = settings.run(measurements)
        if "ok" not in result.counts:
            counts = ", ".join(f"{n} {status}" for status, n in result.counts.items())
            raise ConfigError(f"{log}: no row could be used: {counts}")
        with shown.phase("writing") as advance:
            summary = {"log": str(log), "config": str(config)}
            found, events = findings.find(result, settings, known)
            summary.update(found)
            outputs.write_tables(out, result.columns(), events, summary, progress=advance)
        if outputs.can_plot():
            with shown.phase("plotting"):
                figure = findings.draw(result, settings, reference=known, title=log.name)
                outputs.save_figure(figure, out / "plot.png")
    if json:
        typer.echo(tables.as_json(summary))
    else:
        _print(Console(highlight=False), settings, summary, out)
    if summary.get("rejected", summary.get("flagged")):
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
    model = type(config.model).__name__
    head = Text.assemble((summary["log"], "bold"), f", {summary['duration_s']:.0f} s, {model}\n")
    console.print(head, soft_wrap=True)
    findings.show(console, summary)
    if "flagged" in summary and summary.get("reference", {}).get("compared"):
        report.print_claims(console, summary["reference"])
    console.print(f"\nwritten to {out}", markup=False, soft_wrap=True)
