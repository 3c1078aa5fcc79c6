"""Affine models of a nuisance known by samples, and what their error does to a test.

Lacresse, Grall, Nikiforov 2005, section 4.3: h_i(X) ~ a_i' X + b_i over a box K, by least squares
(9) or with the least largest error (8), here as a linear programme over the samples:

    minimise t,    -t <= h_i(X_j) - a' X_j - b <= t  for every sample j.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from mpmath import mp  # type: ignore[import-untyped]
from scipy.optimize import linprog, minimize_scalar

from oracle import raim_distributions as distributions
from oracle.raim_linear import Linear, Noise
from oracle.step import Array

Nuisance: TypeAlias = Callable[[Array], Array]  # X (k, m) -> (k, n)


def grid(low: Array, high: Array, points: int) -> Array:
    """(points^m, m), equally spaced, ends included."""
    axes = [np.linspace(a, b, points) for a, b in zip(low, high, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(low))


@dataclass(frozen=True)
class Affine:
    A: Array  # (n, m)
    B: Array  # (n,)

    def error(self, X: Array, values: Array) -> Array:
        """E(X) = h(X) - A X - B, (k, n)."""
        return np.asarray(values - X @ self.A.T - self.B)

    def rho(self, X: Array, values: Array) -> Array:
        """(10): the largest error at a sample, (n,)."""
        return np.asarray(np.abs(self.error(X, values)).max(axis=0))


def least_squares(X: Array, values: Array) -> Affine:
    """(9), by the normal equations of the centred samples."""
    mean, middle = X.mean(axis=0), values.mean(axis=0)
    D = X - mean
    A = np.linalg.solve(D.T @ D, D.T @ (values - middle)).T
    return Affine(A, middle - A @ mean)


def minimax(X: Array, values: Array) -> Affine:
    """(8) over the samples, each component by itself. Scaled to the unit box and unit residuals
    of the least-squares fit: the solver's tolerances are absolute, 1e-7."""
    start = least_squares(X, values)
    rest, scale = start.error(X, values), start.rho(X, values)
    middle, half = (X.max(axis=0) + X.min(axis=0)) / 2, np.ptp(X, axis=0) / 2
    U = np.column_stack([(X - middle) / half, np.ones(len(X))])
    A, B = start.A.copy(), start.B.copy()
    options: Any = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}
    for i in np.flatnonzero(scale > 0.0):
        r, column = rest[:, i] / scale[i], np.ones((len(X), 1))
        found: Any = linprog(
            np.array([0.0] * U.shape[1] + [1.0]),
            A_ub=np.block([[-U, -column], [U, -column]]), b_ub=np.concatenate([-r, r]),
            bounds=[(None, None)] * U.shape[1] + [(0.0, None)], options=options,
        )  # fmt: skip
        assert found.status == 0
        slope = scale[i] * found.x[:-2] / half
        A[i] += slope
        B[i] += scale[i] * found.x[-2] - slope @ middle
    return Affine(A, B)


def loose(noise: Noise, rho: Array) -> float:
    """||R||, a bound on the whitened error of any E with |E_i| <= rho_i (||W|| is 1)."""
    n = len(rho)
    L = np.linalg.cholesky(np.diag(np.full(n, noise) ** 2) if np.ndim(noise) < 2 else noise)
    return float(np.linalg.norm(np.abs(np.linalg.inv(L)) @ rho))


def disturbance(H: Array, noise: Noise, E: Array) -> Array:
    """||W L^-1 E|| (k,) of errors E (k, n): the root of their noncentrality."""
    return np.asarray(np.sqrt(Linear(H, None, noise).statistic(E)))


def powers(noncentrality: float, bound: float, degrees: int, false_alarm: float) -> tuple[Any, Any]:
    """beta_1 and beta_2 (section 4.3), in digits."""
    root, h = mp.sqrt(mp.mpf(noncentrality)), distributions.threshold(false_alarm, degrees)
    less = mp.mpf(max(root - bound, 0)) ** 2
    return (distributions.upper(h, degrees, less),
            distributions.upper(h, degrees, (root + bound) ** 2))  # fmt: skip


def losses(
    bound: float, degrees: int, false_alarm: float, noncentrality: float | None, gain: bool
) -> float:
    """e_1, or with ``gain`` e_2, at a noncentrality, or the largest of all where it is None."""
    if noncentrality is not None:
        low, high = powers(noncentrality, bound, degrees, false_alarm)
        beta = distributions.power(noncentrality, degrees, false_alarm)
        return float(high - beta if gain else beta - low)
    h = float(distributions.threshold(false_alarm, degrees))

    def at(root: float) -> float:
        other = root + bound if gain else max(root - bound, 0.0)
        beta = distributions.upper_in_doubles(h, degrees, root**2)
        changed = distributions.upper_in_doubles(h, degrees, other**2)
        return changed - beta if gain else beta - changed

    roots = np.linspace(0.0, np.sqrt(h) + bound + 8.0, 25)  # beyond it either misses less than Q(8)
    k = int(np.argmax([at(t) for t in roots]))
    found: Any = minimize_scalar(
        lambda t: -at(t), method="bounded", options={"xatol": 1e-6},
        bounds=(float(roots[max(k - 1, 0)]), float(roots[min(k + 1, 24)])),
    )  # fmt: skip
    return max(-float(found.fun), at(0.0))
