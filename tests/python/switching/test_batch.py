"""Runs in batches and threads: the same bits as one by one."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest

import surefix as sf
from oracle.step import Array
from switching.plants import LEVELS, random_chain, random_plant, simulated, with_missing
from switching.scenes import FOUR, SCALAR, arrays, assert_same_bits, mode_chain, system

RUNS, STEPS = 20, 15
NAMES = ("A", "H", "Q", "R", "x0", "P0")
PLANT = random_plant(2, 3, 2)
CHAIN = random_chain(2, LEVELS)
SMALL = [random_plant(1, 1, 2, states=("a",)), random_plant(2, 2, 2, states=("b", "a"))]
Run = Callable[..., sf.SwitchingResult]


def genie(z: Array, runs: slice = slice(None), **options: Any) -> sf.SwitchingResult:
    made = sf.GenieFilter(system(PLANT), mode_chain(CHAIN))
    drawn = simulations()[0][runs]
    return made.run(z, drawn if z.ndim == 3 else drawn[0], **options)


def of(filter: Any) -> Run:
    def run(z: Array, runs: slice = slice(None), **options: Any) -> Any:
        return filter.run(z, **options)

    return run


def scalar(filter: Any, known: bool = False) -> Run:
    """Of the first component; ``known``: its modes."""

    def run(z: Array, runs: slice = slice(None), missing: Any = None, **options: Any) -> Any:
        if known:
            drawn = simulations()[0][runs]
            options["modes"] = drawn if z.ndim == 3 else drawn[0]
        gone = None if missing is None else missing[..., :1]
        return filter.run(z[..., :1], missing=gone, **options)

    return run


def different(count: int) -> Any:
    chain = random_chain(3, LEVELS[:count])
    bank = [system(p) for p in SMALL[:count]]
    return sf.IMMFilter(bank, mode_chain(chain), entering={"b": (0.0, 2.0)})


FILTERS: dict[str, Callable[[], Run]] = {
    "one step": lambda: of(sf.OneStepFilter(system(PLANT), mode_chain(CHAIN))),
    "imm": lambda: of(sf.IMMFilter(system(PLANT), mode_chain(CHAIN))),
    "imm, per step": lambda: of(
        sf.IMMFilter(
            system(random_plant(4, 3, 2, STEPS)), mode_chain(random_chain(4, LEVELS, STEPS))
        )
    ),
    "imm, lumped": lambda: of(sf.IMMFilter(system(PLANT), mode_chain(FOUR).lumped_interruptions())),
    "imm, different sizes": lambda: of(different(2)),
    "one step, scalar": lambda: scalar(sf.OneStepFilter(system(SCALAR), mode_chain(FOUR))),
    "imm, scalar": lambda: scalar(sf.IMMFilter(system(SCALAR), mode_chain(FOUR))),
    "one step, scalar, lumped": lambda: scalar(
        sf.OneStepFilter(system(SCALAR), mode_chain(FOUR).lumped_interruptions())
    ),
    "imm, scalar, lumped": lambda: scalar(
        sf.IMMFilter(system(SCALAR), mode_chain(FOUR).lumped_interruptions())
    ),
    "imm, scalar, three modes": lambda: scalar(
        sf.IMMFilter(system(SCALAR), mode_chain(random_chain(3, LEVELS[:3])))
    ),
    "genie, scalar": lambda: scalar(sf.GenieFilter(system(SCALAR), mode_chain(CHAIN)), known=True),
    "genie": lambda: genie,
    "linear": lambda: of(sf.LinearOptimalFilter(system(PLANT), mode_chain(CHAIN))),
    "linear, nominal": lambda: of(
        sf.LinearOptimalFilter(
            system(PLANT), mode_chain(CHAIN), nominal=np.linspace(0, 9, 3 * STEPS).reshape(-1, 3)
        )
    ),
}
every = pytest.mark.parametrize("make", FILTERS.values(), ids=FILTERS.keys())


@cache
def simulations() -> Any:
    """Modes (runs, steps) and measurements (runs, steps, m)."""
    drawn = [simulated(PLANT, CHAIN, STEPS, seed)[1:] for seed in range(RUNS)]
    return np.array([d[0] for d in drawn]), np.array([d[1] for d in drawn])


def measured(kind: str) -> Array:
    z: Array = simulations()[1].copy()
    if "missing" in kind:  # in some runs components, in others whole measurements
        z[::3] = with_missing(z[::3], 1)
        z[1::5, 4:9] = np.nan
    if "outliers" in kind:  # some so far out that only one mode is left
        z[2::4, 6] += 1e3
        z[5, 3] = 1e8
    return z


KINDS = ("clean", "missing", "outliers", "missing and outliers")


@every
@pytest.mark.parametrize("kind", KINDS)
def test_runs_one_by_one_and_in_batches_of_all_sizes(make: Callable[[], Run], kind: str) -> None:
    run, z = make(), measured(kind)
    alone = [run(z[i], slice(i, i + 1)) for i in range(RUNS)]
    for count in range(1, RUNS + 1):
        first = (RUNS - count) // 2
        batch = run(z[first : first + count], slice(first, first + count))
        for i in range(count):
            for many, one in zip(arrays(batch), arrays(alone[first + i]), strict=True):
                assert np.array_equal(many[i], one), f"run {i} of {count}"


@every
@pytest.mark.parametrize("kind", KINDS[::3])
def test_threads_do_not_change_a_bit(make: Callable[[], Run], kind: str) -> None:
    run, z = make(), measured(kind)
    known = run(z)
    for threads in (1, 2, 3):
        assert_same_bits(run(z, threads=threads), known)
    assert_same_bits(run(z[:2], slice(0, 2), threads=3), run(z[:2], slice(0, 2), threads=1))


@every
def test_a_run_does_not_know_its_neighbours(make: Callable[[], Run]) -> None:
    """In another order, and with neighbours that are all missing or far out."""
    run, z = make(), measured("missing")
    known = run(z[4], slice(4, 5))
    around = np.full_like(z, np.nan)
    around[::2] = 1e8
    around[4] = z[4]
    for many, one in zip(arrays(run(around)), arrays(known), strict=True):
        assert np.array_equal(many[4], one)


@every
def test_twice_is_the_same(make: Callable[[], Run]) -> None:
    """No state is left from a run, and what is given is not changed."""
    run, z = make(), measured("missing and outliers")
    before = z.copy()
    first, second = run(z), run(z)
    assert_same_bits(first, second)
    assert np.array_equal(z, before, equal_nan=True)
    for a in (*arrays(first), *arrays(second)):
        assert not np.shares_memory(a, z)


@every
def test_masks_in_some_runs(make: Callable[[], Run]) -> None:
    run, z = make(), measured("missing")
    gone = np.isnan(z)
    assert_same_bits(run(np.where(gone, -1e8, z), missing=gone), run(z))
    half = gone & (np.arange(2) == 0)  # the others as not a number
    assert_same_bits(run(np.where(half, 3.0, z), missing=half), run(z))


@pytest.mark.parametrize("axes", [2, 3])
def test_masked_arrays_of_numpy(axes: int) -> None:
    """What is masked is missing, and so is what is not a number."""
    filter = sf.IMMFilter(system(PLANT), mode_chain(CHAIN))
    z = measured("missing") if axes == 3 else measured("missing")[1]
    gone = np.isnan(z) & (np.arange(2) == 0)
    assert gone.any()
    masked = np.ma.masked_array(np.where(gone, 1e8, z), gone)
    assert_same_bits(filter.run(masked), filter.run(z))
    whole = np.ma.masked_array(np.ones(z.shape, int), gone)
    assert_same_bits(filter.run(whole), filter.run(np.where(gone, np.nan, 1.0)))


PICKLED: dict[str, Callable[[], Any]] = {
    "one step": lambda: sf.OneStepFilter(system(PLANT), mode_chain(CHAIN)),
    "imm": lambda: sf.IMMFilter(system(PLANT), mode_chain(FOUR).lumped_interruptions()),
    "imm, per step": lambda: sf.IMMFilter(
        system(random_plant(4, 3, 2, STEPS)), mode_chain(random_chain(4, LEVELS, STEPS))
    ),
    "imm, different sizes": lambda: different(2),
    "genie": lambda: sf.GenieFilter(system(PLANT), mode_chain(CHAIN)),
    "kalman": lambda: sf.GenieFilter(system(PLANT)),
    "linear": lambda: sf.LinearOptimalFilter(
        system(PLANT), mode_chain(CHAIN), nominal=np.linspace(0, 9, 3 * STEPS).reshape(-1, 3)
    ),
}


@pytest.mark.parametrize("make", PICKLED.values(), ids=PICKLED.keys())
def test_pickled_filter_is_the_same(make: Callable[[], Any]) -> None:
    """Copies of it too."""
    filter, z = make(), measured("missing and outliers")
    for copied in (pickle.loads(pickle.dumps(filter)), copy.deepcopy(filter)):
        assert_same_bits(copied.run(z), filter.run(z))


@pytest.mark.parametrize("steps", [0, 2, 5])
def test_pickled_parts_are_the_same(steps: int) -> None:
    """Shapes, and the number of steps that they are for."""
    made, chain = system(random_plant(1, 2, 1, steps)), mode_chain(random_chain(1, LEVELS, steps))
    copied, followed = pickle.loads(pickle.dumps((made, chain)))
    assert copied.steps == made.steps == followed.steps == chain.steps == (steps or None)
    for name in NAMES:
        assert np.array_equal(getattr(copied, name), getattr(made, name)), name
    assert np.array_equal(followed.transition, chain.transition)
    assert np.array_equal(followed.initial, chain.initial)
    assert followed.modes == chain.modes


def test_what_is_given_is_not_changed() -> None:
    given: dict[str, Any] = {name: np.array(getattr(PLANT, name)) for name in NAMES}
    transition, initial = CHAIN.transition.copy(), CHAIN.initial.copy()
    nominal, z, gone = np.ones((STEPS, 3)), measured("clean"), np.zeros((RUNS, STEPS, 2), bool)
    followed = simulations()[0].copy()
    arguments = [*given.values(), transition, initial, nominal, z, gone, followed]
    before = [a.copy() for a in arguments]
    made, chain = sf.LinearSystem(**given), sf.ModeChain(LEVELS, transition, initial)
    sf.OneStepFilter(made, chain).run(z, missing=gone)
    sf.IMMFilter(made, chain).run(z, missing=gone)
    sf.GenieFilter(made, chain).run(z, modes=followed, missing=gone)
    sf.LinearOptimalFilter(made, chain, nominal=nominal).run(z, missing=gone)
    for a, b in zip(arguments, before, strict=True):
        assert np.array_equal(a, b)


def test_what_is_given_may_lie_in_memory_as_it_likes() -> None:
    """Columns first, every second row, backwards, read-only, whole numbers."""
    z = np.round(measured("clean"))
    filter = sf.IMMFilter(system(PLANT), mode_chain(CHAIN))
    known = filter.run(z)
    spread = np.zeros((2 * RUNS, STEPS, 2))
    spread[::2] = z
    locked = z.copy()
    locked.setflags(write=False)
    for given in (np.asfortranarray(z), spread[::2], z[::-1].copy()[::-1], locked, z.tolist()):
        assert_same_bits(filter.run(given), known)
    assert_same_bits(filter.run(z.astype(np.int64)), known)
    turned: dict[str, Any] = {name: np.asfortranarray(getattr(PLANT, name)) for name in NAMES}
    twisted = sf.LinearSystem(**turned)
    assert_same_bits(sf.IMMFilter(twisted, mode_chain(CHAIN)).run(z), known)
