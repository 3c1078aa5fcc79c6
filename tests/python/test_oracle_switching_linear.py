"""The oracle of the linear optimal filter, against what does not share its formulas."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from oracle import switching, switching_chain, switching_linear
from oracle.step import Array
from oracle.switching import Plant
from oracle.switching_chain import Chain
from switching.plants import LEVELS, random_chain, random_plant

# Channel alpha is drawn once, beta in every step: gamma = 1 - alpha + alpha beta (example 2).
ONCE = Chain(
    ((1.0, 2.8), (1.0, 2.8), (0.0, 2.8)),
    np.array([[1.0, 0.0, 0.0], [0.0, 0.9, 0.1], [0.0, 0.9, 0.1]]), np.array([0.3, 0.63, 0.07]),
)  # fmt: skip
STAYS = Chain(
    ((1.0, 1.0), (0.0, 2.0)), np.array([[1.0, 0.0], [0.2, 0.8]]), np.array([0.3, 0.7])
)  # fmt: skip
HOLDS = {
    "Nahi": switching_chain.draws({(1.0, 1.0): 0.8, (0.0, 1.0): 0.2}),
    "levels": switching_chain.draws({(1.0, 1.0): 0.5, (-0.3, 2.0): 0.2, (0.5, 3.0): 0.3}),
    "drawn once": ONCE,
    "stays one": STAYS,
}
FAILS = random_chain(3, LEVELS, 5)


def second_moments(plant: Plant, chain: Chain, steps: int) -> tuple[Array, Array, Array]:
    """E z z' of all steps, E x z' of the last one and E x x'; E gamma_i gamma_j by sums over all
    sequences of modes, E x_i x_j' over the independent sources of the state."""
    pair, delta, mean = np.zeros((steps, steps)), np.zeros(steps), np.zeros(steps)
    for sequence in product(range(len(chain.modes)), repeat=steps):
        p = chain.initial[sequence[0]]
        for k in range(1, steps):
            p *= switching.at(chain.transition, k - 1)[sequence[k - 1], sequence[k]]
        g = chain.gamma[list(sequence)]
        pair, mean, delta = pair + p * np.outer(g, g), mean + p * g, delta + p * chain.delta[
            list(sequence)
        ]  # fmt: skip
    n, m = len(plant.x0), switching.at(plant.H, 0).shape[0]
    rows = np.zeros((n, n * steps + 1))
    rows[:, 0], rows[:, 1 : n + 1] = plant.x0, np.linalg.cholesky(plant.P0 + 1e-300 * np.eye(n))
    xs = [rows]
    for k in range(1, steps):
        rows = switching.at(plant.A, k - 1) @ rows
        rows[:, 1 + n * k : 1 + n * (k + 1)] = np.linalg.cholesky(switching.at(plant.Q, k - 1))
        xs.append(rows)
    seen = [switching.at(plant.H, k) @ x for k, x in enumerate(xs)]
    zz = np.block([[pair[i, j] * seen[i] @ seen[j].T for j in range(steps)] for i in range(steps)])
    for k in range(steps):
        zz[m * k : m * (k + 1), m * k : m * (k + 1)] += delta[k] * switching.at(plant.R, k)
    xz = np.hstack([mean[i] * xs[-1] @ seen[i].T for i in range(steps)])
    return zz, xz, xs[-1] @ xs[-1].T


@pytest.mark.parametrize("chain", HOLDS.values(), ids=HOLDS.keys())
@pytest.mark.parametrize("n", [1, 2])
def test_linear_filter_is_the_best_linear_estimate(chain: Chain, n: int) -> None:
    """Against the normal equations on second moments, with matrices of every step and missing
    components, where Lemma 2 holds."""
    steps, m = 5, n
    plant = random_plant(7, n, m, steps)
    z = np.random.default_rng(2).normal(size=(steps, m))
    z[1, 0] = np.nan
    found = switching_linear.linear_optimal(plant, chain, z)
    error = switching_linear.mean_square_error(plant, chain, ~np.isnan(z))
    for k in range(1, steps + 1):
        zz, xz, xx = second_moments(plant, chain, k)
        seen = ~np.isnan(z[:k].ravel())
        best = np.linalg.solve(zz[np.ix_(seen, seen)], xz[:, seen].T).T
        np.testing.assert_allclose(found[k - 1], best @ z[:k].ravel()[seen], rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(error[k - 1], xx - best @ xz[:, seen].T, rtol=1e-9, atol=1e-12)


def test_mean_square_error_where_the_condition_fails() -> None:
    """The filter is linear in z: its weights by unit measurements, its error by second moments;
    larger than that of the best linear estimate."""
    steps, n, m = 5, 2, 2
    plant = random_plant(7, n, m, steps)
    given = switching_linear.mean_square_error(plant, FAILS, np.ones((steps, m)))
    W = np.array(
        [switching_linear.linear_optimal(plant, FAILS, unit.reshape(steps, m))[-1]
         for unit in np.eye(steps * m)]
    ).T  # fmt: skip
    zz, xz, xx = second_moments(plant, FAILS, steps)
    error = xx - W @ xz.T - xz @ W.T + W @ zz @ W.T
    np.testing.assert_allclose(given[-1], error, rtol=1e-9)
    best = xx - xz @ np.linalg.solve(zz, xz.T)
    assert np.trace(error) > np.trace(best) * (1 + 1e-6)


@pytest.mark.parametrize("chain", [*HOLDS.values(), FAILS], ids=[*HOLDS, "fails"])
def test_mean_square_error_about_a_nominal_path(chain: Chain) -> None:
    """Against all sequences of modes: in each, error and measurement are linear in independent
    sources, and have a mean."""
    steps, n, m = 4, 2, 1
    plant = random_plant(9, n, m, steps)
    path = 5.0 * np.random.default_rng(1).normal(size=(steps, n))
    mean = chain.law(steps) @ chain.gamma
    weights = [
        switching_linear.linear_optimal(plant, chain, unit.reshape(steps, m), path)[-1]
        for unit in np.vstack([np.zeros(steps * m), np.eye(steps * m)])
    ]
    W = np.array([w - weights[0] for w in weights[1:]]).T
    known = np.array([mean[k] * plant.H[k] @ path[k] for k in range(steps)]).ravel()
    np.testing.assert_allclose(weights[0], path[-1] - W @ known, atol=1e-12)
    error = np.zeros((n, n))
    for sequence in product(range(len(chain.modes)), repeat=steps):
        p, root = chain.initial[sequence[0]], np.linalg.cholesky(plant.P0)
        rows = np.hstack([root, np.zeros((n, n * (steps - 1)))])
        shift, off, noise = np.zeros(n), np.zeros((n, n * steps)), np.zeros((n, n))
        for k, j in enumerate(sequence):
            if k > 0:
                p *= switching.at(chain.transition, k - 1)[sequence[k - 1], j]
                rows = plant.A[k - 1] @ rows
                rows[:, n * k : n * (k + 1)] = np.linalg.cholesky(plant.Q[k - 1])
            Wk = W[:, m * k : m * (k + 1)]
            gamma, delta = chain.gamma[j], chain.delta[j]
            off = off + gamma * Wk @ plant.H[k] @ rows
            shift = shift + (gamma - mean[k]) * Wk @ plant.H[k] @ path[k]
            noise = noise + delta * Wk @ plant.R[k] @ Wk.T
        error += p * ((rows - off) @ (rows - off).T + np.outer(shift, shift) + noise)
    given = switching_linear.mean_square_error(plant, chain, np.ones((steps, m)), path)
    np.testing.assert_allclose(given[-1], error, rtol=1e-9)


def test_conditional_probabilities_of_lemma_2() -> None:
    p, q = 0.9, 0.7
    once = switching_linear.conditional(ONCE, 6)
    below = np.tril_indices(6, -1)
    np.testing.assert_allclose(once[below], (1 - q * (1 - p * p)) / (1 - q * (1 - p)), rtol=1e-14)
    np.testing.assert_allclose(switching_linear.conditional(STAYS, 6)[below], 1.0, rtol=1e-14)
    P = np.array([[1 - p, p], [p, 1 - p]])  # example 1
    flips = switching_chain.independent(P, np.ones((1, 1)), (1.0,))
    powers = [np.linalg.matrix_power(P, lag)[0, 0] for lag in range(1, 6)]
    np.testing.assert_allclose(switching_linear.conditional(flips, 6)[5, ::-1][1:], powers)
