"""The composite step of Bilenne 2004, table 1, without the inverses of app. A.1.

Observation i is predicted from the *start* of the step instead of being shifted back from its end.
With HF_i = H_i F_i ... F_1 and L_ij = H_i F_i ... F_{j+1} (j <= i, else 0), which are the paper's
H F and H W - Theta,

    Gamma = HF P HF' + L Omega L' + Upsilon,    C = cov(x_k, gamma) = F P HF' + W Omega L',
    K = C Gamma^{-1},    P+ = P- - K C'.

It holds for singular transitions too, where H and Theta do not exist.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from oracle.step import Array, Posterior, Step, block_diagonal, concatenate, solve, symmetric


@dataclass(frozen=True)
class Forward:
    """How the start x_{k-1}, the process noise omega and the inputs reach x_k and z."""

    F: Array  # (n, n)
    W: Array  # (n, (N+1) n)
    HF: Array  # (M, n)
    L: Array  # (M, (N+1) n)
    known_x: Array  # (n,) effect of the inputs on x_k
    known_z: Array  # (M,) effect of the inputs on z


def forward(step: Step) -> Forward:
    """The matrices above."""
    n, N, M = step.n, step.N, step.M
    Gu = concatenate([G @ u for G, u in zip(step.G, step.u, strict=True)])  # ((N+1) n,)
    HF, L, Ju = np.zeros((M, n)), np.zeros((M, (N + 1) * n)), np.zeros(M)
    for i, rows in enumerate(step.rows, start=1):
        H = step.H[i - 1]
        HF[rows] = H @ step.transition(0, i)
        for j in range(1, i + 1):
            L[rows, (j - 1) * n : j * n] = H @ step.transition(j, i)
        Ju[rows] = step.J[i - 1] @ step.u[i - 1]
    W = np.hstack([step.transition(j, N + 1) for j in range(1, N + 2)])
    return Forward(step.transition(0, N + 1), W, HF, L, W @ Gu, L @ Gu + Ju)


def update(step: Step, x: Array, P: Array) -> Posterior:
    """One composite step from the previous estimate x (n,) and its covariance P (n, n)."""
    f = forward(step)
    Omega = block_diagonal(step.Q)
    gamma = concatenate(step.z) - f.HF @ x - f.known_z
    Gamma = symmetric(f.HF @ P @ f.HF.T + f.L @ Omega @ f.L.T + step.Upsilon)
    C = f.F @ P @ f.HF.T + f.W @ Omega @ f.L.T
    K = solve(Gamma, C.T).T
    P_prior = f.F @ P @ f.F.T + f.W @ Omega @ f.W.T
    return Posterior(f.F @ x + f.known_x + K @ gamma, symmetric(P_prior - K @ C.T), gamma, Gamma, K)
