"""``surefix validate``: measures the risk that the alert limits claim."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from surefix import tables
from surefix.cli import outputs
from surefix.cli.terminal import phases, reports_errors
from surefix.validation import measure
from surefix.validation.report import make_figure, report
from surefix.validation.violations import SETTINGS


@reports_errors
def validate(
    runs: Annotated[int, typer.Option(help="Simulated runs of each setting.")] = measure.RUNS,
    seed: Annotated[int, typer.Option(help="Seed of the simulation.")] = measure.SEED,
    setting: Annotated[
        list[str] | None, typer.Option(help="Only this setting; may be given several times.")
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder for what is written.")] = Path("validate"),
    json: Annotated[bool, typer.Option("--json", help="Numbers as JSON on stdout.")] = False,
) -> None:
    """Measure the risk of the alert limits against what they claim.

    Runs are simulated under the model that the robust filter assumes, and under models that break
    one assumption: drifts that wander faster, a latency that is wrong, more noise, a common fault.
    """
    names = setting or list(SETTINGS)
    outputs.check_folder(out)
    with phases() as shown, shown.phase("measuring") as advance:
        numbers = measure.validate(runs, seed, settings=names, progress=advance)
    numbers["report"] = report(numbers)
    out.mkdir(parents=True, exist_ok=True)
    tables.plain(out / "validate.json", numbers)
    if outputs.can_plot():
        outputs.save_figure(make_figure(numbers), out / "figure.png")
    outputs.show_report(numbers, out, json=json)
