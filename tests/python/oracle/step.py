"""One estimation step of Bilenne 2004, eq. (4): N observations between two estimation times.

The state x (n,) moves along N+1 legs; measurement i is made after leg i, and leg N+1 leads to the
estimation time:

    x_i = F_i x_{i-1} + G_i u_i + w_i,    y_i = H_i x_i + J_i u_i + v_i.

Python counts from 0, the paper from 1: ``F[i - 1]`` is the paper's F_i.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

Array: TypeAlias = NDArray[np.float64]
Arrays: TypeAlias = tuple[Array, ...]


@dataclass(frozen=True)
class Step:
    """The data of one step. What is left empty gets its default: no inputs, Upsilon = diag{R_i}."""

    F: Arrays  # N+1 transitions (n, n)
    Q: Arrays  # N+1 process noise covariances (n, n), perhaps singular or zero
    H: Arrays  # N observation matrices (m_i, n)
    R: Arrays  # N measurement noise covariances (m_i, m_i)
    z: Arrays  # N measurements (m_i,)
    u: Arrays = ()  # N+1 known inputs (p,)
    G: Arrays = ()  # N+1 input matrices (n, p)
    J: Arrays = ()  # N feed-through matrices (m_i, p)
    Upsilon: Array = field(default_factory=lambda: np.zeros((0, 0)))  # (M, M), M = sum of m_i

    def __post_init__(self) -> None:
        if not len(self.F) == len(self.Q) == len(self.H) + 1 == len(self.R) + 1 == len(self.z) + 1:
            raise ValueError("N observations need N+1 legs")
        u = self.u or (np.zeros(0),) * len(self.F)
        p = u[0].size
        defaults = {
            "u": u,
            "G": self.G or (np.zeros((self.n, p)),) * len(self.F),
            "J": self.J or tuple(np.zeros((z.size, p)) for z in self.z),
            "Upsilon": self.Upsilon if self.Upsilon.size else block_diagonal(self.R),
        }
        for name, value in defaults.items():
            object.__setattr__(self, name, value)  # the class is frozen

    @property
    def n(self) -> int:
        """Dimension of the state."""
        return int(self.F[0].shape[0])

    @property
    def N(self) -> int:
        """Number of observations."""
        return len(self.z)

    @property
    def M(self) -> int:
        """Number of scalar measurements."""
        return sum(z.size for z in self.z)

    @property
    def rows(self) -> list[slice]:
        """Where each observation sits in the composite vector z = vect{y_1, ..., y_N}, eq. (35)."""
        ends = np.cumsum([z.size for z in self.z], dtype=int)
        return [slice(int(end) - z.size, int(end)) for end, z in zip(ends, self.z, strict=True)]

    def transition(self, i: int, j: int) -> Array:
        """F_j ... F_{i+1}, from observation i to observation j >= i (0: start, N+1: end)."""
        product = np.eye(self.n)
        for F in self.F[i:j]:
            product = F @ product
        return product


@dataclass(frozen=True)
class Posterior:
    """What one composite step yields."""

    x: Array  # (n,) estimate of the state at the end of the step
    P: Array  # (n, n) its covariance
    gamma: Array  # (M,) innovation, eq. (17)
    Gamma: Array  # (M, M) its covariance, eq. (18)
    K: Array  # (n, M) gain


def block_diagonal(blocks: Sequence[Array]) -> Array:
    """diag{B_1, B_2, ...}; of nothing, the empty matrix."""
    size = sum(len(block) for block in blocks)
    result = np.zeros((size, size))
    end = 0
    for block in blocks:
        result[end : end + len(block), end : end + len(block)] = block
        end += len(block)
    return result


def concatenate(vectors: Sequence[Array]) -> Array:
    """vect{a_1, a_2, ...}; of nothing, the empty vector."""
    return np.concatenate([np.zeros(0), *vectors])


def solve(A: Array, B: Array) -> Array:
    """A^{-1} B for A symmetric positive definite.

    By Cholesky, whose error does not depend on the units chosen for the rows of A.
    """
    if A.size == 0:
        return np.zeros_like(B)
    return np.asarray(cho_solve(cho_factor(A, lower=True), B))


def log_determinant(A: Array) -> float:
    """log det A for A symmetric positive definite."""
    return 2.0 * float(np.sum(np.log(np.diag(np.linalg.cholesky(A))))) if A.size else 0.0


def symmetric(P: Array) -> Array:
    """The symmetric part: what rounding leaves of the other part has no meaning."""
    return 0.5 * (P + P.T)
