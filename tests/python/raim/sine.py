"""The paper's example (section 5.3): a sine track below eight satellites, and its distances."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from oracle.step import Array

KD = 1000.0  # [m] of track for l = 1
SIGMA = 5.0
SATELLITES = 8


def directions() -> Array:
    """(8, 3) in east, north, up."""
    rng = np.random.RandomState(8)
    azimuth = rng.uniform(0.0, 2.0 * np.pi, SATELLITES)
    up = np.sin(rng.uniform(0.2, 1.4, SATELLITES))
    flat = np.sqrt(1.0 - up**2)
    return np.stack([flat * np.sin(azimuth), flat * np.cos(azimuth), up], axis=1)


def position(amplitude: float, l: Array) -> Array:  # noqa: E741
    """(k, 3) of l (k,): x = k_d l, y = v sin(2 pi l), z = 0."""
    return np.stack([KD * l, amplitude * np.sin(2 * np.pi * l), 0.0 * l], axis=-1)


def distances(amplitude: float) -> Callable[[Array], Array]:
    """h: X = l (k, 1) -> (k, 8) [m], less the distance at l = 0."""
    satellites = 2.2e7 * directions()

    def h(X: Array) -> Array:
        x = position(amplitude, X[:, 0])
        ranges = np.linalg.norm(satellites - x[:, None, :], axis=2)
        return np.asarray(ranges - np.linalg.norm(satellites, axis=1))

    return h


def bend(amplitude: float) -> Array:
    """(8, 1), a bound on |h_i''|: |u . c''| + |c'|^2 / (distance less a kilometre)."""
    u = np.abs(directions()[:, 1])
    # the direction to a satellite turns by less than 1e-4 over a kilometre
    second = (u + 1e-4) * amplitude * (2 * np.pi) ** 2
    speed = KD**2 + (2 * np.pi * amplitude) ** 2
    return np.asarray(second + speed / (2.2e7 - 2e3))[:, None]
