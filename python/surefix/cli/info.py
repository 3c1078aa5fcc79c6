"""``surefix info``: what is installed and its limits."""

from __future__ import annotations

import platform
from importlib import metadata
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console

import surefix
from surefix import _core, tables
from surefix.cli.terminal import reports_errors

OPTIONAL = ("typer", "rich", "matplotlib", "pandas", "pyarrow")


def facts() -> dict[str, Any]:
    """Versions, limits and places."""
    engine = Path(_core.__file__)
    return {
        "surefix": surefix.__version__,
        "python": platform.python_version(),
        "platform": platform.platform(),
        "numpy": np.__version__,
        "optional": {name: _version(name) for name in OPTIONAL},
        "limits": {
            "model_states": _core.MAX_MODEL_STATES,
            "sensors": _core.MAX_SENSORS,
            "time_s": _core.MAX_SECONDS,
            "latency_s": _core.MAX_LATENCY,
        },
        "build": {"engine": engine.name, "size_bytes": engine.stat().st_size},
        "package": str(Path(surefix.__file__).parent),
    }


@reports_errors
def info(
    json: Annotated[bool, typer.Option("--json", help="As JSON on stdout.")] = False,
) -> None:
    """Show versions, limits and where the package lies."""
    found = facts()
    if json:
        typer.echo(tables.as_json(found))
        return
    console = Console(highlight=False)
    for key, value in tables.flattened(found).items():
        text = f"{key:<22}{'not installed' if value is None else value}"
        console.print(text, markup=False, soft_wrap=True)


def _version(name: str) -> str | None:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None
