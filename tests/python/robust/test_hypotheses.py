"""All fault hypotheses of one step against their enumeration, one Cholesky factor each."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import surefix as sf
from oracle import fault_modes, hypotheses
from oracle.compare import covariance_error, state_error
from oracle.fault_step import FaultStep, evaluate, evaluate_with_biases
from oracle.mixture import Mixture
from oracle.step import Array
from robust.scenes import KINDS, MODELS, FaultScene, random_scene

PRIORS = ("constant", "chains")
MIXED = (KINDS, ("outage",), ("noisy", "drifting"), ("frozen", "interrupted"))


def assert_same_mixture(filter: sf.RobustFilter, expected: Mixture) -> None:
    """Every weight to 1e-10, and to a few roundings of its squares where it is below e^−100; every
    Gaussian."""
    found, n = filter.mixture(), expected.xs.shape[1]
    assert np.array_equal(found["modes"], expected.labels)
    np.testing.assert_allclose(found["log_weight"], expected.log_weight, rtol=1e-12, atol=1e-10)
    for x, P, x_k, P_k in zip(found["x"], found["P"], expected.xs, expected.Ps, strict=True):
        assert state_error(x[:n], x_k, P_k) <= 1e-10
        assert covariance_error(P[:n, :n], P_k) <= 1e-10


def squares(step: FaultStep, vector: Any) -> tuple[float, int]:
    """Σ ν²/S, from the evidence of the values that stay against that of what they should be."""
    modes = [step.sensors[s].modes[vector[s]] for _, s, _ in step.measurements]
    removed = (fault_modes.Outage, fault_modes.Interrupted, fault_modes.Frozen)
    kept = [i for i, mode in enumerate(modes) if not isinstance(mode, removed)]
    rows = tuple(step.measurements[i] for i in kept)
    ideal = tuple(
        (t, s, float(step.sensors[s].h @ step.transition(t - step.t0)[0] @ step.x))
        for t, s, _ in rows
    )
    z, zero = (
        evaluate(replace(step, measurements=values), [modes[i] for i in kept]).log_density
        for values in (rows, ideal)
    )
    return 2.0 * (zero - z), len(kept)


def assert_same_estimate(
    filter: sf.RobustFilter, estimate: sf.RobustEstimate, expected: Mixture, step: FaultStep
) -> None:
    assert state_error(estimate.x, expected.x, expected.P) <= 1e-10
    assert covariance_error(estimate.P, expected.P) <= 1e-10
    np.testing.assert_allclose(
        estimate.fault_probability, expected.fault_probability, rtol=1e-10, atol=1e-300
    )
    np.testing.assert_allclose(estimate.mode_probability.sum(axis=1), 1.0, rtol=1e-13)
    for s in range(len(filter.sensors)):
        for m in range(len(filter.mode_names[s])):
            weight = expected.weight[expected.labels[:, s] == m].sum()
            assert estimate.mode_probability[s, m] == pytest.approx(weight, rel=1e-10, abs=1e-300)
    best = expected.labels[expected.map]
    assert estimate.hypothesis == tuple(filter.mode_names[s][m] for s, m in enumerate(best))
    sse, degrees = squares(step, best)
    assert estimate.sse == pytest.approx(sse, rel=1e-10, abs=1e-10)
    assert estimate.degrees_of_freedom == degrees
    assert estimate.discarded_mass == 0.0


def check_one_step(scene: FaultScene, prior: str, end: float = 1.0) -> None:
    filter = scene.filter(prior=prior)
    scene.push(filter)
    estimate = filter.estimate(end)
    step = scene.step(0.0, end, scene.x0, scene.P0)
    log_prior = scene.log_stationary() if prior == "chains" else None
    expected = hypotheses.per_sensor(step, log_prior)
    assert_same_mixture(filter, expected)
    assert_same_estimate(filter, estimate, expected, step)
    assert filter.log_likelihood == pytest.approx(expected.log_evidence, rel=1e-12, abs=1e-10)


@pytest.mark.parametrize("prior", PRIORS)
@pytest.mark.parametrize("kind", KINDS)
@given(seed=st.integers(0, 2**32 - 1), name=st.sampled_from([*MODELS]), count=st.integers(0, 10))
def test_every_mode_alone_equals_the_enumeration(
    prior: str, kind: str, seed: int, name: str, count: int
) -> None:
    check_one_step(random_scene(seed, name, [(kind,)] * 2, measurements=count), prior)


@given(
    seed=st.integers(0, 2**32 - 1),
    name=st.sampled_from([*MODELS]),
    kinds=st.lists(st.sampled_from(MIXED), min_size=1, max_size=2),
    count=st.integers(0, 10),
    prior=st.sampled_from(PRIORS),
    end=st.sampled_from([1.0, 1.7]),
)
def test_modes_together_equal_the_enumeration(
    seed: int, name: str, kinds: list[tuple[str, ...]], count: int, prior: str, end: float
) -> None:
    check_one_step(random_scene(seed, name, kinds, measurements=count), prior, end)


@pytest.mark.parametrize("name", MODELS)
def test_three_sensors_with_every_mode(name: str) -> None:
    """216 hypotheses."""
    scene = random_scene(7, name, [KINDS] * 3, measurements=10)
    filter = scene.filter(components=216)
    scene.push(filter)
    filter.estimate(1.0)
    step = scene.step(0.0, 1.0, scene.x0, scene.P0)
    assert_same_mixture(filter, hypotheses.per_sensor(step, scene.log_stationary()))


@given(seed=st.integers(0, 2**32 - 1), name=st.sampled_from([*MODELS]))
def test_biases_are_those_of_the_drifts(seed: int, name: str) -> None:
    """They stand behind the states; of a sensor that does not drift, exactly zero."""
    scene = random_scene(seed, name, [("drifting", "outage"), (), ("drifting",)])
    filter = scene.filter()
    scene.push(filter)
    filter.estimate(1.0)
    found, n, column = filter.mixture(), scene.model.size, {0: 0, 2: 1}
    step = scene.step(0.0, 1.0, scene.x0, scene.P0)
    for modes, x, P in zip(found["modes"], found["x"], found["P"], strict=True):
        drifts = [s for s in column if modes[s] == 1]
        chosen = [*range(n), *(n + column[s] for s in drifts)]
        vector = [step.sensors[s].modes[m] for s, m in enumerate(modes)]
        expected = evaluate_with_biases(step, vector)
        assert state_error(x[chosen], expected.x, expected.P) <= 1e-10
        assert covariance_error(P[np.ix_(chosen, chosen)], expected.P) <= 1e-10
        others = [i for i in range(len(x)) if i not in chosen]
        assert not x[others].any()
        assert not P[others].any()
        assert not P[:, others].any()


def test_drift_is_coloured_noise() -> None:
    """Υ + b₀² 11ᵀ + b_q² min(τᵢ, τⱼ), by hand: a constant speed, read at three times."""
    P0, sigma, b0, bq, t = 4.0, 0.5, 2.0, 0.7, np.array([0.2, 0.5, 0.9])
    fault = sf.Drifting(sigma=b0, walk=bq, probability=0.1)
    sensor, z = sf.Sensor("radar", sigma, faults=(fault,)), np.array([3.0, 2.5, 4.0])
    filter = sf.RobustFilter(
        sf.ConstantVelocity(0.0), [sensor], [1.0], [[P0]], start=0.0, cut=0.0, carry="cut"
    )
    for time, value in zip(t, z, strict=True):
        filter.push(time, "radar", value)
    filter.estimate(1.0)
    Upsilon = sigma**2 * np.eye(3) + b0**2 * np.ones((3, 3)) + bq**2 * np.minimum.outer(t, t)
    log_joint = []
    for p, noise in ((0.9, sigma**2 * np.eye(3)), (0.1, Upsilon)):
        Gamma, nu = P0 * np.ones((3, 3)) + noise, z - 1.0
        _, log_det = np.linalg.slogdet(2 * np.pi * Gamma)
        log_joint.append(np.log(p) - 0.5 * (log_det + nu @ np.linalg.solve(Gamma, nu)))
    log_weight = log_joint - np.logaddexp.reduce(log_joint)
    np.testing.assert_allclose(filter.mixture()["log_weight"], log_weight, rtol=1e-11)
    gain = P0 * np.linalg.solve(P0 * np.ones((3, 3)) + Upsilon, np.ones(3))
    assert filter.mixture()["x"][1, 0] == pytest.approx(1.0 + gain @ (z - 1.0), rel=1e-12)


@given(seed=st.integers(0, 2**32 - 1), repeats=st.booleans())
def test_frozen_repeats_the_value_of_an_earlier_step(seed: int, repeats: bool) -> None:
    """Not of the last one, in which the sensor was silent."""
    scene = random_scene(seed, kinds=[("frozen", "outage"), ("frozen",)], measurements=6)
    filter = scene.filter(carry="one", prior="constant")
    scene.push(filter)
    filter.estimate(1.0)
    before = filter.estimate(2.0)
    value: dict[int, float] = {s: z for _, s, z in scene.rows}
    last = tuple(value.get(s) for s in range(2))
    rows = tuple(
        (2.5 + 0.1 * s, s, (value.get(s, 3.0) + (0.004 if repeats else 0.006))) for s in (0, 1, 0)
    )
    rows = (rows[0], (2.55, 0, rows[0][2] + 0.0049), rows[1])
    later = replace(scene, rows=rows)
    later.push(filter)
    filter.estimate(3.0)
    step = FaultStep(2.0, 3.0, before.x, before.P, scene.transition, scene.known, rows, last)
    assert_same_mixture(filter, hypotheses.per_sensor(step))


def lone(faults: tuple[Any, ...], P0: float = 1.0, sigma: float = 1.0) -> sf.RobustFilter:
    sensor = sf.Sensor("w", sigma, faults=faults)
    return sf.RobustFilter(
        sf.ConstantVelocity(0.0), [sensor], [0.0], [[P0]], start=0.0, cut=0.0, carry="cut"
    )


@pytest.mark.parametrize("z", [50.0, 5000.0, 1e8])
def test_no_floor_holds_a_weight_up(z: float) -> None:
    """Log odds of twelve million and more, exact."""
    filter = lone((sf.Outage(span=1e3, probability=0.01), sf.Noisy(factor=1e4, probability=0.02)))
    filter.push(0.5, "w", z)
    estimate = filter.estimate(1.0)
    log_joint = np.array([
        np.log(0.97) - 0.5 * (z**2 / 2.0 + np.log(2.0 * np.pi * 2.0)),
        np.log(0.01) - np.log(1e3),
        np.log(0.02) - 0.5 * (z**2 / 10001.0 + np.log(2.0 * np.pi * 10001.0)),
    ])  # fmt: skip
    log_weight = log_joint - np.logaddexp.reduce(log_joint)
    found: Array = filter.mixture()["log_weight"]
    np.testing.assert_allclose(found, log_weight, rtol=1e-14, atol=1e-14)
    np.testing.assert_allclose(found[0] - found[1], log_joint[0] - log_joint[1], rtol=1e-15)
    np.testing.assert_allclose(estimate.mode_probability[0], np.exp(log_weight), rtol=1e-13)


def test_two_sensors_outvote_one_that_is_far_off() -> None:
    """z = 5000 with sigma 1 among healthy ones at 0: it is out, and moves nothing."""
    out = sf.Outage(span=1e4, probability=1e-5)
    sensors = [sf.Sensor(name, 1.0, faults=(out,)) for name in "abc"]
    filter = sf.RobustFilter(
        sf.ConstantVelocity(0.0), sensors, [0.0], [[1e4]], start=0.0, cut=0.0, carry="cut"
    )
    for name, z in (("a", 5000.0), ("b", 0.3), ("c", -0.1)):
        filter.push(0.5, name, z)
    estimate = filter.estimate(1.0)
    assert estimate.hypothesis == ("outage", "healthy", "healthy")
    assert estimate.x[0] == pytest.approx(0.2 / (2.0 + 1e-4), rel=1e-9)
    assert estimate.fault_probability[0] == pytest.approx(1.0, rel=1e-14)
    assert (estimate.fault_probability[1:] < 1e-4).all()
    healthy = filter.mixture()["log_weight"][0]
    P, nu = 1e4 * np.ones((3, 3)) + np.eye(3), np.array([5000.0, 0.3, -0.1])
    _, log_det = np.linalg.slogdet(2.0 * np.pi * P)
    exact = 3 * np.log1p(-1e-5) - 0.5 * (log_det + nu @ np.linalg.solve(P, nu))
    assert healthy + filter.log_likelihood == pytest.approx(exact, rel=1e-12)


@pytest.mark.parametrize("z", [5.0, 5000.0, 1e6])
def test_weights_sum_to_one_however_unlikely_the_values(z: float) -> None:
    """Two sensors contradict each other, either of them may drift, and neither explains it."""
    drift = (sf.Drifting(sigma=0.5, walk=0.0, probability=0.1),)
    sensors = [sf.Sensor(name, 1.0, faults=drift) for name in "ab"]
    filter = sf.RobustFilter(
        sf.ConstantVelocity(0.0), sensors, [0.0], [[1e-6]], start=0.0, cut=0.0, max_faults=1
    )
    filter.push(0.5, "a", z)
    filter.push(0.5, "b", -z)
    estimate = filter.estimate(1.0)
    weights = np.exp(filter.mixture()["log_weight"])
    assert weights.sum() == pytest.approx(1.0, rel=1e-13)
    np.testing.assert_allclose(estimate.mode_probability.sum(axis=1), 1.0, rtol=1e-13)


def test_constant_bias_of_a_sensor_is_a_state_of_the_model() -> None:
    """Sensor states beside fault modes: the same as a general model with that state."""
    faults = (sf.Drifting(sigma=2.0, walk=0.3, probability=0.01),)
    biased = sf.Sensor("a", 0.5, bias_sigma=0.4, faults=faults)
    other = sf.Sensor("b", 0.3, faults=(sf.Outage(span=40.0, probability=0.02),))
    model = sf.LinearModel(np.zeros((2, 2)), [[0.7], [0.0]], [[1.0]])
    one = sf.RobustFilter(sf.ConstantVelocity(0.7), [biased, other], [5.0], [[4.0]], start=0.0)
    rows = (replace(biased, bias_sigma=0.0, observes=(1.0, 1.0)), replace(other, observes=(1, 0)))
    two = sf.RobustFilter(model, rows, [5.0, 0.0], np.diag([4.0, 0.16]), start=0.0)
    for filter in (one, two):
        for time, name, value in ((0.1, "a", 6.0), (0.3, "b", 5.2), (0.6, "a", 6.3)):
            filter.push(time, name, value)
    a, b = one.estimate(1.0), two.estimate(1.0)
    assert state_error(a.x, b.x, b.P) <= 1e-12
    assert covariance_error(a.P, b.P) <= 1e-12
    assert (a.lower, a.upper) == pytest.approx((b.lower, b.upper), rel=1e-10)
    np.testing.assert_allclose(a.mode_probability, b.mode_probability, rtol=1e-11)


@pytest.mark.parametrize("seed", range(40))
def test_noise_under_the_most_probable_hypothesis(seed: int) -> None:
    """v̂ = Υ Γ⁻¹ γ and its variance (eqs. 25, 26); none where the row is removed or not used."""
    case = random_scene(seed, kinds=(KINDS, ("outage",), KINDS), measurements=9)
    filter = case.filter(prior="constant", carry="one")
    result = filter.run(case.log, times=[1.0])
    step = case.step(0.0, 1.0, case.x0, case.P0)
    expected = hypotheses.per_sensor(step)
    best = expected.labels[expected.map]
    modes = [step.sensors[s].modes[best[s]] for _, s, _ in step.measurements]
    evidence = evaluate(step, modes)
    used = np.flatnonzero(result.step == 0)
    latency = {sensor.name: sensor.latency for sensor in case.sensors}
    valid = case.log.time - [latency[name] for name in case.log.sensor]
    rows = used[np.argsort(valid[used], kind="stable")]
    np.testing.assert_allclose(result.noise[rows], evidence.noise, rtol=1e-9, atol=1e-10)
    np.testing.assert_allclose(
        result.noise_variance[rows], evidence.noise_variance, rtol=1e-9, atol=1e-12
    )
    unused = np.setdiff1d(np.arange(len(case.log)), used)
    assert np.isnan(result.noise[unused]).all()
    without = filter.run(case.log, times=[1.0], noise=None)
    assert len(without.noise) == 0
    assert np.array_equal(without.x, result.x)


def test_noise_of_a_healthy_run_is_the_linear_filters() -> None:
    """Without fault modes: the same v̂ as ``DesyncFilter`` gives, of every step."""
    case = random_scene(3, kinds=((), ()), measurements=12)
    result = case.filter().run(case.log, times=[0.4, 0.8, 1.0])
    linear = sf.DesyncFilter(case.model, case.sensors, case.x0, case.P0, start=0.0)
    expected = linear.run(case.log, times=[0.4, 0.8, 1.0], noise="step")
    np.testing.assert_allclose(result.noise, expected.noise, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(result.noise_variance, expected.noise_variance, rtol=1e-9)
    np.testing.assert_allclose(
        result.normalised_noise, expected.normalised_noise, rtol=1e-9, atol=1e-12
    )


def test_noise_wanted() -> None:
    case = random_scene(3, kinds=(("outage",),), measurements=4)
    with pytest.raises(sf.ConfigError, match="noise: expected one of step, got 'journey'"):
        case.filter().run(case.log, times=[1.0], noise="journey")
