"""Chains of modes: Problems 1 to 4, rates, the stationary law, lumping."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import surefix as sf
from oracle import switching_chain
from switching.plants import LEVELS, random_chain
from switching.scenes import DELTA, FOUR, GAMMA, mode_chain

SEEDS = st.integers(0, 2**32 - 1)


def test_what_is_given_is_what_it_has() -> None:
    chain = sf.ModeChain([(1, 1), (0, 3.5), (1, 1)], np.full((3, 3), 1 / 3), [0.5, 0.25, 0.25])
    assert chain.modes == ((1.0, 1.0), (0.0, 3.5), (1.0, 1.0))
    assert chain.size == 3
    assert np.array_equal(chain.transition, np.full((3, 3), 1 / 3))
    assert np.array_equal(chain.initial, [0.5, 0.25, 0.25])


def test_problem_1_is_drawn_anew() -> None:
    """delta runs fastest."""
    chain = sf.ModeChain.independent_draws(gamma={1: 0.9, 0: 0.1}, delta={1: 0.8, 10: 0.2})
    assert chain.modes == ((1, 1), (1, 10), (0, 1), (0, 10))
    law = [0.72, 0.18, 0.08, 0.02]
    np.testing.assert_allclose(chain.initial, law, rtol=1e-15)
    np.testing.assert_allclose(chain.transition, [law] * 4, rtol=1e-15)


def test_problem_2_is_drawn_anew() -> None:
    chain = sf.ModeChain.joint_draws({(1, 1): 0.7, (0, 10): 0.3})
    assert chain.modes == ((1, 1), (0, 10))
    np.testing.assert_allclose(chain.initial, [0.7, 0.3], rtol=1e-15)
    np.testing.assert_allclose(chain.transition, [[0.7, 0.3]] * 2, rtol=1e-15)


def test_problem_3_is_a_product() -> None:
    """Rows before, columns after, delta fastest: each entry on its own."""
    chain = sf.ModeChain.independent_chains((1, 0, 0.5), np.eye(3)[[1, 2, 0]] * 0.8 + np.full(
        (3, 3), 0.2 / 3), (1, 10), DELTA)  # fmt: skip
    gamma = np.eye(3)[[1, 2, 0]] * 0.8 + np.full((3, 3), 0.2 / 3)
    pairs = list(product(range(3), range(2)))
    assert chain.modes == tuple(product((1, 0, 0.5), (1, 10)))
    for (i, (g, d)), (j, (g2, d2)) in product(enumerate(pairs), repeat=2):
        assert chain.transition[i, j] == pytest.approx(gamma[g, g2] * DELTA[d, d2], rel=1e-15)
    np.testing.assert_allclose(chain.initial, np.kron([1 / 3] * 3, [5 / 7, 2 / 7]), rtol=1e-14)


def test_problem_1_is_problem_3_of_equal_rows() -> None:
    one = sf.ModeChain.independent_draws(gamma={1: 0.9, 0: 0.1}, delta={1: 0.8, 10: 0.2})
    three = sf.ModeChain.independent_chains((1, 0), [[0.9, 0.1]] * 2, (1, 10), [[0.8, 0.2]] * 2)
    assert one.modes == three.modes
    np.testing.assert_allclose(one.transition, three.transition, rtol=1e-15)
    np.testing.assert_allclose(one.initial, three.initial, rtol=1e-14)


@given(seed=SEEDS)
def test_stationary_law_stays(seed: int) -> None:
    """p P = p, and the mode starts from it where nothing else is said."""
    known = random_chain(seed, LEVELS)
    chain = sf.ModeChain(LEVELS, known.transition)
    p = chain.stationary()
    np.testing.assert_allclose(p @ known.transition, p, rtol=1e-13)
    assert p.sum() == pytest.approx(1.0, rel=1e-15)
    assert (p >= 0.0).all()
    np.testing.assert_allclose(chain.initial, p, rtol=1e-15)
    assert np.array_equal(mode_chain(known).stationary(), p)


STATIONARY: dict[str, tuple[Any, Any]] = {
    "alternates": ([[0, 1], [1, 0]], [0.5, 0.5]),
    "asymmetric": ([[0.9, 0.1], [0.6, 0.4]], [6 / 7, 1 / 7]),
    "ends in one": ([[0.9, 0.1, 0], [0, 0.5, 0.5], [0, 0, 1]], [0, 0, 1]),
    "ends in two of three": ([[0.2, 0.4, 0.4], [0, 0.9, 0.1], [0, 0.3, 0.7]], [0, 0.75, 0.25]),
    "in a circle": (np.eye(3)[[1, 2, 0]], [1 / 3] * 3),
    "rare": ([[1 - 1e-6, 1e-6], [0.25, 0.75]], [0.25 / 0.250001, 1e-6 / 0.250001]),
}


@pytest.mark.parametrize(("transition", "law"), STATIONARY.values(), ids=STATIONARY.keys())
def test_stationary_law(transition: Any, law: Any) -> None:
    modes = [(1.0, 1.0 + i) for i in range(len(law))]
    found = sf.ModeChain(modes, transition).stationary()
    np.testing.assert_allclose(found, law, rtol=1e-13, atol=1e-15)
    assert (found >= 0.0).all()


def test_stationary_law_of_rare_faults_has_no_cancellation() -> None:
    """The diagonal, rounded to 1e-16, says nothing about a rate of 1e-12: only what leaves does."""
    chain = sf.ModeChain(LEVELS[:2], [[1 - 1e-12, 1e-12], [3e-12, 1 - 3e-12]])
    np.testing.assert_allclose(chain.stationary(), [0.75, 0.25], rtol=1e-12)


TWICE: dict[str, Any] = {
    "static": np.eye(2),
    "two ends": [[0.5, 0.25, 0.25], [0, 1, 0], [0, 0, 1]],
    "two islands": np.kron(np.eye(2), GAMMA),
}


@pytest.mark.parametrize("transition", TWICE.values(), ids=TWICE.keys())
def test_law_that_is_not_unique_has_to_be_given(transition: Any) -> None:
    M = len(transition)
    modes = [(1.0, 1.0 + i) for i in range(M)]
    with pytest.raises(sf.SurefixError, match="initial: expected a law"):
        sf.ModeChain(modes, transition)
    first = np.eye(M)[0]
    given = sf.ModeChain(modes, transition, first)
    assert np.array_equal(given.initial, first)
    with pytest.raises(sf.SurefixError, match="stationary"):
        given.stationary()


@given(seed=SEEDS)
def test_law_of_every_step(seed: int) -> None:
    known = random_chain(seed, LEVELS, 9)
    np.testing.assert_allclose(mode_chain(known).law(9), known.law(9), rtol=1e-13)
    same = random_chain(seed, LEVELS)
    np.testing.assert_allclose(mode_chain(same).law(30), same.law(30), rtol=1e-12)
    np.testing.assert_allclose(mode_chain(same).law(1), same.initial[None], rtol=1e-15)


RATES = np.array([[0.0, 1e-4, 2e-5], [0.5, 0.0, 0.1], [0.02, 0.0, 0.0]])


def test_rates_become_transitions() -> None:
    """Steps of no time to steps of a day; the diagonal is not read."""
    dt = np.array([0.0, 1e-9, 1e-3, 0.1, 1.0, 30.0, 86400.0])
    known = switching_chain.from_rates(LEVELS[:3], RATES, dt, np.array([1.0, 0.0, 0.0]))
    rates = RATES.copy()
    np.fill_diagonal(rates, 7.0)
    chain = sf.ModeChain.from_rates(LEVELS[:3], rates, dt, [1.0, 0.0, 0.0])
    assert chain.transition.shape == (7, 3, 3)
    np.testing.assert_allclose(chain.transition, known.transition, rtol=1e-11, atol=1e-15)
    assert np.array_equal(chain.transition[0], np.eye(3))
    np.testing.assert_allclose(chain.transition.sum(axis=2), 1.0, rtol=1e-14)
    assert (chain.transition >= 0.0).all()
    one = sf.ModeChain.from_rates(LEVELS[:3], RATES, 0.1, [1.0, 0.0, 0.0])
    assert one.transition.shape == (3, 3)
    np.testing.assert_allclose(one.transition, known.transition[3], rtol=1e-12, atol=1e-15)


def test_a_stack_of_one_transition_is_for_two_steps() -> None:
    """However it was made; a single matrix is for any number."""
    initial = [0.5, 0.5]
    chains = {
        "given": sf.ModeChain(LEVELS[:2], [GAMMA], initial),
        "rates": sf.ModeChain.from_rates(LEVELS[:2], [[0, 1], [2, 0]], [0.1]),
        "lumped": sf.ModeChain(LEVELS[:2], [GAMMA], initial).lumped([[0], [1]]),
    }
    for name, chain in chains.items():
        assert chain.transition.shape == (1, 2, 2), name
        assert chain.steps == 2, name
        assert chain.law(2).shape == (2, 2), name
    assert sf.ModeChain(LEVELS[:2], GAMMA).steps is None
    assert sf.ModeChain.from_rates(LEVELS[:2], [[0, 1], [2, 0]], 0.1).steps is None


@pytest.mark.parametrize("dt", [1e-12, 1e-6, 1e-2, 1.0, 1e3, 1e9])
@pytest.mark.parametrize(("a", "b"), [(1e-9, 1.0), (0.3, 2.0), (1e-6, 1e4)])
def test_rates_of_two_modes(a: float, b: float, dt: float) -> None:
    """In closed form, every entry to its own last digits, the smallest too."""
    chain = sf.ModeChain.from_rates(LEVELS[:2], [[0, a], [b, 0]], dt)
    gone = -np.expm1(-(a + b) * dt) / (a + b)
    np.testing.assert_allclose(chain.transition[0, 1], a * gone, rtol=1e-12)
    np.testing.assert_allclose(chain.transition[1, 0], b * gone, rtol=1e-12)
    np.testing.assert_allclose(chain.initial, [b / (a + b), a / (a + b)], rtol=1e-9)


def test_rates_of_irregular_steps_start_from_their_stationary_law() -> None:
    """It is one for all steps: p G = 0."""
    chain = sf.ModeChain.from_rates(LEVELS[:3], RATES, [0.1, 5.0, 0.3])
    G = RATES - np.diag(RATES.sum(axis=1))
    np.testing.assert_allclose(chain.initial @ G, 0.0, atol=1e-16)
    np.testing.assert_allclose(chain.law(4), [chain.initial] * 4, rtol=1e-12)


def test_transitions_of_every_step_have_no_stationary_law() -> None:
    known = random_chain(1, LEVELS, 4)
    with pytest.raises(sf.SurefixError, match="initial: "):
        sf.ModeChain(LEVELS, known.transition)
    with pytest.raises(sf.SurefixError, match="stationary"):
        mode_chain(known).stationary()


def test_lumped_interruptions_are_the_papers_three_modes() -> None:
    chain = sf.ModeChain.independent_chains((1, 0), GAMMA, (1, 10), DELTA).lumped_interruptions()
    known = switching_chain.lumped(FOUR, [[0], [1], [2, 3]], FOUR.initial)
    assert chain.size == 3
    np.testing.assert_allclose(chain.transition, known.transition, rtol=1e-14)
    np.testing.assert_allclose(chain.initial, known.initial, rtol=1e-14)
    np.testing.assert_allclose(chain.stationary(), known.initial, rtol=1e-13)


@pytest.mark.parametrize("groups", [[[0], [1], [2], [3]], [[3, 1], [2], [0]], [[2], [0], [1, 3]]])
def test_lumping_in_any_order(groups: list[list[int]]) -> None:
    known = random_chain(6, LEVELS)
    law = switching_chain.stationary(known.transition)
    expected = switching_chain.lumped(known, groups, law)
    lumped = mode_chain(known).lumped(groups)
    np.testing.assert_allclose(lumped.transition, expected.transition, rtol=1e-13)
    np.testing.assert_allclose(lumped.initial, expected.initial, rtol=1e-14)


def test_lumping_where_there_is_no_stationary_law() -> None:
    """By the first law if the modes stay, by the mean law if each step has its own transition."""
    for steps in (0, 5):
        known = random_chain(6, LEVELS, steps)
        if not steps:
            known = switching_chain.Chain(known.modes, np.eye(4), known.initial)
        law = known.law(steps or 1).mean(axis=0)
        expected = switching_chain.lumped(known, [[0], [1, 3], [2]], law)
        lumped = mode_chain(known).lumped([[0], [1, 3], [2]])
        np.testing.assert_allclose(lumped.transition, expected.transition, rtol=1e-14, atol=1e-16)
        np.testing.assert_allclose(lumped.initial, expected.initial, rtol=1e-14)


def test_lumping_a_chain_of_steps_that_starts_healthy() -> None:
    """delta drawn anew: exact, though no interrupted mode has a share at first."""
    P = np.tile([0.7, 0.3 * 0.9, 0.3 * 0.1], (4, 3, 1))
    chain = sf.ModeChain([(1, 1), (0, 1), (0, 10)], P, [1, 0, 0]).lumped_interruptions()
    np.testing.assert_allclose(np.array(chain.branches[1]), [[1, 0.9], [10, 0.1]], rtol=1e-14)
    np.testing.assert_allclose(chain.transition, np.tile([0.7, 0.3], (4, 2, 1)), rtol=1e-14)


def test_lumping_modes_that_are_never_there() -> None:
    """In equal shares."""
    P = np.tile(np.eye(3), (4, 1, 1))
    chain = sf.ModeChain([(1, 1), (0, 1), (0, 10)], P, [1, 0, 0]).lumped_interruptions()
    assert chain.branches[1] == ((1.0, 0.5), (10.0, 0.5))


def test_a_chain_does_not_change_with_what_it_was_made_of() -> None:
    transition, initial = GAMMA.copy(), np.array([0.5, 0.5])
    chain = sf.ModeChain(LEVELS[:2], transition, initial)
    transition[:], initial[:] = 0.5, 0.25
    assert np.array_equal(chain.transition, GAMMA)
    assert np.array_equal(chain.initial, [0.5, 0.5])
