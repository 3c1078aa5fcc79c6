"""The application: its commands and ``--version``."""

from __future__ import annotations

from typing import Annotated

import typer

from surefix import __version__
from surefix.cli.demo import demo
from surefix.cli.drift import drift
from surefix.cli.info import info
from surefix.cli.inject import inject
from surefix.cli.raim import raim
from surefix.cli.run import run
from surefix.cli.study import study
from surefix.cli.validate import validate

app = typer.Typer(
    name="surefix",
    help="Fuses sensors that report at different times; finds what does not fit.",
    epilog="Exit codes: 0 done, 1 error, 2 wrong usage, 3 done and something did not fit.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
for command in (demo, run, inject, drift, raim, study, validate, info):
    app.command()(command)


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"surefix {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version.")
    ] = False,
) -> None: ...
