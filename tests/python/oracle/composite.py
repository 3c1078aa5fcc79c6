"""The recursive linear estimator of Bilenne 2004: app. A.1, eqs. (35)-(47), and table 1, corrected.

What is corrected:

- H_bar_i (44), Theta_bar_ij (45) and Xi_bar_ij (47) look *back* from the estimation time to the
  observation time: they need the inverse of the product of transitions printed there.
- J (46) is block diagonal, not stacked, and the predicted observation (16) uses J_tilde = J - Xi.
- The covariance is P+ = (I - K H) P- + K Theta Omega W'. The printed last term, -K H Omega W', has
  no matching dimensions.

``state_as_printed`` and ``covariance_as_printed`` keep the misprints, for a test to show them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from oracle.step import Array, Posterior, Step, block_diagonal, concatenate, solve, symmetric


@dataclass(frozen=True)
class Composite:
    """The matrices of x_k = F x_{k-1} + G u + W omega, z = H x_k - Theta omega + J_tilde u + v (7).

    omega = vect{omega_i} and u = vect{u_i} gather all N+1 legs, z and v all M scalar measurements.
    """

    F: Array  # (n, n)
    G: Array  # (n, (N+1) p)
    W: Array  # (n, (N+1) n)
    H: Array  # (M, n)
    Theta: Array  # (M, (N+1) n)
    Xi: Array  # (M, (N+1) p)
    J: Array  # (M, (N+1) p)
    Jtilde: Array  # (M, (N+1) p)
    Omega: Array  # ((N+1) n, (N+1) n)
    Upsilon: Array  # (M, M)


def matrices(step: Step, *, inverses: bool = True) -> Composite:
    """Eqs. (35)-(47). ``inverses=False`` gives (44), (45) and (47) as they are printed."""
    n, N, M, p = step.n, step.N, step.M, step.u[0].size
    end = N + 1
    H = np.zeros((M, n))
    Theta = np.zeros((M, end * n))
    Xi = np.zeros((M, end * p))
    J = np.zeros((M, end * p))
    for i, rows in enumerate(step.rows, start=1):
        for j in range(i + 1, end + 1):  # only the legs after observation i
            product = step.transition(i, j)
            back = np.linalg.inv(product) if inverses else product
            Theta[rows, (j - 1) * n : j * n] = step.H[i - 1] @ back
            Xi[rows, (j - 1) * p : j * p] = step.H[i - 1] @ back @ step.G[j - 1]
        H[rows] = Theta[rows, N * n :]  # j = N+1 looks back over all the legs, as H does
        J[rows, (i - 1) * p : i * p] = step.J[i - 1]
    W_bar = [step.transition(j, end) for j in range(1, end + 1)]
    return Composite(
        F=step.transition(0, end),
        G=np.hstack([W_j @ G_j for W_j, G_j in zip(W_bar, step.G, strict=True)]),
        W=np.hstack(W_bar),
        H=H,
        Theta=Theta,
        Xi=Xi,
        J=J,
        Jtilde=J - Xi,
        Omega=block_diagonal(step.Q),
        Upsilon=step.Upsilon,
    )


def _table_1(c: Composite, z: Array, known_z: Array, x: Array, P: Array) -> Posterior:
    """Table 1 from the prediction ``x`` (n,); ``P`` is the covariance at the start of the step."""
    P_prior = c.F @ P @ c.F.T + c.W @ c.Omega @ c.W.T
    gamma = z - c.H @ x - known_z
    HF, HW_Theta = c.H @ c.F, c.H @ c.W - c.Theta
    Gamma = symmetric(HF @ P @ HF.T + c.Upsilon + HW_Theta @ c.Omega @ HW_Theta.T)
    K = solve(Gamma, (P_prior @ c.H.T - c.W @ c.Omega @ c.Theta.T).T).T
    P_posterior = (np.eye(len(x)) - K @ c.H) @ P_prior + K @ c.Theta @ c.Omega @ c.W.T
    return Posterior(x + K @ gamma, symmetric(P_posterior), gamma, Gamma, K)


def table_1(step: Step, x: Array, P: Array) -> Posterior:
    """Table 1, corrected, from the previous estimate x (n,) and its covariance P (n, n)."""
    c = matrices(step)
    u = concatenate(step.u)
    return _table_1(c, concatenate(step.z), c.Jtilde @ u, c.F @ x + c.G @ u, P)


def state_as_printed(
    step: Step, x: Array, P: Array, *, inverses: bool = False, J_tilde: bool = False
) -> Array:
    """The state of table 1 with the printed matrices, or with the printed J in (16), or with both.

    With both arguments true nothing is misprinted.
    """
    c = matrices(step, inverses=inverses)
    u = concatenate(step.u)
    known_z = (c.Jtilde if J_tilde else c.J) @ u
    return _table_1(c, concatenate(step.z), known_z, c.F @ x + c.G @ u, P).x


def covariance_as_printed(step: Step, P: Array) -> Array:
    """The last line of table 1 as printed: NumPy raises ValueError whenever N > 0."""
    c = matrices(step)
    K = table_1(step, np.zeros(step.n), P).K
    P_prior = c.F @ P @ c.F.T + c.W @ c.Omega @ c.W.T
    return np.asarray((np.eye(step.n) - K @ c.H) @ P_prior - K @ c.H @ c.Omega @ c.W.T)
