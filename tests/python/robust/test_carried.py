"""The mixture that lives from step to step, against all histories of modes, nothing cut."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

import surefix as sf
from oracle import carried, hypotheses, mode_chain
from oracle.compare import covariance_error, state_error
from oracle.mixture import Mixture
from oracle.mode_chain import CommonEvent
from oracle.step import Array
from robust.scenes import MODELS, FaultScene, by_modes, grouped, random_scene

PAIRS = (
    (("drifting",), ("outage",)),
    (("drifting",), ("drifting",)),
    (("drifting", "frozen"), ("noisy",)),
    (("outage", "interrupted"), ("frozen",)),
    (("drifting", "outage", "noisy"),),
)
ENDS = (0.8, 1.6, 2.4, 3.2)


def scene_of(seed: int, name: str, pair: int, measurements: int = 20) -> FaultScene:
    return random_scene(seed, name, PAIRS[pair], measurements=measurements, duration=3.2)


def assert_same_groups(filter: sf.RobustFilter, expected: Mixture) -> None:
    """Sum, mean and covariance, biases included, of the histories that end in the same modes."""
    found = filter.mixture()
    groups = by_modes(found["modes"], found["log_weight"], found["x"], found["P"])
    for vector, (log_weight, x, P) in grouped(expected).items():
        assert groups[vector][0] == pytest.approx(log_weight, rel=1e-12, abs=1e-10)
        # The larger the logarithm, the larger its rounding, and that of the shares in the group.
        rounding = max(1e-9, 1e-13 * abs(log_weight))
        assert state_error(groups[vector][1], x, P) <= rounding
        assert covariance_error(groups[vector][2], P) <= rounding


def assert_same_moments(estimate: sf.RobustEstimate, expected: Mixture) -> None:
    n = len(estimate.x)
    assert state_error(estimate.x, expected.x[:n], expected.P[:n, :n]) <= 1e-10
    assert covariance_error(estimate.P, expected.P[:n, :n]) <= 1e-10
    found = estimate.fault_probability
    np.testing.assert_allclose(found, expected.fault_probability, rtol=1e-10, atol=1e-300)


def histories(
    scene: FaultScene, generator: Array, initial: Array, ends: tuple[float, ...] = ENDS
) -> list[carried.Carried]:
    return carried.run(
        scene.transition, scene.known, generator, scene.x0, scene.P0, scene.rows, ends, 0.0, initial
    )  # fmt: skip


@example(seed=4_294_967_295, name="three states", pair=4)  # modes of log-weight −5e4
@given(
    seed=st.integers(0, 2**32 - 1),
    name=st.sampled_from([*MODELS]),
    pair=st.integers(0, len(PAIRS) - 1),
)
def test_every_step_equals_all_histories(seed: int, name: str, pair: int) -> None:
    """From the stationary distribution; a bias begins, wanders and ends with its fault."""
    scene = scene_of(seed, name, pair)
    generator = scene.generator()
    filter, now = scene.filter(components=512), -1.0
    ends = ENDS[: 3 if len(generator) == 4 else 2]
    steps = histories(scene, generator, np.exp(scene.log_stationary()), ends)
    for step in steps:
        scene.push(filter, step.time, now)
        estimate, now = filter.estimate(step.time), step.time
        assert estimate.discarded_mass <= 1e-300
        assert_same_groups(filter, step.mixture)
        assert_same_moments(estimate, step.mixture)
        assert filter.log_likelihood == pytest.approx(step.mixture.log_evidence, rel=1e-11)


def test_four_steps_of_a_drift_that_comes_and_goes() -> None:
    """Two radars and one that drifts by 3 m/s in the second and third step."""
    drift = sf.Drifting(sigma=2.0, walk=0.5, rate=0.01, duration=2.0)
    sensors = tuple(sf.Sensor(f"s{i}", 0.3, faults=(drift,)) for i in range(2))
    rng, rows = np.random.default_rng(5), []
    for k, time in enumerate(np.arange(0.1, 3.2, 0.1)):
        bias = 3.0 * (0.8 < time <= 2.4) if k % 3 == 1 else 0.0
        rows.append((round(float(time), 1), int(k % 3 > 0), 10.0 + bias + 0.3 * rng.normal()))
    scene = random_scene(1, kinds=[(), ()])
    scene = replace(scene, sensors=sensors, x0=np.array([10.0, 0.0]), rows=tuple(rows))
    filter, now = scene.filter(components=256), -1.0
    for step in histories(scene, scene.generator(), np.exp(scene.log_stationary())):
        scene.push(filter, step.time, now)
        estimate, now = filter.estimate(step.time), step.time
        assert_same_groups(filter, step.mixture)
        assert_same_moments(estimate, step.mixture)


@given(
    seed=st.integers(0, 2**32 - 1),
    name=st.sampled_from([*MODELS]),
    pair=st.integers(0, len(PAIRS) - 1),
    prior=st.sampled_from(["chains", "constant"]),
)
def test_one_gaussian_is_moment_matching(seed: int, name: str, pair: int, prior: str) -> None:
    """The paper's recursion; the joint posterior of the modes is what the next step starts from,
    and drifts are drawn anew."""
    scene = scene_of(seed, name, pair)
    filter = scene.filter(carry="one", prior=prior)
    R = len(scene.generator())
    silent = replace(scene, rows=()).step(0.0, 1.0, scene.x0, scene.P0)
    constant = hypotheses.per_sensor(silent).log_weight
    x, P, posterior, now = scene.x0, scene.P0, np.zeros(R), 0.0
    value: dict[int, float] = {}
    for end in ENDS:
        if prior == "constant":
            log_prior = constant
        elif now == 0.0:
            log_prior = scene.log_stationary()
        else:
            log_prior = np.log(posterior @ mode_chain.transition(scene.generator(), end - now))
        last = tuple(value.get(s) for s in range(len(scene.sensors)))
        expected = hypotheses.per_sensor(scene.step(now, end, x, P, last), log_prior)
        scene.push(filter, end, now if now > 0.0 else -1.0)
        estimate = filter.estimate(end)
        found = filter.mixture()
        assert np.array_equal(found["modes"], expected.labels)
        np.testing.assert_allclose(found["log_weight"], expected.log_weight, rtol=1e-9, atol=1e-9)
        assert_same_moments(estimate, expected)
        value.update({s: z for t, s, z in scene.rows if t <= end})
        x, P, posterior, now = expected.x, expected.P, expected.weight, end


def test_merging_keeps_the_moments() -> None:
    """Over a step without measurements nothing but the merging could change them."""
    scene = scene_of(3, "speed, acceleration", 1)
    whole, small = scene.filter(components=64), scene.filter(carry="merge", components=4)
    for filter in (whole, small):
        scene.push(filter, 0.8)
        filter.estimate(0.8)
    one, other = whole.estimate(1.5), small.estimate(1.5)
    assert state_error(other.x, one.x, one.P) <= 1e-11
    assert covariance_error(other.P, one.P) <= 1e-11
    np.testing.assert_allclose(other.mode_probability, one.mode_probability, rtol=1e-11)
    assert other.discarded_mass == 0.0


COMMON: list[tuple[Any, Any]] = [
    (sf.CommonFault({"s0": "outage", "s1": "outage"}, 0.03), CommonEvent(0.03, {0: 1, 1: 1})),
    (sf.CommonFault({"s1": "drifting"}, 0.4), CommonEvent(0.4, {1: 2})),
    (
        sf.CommonFault({"s1": "drifting", "s0": "outage", "s2": "noisy"}, 1e-4),
        CommonEvent(1e-4, {0: 1, 1: 2, 2: 1}),
    ),
]


@pytest.mark.parametrize("count", [1, 2, 3])
@pytest.mark.parametrize("seed", range(2))
def test_common_faults_equal_the_joint_chain(count: int, seed: int) -> None:
    kinds = (("outage",), ("outage", "drifting"), ("noisy",))
    scene = random_scene(seed, kinds=kinds, measurements=6, duration=1.6)
    faults, events = zip(*COMMON[:count], strict=True)
    generator = scene.generator(events)
    filter, now = scene.filter(common=faults, components=144), -1.0
    for step in histories(scene, generator, mode_chain.stationary(generator), ENDS[:2]):
        scene.push(filter, step.time, now)
        estimate, now = filter.estimate(step.time), step.time
        assert_same_moments(estimate, step.mixture)
        assert filter.log_likelihood == pytest.approx(step.mixture.log_evidence, rel=1e-10)


def settled(rate: float, duration: float, **options: Any) -> sf.RobustFilter:
    """At 1 s surely healthy."""
    fault = sf.Outage(span=1e12, rate=rate, duration=duration)
    sensors = [sf.Sensor(name, 1.0, faults=(fault,)) for name in "ab"]
    filter = sf.RobustFilter(
        sf.ConstantVelocity(0.1), sensors, [0.0], [[1.0]], start=0.0, cut=0.0, **options
    )
    for time in (0.2, 0.4, 0.6, 0.8):
        for name in "ab":
            filter.push(time, name, 0.1)
    filter.estimate(1.0)
    return filter


@pytest.mark.parametrize("options", [{"carry": "cut"}, {"carry": "one"}, {"carry": "merge"}])
@pytest.mark.parametrize("dt", [0.0, 1e-9, 1e-3, 1.0, 60.0, 3600.0, 1e6, 1e9])
@pytest.mark.parametrize(("rate", "duration"), [(1e-3, 10.0), (0.7, 0.3), (1e-9, 1e6), (1e-12, 1)])
def test_without_measurements_the_modes_follow_the_chain(
    rate: float, duration: float, dt: float, options: dict[str, Any]
) -> None:
    """P(faulty) = πₓ (1 − e^(−(λ + 1/d) Δt)) from healthy, with all its digits."""
    filter = settled(rate, duration, **options)
    p = by_hypothesis(filter)
    filter.estimate(1.0 + dt)
    speed = rate + 1.0 / duration
    fail = -np.expm1(-speed * round(dt, 9)) * rate / speed
    heal = -np.expm1(-speed * round(dt, 9)) / (duration * speed)
    T = np.array([[1.0 - fail, fail], [heal, 1.0 - heal]])
    np.testing.assert_allclose(by_hypothesis(filter), p @ np.kron(T, T), rtol=1e-11, atol=1e-300)


def by_hypothesis(filter: sf.RobustFilter) -> Array:
    """Posterior (4,) of both healthy, b out, a out, both out."""
    found, p = filter.mixture(), np.zeros(4)
    np.add.at(p, found["modes"] @ [2, 1], np.exp(found["log_weight"]))
    return p


@pytest.mark.parametrize("dt", [0.0, 1e-9, 0.1, 10.0, 1e6])
def test_chain_of_many_modes_is_the_matrix_exponential(dt: float) -> None:
    kinds = (("outage", "noisy", "interrupted", "drifting"), ("frozen", "outage"))
    scene = random_scene(11, kinds=kinds, measurements=6)
    filter = scene.filter(components=256)
    scene.push(filter)
    filter.estimate(1.0)
    before, G = filter.mixture(), scene.generator()
    filter.estimate(1.0 + dt)
    after = filter.mixture()
    groups = by_modes(after["modes"], after["log_weight"], after["x"], after["P"])
    if dt < 1e3:
        expected = np.exp(before["log_weight"]) @ mode_chain.transition(G, dt)
    else:  # after ten thousand faults; here expm is right to 1e-9 only
        expected = np.exp(scene.log_stationary())
    for k, vector in enumerate(before["modes"]):
        found = groups.get(tuple(vector.tolist()))
        if found is not None:
            assert np.exp(found[0]) == pytest.approx(expected[k], rel=1e-11, abs=1e-15)


def test_most_probable_hypothesis_is_that_of_all_its_histories() -> None:
    """Not the modes of the heaviest history: those may be less probable than others."""
    kinds = (("drifting", "outage"), ("drifting",))
    scene = random_scene(392, kinds=kinds, measurements=20, duration=4.0)
    filter, now = scene.filter(carry="merge", cut=1e-14), -1.0
    for end in (1.0, 2.0, 3.0, 4.0):
        scene.push(filter, end, now)
        estimate, now = filter.estimate(end), end
        found = filter.mixture()
        groups = by_modes(found["modes"], found["log_weight"], found["x"], found["P"])
        best = max(groups, key=lambda vector: groups[vector][0])
        names = tuple(filter.mode_names[s][m] for s, m in enumerate(best))
        assert estimate.hypothesis == names, end
