"""Tracks: the natural cubic spline through points over the length of the polyline through them.

SciPy's spline, each coordinate by itself; straight beyond its ends (a natural
spline has no second derivative there, so the straight line goes on smoothly).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from oracle.step import Array


@dataclass(frozen=True)
class Spline:
    """c(l) through points (k, 3) [m] at mileages knots (k,) [m]."""

    points: Array
    knots: Array
    origin: Array  # (3,), taken off before anything is computed
    curve: CubicSpline[np.float64]

    @property
    def low(self) -> float:
        return float(self.knots[0])

    @property
    def high(self) -> float:
        return float(self.knots[-1])

    def position(self, l: Array | float) -> Array:  # noqa: E741
        """(..., 3)."""
        at = np.asarray(l, dtype=np.float64)
        inside = np.clip(at, self.low, self.high)
        beyond = (at - inside)[..., None] * self.curve(inside, 1)
        return np.asarray(self.origin + self.curve(inside) + beyond)

    def tangent(self, l: Array | float) -> Array:  # noqa: E741
        """dc/dl (..., 3); not of unit length."""
        return np.asarray(self.curve(np.clip(l, self.low, self.high), 1))

    def bend(self, l: Array | float) -> Array:  # noqa: E741
        """d2c/dl2 (..., 3), zero beyond the ends."""
        at = np.asarray(l, dtype=np.float64)
        inside = (at >= self.low) & (at <= self.high)
        second = self.curve(np.clip(at, self.low, self.high), 2)
        return np.where(inside[..., None], second, 0.0)

    def curvature(self, l: Array | float) -> Array:  # noqa: E741
        """|c' x c''| / |c'|^3 (...) [1/m]."""
        first = self.tangent(l)
        turn = np.linalg.norm(np.cross(first, self.bend(l)), axis=-1)
        return np.asarray(turn / np.linalg.norm(first, axis=-1) ** 3)

    def polyline(self, l: Array) -> Array:  # noqa: E741
        """(..., 3): the straight lines between the points, at the same mileage."""
        columns = [np.interp(l, self.knots, column) for column in self.points.T]
        return np.stack(columns, axis=-1)

    def nearest(self, x: Array) -> float:
        """Mileage of the point of the track nearest to x (3,): the best of a dense search, then
        where (c - x) . c' is zero beside it."""
        beyond = 0.2 * (self.high - self.low)
        tried = np.linspace(self.low - beyond, self.high + beyond, 20_001)
        k = int(np.argmin(np.linalg.norm(self.position(tried) - x, axis=1)))
        low, high = tried[max(k - 1, 0)], tried[min(k + 1, len(tried) - 1)]

        def ahead(at: float) -> float:
            return float((self.position(at) - x) @ self.tangent(at))

        return float(brentq(ahead, low, high, xtol=1e-9))


def spline(points: Array, start: float = 0.0) -> Spline:
    """Points (k, 3), all different from their predecessors."""
    steps = np.sqrt(np.sum(np.diff(points, axis=0) ** 2, axis=1))
    knots = start + np.concatenate([[0.0], np.cumsum(steps)])
    origin = points.mean(axis=0)
    return Spline(points, knots, origin, CubicSpline(knots, points - origin, bc_type="natural"))
