"""The optimal estimate of a switching system by brute force, to check the oracle's recursions.

In every sequence of modes the state is conditioned on all measurements at once. States and
measurements are a mean and a row over independent standard normals; nothing is recursive but the
system itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from math import log
from typing import TypeAlias

import numpy as np
from scipy.stats import multivariate_normal

from oracle.step import Array
from oracle.switching import NOTHING, Entering, Plant, at
from oracle.switching_chain import Chain

Affine: TypeAlias = tuple[float, Array]  # mean, row over the sources
Choice: TypeAlias = tuple[int, float, float, float]  # mode, share of it, gamma, delta
MOST = 100  # sources


class Sources:
    """Independent standard normals, handed out in turn."""

    def __init__(self) -> None:
        self.used = 0

    def with_covariance(self, P: Array) -> Array:
        """Rows of a new vector of covariance P."""
        rows = np.zeros((len(P), MOST))
        rows[:, self.used : self.used + len(P)] = np.linalg.cholesky(P)
        self.used += len(P)
        return rows

    def of(self, state: dict[str, Affine], name: str, entering: Entering) -> Affine:
        if name in state:
            return state[name]
        mean, variance = entering[name]
        return mean, self.with_covariance(np.array([[variance]]))[0]


def choices(chain: Chain) -> list[Choice]:
    """Every member of every mode."""
    out = []
    for j, (gamma, delta) in enumerate(chain.modes):
        members = delta if isinstance(delta, tuple) else ((1.0, delta),)
        out += [(j, share, gamma, d) for share, d in members]
    return out


def brute_force(
    bank: Sequence[Plant], chain: Chain, z: Array, entering: Entering = NOTHING
) -> tuple[Array, Array, Array, float]:
    """Mean, covariance, posterior of the modes and log-density, at the last step."""
    names = list(dict.fromkeys(s for plant in bank for s in plant.states))
    found = [
        _conditioned(bank, chain, sequence, z, names, entering)
        for sequence in product(choices(chain), repeat=len(z))
    ]
    total = sum(w for w, *_ in found)
    x = np.asarray(sum(w * y for w, _, y, _ in found) / total)
    P = np.asarray(sum(w * (Y + np.outer(y - x, y - x)) for w, _, y, Y in found) / total)
    mode = [sum(w for w, i, *_ in found if i == j) / total for j in range(len(bank))]
    return x, P, np.array(mode), log(total)


def _conditioned(
    bank: Sequence[Plant], chain: Chain, sequence: Sequence[Choice], z: Array,
    names: Sequence[str], entering: Entering,
) -> tuple[float, int, Array, Array]:  # fmt: skip
    """Weight, last mode, mean and covariance of one sequence."""
    p, sources = float(chain.initial[sequence[0][0]]), Sources()
    state: dict[str, Affine] = {}
    seen: list[tuple[float, float, Array]] = []  # measured, its mean, its row
    for k, (j, share, gamma, delta) in enumerate(sequence):
        plant = bank[j]
        if k == 0:
            mean, rows = plant.x0, sources.with_covariance(plant.P0)
        else:
            p *= at(chain.transition, k - 1)[sequence[k - 1][0], j]
            before = [sources.of(state, name, entering) for name in plant.states]
            A = at(plant.A, k - 1)
            mean, rows = A @ np.array([b[0] for b in before]), A @ np.array([b[1] for b in before])
            rows = rows + sources.with_covariance(at(plant.Q, k - 1))
        p *= share
        state = dict(zip(plant.states, zip(mean, rows, strict=True), strict=True))
        H = gamma * at(plant.H, k)
        z_rows = H @ rows + sources.with_covariance(delta * at(plant.R, k))
        seen += [s for s in zip(z[k], H @ mean, z_rows, strict=True) if not np.isnan(s[0])]
    final = [sources.of(state, name, entering) for name in names]
    x, X = np.array([f[0] for f in final]), np.array([f[1] for f in final])
    v, Z = np.array([a - b for a, b, _ in seen]), np.array([row for *_, row in seen])
    gain = np.linalg.solve(Z @ Z.T, Z @ X.T).T
    density = multivariate_normal(np.zeros(len(v)), Z @ Z.T).pdf(v)
    return float(p * density), sequence[-1][0], x + gain @ v, X @ X.T - gain @ Z @ X.T
