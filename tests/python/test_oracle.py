"""The reference implementations agree with one another, and the paper's misprints show.

Tolerances. Errors of x are counted in standard deviations and errors of P as |dP_ij| /
sqrt(P_ii P_jj), against the fifty-digit reference (``oracle.compare``, ``oracle.precise``). With
variances spread over d decades, in doubles, what holds over thousands of random journeys is:

- dense forms (Wiener-Hopf, composite with and without inverses): about eps 10^d, since P- - K C'
  cancels d digits; the worst of some thousand journeys was 6e-6 at d = 10;
- the Levinson recursion: eps 10^(2 d), since it carries an explicit inverse; it can fail at d = 10;
- the sequential filter in Joseph's form: within a factor of some tens of what one rounding of the
  data does to the exact answer (``oracle.conditioning``), which itself reaches 3e-8 at d = 10.
"""

from __future__ import annotations

from collections.abc import Callable
from math import inf

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from oracle import composite, composite_forward, models, sequential
from oracle.compare import covariance_error, smallest_correlation, state_error
from oracle.conditioning import precise_journey, sensitivity
from oracle.levinson import levinson
from oracle.noise import noise_estimate
from oracle.sensors import Run, Sensor, run
from oracle.step import Array, Posterior, Step
from oracle.strategies import Journey, journeys, random_journey
from oracle.wiener import wiener, wiener_noise

EPS = float(np.finfo(np.float64).eps)
Estimates = list[tuple[Array, Array]]

examples = settings(
    max_examples=15, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow]
)


def dense_tolerance(decades: int) -> float:
    return EPS * (1e3 + 1e2 * 10.0**decades)


def chain(
    update: Callable[[Step, Array, Array], Posterior | sequential.Filtered], journey: Journey
) -> Estimates:
    """Every step's estimate, each step starting from the one before."""
    x, P, estimates = journey.x0, journey.P0, []
    for step in journey.steps:
        result = update(step, x, P)
        x, P = result.x, result.P
        estimates.append((x, P))
    return estimates


def assert_precise(journey: Journey, estimates: Estimates, tolerance: float) -> None:
    for (x, P), reference in zip(estimates, precise_journey(journey), strict=True):
        assert state_error(x, reference.x, reference.P) <= tolerance
        assert covariance_error(P, reference.P) <= tolerance
        assert np.array_equal(P, P.T)
        assert smallest_correlation(P) >= -tolerance


@examples
@given(journeys())
def test_wiener_equals_precise(journey: Journey) -> None:
    estimates = wiener(journey.x0, journey.P0, journey.steps)
    assert_precise(journey, estimates, dense_tolerance(journey.decades))


@examples
@given(journeys())
def test_forward_composite_equals_precise(journey: Journey) -> None:
    estimates = chain(composite_forward.update, journey)
    assert_precise(journey, estimates, dense_tolerance(journey.decades))


@examples
@given(journeys(singular=False))
def test_table_1_corrected_equals_precise(journey: Journey) -> None:
    assert_precise(journey, chain(composite.table_1, journey), dense_tolerance(journey.decades))


@examples
@given(journeys(max_decades=4))
def test_levinson_equals_precise(journey: Journey) -> None:
    estimates = levinson(journey.x0, journey.P0, journey.steps)
    assert_precise(journey, estimates, dense_tolerance(2 * journey.decades))


@examples
@given(journeys(full=False))
def test_sequential_filter_is_as_good_as_its_data(journey: Journey) -> None:
    x, P = chain(sequential.kalman, journey)[-1]
    reference = precise_journey(journey)[-1]
    x_limit, P_limit = np.max([sensitivity(journey, seed) for seed in range(3)], axis=0)
    assert state_error(x, reference.x, reference.P) <= 1e-12 + 100 * x_limit
    assert covariance_error(P, reference.P) <= 1e-13 + 100 * P_limit
    assert smallest_correlation(P) >= -1e-13


def test_sequential_filter_refuses_correlated_measurements() -> None:
    journey = random_journey(1, full=True)
    with pytest.raises(ValueError, match="block-diagonal"):
        sequential.kalman(journey.steps[0], journey.x0, journey.P0)


@examples
@given(journeys(max_decades=4, full=False))
def test_likelihood_and_nis_agree(journey: Journey) -> None:
    """SSE is the sum of the sequential NIS, and the likelihoods are one."""
    x, P = journey.x0, journey.P0
    for step, reference in zip(journey.steps, precise_journey(journey), strict=True):
        tolerance = 1e2 * dense_tolerance(journey.decades) * (1.0 + step.M)
        filtered = sequential.kalman(step, x, P)
        noise = noise_estimate(composite_forward.update(step, x, P), step.Upsilon)
        for log_likelihood in (filtered.log_likelihood, noise.log_likelihood):
            assert log_likelihood == pytest.approx(reference.log_likelihood, abs=tolerance)
        assert filtered.nis == pytest.approx(reference.nis, abs=tolerance)
        assert noise.sse == pytest.approx(np.sum(reference.nis), abs=tolerance)
        assert noise.dof == step.M
        x, P = filtered.x, filtered.P


@examples
@given(journeys(max_decades=4, max_steps=3))
def test_noise_estimate_is_the_wiener_estimate(journey: Journey) -> None:
    """Eq. (25) for the last step equals eq. (23): the noise is independent of earlier data."""
    estimates = [(journey.x0, journey.P0), *chain(composite_forward.update, journey)]
    last, reference = journey.steps[-1], precise_journey(journey)[-1]
    noise = noise_estimate(composite_forward.update(last, *estimates[-2]), last.Upsilon)
    v, covariance = wiener_noise(journey.x0, journey.P0, journey.steps)
    start = len(v) - last.M
    tolerance = 1e2 * dense_tolerance(journey.decades)
    for v_k, covariance_k in (
        (noise.v, noise.covariance),
        (v[start:], covariance[start:, start:]),
    ):
        assert state_error(v_k, reference.v, reference.v_covariance) <= tolerance
        assert covariance_error(covariance_k, reference.v_covariance) <= tolerance


def test_sse_is_the_norm_of_the_estimated_noise() -> None:
    """Eq. (27) as it is written."""
    journey = random_journey(2, largest=3, full=True)
    step = journey.steps[0]
    noise = noise_estimate(composite_forward.update(step, journey.x0, journey.P0), step.Upsilon)
    written = noise.v @ np.linalg.solve(noise.covariance, noise.v)
    assert noise.sse == pytest.approx(written, rel=1e-9)
    assert noise.normalised == pytest.approx(noise.v / np.sqrt(np.diag(noise.covariance)))


def test_matrices_give_the_forward_ones() -> None:
    """H F = HF and H W - Theta = L; the inputs reach z by H G + J_tilde."""
    step = random_journey(3, inputs=2, largest=2).steps[0]
    c, f = composite.matrices(step), composite_forward.forward(step)
    u = np.concatenate(step.u)
    np.testing.assert_allclose(c.H @ c.F, f.HF, atol=1e-13)
    np.testing.assert_allclose(c.H @ c.W - c.Theta, f.L, atol=1e-13)
    np.testing.assert_allclose((c.H @ c.G + c.Jtilde) @ u, f.known_z, atol=1e-13)
    np.testing.assert_allclose(c.G @ u, f.known_x, atol=1e-13)


def test_step_without_measurements_is_a_prediction() -> None:
    journey = random_journey(4, measurements=0, step_count=1, inputs=1)
    (step,) = journey.steps
    x = step.F[0] @ journey.x0 + step.G[0] @ step.u[0]
    P = step.F[0] @ journey.P0 @ step.F[0].T + step.Q[0]
    for estimates in (
        wiener(journey.x0, journey.P0, journey.steps),
        levinson(journey.x0, journey.P0, journey.steps),
        chain(composite.table_1, journey),
        chain(composite_forward.update, journey),
        chain(sequential.kalman, journey),
    ):
        np.testing.assert_allclose(estimates[0][0], x, rtol=1e-14, atol=1e-14)
        np.testing.assert_allclose(estimates[0][1], P, rtol=1e-14, atol=1e-14)


@pytest.mark.parametrize(("inverses", "J_tilde"), [(False, True), (True, False), (False, False)])
def test_misprints_change_the_state(inverses: bool, J_tilde: bool) -> None:
    """Without the inverses of (44)-(47), or with J for J_tilde in (16), x is wrong by sigmas."""
    journey = random_journey(5, inputs=2, step_count=1)
    (step,) = journey.steps
    right = composite.table_1(step, journey.x0, journey.P0)
    printed = composite.state_as_printed(
        step, journey.x0, journey.P0, inverses=inverses, J_tilde=J_tilde
    )
    corrected = composite.state_as_printed(
        step, journey.x0, journey.P0, inverses=True, J_tilde=True
    )
    assert state_error(printed, right.x, right.P) > 1.0
    assert np.array_equal(corrected, right.x)


def test_misprinted_covariance_has_no_matching_dimensions() -> None:
    journey = random_journey(6)
    with pytest.raises(ValueError, match="mismatch"):
        composite.covariance_as_printed(journey.steps[0], journey.P0)


MODELS = {
    "speed": models.constant_velocity(0.7, position=False),
    "position, speed": models.constant_velocity(0.7),
    "speed, acceleration": models.constant_acceleration(0.08, position=False),
    "position, speed, acceleration": models.constant_acceleration(0.08),
    "bias": models.gauss_markov(2.0, 5.0),
    "constant bias": models.gauss_markov(2.0, inf),
    "damped oscillator": models.Model(
        A=np.array([[0.0, 1.0], [-4.0, -0.3]]),
        L=np.array([[0.1, 0.0], [0.2, 1.0]]),
        Qc=np.array([[1.0, 0.3], [0.3, 0.5]]),
        B=np.array([[0.0], [1.0]]),
    ),
}


@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS.keys())
@pytest.mark.parametrize("dt", [0.0, 0.1, 7.0])
def test_matrix_exponential_equals_quadrature(model: models.Model, dt: float) -> None:
    """To 1e-11 of sqrt(Q_ii Q_jj) for Q, to 1e-12 of the largest entry for F and G."""
    F, Q, G = models.van_loan(model, dt)
    F_q, Q_q, G_q = models.quadrature(model, dt)
    for exponential, integral in ((F, F_q), (G, G_q)):
        np.testing.assert_allclose(
            exponential, integral, rtol=0, atol=1e-12 * np.max(np.abs(integral), initial=0.0)
        )
    assert covariance_error(Q, Q_q) <= 1e-11


@pytest.mark.parametrize("dt", [1e-3, 1.0, 60.0])
def test_models_have_their_closed_forms(dt: float) -> None:
    q = 0.08
    F, Q, G = models.van_loan(models.constant_acceleration(q), dt)
    expected = np.array([[1.0, dt, dt**2 / 2], [0.0, 1.0, dt], [0.0, 0.0, 1.0]])
    np.testing.assert_allclose(F, expected, rtol=1e-13)
    expected = np.array(
        [
            [dt**5 / 20, dt**4 / 8, dt**3 / 6],
            [dt**4 / 8, dt**3 / 3, dt**2 / 2],
            [dt**3 / 6, dt**2 / 2, dt],
        ]
    )
    assert covariance_error(Q, q**2 * expected) <= 1e-12
    np.testing.assert_allclose(G, [[dt**3 / 6], [dt**2 / 2], [dt]], rtol=1e-13)
    F_b, Q_b, _ = models.van_loan(models.gauss_markov(2.0, 30.0), dt)
    np.testing.assert_allclose(
        [F_b.item(), Q_b.item()], models.gauss_markov_transition(2.0, 30.0, dt), rtol=1e-12
    )


def speed_transition(dt: float) -> tuple[Array, Array]:
    """``constant_acceleration`` without position in closed form, for speed."""
    q = 0.3
    Q = q**2 * np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]])
    return np.array([[1.0, dt], [0.0, 1.0]]), Q


SPEED = np.array([1.0, 0.0])
X0, P0 = np.array([20.0, 0.0]), np.diag([4.0, 1.0])


def assert_same_run(a: Run, b: Run) -> None:
    for name in ("x", "P", "sse", "dof", "log_likelihood"):
        np.testing.assert_allclose(getattr(a, name), getattr(b, name), rtol=1e-12, atol=1e-13)


def test_sensor_filter_equals_the_composite_step() -> None:
    """A bias is a state; late data are sorted into place; unused data are left out."""
    wheel = Sensor("wheel", SPEED, 0.5, bias_sigma=0.4, bias_time=3.0)
    radar = Sensor("radar", SPEED, 0.2, latency=0.25)
    log = [(0.5, 1, 20.3), (0.4, 0, 20.9), (0.0, 0, 19.5), (0.2, 1, 99.0), (1.3, 1, 99.0)]
    result = run(speed_transition, [wheel, radar], X0, P0, log, [1.0])
    legs = []
    for dt in (0.0, 0.25, 0.15, 0.6):  # wheel at 0, radar at 0.25, wheel at 0.4, estimate at 1
        F, Q = np.eye(3), np.zeros((3, 3))
        F[:2, :2], Q[:2, :2] = speed_transition(dt)
        F[2, 2], Q[2, 2] = models.gauss_markov_transition(0.4, 3.0, dt)
        legs.append((F, Q))
    biased, plain = np.array([[1.0, 0.0, 1.0]]), np.array([[1.0, 0.0, 0.0]])
    step = Step(
        F=tuple(F for F, _ in legs),
        Q=tuple(Q for _, Q in legs),
        H=(biased, plain, biased),
        R=(np.array([[0.25]]), np.array([[0.04]]), np.array([[0.25]])),
        z=(np.array([19.5]), np.array([20.3]), np.array([20.9])),
    )
    posterior = composite_forward.update(step, np.append(X0, 0.0), np.diag([4.0, 1.0, 0.16]))
    noise = noise_estimate(posterior, step.Upsilon)
    assert state_error(result.x[0], posterior.x, posterior.P) <= 1e-12
    assert covariance_error(result.P[0], posterior.P) <= 1e-12
    assert result.sse[0] == pytest.approx(noise.sse, rel=1e-12)
    assert result.dof[0] == 3
    assert result.log_likelihood == pytest.approx(noise.log_likelihood, rel=1e-12)


@examples
@given(st.integers(0, 2**32 - 1))
def test_sensor_filter_does_not_depend_on_arrival(seed: int) -> None:
    """Neither the order of the log, nor a latency that the stamps make up for, nor extra estimation
    times change the last estimate."""
    rng = np.random.default_rng(seed)
    times = rng.integers(0, 10_000, 30) / 1000
    log = [(float(t), int(rng.integers(2)), float(rng.normal(20.0, 1.0))) for t in times]

    def sensors(latency: float) -> list[Sensor]:
        return [
            Sensor("wheel", SPEED, 0.5, latency, scale_sigma=0.02, bias_sigma=0.1, bias_time=2.0),
            Sensor("radar", SPEED, 1.0, scale_sigma=0.01),
        ]

    reference = run(speed_transition, sensors(0.0), X0, P0, log, [10.0])
    shuffled = [log[i] for i in rng.permutation(len(log))]
    assert_same_run(run(speed_transition, sensors(0.0), X0, P0, shuffled, [10.0]), reference)
    late = [(time + (0.5 if i == 0 else 0.0), i, value) for time, i, value in shuffled]
    assert_same_run(run(speed_transition, sensors(0.5), X0, P0, late, [10.0]), reference)
    stepped = run(speed_transition, sensors(0.0), X0, P0, log, [float(t) for t in range(1, 11)])
    assert stepped.dof.sum() == reference.dof[0] == 30
    assert stepped.sse.sum() == pytest.approx(reference.sse[0], rel=1e-9)
    assert state_error(stepped.x[-1], reference.x[-1], reference.P[-1]) <= 1e-9
    assert covariance_error(stepped.P[-1], reference.P[-1]) <= 1e-9


def test_scale_error_of_a_known_speed() -> None:
    """With the speed known and constant, s follows from the readings by linear regression."""
    speed, sigma, scale_sigma, readings = 20.0, 0.5, 0.03, np.array([20.9, 20.4, 21.1])
    sensor = Sensor("wheel", np.array([1.0]), sigma, scale_sigma=scale_sigma)
    log = [(float(t), 0, float(z)) for t, z in enumerate(readings, start=1)]
    result = run(
        lambda dt: (np.eye(1), np.zeros((1, 1))),
        [sensor],
        np.array([speed]),
        np.zeros((1, 1)),
        log,
        [4.0],
    )
    information = len(readings) * speed**2 / sigma**2 + 1 / scale_sigma**2
    scale = speed * np.sum(readings - speed) / sigma**2 / information
    np.testing.assert_allclose(result.x[0], [speed, scale], rtol=1e-12)
    np.testing.assert_allclose(result.P[0], np.diag([0.0, 1 / information]), rtol=1e-12)
