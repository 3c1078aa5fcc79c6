"""Streaming: the bits of the batch, whatever comes, in whatever order."""

from __future__ import annotations

from math import inf, nan
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import surefix as sf
from robust.scenes import (
    CARRIES,
    FIELDS,
    KINDS,
    MODELS,
    FaultScene,
    bits,
    frozen,
    make,
    random_scene,
)


def assert_same_run(
    filter: sf.RobustFilter, estimates: list[sf.RobustEstimate], result: sf.RobustResult
) -> None:
    """Every field, every bit."""
    assert len(estimates) == len(result.time)
    for k, estimate in enumerate(estimates):
        assert estimate.time == result.time[k]
        for name in FIELDS:
            one, other = np.asarray(getattr(estimate, name)), np.asarray(getattr(result, name)[k])
            assert one.tobytes() == other.astype(one.dtype).tobytes(), name
        names = tuple(result.mode_names[s][m] for s, m in enumerate(result.hypothesis[k]))
        assert estimate.hypothesis == names
    assert filter.log_likelihood == result.log_likelihood


def stream(
    scene: FaultScene, filter: sf.RobustFilter, times: list[float], seed: int
) -> list[sf.RobustEstimate]:
    """Each step's rows pushed in an order of their own."""
    rng, now, estimates = np.random.default_rng(seed), -1.0, []
    for end in times:
        mine = [row for row in scene.rows if now < row[0] <= end]
        for i in rng.permutation(len(mine)):
            valid, s, value = mine[i]
            stamp = round(valid + scene.sensors[s].latency, 9)
            assert filter.push(stamp, scene.sensors[s].name, value).name == "ok"
        estimates.append(filter.estimate(end))
        now = end
    return estimates


PAIRS = (
    (("drifting",), ("outage",)),
    (("drifting", "frozen"), ("drifting",)),
    (("outage", "interrupted"), ("frozen",), ("noisy",)),
    (KINDS,),
    ((), ("drifting", "outage")),
)
SCENES = st.builds(
    random_scene,
    st.integers(0, 2**32 - 1),
    st.sampled_from([*MODELS]),
    st.sampled_from(PAIRS),
    measurements=st.integers(1, 30),
    duration=st.just(4.0),
)
OPTIONS = st.fixed_dictionaries(
    {"carry": st.sampled_from(CARRIES), "components": st.sampled_from([1, 5, 24])},
    optional={"prior": st.just("constant"), "max_faults": st.just(1), "cut": st.just(1e-14)},
)


@given(scene=SCENES, options=OPTIONS, rate=st.sampled_from([1.0, 2.5, 10.0]), seed=st.integers())
def test_stream_has_the_bits_of_the_batch(
    scene: FaultScene, options: dict[str, Any], rate: float, seed: int
) -> None:
    result = scene.filter(**options).run(scene.log, rate=rate)
    filter = scene.filter(**options)
    assert_same_run(filter, stream(scene, filter, result.time.tolist(), seed % 2**32), result)
    assert set(result.counts) == {"ok"}
    assert len(result.time) - 1 >= result.step.max() >= 0


@given(scene=SCENES, options=OPTIONS)
def test_batch_at_every_measurement_has_the_bits_of_the_stream(
    scene: FaultScene, options: dict[str, Any]
) -> None:
    """Without a start, too: the first measurement is it."""
    result = scene.filter(**options, start=None).run(scene.log)
    assert result.time.tolist() == [t for t, _, _ in scene.rows]
    filter = scene.filter(**options, start=None)
    assert_same_run(filter, stream(scene, filter, result.time.tolist(), 0), result)


@given(scene=SCENES, options=OPTIONS, seed=st.integers(0, 1000))
def test_order_of_the_rows_changes_no_bit(
    scene: FaultScene, options: dict[str, Any], seed: int
) -> None:
    order = np.random.default_rng(seed).permutation(len(scene.rows))
    log = scene.log
    names = [scene.sensors[scene.rows[i][1]].name for i in order]
    stamps, values = (np.array(column)[order] for column in (log.stamp / 1e9, log.value))
    one = scene.filter(**options).run(log, rate=2.0)
    other = scene.filter(**options).run(sf.Log(stamps, names, values), rate=2.0)
    for name in (*FIELDS, "time", "hypothesis"):
        assert np.array_equal(getattr(one, name), getattr(other, name)), name
    assert np.array_equal(one.status[order], other.status)
    assert np.array_equal(one.step[order], other.step)
    assert np.array_equal(one.rejected[order], other.rejected)


WRONG: list[tuple[float, str, Any, str]] = [
    (0.3, "a", nan, "not_finite"),
    (0.3, "a", inf, "not_finite"),
    (0.3, "a", 1.1e30, "not_finite"),
    (0.3, "b", -1e300, "not_finite"),
    (nan, "a", 20.0, "not_finite"),
    (4e9, "a", 20.0, "not_finite"),
    (0.3, "nobody", 20.0, "unknown_sensor"),
    (-0.1, "a", 20.0, "too_late"),
    (0.2, "b", 20.0, "too_late"),  # valid at −0.05
    (-0.1, "a", 1e31, "not_finite"),
    (0.4, "a", 20.2, "repeated"),
]
GOOD = [(0.4, "a", 20.2), (0.5, "b", 19.9), (0.9, "a", 20.1)]


@pytest.mark.parametrize(("time", "sensor", "value", "status"), WRONG)
def test_what_cannot_be_used_is_counted_and_changes_no_bit(
    time: float, sensor: str, value: float, status: str
) -> None:
    plain, disturbed = make(), make()
    for row in GOOD:
        assert plain.push(*row).name == disturbed.push(*row).name == "ok"
    assert disturbed.push(time, sensor, value).name == status
    assert disturbed.counters[status] == 1
    expected = plain.estimate(1.0)
    assert bits(disturbed.estimate(1.0)) == bits(expected)
    log = sf.Log(*zip(*GOOD, (time, sensor, value), strict=True))
    result = make().run(log, times=[1.0])
    assert result.counts == {"ok": 3, status: 1}
    assert_same_run(plain, [expected], result)
    assert result.step.tolist() == [0, 0, 0, -1]


@pytest.mark.parametrize("value", [nan, 1e31])
def test_unusable_value_is_no_start_and_no_estimate(value: float) -> None:
    """Without a start, the first measurement that can be used is it."""
    log = sf.Log([0.1, 0.4, 0.9, 1.0], ["a", "a", "a", "a"], [value, 20.2, 20.1, value])
    result = make(start=None).run(log)
    assert result.time.tolist() == [0.4, 0.9]
    filter = make(start=None)
    assert filter.push(0.1, "a", value).name == "not_finite"
    estimates = []
    for time, z in ((0.4, 20.2), (0.9, 20.1)):
        filter.push(time, "a", z)
        estimates.append(filter.estimate(time))
    assert_same_run(filter, estimates, result)
    filter = make(start=None)
    filter.push(0.4, "a", 20.2)
    filter.push(0.9, "a", 20.1)
    at_a_rate = make(start=None).run(log, rate=0.5)
    assert_same_run(filter, [filter.estimate(at_a_rate.time[0])], at_a_rate)


def test_late_measurements_are_not_used() -> None:
    filters = [make() for _ in range(2)]
    for filter in filters:
        filter.push(0.3, "a", 20.0)
        filter.estimate(0.5)
    assert filters[0].push(0.5, "a", 99.0).name == "too_late"
    assert filters[0].push(0.75, "b", 99.0).name == "too_late"
    for filter in filters:
        assert filter.push(0.750000001, "b", 20.3).name == "ok"
    one, other = (filter.estimate(1.0) for filter in filters)
    assert bits(one) == bits(other)
    log = sf.Log([0.3, 1.0, 1.24, 1.3], ["a", "b", "b", "b"], [20.0, 20.3, 99.0, 20.2])
    result = make().run(log, times=[0.5, 1.0, 2.0], delay=0.2)  # the third is valid at 0.99
    assert result.counts == {"ok": 3, "too_late": 1}
    assert result.step.tolist() == [0, 1, -1, 2]
    without = make().run(sf.Log([0.3, 1.0, 1.3], ["a", "b", "b"], [20.0, 20.3, 20.2]),
                         times=[0.5, 1.0, 2.0])  # fmt: skip
    assert np.array_equal(result.x, without.x)
    assert np.array_equal(result.upper, without.upper)


@pytest.mark.parametrize("carry", CARRIES)
def test_discrete_model_leaves_out_what_no_period_leads_to(carry: str) -> None:
    model = sf.DiscreteModel(0.99 * np.eye(1), 0.05 * np.eye(1), period=0.05)
    rows = [(0.1, 20.0), (0.12, 99.0), (0.2, 20.1), (0.3, 19.9)]
    log = sf.Log([t for t, _ in rows], ["a"] * 4, [z for _, z in rows])
    result = make(model, carry=carry).run(log, times=[0.5, 1.0])
    assert result.counts == {"ok": 3, "off_grid": 1}
    assert result.step.tolist() == [0, -1, 0, 0]
    filter, clean = make(model, carry=carry), make(model, carry=carry)
    for t, z in rows:
        assert filter.push(t, "a", z).name == "ok"
        if z < 99.0:
            clean.push(t, "a", z)
    before = frozen(filter.save())
    with pytest.raises(sf.ConfigError, match=r"no estimate at 0\.42 s: off_grid"):
        filter.estimate(0.42)
    assert frozen(filter.save()) == before
    estimates = [filter.estimate(t) for t in (0.5, 1.0)]
    assert_same_run(filter, estimates, result)
    assert [bits(e) for e in estimates] == [bits(clean.estimate(t)) for t in (0.5, 1.0)]
    assert filter.counters["off_grid"] == 2  # the row, and the request
    every = make(model, carry=carry).run(log)
    assert every.time.tolist() == [0.1, 0.2, 0.3]


@pytest.mark.parametrize("carry", CARRIES)
def test_gap_of_a_year(carry: str) -> None:
    """The limits open, the modes are what they are in the long run, and the filter goes on."""
    year, log = 365.25 * 86400.0, [(0.4, "a", 20.2), (0.6, "b", 20.0)]
    filter = make(sf.ConstantVelocity(0.1), carry=carry)
    for row in log:
        filter.push(*row)
    first = filter.estimate(1.0)
    late = [(year + 0.4, "a", 80.2), (year + 0.6, "b", 80.0)]
    for row in late:
        assert filter.push(*row).name == "ok"
    silent = filter.estimate(year)
    p = np.array([1.0, 0.01, 0.02]) / 1.03
    np.testing.assert_allclose(silent.mode_probability[0], p, rtol=1e-9)
    np.testing.assert_allclose(silent.mode_probability[1, :2], [1 / 1.01, 0.01 / 1.01], rtol=1e-9)
    assert silent.upper - silent.lower > 600.0 * 6.8
    last = filter.estimate(year + 1.0)
    assert last.x[0] == pytest.approx(80.0, abs=0.5)
    assert last.hypothesis == ("healthy", "healthy")
    times = [1.0, year, year + 1.0]
    result = make(sf.ConstantVelocity(0.1), carry=carry).run(
        sf.Log(*zip(*log, *late, strict=True)), times=times
    )
    assert_same_run(filter, [first, silent, last], result)


def test_failed_estimate_changes_nothing() -> None:
    """Before the last one, or where the state overflows; what waits goes on waiting."""
    model = sf.LinearModel(np.eye(1), np.eye(1), np.eye(1))
    filter, twin = make(model), make(model)
    for f in (filter, twin):
        f.push(0.1, "a", 20.0)
        f.estimate(0.5)
        f.push(0.9, "a", 30.0)
    before, mixture = frozen(filter.save()), repr(filter.mixture())
    with pytest.raises(sf.ConfigError, match=r"no estimate at 0\.4 s: time_backwards"):
        filter.estimate(0.4)
    with pytest.raises(sf.NumericalError, match=r"no estimate at 2000\.0 s: numerical"):
        filter.estimate(2000.0)
    assert frozen(filter.save()) == before
    assert repr(filter.mixture()) == mixture
    assert bits(filter.estimate(1.0)) == bits(twin.estimate(1.0))
    assert filter.log_likelihood == twin.log_likelihood


def test_streaming_does_not_change_what_run_gives() -> None:
    log = sf.Log([0.4, 0.9], ["a", "a"], [20.2, 20.1])
    fresh, used = make(), make()
    used.push(0.1, "a", 10.0)
    used.estimate(1.0)
    before = frozen(used.save())
    one, other = fresh.run(log, rate=5.0), used.run(log, rate=5.0)
    for name in FIELDS:
        assert np.array_equal(getattr(one, name), getattr(other, name)), name
    assert frozen(used.save()) == before


@pytest.mark.parametrize("hypotheses", ["sensor", "measurement"])
def test_measurements_of_a_step_have_the_bits_of_the_batch(hypotheses: str) -> None:
    """Noise, outlier probability and the number of the push, in order of validity."""
    kinds = (("drifting", "frozen"), ("outage",)) if hypotheses == "sensor" else (("outage",),) * 2
    case = random_scene(5, kinds=kinds, measurements=14)
    options: dict[str, Any] = {"hypotheses": hypotheses, "prior": "constant", "carry": "one"}
    if hypotheses == "measurement":
        options["components"] = 1
    filter, times = case.filter(**options), [0.5, 1.0]
    result = case.filter(**options).run(case.log, times=times)
    latency = {sensor.name: sensor.latency for sensor in case.sensors}
    valid = case.log.time - [latency[name] for name in case.log.sensor]
    for t, s, z in case.rows:  # pushed in order of validity: the number is the row's place
        sensor = case.sensors[s]
        assert filter.push(round(t + sensor.latency, 9), sensor.name, z).name == "ok"
    for k, time in enumerate(times):
        estimate = filter.estimate(time)
        rows = np.flatnonzero(result.step == k)
        rows = rows[np.argsort(valid[rows], kind="stable")]
        assert len(estimate.noise_id) == len(rows) > 0
        assert np.array_equal(np.array([case.rows[i][2] for i in estimate.noise_id]),
                              case.log.value[rows])  # fmt: skip
        if hypotheses == "sensor":
            assert estimate.noise.tobytes() == result.noise[rows].tobytes()
            assert estimate.noise_variance.tobytes() == result.noise_variance[rows].tobytes()
            assert np.isnan(estimate.outlier_probability).all()
        else:
            assert (
                estimate.outlier_probability.tobytes() == result.outlier_probability[rows].tobytes()
            )
            assert np.isnan(estimate.noise).all()
        np.testing.assert_array_equal(estimate.fault_probability, result.fault_probability[k])
        names = [result.mode_names[s][m] for s, m in enumerate(result.hypothesis[k])]
        assert estimate.hypothesis == tuple(names)
    assert len(filter.estimate(2.0).noise_id) == 0


@pytest.mark.parametrize("hypotheses", ["sensor", "measurement"])
def test_tiny_noise_keeps_its_likelihood(hypotheses: str) -> None:
    """S of 4e-308: the product of two is no normal number, the sum of their logarithms is."""
    outage = sf.Outage(span=1.0, probability=1e-6)
    sensors = [sf.Sensor(name, 2e-154, faults=(outage,)) for name in "ab"]
    filter = sf.RobustFilter(
        sf.ConstantAcceleration(0.0), sensors, [0.0, 0.0], np.zeros((2, 2)), start=0.0,
        hypotheses=hypotheses, carry="one",
    )  # fmt: skip
    filter.push(0.5, "a", 0.0)
    filter.push(0.5, "b", 0.0)
    filter.estimate(1.0)
    expected = 308 * np.log(10) - np.log(2 * np.pi) - np.log(4.0)  # S = 4e-308, twice
    assert filter.log_likelihood == pytest.approx(expected + 2 * np.log1p(-1e-6), rel=1e-6)
