"""The oracle of the switching filters, against what does not share its formulas."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from oracle import switching, switching_chain
from oracle.step import Array
from oracle.switching import Plant
from oracle.switching_chain import Chain
from oracle.switching_sequences import brute_force, choices
from switching.plants import LEVELS, random_chain, random_plant

ONE = np.ones((1, 1))
SCALAR = Plant(A=-0.8 * ONE, H=ONE, Q=ONE, R=ONE, x0=np.zeros(1), P0=0 * ONE)
TWO = Plant(
    A=np.array([[1.0, 0.5], [-0.2, 0.7]]), H=np.array([[1.0, 0.3]]),
    Q=np.diag([0.3, 0.1]), R=np.array([[0.5]]), x0=np.array([1.0, -1.0]), P0=np.diag([2.0, 1.0]),
)  # fmt: skip
GAMMA = np.array([[0.9, 0.1], [0.6, 0.4]])
DELTA = np.array([[0.8, 0.2], [0.5, 0.5]])
FOUR = switching_chain.independent(GAMMA, DELTA, (1.0, 10.0))
THREE = switching_chain.lumped(FOUR, [[0], [1], [2, 3]], FOUR.initial)
STATIC = Chain(((1.0, 1.0), (1.0, 100.0), (0.0, 1.0)), np.eye(3), np.array([0.5, 0.3, 0.2]))


NAMES = ("a", "b", "c")


@pytest.mark.parametrize(("n", "m", "steps"), [(1, 1, 5), (2, 1, 4), (2, 2, 4), (3, 3, 3)])
def test_enumeration_conditions_on_all_measurements_at_once(n: int, m: int, steps: int) -> None:
    """Per-step matrices and chain, components missing, any gamma, a lumped mode."""
    plant = random_plant(n + m, n, m, steps, NAMES[:n])
    chain = random_chain(5, LEVELS, steps)
    rng = np.random.default_rng(3)
    z = rng.normal(size=(steps, m))
    z[1, 0] = np.nan
    z[2, 1:] = np.nan
    for given in (chain, switching_chain.lumped(chain, [[0], [1, 3], [2]], chain.initial)):
        found = switching.enumeration(plant, given, z)
        x, P, mode, density = brute_force([plant] * len(given.modes), given, z)
        np.testing.assert_allclose(found.x[-1], x, rtol=1e-9, atol=1e-11)
        np.testing.assert_allclose(found.P[-1], P, rtol=1e-9, atol=1e-11)
        np.testing.assert_allclose(found.mode[-1], mode, atol=1e-11)
        assert found.log_likelihood == pytest.approx(density, rel=1e-11)


def test_enumeration_of_systems_of_different_size() -> None:
    """A state enters, leaves, and enters anew."""
    steps, states = 4, (("a",), ("b", "a"), ("c", "b"))
    bank = [random_plant(i, len(s), 2, steps, s) for i, s in enumerate(states)]
    chain = random_chain(2, LEVELS[:3], steps)
    z = np.random.default_rng(1).normal(size=(steps, 2))
    z[1, 0] = np.nan
    entering = {"a": (0.3, 2.0), "b": (-1.0, 0.5), "c": (0.0, 3.0)}
    for k in range(1, steps + 1):
        found = switching.enumeration(bank, chain, z[:k], entering)
        x, P, mode, density = brute_force(bank, chain, z[:k], entering)
        np.testing.assert_allclose(found.x[-1], x, rtol=1e-9, atol=1e-11)
        np.testing.assert_allclose(found.P[-1], P, rtol=1e-9, atol=1e-11)
        np.testing.assert_allclose(found.mode[-1], mode, atol=1e-11)
        assert found.log_likelihood == pytest.approx(density, rel=1e-11)


@pytest.mark.parametrize("chain", [FOUR, THREE], ids=["four", "three"])
def test_enumeration_is_the_conditional_mean(chain: Chain) -> None:
    """By sums over a grid of the state: no Gaussian is conditioned in it."""
    plant = Plant(SCALAR.A, SCALAR.H, SCALAR.Q, SCALAR.R, np.array([0.5]), np.eye(1))
    z = np.array([[0.3], [4.0], [-0.7], [2.5]])
    grid = np.linspace(-14.0, 14.0, 1401)
    step = grid[1] - grid[0]

    def normal(v: Array, variance: float) -> Array:
        return np.asarray(np.exp(-0.5 * v**2 / variance) / np.sqrt(2 * np.pi * variance))

    joint = chain.initial[:, None] * normal(grid - 0.5, 1.0)
    move = normal(grid[None, :] + 0.8 * grid[:, None], 1.0) * step  # from, to
    found = switching.enumeration(plant, chain, z)
    for k in range(4):
        if k > 0:
            joint = (chain.transition.T @ joint) @ move
        density = np.zeros_like(joint)
        for j, share, gamma, delta in choices(chain):
            density[j] += share * normal(z[k, 0] - gamma * grid, delta)
        joint *= density
        mass = joint.sum()
        mean = (joint @ grid).sum() / mass
        assert found.x[k, 0] == pytest.approx(mean, abs=1e-9)
        assert found.P[k, 0, 0] == pytest.approx(
            (joint @ (grid - mean) ** 2).sum() / mass, abs=1e-9
        )
        np.testing.assert_allclose(found.mode[k], joint.sum(axis=1) / mass, atol=1e-9)
    assert found.log_likelihood == pytest.approx(np.log(mass * step), abs=1e-9)


@pytest.mark.parametrize("plant", [SCALAR, TWO])
@pytest.mark.parametrize("seed", range(3))
def test_approximations_are_exact_at_the_first_step(plant: Plant, seed: int) -> None:
    z = 3.0 * np.random.default_rng(seed).normal(size=(5, 1))
    exact = switching.enumeration(plant, FOUR, z)
    for filter in (switching.one_step, switching.imm):
        found = filter(plant, FOUR, z)
        np.testing.assert_allclose(found.x[0], exact.x[0], rtol=1e-12, atol=1e-13)
        np.testing.assert_allclose(found.mode[0], exact.mode[0], rtol=1e-12)
        assert 1e-9 < np.abs(found.x - exact.x).max() < 1.0


def test_a_step_of_the_one_step_filter_is_exact_from_its_last_estimate() -> None:
    plant, chain = random_plant(4, 2, 2, 4, NAMES[:2]), random_chain(1, LEVELS[:3], 4)
    z = np.random.default_rng(0).normal(size=(4, 2))
    found = switching.one_step(plant, chain, z)
    A, Q = plant.A[2], plant.Q[2]
    start = Plant(A, plant.H[3], Q, plant.R[3], A @ found.x[2], A @ found.P[2] @ A.T + Q, NAMES[:2])
    follow = Chain(chain.modes, np.eye(3), found.mode[2] @ chain.transition[2])
    x, P, mode, density = brute_force([start] * 3, follow, z[3:])
    np.testing.assert_allclose(found.x[3], x, rtol=1e-10)
    np.testing.assert_allclose(found.P[3], P, rtol=1e-10)
    np.testing.assert_allclose(found.mode[3], mode, atol=1e-12)
    before = switching.one_step(plant, chain, z[:3]).log_likelihood
    assert found.log_likelihood - before == pytest.approx(density, rel=1e-11)


def test_the_second_step_of_the_imm_is_exact_from_the_moments_given_each_mode() -> None:
    """(17) and (18) by what they mean: the law of (mode before, state) given the mode after."""
    bank = [random_plant(i, 2, 2, 2, ("b", "a")[: 1 + i % 2]) for i in range(2)]
    bank = [Plant(p.A[:, :k, :k], p.H[:, :, :k], p.Q[:, :k, :k], p.R, p.x0[:k], p.P0[:k, :k],
                  p.states) for k, p in zip((1, 2), bank, strict=True)]  # fmt: skip
    chain, entering = random_chain(8, LEVELS[:3:2], 2), {"a": (0.3, 2.0)}
    z = np.random.default_rng(5).normal(size=(2, 2))
    given = [brute_force([p], Chain((m,), np.eye(1), np.ones(1)), z[:1])
             for p, m in zip(bank, chain.modes, strict=True)]  # fmt: skip
    weight = chain.initial * np.exp([g[3] for g in given])
    (x, P), (y, Y) = given[0][:2], given[1][:2]
    starts = []
    for j, plant in enumerate(bank):
        first, second = weight * chain.transition[0, :, j] / (weight @ chain.transition[0, :, j])
        if j == 0:  # the state b
            means, covariances = [x, y[:1]], [P, Y[:1, :1]]
        else:
            means, covariances = [np.array([x[0], 0.3]), y], [np.diag([P[0, 0], 2.0]), Y]
        mean = first * means[0] + second * means[1]
        moment = sum(w * (C + np.outer(c, c)) for w, c, C in
                     zip((first, second), means, covariances, strict=True))  # fmt: skip
        A, C = plant.A[0], np.asarray(moment) - np.outer(mean, mean)
        starts.append(Plant(A, plant.H[1], plant.Q[0], plant.R[1], A @ mean,
                            A @ C @ A.T + plant.Q[0], plant.states))  # fmt: skip
    follow = Chain(chain.modes, np.eye(2), weight @ chain.transition[0] / weight.sum())
    x, P, mode, density = brute_force(starts, follow, z[1:], entering)
    found = switching.imm(bank, chain, z, entering)
    np.testing.assert_allclose(found.x[1], x, rtol=1e-10)
    np.testing.assert_allclose(found.P[1], P, rtol=1e-10)
    np.testing.assert_allclose(found.mode[1], mode, atol=1e-12)
    assert found.log_likelihood == pytest.approx(density + np.log(weight.sum()), rel=1e-11)


def test_without_faults_all_are_the_kalman_filter() -> None:
    chain = Chain(((1, 1.0), (0, 1.0)), np.array([[1.0, 0.0], [1.0, 0.0]]), np.array([1.0, 0.0]))
    z = np.random.default_rng(1).normal(size=(8, 1))
    known = switching.genie(TWO, [(1.0, 1.0)] * 8, z)
    for filter in (switching.one_step, switching.imm):
        found = filter(TWO, chain, z)
        np.testing.assert_allclose(found.x, known.x, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(found.P, known.P, rtol=1e-12, atol=1e-12)
        assert found.log_likelihood == pytest.approx(known.log_likelihood, rel=1e-12)


def test_static_modes_whose_probability_no_double_can_hold() -> None:
    """Each mode is a Kalman filter of its own, and its posterior the sum of its log-densities."""
    z = np.random.default_rng(1).normal(size=(6, 1))
    z[2] = 70.0
    known = [switching.genie(SCALAR, [m] * 6, z) for m in STATIC.modes]
    assert known[0].log_likelihood - known[1].log_likelihood < -800.0
    for filter in (switching.imm, switching.enumeration):
        found = filter(SCALAR, STATIC, z)
        evidence = np.log(STATIC.initial) + [k.log_likelihood for k in known]
        total = np.logaddexp.reduce(evidence)
        assert found.log_likelihood == pytest.approx(total, rel=1e-13)
        np.testing.assert_allclose(found.mode[-1], np.exp(evidence - total), rtol=1e-10)
        np.testing.assert_allclose(found.x[-1], known[1].x[-1], rtol=1e-12)


def test_drawn_anew_the_imm_is_the_one_step_filter() -> None:
    """All modes start from the same mixture, (17) does not depend on i."""
    chain = switching_chain.independent_draws({1.0: 0.7, 0.0: 0.3}, {1.0: 0.8, 10.0: 0.2})
    assert chain.modes == ((1.0, 1.0), (1.0, 10.0), (0.0, 1.0), (0.0, 10.0))
    z = 3.0 * np.random.default_rng(4).normal(size=(20, 1))
    one, many = switching.one_step(TWO, chain, z), switching.imm(TWO, chain, z)
    np.testing.assert_allclose(one.x, many.x, rtol=1e-11)
    np.testing.assert_allclose(one.P, many.P, rtol=1e-11)


def test_lumping_loses_nothing_where_delta_is_drawn_anew() -> None:
    """The paper's three modes for its four."""
    full = switching_chain.independent(GAMMA, np.tile([0.8, 0.2], (2, 1)), (1.0, 10.0))
    three = switching_chain.lumped(full, [[0], [1], [2, 3]], full.initial)
    z = 3.0 * np.random.default_rng(4).normal(size=(20, 1))
    for filter in (switching.one_step, switching.imm):
        found, known = filter(TWO, three, z), filter(TWO, full, z)
        np.testing.assert_allclose(found.x, known.x, rtol=1e-11)
        np.testing.assert_allclose(found.P, known.P, rtol=1e-11)
        np.testing.assert_allclose(found.mode[:, 2], known.mode[:, 2:].sum(axis=1), atol=1e-13)
        assert found.log_likelihood == pytest.approx(known.log_likelihood, rel=1e-12)


def test_modes_of_the_independent_chain() -> None:
    assert FOUR.modes == ((1, 1.0), (1, 10.0), (0, 1.0), (0, 10.0))
    for (i, a), (j, b) in product(enumerate(FOUR.modes), repeat=2):
        assert isinstance(a[1], float)
        assert isinstance(b[1], float)
        expected = GAMMA[1 - int(a[0]), 1 - int(b[0])] * DELTA[int(a[1] > 1), int(b[1] > 1)]
        assert FOUR.transition[i, j] == pytest.approx(expected)
    np.testing.assert_allclose(FOUR.initial @ FOUR.transition, FOUR.initial, atol=1e-14)


def test_lumped_law_stays_where_the_shares_are_stationary() -> None:
    assert THREE.modes[:2] == ((1, 1.0), (1, 10.0))
    np.testing.assert_allclose(THREE.initial @ THREE.transition, THREE.initial, atol=1e-14)
    np.testing.assert_allclose(THREE.transition.sum(axis=1), 1.0, atol=1e-14)


def test_rates_of_two_modes() -> None:
    """exp of a generator of two modes, in closed form."""
    a, b, dt = 0.3, 2.0, np.array([0.0, 1e-3, 0.7, 40.0])
    chain = switching_chain.from_rates(
        LEVELS[:2], np.array([[9.0, a], [b, 9.0]]), dt, np.array([1.0, 0.0])
    )
    np.testing.assert_allclose(
        chain.transition[:, 0, 1], a / (a + b) * -np.expm1(-(a + b) * dt), rtol=1e-13
    )
    np.testing.assert_allclose(chain.transition.sum(axis=2), 1.0, rtol=1e-13)
