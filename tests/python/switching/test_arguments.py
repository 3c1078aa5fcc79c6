"""What the switching filters refuse, before anything runs, and how they say so."""

from __future__ import annotations

from collections.abc import Callable
from math import inf, nan
from typing import Any

import numpy as np
import pytest

import surefix as sf
from switching.refused import ANY, HALF, I1, I2, SHAPE, VALUE, Refused, chain, refuses

wrongly: Any = sf  # called with what a type checker refuses
GOOD: dict[str, Any] = {
    "A": I2, "H": I2[:1], "Q": I2, "R": I1, "x0": [0.0, 0.0], "P0": I2,
}  # fmt: skip


def per_step(matrix: Any, steps: int) -> Any:
    return np.array([matrix] * steps)


def system(**changed: Any) -> sf.LinearSystem:
    return sf.LinearSystem(**{**GOOD, **changed})


SYSTEMS: dict[str, Refused] = {
    "A not square": (lambda: system(A=np.ones((2, 3))), SHAPE, r"^A: .*got \(2, 3\)"),
    "A size": (lambda: system(A=np.eye(3)), SHAPE, r"^A: .*\(2, 2\).*got \(3, 3\)"),
    "A NaN": (lambda: system(A=[[1, nan], [0, 1]]), VALUE, "^A: .*nan"),
    "A four axes": (lambda: system(A=[[I2]]), SHAPE, r"^A: .*got \(1, 1, 2, 2\)"),
    "H columns": (lambda: system(H=[[1.0]]), SHAPE, r"^H: .*got \(1, 1\)"),
    "H one row": (lambda: system(H=[1.0, 0.0]), SHAPE, r"^H: .*got \(2,\)"),
    "H no row": (lambda: system(H=np.zeros((0, 2)), R=np.zeros((0, 0))), SHAPE, "^H: "),
    "H inf": (lambda: system(H=[[1.0, inf]]), VALUE, "^H: .*inf"),
    "Q size": (lambda: system(Q=I1), SHAPE, r"^Q: .*\(2, 2\).*got \(1, 1\)"),
    "Q negative": (lambda: system(Q=-I2), VALUE, "^Q: .*positive semidefinite"),
    "Q indefinite": (lambda: system(Q=[[1, 2], [2, 1]]), VALUE, "^Q: .*positive semidefinite"),
    "Q not symmetric": (lambda: system(Q=[[1, 0.5], [0, 1]]), VALUE, "^Q: .*symmetric"),
    "Q NaN": (lambda: system(Q=[[nan, 0], [0, 1]]), VALUE, "^Q: .*nan"),
    "R size": (lambda: system(R=I2), SHAPE, r"^R: .*\(1, 1\).*got \(2, 2\)"),
    "R zero": (lambda: system(R=[[0.0]]), VALUE, "^R: .*positive definite"),
    "R negative": (lambda: system(R=[[-1.0]]), VALUE, "^R: .*positive definite"),
    "R singular": (lambda: system(H=I2, R=np.ones((2, 2))), VALUE, "^R: .*positive definite"),
    "R indefinite": (lambda: system(H=I2, R=[[1, 2], [2, 1]]), VALUE, "^R: .*positive definite"),
    "R not symmetric": (lambda: system(H=I2, R=[[1, 0.5], [0, 1]]), VALUE, "^R: .*symmetric"),
    "R definite by rounding": (
        lambda: system(H=I2, R=[[1, 1 - 5e-16], [1 - 5e-16, 1]]),
        VALUE,
        "^R: .*positive definite.*component 1",
    ),
    "R of a step definite by rounding": (
        lambda: system(H=I2, R=[I2, [[1, 1 - 5e-16], [1 - 5e-16, 1]], I2]),
        VALUE,
        r"^R\[1\]: .*positive definite.*component 1",
    ),
    "R NaN": (lambda: system(R=[[nan]]), VALUE, "^R: .*nan"),
    "R of one step": (
        lambda: system(R=[[[1.0]], [[0.0]], [[1.0]]]),
        VALUE,
        "^R.*positive definite",
    ),
    "x0 size": (lambda: system(x0=[0.0]), SHAPE, r"^x0: .*\(2,\).*got \(1,\)"),
    "all numbers": (
        lambda: system(A=1.0, H=1.0, Q=1.0, R=1.0, x0=0.0, P0=1.0),
        SHAPE,
        r"^H: .*\(any, 1\).*got \(\)",
    ),
    "A ragged": (lambda: system(A=[[1.0], [0.0, 1.0]]), SHAPE, "^A: "),
    "H ragged": (lambda: system(H=[[[1.0, 0.0]], [[1.0]]]), SHAPE, "^H: "),
    "Q ragged": (lambda: system(Q=[[1.0], [0.0, 1.0]]), SHAPE, "^Q: "),
    "R ragged": (lambda: system(R=[[[1.0]], [[1.0, 2.0]]]), SHAPE, "^R: "),
    "A of texts": (lambda: system(A=[["1", "0"], ["0", "1"]]), SHAPE, "^A: .*'1'"),
    "A of a text": (lambda: system(A=[["1", None], [0, 1]]), SHAPE, "^A: .*'1'"),
    "A too large": (lambda: system(A=[[10**400, 0], [0, 1]]), SHAPE, "^A: "),
    "A masked": (
        lambda: system(A=np.ma.masked_equal([[1.0, 7.0], [0.0, 1.0]], 7.0)),
        VALUE,
        r"^A: .*nan at \(0, 1\)",
    ),
    "H of no step": (lambda: system(H=np.zeros((0, 1, 2))), SHAPE, "^H: .*1 or more steps"),
    "R of no step": (lambda: system(R=np.zeros((0, 1, 1))), SHAPE, "^R: .*1 or more steps"),
    "steps of one and three": (
        lambda: system(A=per_step(I2, 1), H=per_step(I2[:1], 3)),
        SHAPE,
        "A, Q, H, R: .*A for 2, H for 3",
    ),
    "x0 a column": (lambda: system(x0=[[0.0], [0.0]]), SHAPE, r"^x0: .*got \(2, 1\)"),
    "x0 NaN": (lambda: system(x0=[0.0, nan]), VALUE, "^x0: .*nan"),
    "P0 size": (lambda: system(P0=np.eye(3)), SHAPE, r"^P0: .*\(2, 2\).*got \(3, 3\)"),
    "P0 negative": (lambda: system(P0=-I2), VALUE, "^P0: .*positive semidefinite"),
    "P0 per step": (lambda: system(P0=per_step(I2, 3)), SHAPE, r"^P0: .*got \(3, 2, 2\)"),
    "steps of A and H": (
        lambda: system(A=per_step(I2, 3), H=per_step(I2[:1], 3)),
        SHAPE,
        "A, Q, H, R: .*A for 4, H for 3",
    ),
    "steps of A and Q": (
        lambda: system(A=per_step(I2, 3), Q=per_step(I2, 4)),
        SHAPE,
        "A, Q, H, R: .*A for 4, Q for 5",
    ),
    "steps of H and R": (
        lambda: system(H=per_step(I2[:1], 3), R=per_step(I1, 4)),
        SHAPE,
        "A, Q, H, R: .*H for 3, R for 4",
    ),
    "names too few": (lambda: system(states=("a",)), ANY, "states: "),
    "names twice": (lambda: system(states=("a", "a")), VALUE, "states: .*'?a'?"),
    "names are numbers": (lambda: system(states=[1, 2]), VALUE, "states: "),
    "no model": (
        lambda: wrongly.LinearSystem.from_model("m", [0, 1], I2[:1], I1, [0, 0], I2),
        VALUE,
        "model: ",
    ),
    "times backwards": (
        lambda: sf.LinearSystem.from_model(
            sf.ConstantAcceleration(jerk=1.0), [0, 1, 0.5], I2[:1], I1, [0, 0], I2
        ),
        VALUE,
        "times: ",
    ),
    "times NaN": (
        lambda: sf.LinearSystem.from_model(
            sf.ConstantAcceleration(jerk=1.0), [0, nan], I2[:1], I1, [0, 0], I2
        ),
        VALUE,
        "times: .*nan",
    ),
}


@refuses(SYSTEMS)
def test_system_that_is_none(make: Callable[[], Any], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        make()


def one_step(**changed: Any) -> sf.OneStepFilter:
    return sf.OneStepFilter(system(**changed), chain())


def bank(*systems: Any, entering: Any = None) -> sf.IMMFilter:
    return sf.IMMFilter(list(systems), chain(), entering=entering)


def genie(z: Any, modes: Any) -> Any:
    return sf.GenieFilter(system(), chain()).run(z, modes)


def linear(nominal: Any) -> Any:
    return sf.LinearOptimalFilter(system(), chain(), nominal=nominal).run(Z)


def small(**changed: Any) -> sf.LinearSystem:
    one = {"A": I1, "H": I1, "Q": I1, "R": I1, "x0": [0.0], "P0": I1, "states": ["a"]}
    return sf.LinearSystem(**{**one, **changed})


def many(name: str, n: int) -> sf.LinearSystem:
    return sf.LinearSystem(
        np.eye(n), np.ones((1, n)), np.eye(n), I1, np.zeros(n), np.eye(n),
        states=tuple(f"{name}{i}" for i in range(n)),
    )  # fmt: skip


AB = ("a", "b")
half: Any = 1.5
Z = np.zeros((3, 1))
FILTERS: dict[str, Refused] = {
    "A of no step": (
        lambda: one_step(A=np.zeros((0, 2, 2)), Q=np.zeros((0, 2, 2))).run(Z),
        SHAPE,
        "[Az]: |system",
    ),
    "A of one step": (lambda: one_step(A=per_step(I2, 1)).run(Z), SHAPE, "[Az]: |system"),
    "H of one step": (lambda: one_step(H=per_step(I2[:1], 1)).run(Z), SHAPE, "[Hz]: |system"),
    "Q of one step": (lambda: one_step(Q=per_step(I2, 1)).run(Z), SHAPE, "^z: .*2 steps"),
    "R of one step": (lambda: one_step(R=per_step(I1, 1)).run(Z), SHAPE, "^z: .*1 step"),
    "A of one step, genie": (
        lambda: sf.GenieFilter(system(A=per_step(I2, 1))).run(Z),
        SHAPE,
        "^z: .*2 steps",
    ),
    "transition of one step": (
        lambda: sf.OneStepFilter(system(), chain(transition=[HALF], initial=[1, 0])).run(Z),
        SHAPE,
        "^z: .*2 steps",
    ),
    "transition of one step, linear": (
        lambda: sf.LinearOptimalFilter(system(), chain(transition=[HALF], initial=[1, 0])).run(Z),
        SHAPE,
        "^z: .*2 steps",
    ),
    "steps of system and chain": (
        lambda: sf.OneStepFilter(
            system(H=per_step(I2[:1], 3)), chain(transition=[HALF], initial=[1, 0])
        ),
        SHAPE,
        "^system, chain: .*system for 3, chain for 2",
    ),
    "z ragged": (lambda: one_step().run([[0.0], [0.0, 1.0]]), SHAPE, "^z: "),
    "z of texts": (lambda: one_step().run([["1"], ["2"]]), SHAPE, "^z: .*'1'"),
    "z a vector": (lambda: one_step().run([0.0, 1.0]), SHAPE, r"^z: .*got \(2,\)"),
    "z four axes": (lambda: one_step().run([[Z]]), SHAPE, r"^z: .*got \(1, 1, 3, 1\)"),
    "z too wide": (lambda: one_step().run(np.zeros((3, 2))), SHAPE, r"^z: .*got \(3, 2\)"),
    "z inf": (lambda: one_step().run([[0.0], [inf]]), VALUE, r"^z: .*got infinity at \(1,\)"),
    "z -inf": (
        lambda: one_step().run([[[0.0]], [[-inf]]]),
        VALUE,
        r"^z: .*got -infinity at \(1, 0\)",
    ),
    "z a text": (lambda: one_step().run("z"), ANY, "^z: "),
    "z complex": (lambda: one_step().run([[1j]]), ANY, "^z: "),
    "z longer than A": (lambda: one_step(A=per_step(I2, 4)).run(Z), SHAPE, "[Az]: .*[345]"),
    "z longer than H": (lambda: one_step(H=per_step(I2[:1], 4)).run(Z), SHAPE, "[Hz]: .*[34]"),
    "z longer than the chain": (
        lambda: sf.IMMFilter(system(), chain(transition=[HALF] * 4, initial=[1, 0])).run(Z),
        SHAPE,
        "(transition|z): .*[345]",
    ),
    "missing's shape": (
        lambda: one_step().run(Z, missing=np.zeros(3, bool)),
        SHAPE,
        r"^missing: .*\(3, 1\).*got bool of \(3,\)",
    ),
    "missing ragged": (
        lambda: one_step().run(Z, missing=[[True], [False, True], [True]]),
        SHAPE,
        "^missing: ",
    ),
    "missing of runs": (
        lambda: one_step().run(Z, missing=np.zeros((1, 3, 1), bool)),
        SHAPE,
        r"^missing: .*got bool of \(1, 3, 1\)",
    ),
    "missing of numbers": (
        lambda: one_step().run(Z, missing=np.zeros((3, 1))),
        ANY,
        "^missing: .*bool",
    ),
    "threads 0": (lambda: one_step().run(Z, threads=0), VALUE, "^threads: .*got 0"),
    "threads -1": (lambda: one_step().run(Z, threads=-1), VALUE, "^threads: .*got -1"),
    "threads a half": (lambda: one_step().run(Z, threads=half), VALUE, r"^threads: .*got 1\.5"),
    "no system": (lambda: wrongly.OneStepFilter("s", chain()), VALUE, "^system: "),
    "no chain": (lambda: wrongly.OneStepFilter(system(), HALF), VALUE, "^chain: "),
    "many systems": (
        lambda: wrongly.OneStepFilter([system(), system()], chain()),
        VALUE,
        "^system: ",
    ),
    "too few systems": (lambda: bank(system()), ANY, "^system.*: .*2.*1"),
    "too many systems": (lambda: bank(*[system()] * 3), ANY, "^system.*: .*2.*3"),
    "other measurements": (
        lambda: bank(system(), system(H=I2, R=I2)),
        ANY,
        "^system.*: .*2",
    ),
    "other steps": (
        lambda: bank(system(A=per_step(I2, 3)), system(A=per_step(I2, 4))).run(Z),
        SHAPE,
        "(A|z|system).*: ",
    ),
    "sizes without names": (
        lambda: bank(small(states=None), system()),
        VALUE,
        "states",
    ),
    "one without names": (lambda: bank(small(), system()), VALUE, "states"),
    "one of the same size without names": (
        lambda: bank(system(states=AB), system()),
        VALUE,
        r"^systems: .*names of the states.*got none of systems\[1\]$",
    ),
    "too many states in all": (lambda: bank(many("a", 20), many("b", 13)), SHAPE, "^systems: .*33"),
    "who enters?": (lambda: bank(small(), system(states=AB)), VALUE, "entering: .*b"),
    "who else?": (
        lambda: bank(small(states=("c",)), system(states=AB), entering={"b": (0, 1), "a": (0, 1)}),
        VALUE,
        "entering: .*c",
    ),
    "enters unknown": (
        lambda: bank(small(), system(states=AB), entering={"b": (0, 1), "q": (0, 1)}),
        VALUE,
        "entering: .*q",
    ),
    "enters negative": (
        lambda: bank(small(), system(states=AB), entering={"b": (0, -1)}),
        VALUE,
        "entering.*-1",
    ),
    "enters NaN": (
        lambda: bank(small(), system(states=AB), entering={"b": (nan, 1)}),
        VALUE,
        "entering.*nan",
    ),
    "enters alone": (
        lambda: bank(small(), system(states=AB), entering={"b": 1.0}),
        SHAPE,
        "entering",
    ),
    "enters nameless": (
        lambda: bank(small(), system(states=AB), entering=[(0, 1)]),
        VALUE,
        "^entering: ",
    ),
    "mode too high": (lambda: genie(Z, [0, 1, 2]), VALUE, r"^modes: .*got 0 to 2"),
    "mode from the end": (lambda: genie(Z, [0, -1, 1]), VALUE, r"^modes: .*got -1 to 1"),
    "modes too few": (lambda: genie(Z, [0, 1]), SHAPE, r"^modes: .*\(3,\).*got int64 of \(2,\)"),
    "modes of runs": (
        lambda: genie(np.zeros((2, 3, 1)), np.zeros((3, 3), int)),
        SHAPE,
        r"^modes: .*\(2, 3\).*got int64 of \(3, 3\)",
    ),
    "modes ragged": (lambda: genie(Z, [[0], [0, 1], [0]]), SHAPE, "^modes: "),
    "modes of one too few runs": (
        lambda: genie(np.zeros((2, 3, 1)), np.zeros((1, 3), int)),
        SHAPE,
        r"^modes: .*\(3,\) or \(2, 3\), got int64 of \(1, 3\)",
    ),
    "mode of several": (
        lambda: sf.GenieFilter(system(), chain([(0, 1), (0, 2)]).lumped([[0, 1]])).run(Z, [0] * 3),
        VALUE,
        r"^modes: .*\[0\] are lumped",
    ),
    "modes of halves": (lambda: genie(Z, [0.5, 1.0, 0.0]), ANY, "^modes: "),
    "modes of what?": (
        lambda: sf.GenieFilter(system()).run(Z, [0, 0, 0]),
        VALUE,
        "(chain|modes): ",
    ),
    "nominal's shape": (
        lambda: linear(np.zeros((3, 1))),
        SHAPE,
        r"^nominal: .*got \(3, 1\)",
    ),
    "nominal's steps": (lambda: linear(np.zeros((4, 2))), SHAPE, r"nominal: .*|z: .*4"),
    "nominal NaN": (lambda: linear(np.full((3, 2), nan)), VALUE, "^nominal: .*nan"),
    "condition of too many steps": (
        lambda: sf.LinearOptimalFilter(system(), chain()).condition(1 << 31),
        VALUE,
        "^steps: .*2147483647, got 2147483648",
    ),
    "condition of no steps": (
        lambda: sf.LinearOptimalFilter(system(), chain()).condition(0),
        VALUE,
        "^steps: .*got 0",
    ),
}


@refuses(FILTERS)
def test_run_that_is_none(make: Callable[[], Any], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        make()


def test_all_errors_are_of_one_family() -> None:
    assert issubclass(sf.ShapeError, sf.SurefixError)
    assert issubclass(sf.ConfigError, sf.SurefixError)
    assert issubclass(sf.NumericalError, sf.SurefixError)


def test_what_was_refused_leaves_a_filter_as_it_was() -> None:
    filter = one_step()
    z = np.array([[0.3], [-0.2], [1.0]])
    known = filter.run(z)
    with pytest.raises(sf.ConfigError):
        filter.run([[inf]])
    again = filter.run(z)
    assert np.array_equal(again.x, known.x)
    assert again.log_likelihood == known.log_likelihood


def test_one_step_is_enough() -> None:
    """T = 1: no transition at all, and none is asked for."""
    lone = system(A=np.zeros((0, 2, 2)), Q=np.zeros((0, 2, 2)))
    known = one_step().run([[0.7]])
    found = sf.OneStepFilter(lone, chain()).run([[0.7]])
    assert np.array_equal(found.x, known.x)
    assert np.array_equal(found.P, known.P)


def test_what_is_given_is_what_it_has() -> None:
    H = per_step([[1.0, 2.0]], 3)
    made = system(A=2 * I2, H=H, Q=3 * I2, R=[[4.0]], x0=[1, 2], P0=5 * I2, states=AB)
    assert (made.size, made.measured, made.states) == (2, 1, ("a", "b"))
    known = {"A": 2 * I2, "H": H, "Q": 3 * I2, "R": [[4.0]], "x0": [1, 2], "P0": 5 * I2}
    for name, value in known.items():
        assert np.array_equal(getattr(made, name), value), name


def test_a_system_does_not_change_with_what_it_was_made_of() -> None:
    A, x0 = 0.5 * np.eye(2), np.ones(2)
    filter = one_step(A=A, x0=x0)
    known = filter.run(Z)
    A[:], x0[:] = 7.0, 7.0
    assert np.array_equal(filter.run(Z).x, known.x)


def test_shapes_are_kept() -> None:
    """A stack of a single matrix too, which is for two measurements."""
    one, stack = system(), system(A=per_step(I2, 1))
    assert (one.A.shape, one.H.shape, one.Q.shape, one.R.shape) == ((2, 2), (1, 2), (2, 2), (1, 1))
    assert (stack.A.shape, stack.Q.shape) == ((1, 2, 2), (2, 2))
    assert (one.steps, stack.steps, system(R=per_step(I1, 1)).steps) == (None, 2, 1)
    z = [[0.7], [0.2]]
    assert np.array_equal(one_step(A=per_step(I2, 1)).run(z).x, one_step().run(z).x)


@pytest.mark.parametrize("name", ["A", "Q"])
def test_one_measurement_moves_nothing(name: str) -> None:
    """Either stack may be of no step, in every filter."""
    lone = system(**{name: np.zeros((0, 2, 2))})
    assert lone.steps == 1
    filters: list[Any] = [sf.OneStepFilter, sf.IMMFilter, sf.GenieFilter, sf.LinearOptimalFilter]
    for filter in filters:
        found, known = (filter(s, chain()).run([[0.7]]) for s in (lone, system()))
        assert np.array_equal(found.x, known.x)
        assert np.array_equal(found.P, known.P)


def test_two_times_are_two_measurements() -> None:
    model = sf.ConstantAcceleration(jerk=1.0)
    made = sf.LinearSystem.from_model(model, [0, 1], [[1, 0]], I1, [0, 0], I2)
    assert made.steps == 2
    with pytest.raises(sf.ShapeError, match=r"^z: .*2 steps"):
        sf.GenieFilter(made).run(Z)


def test_a_linear_filter_does_not_blame_the_measurement() -> None:
    """Its gains do not depend on it."""
    filter = sf.LinearOptimalFilter(system(A=1e200 * I2), chain())
    with pytest.raises(
        sf.NumericalError, match=r"^system, chain: at \(\d,\) the matrix of the gain"
    ):
        filter.run(np.zeros((9, 1)))
