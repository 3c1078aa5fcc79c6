"""``surefix inject``: puts faults into a recorded log and says what the filter makes of them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from surefix import tables
from surefix.cli import outputs
from surefix.cli.terminal import phases, reports_errors
from surefix.config import load_config
from surefix.injection.challenge import RISKS, SEED, SEEDS, challenge
from surefix.injection.fault import KINDS
from surefix.injection.report import make_figure, report


@reports_errors
def inject(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="Log: .csv, .csv.gz or .parquet.")],
    config: Annotated[Path, typer.Option(help="Configuration with faults and a reference, TOML.")],
    seeds: Annotated[int, typer.Option(help="Faults of every kind in every sensor.")] = SEEDS,
    seed: Annotated[int, typer.Option(help="What they are drawn by.")] = SEED,
    risk: Annotated[
        list[float] | None, typer.Option(help="Risk of the limits; may be given several times.")
    ] = None,
    kind: Annotated[
        list[str] | None,
        typer.Option(help=f"Only this kind: {', '.join(KINDS)}; may be given several times."),
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder for what is written.")] = Path("inject"),
    json: Annotated[bool, typer.Option("--json", help="Numbers as JSON on stdout.")] = False,
) -> None:
    """Challenge a configuration with a recording: as it is, and with faults put into each sensor.

    Against the recording's reference: how often the limits mislead, how often they are tight
    enough to be of use, how soon each fault is found, how many healthy readings are rejected.
    """
    settings = load_config(config)
    outputs.check_folder(out)
    with phases() as shown:
        with shown.phase("reading") as advance:
            measurements = settings.read_log(log, advance)
        with shown.phase("injecting") as advance:
            found = challenge(
                settings, measurements, log.parent, seeds=seeds, seed=seed, risks=risk or RISKS,
                kinds=kind or KINDS, progress=advance,
            )  # fmt: skip
    out.mkdir(parents=True, exist_ok=True)
    if outputs.can_plot():
        outputs.save_figure(make_figure(found, log.name), out / "figure.png")
    del found["points"]
    numbers: dict[str, Any] = {"log": str(log), "config": str(config), **found}
    numbers["report"] = report(numbers)
    tables.plain(out / "inject.json", numbers)
    outputs.show_report(numbers, out, json=json)
