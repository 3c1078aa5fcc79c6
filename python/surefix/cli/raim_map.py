"""The availability map of ``surefix raim``: the first epoch's satellites along the whole track."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from surefix.cli.raim_monitored import Inputs, Monitored, spread
from surefix.core.checks import FloatArray
from surefix.errors import ConfigError
from surefix.raim.availability import AvailabilityMap, availability


def draw_up(
    monitored: Monitored, step: float, progress: Callable[[int, int], None]
) -> tuple[AvailabilityMap, float]:
    """The map, at every ``step`` [m], and the time [s] of the epoch whose satellites it has: all
    that the file has with a finite position and σ, for the masks decide what is seen from where."""
    inputs = monitored.inputs
    data, config = inputs.data, inputs.config
    epoch = _first(monitored)
    rows = np.arange(data.begin[epoch], data.begin[epoch + 1])
    rows = rows[monitored.finite[rows]]
    given = config.monitor.arguments().items()
    arguments = {k: v for k, v in given if k not in ("max_excluded", "max_speed")}
    found = availability(
        inputs.track, data.position[rows], system=data.system[rows].tolist(),
        sigma=_sigma(inputs, data.sigma[rows]), step=step,
        elevation_mask=config.pseudoranges.elevation_mask, masks=config.masks, progress=progress,
        earth_rotation=config.pseudoranges.earth_rotation, **arguments,
    )  # fmt: skip
    return found, float(data.epoch_time[epoch])


def _first(monitored: Monitored) -> int:
    """The first epoch that has a satellite."""
    epochs = monitored.inputs.data.epoch[monitored.finite]
    if len(epochs) == 0:
        raise ConfigError("--availability: expected a satellite with a position and σ, got none")
    return int(epochs[0])


def _sigma(inputs: Inputs, sigma: FloatArray) -> Callable[[FloatArray], FloatArray]:
    """σ of the elevations at all places, those of one place together."""

    def of(elevation: FloatArray) -> FloatArray:
        return spread(inputs, elevation, np.tile(sigma, len(elevation) // len(sigma)))

    return of
