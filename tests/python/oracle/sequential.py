"""The ordinary Kalman filter through one step: predict to each observation and update there.

Bilenne 2004 (conclusion) says that the composite step equals this filter. It needs measurement
noise that is independent from observation to observation: a block-diagonal Upsilon.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from oracle.step import Array, Step, block_diagonal, log_determinant, solve, symmetric


@dataclass(frozen=True)
class Filtered:
    """The estimate at the end of the step, and how probable the measurements were."""

    x: Array  # (n,)
    P: Array  # (n, n)
    log_likelihood: float
    nis: Array  # (N,) normalised innovation squared, nu' S^-1 nu, of each observation


def kalman(step: Step, x: Array, P: Array) -> Filtered:
    """Filter through ``step`` from the previous estimate x (n,) and its covariance P (n, n)."""
    R = [step.Upsilon[rows, rows] for rows in step.rows]
    if not np.array_equal(block_diagonal(R), step.Upsilon):
        raise ValueError("the sequential filter needs a block-diagonal Upsilon")
    log_likelihood, nis = 0.0, []
    for i in range(step.N):
        x, P = _predict(step, i, x, P)
        H = step.H[i]
        nu = step.z[i] - H @ x - step.J[i] @ step.u[i]
        S = symmetric(H @ P @ H.T + R[i])
        K = solve(S, H @ P).T
        x = x + K @ nu
        I_KH = np.eye(step.n) - K @ H
        P = symmetric(I_KH @ P @ I_KH.T + K @ R[i] @ K.T)  # Joseph's form: a sum of squares
        nis.append(float(nu @ solve(S, nu)))
        log_likelihood -= 0.5 * (nu.size * np.log(2.0 * np.pi) + log_determinant(S) + nis[-1])
    x, P = _predict(step, step.N, x, P)
    return Filtered(x, P, float(log_likelihood), np.array(nis))


def _predict(step: Step, i: int, x: Array, P: Array) -> tuple[Array, Array]:
    F = step.F[i]
    return F @ x + step.G[i] @ step.u[i], symmetric(F @ P @ F.T + step.Q[i])
