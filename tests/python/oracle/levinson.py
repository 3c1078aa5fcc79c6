"""The Levinson recursion of Bilenne 2004, app. A.2: Wiener-Hopf made recursive by partitioning.

The covariance of all the data (48) grows by one block row per step, and so does its inverse (50).
The printed (50) has R_{k-1}^{-1} r_k' where R_{k-1}^{-1} r_k is meant: r_k (49) has the rows of
R_{k-1} and the columns of rho_k. And (51) is the covariance of the innovation, not the innovation.

No Kalman recursion inside: the moments come from the journey as a whole.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from oracle.step import Array, Step, concatenate, solve, symmetric
from oracle.wiener import moments


def levinson(x0: Array, P0: Array, steps: Sequence[Step]) -> list[tuple[Array, Array]]:
    """x_k (n,) and P_k (n, n) at the end of every step, from all the measurements up to then."""
    m = moments(x0, P0, steps)
    R_inverse = np.zeros((0, 0))  # of the covariance R_{k-1} of all the earlier data
    past = np.zeros(0)  # all the earlier data, less their mean
    Z_past = np.zeros((0, len(m.Sigma)))
    estimates = []
    for X, Z, x_mean, z in zip(m.X, m.Z, m.x_mean, m.innovation, strict=True):
        r, rho = m.covariance(Z_past, Z), m.covariance(Z, Z)  # (49)
        xz_past, xz = m.covariance(X, Z_past), m.covariance(X, Z)
        B = R_inverse @ r  # coefficients of the best prediction of z from the past
        Gamma = symmetric(rho - r.T @ B)  # (51)
        gamma = z - B.T @ past  # (17)

        # eq. (50) put into (11) splits it into the past's estimate and the innovation's share (19)
        x_gamma = xz - xz_past @ B  # E{x gamma'}
        x = x_mean + xz_past @ R_inverse @ past + x_gamma @ solve(Gamma, gamma)
        P_past = m.covariance(X, X) - xz_past @ R_inverse @ xz_past.T
        P = P_past - x_gamma @ solve(Gamma, x_gamma.T)
        estimates.append((x, symmetric(P)))

        A = np.vstack([B, -np.eye(len(z))])
        grown = np.zeros((len(A), len(A)))
        grown[: len(past), : len(past)] = R_inverse
        R_inverse = symmetric(grown + A @ solve(Gamma, A.T))  # (50)
        past, Z_past = concatenate([past, z]), np.vstack([Z_past, Z])
    return estimates
