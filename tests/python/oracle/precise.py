"""The composite step with fifty decimal digits: the reference where doubles lose theirs.

With P0 and R spread over ten decades, P- - K C' cancels most of a double's digits. Python's
``decimal`` numbers inside NumPy object arrays carry the same formulas with digits to spare.

Along the legs, the covariance C = cov(x_i, z_1..z_i) and the rows of Gamma grow with every
observation. Then Gamma = U D U' (U unit lower triangular, D diagonal), and Y = U^{-1} [C', Upsilon,
gamma] gives every answer as Y' D^{-1} Y. Upsilon may be full and the transitions singular.
"""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal, localcontext
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from oracle.step import Array, Step, concatenate

Digits: TypeAlias = NDArray[np.object_]  # an array of Decimal

DIGITS = 50
TWO_PI = Decimal("6.28318530717958647692528676655900576839433879875021164194988918461563")


@dataclass(frozen=True)
class Precise:
    """Exact but for rounding to doubles; ``x_digits`` and ``P_digits`` start the next step."""

    x: Array  # (n,)
    P: Array  # (n, n)
    P_prior: Array  # (n, n) covariance of the prediction at the end of the step
    gamma: Array  # (M,)
    Gamma: Array  # (M, M)
    v: Array  # (M,) noise estimate, eq. (25)
    v_covariance: Array  # (M, M) its covariance, eq. (26)
    nis: Array  # (N,) share of each observation, given the earlier ones, in SSE (27)
    log_likelihood: float
    x_digits: Digits
    P_digits: Digits


def exact(a: Array | Digits) -> Digits:
    """Doubles as decimals, without any rounding."""
    digits = [Decimal(value) for value in a.ravel().tolist()]
    return np.array(digits, dtype=np.object_).reshape(a.shape)


def update(step: Step, x0: Array | Digits, P0: Array | Digits) -> Precise:
    """One composite step from the previous estimate x0 (n,) and its covariance P0 (n, n)."""
    with localcontext() as context:
        context.prec = DIGITS
        x, P = exact(x0), exact(P0)
        Gamma, Upsilon = exact(step.Upsilon), exact(step.Upsilon)
        z, predicted = exact(concatenate(step.z)), exact(np.zeros(step.M))
        C = exact(np.zeros((step.n, step.M)))  # (n, M): cov(x_i, z), columns still zero after i
        for i in range(step.N + 1):
            F, u = exact(step.F[i]), exact(step.u[i])
            x, P, C = _dot(F, x) + _dot(exact(step.G[i]), u), F @ P @ F.T + exact(step.Q[i]), F @ C
            if i < step.N:
                rows, H = step.rows[i], exact(step.H[i])
                predicted[rows] = _dot(H, x) + _dot(exact(step.J[i]), u)
                earlier = slice(0, rows.start)
                Gamma[rows, earlier] += H @ C[:, earlier]
                Gamma[earlier, rows] = Gamma[rows, earlier].T
                Gamma[rows, rows] += H @ P @ H.T
                C[:, rows] = P @ H.T
        gamma = z - predicted
        Y, D = _eliminate(Gamma, np.column_stack([C.T, Upsilon, gamma]))
        squares = _weighted(Y, D)
        state, noise, last = slice(0, step.n), slice(step.n, step.n + step.M), step.n + step.M
        x_posterior, P_posterior = x + squares[state, last], P - squares[state, state]
        nis = Y[:, last] ** 2 / D
        log_likelihood = sum((-(TWO_PI * d).ln() - e) / 2 for d, e in zip(D, nis, strict=True))
    return Precise(
        x=_rounded(x_posterior),
        P=_rounded(P_posterior),
        P_prior=_rounded(P),
        gamma=_rounded(gamma),
        Gamma=_rounded(Gamma),
        v=_rounded(squares[noise, last]),
        v_covariance=_rounded(squares[noise, noise]),
        nis=np.array([float(np.sum(nis[rows])) for rows in step.rows]),
        log_likelihood=float(log_likelihood),
        x_digits=x_posterior,
        P_digits=P_posterior,
    )


def _dot(A: Digits, b: Digits) -> Digits:
    """A b, also when b is empty: NumPy's sum over no objects is not a Decimal."""
    return np.asarray(A @ b) if b.size else exact(np.zeros(len(A)))


def _eliminate(Gamma: Digits, B: Digits) -> tuple[Digits, Digits]:
    """U^{-1} B and D of Gamma = U D U', by Gauss elimination without pivots (Gamma > 0)."""
    A, Y = Gamma.copy(), B.copy()
    for j in range(len(A)):
        for i in range(j + 1, len(A)):
            factor = A[i, j] / A[j, j]
            A[i, j:] -= factor * A[j, j:]
            Y[i] -= factor * Y[j]
    return Y, np.diag(A).copy()


def _weighted(Y: Digits, D: Digits) -> Digits:
    """Y' D^{-1} Y."""
    if D.size == 0:
        return exact(np.zeros((Y.shape[1], Y.shape[1])))
    return np.asarray(Y.T @ (Y / D[:, None]))


def _rounded(a: Digits) -> Array:
    return a.astype(np.float64)
