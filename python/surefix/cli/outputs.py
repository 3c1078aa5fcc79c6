"""The files of a run's folder."""

from __future__ import annotations

import importlib.util
import os
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer
from rich.console import Console

from surefix import tables
from surefix.errors import ConfigError
from surefix.tables import Columns

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PLOT_DPI = 150

TABLES = ("estimates", "events", "summary")


def check_folder(folder: Path) -> None:
    """Raises ConfigError if ``folder`` cannot be made or written: before the work, not after it."""
    nearest = next(path for path in (folder, *folder.absolute().parents) if path.exists())
    if not nearest.is_dir() or not os.access(nearest, os.W_OK):
        raise ConfigError(f"--out: expected a folder that can be written, got {folder}")


def spare_inputs(folder: Path, names: Iterable[str], inputs: Iterable[Path]) -> None:
    """Raises ConfigError if a file of that name in ``folder`` is one of the inputs."""
    for name in names:
        for path in inputs:
            if (folder / name).exists() and path.exists() and path.samefile(folder / name):
                raise ConfigError(f"--out: {folder / name} is an input, it would be overwritten")


def write_tables(
    folder: Path,
    estimates: Columns,
    events: Columns,
    summary: Mapping[str, Any],
    *,
    both: bool = True,
    progress: Callable[[int, int], None] | None = None,
) -> None:
    """Writes estimates, events and summary, each as CSV and JSON if ``both``; otherwise the tables
    as CSV and the summary as JSON."""
    folder.mkdir(parents=True, exist_ok=True)
    tables.write_csv(folder / "estimates.csv", estimates, progress)
    tables.write_csv(folder / "events.csv", events)
    tables.plain(folder / "summary.json", summary)
    if both:
        tables.write_columns_json(folder / "estimates.json", estimates)
        tables.write_columns_json(folder / "events.json", events)
        tables.write_flat_csv(folder / "summary.csv", summary)


def show_report(
    numbers: Mapping[str, Any], folder: Path, *, json: bool, title: str | None = None
) -> None:
    """Numbers as JSON, or their ``report`` line by line and where the files are, on stdout."""
    if json:
        typer.echo(tables.as_json(numbers))
        return
    console = Console(highlight=False)
    if title is not None:
        console.print(f"[bold]{title}[/]\n")
    for line in numbers["report"]:
        console.print(line, markup=False, soft_wrap=True)
    console.print(f"\nwritten to {folder}", markup=False, soft_wrap=True)


def can_plot() -> bool:
    """Whether figures can be drawn; if not, says on stderr what is missing."""
    if importlib.util.find_spec("matplotlib") is not None:
        return True
    typer.echo("note: no figure without matplotlib: pip install surefix[plot]", err=True)
    return False


def save_figure(figure: Figure, path: Path) -> None:
    """Writes a figure as PNG."""
    figure.savefig(path, dpi=PLOT_DPI)
