"""What ``surefix raim`` does: pseudoranges, a track and a configuration in, answers out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from surefix.cli.raim_truth import Truth, read_truth
from surefix.config_raim import RaimConfig
from surefix.core.checks import FloatArray
from surefix.raim.monitor import TrackRaim
from surefix.raim.pseudorange_files import read_pseudoranges
from surefix.raim.pseudoranges import Pseudoranges, elevation_sigma
from surefix.raim.result import BoolArray, RaimResult
from surefix.raim.track import Track
from surefix.raim.track_files import read_track

Progress = Callable[[int, int], None]


@dataclass(frozen=True, eq=False)
class Inputs:
    """What the files hold; ``truth`` None where there is no file with it."""

    config: RaimConfig
    data: Pseudoranges
    track: Track
    truth: Truth | None


@dataclass(frozen=True, eq=False)
class Monitored:
    """The answers, and of every row (N,) ``elevation`` [degrees], whether its numbers were
    ``finite``, and whether it was ``seen``, so that the monitor was given it."""

    inputs: Inputs
    monitor: TrackRaim
    result: RaimResult
    elevation: FloatArray
    finite: BoolArray
    seen: BoolArray


def read(
    config: RaimConfig, pseudoranges: Path, track: Path, truth: Path | None, progress: Progress
) -> Inputs:
    """Reads all files. Raises ConfigError naming file, line and column."""
    columns = config.pseudoranges.columns()
    data = read_pseudoranges(pseudoranges, **columns, progress=progress)
    options = config.track
    line = read_track(
        track, columns=options.columns, height=options.height, tolerance=options.tolerance,
        start=options.start,
    )  # fmt: skip
    known = None
    if truth is not None:
        time = config.truth.time or config.pseudoranges.time
        known = read_truth(truth, config.truth, time, line, data.epoch_time)
    return Inputs(config, data, line, known)


def judge(inputs: Inputs, progress: Progress) -> Monitored:
    """Runs the monitor. Elevations are those above where a first run puts the receiver, which uses
    all that is above the horizon in the middle of the track."""
    data, track, options = inputs.data, inputs.track, inputs.config.pseudoranges
    middle = np.full(data.epochs, (track.low + track.high) / 2)
    rough = _weighed(inputs, _elevation(inputs, middle), -90.0)
    near = inputs.config.monitor.near
    first = make_monitor(inputs, max_excluded=0, max_faults=0).run(rough, near=near)
    elevation = _elevation(inputs, _filled(first, middle))
    monitor = make_monitor(inputs)
    given = _weighed(inputs, elevation, options.elevation_mask)
    result = monitor.run(given, near=near, progress=progress)
    finite = np.isfinite(data.position).all(axis=1) & np.isfinite(data.pseudorange)
    if options.sigma_zenith is None:
        finite &= np.isfinite(data.sigma) & (data.sigma > 0)
    seen = finite & np.isfinite(given.sigma)
    return Monitored(inputs, monitor, result, elevation, finite, seen)


def make_monitor(inputs: Inputs, **changed: Any) -> TrackRaim:
    """The monitor of the configuration, with other arguments."""
    arguments = {**inputs.config.monitor.arguments(), **changed}
    rotation = inputs.config.pseudoranges.earth_rotation
    return TrackRaim(inputs.track, earth_rotation=rotation, **arguments)


def spread(inputs: Inputs, elevation: FloatArray, sigma: FloatArray) -> FloatArray:
    """σ (…) [m] at the elevations (…) [degrees]: the configuration's, or else ``sigma``."""
    zenith = inputs.config.pseudoranges.sigma_zenith
    return sigma if zenith is None else elevation_sigma(elevation, zenith)


def _weighed(inputs: Inputs, elevation: FloatArray, mask: float) -> Pseudoranges:
    """The pseudoranges with their σ; infinity, not to be used, below the mask [degrees]."""
    sigma = spread(inputs, elevation, inputs.data.sigma)
    return inputs.data.with_sigma(np.where(elevation >= mask, sigma, np.inf))


def _elevation(inputs: Inputs, along: FloatArray) -> FloatArray:
    """Of every row (N,) above the mileages of its epochs (T,); NaN without a position."""
    data = inputs.data
    elevation, _ = data.sky(inputs.track.position(along)[data.epoch])
    return elevation


def _filled(result: RaimResult, otherwise: FloatArray) -> FloatArray:
    """Mileages (T,), where there is none that of the nearest epoch in time."""
    known = np.flatnonzero(np.isfinite(result.along))
    if len(known) == 0:
        return otherwise
    time = result.time
    after = np.clip(np.searchsorted(time[known], time), 1, max(len(known) - 1, 1))
    after = np.minimum(after, len(known) - 1)
    before = np.maximum(after - 1, 0)
    closer = np.abs(time - time[known[before]]) <= np.abs(time - time[known[after]])
    return result.along[known[np.where(closer, before, after)]]
