"""The linear optimal filter of Sigalov & Oshman, section V, and its exact mean-square error.

The recursion (23) starts before z_0 with nothing: V = 0, C_0 = P0 + x0 x0'. For levels of gamma
other than 0 and 1, p11 is E gamma_{k+1} gamma_k / E gamma_k, and where two gammas of the same step
meet, in (23c) and (23e), E gamma^2 stands for E gamma.

About a nominal path: x - nominal is the state, of mean zero and covariance P0, and z less E gamma H
nominal is its measurement, whose noise has (gamma - E gamma) H nominal in it.
"""

from __future__ import annotations

import numpy as np

from oracle.step import Array
from oracle.switching import Plant, at
from oracle.switching_chain import Chain


def conditional(chain: Chain, steps: int) -> Array:
    """(steps, steps): E gamma_k gamma_i / E gamma_i at [k, i], i < k; NaN elsewhere and where
    E gamma_i = 0. Where all gammas are 0 and 1 it is Pr(gamma_k = 1 | gamma_i = 1). Lemma 2: a row
    is one number."""
    law, out = chain.law(steps), np.full((steps, steps), np.nan)
    for i in range(steps):
        weighted = law[i] * chain.gamma
        for k in range(i + 1, steps):
            weighted = weighted @ at(chain.transition, k - 1)
            if law[i] @ chain.gamma != 0:
                out[k, i] = weighted @ chain.gamma / (law[i] @ chain.gamma)
    return out


def _means(chain: Chain, steps: int) -> tuple[Array, Array, Array]:
    """E gamma, E gamma^2, E delta of each step."""
    law = chain.law(steps)
    return law @ chain.gamma, law @ chain.gamma**2, law @ chain.delta


def gains(
    plant: Plant, chain: Chain, seen: Array, nominal: Array | None = None
) -> list[tuple[Array, Array]]:
    """F1 and F2 of every step, which lead to it; ``seen`` (T, m): F2 is zero for what is not."""
    steps, n = len(seen), len(plant.x0)
    mean, square, noise = _means(chain, steps)
    C, V, out = plant.P0, np.zeros((n, n)), []
    if nominal is None:
        C = C + np.outer(plant.x0, plant.x0)
    for k in range(steps):
        A, p11 = np.eye(n), 0.0  # as long as V = 0, p11 means nothing
        if k > 0:
            A = at(plant.A, k - 1)
            row = conditional(chain, k + 1)[k, :k]
            if not np.isnan(row).all():
                p11 = row[~np.isnan(row)][-1]  # of neighbours, unless E gamma_{k-1} = 0
            C = A @ C @ A.T + at(plant.Q, k - 1)
        H, R = at(plant.H, k), noise[k] * at(plant.R, k)
        if nominal is not None:
            R = R + (square[k] - mean[k] ** 2) * np.outer(H @ nominal[k], H @ nominal[k])
        AVA, here = A @ V @ A.T, seen[k].astype(bool)
        S = square[k] * H @ C @ H.T - p11**2 * H @ AVA @ H.T + R
        F2 = np.zeros((n, len(H)))
        F2[:, here] = np.linalg.solve(
            S[np.ix_(here, here)], (H @ (mean[k] * C - p11 * AVA).T)[here]
        ).T  # (23c)
        F1 = A - p11 * F2 @ H @ A  # (23b)
        cross = p11 * F2 @ H @ A @ V @ F1.T
        V = F1 @ V @ F1.T + F2 @ (square[k] * H @ C @ H.T + R) @ F2.T + cross + cross.T  # (23e)
        out.append((F1, F2))
    return out


def linear_optimal(plant: Plant, chain: Chain, z: Array, nominal: Array | None = None) -> Array:
    """(23a): x (T, n)."""
    x, out = np.zeros(len(plant.x0)), []
    path = np.zeros((len(z), len(plant.x0))) if nominal is None else nominal
    mean, _, _ = _means(chain, len(z))
    for k, (F1, F2) in enumerate(gains(plant, chain, ~np.isnan(z), nominal)):
        known = mean[k] * at(plant.H, k) @ path[k]
        x = F1 @ x + F2 @ np.nan_to_num(z[k] - known)
        out.append(path[k] + x)
    return np.array(out)


def mean_square_error(
    plant: Plant, chain: Chain, seen: Array, nominal: Array | None = None
) -> Array:
    """(T, n, n): E (x - x^)(x - x^)', whether or not Lemma 2 holds.

    In every mode j: p = Pr(j), X = E x x' 1{j}, B = E x^ x' 1{j}, V = E x^ x^' 1{j} and
    mu = E x^ 1{j}. Of x and x^ about the nominal path, where there is one.
    """
    steps, n, M = len(seen), len(plant.x0), len(chain.modes)
    mean, _, _ = _means(chain, steps)
    path = np.zeros((steps, n)) if nominal is None else nominal
    C0 = plant.P0 + (np.outer(plant.x0, plant.x0) if nominal is None else 0.0)
    p, X = chain.initial, chain.initial[:, None, None] * C0
    B, V, mu, out = np.zeros((M, n, n)), np.zeros((M, n, n)), np.zeros((M, n)), []
    for k, (F1, F2) in enumerate(gains(plant, chain, seen, nominal)):
        if k > 0:
            A, follow = at(plant.A, k - 1), at(chain.transition, k - 1)
            p, mu = p @ follow, follow.T @ mu
            X = A @ np.einsum("ij,iab->jab", follow, X) @ A.T
            X = X + p[:, None, None] * at(plant.Q, k - 1)
            B = np.einsum("ij,iab->jab", follow, B) @ A.T
            V = np.einsum("ij,iab->jab", follow, V)
        H, R = at(plant.H, k), at(plant.R, k)
        for j, (gamma, delta) in enumerate(zip(chain.gamma, chain.delta, strict=True)):
            wrong = (gamma - mean[k]) * H @ path[k]
            zz = gamma**2 * H @ X[j] @ H.T + p[j] * (delta * R + np.outer(wrong, wrong))
            xz = gamma * B[j] @ H.T + np.outer(mu[j], wrong)
            cross = F1 @ xz @ F2.T
            V[j] = F1 @ V[j] @ F1.T + cross + cross.T + F2 @ zz @ F2.T
            B[j] = F1 @ B[j] + gamma * F2 @ H @ X[j]
            mu[j] = F1 @ mu[j] + p[j] * F2 @ wrong
        B_all = B.sum(axis=0)
        out.append(X.sum(axis=0) - B_all - B_all.T + V.sum(axis=0))
    return np.array(out)
