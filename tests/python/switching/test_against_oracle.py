"""Every filter and every problem of the paper against plain NumPy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import surefix as sf
from oracle import models, switching, switching_chain
from oracle.step import Array
from oracle.switching import Estimates, Plant
from oracle.switching_chain import Chain
from switching.plants import LEVELS, random_chain, random_plant, simulated, with_missing
from switching.scenes import (
    APPROXIMATIONS,
    DELTA,
    FOUR,
    GAMMA,
    HEALTHY,
    SCALAR,
    TOLERANCE,
    assert_equal,
    assert_gaussians,
    mode_chain,
    probability,
    system,
)

SIZES = [(1, 1), (1, 2), (2, 1), (2, 2), (3, 2), (3, 3), (5, 1), (5, 3)]
STEPS = 25
Both = tuple[Any, Callable[..., Estimates]]
both = pytest.mark.parametrize("both", APPROXIMATIONS.values(), ids=APPROXIMATIONS.keys())


@both
@pytest.mark.parametrize(("n", "m"), SIZES)
@pytest.mark.parametrize("steps", [0, STEPS], ids=["the same in all steps", "per step"])
def test_all_sizes(both: Both, n: int, m: int, steps: int) -> None:
    """Any gamma, missing components, a chain that is not in its stationary law."""
    filter, oracle = both
    plant, chain = random_plant(n, n, m, steps), random_chain(m, LEVELS, steps)
    z = with_missing(simulated(plant, chain, STEPS, 1)[2], 2)
    assert_equal(filter(system(plant), mode_chain(chain)).run(z), oracle(plant, chain, z))


@given(seed=st.integers(0, 2**32 - 1))
def test_whatever_the_system_and_the_modes(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n, m, M, steps = (int(rng.integers(1, most)) for most in (6, 4, 7, 12))
    plant = random_plant(seed, n, m, steps if rng.random() < 0.5 else 0)
    modes = [(float(rng.choice([1.0, 0.0, rng.normal()])), float(10.0 ** rng.uniform(-2, 3)))
             for _ in range(M)]  # fmt: skip
    chain = random_chain(seed, modes, steps if rng.random() < 0.5 and steps > 1 else 0)
    z = with_missing(simulated(plant, chain, steps, seed)[2], seed, float(rng.uniform(0, 0.5)))
    for filter, oracle in APPROXIMATIONS.values():
        assert_equal(filter(system(plant), mode_chain(chain)).run(z), oracle(plant, chain, z))


PROBLEMS: dict[str, tuple[Callable[[], sf.ModeChain], Chain]] = {
    "1": (
        lambda: sf.ModeChain.independent_draws(gamma={1: 0.9, 0: 0.1}, delta={1: 0.8, 10: 0.2}),
        switching_chain.independent_draws({1.0: 0.9, 0.0: 0.1}, {1.0: 0.8, 10.0: 0.2}),
    ),
    "2": (
        lambda: sf.ModeChain.joint_draws({(1, 1): 0.7, (0, 10): 0.2, (0.5, 2): 0.1}),
        switching_chain.draws({(1.0, 1.0): 0.7, (0.0, 10.0): 0.2, (0.5, 2.0): 0.1}),
    ),
    "3": (lambda: sf.ModeChain.independent_chains((1, 0), GAMMA, (1, 10), DELTA), FOUR),
    "4": (
        lambda: sf.ModeChain(LEVELS, random_chain(9, LEVELS).transition),
        replace(
            random_chain(9, LEVELS),
            initial=switching_chain.stationary(random_chain(9, LEVELS).transition),
        ),
    ),
    "in continuous time, once every 0.3 s": (
        lambda: sf.ModeChain.from_rates(LEVELS[:2], [[0, 0.2], [2.0, 0]], 0.3, [0.5, 0.5]),
        switching_chain.from_rates(
            LEVELS[:2], np.array([[0, 0.2], [2.0, 0]]), 0.3, np.array([0.5, 0.5])
        ),
    ),
}


@both
@pytest.mark.parametrize(("make", "chain"), PROBLEMS.values(), ids=PROBLEMS.keys())
def test_problems(both: Both, make: Callable[[], sf.ModeChain], chain: Chain) -> None:
    filter, oracle = both
    plant = random_plant(3, 2, 1)
    z = with_missing(simulated(plant, chain, STEPS, 4)[2], 5)
    assert_equal(filter(system(plant), make()).run(z), oracle(plant, chain, z))


@both
def test_rates_and_irregular_steps(both: Both) -> None:
    """A motion model and a chain in continuous time, between the same times."""
    filter, oracle = both
    times = np.cumsum([0.0, 0.1, 0.5, 1e-3, 2.0, 0.1, 0.1, 30.0, 0.2])
    dt, rates = np.diff(times), np.array([[0, 0.3, 0.1], [1.0, 0, 0.2], [0.5, 0.0, 0]])
    chain = switching_chain.from_rates(LEVELS[:3], rates, dt, np.array([0.8, 0.1, 0.1]))
    model = models.constant_acceleration(0.3, position=False)
    moves = [models.van_loan(model, d)[:2] for d in dt]
    H, R, x0 = np.array([[1.0, 0.0]]), np.array([[0.5]]), np.array([20.0, 0.0])
    plant = Plant(
        np.array([F for F, _ in moves]), H, np.array([Q for _, Q in moves]), R, x0, np.eye(2)
    )
    given = sf.LinearSystem.from_model(
        sf.ConstantAcceleration(jerk=0.3), times, H, R, x0, np.eye(2)
    )
    np.testing.assert_allclose(given.A, plant.A, rtol=1e-13, atol=1e-15)
    np.testing.assert_allclose(given.Q, plant.Q, rtol=1e-12)
    z = simulated(plant, chain, len(times), 3)[2]
    known = sf.ModeChain.from_rates(LEVELS[:3], rates, dt, chain.initial)
    np.testing.assert_allclose(known.transition, chain.transition, rtol=1e-11)
    assert_equal(filter(given, known).run(z), oracle(plant, chain, z))


@both
@pytest.mark.parametrize(("n", "m"), [(1, 1), (3, 2)])
def test_interruptions_lumped(both: Both, n: int, m: int) -> None:
    """The paper's three modes: the density of the third is a mixture."""
    filter, oracle = both
    plant, given = random_plant(n, n, m), mode_chain(FOUR)
    lumped = switching_chain.lumped(FOUR, [[0], [1], [2, 3]], FOUR.initial)
    z = with_missing(simulated(plant, FOUR, STEPS, n)[2], 1)
    known = oracle(plant, lumped, z)
    assert_equal(filter(system(plant), given.lumped([[0], [1], [2, 3]])).run(z), known)
    assert_equal(filter(system(plant), given.lumped_interruptions()).run(z), known)


@both
def test_three_modes_are_four_where_delta_is_drawn_anew(both: Both) -> None:
    """No approximation: the estimates of both lumped modes are one."""
    filter, _ = both
    chain = sf.ModeChain.independent_chains((1, 0), GAMMA, (1, 10), [[0.8, 0.2]] * 2)
    plant = random_plant(2, 2, 1)
    z = simulated(plant, FOUR, STEPS, 8)[2]
    four = filter(system(plant), chain).run(z)
    three = filter(system(plant), chain.lumped_interruptions()).run(z)
    assert_gaussians(three.x, three.P, four.x, four.P)
    lost = four.mode_probability[:, 2:].sum(axis=1)
    np.testing.assert_allclose(three.mode_probability[:, 2], lost, atol=TOLERANCE)
    assert three.log_likelihood == pytest.approx(four.log_likelihood, rel=TOLERANCE)


def test_drawn_anew_the_imm_is_the_one_step_filter() -> None:
    """Problems 1 and 2: every mode starts from the same mixture."""
    plant, (make, chain) = random_plant(2, 3, 2), PROBLEMS["2"]
    z = simulated(plant, chain, STEPS, 8)[2]
    one = sf.OneStepFilter(system(plant), make()).run(z)
    imm = sf.IMMFilter(system(plant), make()).run(z)
    assert_gaussians(imm.x, imm.P, one.x, one.P)
    np.testing.assert_allclose(probability(imm), probability(one), atol=TOLERANCE)


def test_systems_that_differ_in_their_matrices() -> None:
    """One for each mode: another transition, another noise, another start; the mode after moves."""
    bank = [random_plant(i, 2, 2, STEPS if i == 1 else 0, ("a", "b")) for i in range(3)]
    chain = random_chain(4, LEVELS[:3])
    z = with_missing(simulated(bank[0], chain, STEPS, 1)[2], 2)
    filter = sf.IMMFilter([system(plant) for plant in bank], mode_chain(chain))
    assert_equal(filter.run(z), switching.imm(bank, chain, z))


ENTERING = {"a": (0.3, 2.0), "b": (-1.0, 0.5), "c": (0.0, 3.0)}
STATES: dict[str, tuple[tuple[str, ...], ...]] = {
    "a bias comes and goes": (("a",), ("a", "b")),
    "in another order": (("a", "b"), ("b", "a"), ("a", "b")),
    "none has them all": (("a",), ("b", "a"), ("c", "b")),
    "nothing in common": (("a", "b"), ("c",)),
}


def entering(states: tuple[tuple[str, ...], ...]) -> dict[str, tuple[float, float]]:
    """Of the states that not all have."""
    return {name: e for name, e in ENTERING.items()
            if 0 < sum(name in s for s in states) < len(states)}  # fmt: skip


@pytest.mark.parametrize("states", STATES.values(), ids=STATES.keys())
@pytest.mark.parametrize("steps", [0, STEPS], ids=["the same in all steps", "per step"])
@pytest.mark.parametrize("m", [1, 2])
def test_systems_of_different_size(states: tuple[tuple[str, ...], ...], steps: int, m: int) -> None:
    bank = [random_plant(i, len(s), m, steps, s) for i, s in enumerate(states)]
    chain = random_chain(3, LEVELS[: len(states)], steps)
    z = with_missing(3.0 * np.random.default_rng(m).normal(size=(STEPS, m)), 1)
    filter = sf.IMMFilter([system(p) for p in bank], mode_chain(chain), entering=entering(states))
    assert_equal(filter.run(z), switching.imm(bank, chain, z, ENTERING))


def test_first_step_of_systems_of_different_size_is_exact() -> None:
    states = STATES["none has them all"]
    bank = [random_plant(i, len(s), 2, 0, s) for i, s in enumerate(states)]
    chain, z = random_chain(3, LEVELS[:3]), np.array([[1.0, -2.0]])
    filter = sf.IMMFilter([system(p) for p in bank], mode_chain(chain), entering=entering(states))
    assert_equal(filter.run(z), switching.enumeration(bank, chain, z, ENTERING))


@pytest.mark.parametrize(("n", "m"), SIZES)
def test_genie(n: int, m: int) -> None:
    plant, chain = random_plant(n, n, m, STEPS), random_chain(m, LEVELS)
    _, modes, z = simulated(plant, chain, STEPS, 1)
    z = with_missing(z, 1)
    found = sf.GenieFilter(system(plant), mode_chain(chain)).run(z, modes)
    known = switching.genie(plant, [chain.modes[j] for j in modes], z)
    assert_gaussians(found.x, found.P, known.x, known.P)
    assert found.mode_probability is None
    assert found.log_likelihood == pytest.approx(known.log_likelihood, rel=TOLERANCE)


def test_genie_takes_modes_of_every_run_or_of_all() -> None:
    plant, chain = random_plant(2, 2, 1), random_chain(1, LEVELS)
    drawn = [simulated(plant, chain, STEPS, seed)[1:] for seed in range(3)]
    modes, z = np.array([d[0] for d in drawn]), np.array([d[1] for d in drawn])
    filter = sf.GenieFilter(system(plant), mode_chain(chain))
    own, shared = filter.run(z, modes), filter.run(z, modes[0])
    for i in range(3):
        for found, followed in ((own, modes[i]), (shared, modes[0])):
            known = switching.genie(plant, [chain.modes[j] for j in followed], z[i])
            assert_gaussians(found.x[i], found.P[i], known.x, known.P)


@both
@pytest.mark.parametrize("n", [1, 2, 3, 5])
def test_without_faults_all_are_the_kalman_filter(both: Both, n: int) -> None:
    """In a chain that knows faults and never has them, and in one that knows none."""
    plant = random_plant(n, n, 2, STEPS)
    z = with_missing(simulated(plant, HEALTHY, STEPS, n)[2], 1)
    known = switching.genie(plant, HEALTHY.modes * STEPS, z)
    never = Chain(LEVELS[:2], np.array([[1.0, 0.0], [0.5, 0.5]]), np.array([1.0, 0.0]))
    results = [both[0](system(plant), mode_chain(chain)).run(z) for chain in (HEALTHY, never)]
    genie = sf.GenieFilter(system(plant)).run(z)
    for found in (*results, genie):
        assert_gaussians(found.x, found.P, known.x, known.P, 1e-12)
        assert found.log_likelihood == pytest.approx(known.log_likelihood, rel=1e-12)
    np.testing.assert_array_equal(results[1].mode_probability[:, 1], 0.0)


@both
def test_gamma_scales_the_row_and_delta_the_noise(both: Both) -> None:
    """A mode (gamma, delta) is a healthy system of H gamma and R delta."""
    plant = random_plant(1, 3, 2)
    z = simulated(plant, HEALTHY, STEPS, 1)[2]
    scaled = replace(plant, H=-0.7 * plant.H, R=3.0 * plant.R)
    found = both[0](system(plant), sf.ModeChain([(-0.7, 3.0)], [[1.0]])).run(z)
    known = switching.genie(scaled, HEALTHY.modes * STEPS, z)
    assert_gaussians(found.x, found.P, known.x, known.P)


def loss(estimates: Any, exact: Estimates) -> float:
    """Mean squared difference from the optimal estimate, in the optimal variance. On average over
    all there may be, the filter's mean squared error is larger than the optimal one by just this:
    what is left of the error by the optimal estimate is orthogonal to the measurements."""
    d = estimates.x - exact.x
    return float(np.mean(np.einsum("ki,kij,kj->k", d, np.linalg.inv(exact.P), d)) / d.shape[1])


@pytest.mark.parametrize("plant", [SCALAR, Plant(
    A=np.array([[1.0, 0.5], [0.0, 0.9]]), H=np.array([[1.0, 0.0]]), Q=np.diag([0.01, 0.1]),
    R=np.eye(1), x0=np.zeros(2), P0=np.eye(2),
)], ids=["scalar", "two states"])  # fmt: skip
def test_loss_against_all_sequences_of_modes(plant: Plant) -> None:
    """Eight steps, the paper's three modes, 3^8 Kalman filters: the first step is exact; after it
    something is lost, less by the IMM, which keeps what one mode's history says, than by the
    one-step filter, and less than a twentieth of the optimal error by both."""
    chain = switching_chain.lumped(FOUR, [[0], [1], [2, 3]], FOUR.initial)
    filters = {name: f(system(plant), mode_chain(FOUR).lumped_interruptions())
               for name, (f, _) in APPROXIMATIONS.items()}  # fmt: skip
    losses: dict[str, list[float]] = {"one step": [], "imm": []}
    for seed in range(20):
        z = simulated(plant, FOUR, 8, seed)[2]
        exact = switching.enumeration(plant, chain, z)
        for name, filter in filters.items():
            found = filter.run(z)
            losses[name].append(loss(found, exact))
            assert_gaussians(found.x[:1], found.P[:1], exact.x[:1], exact.P[:1])
            np.testing.assert_allclose(found.mode_probability[0], exact.mode[0], atol=TOLERANCE)
    one, imm = (float(np.mean(losses[name])) for name in ("one step", "imm"))
    assert 1e-6 < imm < one < 0.05


@both
def test_one_measurement_among_missing_ones_is_exact(both: Both) -> None:
    """Nothing is merged that a measurement told apart: the optimal mean, covariance and modes of
    every step up to the second measurement."""
    plant, chain = random_plant(2, 3, 2), random_chain(1, LEVELS)
    z = np.full((7, 2), np.nan)
    z[2] = 1.0, -2.0
    known = switching.enumeration(plant, chain, z)
    assert_equal(both[0](system(plant), mode_chain(chain)).run(z), known)


def test_measurements_of_every_shape() -> None:
    """The axis of runs is there where z has it."""
    plant, chain = random_plant(1, 2, 1), random_chain(1, LEVELS[:3])
    z = np.array([simulated(plant, chain, STEPS, s)[2] for s in range(3)])
    for name, (filter, oracle) in APPROXIMATIONS.items():
        made = filter(system(plant), mode_chain(chain))
        many, one = made.run(z), made.run(z[0])
        assert many.x.shape == (3, STEPS, 2), name
        assert many.P.shape == (3, STEPS, 2, 2)
        assert many.mode_probability.shape == (3, STEPS, 3)
        assert many.log_likelihood.shape == (3,)
        assert isinstance(one.log_likelihood, float)
        for i in range(3):
            known = oracle(plant, chain, z[i])
            assert_gaussians(many.x[i], many.P[i], known.x, known.P)
            assert many.log_likelihood[i] == pytest.approx(known.log_likelihood, rel=TOLERANCE)


def missing_by(mask: bool, z: Array) -> dict[str, Array]:
    gone = np.isnan(z)
    return {"z": np.where(gone, 1e8, z), "missing": gone} if mask else {"z": z}


@both
def test_a_mask_says_the_same_as_not_a_number(both: Both) -> None:
    """What stands under the mask is not read."""
    plant, chain = random_plant(1, 2, 3), random_chain(1, LEVELS)
    z = with_missing(simulated(plant, chain, STEPS, 1)[2], 1)
    filter = both[0](system(plant), mode_chain(chain))
    masked, nan = filter.run(**missing_by(True, z)), filter.run(**missing_by(False, z))
    assert np.array_equal(masked.x, nan.x)
    assert masked.log_likelihood == nan.log_likelihood
