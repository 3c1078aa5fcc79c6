"""Critical biases of the satellites, as noncentralities (Lacresse, Grall & Nikiforov 2005, sections
5.2 and 5.3)."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from math import erfc, sqrt

import numpy as np

from surefix.core.checks import FloatArray
from surefix.raim.chi_squared import noncentrality
from surefix.studies.lacresse_sine import ALPHA, GAMMA, KD, SineTrack

RISK, FAULT = 1e-7, 1e-4  # p_r of the position, p_f of a satellite; the paper states neither
NARROW = 1 + 1e-8  # quotient of the ends at which a bisection stops


def bisect(value: Callable[[float], float], low: float, high: float) -> float:
    """Where ``value``, which rises, passes 0 between low > 0 and high; nan where it does not."""
    if not value(low) <= 0 <= value(high):
        return float("nan")
    while high > low * NARROW:
        middle = sqrt(low * high)
        low, high = (low, middle) if value(middle) > 0 else (middle, high)
    return sqrt(low * high)


def beyond(half: float, shift: float, sigma: float) -> float:
    """P(|l̂ - l| > half), l̂ shifted and with that standard deviation."""
    scale = sigma * sqrt(2)
    return (erfc((half - shift) / scale) + erfc((half + shift) / scale)) / 2


def effects(track: SineTrack) -> tuple[float, FloatArray]:
    """σ_l [m] of the position k_d l by least squares; and (n,), for every satellite, √λ of the bias
    that shifts the position by 1 m."""
    model = track.model()
    H = model.test.whitening @ np.hstack([model.A / KD, track.sky.clocks])
    gain = np.linalg.pinv(H)[0]  # shift by a unit of whitened bias
    parity = np.linalg.norm(model.W, axis=0)  # its √λ
    return float(np.linalg.norm(gain)), parity / np.abs(gain)


@lru_cache
def just_missed(degrees: int) -> float:
    """λ_γ of the fault that is missed with probability γ."""
    return float(noncentrality(GAMMA, degrees, ALPHA))


def shortest_interval(track: SineTrack) -> float:
    """L [m], the length of the protection interval at which p* = γ: the critical bias of the
    satellite that shows least has λ_γ."""
    sigma, root = effects(track)
    shift = sqrt(just_missed(track.model().degrees)) / float(root.min())
    return 2 * bisect(
        lambda half: RISK / FAULT - beyond(half, shift, sigma), 1e-3 * sigma, shift + 40 * sigma
    )


def critical(track: SineTrack, length: float) -> FloatArray:
    """λ (n,) of every satellite's v_i*, the bias at which P(|l̂ - l| > L/2) p_f = p_r."""
    sigma, root = effects(track)
    shift = bisect(lambda mu: beyond(length / 2, mu, sigma) - RISK / FAULT, 1e-6 * sigma, length)
    return np.square(shift * root)
