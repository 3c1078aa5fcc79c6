"""The batch Wiener-Hopf estimator of Bilenne 2004, eqs. (8)-(12) and (23): no recursion at all.

A journey is a list of steps. Its only random sources are s = vect{x_0, every omega_i, every v_i},
of covariance Sigma. Every state and every measurement is a known mean plus a matrix times
(s - E s); all second moments follow by matrix products, and the estimates by one linear solve.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from oracle.step import Array, Step, block_diagonal, concatenate, solve, symmetric


@dataclass(frozen=True)
class Moments:
    """Means and coefficients, one entry for each step k of the journey; d is the size of s."""

    Sigma: Array  # (d, d)
    X: list[Array]  # x_k = x_mean + X (s - E s), (n, d)
    Z: list[Array]  # z_k = z_mean + Z (s - E s), (M_k, d)
    V: list[Array]  # v_k = V (s - E s), (M_k, d)
    x_mean: list[Array]  # (n,)
    innovation: list[Array]  # z_k - z_mean, (M_k,)

    def covariance(self, A: Array, B: Array) -> Array:
        """E{a b'} of two vectors with coefficients A and B."""
        return A @ self.Sigma @ B.T


def moments(x0: Array, P0: Array, steps: Sequence[Step]) -> Moments:
    """Play eq. (4) through the journey, with matrices in the place of random vectors."""
    n = len(x0)
    blocks = [P0] + [block for step in steps for block in (*step.Q, step.Upsilon)]
    Sigma = block_diagonal(blocks)
    identity = np.eye(len(Sigma))
    used = n  # sources consumed so far
    X, mean = identity[:n], x0
    result = Moments(Sigma, [], [], [], [], [])
    for step in steps:
        noise_start = used + (step.N + 1) * n
        V = identity[noise_start : noise_start + step.M]
        Z, z_mean = np.zeros_like(V), np.zeros(step.M)
        for i, (F, G, u) in enumerate(zip(step.F, step.G, step.u, strict=True)):
            X = F @ X + identity[used : used + n]
            mean = F @ mean + G @ u
            used += n
            if i < step.N:
                rows = step.rows[i]
                Z[rows] = step.H[i] @ X + V[rows]
                z_mean[rows] = step.H[i] @ mean + step.J[i] @ u
        used += step.M
        result.X.append(X)
        result.Z.append(Z)
        result.V.append(V)
        result.x_mean.append(mean)
        result.innovation.append(concatenate(step.z) - z_mean)
    return result


def wiener(x0: Array, P0: Array, steps: Sequence[Step]) -> list[tuple[Array, Array]]:
    """Eq. (11): x_k (n,) and P_k (n, n) at the end of every step, from all the data up to then."""
    m = moments(x0, P0, steps)
    estimates = []
    for k in range(len(steps)):
        X, Z = m.X[k], np.vstack(m.Z[: k + 1])
        xz, zz = m.covariance(X, Z), symmetric(m.covariance(Z, Z))
        x = m.x_mean[k] + xz @ solve(zz, concatenate(m.innovation[: k + 1]))
        P = m.covariance(X, X) - xz @ solve(zz, xz.T)
        estimates.append((x, symmetric(P)))
    return estimates


def wiener_noise(x0: Array, P0: Array, steps: Sequence[Step]) -> tuple[Array, Array]:
    """Eq. (23): the noise of all measurements of the journey given all of them, and its covariance.

    Like eq. (26) this is the covariance of the estimate, not of its error.
    """
    m = moments(x0, P0, steps)
    Z, V = np.vstack(m.Z), np.vstack(m.V)
    vz, zz = m.covariance(V, Z), symmetric(m.covariance(Z, Z))
    return vz @ solve(zz, concatenate(m.innovation)), symmetric(vz @ solve(zz, vz.T))
