"""Chains of modes (gamma, delta): Sigalov & Oshman's problems 1 to 4.

Rows of a transition matrix are the mode before, columns the mode after.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any, TypeAlias

import numpy as np
from scipy.linalg import expm

from oracle.step import Array

# gamma and delta; of a mode that stands for several: 0 and its members' (share, delta).
Mode: TypeAlias = tuple[float, float | tuple[tuple[float, float], ...]]


@dataclass(frozen=True)
class Chain:
    """Problem 4: M modes and how they follow each other."""

    modes: tuple[Mode, ...]
    transition: Array  # (M, M), or (T-1, M, M): entry k from step k to step k + 1
    initial: Array  # (M,) of the mode at k = 0

    def law(self, steps: int) -> Array:
        """(steps, M): of the mode in each step."""
        out = [self.initial]
        for k in range(steps - 1):
            out.append(out[-1] @ (self.transition[k] if self.transition.ndim == 3
                                  else self.transition))  # fmt: skip
        return np.array(out)

    @property
    def gamma(self) -> Array:
        return np.array([gamma for gamma, _ in self.modes], dtype=np.float64)

    @property
    def delta(self) -> Array:
        """(M,): the mean, of a mode that stands for several."""
        means = [sum(s * d for s, d in m) if isinstance(m, tuple) else m for _, m in self.modes]
        return np.array(means, dtype=np.float64)


def draws(law: Mapping[tuple[float, float], float]) -> Chain:
    """Problem 2: drawn anew in every step, as often as ``law`` says."""
    p = np.array(list(law.values()))
    return Chain(tuple(law), np.tile(p, (len(p), 1)), p)


def independent_draws(gamma: Mapping[float, float], delta: Mapping[float, float]) -> Chain:
    """Problem 1; delta runs fastest."""
    pairs = product(gamma.items(), delta.items())
    return draws({(g, d): p * q for (g, p), (d, q) in pairs})


def independent(
    gamma: Array, delta: Array, levels: Sequence[float], gammas: Sequence[float] = (1.0, 0.0)
) -> Chain:
    """Problem 3: gamma's chain over ``gammas``, delta's over ``levels``, each started from its
    stationary law; delta runs fastest."""
    law = np.asarray(np.kron(stationary(gamma), stationary(delta)), dtype=np.float64)
    return Chain(tuple(product(gammas, levels)), np.asarray(np.kron(gamma, delta)), law)


def from_rates(modes: Sequence[Mode], rates: Array, dt: Any, initial: Array) -> Chain:
    """In continuous time: rates in 1/s from row to column, dt in s, a number or (T-1,)."""
    G = rates - np.diag(np.diag(rates))
    G = G - np.diag(G.sum(axis=1))
    steps = np.array([expm(G * d) for d in np.atleast_1d(dt)])
    return Chain(tuple(modes), steps if np.ndim(dt) else steps[0], initial)


def stationary(transition: Array) -> Array:
    """The law that stays as it is: p P = p, sum p = 1."""
    M = len(transition)
    system = np.vstack([transition.T - np.eye(M), np.ones((1, M))])
    right = np.concatenate([np.zeros(M), [1.0]])
    return np.asarray(np.linalg.lstsq(system, right, rcond=None)[0])


def lumped(chain: Chain, groups: Sequence[Sequence[int]], law: Array) -> Chain:
    """A mode for each group, which draws its member anew in every step, with the members' shares
    in ``law``. Members of a group of two or more have gamma = 0."""
    modes: list[Mode] = []
    member, share = np.zeros((2, len(groups), len(chain.modes)))
    for g, group in enumerate(groups):
        i = list(group)
        member[g, i], share[g, i] = 1.0, law[i] / law[i].sum()
        gammas, deltas = chain.gamma[i], chain.delta[i]
        assert len(i) == 1 or not gammas.any()
        several = tuple(zip(share[g, i].tolist(), deltas.tolist(), strict=True))
        modes.append(chain.modes[i[0]] if len(i) == 1 else (0.0, several))
    return Chain(tuple(modes), share @ chain.transition @ member.T, member @ chain.initial)


def log_of(p: Any) -> Array:
    """log p, -inf where p = 0."""
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(p))
