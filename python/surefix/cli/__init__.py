"""The command line: ``surefix demo | run | study | info``."""

from __future__ import annotations

import sys
from collections.abc import Sequence


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line (by default with the process's arguments) and returns its exit code:
    0, 1 for an error, 2 for wrong usage, 3 if it ran and something did not fit."""
    try:
        import rich  # noqa: F401
        import typer  # noqa: F401
    except ImportError as error:
        needed = "the command line needs typer and rich: pip install surefix[cli]"
        print(f"error: {needed} ({error})", file=sys.stderr)
        return 1
    from surefix.cli.app import app

    try:
        app(args=None if arguments is None else list(arguments), prog_name="surefix")
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else 1
    return 0
