"""Interrupted and noisy measurements: Sigalov & Oshman, plain NumPy.

x_{k+1} = A x_k + w_k, z_k = gamma_k H x_k + v_k, cov(v_k) = R delta_k, k = 0, 1, ...; x_0 is
N(x0, P0) and the first measurement is of x_0. A mode is a pair (gamma, delta); modes follow a
Markov chain whose transition matrix has the mode before in its rows and the mode after in its
columns.

Where the paper is misprinted: the covariances in (6) and (9) and the estimate in the text above (9)
are the predicted ones, A P A' + Q and A x; a merged covariance contains the spread of the means.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.special import logsumexp

from oracle.step import Array, symmetric


@dataclass(frozen=True)
class Plant:
    """The fault-free system."""

    A: Array  # (n, n)
    H: Array  # (m, n)
    Q: Array  # (n, n)
    R: Array  # (m, m)
    x0: Array  # (n,)
    P0: Array  # (n, n)


@dataclass(frozen=True)
class Chain:
    """M modes (gamma, delta) and how they follow each other."""

    modes: tuple[tuple[int, float], ...]
    transition: Array  # (M, M), rows: before
    initial: Array  # (M,) of the mode at k = 0


def independent(gamma: Array, delta: Array, levels: Sequence[float]) -> Chain:
    """Problem 3 (Problem 1 where the rows are equal): gamma's chain over (1, 0), delta's over
    ``levels``, each started from its stationary law; delta runs fastest."""
    modes = tuple(product((1, 0), levels))
    law = np.asarray(np.kron(stationary(gamma), stationary(delta)), dtype=np.float64)
    return Chain(modes, np.asarray(np.kron(gamma, delta), dtype=np.float64), law)


def stationary(transition: Array) -> Array:
    """The law that stays as it is: p P = p, sum p = 1."""
    M = len(transition)
    system = np.vstack([transition.T - np.eye(M), np.ones((1, M))])
    right = np.concatenate([np.zeros(M), [1.0]])
    return np.asarray(np.linalg.lstsq(system, right, rcond=None)[0])


@dataclass(frozen=True)
class Estimates:
    """Of T steps: mean, covariance, posterior of the modes, log-density of all measurements."""

    x: Array  # (T, n)
    P: Array  # (T, n, n)
    mode: Array  # (T, M)
    log_likelihood: float


def log_normal(z: Array, mean: Array, S: Array) -> float:
    """log N(z; mean, S)."""
    L = np.linalg.cholesky(S)
    white = np.linalg.solve(L, z - mean)
    size = len(z) * np.log(2.0 * np.pi)
    return float(-0.5 * (white @ white + size) - np.log(np.diag(L)).sum())


def update(
    plant: Plant, mode: tuple[int, float], x: Array, P: Array, z: Array
) -> tuple[Array, Array, float]:
    """A mode's estimate and the log-density of the measurement; gamma = 0 leaves the estimate."""
    gamma, delta = mode
    H, R = plant.H, plant.R * delta
    if gamma == 0:
        return x, P, log_normal(z, np.zeros(len(z)), R)
    S = H @ P @ H.T + R
    K = np.linalg.solve(S, H @ P).T
    return x + K @ (z - H @ x), symmetric(P - K @ S @ K.T), log_normal(z, H @ x, S)


def merged(weight: Array, xs: Array, Ps: Array) -> tuple[Array, Array]:
    """Mean and covariance of a mixture."""
    x = weight @ xs
    spread = np.einsum("i,ij,ik->jk", weight, xs - x, xs - x)
    return x, symmetric(np.einsum("i,ijk->jk", weight, Ps) + spread)


def genie(plant: Plant, modes: Sequence[tuple[int, float]], z: Array) -> Estimates:
    """The Kalman filter that knows every mode."""
    x, P, total, out = plant.x0, plant.P0, 0.0, []
    for k, mode in enumerate(modes):
        if k > 0:
            x, P = plant.A @ x, plant.A @ P @ plant.A.T + plant.Q
        x, P, density = update(plant, mode, x, P, z[k])
        total += density
        out.append((x, P))
    return _collected(out, [np.ones(1)] * len(out), total)


def one_step(plant: Plant, chain: Chain, z: Array) -> Estimates:
    """Section III: all modes start from one merged estimate in every step."""
    x, P, mode, total, out, posterior = plant.x0, plant.P0, chain.initial, 0.0, [], []
    for k in range(len(z)):
        if k > 0:
            x, P = plant.A @ x, plant.A @ P @ plant.A.T + plant.Q
            mode = mode @ chain.transition
        xs, Ps, density = _all_modes(plant, chain, [x] * len(mode), [P] * len(mode), z[k])
        mode, evidence = _posterior(mode, density)
        x, P = merged(mode, xs, Ps)
        total += evidence
        out.append((x, P))
        posterior.append(mode)
    return _collected(out, posterior, total)


def imm(plant: Plant, chain: Chain, z: Array) -> Estimates:
    """Section IV with all modes: each starts from its own mixture (17)-(18)."""
    M = len(chain.modes)
    xs, Ps = np.array([plant.x0] * M), np.array([plant.P0] * M)
    mode, total, out, posterior = chain.initial, 0.0, [], []
    for k in range(len(z)):
        if k > 0:
            before = mode[:, None] * chain.transition  # (from, to)
            mode = before.sum(axis=0)
            mixed = []
            for j in range(M):
                weight = before[:, j] / mode[j] if mode[j] > 0 else np.full(M, 1.0 / M)
                x, P = merged(weight, xs, Ps)
                mixed.append((plant.A @ x, plant.A @ P @ plant.A.T + plant.Q))
            xs, Ps = np.array([x for x, _ in mixed]), np.array([P for _, P in mixed])
        xs, Ps, density = _all_modes(plant, chain, list(xs), list(Ps), z[k])
        mode, evidence = _posterior(mode, density)
        total += evidence
        out.append(merged(mode, xs, Ps))
        posterior.append(mode)
    return _collected(out, posterior, total)


def enumeration(plant: Plant, chain: Chain, z: Array) -> Estimates:
    """The optimal estimate (3) of every step, over all mode sequences: M^T Kalman filters."""
    M, out, posterior, total = len(chain.modes), [], [], 0.0
    histories = [
        (np.log(p) if p > 0 else -np.inf, i, plant.x0, plant.P0)
        for i, p in enumerate(chain.initial)
    ]
    for k in range(len(z)):
        if k > 0:
            with np.errstate(divide="ignore"):
                log_p = np.log(chain.transition)
            histories = [
                (w + log_p[i, j], j, plant.A @ x, plant.A @ P @ plant.A.T + plant.Q)
                for w, i, x, P in histories
                for j in range(M)
            ]
        after = []
        for w, i, x, P in histories:
            x_new, P_new, density = update(plant, chain.modes[i], x, P, z[k])
            after.append((w + density, i, x_new, P_new))
        histories = after
        log_weight = np.array([h[0] for h in histories])
        total = float(logsumexp(log_weight))
        weight = np.exp(log_weight - total)
        last = np.array([h[1] for h in histories])
        posterior.append(np.array([weight[last == i].sum() for i in range(M)]))
        out.append(merged(weight, np.array([h[2] for h in histories]),
                          np.array([h[3] for h in histories])))  # fmt: skip
    return _collected(out, posterior, total)


def linear_optimal(
    plant: Plant, mean_gamma: float, mean_delta: float, p11: float, z: Array
) -> Array:
    """(23a-e), for x_0 known: the estimate of x_0 is x0, and x0 must be zero where gamma may be
    (the filter knows of no origin but zero). Returns x (T, n); z[0] is not used."""
    A, H, Q, R = plant.A, plant.H, plant.Q, plant.R
    x, C = plant.x0, plant.P0 + np.outer(plant.x0, plant.x0)
    V, out = np.outer(plant.x0, plant.x0), [plant.x0]
    for k in range(1, len(z)):
        C_next = A @ C @ A.T + Q
        AVA = A @ V @ A.T
        gain = mean_gamma * C_next - p11 * AVA
        S = mean_gamma * H @ C_next @ H.T - p11**2 * H @ AVA @ H.T + R * mean_delta
        F2 = np.linalg.solve(S, H @ gain.T).T
        F1 = A - p11 * F2 @ H @ A
        cross = p11 * F2 @ H @ A @ V @ F1.T
        noise = F2 @ (mean_gamma * H @ C_next @ H.T + R * mean_delta) @ F2.T
        V = F1 @ V @ F1.T + noise + cross + cross.T
        C = C_next
        x = F1 @ x + F2 @ z[k]
        out.append(x)
    return np.array(out)


def _all_modes(
    plant: Plant, chain: Chain, xs: Sequence[Array], Ps: Sequence[Array], z: Array
) -> tuple[Array, Array, Array]:
    updated = [update(plant, m, x, P, z) for m, x, P in zip(chain.modes, xs, Ps, strict=True)]
    return tuple(np.array([u[i] for u in updated]) for i in range(3))  # type: ignore[return-value]


def _posterior(prior: Array, density: Array) -> tuple[Array, float]:
    with np.errstate(divide="ignore"):
        log_weight = np.log(prior) + density
    evidence = float(logsumexp(log_weight))
    return np.exp(log_weight - evidence), evidence


def _collected(
    out: Sequence[tuple[Array, Array]], posterior: Sequence[Array], total: float
) -> Estimates:
    return Estimates(
        np.array([x for x, _ in out]), np.array([P for _, P in out]), np.array(posterior), total
    )
