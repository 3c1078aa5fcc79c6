"""What commands share at the terminal: errors in one line, progress on stderr."""

from __future__ import annotations

import functools
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import ParamSpec, TypeVar

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from surefix.errors import SurefixError

P = ParamSpec("P")
R = TypeVar("R")


def reports_errors(command: Callable[P, R]) -> Callable[P, R]:
    """A command whose errors are one line on stderr and exit code 1."""

    @functools.wraps(command)
    def wrapped(*args: P.args, **kwargs: P.kwargs) -> R:
        try:
            return command(*args, **kwargs)
        except (SurefixError, OSError) as error:
            text = " ".join(str(error).splitlines())
        except MemoryError:
            text = "out of memory"
        typer.echo(f"error: {text}", err=True)
        raise typer.Exit(1)

    return wrapped


class Phases:
    """Progress over the phases of a command, each a bar of its own."""

    def __init__(self, progress: Progress) -> None:
        self._progress = progress

    @contextmanager
    def phase(self, name: str) -> Iterator[Callable[[int, int], None]]:
        """Shows ``name`` while it lasts; gives a function (done, total) that moves its bar."""
        task = self._progress.add_task(name, total=None)

        def advance(done: int, total: int) -> None:
            self._progress.update(task, completed=done, total=max(total, 1))

        yield advance
        self._progress.update(task, completed=1, total=1)


@contextmanager
def phases() -> Iterator[Phases]:
    """Progress bars on stderr if that is a terminal; they vanish at the end."""
    columns = TextColumn("{task.description:<10}"), BarColumn(), TimeElapsedColumn()
    disable = not sys.stderr.isatty()
    with Progress(*columns, console=Console(stderr=True), transient=True, disable=disable) as bars:
        yield Phases(bars)
