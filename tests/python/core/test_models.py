"""Motion models: F and Q against the matrix exponential and against quadrature."""

from __future__ import annotations

import pickle
import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import surefix as sf
from oracle import models as oracle
from oracle.compare import covariance_error
from oracle.step import Array

EPS = float(np.finfo(np.float64).eps)

# Without their types: what is refused here is what type checkers refuse, too.
ConstantVelocity: Any = sf.ConstantVelocity
LinearModel: Any = sf.LinearModel
DiscreteModel: Any = sf.DiscreteModel

OSCILLATOR = oracle.Model(
    A=np.array([[0.0, 1.0], [-4.0, -0.3]]),
    L=np.array([[0.1, 0.0], [0.2, 1.0]]),
    Qc=np.array([[1.0, 0.3], [0.3, 0.5]]),
)
RANDOM_8 = oracle.Model(
    A=np.random.RandomState(1).normal(size=(8, 8)) / 4,
    L=np.random.RandomState(2).normal(size=(8, 3)),
    Qc=np.diag([1.0, 0.1, 2.0]),
)


def linear(model: oracle.Model) -> sf.LinearModel:
    return sf.LinearModel(model.A, model.L, model.Qc)


PAIRS: dict[str, tuple[sf.Model, oracle.Model]] = {
    "speed": (sf.ConstantVelocity(0.7), oracle.constant_velocity(0.7, position=False)),
    "position, speed": (
        sf.ConstantVelocity(0.7, position=True),
        oracle.constant_velocity(0.7),
    ),
    "speed, acceleration": (
        sf.ConstantAcceleration(jerk=0.08),
        oracle.constant_acceleration(0.08, position=False),
    ),
    "position, speed, acceleration": (
        sf.ConstantAcceleration(jerk=0.08, position=True),
        oracle.constant_acceleration(0.08),
    ),
    "Gauss-Markov": (linear(oracle.gauss_markov(2.0, 5.0)), oracle.gauss_markov(2.0, 5.0)),
    "damped oscillator": (linear(OSCILLATOR), OSCILLATOR),
    "eight states": (linear(RANDOM_8), RANDOM_8),
}
DISCRETE: sf.Model = DiscreteModel([[0.9, 0.1], [0.0, 0.8]], [[0.2, 0.1], [0.1, 0.3]], period=0.1)
ALL_MODELS = [*(model for model, _ in PAIRS.values()), DISCRETE]
NAMES = [*PAIRS, "discrete"]

pairs = pytest.mark.parametrize(("model", "reference"), PAIRS.values(), ids=PAIRS.keys())


def transition_error(F: Array, Q: Array, F_reference: Array, Q_reference: Array) -> float:
    """Of F relative to its largest entry, of Q as a difference of correlations."""
    largest = float(np.max(np.abs(F_reference)))
    return max(float(np.max(np.abs(F - F_reference))) / largest, covariance_error(Q, Q_reference))


@pairs
@pytest.mark.parametrize("dt", [1e-6, 1e-3, 0.1, 1.0, 7.0])
def test_transition_equals_the_matrix_exponential(
    model: sf.Model, reference: oracle.Model, dt: float
) -> None:
    F, Q, _ = oracle.van_loan(reference, dt)
    assert transition_error(*model.transition(dt), F, Q) <= 1e-12


@pairs
@pytest.mark.parametrize("dt", [0.1, 3.0])
def test_transition_equals_quadrature(model: sf.Model, reference: oracle.Model, dt: float) -> None:
    F, Q, _ = oracle.quadrature(reference, dt)
    assert transition_error(*model.transition(dt), F, Q) <= 1e-11


@pytest.mark.parametrize("model", ALL_MODELS, ids=NAMES)
@given(a=st.integers(0, 100), b=st.integers(0, 100))
def test_going_twice_is_going_once(model: sf.Model, a: int, b: int) -> None:
    """F(a + b) = F(b) F(a) and Q(a + b) = F(b) Q(a) F(b)' + Q(b), in tenths of a second."""
    F_a, Q_a = model.transition(a / 10)
    F_b, Q_b = model.transition(b / 10)
    F, Q = model.transition((a + b) / 10)
    assert transition_error(F_b @ F_a, F_b @ Q_a @ F_b.T + Q_b, F, Q) <= 1e-12


@pytest.mark.parametrize("model", ALL_MODELS, ids=NAMES)
def test_no_time_changes_nothing(model: sf.Model) -> None:
    F, Q = model.transition(0.0)
    assert np.array_equal(F, np.eye(model.size))
    assert not Q.any()


@pytest.mark.parametrize("model", ALL_MODELS, ids=NAMES)
@pytest.mark.parametrize("dt", [0.1, 10.0, 60.0])
def test_process_noise_is_a_covariance(model: sf.Model, dt: float) -> None:
    """Exactly symmetric, and no eigenvalue of the correlations below a rounding."""
    _, Q = model.transition(dt)
    assert np.array_equal(Q, Q.T)
    sigma = np.sqrt(np.diag(Q))
    assert np.linalg.eigvalsh(Q / np.outer(sigma, sigma)).min() >= -16 * EPS


@given(order=st.integers(1, 3), q=st.floats(1e-3, 1e3), dt=st.floats(1e-6, 3e7))
def test_linear_model_of_a_chain_equals_the_chain(order: int, q: float, dt: float) -> None:
    chain = {
        1: sf.ConstantVelocity(q),
        2: sf.ConstantVelocity(q, position=True),
        3: sf.ConstantAcceleration(q, position=True),
    }[order]
    general = linear(oracle.integrator_chain(order, q))
    dt = max(round(dt, 9), 1e-9)
    F, Q = chain.transition(dt)
    F_general, Q_general = general.transition(dt)
    np.testing.assert_allclose(F_general, F, rtol=1e-12)
    assert covariance_error(Q_general, Q) <= 1e-12


@pytest.mark.parametrize("time", [1e-3, 1.0, 1e6])
def test_stable_model_forgets_over_a_year(time: float) -> None:
    """Van Loan's exponential overflows here; the variance is the stationary one."""
    year = 365.25 * 86400.0
    F, Q = linear(oracle.gauss_markov(2.0, time)).transition(year)
    expected = oracle.gauss_markov_transition(2.0, time, year)
    np.testing.assert_allclose([F.item(), Q.item()], expected, rtol=1e-10, atol=1e-300)


def test_discrete_model_takes_whole_periods() -> None:
    F, Q = np.array([[0.9, 0.1], [0.0, 0.8]]), np.array([[0.2, 0.1], [0.1, 0.3]])
    expected_F, expected_Q = np.eye(2), np.zeros((2, 2))
    for _ in range(7):
        expected_F, expected_Q = F @ expected_F, F @ expected_Q @ F.T + Q
    assert transition_error(*DISCRETE.transition(0.7), expected_F, expected_Q) <= 1e-14


@pytest.mark.parametrize("dt", [0.05, 0.100000001, 1e-9])
def test_discrete_model_has_nothing_between_its_periods(dt: float) -> None:
    with pytest.raises(sf.ConfigError, match=rf"dt: .*periods, got {re.escape(str(dt))}"):
        DISCRETE.transition(dt)


@pytest.mark.parametrize("dt", [-1e-3, np.nan, np.inf, 3.1e9, "soon"])
@pytest.mark.parametrize("model", [PAIRS["speed"][0], DISCRETE])
def test_time_that_is_none_names_itself(model: sf.Model, dt: float) -> None:
    with pytest.raises(sf.ConfigError, match=rf"dt: expected .*got {re.escape(repr(dt))}"):
        model.transition(dt)


@pytest.mark.parametrize(
    "model",
    [
        LinearModel([[1.0]], [[1.0]], [[1.0]]),
        DiscreteModel([[2.0]], [[1.0]]),
        sf.ConstantAcceleration(jerk=1e160),
    ],
    ids=["unstable", "unstable, discrete", "density"],
)
def test_overflow_is_an_error(model: sf.Model) -> None:
    with pytest.raises(sf.NumericalError, match=r"overflows over dt = 2000.0 s"):
        model.transition(2000.0)


def test_states_have_names() -> None:
    assert sf.ConstantVelocity(1.0).state_names == ("speed",)
    assert sf.ConstantVelocity(1.0, position=True).state_names == ("position", "speed")
    assert sf.ConstantAcceleration(1.0).state_names == ("speed", "acceleration")
    with_position = sf.ConstantAcceleration(1.0, position=True)
    assert with_position.state_names == ("position", "speed", "acceleration")
    for model in (*(model for model, _ in list(PAIRS.values())[:4]), with_position):
        assert model.state_names[model.output] == "speed"
    assert DISCRETE.state_names == ("x1", "x2")
    named = DiscreteModel(np.eye(2), np.eye(2), names=("angle", "rate"), reads=1)
    assert named.state_names == ("angle", "rate")
    assert named.output == 1


I1, I2, I9 = np.eye(1), np.eye(2), np.eye(9)
BAD: dict[str, tuple[Callable[[], object], type[Exception], str]] = {
    "negative jerk": (
        lambda: sf.ConstantAcceleration(-0.1),
        sf.ConfigError,
        "jerk: expected a number >= 0, got -0.1",
    ),
    "NaN jerk": (
        lambda: sf.ConstantAcceleration(np.nan),
        sf.ConfigError,
        "jerk: expected a finite number, got nan",
    ),
    "infinite acceleration": (
        lambda: ConstantVelocity(np.inf),
        sf.ConfigError,
        "acceleration: .*finite number, got inf",
    ),
    "text": (
        lambda: ConstantVelocity("fast"),
        sf.ConfigError,
        "acceleration: expected a number, got 'fast'",
    ),
    "A not square": (
        lambda: LinearModel(np.ones((2, 3)), I2, I2),
        sf.ShapeError,
        r"A: expected .*got \(2, 3\)",
    ),
    "A a vector": (
        lambda: LinearModel(np.ones(2), I2, I2),
        sf.ShapeError,
        r"A: expected .*got \(2,\)",
    ),
    "no states": (
        lambda: LinearModel(np.ones((0, 0)), I2, I2),
        sf.ShapeError,
        r"A: expected .*got \(0, 0\)",
    ),
    "too many states": (
        lambda: LinearModel(I9, I9, I9),
        sf.ShapeError,
        r"A: expected .*<= 8, got \(9, 9\)",
    ),
    "A with a NaN": (
        lambda: LinearModel([[0.0, np.nan], [0.0, 0.0]], I2, I2),
        sf.ConfigError,
        r"A: expected finite numbers, got nan at \(0, 1\)",
    ),
    "A of text": (
        lambda: LinearModel([["a"]], I1, I1),
        sf.ShapeError,
        r"A: expected numbers .*got \[\['a'\]\]",
    ),
    "L does not fit": (
        lambda: LinearModel(I2, I1, I1),
        sf.ShapeError,
        r"L: expected shape \(2, any\), got \(1, 1\)",
    ),
    "Qc does not fit": (
        lambda: LinearModel(I2, I2, I1),
        sf.ShapeError,
        r"Qc: expected shape \(2, 2\), got \(1, 1\)",
    ),
    "Qc negative": (
        lambda: LinearModel(I1, I1, [[-1.0]]),
        sf.ConfigError,
        r"Qc: .*semidefinite matrix, got \[\[-1",
    ),
    "Qc indefinite": (
        lambda: LinearModel(I2, I2, [[1.0, 2.0], [2.0, 1.0]]),
        sf.ConfigError,
        "Qc: .*semidefinite",
    ),
    "Qc not symmetric": (
        lambda: LinearModel(I2, I2, [[1.0, 0.5], [0.0, 1.0]]),
        sf.ConfigError,
        "Qc: .*symmetric",
    ),
    "Qc infinite": (
        lambda: LinearModel(I1, I1, [[np.inf]]),
        sf.ConfigError,
        r"Qc: .*got inf at \(0, 0\)",
    ),
    "too few names": (
        lambda: LinearModel(I2, I2, I2, names=("a",)),
        sf.ConfigError,
        r"names: expected 2 different names, got \('a',\)",
    ),
    "equal names": (
        lambda: LinearModel(I2, I2, I2, names=("a", "a")),
        sf.ConfigError,
        r"names: .*\('a', 'a'\)",
    ),
    "one name": (
        lambda: LinearModel(I2, I2, I2, names=5),
        sf.ConfigError,
        "names: expected 2 different names, got 5",
    ),
    "names in one text": (
        lambda: LinearModel(I2, I2, I2, names="ab"),
        sf.ConfigError,
        "names: expected 2 different names, got 'ab'",
    ),
    "names of numbers": (
        lambda: DiscreteModel(I2, I2, names=(1, 2)),
        sf.ConfigError,
        r"names: expected 2 different names, got \(1, 2\)",
    ),
    "names in lists": (
        lambda: DiscreteModel(I2, I2, names=([1], [2])),
        sf.ConfigError,
        r"names: expected 2 different names, got \(\[1\], \[2\]\)",
    ),
    "the base of all models": (
        lambda: sf.Model(),
        sf.ConfigError,
        "Model: expected one of its kinds, .*ConstantAcceleration",
    ),
    "reads no state": (
        lambda: LinearModel(I2, I2, I2, reads=2),
        sf.ConfigError,
        "reads: .*0 to 1, got 2",
    ),
    "reads backwards": (
        lambda: DiscreteModel(I2, I2, reads=-1),
        sf.ConfigError,
        "reads: .*0 to 1, got -1",
    ),
    "reads half a state": (
        lambda: DiscreteModel(I2, I2, reads=0.5),
        sf.ConfigError,
        "reads: .*got 0.5",
    ),
    "F not square": (
        lambda: DiscreteModel(np.ones((1, 2)), I1),
        sf.ShapeError,
        r"F: .*got \(1, 2\)",
    ),
    "too many discrete states": (
        lambda: DiscreteModel(I9, I9),
        sf.ShapeError,
        r"F: .*got \(9, 9\)",
    ),
    "Q indefinite": (lambda: DiscreteModel(I1, [[-1.0]]), sf.ConfigError, "Q: .*semidefinite"),
    "Q does not fit": (
        lambda: DiscreteModel(I1, I2),
        sf.ShapeError,
        r"Q: expected shape \(1, 1\), got \(2, 2\)",
    ),
    "no period": (
        lambda: DiscreteModel(I1, I1, period=0.0),
        sf.ConfigError,
        "period: .*> 0, got 0.0",
    ),
    "period below a nanosecond": (
        lambda: DiscreteModel(I1, I1, period=1e-10),
        sf.ConfigError,
        "period: .*got 1e-10",
    ),
    "endless period": (
        lambda: DiscreteModel(I1, I1, period=np.inf),
        sf.ConfigError,
        "period: .*got inf",
    ),
}


@pytest.mark.parametrize(("make", "error", "message"), BAD.values(), ids=BAD.keys())
def test_bad_argument_is_named(
    make: Callable[[], object], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        make()


@pytest.mark.parametrize("model", ALL_MODELS, ids=NAMES)
def test_model_survives_pickling(model: sf.Model) -> None:
    copy = pickle.loads(pickle.dumps(model))
    assert type(copy) is type(model)
    assert copy.state_names == model.state_names
    assert copy.output == model.output
    for one, other in zip(copy.transition(1.7), model.transition(1.7), strict=True):
        assert np.array_equal(one, other)


def test_models_are_frozen() -> None:
    with pytest.raises(AttributeError):
        sf.ConstantVelocity(1.0).acceleration = 2.0  # type: ignore[misc]


def test_matrices_are_copied_and_read_only() -> None:
    F, Q = np.eye(2), np.eye(2)
    model = sf.DiscreteModel(F, Q)
    F[:], Q[:] = 99.0, 99.0
    general = sf.LinearModel(F := np.zeros((1, 1)), L := np.eye(1), Qc := np.eye(1))
    F[:], L[:], Qc[:] = 99.0, 99.0, 99.0
    for matrix, expected in (
        (model.F, np.eye(2)), (model.Q, np.eye(2)),
        (general.A, [[0.0]]), (general.L, [[1.0]]), (general.Qc, [[1.0]]),
    ):  # fmt: skip
        assert np.array_equal(matrix, expected)
        assert isinstance(matrix, np.ndarray)
        assert not matrix.flags.writeable
