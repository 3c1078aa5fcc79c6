"""False alarms and missed faults of the affine model's test, drawn. Both are rare: they are drawn
from another density and weighted (importance sampling)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from surefix.core.checks import FloatArray
from surefix.raim.affine import AffineModel
from surefix.studies.lacresse_sine import SineTrack
from surefix.studies.lacresse_worst import parity_error

CLOCK = 1e5  # deviation [m] of the receiver clocks; the test does not see them


@dataclass(frozen=True)
class Share:
    """A probability as measured, and its standard error."""

    value: float
    error: float


def false_alarms(track: SineTrack, l: float, runs: int, seed: int) -> Share:  # noqa: E741
    """At l, with no fault. The noise is widened in the parity space until Λ is about the threshold
    on average."""
    model = track.model()
    moved = float(np.square(parity_error(track, model, np.array([l]))).sum())
    scale = float(np.sqrt(max((model.test.threshold - moved) / model.degrees, 1.0)))
    centre = np.zeros(model.degrees)
    alarm, weight = _run(track, model, l, np.zeros(len(model.A)), centre, scale, runs, seed)
    return _share(alarm * weight)


def missed_faults(track: SineTrack, l: float, bias: FloatArray, runs: int, seed: int) -> Share:  # noqa: E741
    """At l, with a bias (n,) [m]. The noise is moved against what the test sees, until most of it
    is near the threshold."""
    model = track.model()
    seen = model.W @ model.test.whitening @ bias + parity_error(track, model, np.array([l]))[0]
    size = float(np.linalg.norm(seen))
    rest = max(model.test.threshold - (model.degrees - 1), 0.0)  # of which the noise needs d - 1
    centre = -seen / size * max(size - float(np.sqrt(rest)), 0.0)
    alarm, weight = _run(track, model, l, bias, centre, 1.0, runs, seed)
    return _share(~alarm * weight)


def _run(
    track: SineTrack,
    model: AffineModel,
    l: float,  # noqa: E741
    bias: FloatArray,
    centre: FloatArray,
    scale: float,
    runs: int,
    seed: int,
) -> tuple[np.ndarray[tuple[int], np.dtype[np.bool_]], FloatArray]:
    """Alarms (runs,) of whole epochs Y = D(l) + clocks + noise + bias, and their weights. In the
    parity space the noise is N(centre, scale² I) instead of N(0, I), elsewhere as it is."""
    rng = np.random.RandomState(seed)
    n, clocks = track.sky.clocks.shape
    z = rng.standard_normal((runs, n))
    parity = z @ model.W.T
    drawn = centre + scale * parity
    noise = (z + (drawn - parity) @ model.W) @ model.test.root.T
    log_weight = (np.square(parity) - np.square(drawn)).sum(axis=1) / 2
    weight = scale**model.degrees * np.exp(log_weight)
    clock = CLOCK * rng.standard_normal((runs, clocks)) @ track.sky.clocks.T
    Y = track.distances(np.array([[l]])) + clock + noise + bias
    statistic = np.asarray(model.test.noncentrality(Y - model.B))  # as run(Y) has, without p-values
    return statistic >= model.test.threshold, weight


def _share(terms: FloatArray) -> Share:
    return Share(float(terms.mean()), float(terms.std(ddof=1) / np.sqrt(len(terms))))
