"""``surefix study``: repeats a result of a paper."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from surefix.cli import outputs
from surefix.cli.terminal import phases, reports_errors
from surefix.studies import STUDIES, run_study


@reports_errors
def study(
    name: Annotated[
        str | None, typer.Argument(metavar="NAME", help="Which study; see --list.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder for what is written; by default the name.")
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Numbers as JSON on stdout.")] = False,
    list_: Annotated[bool, typer.Option("--list", help="List the studies.")] = False,
) -> None:
    """Repeat a result of a paper: figure, table and numbers."""
    console = Console(highlight=False)
    if list_:
        for known, study in STUDIES.items():
            console.print(f"[bold]{known}[/]  {study.title}", soft_wrap=True)
        return
    if name is None or name not in STUDIES:
        what = "missing" if name is None else f"unknown study {name!r};"
        raise typer.BadParameter(f"{what} NAME: one of {', '.join(STUDIES)}")
    folder = Path(name) if out is None else out
    with phases() as shown, shown.phase(name) as advance:
        numbers = run_study(name, folder, advance)
    outputs.show_report(numbers, folder, json=json, title=STUDIES[name].title)
