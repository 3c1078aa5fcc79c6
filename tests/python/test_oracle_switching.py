"""The oracle of the switching filters, against what does not share its formulas."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from numpy.typing import NDArray

from oracle import switching
from oracle.switching import Chain, Plant

ONE = np.ones((1, 1))
SCALAR = Plant(A=-0.8 * ONE, H=ONE, Q=ONE, R=ONE, x0=np.zeros(1), P0=0 * ONE)
TWO = Plant(
    A=np.array([[1.0, 0.5], [-0.2, 0.7]]), H=np.array([[1.0, 0.3]]),
    Q=np.diag([0.3, 0.1]), R=np.array([[0.5]]), x0=np.array([1.0, -1.0]), P0=np.diag([2.0, 1.0]),
)  # fmt: skip
GAMMA = np.array([[0.9, 0.1], [0.6, 0.4]])
DELTA = np.array([[0.8, 0.2], [0.5, 0.5]])


def measured(plant: Plant, chain: Chain, steps: int, seed: int) -> NDArray[np.float64]:
    rng = np.random.default_rng(seed)
    x, mode, z = rng.multivariate_normal(plant.x0, plant.P0), 0, []
    for k in range(steps):
        law = chain.initial if k == 0 else chain.transition[mode]
        mode = int(rng.choice(len(law), p=law / law.sum()))
        if k > 0:
            x = plant.A @ x + rng.multivariate_normal(np.zeros(len(x)), plant.Q)
        gamma, delta = chain.modes[mode]
        z.append(gamma * plant.H @ x + rng.multivariate_normal([0.0], plant.R * delta))
    return np.array(z)


@pytest.mark.parametrize("plant", [SCALAR, TWO])
@pytest.mark.parametrize("seed", range(3))
def test_approximations_are_exact_at_the_first_step(plant: Plant, seed: int) -> None:
    chain = switching.independent(GAMMA, DELTA, (1.0, 10.0))
    z = measured(plant, chain, 5, seed)
    exact = switching.enumeration(plant, chain, z)
    for filter in (switching.one_step, switching.imm):
        found = filter(plant, chain, z)
        np.testing.assert_allclose(found.x[0], exact.x[0], rtol=1e-12, atol=1e-13)
        np.testing.assert_allclose(found.mode[0], exact.mode[0], rtol=1e-12)
        np.testing.assert_allclose(found.x, exact.x, atol=1.0)


def test_enumeration_is_the_conditional_mean() -> None:
    """By sums over a grid of the state: no Kalman filter in it."""
    chain = switching.independent(GAMMA, DELTA, (1.0, 10.0))
    plant = Plant(SCALAR.A, SCALAR.H, SCALAR.Q, SCALAR.R, np.array([0.5]), np.eye(1))
    z = measured(plant, chain, 4, 7)
    grid = np.linspace(-14.0, 14.0, 1401)
    step = grid[1] - grid[0]

    def normal(v: NDArray[np.float64], variance: float) -> NDArray[np.float64]:
        return np.asarray(np.exp(-0.5 * v**2 / variance) / np.sqrt(2 * np.pi * variance))

    joint = chain.initial[:, None] * normal(grid - 0.5, 1.0)
    move = normal(grid[None, :] + 0.8 * grid[:, None], 1.0) * step  # from, to
    means = []
    for k in range(4):
        if k > 0:
            joint = (chain.transition.T @ joint) @ move
        for i, (gamma, delta) in enumerate(chain.modes):
            joint[i] *= normal(z[k, 0] - gamma * grid, delta)
        means.append((joint @ grid).sum() / joint.sum())
    np.testing.assert_allclose(switching.enumeration(plant, chain, z).x[:, 0], means, atol=1e-9)


def test_without_faults_all_are_the_kalman_filter() -> None:
    chain = Chain(((1, 1.0), (0, 1.0)), np.array([[1.0, 0.0], [1.0, 0.0]]), np.array([1.0, 0.0]))
    z = measured(TWO, chain, 8, 1)
    known = switching.genie(TWO, [(1, 1.0)] * 8, z)
    for filter in (switching.one_step, switching.imm):
        found = filter(TWO, chain, z)
        np.testing.assert_allclose(found.x, known.x, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(found.P, known.P, rtol=1e-12, atol=1e-12)
        assert found.log_likelihood == pytest.approx(known.log_likelihood, rel=1e-12)


def second_moments(
    plant: Plant, steps: int, pair: NDArray[np.float64], delta: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """E z z' (T, T) and E x_T z' (1, T) of the scalar plant, z[0] left out; ``pair`` (T, T):
    E gamma_i gamma_j."""
    a, q = plant.A[0, 0], plant.Q[0, 0]
    power = [0.0]
    for _ in range(steps):
        power.append(a * a * power[-1] + q)
    state = np.array(
        [[a ** abs(i - j) * power[min(i, j)] for j in range(1, steps + 1)]
         for i in range(1, steps + 1)]
    )  # fmt: skip
    return pair * state + delta * plant.R[0, 0] * np.eye(steps), state[-1] * np.diag(pair)


@pytest.mark.parametrize("which", ["independent", "drawn once"])
def test_linear_filter_is_the_best_linear_estimate(which: str) -> None:
    """Against the normal equations on second moments: Nahi's case, and example 2, where the
    condition of Lemma 2 holds (29) though the process is no Markov chain."""
    steps, p, q, delta = 7, 0.9, 0.7, 2.8
    if which == "independent":
        mean, p11 = p, p
        pair = np.where(np.eye(steps) > 0, p, p * p)
    else:
        mean = 1 - q * (1 - p)
        p11 = (1 - q * (1 - p * p)) / mean
        pair = np.where(np.eye(steps) > 0, mean, 1 - q * (1 - p * p))
    z = np.random.default_rng(2).normal(size=(steps + 1, 1))
    found = switching.linear_optimal(SCALAR, mean, delta, p11, z)
    for k in range(1, steps + 1):
        zz, xz = second_moments(SCALAR, k, pair[:k, :k], delta)
        best = xz @ np.linalg.solve(zz, z[1 : k + 1, 0])
        assert found[k, 0] == pytest.approx(best, rel=1e-10)


def test_modes_of_the_independent_chain() -> None:
    chain = switching.independent(GAMMA, DELTA, (1.0, 10.0))
    assert chain.modes == ((1, 1.0), (1, 10.0), (0, 1.0), (0, 10.0))
    for (i, a), (j, b) in product(enumerate(chain.modes), repeat=2):
        expected = GAMMA[1 - a[0], 1 - b[0]] * DELTA[int(a[1] > 1), int(b[1] > 1)]
        assert chain.transition[i, j] == pytest.approx(expected)
    np.testing.assert_allclose(chain.initial @ chain.transition, chain.initial, atol=1e-14)
