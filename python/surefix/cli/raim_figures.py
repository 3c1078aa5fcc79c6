"""The figures that ``surefix raim`` writes."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from surefix.cli import outputs
from surefix.cli.raim_monitored import Monitored
from surefix.plots.raim import draw_availability, draw_raim, draw_stanford
from surefix.raim.availability import AvailabilityMap


def save(
    monitored: Monitored, line: AvailabilityMap | None, folder: Path, names: tuple[str, str]
) -> None:
    """raim.png; with a truth stanford.png, of the positions that may be used; with a ``line``
    availability.png. ``names``: titles, of the pseudoranges and of the track."""
    result, monitor, truth = monitored.result, monitored.monitor, monitored.inputs.truth
    along = None if truth is None else truth.along
    outputs.save_figure(draw_raim(result, along, title=names[0]), folder / "raim.png")
    if along is not None:
        error = np.where(result.usable, result.along - along, np.nan)
        figure = draw_stanford(error, result.protection, monitor.length / 2, title=names[0])
        outputs.save_figure(figure, folder / "stanford.png")
    if line is not None:
        figure = draw_availability(line, missed=monitor.missed, title=names[1])
        outputs.save_figure(figure, folder / "availability.png")
