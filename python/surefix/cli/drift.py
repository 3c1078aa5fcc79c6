"""``surefix drift``: which sensor has a slow fault, which course, since when, how large."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from surefix import tables
from surefix.cli import drift_findings, drift_report, drift_search, outputs
from surefix.cli.run import ALERT
from surefix.cli.terminal import phases, reports_errors
from surefix.config import load_config
from surefix.config_drift import Drift
from surefix.core.sensor import Sensor
from surefix.errors import ConfigError
from surefix.plots.drift import draw_drift
from surefix.toml_table import nearest

REPAIRED = "repaired.csv"
FILES = ("drift.json", "drift.png", REPAIRED)


@reports_errors
def drift(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="Log: .csv, .csv.gz or .parquet.")],
    config: Annotated[Path, typer.Option(help="Configuration, TOML.")],
    out: Annotated[Path, typer.Option(help="Folder for what is written.")] = Path("drift"),
    json: Annotated[bool, typer.Option("--json", help="What was found as JSON on stdout.")] = False,
    false_alarm: Annotated[
        float | None, typer.Option(help="Probability that a healthy log is called faulty.")
    ] = None,
    sensor: Annotated[
        list[str] | None, typer.Option(help="May be at fault; may be given several times.")
    ] = None,
    no_spectrum: Annotated[
        bool, typer.Option("--no-spectrum", help="Look for no oscillations, which take longest.")
    ] = False,
) -> None:
    """Look for slow faults: steps, ramps, oscillations in a sensor. Exit code 3 if there is one.

    The whole log is compared, for every sensor, course and onset, with the linear filter of the
    configuration; what is found is subtracted, and the log without it written.
    """
    settings = load_config(config)
    wanted = _overridden(settings.drift, settings.sensors, false_alarm, sensor, no_spectrum)
    settings = dataclasses.replace(settings, drift=wanted)
    outputs.check_folder(out)
    outputs.spare_inputs(out, FILES, [log, config])
    with phases() as shown:
        with shown.phase("reading") as advance:
            measurements = settings.read_log(log, advance)
        with shown.phase("searching") as advance:
            search = drift_search.search(settings, measurements, advance)
            if search.before.engine.size == 0:
                counts = ", ".join(f"{n} {status}" for status, n in search.counts.items())
                raise ConfigError(f"{log}: no row could be used: {counts}")
        with shown.phase("writing") as advance:
            found = {"log": str(log), "config": str(config), **drift_findings.summarise(search)}
            out.mkdir(parents=True, exist_ok=True)
            (out / REPAIRED).unlink(missing_ok=True)  # of another run, which found something
            if search.diagnosis.detected:
                tables.write_csv(out / REPAIRED, search.repaired(), advance)
                found["repaired"] = str(out / REPAIRED)
            tables.plain(out / "drift.json", found)
        if outputs.can_plot():
            with shown.phase("plotting"):
                figure = draw_drift(
                    search.before, search.after, search.diagnosis, wanted.courses(),
                    frequencies=search.frequencies, units=search.units, title=log.name,
                )  # fmt: skip
                outputs.save_figure(figure, out / "drift.png")
    if json:
        typer.echo(tables.as_json(found))
    else:
        drift_report.show(Console(highlight=False), found)
        typer.echo(f"\nwritten to {out}")
    if search.diagnosis.detected:
        raise typer.Exit(ALERT)


def _overridden(
    drift: Drift,
    sensors: tuple[Sensor, ...],
    false_alarm: float | None,
    suspects: list[str] | None,
    no_spectrum: bool,
) -> Drift:
    """The configuration's table with the options of the command line."""
    names = [sensor.name for sensor in sensors]
    for name in suspects or ():
        if name not in names:
            raise typer.BadParameter(f"--sensor: unknown sensor {name!r}; {nearest(name, names)}")
    try:
        if no_spectrum:
            drift = dataclasses.replace(drift, spectrum=False, frequencies=None)
        if false_alarm is not None:
            drift = dataclasses.replace(drift, false_alarm=false_alarm)
        return dataclasses.replace(drift, sensors=tuple(suspects)) if suspects else drift
    except ConfigError as error:
        raise typer.BadParameter(str(error)) from None
