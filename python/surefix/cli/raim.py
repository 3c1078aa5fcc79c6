"""``surefix raim``: may a satellite position on a known track be trusted, and where on the line?"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from surefix import tables
from surefix.cli import (
    outputs,
    raim_figures,
    raim_findings,
    raim_map,
    raim_monitored,
    raim_report,
    raim_tables,
)
from surefix.cli.raim_settings import overridden, with_default
from surefix.cli.run import ALERT
from surefix.cli.terminal import phases, reports_errors
from surefix.config_raim import RaimConfig, load_raim_config
from surefix.config_raim_tables import ELEVATION_MASK

ALWAYS = ("epochs.csv", "satellites.csv", "raim.json", "raim.png")
SOMETIMES = ("stanford.png", "availability.csv", "availability.png")

Number = float | None


@reports_errors
def raim(
    pseudoranges: Annotated[Path, typer.Argument(metavar="PSEUDORANGES", help="CSV or CSV.GZ.")],
    track: Annotated[Path, typer.Option(help="The track: CSV or GeoJSON.")],
    config: Annotated[Path | None, typer.Option(help="Configuration, TOML.")] = None,
    length: Annotated[Number, typer.Option(help="Of the protection interval, m.")] = None,
    sigma: Annotated[Number, typer.Option(help="σ at the zenith, m; divided by sin el.")] = None,
    mask: Annotated[
        Number, typer.Option(help=f"Elevation mask, degrees; {ELEVATION_MASK:g} if not given.")
    ] = None,
    false_alarm: Annotated[
        Number, typer.Option(help=with_default("false_alarm", "Per epoch and test"))
    ] = None,
    missed: Annotated[
        Number, typer.Option(help=with_default("missed", "How often a critical fault may be"))
    ] = None,
    risk: Annotated[Number, typer.Option(help=with_default("risk", "Per epoch"))] = None,
    fault_probability: Annotated[
        Number, typer.Option(help=with_default("fault_probability", "Of a satellite, per epoch"))
    ] = None,
    max_excluded: Annotated[
        int | None, typer.Option(help=with_default("max_excluded", "How many may be taken out"))
    ] = None,
    max_speed: Annotated[
        Number, typer.Option(help="Of the vehicle, m/s; any if not given.")
    ] = None,
    near: Annotated[Number, typer.Option(help="Mileage at the beginning, m.")] = None,
    tolerance: Annotated[Number, typer.Option(help="Smooths the track by so many m.")] = None,
    earth_rotation: Annotated[
        bool, typer.Option("--earth-rotation", help="Satellite positions are at transmission.")
    ] = False,
    truth: Annotated[Path | None, typer.Option(help="True positions or mileages, CSV.")] = None,
    availability: Annotated[
        bool, typer.Option("--availability", help="A map, with the first epoch's satellites.")
    ] = False,
    step: Annotated[float, typer.Option(help="Between the map's places, m.")] = 10.0,
    out: Annotated[Path, typer.Option(help="Folder for what is written.")] = Path("raim"),
    json: Annotated[bool, typer.Option("--json", help="What was found as JSON on stdout.")] = False,
) -> None:
    """Positions on a known track, with their integrity. Exit code 3 if there is an alarm.

    Every epoch is tested, faulty satellites are taken out, and a protection level along the track
    is given; an epoch with too few satellites is not available, never a number.
    """
    settings = overridden(
        RaimConfig() if config is None else load_raim_config(config),
        {
            "length": length, "sigma": sigma, "mask": mask, "false_alarm": false_alarm,
            "missed": missed, "risk": risk, "fault_probability": fault_probability,
            "max_excluded": max_excluded, "max_speed": max_speed, "near": near,
            "tolerance": tolerance, "earth_rotation": earth_rotation,
        },
    )  # fmt: skip
    if not step > 0:
        raise typer.BadParameter(f"--step: expected a number > 0, got {step:g}")
    outputs.check_folder(out)
    inputs = [path for path in (pseudoranges, track, config, truth) if path is not None]
    outputs.spare_inputs(out, [*ALWAYS, *SOMETIMES], inputs)
    with phases() as shown:
        with shown.phase("reading") as advance:
            files = raim_monitored.read(settings, pseudoranges, track, truth, advance)
        with shown.phase("testing") as advance:
            monitored = raim_monitored.judge(files, advance)
        found = {
            "pseudoranges": str(pseudoranges), "track_file": str(track),
            "config": None if config is None else str(config),
            **raim_findings.summarise(monitored),
        }  # fmt: skip
        line = None
        if availability:
            with shown.phase("mapping") as advance:
                line, time = raim_map.draw_up(monitored, step, advance)
                found["map"] = raim_findings.found_on_map(line, monitored.monitor, time)
        with shown.phase("writing") as advance:
            out.mkdir(parents=True, exist_ok=True)
            for name in SOMETIMES:
                (out / name).unlink(missing_ok=True)  # of another run
            tables.write_csv(out / "epochs.csv", raim_tables.epoch_table(monitored), advance)
            tables.write_csv(out / "satellites.csv", raim_tables.satellite_table(monitored))
            tables.plain(out / "raim.json", found)
            if line is not None:
                tables.write_csv(out / "availability.csv", raim_tables.availability_table(line))
        if outputs.can_plot():
            with shown.phase("plotting"):
                raim_figures.save(monitored, line, out, (pseudoranges.name, track.name))
    if json:
        typer.echo(tables.as_json(found))
    else:
        raim_report.show(Console(highlight=False), found)
        typer.echo(f"\nwritten to {out}")
    if raim_findings.raised(monitored).any():
        raise typer.Exit(ALERT)
