"""Interrupted and noisy measurements: Sigalov & Oshman, plain NumPy.

x_{k+1} = A x_k + w_k, z_k = gamma_k H x_k + v_k, cov(v_k) = R delta_k, k = 0, 1, ...; x_0 is
N(x0, P0) and the first measurement is of x_0. A mode is a pair (gamma, delta); modes follow a
Markov chain whose transition matrix has the mode before in its rows and the mode after in its
columns. What is not a number in a measurement is missing: its rows are left out.

Where the paper is misprinted: the covariances in (6) and (9) and the estimate in the text above (9)
are the predicted ones, A P A' + Q and A x; a merged covariance contains the spread of the means.

Probabilities of modes are logarithms throughout, x (..., n) and P (..., n, n) may be stacks.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import TypeAlias

import numpy as np
from scipy.special import logsumexp

from oracle.step import Array
from oracle.switching_chain import Chain, Mode, log_of

# Of a state that the mode before does not have: its mean and variance.
Entering: TypeAlias = Mapping[str, tuple[float, float]]
NOTHING: Entering = MappingProxyType({})


@dataclass(frozen=True)
class Plant:
    """The fault-free system. A matrix is one for all steps, or one for each along its first axis:
    T of H and R, T - 1 of A and Q, whose entry k leads from step k to step k + 1."""

    A: Array  # (n, n)
    H: Array  # (m, n)
    Q: Array  # (n, n)
    R: Array  # (m, m)
    x0: Array  # (n,)
    P0: Array  # (n, n)
    states: tuple[str, ...] = ()  # their names, where plants of different size meet


@dataclass(frozen=True)
class Estimates:
    """Of T steps: mean, covariance, posterior of the modes, log-density of all measurements."""

    x: Array  # (T, n)
    P: Array  # (T, n, n)
    mode: Array  # (T, M)
    log_likelihood: float


Gaussian: TypeAlias = tuple[Array, Array]
Plants: TypeAlias = Plant | Sequence[Plant]  # the same for all modes, or one for each


def at(matrix: Array, k: int) -> Array:
    return np.asarray(matrix[k]) if matrix.ndim == 3 else matrix


def log_normal(v: Array, S: Array) -> Array:
    """log N(v; 0, S)."""
    L = np.linalg.cholesky(S)
    white = np.linalg.solve(L, v[..., None])[..., 0]
    log_root = np.log(np.diagonal(L, axis1=-2, axis2=-1)).sum(axis=-1)
    size = v.shape[-1] * np.log(2.0 * np.pi)
    return np.asarray(-0.5 * ((white**2).sum(axis=-1) + size) - log_root)


def predicted(plant: Plant, k: int, x: Array, P: Array) -> Gaussian:
    """From step k - 1 to step k."""
    A = at(plant.A, k - 1)
    return x @ A.T, _symmetric(A @ P @ A.T + at(plant.Q, k - 1))


def update(
    plant: Plant, k: int, mode: Mode, x: Array, P: Array, z: Array
) -> tuple[Array, Array, Array]:
    """A mode's estimate and the log-density of the measurement; gamma = 0 leaves the estimate."""
    gamma, delta = mode
    seen = ~np.isnan(z)
    H, R = gamma * at(plant.H, k)[seen], at(plant.R, k)[np.ix_(seen, seen)]
    if gamma == 0:
        laws = delta if isinstance(delta, tuple) else ((1.0, delta),)
        densities = [log_of(share) + log_normal(z[seen], R * d) for share, d in laws]
        return x, P, np.asarray(logsumexp(densities, axis=0))
    assert isinstance(delta, float)
    S = H @ P @ H.T + R * delta
    v = z[seen] - x @ H.T
    K = np.swapaxes(np.linalg.solve(S, H @ P), -1, -2)
    left = np.eye(x.shape[-1]) - K @ H
    P = left @ P @ np.swapaxes(left, -1, -2) + K @ (R * delta) @ np.swapaxes(K, -1, -2)
    return x + (K @ v[..., None])[..., 0], _symmetric(P), log_normal(v, S)


def merged(weight: Array, xs: Array, Ps: Array) -> Gaussian:
    """Mean and covariance of a mixture."""
    x = weight @ xs
    spread = np.einsum("i,ij,ik->jk", weight, xs - x, xs - x)
    return x, _symmetric(np.einsum("i,ijk->jk", weight, Ps) + spread)


def lifted(
    x: Array, P: Array, before: Sequence[str], after: Sequence[str], entering: Entering
) -> Gaussian:
    """To other states: those that are new are independent of all, those that are gone are
    marginalised."""
    if tuple(before) == tuple(after):
        return x, P
    shared = [name for name in after if name in before]
    source = np.array([before.index(s) for s in shared], dtype=int)
    into = np.array([after.index(s) for s in shared], dtype=int)
    y = np.zeros((*x.shape[:-1], len(after)))
    Y = np.zeros((*y.shape, len(after)))
    y[..., into] = x[..., source]
    Y[..., into[:, None], into] = P[..., source[:, None], source]
    for a, name in enumerate(after):
        if name not in before:
            y[..., a], Y[..., a, a] = entering[name]
    return y, Y


def genie(plant: Plant, modes: Sequence[Mode], z: Array) -> Estimates:
    """The Kalman filter that knows every mode."""
    x, P, total, out = plant.x0, plant.P0, 0.0, []
    for k, mode in enumerate(modes):
        if k > 0:
            x, P = predicted(plant, k, x, P)
        x, P, density = update(plant, k, mode, x, P, z[k])
        total += float(density)
        out.append((x, P))
    return _collected(out, [np.zeros(1)] * len(out), total)


def one_step(plant: Plant, chain: Chain, z: Array) -> Estimates:
    """Section III: all modes start from one merged estimate in every step."""
    x, P, log_mode, total, out, posterior = plant.x0, plant.P0, log_of(chain.initial), 0.0, [], []
    for k in range(len(z)):
        if k > 0:
            x, P = predicted(plant, k, x, P)
            log_mode = logsumexp(log_mode[:, None] + log_of(at(chain.transition, k - 1)), axis=0)
        xs, Ps, density = zip(*(update(plant, k, m, x, P, z[k]) for m in chain.modes), strict=True)
        log_mode, evidence = _posterior(log_mode, density)
        x, P = merged(np.exp(log_mode), np.array(xs), np.array(Ps))
        total += evidence
        out.append((x, P))
        posterior.append(log_mode)
    return _collected(out, posterior, total)


def imm(plants: Plants, chain: Chain, z: Array, entering: Entering = NOTHING) -> Estimates:
    """Section IV with all modes: each starts from its own mixture (17)-(18)."""
    bank, states = _bank(plants, chain)
    held = [(plant.x0, plant.P0) for plant in bank]
    log_mode, total, out, posterior = log_of(chain.initial), 0.0, [], []
    for k in range(len(z)):
        if k > 0:
            log_before = log_mode[:, None] + log_of(at(chain.transition, k - 1))  # (from, to)
            log_mode = logsumexp(log_before, axis=0)
            mixed = []
            for j, plant in enumerate(bank):
                possible = np.isfinite(log_mode[j])
                weight = (
                    np.exp(log_before[:, j] - log_mode[j]) if possible else np.eye(len(bank))[j]
                )
                x, P = merged(weight, *_stacked(held, bank, plant.states, entering))
                mixed.append(predicted(plant, k, x, P))
            held = mixed
        updated = [
            update(plant, k, mode, x, P, z[k])
            for plant, mode, (x, P) in zip(bank, chain.modes, held, strict=True)
        ]
        held = [(x, P) for x, P, _ in updated]
        log_mode, evidence = _posterior(log_mode, [density for *_, density in updated])
        total += evidence
        out.append(merged(np.exp(log_mode), *_stacked(held, bank, states, entering)))
        posterior.append(log_mode)
    return _collected(out, posterior, total)


def enumeration(plants: Plants, chain: Chain, z: Array, entering: Entering = NOTHING) -> Estimates:
    """The optimal estimate (3) of every step, over all mode sequences: M^T Kalman filters, in a
    stack (log-weights, x, P) for each last mode."""
    (bank, states), out, posterior, total = _bank(plants, chain), [], [], 0.0
    held = [
        (log_p[None], plant.x0[None], plant.P0[None])
        for log_p, plant in zip(log_of(chain.initial), bank, strict=True)
    ]
    for k in range(len(z)):
        if k > 0:
            log_p, before, held = log_of(at(chain.transition, k - 1)), held, []
            for j, plant in enumerate(bank):
                moved = [
                    (w + log_p[i, j], *lifted(x, P, bank[i].states, plant.states, entering))
                    for i, (w, x, P) in enumerate(before)
                ]
                w, x, P = (np.concatenate(part) for part in zip(*moved, strict=True))
                held.append((w, *predicted(plant, k, x, P)))
        for j, (w, x, P) in enumerate(held):
            x, P, density = update(bank[j], k, chain.modes[j], x, P, z[k])
            held[j] = (w + density, x, P)
        log_weight = np.concatenate([w for w, *_ in held])
        total = float(logsumexp(log_weight))
        posterior.append(np.array([logsumexp(w) for w, *_ in held]) - total)
        all_x, all_P = _stacked([(x, P) for _, x, P in held], bank, states, entering, join=True)
        out.append(merged(np.exp(log_weight - total), all_x, all_P))
    return _collected(out, posterior, total)


def _bank(plants: Plants, chain: Chain) -> tuple[list[Plant], tuple[str, ...]]:
    """One for each mode, and the states of all, in the order of first appearance."""
    bank = [plants] * len(chain.modes) if isinstance(plants, Plant) else list(plants)
    return bank, tuple(dict.fromkeys(name for plant in bank for name in plant.states))


def _stacked(
    held: Sequence[Gaussian], bank: Sequence[Plant], states: Sequence[str], entering: Entering,
    join: bool = False,
) -> Gaussian:  # fmt: skip
    """All modes' estimates of the same states; ``join``: each mode has a stack of its own."""
    parts = [
        lifted(*g, plant.states, states, entering) for g, plant in zip(held, bank, strict=True)
    ]
    stack = np.concatenate if join else np.stack
    return stack([x for x, _ in parts]), stack([P for _, P in parts])


def _posterior(log_prior: Array, density: Sequence[Array]) -> tuple[Array, float]:
    log_weight = log_prior + np.array(density)
    evidence = float(logsumexp(log_weight))
    return log_weight - evidence, evidence


def _symmetric(P: Array) -> Array:
    return np.asarray(0.5 * (P + np.swapaxes(P, -1, -2)))


def _collected(out: Sequence[Gaussian], posterior: Sequence[Array], total: float) -> Estimates:
    x, P = np.array([x for x, _ in out]), np.array([P for _, P in out])
    return Estimates(x, P, np.exp(np.array(posterior)), total)
