"""What the error of the affine model does at worst, by looking at all of K: the bounds of
``lacresse_bounds`` must hold there, and the tight ones must be reached."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from surefix.core.checks import FloatArray
from surefix.raim.affine import AffineModel
from surefix.raim.chi_squared import missed, power
from surefix.studies.lacresse_critical import critical, just_missed
from surefix.studies.lacresse_sine import ALPHA, GAMMA, SineTrack

GRID, ROUNDS = 801, 2  # points of K, and how often the neighbourhood of the best is searched again


@dataclass(frozen=True)
class Worst:
    """``b``: the largest ‖W E(l)‖, at ``l``; ``e1``: the power lost there, of a fault of λ_γ that
    points the other way, and ``e2``: the false alarms gained there. ``missed_satellite``: the
    largest probability that the critical bias of one satellite is missed, which is the
    ``satellite``-th, of that ``sign``, at ``l_satellite``; ``p_star``: the largest with no error.
    """

    l: float  # noqa: E741
    b: float
    e1: float
    e2: float
    satellite: int
    sign: float
    l_satellite: float
    missed_satellite: float
    p_star: float

    @property
    def e1_satellite(self) -> float:
        """What faults of single satellites really lose."""
        return self.missed_satellite - self.p_star


def parity_error(track: SineTrack, model: AffineModel, l: FloatArray) -> FloatArray:  # noqa: E741
    """W E(l) (k, n - q), whitened, at l (k,)."""
    X = l[:, None]
    error = track.distances(X) - X @ model.A.T - model.B
    return np.asarray(error @ (model.W @ model.test.whitening).T)


def worst(track: SineTrack, length: float) -> Worst:
    """By the paper's fit. ``length``: L [m], which the critical biases belong to."""
    model = track.model()
    degrees, least = model.degrees, just_missed(model.degrees)
    at, b = search(lambda l: np.linalg.norm(parity_error(track, model, l), axis=1))  # noqa: E741
    root = np.sqrt(critical(track, length))
    unit = model.W / np.linalg.norm(model.W, axis=0)  # of a bias of each satellite

    def left(l: FloatArray) -> FloatArray:  # noqa: E741
        """λ_t (k, n) of the critical biases, of the sign that shows less."""
        error = parity_error(track, model, l)
        square = np.square(error).sum(axis=1, keepdims=True)
        return np.asarray(np.square(root) - 2 * root * np.abs(error @ unit) + square)

    place, least_left = search(lambda l: -left(l).min(axis=1))  # noqa: E741
    here = np.array([place])
    satellite = int(np.argmin(left(here)[0]))
    sign = -float(np.sign(parity_error(track, model, here)[0] @ unit[:, satellite]))
    return Worst(
        at, b,
        float(missed(max(np.sqrt(least) - b, 0.0) ** 2, degrees, ALPHA)) - GAMMA,
        float(power(b * b, degrees, ALPHA)) - ALPHA,
        satellite, sign, place,
        float(missed(max(-least_left, 0.0), degrees, ALPHA)),
        float(missed(np.square(root).min(), degrees, ALPHA)),
    )  # fmt: skip


def search(value: Callable[[FloatArray], FloatArray]) -> tuple[float, float]:
    """(l, value): the largest ``value`` over K, l (k,) to (k,)."""
    low, high = 0.0, 1.0
    for _ in range(ROUNDS):
        at = np.linspace(low, high, GRID)
        found = value(at)
        k = int(np.argmax(found))
        low, high = at[max(k - 1, 0)], at[min(k + 1, GRID - 1)]
    return float(at[k]), float(found[k])
