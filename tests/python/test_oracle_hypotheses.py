"""The references for fault hypotheses, chains, carried drifts and tails agree with one another.

No engine here. Composite and sequential forms are compared in standard deviations (see
``oracle.compare``); log-densities are sums of some tens of terms of order one.
"""

from __future__ import annotations

from dataclasses import replace
from decimal import Decimal
from itertools import product
from math import inf, log, pi, sqrt

import numpy as np
import pytest
from scipy import stats
from scipy.special import log_ndtr, logsumexp

from oracle import carried, mode_chain
from oracle.compare import covariance_error, state_error
from oracle.fault_modes import (
    Drifting,
    FallibleSensor,
    Frozen,
    Healthy,
    Interrupted,
    Mode,
    Noisy,
    Outage,
    log_removed,
)
from oracle.fault_step import FaultStep, Transition, evaluate, evaluate_with_biases
from oracle.hypotheses import per_measurement, per_sensor
from oracle.mixture_tail import alert_limits, normal_tail, upper_tail
from oracle.models import constant_acceleration, van_loan
from oracle.step import Array

TOLERANCE = 1e-9
HEALTHY, DRIFT = Healthy(), Drifting(b0=20.0, bq=1.5)
ALL_MODES: tuple[Mode, ...] = (
    HEALTHY,
    Outage(100.0),
    Noisy(25.0),
    Interrupted(10.0),
    Frozen(1e-3, 0.1, 60.0),
    DRIFT,
)
X0, P0 = np.array([30.0, 0.2]), np.array([[4.0, 0.1], [0.1, 0.1]])


def speed(jerk: float = 0.5) -> Transition:
    """[speed, acceleration]."""
    model = constant_acceleration(jerk, position=False)

    def transition(dt: float) -> tuple[Array, Array]:
        F, Q, _ = van_loan(model, dt)
        return F, Q

    return transition


def sensors(*modes: tuple[Mode, ...]) -> tuple[FallibleSensor, ...]:
    """One sensor of the speed for each set of modes, of growing sigma; healthy with 0.9."""

    def prior(count: int) -> tuple[float, ...]:
        return (0.9, *(0.1 / (count - 1),) * (count - 1)) if count > 1 else (1.0,)

    h = np.array([1.0, 0.0])
    return tuple(FallibleSensor(h, 0.5 * 2.0**s, m, prior(len(m))) for s, m in enumerate(modes))


def random_step(owners: tuple[FallibleSensor, ...], count: int = 9, seed: int = 1) -> FaultStep:
    """``count`` measurements in one second from t0 = 3 s; values of 0.1 resolution."""
    rng = np.random.default_rng(seed)
    times = np.sort(rng.uniform(3.0, 4.0, count))
    measurements = [
        (float(t), int(s), round(30.0 + owners[s].sigma * float(rng.normal()), 1))
        for t, s in zip(times, rng.integers(0, len(owners), count), strict=True)
    ]
    return FaultStep(3.0, 4.0, X0, P0, speed(), owners, tuple(measurements))


def assert_same(a: tuple[Array, Array], b: tuple[Array, Array]) -> None:
    assert state_error(a[0], *b) <= TOLERANCE
    assert covariance_error(a[1], b[1]) <= TOLERANCE


def test_drift_as_noise_equals_drift_as_state() -> None:
    step = random_step(sensors(ALL_MODES, ALL_MODES))
    for vector in product(ALL_MODES, repeat=2):
        noise = evaluate(step, [vector[s] for _, s, _ in step.measurements])
        state = evaluate_with_biases(step, vector)
        assert len(state.x) == 2 + vector.count(DRIFT)
        assert noise.log_density == pytest.approx(state.log_density, abs=1e-10)
        assert_same((state.x[:2], state.P[:2, :2]), (noise.x, noise.P))


def test_composite_density_is_the_normal_density() -> None:
    """The density of [z; x] by SciPy at once, where F, Q and the layout of time are by hand."""
    owners, jerk = sensors((HEALTHY, DRIFT)), 0.5
    measurements = ((3.1, 0, 29.0), (3.4, 0, 32.5), (3.4, 0, 31.0), (4.0, 0, 28.0))
    step = FaultStep(3.0, 4.0, X0, P0, speed(jerk), owners, measurements)
    tau = np.array([0.1, 0.4, 0.4, 1.0])
    HF = np.column_stack([np.ones(4), tau])
    low, high = np.minimum.outer(tau, tau), np.maximum.outer(tau, tau)
    walk = jerk**2 * (low**2 * high / 2.0 - low**3 / 6.0)  # cov of the twice integrated noise
    Gamma = HF @ P0 @ HF.T + walk + np.diag([0.25] * 4) + DRIFT.b0**2 + DRIFT.bq**2 * low
    values = [value for _, _, value in measurements]
    expected = stats.multivariate_normal(HF @ X0, Gamma).logpdf(values)
    assert evaluate(step, [DRIFT] * 4).log_density == pytest.approx(expected, abs=1e-10)


def test_no_drift_is_healthy() -> None:
    nothing = Drifting(0.0, 0.0)
    mixture = per_sensor(random_step(sensors((HEALTHY, nothing), (HEALTHY, nothing))))
    np.testing.assert_allclose(mixture.weight, [0.81, 0.09, 0.09, 0.01], rtol=1e-12)
    np.testing.assert_allclose(mixture.fault_probability, 0.1, rtol=1e-12)
    assert_same((mixture.x, mixture.P), (mixture.xs[0], mixture.Ps[0]))


@pytest.mark.parametrize("mode", [Noisy(1.0), Drifting(0.0, 0.0)])
def test_modes_that_change_nothing(mode: Mode) -> None:
    step = random_step(sensors((HEALTHY, mode)))
    healthy, other = (evaluate(step, [m] * 9) for m in (HEALTHY, mode))
    assert healthy.log_density == pytest.approx(other.log_density, abs=1e-12)
    assert_same((healthy.x, healthy.P), (other.x, other.P))


def test_noisy_multiplies_the_variance() -> None:
    step = random_step(sensors((HEALTHY,)))
    loud = replace(step, sensors=(replace(step.sensors[0], sigma=5.0 * step.sensors[0].sigma),))
    noisy, expected = evaluate(step, [Noisy(25.0)] * 9), evaluate(loud, [HEALTHY] * 9)
    assert noisy.log_density == pytest.approx(expected.log_density, abs=1e-12)
    assert_same((noisy.x, noisy.P), (expected.x, expected.P))


def test_removed_values() -> None:
    """Every removed value by hand; what is left of the state is the prediction."""
    assert log_removed(Outage(100.0), 2.0, 7.0, None) == -log(100.0)
    expected = -0.5 * (log(2.0 * pi * 40.0) + 49.0 / 40.0)
    assert log_removed(Interrupted(10.0), 2.0, 7.0, None) == pytest.approx(expected)
    frozen = Frozen(0.01, 0.5, 50.0)
    assert log_removed(frozen, 2.0, 7.0, None) == log(0.01 / 50.0)
    assert log_removed(frozen, 2.0, 7.0, 7.25) == log(0.99 / 0.5)
    assert log_removed(frozen, 2.0, 7.0, 7.26) == log(0.01 / 50.0)
    assert log_removed(Frozen(0.0, 0.5, 50.0), 2.0, 7.0, 9.0) == -inf
    assert log_removed(HEALTHY, 2.0, 7.0, None) is None

    owners = sensors((HEALTHY, frozen), (HEALTHY,))
    values = ((3.2, 0, 7.0), (3.5, 0, 7.0), (3.6, 0, 9.0))
    step = FaultStep(3.0, 4.0, X0, P0, speed(), owners, values, last=(6.0, 9.0))
    evidence = evaluate(step, [frozen] * 3)
    assert evidence.log_density == pytest.approx(log(0.99 / 0.5) + 2 * log(0.01 / 50.0))
    F, Q = speed()(1.0)
    assert_same((evidence.x, evidence.P), (F @ X0, F @ P0 @ F.T + Q))


def test_impossible_value_is_an_outage() -> None:
    """z = 5000 m/s, sigma = 1 m/s: the log odds are exact, although exp(-2e6) is no double."""
    owner = FallibleSensor(np.array([1.0, 0.0]), 1.0, (HEALTHY, Outage(100.0)), (0.9, 0.1))
    step = FaultStep(0.0, 1.0, X0, P0, speed(), (owner,), ((0.0, 0, 5000.0),))
    odds = log(0.1 / 0.9) - log(100.0) + 0.5 * (log(2.0 * pi * 5.0) + (5000.0 - 30.0) ** 2 / 5.0)
    for mixture in (per_sensor(step), per_measurement(step)):
        assert mixture.log_weight[1] - mixture.log_weight[0] == pytest.approx(odds, rel=1e-14)
        assert mixture.fault_probability[0] == 1.0
        assert mixture.map == 1
        assert_same((mixture.x, mixture.P), (mixture.xs[1], mixture.Ps[1]))


def test_probabilities_and_moments() -> None:
    mixture = per_sensor(random_step(sensors(ALL_MODES, ALL_MODES)))
    assert mixture.labels.shape == (36, 2)
    assert np.sum(mixture.weight) == pytest.approx(1.0, abs=1e-14)
    faulty = [np.sum(mixture.weight[mixture.labels[:, s] > 0]) for s in (0, 1)]
    np.testing.assert_allclose(mixture.fault_probability, faulty, rtol=1e-12)
    second = sum(
        w * (P + np.outer(x, x))
        for w, x, P in zip(mixture.weight, mixture.xs, mixture.Ps, strict=True)
    )
    assert covariance_error(second - np.outer(mixture.x, mixture.x), mixture.P) <= 1e-9


def test_measurements_of_their_own() -> None:
    """One measurement for each sensor: both kinds of hypothesis are the same."""
    two = (HEALTHY, Outage(100.0))
    owners = sensors(two, two, two)
    step = replace(
        random_step(owners), measurements=((3.2, 1, 31.0), (3.3, 0, 35.0), (3.9, 2, 30.0))
    )
    single, whole = per_measurement(step), per_sensor(step)
    assert single.labels.shape == (8, 3)
    assert single.log_evidence == pytest.approx(whole.log_evidence, abs=1e-12)
    np.testing.assert_allclose(
        single.fault_probability, whole.fault_probability[[1, 0, 2]], rtol=1e-10
    )
    assert_same((single.x, single.P), (whole.x, whole.P))
    assert per_measurement(random_step(owners)).labels.shape == (2**9, 9)


def test_star_and_joint_chain() -> None:
    one, two = mode_chain.star([0.01, 0.02], [1.0, 5.0]), mode_chain.star([0.1], [3.0])
    joint = mode_chain.joint([one, two])
    for G in (one, two, joint):
        np.testing.assert_allclose(G.sum(axis=1), 0.0, atol=1e-15)
        np.testing.assert_allclose(mode_chain.transition(G, 0.7).sum(axis=1), 1.0, rtol=1e-14)
        p = mode_chain.stationary(G)
        assert np.sum(p) == pytest.approx(1.0)
        np.testing.assert_allclose(p @ mode_chain.transition(G, 2.0), p, rtol=1e-12)
    p = mode_chain.stationary(one)
    np.testing.assert_allclose(p[1:], p[0] * np.array([0.01 * 1.0, 0.02 * 5.0]), rtol=1e-13)
    # two states in closed form
    decay = np.exp(-(0.1 + 1.0 / 3.0) * 0.7)
    healthy = (1.0 / 3.0 + 0.1 * decay) / (0.1 + 1.0 / 3.0)
    assert mode_chain.transition(two, 0.7)[0, 0] == pytest.approx(healthy, rel=1e-14)
    product_of = np.kron(mode_chain.transition(one, 0.7), mode_chain.transition(two, 0.7))
    np.testing.assert_allclose(mode_chain.transition(joint, 0.7), product_of, rtol=1e-12)


def test_common_event() -> None:
    one = mode_chain.star([0.01, 0.02], [1.0, 5.0])
    event = mode_chain.CommonEvent(0.5, {0: 2, 1: 2})
    difference = mode_chain.joint([one] * 3, [event]) - mode_chain.joint([one] * 3)
    np.testing.assert_allclose(difference.sum(axis=1), 0.0, atol=1e-15)

    def index(a: int, b: int, c: int) -> int:
        return 9 * a + 3 * b + c

    for c in range(3):
        assert difference[index(0, 0, c), index(2, 2, c)] == pytest.approx(0.5)
        assert difference[index(1, 0, c), index(1, 2, c)] == pytest.approx(0.5)
        assert not np.any(difference[index(1, 2, c)])


def chain(owners: tuple[FallibleSensor, ...]) -> Array:
    """Failures every 20 s into each mode, lasting 2 s."""
    stars = [mode_chain.star(*([v] * (len(o.modes) - 1) for v in (0.05, 2.0))) for o in owners]
    return mode_chain.joint(stars)


def test_carried_for_one_step_is_the_composite() -> None:
    owners = sensors(ALL_MODES, (HEALTHY, DRIFT))
    step, G = random_step(owners), chain(owners)
    (after,) = carried.run(speed(), owners, G, X0, P0, step.measurements, [step.t1], step.t0)
    once = per_sensor(step, np.log(mode_chain.transition(G, 1.0)[0]))
    np.testing.assert_array_equal(after.mixture.labels, once.labels)
    np.testing.assert_allclose(after.mixture.log_weight, once.log_weight, rtol=1e-10, atol=1e-10)
    assert after.mixture.log_evidence == pytest.approx(once.log_evidence, abs=1e-10)
    assert_same((after.mixture.x[:2], after.mixture.P[:2, :2]), (once.x, once.P))
    for component in after.components:
        modes = [o.modes[m] for o, m in zip(owners, component.path[-1], strict=True)]
        biases = evaluate_with_biases(step, modes)
        alive = [0, 1, *(2 + s for s in (0, 1) if modes[s] == DRIFT)]
        gone = [i for i in range(4) if i not in alive]
        assert_same((component.x[alive], component.P[np.ix_(alive, alive)]), (biases.x, biases.P))
        assert not np.any(component.x[gone])
        assert not np.any(component.P[gone])


def test_carried_over_two_steps_is_one_composite_step() -> None:
    """Every path of one sensor that drifts or not, as one step of twice the length in which the
    values of the second half belong to a second sensor if the mode changes at half time."""
    owners, half, end = sensors((HEALTHY, DRIFT)), 3.5, 4.0
    step, G = random_step(owners), chain(owners)
    T = mode_chain.transition(G, 0.5)
    initial = np.array([0.7, 0.3])
    first, second = carried.run(
        speed(), owners, G, X0, P0, step.measurements, [half, end], step.t0, initial
    )
    assert (len(first.components), len(second.components)) == (4, 8)
    # counted from half time, a bias of variance b0^2 has b0^2 - bq^2 T + bq^2 min(tau)
    late = Drifting(sqrt(DRIFT.b0**2 - 0.5 * DRIFT.bq**2), DRIFT.bq)
    halves = tuple((t, int(t > half), z) for t, _, z in step.measurements)
    split = replace(step, sensors=owners * 2, measurements=halves)
    assert {s for _, s, _ in halves} == {0, 1}
    log_joint = []
    for component in second.components:
        (a,), (b,), (c,) = component.path
        if b == c == 1:
            expected = evaluate_with_biases(step, [DRIFT])
        else:
            modes = (DRIFT if b else HEALTHY, late if c else HEALTHY)
            expected = evaluate_with_biases(split, modes)
        prior = initial[a] * T[a, b] * T[b, c]
        log_joint.append(expected.log_density + log(prior))
        assert component.log_joint == pytest.approx(log_joint[-1], abs=1e-10)
        alive = [0, 1, 2] if c else [0, 1]
        kept = [0, 1, len(expected.x) - 1] if c else [0, 1]
        assert_same(
            (component.x[alive], component.P[np.ix_(alive, alive)]),
            (expected.x[kept], expected.P[np.ix_(kept, kept)]),
        )
        if not c:
            assert component.x[2] == 0.0
            assert not np.any(component.P[2])
            assert not np.any(component.P[:, 2])
    assert np.sum(second.mixture.weight) == pytest.approx(1.0, abs=1e-14)
    assert second.mixture.log_evidence == pytest.approx(logsumexp(log_joint), abs=1e-10)


def test_carried_remembers_the_last_value() -> None:
    frozen = Frozen(1e-3, 0.1, 60.0)
    owners = sensors((HEALTHY, frozen))
    results = carried.run(
        speed(), owners, chain(owners), X0, P0, [(0.5, 0, 30.0), (1.5, 0, 30.0)], [1.0, 2.0]
    )
    (component,) = [c for c in results[1].components if c.path == ((0,), (1,), (1,))]
    T = mode_chain.transition(chain(owners), 1.0)
    expected = log(T[0, 1] * T[1, 1]) + log(1e-3 / 60.0) + log((1.0 - 1e-3) / 0.1)
    assert component.log_joint == pytest.approx(expected, rel=1e-13)


def test_normal_tail() -> None:
    for x in (0.0, 0.3, 2.5, 3.999, 4.0, 6.7, 12.0, 37.0):
        for sign in (1.0, -1.0):
            tail = normal_tail(Decimal(sign * x))
            assert float(tail.ln()) == pytest.approx(log_ndtr(-sign * x), rel=1e-13)
    # mpmath 1.3, erfc(x / sqrt(2)) / 2 at 60 digits
    known = {
        "3.5": "0.000232629079035525036349925886727984773548749335889041236",
        "4.5": "0.00000339767312473006040168744919087152351210476508684864834",
    }
    for x_text, value in known.items():
        relative = abs(normal_tail(Decimal(x_text)) / Decimal(value) - 1)
        assert relative < Decimal("1e-49")


def test_alert_limits() -> None:
    for risk in (1e-3, 1e-7, 1e-11, 1e-15):
        k = float(stats.norm.isf(risk / 2.0))
        limits = alert_limits([0.25, 0.75], [30.0, 30.0], [2.0, 2.0], risk)
        np.testing.assert_allclose(limits, [30.0 - 2.0 * k, 30.0 + 2.0 * k], rtol=1e-12)
    weights, means, sigmas = [0.999, 1e-3, 1e-9], [30.0, 20.0, 55.0], [0.5, 1.0, 3.0]
    low, high = alert_limits(weights, means, sigmas, 1e-11)
    assert float(upper_tail(Decimal(high), weights, means, sigmas)) == pytest.approx(5e-12)
    mirrored = upper_tail(-Decimal(low), weights, [-m for m in means], sigmas)
    assert float(mirrored) == pytest.approx(5e-12)
    wide = alert_limits(weights, means, sigmas, 1e-11, lost=9e-12)
    assert wide[0] < low
    assert high < wide[1]
    np.testing.assert_allclose(wide, alert_limits(weights, means, sigmas, 1e-12), rtol=1e-5)
    assert alert_limits(weights, means, sigmas, 1e-11, lost=1e-11) == (-inf, inf)
    assert alert_limits([1.0], [30.0], [0.0], 1e-11) == (30.0, 30.0)
