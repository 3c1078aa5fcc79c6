"""The composite step against table 1 (corrected), its forward form and fifty digits.

Tolerances. With variances spread over up to four decades both ways agree with the fifty-digit
reference to 1e-11 in standard deviations (in fact to 1e-12). Beyond that, one rounding of the data
may move the exact answer further (``oracle.conditioning``); an error up to some times that is as
good as doubles can be.
"""

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
from oracle import composite, composite_forward
from oracle.compare import covariance_error, smallest_correlation, state_error
from oracle.conditioning import precise_journey, sensitivity
from oracle.noise import noise_estimate
from oracle.precise import Precise
from oracle.step import Array, Step, concatenate
from oracle.strategies import Journey, journeys, random_journey

WELL = 1e-11  # demanded of well conditioned cases
TIMES = 50.0  # the sensitivity, for the others

ways = pytest.mark.parametrize("way", ["sequential", "composite"])


def engine(step: Step) -> sf.CompositeStep:
    return sf.CompositeStep(step.F, step.Q, step.H, G=step.G, J=step.J, Upsilon=step.Upsilon)


def run(step: Step, x: Array, P: Array, way: str = "auto") -> sf.StepUpdate:
    u = np.array(step.u).reshape(step.N + 1, -1)
    return engine(step).update(x, P, concatenate(step.z), u, way=way)


def filtered(journey: Journey, way: str) -> list[sf.StepUpdate]:
    """Every step's update, each step starting from the one before."""
    x, P, updates = journey.x0, journey.P0, []
    for step in journey.steps:
        updates.append(run(step, x, P, way))
        x, P = updates[-1].x, updates[-1].P
    return updates


def estimate_errors(update: sf.StepUpdate, reference: Precise) -> tuple[float, float]:
    return (
        state_error(update.x, reference.x, reference.P),
        covariance_error(update.P, reference.P),
    )


def assert_statistics(update: sf.StepUpdate, reference: Precise, tolerance: float) -> None:
    """Noise estimate, its variance, SSE and log-likelihood, relative to their size."""
    variance = np.diag(reference.v_covariance)
    sse = float(np.sum(reference.nis))
    assert state_error(update.noise, reference.v, reference.v_covariance) <= tolerance
    np.testing.assert_allclose(update.noise_variance, variance, rtol=tolerance)
    assert update.sse == pytest.approx(sse, rel=tolerance, abs=tolerance)
    assert update.log_likelihood == pytest.approx(
        reference.log_likelihood, rel=tolerance, abs=tolerance
    )
    assert update.degrees_of_freedom == len(reference.gamma)


def assert_as_good_as_the_data(journey: Journey, way: str) -> None:
    updates = filtered(journey, way)
    reference = precise_journey(journey)[-1]
    errors = estimate_errors(updates[-1], reference)
    if max(errors) > 1e-10:
        assert journey.decades > 4, errors
        limits = TIMES * np.max([sensitivity(journey, seed) for seed in range(3)], axis=0)
        assert (np.array(errors) <= np.maximum(1e-10, limits)).all(), (errors, limits)
    for update in updates:
        assert update.way == way
        assert np.array_equal(update.P, update.P.T)
        assert smallest_correlation(update.P) >= -1e-13


@ways
@given(journey=journeys(full=False, max_decades=4, max_steps=3))
def test_well_conditioned_journey_equals_fifty_digits(way: str, journey: Journey) -> None:
    """Scalar and vector observations, inputs, singular transitions, up to 40 measurements."""
    for update, reference in zip(filtered(journey, way), precise_journey(journey), strict=True):
        assert max(estimate_errors(update, reference)) <= WELL
        assert_statistics(update, reference, WELL)


@given(journey=journeys(full=True, max_decades=4, max_steps=3))
def test_full_Upsilon_equals_fifty_digits(journey: Journey) -> None:
    for update, reference in zip(
        filtered(journey, "composite"), precise_journey(journey), strict=True
    ):
        assert max(estimate_errors(update, reference)) <= WELL
        assert_statistics(update, reference, WELL)


@ways
@given(journey=journeys(full=False, max_decades=10, max_steps=3))
def test_journey_is_as_good_as_its_data(way: str, journey: Journey) -> None:
    assert_as_good_as_the_data(journey, way)


@given(journey=journeys(full=True, max_decades=10, max_steps=3))
def test_full_Upsilon_is_as_good_as_its_data(journey: Journey) -> None:
    assert_as_good_as_the_data(journey, "composite")


@pytest.mark.parametrize("full", [False, True])
@pytest.mark.parametrize("seed", range(6))
def test_largest_step_over_ten_decades(full: bool, seed: int) -> None:
    """Six states, forty measurements in observations of up to three."""
    journey = random_journey(
        seed, n=6, measurements=40, step_count=1, largest=3, inputs=2, decades=10, full=full
    )
    for way in ("composite",) if full else ("sequential", "composite"):
        assert_as_good_as_the_data(journey, way)


def test_noise_without_rank_is_no_numerical_error() -> None:
    """Process noise of fewer axes than states, in a random frame: a covariance like any other.

    A triangular factorisation of it without a stop divides by pivots that are roundings.
    """
    journey = random_journey(
        471499610,
        n=6,
        measurements=7,
        step_count=3,
        largest=3,
        decades=2,
        singular=True,
        full=True,
    )
    assert_as_good_as_the_data(journey, "composite")


@given(seed=st.integers(0, 2**32 - 1), rank=st.integers(0, 5))
def test_semidefinite_covariances_are_taken(seed: int, rank: int) -> None:
    """P and Q of any rank, as products that rounding leaves with eigenvalues of -1e-17."""
    rng = np.random.default_rng(seed)

    def covariance() -> Array:
        root = rng.normal(size=(6, rank))
        return np.asarray(root @ root.T)

    legs = 5
    F, Q = [np.eye(6)] * legs, [covariance() for _ in range(legs)]
    H = [rng.normal(size=(1, 6)) for _ in range(legs - 1)]
    step = sf.CompositeStep(F, Q, H, [np.eye(1)] * (legs - 1))
    P, z = covariance(), rng.normal(size=legs - 1)
    one, other = (step.update(np.zeros(6), P, z, way=way) for way in ("sequential", "composite"))
    if rank == 0:
        assert not one.P.any()
        assert not other.P.any()
    else:
        assert state_error(other.x, one.x, one.P) <= 1e-10
        assert covariance_error(other.P, one.P) <= 1e-10


@given(journey=journeys(max_decades=4, max_steps=1))
def test_forward_matrices_equal_the_oracle(journey: Journey) -> None:
    step = journey.steps[0]
    mine, reference = engine(step), composite.matrices(step, inverses=False)
    forward = composite_forward.forward(step)
    for name in ("F", "G", "W", "Omega", "Upsilon", "J"):
        expected = getattr(reference, name)
        np.testing.assert_allclose(getattr(mine, name), expected, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(mine.HF, forward.HF, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(mine.L, forward.L, rtol=1e-12, atol=1e-12)
    assert mine.size == step.n
    assert mine.components == step.M
    assert mine.legs == step.N + 1


@given(journey=journeys(max_decades=4, max_steps=1, singular=False))
def test_papers_matrices_equal_the_oracle(journey: Journey) -> None:
    """H, Theta, Xi and J_tilde (eqs. 44-47) with the inverses that the paper leaves out."""
    step = journey.steps[0]
    mine, reference = engine(step), composite.matrices(step)
    for name in ("H", "Theta", "Xi", "Jtilde"):
        expected = getattr(reference, name)
        np.testing.assert_allclose(getattr(mine, name), expected, rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(mine.H @ mine.F, mine.HF, rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(mine.H @ mine.W - mine.Theta, mine.L, rtol=1e-10, atol=1e-10)


@given(journey=journeys(max_decades=4, max_steps=1))
def test_innovation_and_its_covariance_equal_fifty_digits(journey: Journey) -> None:
    step, (reference,) = journey.steps[0], precise_journey(journey)
    mine = run(step, journey.x0, journey.P0)
    assert state_error(mine.innovation, reference.gamma, reference.Gamma) <= WELL
    Gamma = engine(step).Gamma(journey.P0)
    assert covariance_error(Gamma, reference.Gamma) <= WELL
    np.testing.assert_allclose(
        mine.normalised_noise,
        reference.v / np.sqrt(np.diag(reference.v_covariance)),
        rtol=1e-9,
        atol=1e-9,
    )


@pytest.mark.parametrize("full", [False, True])
def test_statistics_equal_the_dense_formulas(full: bool) -> None:
    """Eqs. (25)-(27) as they are written, with table 1 corrected."""
    journey = random_journey(11, n=4, measurements=15, step_count=1, largest=3, full=full)
    (step,) = journey.steps
    posterior = composite.table_1(step, journey.x0, journey.P0)
    expected = noise_estimate(posterior, step.Upsilon)
    mine = run(step, journey.x0, journey.P0)
    np.testing.assert_allclose(mine.noise, expected.v, rtol=1e-9)
    np.testing.assert_allclose(mine.noise_variance, np.diag(expected.covariance), rtol=1e-9)
    np.testing.assert_allclose(mine.normalised_noise, expected.normalised, rtol=1e-9)
    assert mine.sse == pytest.approx(expected.sse, rel=1e-10)
    assert mine.log_likelihood == pytest.approx(expected.log_likelihood, rel=1e-10)
    assert mine.degrees_of_freedom == expected.dof == 15


def test_p_value_is_the_tail_of_the_sse() -> None:
    journey = random_journey(12, step_count=1)
    mine = run(journey.steps[0], journey.x0, journey.P0)
    assert mine.p_value == float(sf.chi_squared_p_value(mine.sse, 12))


@ways
def test_step_without_measurements_is_a_prediction(way: str) -> None:
    journey = random_journey(4, measurements=0, step_count=1, inputs=1)
    (step,) = journey.steps
    mine = run(step, journey.x0, journey.P0, way)
    x = step.F[0] @ journey.x0 + step.G[0] @ step.u[0]
    P = step.F[0] @ journey.P0 @ step.F[0].T + step.Q[0]
    np.testing.assert_allclose(mine.x, x, rtol=1e-13)
    np.testing.assert_allclose(mine.P, P, rtol=1e-13)
    assert mine.sse == 0.0
    assert mine.log_likelihood == 0.0
    assert mine.noise.shape == mine.noise_variance.shape == (0,)
    assert np.isnan(mine.p_value)


def test_auto_takes_the_sequential_way_where_it_exists() -> None:
    for full in (False, True):
        journey = random_journey(5, step_count=1, largest=3, full=full)
        step = engine(journey.steps[0])
        assert step.separable is not full
        mine = run(journey.steps[0], journey.x0, journey.P0)
        assert mine.way == ("composite" if full else "sequential")


def test_correlated_observations_have_no_sequential_way() -> None:
    journey = random_journey(5, step_count=1, full=True)
    with pytest.raises(sf.ConfigError, match="Upsilon is not block diagonal, only 'composite'"):
        run(journey.steps[0], journey.x0, journey.P0, "sequential")


def test_R_and_its_Upsilon_are_one() -> None:
    journey = random_journey(6, step_count=1, largest=3)
    (step,) = journey.steps
    by_R = sf.CompositeStep(step.F, step.Q, step.H, step.R)
    by_Upsilon = sf.CompositeStep(step.F, step.Q, step.H, Upsilon=step.Upsilon)
    assert np.array_equal(by_R.Upsilon, by_Upsilon.Upsilon)
    z = concatenate(step.z)
    for way in ("sequential", "composite"):
        one = by_R.update(journey.x0, journey.P0, z, way=way)
        other = by_Upsilon.update(journey.x0, journey.P0, z, way=way)
        assert np.array_equal(one.x, other.x)
        assert np.array_equal(one.P, other.P)


@pytest.mark.parametrize("name", ["H", "Theta", "Xi", "Jtilde"])
def test_papers_matrices_do_not_exist_for_singular_transitions(name: str) -> None:
    """The update does: it needs no inverse."""
    flat = np.diag([1.0, 0.0])
    step = sf.CompositeStep([np.eye(2), flat], [np.eye(2)] * 2, [[[1.0, 1.0]]], [np.eye(1)])
    assert step.update(np.zeros(2), np.eye(2), [1.0]).x[0] > 0.0
    with pytest.raises(sf.NumericalError, match=f"{name}: needs the inverse of a transition"):
        getattr(step, name)


def test_singular_first_leg_needs_no_inverse() -> None:
    """Only the legs after an observation are looked back over."""
    flat = np.diag([1.0, 0.0])
    step = sf.CompositeStep([flat, np.eye(2)], [np.eye(2)] * 2, [[[1.0, 1.0]]], [np.eye(1)])
    assert np.array_equal(step.H, [[1.0, 1.0]])


def test_unknown_attribute_is_an_attribute_error() -> None:
    step = sf.CompositeStep([np.eye(1)], [np.eye(1)], [], [])
    with pytest.raises(AttributeError, match="Lambda"):
        _ = step.Lambda  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    "name", ["F", "G", "W", "Omega", "Upsilon", "J", "HF", "L", "H", "Theta", "Xi", "Jtilde"]
)
def test_matrices_are_documented_and_read_only(name: str) -> None:
    step = sf.CompositeStep(**GOOD)
    assert name in dir(step)
    assert "(" in str(getattr(sf.CompositeStep, name).__doc__)  # its shape
    matrix = getattr(step, name)
    assert getattr(step, name) is matrix
    with pytest.raises(ValueError, match="read-only"):
        matrix[...] = 0.0


@given(journey=journeys(max_steps=1))
def test_step_survives_pickling(journey: Journey) -> None:
    step = engine(journey.steps[0])
    copy = pickle.loads(pickle.dumps(step))
    for name in ("F", "G", "W", "Omega", "Upsilon", "J", "HF", "L"):
        assert np.array_equal(getattr(copy, name), getattr(step, name))
    assert copy.separable == step.separable
    z, u = np.zeros(step.components), np.array(journey.steps[0].u).reshape(step.legs, -1)
    one, other = (each.update(journey.x0, journey.P0, z, u) for each in (step, copy))
    assert np.array_equal(one.x, other.x)
    assert np.array_equal(one.P, other.P)


def test_later_changes_of_the_arguments_change_nothing() -> None:
    arguments = {name: [np.array(entry) for entry in given] for name, given in GOOD.items()}
    step = sf.CompositeStep(**arguments)
    for matrices in arguments.values():
        for matrix in matrices:
            matrix[:] = 99.0
    assert np.array_equal(pickle.loads(pickle.dumps(step)).F, I2)


def test_printed_table_1_is_not_what_is_computed() -> None:
    """The printed matrices move x by sigmas; the printed covariance does not even exist."""
    journey = random_journey(5, inputs=2, step_count=1)
    (step,) = journey.steps
    mine = run(step, journey.x0, journey.P0, "composite")
    right = composite.table_1(step, journey.x0, journey.P0)
    assert state_error(mine.x, right.x, right.P) <= WELL
    for inverses, J_tilde in ((False, True), (True, False), (False, False)):
        printed = composite.state_as_printed(
            step, journey.x0, journey.P0, inverses=inverses, J_tilde=J_tilde
        )
        assert state_error(mine.x, printed, right.P) > 1.0
    with pytest.raises(ValueError, match="mismatch"):
        composite.covariance_as_printed(step, journey.P0)


def test_printed_covariance_is_wrong_where_its_dimensions_match() -> None:
    """With H Omega W' in the place of Theta Omega W' - the only reading of the last term of table 1
    whose dimensions match, for a single leg after the observation - P+ differs."""
    P0, Q = np.diag([4.0, 1.0]), np.diag([0.5, 0.2])
    F = np.array([[1.0, 0.5], [0.0, 1.0]])
    step = sf.CompositeStep([F, F], [np.zeros((2, 2)), Q], [[[1.0, 0.0]]], [[[0.3]]])
    mine = step.update(np.zeros(2), P0, [0.0])
    P_prior = step.F @ P0 @ step.F.T + Q
    cross = P_prior @ step.H.T - step.W @ step.Omega @ step.Theta.T
    K = cross / step.Gamma(P0)
    corrected = (np.eye(2) - K @ step.H) @ P_prior + K @ step.Theta @ step.Omega @ step.W.T
    printed = (np.eye(2) - K @ step.H) @ P_prior - K @ step.H @ Q
    assert covariance_error(mine.P, corrected) <= 1e-13
    assert covariance_error(printed, mine.P) > 0.1


I1, I2 = np.eye(1), np.eye(2)
H2 = np.array([[1.0, 0.0]])
INDEFINITE = [[1.0, 2.0], [2.0, 1.0]]
Arguments = dict[str, Any]
GOOD: Arguments = {"F": [I2, I2], "Q": [I2, I2], "H": [H2], "R": [I1]}
BAD: dict[str, tuple[Arguments, type[Exception], str]] = {
    "no legs": ({"F": []}, sf.ShapeError, "F: expected N . 1 transitions .*got none"),
    **{
        f"{name} none": ({name: given}, sf.ShapeError, f"{name}: expected a sequence .*got {given}")
        for name, given in (("F", None), ("Q", None), ("H", None), ("R", 5), ("G", 5), ("J", 5))
    },
    "too few legs": ({"F": [I2]}, sf.ShapeError, "F: expected 2 matrices for 1 observ.*, got 1"),
    "too many legs": ({"F": [I2] * 3}, sf.ShapeError, "F: expected 2 matrices .*, got 3"),
    "F not square": ({"F": [H2, I2]}, sf.ShapeError, r"F\[0\]: .*got \(1, 2\)"),
    "F of two sizes": ({"F": [I2, I1]}, sf.ShapeError, r"F\[1\]: .*\(2, 2\), got \(1, 1\)"),
    "F with a NaN": ({"F": [I2, I2 * np.nan]}, sf.ConfigError, r"F\[1\]: .*got nan at \(0, 0\)"),
    "too few Q": ({"Q": [I2]}, sf.ShapeError, "Q: expected 2 matrices .*, got 1"),
    "too many Q": ({"Q": [I2] * 3}, sf.ShapeError, "Q: expected 2 matrices .*, got 3"),
    "Q does not fit": ({"Q": [I2, I1]}, sf.ShapeError, r"Q\[1\]: .*\(2, 2\), got \(1, 1\)"),
    "Q indefinite": ({"Q": [I2, INDEFINITE]}, sf.ConfigError, r"Q\[1\]: .*semidefinite"),
    "Q not symmetric": (
        {"Q": [[[1.0, 0.5], [0.0, 1.0]], I2]},
        sf.ConfigError,
        r"Q\[0\]: expected a symmetric",
    ),
    "H does not fit": ({"H": [I1]}, sf.ShapeError, r"H\[0\]: .*\(any, 2\), got \(1, 1\)"),
    "H a vector": ({"H": [[1.0, 0.0]]}, sf.ShapeError, r"H\[0\]: .*got \(2,\)"),
    "H infinite": ({"H": [[[np.inf, 0.0]]]}, sf.ConfigError, r"H\[0\]: expected finite"),
    "too few R": ({"R": []}, sf.ShapeError, "R: expected 1 matrices .*, got 0"),
    "too many R": ({"R": [I1, I1]}, sf.ShapeError, "R: expected 1 matrices .*, got 2"),
    "R does not fit": ({"R": [I2]}, sf.ShapeError, r"R\[0\]: .*\(1, 1\), got \(2, 2\)"),
    "R zero": ({"R": [[[0.0]]]}, sf.ConfigError, r"R\[0\]: expected a positive definite"),
    "R negative": ({"R": [[[-1.0]]]}, sf.ConfigError, r"R\[0\]: expected a positive definite"),
    "R missing": ({"R": None}, sf.ConfigError, "R: expected R or Upsilon"),
    "Upsilon does not fit": (
        {"R": None, "Upsilon": I2},
        sf.ShapeError,
        r"Upsilon: .*\(1, 1\), got \(2, 2\)",
    ),
    "Upsilon zero": (
        {"R": None, "Upsilon": [[0.0]]},
        sf.ConfigError,
        "Upsilon: expected a positive definite",
    ),
    "Upsilon singular": (
        {"H": [H2, H2], "F": [I2] * 3, "Q": [I2] * 3, "R": None, "Upsilon": np.ones((2, 2))},
        sf.ConfigError,
        "Upsilon: expected a positive definite",
    ),
    "no G": ({"G": []}, sf.ShapeError, "G: expected 2 matrices .*, got 0"),
    "too few G": ({"G": [I2]}, sf.ShapeError, "G: expected 2 matrices .*, got 1"),
    "G of two sizes": ({"G": [I2, I2[:, :1]]}, sf.ShapeError, r"G\[1\]: .*got \(2, 1\)"),
    "too many J": ({"G": [I2, I2], "J": [H2, H2]}, sf.ShapeError, "J: expected 1 .*, got 2"),
    "J does not fit": ({"G": [I2, I2], "J": [I2]}, sf.ShapeError, r"J\[0\]: .*got \(2, 2\)"),
    "J without G": ({"J": [H2]}, sf.ShapeError, r"J\[0\]: .*got \(1, 2\)"),
}


@pytest.mark.parametrize(("changed", "error", "message"), BAD.values(), ids=BAD.keys())
def test_bad_argument_is_named(changed: Arguments, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        sf.CompositeStep(**{**GOOD, **changed})


UPDATE: Arguments = {"x": np.zeros(2), "P": I2, "z": [1.0]}
BAD_UPDATE: dict[str, tuple[Arguments, type[Exception], str]] = {
    "x too long": ({"x": np.zeros(3)}, sf.ShapeError, r"x: expected shape \(2,\), got \(3,\)"),
    "x with a NaN": ({"x": [0.0, np.nan]}, sf.ConfigError, r"x: .*got nan at \(1,\)"),
    "P does not fit": ({"P": I1}, sf.ShapeError, r"P: expected shape \(2, 2\), got \(1, 1\)"),
    "P indefinite": ({"P": INDEFINITE}, sf.ConfigError, "P: expected a positive semidefinite"),
    "z too short": ({"z": []}, sf.ShapeError, r"z: expected shape \(1,\), got \(0,\)"),
    "z infinite": ({"z": [np.inf]}, sf.ConfigError, r"z: .*got inf at \(0,\)"),
    "u where there is none": (
        {"u": [[1.0], [2.0]]},
        sf.ShapeError,
        r"u: expected shape \(2, 0\), got \(2, 1\)",
    ),
    "no such way": (
        {"way": "fast"},
        sf.ConfigError,
        "way: expected 'auto', 'sequential' or 'composite', got 'fast'",
    ),
}


@pytest.mark.parametrize(
    ("changed", "error", "message"), BAD_UPDATE.values(), ids=BAD_UPDATE.keys()
)
def test_bad_argument_of_update_is_named(
    changed: Arguments, error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        sf.CompositeStep(**GOOD).update(**{**UPDATE, **changed})


@pytest.mark.parametrize("u", [np.zeros((1, 2)), np.zeros((2, 1)), np.zeros(4)])
def test_inputs_that_do_not_fit_are_named(u: Array) -> None:
    step = sf.CompositeStep(**GOOD, G=[I2, I2])
    with pytest.raises(sf.ShapeError, match=re.escape(f"u: expected shape (2, 2), got {u.shape}")):
        step.update(np.zeros(2), I2, [1.0], u)


@ways
def test_overflow_is_a_numerical_error(way: str) -> None:
    huge = np.array([[1e200]])
    step = sf.CompositeStep([huge, huge], [I1, I1], [I1], [I1])
    with pytest.raises(sf.NumericalError, match="update: "):
        step.update([1.0], I1, [1.0], way=way)


MODEL = sf.ConstantAcceleration(0.1)
WHEEL = sf.Sensor("wheel", 1.0, latency=0.1)
NO_SENSORS: Any = None
BAD_ROWS: dict[str, tuple[Callable[[], object], type[Exception], str]] = {
    "unknown sensor": (
        lambda: sf.CompositeStep.from_measurements(MODEL, [WHEEL], 0.0, 1.0, [0.5], ["radar"]),
        sf.ConfigError,
        "radar",
    ),
    "two lengths": (
        lambda: sf.CompositeStep.from_measurements(MODEL, [WHEEL], 0.0, 1.0, [0.5, 0.6], ["wheel"]),
        sf.ShapeError,
        "sensor|time",
    ),
    "before the start": (
        lambda: sf.CompositeStep.from_measurements(MODEL, [WHEEL], 0.0, 1.0, [0.05], ["wheel"]),
        sf.ConfigError,
        "time: expected validity between 0.0 and 1.0",
    ),
    "after the end": (
        lambda: sf.CompositeStep.from_measurements(MODEL, [WHEEL], 0.0, 1.0, [1.2], ["wheel"]),
        sf.ConfigError,
        "time: expected validity between 0.0 and 1.0",
    ),
    "end before start": (
        lambda: sf.CompositeStep.from_measurements(MODEL, [WHEEL], 1.0, 0.0, [], []),
        sf.ConfigError,
        "time: expected validity between 1.0 and 0.0",
    ),
    "NaN": (
        lambda: sf.CompositeStep.from_measurements(MODEL, [WHEEL], 0.0, 1.0, [np.nan], ["wheel"]),
        sf.ConfigError,
        r"time: .*got nan at \(0,\)",
    ),
    "beyond all times": (
        lambda: sf.CompositeStep.from_measurements(MODEL, [WHEEL], 0.0, 1.0, [1e30], ["wheel"]),
        sf.ConfigError,
        r"time: expected at most 3e\+09 s in magnitude, got 1e\+30 at 0",
    ),
    "sensors none": (
        lambda: sf.CompositeStep.from_measurements(MODEL, NO_SENSORS, 0.0, 1.0, [0.5], ["wheel"]),
        sf.ConfigError,
        "sensors: expected a sequence of Sensor objects, got None",
    ),
    "x does not fit": (
        lambda: sf.CompositeStep.from_measurements(
            MODEL, [WHEEL], 0.0, 1.0, [0.5], ["wheel"], x=[1.0]
        ),
        sf.ShapeError,
        r"x: expected shape \(2,\), got \(1,\)",
    ),
}


@pytest.mark.parametrize(("make", "error", "message"), BAD_ROWS.values(), ids=BAD_ROWS.keys())
def test_bad_rows_are_named(
    make: Callable[[], object], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        make()
