"""The linear optimal filter, its exact error, and Lemma 2."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import surefix as sf
from oracle import switching, switching_chain, switching_linear
from oracle.step import Array
from oracle.switching import Plant
from oracle.switching_chain import Chain
from switching.plants import random_chain, random_plant, simulated, with_missing
from switching.scenes import (
    FOUR,
    GAMMA,
    HEALTHY,
    ONE,
    SCALAR,
    TOLERANCE,
    assert_gaussians,
    mode_chain,
    system,
)

STEPS = 20
P9 = np.array([[0.1, 0.9], [0.9, 0.1]])  # the paper's example 1, p = 0.9
# Example 2: the channel, alpha, is drawn once, beta and delta in every step; q = 0.7, p = 0.9.
BETA_DELTA = np.array([0.9 * 0.8, 0.9 * 0.2, 0.1 * 0.8, 0.1 * 0.2])
ONCE = Chain(
    ((1.0, 1.0), (1.0, 10.0), (1.0, 1.0), (1.0, 10.0), (0.0, 1.0), (0.0, 10.0)),
    np.block([[np.tile([0.8, 0.2], (2, 1)), np.zeros((2, 4))],
              [np.zeros((4, 2)), np.tile(BETA_DELTA, (4, 1))]]),
    np.concatenate([0.3 * np.array([0.8, 0.2]), 0.7 * BETA_DELTA]),
)  # fmt: skip
STAYS = Chain(((1.0, 1.0), (0.0, 1.0)), np.array([[1.0, 0.0], [0.2, 0.8]]), np.array([0.3, 0.7]))
NAHI = switching_chain.draws({(1.0, 1.0): 0.9, (0.0, 1.0): 0.1})
CHAINS: dict[str, Chain] = {
    "Nahi": NAHI,
    "problem 1": switching_chain.independent_draws({1.0: 0.9, 0.0: 0.1}, {1.0: 0.8, 10.0: 0.2}),
    "problem 2": switching_chain.draws({(1.0, 1.0): 0.7, (0.0, 10.0): 0.3}),
    "problem 3": FOUR,
    "example 1": switching_chain.independent(P9, np.tile([0.8, 0.2], (2, 1)), (1.0, 10.0)),
    "example 2": ONCE,
    "stays one": STAYS,
    "any gamma": random_chain(5, ((1.0, 1.0), (0.3, 3.0), (1.7, 2.0))),
    "per step": random_chain(5, ((1.0, 1.0), (0.0, 3.0), (0.6, 2.0)), STEPS),
}
HOLDS = {
    name: CHAINS[name] for name in ("Nahi", "problem 1", "problem 2", "example 2", "stays one")
}
every = pytest.mark.parametrize("chain", CHAINS.values(), ids=CHAINS.keys())


def compared(plant: Plant, chain: Chain, z: Array, nominal: Array | None = None) -> None:
    found = sf.LinearOptimalFilter(system(plant), mode_chain(chain), nominal=nominal).run(z)
    x = switching_linear.linear_optimal(plant, chain, z, nominal)
    P = switching_linear.mean_square_error(plant, chain, ~np.isnan(z), nominal)
    assert_gaussians(found.x, found.P, x, P)
    assert found.mode_probability is None
    assert found.log_likelihood is None


@every
@pytest.mark.parametrize(("n", "m"), [(1, 1), (2, 1), (3, 2), (5, 3), (1, 2)])
def test_estimates_and_their_exact_error(chain: Chain, n: int, m: int) -> None:
    """Lemma 2's condition may hold or not: the error is exact."""
    per_step = STEPS if (n + m) % 2 else 0
    plant = random_plant(n, n, m, per_step)
    compared(plant, chain, with_missing(simulated(plant, chain, STEPS, 1)[2], 2))


@every
def test_about_a_nominal_path(chain: Chain) -> None:
    """One that is a path of the system, and one that is not."""
    plant = random_plant(3, 2, 2, STEPS)
    path = [plant.x0 + 30.0]
    for A in plant.A:
        path.append(A @ path[-1])
    z = with_missing(simulated(plant, chain, STEPS, 1)[2], 2)
    compared(plant, chain, z, np.array(path))
    compared(plant, chain, z, 10.0 * np.random.default_rng(1).normal(size=(STEPS, 2)))


def test_a_nominal_path_keeps_the_error_from_growing_with_the_state() -> None:
    """Where gamma is one and stays, nothing is gained; where it is drawn, the state itself is noise
    in what the filter without a path sees."""
    plant = replace(SCALAR, A=ONE, x0=np.array([20.0]), Q=0.01 * ONE)
    path = np.full((STEPS, 1), 20.0)
    z = np.full((STEPS, 1), 20.0)
    drawn = mode_chain(CHAINS["problem 1"])
    plain = sf.LinearOptimalFilter(system(plant), drawn).run(z)
    about = sf.LinearOptimalFilter(system(plant), drawn, nominal=path).run(z)
    assert about.P[0, 0, 0] < 1.0 < plain.P[0, 0, 0]
    assert plain.P[0, 0, 0] > 10 * about.P[0, 0, 0]


def test_of_zero_a_nominal_path_says_nothing() -> None:
    plant = replace(random_plant(3, 2, 2), x0=np.zeros(2))
    z = simulated(plant, FOUR, STEPS, 1)[2]
    plain = sf.LinearOptimalFilter(system(plant), mode_chain(FOUR)).run(z)
    about = sf.LinearOptimalFilter(
        system(plant), mode_chain(FOUR), nominal=np.zeros((STEPS, 2))
    ).run(z)
    assert_gaussians(about.x, about.P, plain.x, plain.P, 1e-13)


def test_without_faults_it_is_the_kalman_filter() -> None:
    """Where the mean is zero: of no other does a linear filter know."""
    for n in (1, 2, 3, 5):
        plant = replace(random_plant(n, n, 2, STEPS), x0=np.zeros(n))
        z = with_missing(simulated(plant, HEALTHY, STEPS, 1)[2], 2)
        found = sf.LinearOptimalFilter(system(plant), mode_chain(HEALTHY)).run(z)
        known = switching.genie(plant, HEALTHY.modes * STEPS, z)
        assert_gaussians(found.x, found.P, known.x, known.P, TOLERANCE)


def test_nahi() -> None:
    """Scalar, by his own recursion: the error sigma of the best linear filter, where the chance of
    a measurement p multiplies state and noise alike: K = p M / (p^2 M + p (1 - p) C + R)."""
    p, M, C, x = 0.9, 1.0, 1.0, 0.0
    plant = replace(SCALAR, x0=np.zeros(1))
    z = simulated(plant, NAHI, STEPS, 3)[2]
    found = sf.LinearOptimalFilter(system(plant), mode_chain(NAHI)).run(z)
    for k in range(STEPS):
        if k > 0:
            x, M, C = -0.8 * x, 0.64 * M + 1.0, 0.64 * C + 1.0
        S = p * p * M + p * (1 - p) * C + 1.0
        x, M = x + p * M / S * (z[k, 0] - p * x), M - (p * M) ** 2 / S
        assert found.x[k, 0] == pytest.approx(x, rel=1e-12)
        assert found.P[k, 0, 0] == pytest.approx(M, rel=1e-12)


def normal_equations(chain: Chain, plant: Plant, z: Array) -> tuple[float, float]:
    """The best linear estimate of a scalar state at the last step, and its mean-square error, from
    second moments alone."""
    steps = len(z)
    a, law = float(plant.A[0, 0]), chain.law(steps)
    mean, delta = law @ chain.gamma, law @ chain.delta
    pair = switching_linear.conditional(chain, steps) * mean
    pair = np.where(np.eye(steps) > 0, np.diag(law @ chain.gamma**2), np.nan_to_num(pair))
    pair = np.tril(pair) + np.tril(pair, -1).T
    power = [float(plant.P0[0, 0])]
    for _ in range(steps - 1):
        power.append(a * a * power[-1] + float(plant.Q[0, 0]))
    state = np.array([[a ** abs(i - j) * power[min(i, j)] for j in range(steps)]
                      for i in range(steps)])  # fmt: skip
    zz, xz = pair * state + np.diag(delta * plant.R[0, 0]), mean * state[-1]
    weight = np.linalg.solve(zz, xz)
    return float(weight @ z[:, 0]), float(power[-1] - weight @ xz)


@pytest.mark.parametrize("chain", HOLDS.values(), ids=HOLDS.keys())
def test_where_lemma_2_holds_nothing_linear_is_better(chain: Chain) -> None:
    """Hadidi & Schwartz: example 2 is no Markov process, and one that stays is none that is drawn
    anew."""
    plant = replace(SCALAR, x0=np.zeros(1))
    z = simulated(plant, chain, STEPS, 3)[2]
    found = sf.LinearOptimalFilter(system(plant), mode_chain(chain)).run(z)
    for k in (0, 1, 2, 7, STEPS - 1):
        x, error = normal_equations(chain, plant, z[: k + 1])
        assert found.x[k, 0] == pytest.approx(x, rel=1e-10)
        assert found.P[k, 0, 0] == pytest.approx(error, rel=1e-10)


def test_where_lemma_2_fails_something_linear_is_better() -> None:
    chain = CHAINS["example 1"]
    plant = replace(SCALAR, x0=np.zeros(1))
    z = simulated(plant, chain, STEPS, 3)[2]
    found = sf.LinearOptimalFilter(system(plant), mode_chain(chain)).run(z)
    _, best = normal_equations(chain, plant, z)
    assert found.P[-1, 0, 0] > best * (1 + 1e-4)


@pytest.mark.parametrize("chain", HOLDS.values(), ids=HOLDS.keys())
def test_the_condition_holds(chain: Chain) -> None:
    condition = sf.LinearOptimalFilter(system(SCALAR), mode_chain(chain)).condition(STEPS)
    known = switching_linear.conditional(chain, STEPS)[1, 0]
    assert condition.holds
    for value in (condition.p11, condition.lowest, condition.highest):
        assert value == pytest.approx(known, rel=1e-12)
    assert condition.spread < 1e-12
    assert condition.lags == STEPS - 1


def test_p11_of_equation_29() -> None:
    p, q = 0.9, 0.7
    condition = sf.LinearOptimalFilter(system(SCALAR), mode_chain(ONCE)).condition(STEPS)
    expected = (1 - q * (1 - p * p)) / (1 - q * (1 - p))
    assert condition.p11 == pytest.approx(expected, rel=1e-13)
    assert expected == pytest.approx(0.9323, abs=5e-5)


def test_the_condition_fails_for_example_1() -> None:
    """Pr(1 | 1) is 0.1 after one step and 0.82 after two; what comes later is between."""
    chain = mode_chain(CHAINS["example 1"])
    condition = sf.LinearOptimalFilter(system(SCALAR), chain).condition(STEPS)
    assert not condition.holds
    assert condition.p11 == pytest.approx(0.1, rel=1e-12)
    assert condition.lowest == pytest.approx(0.1, rel=1e-12)
    assert condition.highest == pytest.approx(0.82, rel=1e-12)
    assert condition.spread == pytest.approx(0.72, rel=1e-12)


def test_condition_of_a_chain_that_is_another_in_every_step() -> None:
    """Every entry of the table of k and i: p11 is that of neighbours at the last step."""
    chain = CHAINS["per step"]
    condition = sf.LinearOptimalFilter(system(SCALAR), mode_chain(chain)).condition(7)
    table = switching_linear.conditional(chain, 7)
    assert condition.p11 == pytest.approx(table[6, 5], rel=1e-12)
    assert condition.lowest == pytest.approx(np.nanmin(table), rel=1e-12)
    assert condition.highest == pytest.approx(np.nanmax(table), rel=1e-12)
    spread = max(np.ptp(table[k, :k]) for k in range(1, 7))
    assert condition.spread == pytest.approx(spread, rel=1e-12)
    assert not condition.holds


@pytest.mark.parametrize("p", [0.3, 0.5, 0.6])
def test_corollary_1(p: float) -> None:
    """Of Markov chains of two levels, those of equal rows and those that stay one."""
    transition = np.array([[p, 1 - p], [1 - p, p]])
    chain = sf.ModeChain.independent_chains((1, 0), transition, (1,), [[1.0]])
    filter = sf.LinearOptimalFilter(system(SCALAR), chain)
    assert filter.condition(STEPS).holds == (p == 0.5)


def test_two_steps_have_one_lag() -> None:
    """What could fail is not there yet."""
    filter = sf.LinearOptimalFilter(system(SCALAR), mode_chain(CHAINS["example 1"]))
    assert filter.condition(2).holds
    assert not filter.condition(3).holds


def test_of_what_is_almost_a_draw_the_condition_fails() -> None:
    """1e-6 is no rounding."""
    almost = GAMMA.copy()
    almost[1] = almost[0] + [-1e-6, 1e-6]
    chain = sf.ModeChain.independent_chains((1, 0), almost, (1,), [[1.0]])
    assert not sf.LinearOptimalFilter(system(SCALAR), chain).condition(STEPS).holds


@pytest.mark.parametrize("name", ["example 1", "example 2", "problem 3", "stays one"])
def test_error_is_what_happens(name: str) -> None:
    """4000 runs simulated here, five standard errors: the mean square of the error is P."""
    chain, runs, steps = CHAINS[name], 4000, 12
    rng = np.random.default_rng(4)
    plant = Plant(
        A=np.array([[0.9, 0.3], [-0.2, 0.8]]), H=np.array([[1.0, 0.5]]), Q=np.diag([0.5, 0.2]),
        R=ONE, x0=np.array([1.0, -2.0]), P0=np.diag([1.0, 0.5]),
    )  # fmt: skip
    x = plant.x0 + rng.normal(size=(runs, 2)) * np.sqrt(np.diag(plant.P0))
    mode = rng.choice(len(chain.modes), size=runs, p=chain.initial)
    xs, zs = [], []
    for k in range(steps):
        if k > 0:
            x = x @ plant.A.T + rng.normal(size=(runs, 2)) * np.sqrt(np.diag(plant.Q))
            passed = rng.random(runs)[:, None] > np.cumsum(chain.transition[mode], axis=1)
            mode = np.minimum(passed.sum(axis=1), len(chain.modes) - 1)
        noise = rng.normal(size=(runs, 1)) * np.sqrt(chain.delta[mode])[:, None]
        zs.append(chain.gamma[mode][:, None] * (x @ plant.H.T) + noise)
        xs.append(x)
    z, truth = np.stack(zs, axis=1), np.stack(xs, axis=1)
    found = sf.LinearOptimalFilter(system(plant), mode_chain(chain)).run(z)
    error = found.x - truth
    squares = np.einsum("rka,rkb->rkab", error, error)
    deviation = squares.std(axis=0) / np.sqrt(runs)
    assert (np.abs(squares.mean(axis=0) - found.P[0]) < 5.0 * deviation).all()


def test_it_is_linear() -> None:
    """In the measurements, however far out."""
    plant = random_plant(2, 3, 2)
    filter = sf.LinearOptimalFilter(system(plant), mode_chain(FOUR))
    one, two = np.random.default_rng(1).normal(size=(2, STEPS, 2)) * [[[1.0]], [[1e6]]]
    known = 2.0 * filter.run(one).x - 3.0 * filter.run(two).x
    found = filter.run(2.0 * one - 3.0 * two).x
    np.testing.assert_allclose(found, known, rtol=0.0, atol=1e-13 * np.abs(known).max())


def test_error_does_not_depend_on_the_measurements() -> None:
    """Only on which are missing."""
    plant = random_plant(2, 3, 2)
    filter = sf.LinearOptimalFilter(system(plant), mode_chain(FOUR))
    z = with_missing(np.ones((3, STEPS, 2)), 2)
    z[1] = z[0] * 1e3
    P = filter.run(z).P
    assert np.array_equal(P[0], P[1])
    assert not np.array_equal(P[0], P[2])


def test_levels_of_which_gamma_is_made_up() -> None:
    """0 and 1 need no E gamma^2 of their own; other levels do."""
    halves = switching_chain.draws({(0.5, 1.0): 1.0})
    plant = replace(random_plant(2, 2, 2), x0=np.zeros(2))
    z = simulated(plant, HEALTHY, STEPS, 1)[2]
    found = sf.LinearOptimalFilter(system(plant), mode_chain(halves)).run(z)
    known = switching.genie(replace(plant, H=0.5 * plant.H), HEALTHY.modes * STEPS, z)
    assert_gaussians(found.x, found.P, known.x, known.P)


def test_lumped_modes_have_the_mean_of_their_noise() -> None:
    plant = random_plant(2, 2, 1)
    z = simulated(plant, FOUR, STEPS, 1)[2]
    chain = switching_chain.lumped(FOUR, [[0], [1], [2, 3]], FOUR.initial)
    found = sf.LinearOptimalFilter(system(plant), mode_chain(FOUR).lumped_interruptions()).run(z)
    x = switching_linear.linear_optimal(plant, chain, z)
    P = switching_linear.mean_square_error(plant, chain, np.ones_like(z))
    assert_gaussians(found.x, found.P, x, P)


def test_modes_that_take_turns() -> None:
    """Every second measurement is surely interrupted. Pr(gamma_k = 1 | gamma_{k-1} = 1) is 0 / 0 at
    the others; of all i where it is a number it is 1, Lemma 2 holds, and nothing is better: the
    filter is the genie."""
    plant = replace(random_plant(2, 2, 1), x0=np.zeros(2))
    chain = Chain(((1.0, 1.0), (0.0, 1.0)), np.eye(2)[[1, 0]], np.array([1.0, 0.0]))
    z = simulated(plant, chain, STEPS, 1)[2]
    filter = sf.LinearOptimalFilter(system(plant), mode_chain(chain))
    assert filter.condition(STEPS).holds
    found = filter.run(z)
    known = switching.genie(plant, [chain.modes[k % 2] for k in range(STEPS)], z)
    assert_gaussians(found.x, found.P, known.x, known.P)


def test_a_run_that_surely_starts_interrupted() -> None:
    """Pr(gamma_1 = 1 | gamma_0 = 1) is 0 / 0, and nothing depends on it: z_0 says nothing."""
    plant = random_plant(2, 2, 1)
    chain = Chain(((1.0, 1.0), (0.0, 1.0)), GAMMA, np.array([0.0, 1.0]))
    z = simulated(plant, chain, STEPS, 1)[2]
    compared(plant, chain, z)
    found = sf.LinearOptimalFilter(system(plant), mode_chain(chain)).run(z)
    assert np.array_equal(found.x[0], [0.0, 0.0])
    np.testing.assert_allclose(found.P[0], plant.P0 + np.outer(plant.x0, plant.x0), rtol=1e-14)
