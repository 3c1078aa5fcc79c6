"""Tests with a linear nuisance: Y = H X + M theta + noise (Lacresse et al. 2005, section 3).

Whitened first, with a factor of the noise's covariance; then the paper's formulas as they stand:

    P_H = I - H H^+,    Lambda = Y' P_H M (M' P_H M)^+ M' P_H Y      (4)

with the Moore-Penrose inverse where the paper's has none. Lambda does not depend on which factor
whitens, so the symmetric root is taken, not Cholesky's. The same formula of a bias, in place of Y,
is the noncentrality.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np

from oracle.step import Array

Noise: TypeAlias = float | Array
# A singular value below this share of the largest is zero: test matrices are far from it.
SINGULAR = 1e-9


def covariance(noise: Noise, n: int) -> Array:
    """Of a standard deviation, of (n,) standard deviations, or as it is given, (n, n)."""
    given = np.asarray(noise, dtype=np.float64)
    return given if given.ndim == 2 else np.diag(np.broadcast_to(given, n) ** 2)


def whitener(noise: Noise, n: int) -> Array:
    """Sigma^(-1/2), (n, n)."""
    variance, axes = np.linalg.eigh(covariance(noise, n))
    return np.asarray((axes / np.sqrt(variance)) @ axes.T)


def pseudo_inverse(A: Array) -> Array:
    return np.asarray(np.linalg.pinv(A, rcond=SINGULAR)) if A.size else A.T.copy()


def unit(A: Array) -> Array:
    """Columns of length one, or zero: their space is the same, their units do not cost digits."""
    length = np.linalg.norm(A, axis=0)
    return np.asarray(A / np.where(length > 0.0, length, 1.0))


@dataclass(frozen=True)
class Linear:
    """The test of M theta (all of R^n where M is None) beside H X."""

    H: Array  # (n, m), of any rank
    M: Array | None = None  # (n, p), of any rank
    noise: Noise = 1.0

    @cached_property
    def root(self) -> Array:
        return whitener(self.noise, len(self.H))

    @cached_property
    def P(self) -> Array:
        """P_H of the whitened H, (n, n)."""
        H = unit(self.root @ self.H)
        return np.eye(len(H)) - H @ pseudo_inverse(H)

    @cached_property
    def seen(self) -> Array:
        """P_H M of the whitened M, (n, p), without the rounding that is left of a column of H. The
        columns of M are of length one; (4) does not change with theta's units."""
        PM = self.P @ unit(self.root if self.M is None else self.root @ self.M)
        PM[:, np.linalg.norm(PM, axis=0) < SINGULAR] = 0.0
        return PM

    @cached_property
    def rank(self) -> int:
        """q of the paper."""
        return rank(unit(self.root @ self.H))

    @cached_property
    def degrees(self) -> int:
        """rank(P_H M), which is n - q for M = I."""
        return rank(self.seen)

    def statistic(self, Y: Array) -> Array:
        """Lambda (...) of Y (..., n); the noncentrality of a bias."""
        PM = self.seen
        correlated = Y @ self.root @ PM  # (..., p)
        normal = pseudo_inverse(PM.T @ PM)
        return np.asarray(np.sum((correlated @ normal) * correlated, axis=-1))


def rank(A: Array) -> int:
    return int(np.linalg.matrix_rank(A, rtol=SINGULAR)) if A.size else 0
