"""What the error of the affine model does at worst, by looking at all of K: the bounds of
``lacresse_bounds`` must hold there, and the tight ones must be reached."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from surefix.core.checks import FloatArray
from surefix.raim.affine import AffineModel
from surefix.raim.power import missed, power
from surefix.studies.lacresse_critical import bisect, critical, just_missed
from surefix.studies.lacresse_sine import ALPHA, GAMMA, SineTrack

GRID, ROUNDS = 2001, 4  # points of K, and how often the neighbourhood of the best is searched again


@dataclass(frozen=True)
class Worst:
    """``b``: the largest ‖W E(l)‖, at ``l``; ``e1``: the power lost there, of a fault of λ_γ that
    points the other way, and ``e2``: the false alarms gained there. ``e1_satellite``: how much more
    often than p* the critical bias of one satellite, the ``satellite``-th, of that ``sign``, is
    missed, at ``l_satellite``."""

    l: float  # noqa: E741
    b: float
    e1: float
    e2: float
    satellite: int
    sign: float
    l_satellite: float
    e1_satellite: float


def parity_error(track: SineTrack, model: AffineModel, l: FloatArray) -> FloatArray:  # noqa: E741
    """W E(l) (k, n - q), whitened, at l (k,)."""
    X = l[:, None]
    error = track.distances(X) - X @ model.A.T - model.B
    return error @ (model.W @ model.test.whitening).T


def search(value: Callable[[FloatArray], FloatArray]) -> tuple[float, float]:
    """(l, value): the largest ``value`` over K, l (k,) to (k,)."""
    low, high = 0.0, 1.0
    for _ in range(ROUNDS):
        at = np.linspace(low, high, GRID)
        found = value(at)
        k = int(np.argmax(found))
        low, high = at[max(k - 1, 0)], at[min(k + 1, GRID - 1)]
    return float(at[k]), float(found[k])


def worst(track: SineTrack, length: float) -> Worst:
    """By the paper's fit. ``length``: L [m], which the critical biases belong to."""
    model = track.model()
    at, b = search(lambda l: np.linalg.norm(parity_error(track, model, l), axis=1))  # noqa: E741
    degrees, least = model.degrees, just_missed(model.degrees)
    root = np.sqrt(critical(track, length))
    unit = model.W / np.linalg.norm(model.W, axis=0)  # of a bias of each satellite

    def nearer(l: FloatArray) -> FloatArray:  # noqa: E741
        """(k, n): by how much the error can reduce λ of the critical biases."""
        error = parity_error(track, model, l)
        along = np.abs(error @ unit)
        return 2 * root * along - np.square(error).sum(axis=1, keepdims=True) - np.square(root)

    place, left = search(lambda l: nearer(l).max(axis=1))  # noqa: E741
    satellite = int(np.argmax(nearer(np.array([place]))[0]))
    sign = -np.sign(parity_error(track, model, np.array([place]))[0] @ unit[:, satellite])
    p_star = float(missed(float(np.square(root.min())), degrees, ALPHA))
    return Worst(
        at, b,
        float(missed(max(np.sqrt(least) - b, 0.0) ** 2, degrees, ALPHA)) - GAMMA,
        float(power(b * b, degrees, ALPHA)) - ALPHA,
        satellite, float(sign), place,
        float(missed(max(-left, 0.0), degrees, ALPHA)) - p_star,
    )  # fmt: skip


def satellite_crossing(make: Callable[[float], SineTrack], length: float) -> float:
    """The amplitude [m] at which the real loss for faults of single satellites passes γ."""
    return bisect(lambda v: worst(make(v), length).e1_satellite - GAMMA, 1e-3, 1e3)
