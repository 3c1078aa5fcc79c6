"""Fault modes as Markov chains in continuous time.

A sensor's chain is a star: it fails from healthy (mode 0) into mode m at the rate lambda_m, and
mode m lasts d_m seconds on average and ends in healthy. Generators have the rate from row to column
and rows that sum to zero: dp/dt = p G for a row vector p, and p(t + dt) = p(t) exp(G dt).

The joint chain of several sensors counts mode vectors as itertools.product and numpy.kron do: the
last sensor's mode runs fastest.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.linalg import expm

from oracle.step import Array


@dataclass(frozen=True)
class CommonEvent:
    """An event that strikes several sensors at once: each of them that is healthy then goes into
    its mode. Those that have failed already, and sensors that are not named, stay as they are."""

    rate: float  # 1/s
    modes: Mapping[int, int]  # sensor -> mode


def star(rates: Sequence[float], durations: Sequence[float]) -> Array:
    """Generator (1 + m, 1 + m) in 1/s from m failure rates in 1/s and mean durations in s."""
    if len(rates) != len(durations):
        raise ValueError("every fault mode needs a rate and a mean duration")
    G = np.zeros((len(rates) + 1, len(rates) + 1))
    for mode, (rate, duration) in enumerate(zip(rates, durations, strict=True), start=1):
        G[0, mode], G[mode, 0] = rate, 1.0 / duration
    return _conserving(G)


def joint(generators: Sequence[Array], events: Sequence[CommonEvent] = ()) -> Array:
    """Generator of all sensors together: the Kronecker sum, and the common events on top."""
    sizes = [len(G) for G in generators]
    total = np.zeros((1, 1))
    for G in generators:
        total = np.kron(total, np.eye(len(G))) + np.kron(np.eye(len(total)), G)
    vectors = list(product(*(range(size) for size in sizes)))
    index = {vector: i for i, vector in enumerate(vectors)}
    for event in events:
        for vector in vectors:
            struck = tuple(event.modes.get(s, 0) if m == 0 else m for s, m in enumerate(vector))
            if struck != vector:
                total[index[vector], index[struck]] += event.rate
    return _conserving(total)


def transition(G: Array, dt: float) -> Array:
    """p(mode at t + dt | mode at t) for dt >= 0 in s; the row is the mode at t."""
    return np.asarray(expm(G * dt))


def stationary(G: Array) -> Array:
    """The distribution p with p G = 0; NumPy raises LinAlgError where it is not unique.

    Of a star, p_m = p_0 lambda_m d_m.
    """
    equations = G.T.copy()
    equations[-1] = 1.0  # the last equation follows from the others; the probabilities sum to 1
    return np.linalg.solve(equations, np.eye(len(G))[-1])


def _conserving(G: Array) -> Array:
    """Sets the diagonal, so that no probability is lost."""
    G = G - np.diag(np.diag(G))
    return np.asarray(G - np.diag(G.sum(axis=1)))
