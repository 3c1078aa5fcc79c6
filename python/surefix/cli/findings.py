"""What commands show of a result, whichever filter made it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
from rich.console import Console

from surefix.cli import report, robust_report
from surefix.cli.robust_summary import robust_event_table, summarise_robust
from surefix.cli.summary import AnyResult, event_table, summarise
from surefix.config import Config
from surefix.core.checks import FloatArray
from surefix.plots import plot_result, plot_robust
from surefix.robust.result import RobustResult
from surefix.tables import Columns

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def find(
    result: AnyResult, config: Config, reference: tuple[FloatArray, FloatArray] | None
) -> tuple[dict[str, Any], Columns]:
    """The summary and the table of events."""
    if isinstance(result, RobustResult):
        return summarise_robust(result, config, reference), robust_event_table(result)
    return summarise(result, config, reference), event_table(result, config.output.false_alarm)


def marked(result: AnyResult, config: Config) -> npt.NDArray[np.bool_]:
    """Rows that were rejected by a robust filter, flagged by a linear one (N,)."""
    if isinstance(result, RobustResult):
        return result.rejected
    return result.flagged(config.output.false_alarm)


def draw(result: AnyResult, config: Config, **options: Any) -> Figure:
    """The figure; ``options`` are those that all figures have."""
    if isinstance(result, RobustResult):
        return plot_robust(result, **options)
    return plot_result(result, false_alarm=config.output.false_alarm, **options)


def show(console: Console, summary: Mapping[str, Any]) -> None:
    """Prints the summary."""
    if "rejected" in summary:
        robust_report.print_robust_sensors(console, summary)
        console.print()
        robust_report.print_limits(console, summary)
    else:
        report.print_sensors(console, summary)
        console.print()
        report.print_estimates(console, summary)
