"""One epoch of pseudoranges on a known track, by least squares over mileage and clocks.

Lacresse et al. 2005, (11)-(12): r_i = d_i(l) + c t_system + noise. The unknowns are all kept: the
whitened Jacobian J (n, 1 + systems) has the slope of d_i and a one for the clock of i's system,
each over sigma_i; steps are ``numpy.linalg.lstsq``'s, until the mileage stands still.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np

from oracle.raim_linear import SINGULAR
from oracle.step import Array

LIGHT = 299792458.0  # [m/s]
EARTH_RATE = 7.2921151467e-5  # [rad/s], WGS-84


class Track(Protocol):
    def position(self, l: float) -> Array: ...  # noqa: E741
    def tangent(self, l: float) -> Array: ...  # noqa: E741


@dataclass(frozen=True)
class Epoch:
    satellite: Array  # (n, 3) [m]
    pseudorange: Array  # (n,) [m]
    sigma: Array  # (n,) [m]
    system: tuple[str, ...]  # (n,)
    rotation: bool = False  # whether the satellites' positions are at transmission, Earth-fixed

    @property
    def n(self) -> int:
        return int(self.sigma.size)

    @property
    def systems(self) -> tuple[str, ...]:
        return tuple(sorted(set(self.system)))

    def without(self, gone: Sequence[int]) -> Epoch:
        kept = [i for i in range(self.n) if i not in set(gone)]
        return Epoch(self.satellite[kept], self.pseudorange[kept], self.sigma[kept],
                     tuple(self.system[i] for i in kept), self.rotation)  # fmt: skip

    def with_bias(self, i: int, bias: float) -> Epoch:
        moved = self.pseudorange.copy()
        moved[i] += bias
        return replace(self, pseudorange=moved)

    def ranges(self, x: Array) -> Array:
        """d_i of the receiver's position x (3,), (n,). The Earth turns while the signal is on its
        way: omega / c (x_s y_r - y_s x_r) longer, to the first order."""
        s = self.satellite
        turn = EARTH_RATE / LIGHT * (s[:, 0] * x[1] - s[:, 1] * x[0]) if self.rotation else 0.0
        return np.asarray(np.linalg.norm(s - x, axis=1) + turn)

    def slopes(self, x: Array, direction: Array) -> Array:
        """d d_i along a direction (3,) at x, (n,)."""
        s = self.satellite
        unit = (s - x) / np.linalg.norm(s - x, axis=1)[:, None]
        turn = s[:, 0] * direction[1] - s[:, 1] * direction[0]
        return np.asarray(-unit @ direction + (EARTH_RATE / LIGHT * turn if self.rotation else 0.0))


@dataclass(frozen=True)
class Solution:
    along: float
    clock: dict[str, float]  # [m]
    J: Array  # (n, 1 + systems), whitened, at the solution
    r: Array  # (n,) whitened residuals

    @cached_property
    def hat(self) -> Array:
        """J J^+, (n, n)."""
        return self.J @ np.linalg.pinv(self.J)

    @cached_property
    def gain(self) -> Array:
        """Effect of whitened measurements on the mileage (n,): the first row of J^+."""
        return np.asarray(np.linalg.pinv(self.J)[0])

    @property
    def sigma(self) -> float:
        return float(np.linalg.norm(self.gain))

    @property
    def degrees(self) -> int:
        return int(self.J.shape[0] - self.J.shape[1])

    @property
    def statistic(self) -> float:
        return float(self.r @ self.r)


def estimable(J: Array) -> bool:
    return bool(len(J) >= J.shape[1] and np.linalg.matrix_rank(J, rtol=SINGULAR) == J.shape[1])


def linearised(epoch: Epoch, track: Track, l: float) -> tuple[Array, Array]:  # noqa: E741
    """Whitened pseudoranges less distances (n,), and the whitened J, at mileage l."""
    x, systems = track.position(l), epoch.systems
    clocks = np.array([[float(s == name) for name in systems] for s in epoch.system])
    J = np.column_stack([epoch.slopes(x, track.tangent(l)), clocks]) / epoch.sigma[:, None]
    return (epoch.pseudorange - epoch.ranges(x)) / epoch.sigma, J


def solve(epoch: Epoch, track: Track, near: float) -> Solution:
    """Iterated from mileage ``near``."""
    along = near
    for _ in range(60):
        y, J = linearised(epoch, track, along)
        step = np.linalg.lstsq(J, y, rcond=None)[0]
        along += float(step[0])
        if abs(step[0]) < 1e-8 * (1.0 + float(np.linalg.norm(np.linalg.pinv(J)[0]))):
            break
    else:
        raise ArithmeticError(f"no convergence from {near}")
    y, J = linearised(epoch, track, along)
    found = np.linalg.lstsq(J[:, 1:], y, rcond=None)[0]
    clock = dict(zip(epoch.systems, found.tolist(), strict=True))
    return Solution(along, clock, J, y - J[:, 1:] @ found)
