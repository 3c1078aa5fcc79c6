"""Streaming: the bits of the batch, whatever comes, in whatever order."""

from __future__ import annotations

import math
import pickle
from dataclasses import replace
from math import inf, nan
from typing import Any, ClassVar

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    initialize,
    invariant,
    precondition,
    rule,
    run_state_machine_as_test,
)

import surefix as sf
from desync.scenes import Scene, random_scene, scenes
from oracle.compare import covariance_error, state_error
from oracle.sensors import nanoseconds

WHEEL = sf.Sensor("wheel", 0.5)
RADAR = sf.Sensor("radar", 0.2, latency=0.25)
BIASED = sf.Sensor("biased", 0.3, bias_sigma=0.4, bias_time=3.0, latency=-0.05)
SCALED = sf.Sensor("scaled", 0.3, scale_sigma=0.02)
SPEED = sf.ConstantAcceleration(jerk=0.3)
SYSTEMS: dict[str, tuple[sf.Model, tuple[sf.Sensor, ...]]] = {
    "fixed size": (SPEED, (WHEEL, RADAR)),
    "sensor states": (SPEED, (WHEEL, BIASED, SCALED)),
    "one state": (sf.ConstantVelocity(0.7), (RADAR, BIASED)),
    "discrete": (sf.DiscreteModel(0.99 * np.eye(1), 0.05 * np.eye(1), period=0.05), (WHEEL, RADAR)),
}


AHEAD = st.sampled_from([*range(1, 31), 0, 0, -1, -4])  # periods of the discrete model


def make(system: str, start: float | None = 0.0, **options: Any) -> sf.DesyncFilter:
    model, sensors = SYSTEMS[system]
    n = model.size
    x0 = 20.0 * np.eye(n)[model.output]
    return sf.DesyncFilter(model, sensors, x0, 4.0 * np.eye(n), start=start, **options)


def frozen(saved: dict[str, Any]) -> str:
    """All of a saved filter, to the last bit, in a form that compares."""
    with np.printoptions(precision=17, floatmode="unique", threshold=10**6):
        return repr(sorted(saved.items()))


def assert_same_estimate(one: sf.Estimate, other: sf.Estimate) -> None:
    assert (one.time, one.sse, one.degrees_of_freedom) == (
        other.time,
        other.sse,
        other.degrees_of_freedom,
    )
    for name in ("x", "P", "noise_id", "noise", "noise_variance"):
        assert np.array_equal(getattr(one, name), getattr(other, name)), name


class Stream(RuleBasedStateMachine):
    """Pushes, estimates and restores in any order; beside it, what should have become of each."""

    names: ClassVar[list[str]] = list(SYSTEMS)

    @initialize(system=st.sampled_from(names), bound=st.booleans(), capacity=st.integers(3, 60))
    def begin(self, system: str, bound: bool, capacity: int) -> None:
        self.system, self.capacity = system, capacity
        self.start = 0.0 if bound else None
        self.filter = make(system, self.start, capacity=capacity)
        self.sensors = self.filter.sensors
        self.pushes = 0
        self.failures = 0
        self.accepted: list[tuple[float, str, float]] = []
        self.accepted_ids: list[int] = []
        self.waiting: list[tuple[int, str, float]] = []  # validity, sensor, value
        self.estimates: list[sf.Estimate] = []
        self.now = 0  # ns: of the last estimate, or the start

    def valid(self, stamp: float, name: str) -> int:
        latency = next(s.latency for s in self.sensors if s.name == name)
        return nanoseconds(stamp) - nanoseconds(latency)

    def expected(self, stamp: float, name: str, value: float) -> str:
        if name not in [s.name for s in self.sensors]:
            return "unknown_sensor"
        if not (math.isfinite(stamp) and math.isfinite(value)) or abs(stamp) > 3e9:
            return "not_finite"
        valid = self.valid(stamp, name)
        started = bool(self.estimates) or self.start is not None
        if started and valid < self.now + (1 if self.estimates else 0):
            return "too_late"
        if (valid, name, value) in self.waiting:
            return "repeated"
        return "buffer_full" if len(self.waiting) == self.capacity else "ok"

    def push(self, stamp: float, name: str, value: float) -> None:
        expected = self.expected(stamp, name, value)
        waiting = repr(self.filter.save()["waiting"])
        assert self.filter.push(stamp, name, value).name == expected
        if expected == "ok":
            self.accepted.append((stamp, name, value))
            self.accepted_ids.append(self.pushes)
            self.waiting.append((self.valid(stamp, name), name, value))
        else:
            assert repr(self.filter.save()["waiting"]) == waiting
        self.pushes += 1

    @rule(data=st.data(), rows=st.lists(st.tuples(AHEAD, st.floats(15.0, 25.0)), max_size=12))
    def push_in_any_order(self, data: st.DataObject, rows: list[tuple[int, float]]) -> None:
        """Within the step and a little before it; on the grid of the discrete model."""
        for ahead, value in rows:
            sensor = data.draw(st.sampled_from(self.sensors))
            stamp = round(self.now / 1e9 + 0.05 * ahead + sensor.latency, 9)
            self.push(stamp, sensor.name, round(value, 2))

    @rule(ahead=AHEAD)
    def push_of_nobody(self, ahead: int) -> None:
        self.push(round(self.now / 1e9 + 0.05 * ahead, 9), "nobody", 20.0)

    @precondition(lambda self: self.waiting)
    @rule(data=st.data(), other=st.booleans())
    def push_again(self, data: st.DataObject, other: bool) -> None:
        """The same message twice, or the same stamp with another value."""
        stamp, name, value = data.draw(st.sampled_from(self.accepted))
        self.push(stamp, name, value + 0.5 if other else value)

    @rule(
        stamp=st.sampled_from([0.5, nan, inf, -inf, 4e9, -4e9, 1e300]),
        value=st.sampled_from([20.0, nan, inf, -inf]),
        data=st.data(),
    )
    def push_what_is_no_number(self, stamp: float, value: float, data: st.DataObject) -> None:
        if not (math.isfinite(value) and abs(stamp) <= 3e9):
            self.push(stamp, data.draw(st.sampled_from(self.sensors)).name, value)

    @rule(
        data=st.data(),
        rows=st.lists(st.tuples(AHEAD, st.floats(15.0, 25.0)), max_size=6),
        periods=st.integers(0, 20),
    )
    def push_and_estimate(
        self, data: st.DataObject, rows: list[tuple[int, float]], periods: int
    ) -> None:
        self.push_in_any_order(data, rows)
        time = round(self.now / 1e9 + 0.05 * periods, 9)
        self.estimates.append(self.filter.estimate(time))
        self.now = nanoseconds(time)
        self.waiting = [m for m in self.waiting if m[0] > self.now]

    @precondition(lambda self: self.estimates)
    @rule(back=st.floats(1e-9, 1e3))
    def estimate_in_the_past(self, back: float) -> None:
        before = self.filter.save()
        counted = before.pop("counters")
        with pytest.raises(sf.ConfigError, match="time_backwards"):
            self.filter.estimate(self.now / 1e9 - max(back, 2e-9))
        after = self.filter.save()
        assert np.sum(after.pop("counters")) == np.sum(counted) + 1  # a request is counted too
        assert frozen(after) == frozen(before)
        self.failures += 1

    @rule(way=st.sampled_from(["restore", "pickle"]))
    def continue_elsewhere(self, way: str) -> None:
        saved = self.filter.save()
        if way == "pickle":
            self.filter = pickle.loads(pickle.dumps(self.filter))
        else:
            self.filter = make(self.system, self.start, capacity=self.capacity)
            self.filter.restore(saved)
        assert frozen(self.filter.save()) == frozen(saved)

    @invariant()
    def every_push_is_counted(self) -> None:
        if not hasattr(self, "filter"):
            return
        counters = self.filter.counters
        assert sum(counters.values()) == self.pushes + self.failures
        assert counters["ok"] == len(self.accepted)
        assert counters["time_backwards"] == self.failures

    def teardown(self) -> None:
        """The batch over what was accepted gives the same bits."""
        if not getattr(self, "accepted", []) or not self.estimates:
            return
        start = self.start
        if start is None:  # where the first step started
            valid = [self.valid(stamp, name) for stamp, name, _ in self.accepted]
            first = nanoseconds(self.estimates[0].time)
            start = min([first, *valid]) / 1e9
        filter = make(self.system, start)
        time, sensor, value = zip(*self.accepted, strict=True)
        log = sf.Log(time, sensor, value)
        result = filter.run(log, times=[e.time for e in self.estimates])
        assert set(result.counts) <= {"ok", "waiting"}
        assert result.counts.get("waiting", 0) == len(self.waiting)
        for k, estimate in enumerate(self.estimates):
            assert np.array_equal(estimate.x, result.x[k])
            assert np.array_equal(estimate.P, result.P[k])
            assert estimate.sse == result.sse[k]
            assert estimate.degrees_of_freedom == result.degrees_of_freedom[k]
            assert (estimate.lower, estimate.upper) == (result.lower[k], result.upper[k])
            rows = [self.accepted_ids.index(i) for i in estimate.noise_id.tolist()]
            assert np.array_equal(estimate.noise, result.noise[rows])
            assert np.array_equal(estimate.noise_variance, result.noise_variance[rows])
        assert self.filter.log_likelihood == result.log_likelihood
        assert result.degrees_of_freedom.sum() == len(self.accepted) - len(self.waiting)


def test_stream_has_the_bits_of_the_batch() -> None:
    run_state_machine_as_test(Stream)


@given(scene=scenes(), seed=st.integers(0, 1000), rate=st.sampled_from([1, 2, 5, 10]))
def test_whole_log_streamed_has_the_bits_of_the_batch(scene: Scene, seed: int, rate: int) -> None:
    """Each step's rows pushed in an order of their own."""
    rng, filter = np.random.default_rng(seed), scene.filter
    result = scene.filter.run(scene.log, rate=float(rate))
    left = list(scene.rows)
    for k, time in enumerate(result.time.tolist()):
        mine = [r for r in left if round(r[0] - scene.sensors[r[1]].latency, 9) <= time]
        left = [r for r in left if r not in mine]
        for i in rng.permutation(len(mine)):
            stamp, sensor, value = mine[i]
            assert filter.push(stamp, scene.sensors[sensor].name, value).name == "ok"
        estimate = filter.estimate(time)
        assert np.array_equal(estimate.x, result.x[k])
        assert np.array_equal(estimate.P, result.P[k])
        assert estimate.sse == result.sse[k]
    assert filter.log_likelihood == result.log_likelihood


@pytest.mark.parametrize("stamp", [nan, -inf, 3.1e9])
@pytest.mark.parametrize("start", [None, 0.0])
@pytest.mark.parametrize("latency", [0.0, 0.25])
def test_time_that_is_no_time_is_answered(
    stamp: float, start: float | None, latency: float
) -> None:
    """Before the first estimate and after it, whatever the latency; and nothing else changes."""
    sensor = sf.Sensor("w", 0.5, latency=latency)
    filters = [
        sf.DesyncFilter(SPEED, [sensor], [20.0, 0.0], np.eye(2), start=start) for _ in range(2)
    ]
    for time in (1.0, 2.0):
        assert filters[0].push(stamp, "w", 20.0).name == "not_finite"
        for filter in filters:
            assert filter.push(time, "w", 20.5).name == "ok"
        one, other = (filter.estimate(time + 0.5) for filter in filters)
        assert np.array_equal(one.x, other.x)
        assert np.array_equal(one.P, other.P)
    assert filters[0].counters["not_finite"] == 2


def test_late_within_the_step_has_the_same_bits() -> None:
    filters = [make("sensor states") for _ in range(2)]
    rows = [
        (0.1, "wheel", 20.1),
        (0.2, "biased", 20.4),
        (0.2, "scaled", 20.2),
        (0.3, "wheel", 19.8),
    ]
    for row in rows:
        filters[0].push(*row)
    for row in reversed(rows):
        filters[1].push(*row)
    one, other = (filter.estimate(0.5) for filter in filters)
    assert np.array_equal(one.x, other.x)
    assert np.array_equal(one.P, other.P)
    assert one.noise_id.tolist() == [0, 2, 1, 3]  # in order of validity: biased reads early
    assert other.noise_id.tolist() == [3, 1, 2, 0]
    assert np.array_equal(one.noise, other.noise)


def test_too_late_is_counted_and_not_used() -> None:
    filters = [make("fixed size") for _ in range(2)]
    for filter in filters:
        filter.push(0.3, "wheel", 20.0)
        filter.estimate(0.5)
    assert filters[0].push(0.5, "wheel", 99.0).name == "too_late"  # at the last estimate
    assert filters[0].push(0.74, "radar", 99.0).name == "too_late"  # valid at 0.49
    assert filters[0].push(0.75, "radar", 99.0).name == "too_late"  # valid at 0.5
    assert filters[0].counters["too_late"] == 3
    for filter in filters:
        assert filter.push(0.750000001, "radar", 20.3).name == "ok"
    one, other = (filter.estimate(1.0) for filter in filters)
    assert one.degrees_of_freedom == 1
    assert np.array_equal(one.x, other.x)


def test_full_buffer_is_answered_and_empties() -> None:
    filter = make("fixed size", capacity=2)
    assert filter.push(0.1, "wheel", 20.0).name == "ok"
    assert filter.push(0.1, "wheel", 20.0).name == "repeated"
    assert filter.push(0.3, "wheel", 20.2).name == "ok"
    assert filter.push(0.2, "wheel", 20.1).name == "buffer_full"
    assert filter.push(0.3, "wheel", 20.2).name == "repeated"
    assert filter.estimate(0.1).degrees_of_freedom == 1
    assert filter.push(0.2, "wheel", 20.1).name == "ok"
    assert filter.estimate(0.4).degrees_of_freedom == 2
    assert filter.counters == {
        **dict.fromkeys(filter.counters, 0),
        "ok": 3,
        "repeated": 2,
        "buffer_full": 1,
    }


def test_estimate_without_measurements_is_a_prediction() -> None:
    filter = make("fixed size")
    estimate = filter.estimate(2.0)
    F, Q = SPEED.transition(2.0)
    np.testing.assert_allclose(estimate.x, F @ filter.x0, rtol=1e-15)
    np.testing.assert_allclose(estimate.P, F @ filter.P0 @ F.T + Q, rtol=1e-15)
    assert estimate.degrees_of_freedom == 0
    assert estimate.sse == 0.0
    assert math.isnan(estimate.p_value)
    assert filter.log_likelihood == 0.0


def test_interval_is_centred_on_the_output_at_the_risk() -> None:
    filter = make("fixed size", risk=1e-3)
    filter.push(0.1, "wheel", 20.0)
    estimate = filter.estimate(0.2)
    width = sf.two_sided_quantile(1e-3) * math.sqrt(estimate.P[0, 0])
    assert estimate.lower == pytest.approx(estimate.x[0] - width, rel=1e-15)
    assert estimate.upper == pytest.approx(estimate.x[0] + width, rel=1e-15)
    assert estimate.p_value == float(sf.chi_squared_p_value(estimate.sse, 1))


def failing() -> tuple[sf.DesyncFilter, float, type[Exception]]:
    """A filter, and the time of an estimate that overflows."""
    model = sf.LinearModel(np.eye(1), np.eye(1), np.eye(1))
    filter = sf.DesyncFilter(model, [sf.Sensor("w", 1.0)], [1.0], [[1.0]], start=0.0)
    return filter, 2000.0, sf.NumericalError


def off_grid() -> tuple[sf.DesyncFilter, float, type[Exception]]:
    return make("discrete"), 0.72, sf.ConfigError


@pytest.mark.parametrize("case", [failing, off_grid])
def test_failing_estimate_changes_nothing(case: Any) -> None:
    """Only that it is counted. Measurements of the step wait, and the next estimate uses them."""
    filter, time, error = case()
    twin, _, _ = case()
    name = filter.sensors[0].name
    for f in (filter, twin):
        for stamp, value in ((0.1, 20.0), (0.3, 20.2), (0.9, 20.3)):
            f.push(stamp, name, value)
    before = filter.save()
    with pytest.raises(error, match=f"no estimate at {time} s: "):
        filter.estimate(time)
    after = filter.save()
    assert np.sum(after.pop("counters")) == np.sum(before.pop("counters")) + 1
    assert frozen(after) == frozen(before)
    assert_same_estimate(filter.estimate(1.0), twin.estimate(1.0))


@pytest.mark.parametrize("time", [nan, inf, -inf, 4e9, "now"])
def test_estimate_at_no_time_is_refused(time: float) -> None:
    filter = make("fixed size")
    before = frozen(filter.save())
    with pytest.raises(sf.ConfigError, match=f"time: expected .*got {time!r}"):
        filter.estimate(time)
    assert frozen(filter.save()) == before


def test_reading_between_the_periods_is_counted_when_it_is_reached() -> None:
    filter = make("discrete")
    assert filter.push(0.12, "wheel", 99.0).name == "ok"
    assert filter.push(0.2, "wheel", 20.0).name == "ok"
    assert filter.estimate(0.5).degrees_of_freedom == 1
    assert filter.counters["off_grid"] == 1


# Sensors that come and go.


def streamed(filter: sf.DesyncFilter, rows: list[tuple[float, str, float]], time: float) -> None:
    for row in rows:
        assert filter.push(*row).name == "ok"
    filter.estimate(time)


FIRST = [(0.1, "wheel", 20.1), (0.4, "radar", 20.3), (0.6, "wheel", 19.9)]
SECOND = [(1.1, "wheel", 20.2), (1.4, "radar", 20.1), (1.6, "wheel", 20.4)]


@pytest.mark.parametrize("added", [sf.Sensor("plain", 1.0), BIASED, SCALED])
@pytest.mark.parametrize("system", ["fixed size", "sensor states"])
def test_adding_and_removing_an_unused_sensor_changes_no_bit(system: str, added: sf.Sensor) -> None:
    if added.name in [sensor.name for sensor in SYSTEMS[system][1]]:
        added = replace(added, name="another")
    plain, changed = make(system), make(system)
    name = plain.sensors[1].name
    first, second = ([(t, s.replace("radar", name), z) for t, s, z in r] for r in (FIRST, SECOND))
    for filter in (plain, changed):
        streamed(filter, first, 1.0)
        for row in second:
            filter.push(*row)
    changed.add_sensor(added)
    assert changed.state_names[: len(plain.state_names)] == plain.state_names
    changed.remove_sensor(added.name)
    assert frozen(changed.save()) == frozen(plain.save())
    assert_same_estimate(changed.estimate(2.0), plain.estimate(2.0))
    assert changed.log_likelihood == plain.log_likelihood


@pytest.mark.parametrize("added", [BIASED, SCALED])
def test_an_unused_sensor_may_stay_for_a_while(added: sf.Sensor) -> None:
    """Its states stay independent of all others."""
    plain, changed = make("fixed size"), make("fixed size")
    for filter in (plain, changed):
        streamed(filter, FIRST, 1.0)
    changed.add_sensor(added)
    for filter in (plain, changed):
        streamed(filter, SECOND, 2.0)
    changed.remove_sensor(added.name)
    one, other = changed.estimate(2.5), plain.estimate(2.5)
    assert state_error(one.x, other.x, other.P) <= 1e-13
    assert covariance_error(one.P, other.P) <= 1e-13


@pytest.mark.parametrize("added", [BIASED, SCALED])
def test_added_sensor_equals_one_that_was_there_unused(added: sf.Sensor) -> None:
    """A stationary state that nothing has seen is the same now as it was at the start."""
    model, sensors = SYSTEMS["fixed size"]
    x0, P0 = [20.0, 0.0], 4.0 * np.eye(2)
    present = sf.DesyncFilter(model, [*sensors, added], x0, P0, start=0.0)
    joined = sf.DesyncFilter(model, sensors, x0, P0, start=0.0)
    for filter in (present, joined):
        streamed(filter, FIRST, 1.0)
    joined.add_sensor(added)
    assert joined.state_names == present.state_names
    rows = [*SECOND, (1.3, added.name, 20.6), (1.5, added.name, 20.7)]
    for filter in (present, joined):
        for row in rows:
            filter.push(*row)
    one, other = joined.estimate(2.0), present.estimate(2.0)
    assert one.degrees_of_freedom == other.degrees_of_freedom == 5
    assert state_error(one.x, other.x, other.P) <= 1e-12
    assert covariance_error(one.P, other.P) <= 1e-12
    np.testing.assert_allclose(one.noise, other.noise, rtol=1e-10, atol=1e-12)


def test_removal_is_marginalisation() -> None:
    """What is left is the part of x and P of the other states; what waits of the sensor is gone."""
    filter = make("sensor states")
    rows = [(0.1, "biased", 20.9), (0.2, "scaled", 20.5), (0.3, "wheel", 20.0)]
    streamed(filter, rows, 1.0)
    before = filter.save()
    filter.push(1.1, "biased", 99.0)
    filter.push(1.2, "scaled", 20.3)
    kept = [i for i, name in enumerate(filter.state_names) if name != "biased.bias"]
    filter.remove_sensor("biased")
    after = filter.save()
    assert filter.state_names == ("speed", "acceleration", "scaled.scale")
    assert np.array_equal(after["x"], before["x"][kept])
    assert np.array_equal(after["P"], before["P"][np.ix_(kept, kept)])
    assert filter.push(1.3, "biased", 20.0).name == "unknown_sensor"
    estimate = filter.estimate(2.0)
    assert estimate.noise_id.tolist() == [4]  # the scaled one; the biased one was push 3
    counted = {name: count for name, count in filter.counters.items() if count}
    assert counted == {"ok": 4, "unknown_sensor": 2}  # one of them waited when its sensor went


def test_sensors_that_do_not_fit_are_refused() -> None:
    filter = make("fixed size")
    before = frozen(filter.save())
    with pytest.raises(sf.ConfigError, match=r"no sensor 'gps'; there are \['wheel', 'radar'\]"):
        filter.remove_sensor("gps")
    with pytest.raises(sf.ConfigError, match="expected different names"):
        filter.add_sensor(sf.Sensor("wheel", 2.0))
    with pytest.raises(sf.ShapeError, match="observes"):
        filter.add_sensor(sf.Sensor("gps", 1.0, observes=(1.0,)))
    filter.remove_sensor("radar")
    with pytest.raises(sf.ConfigError, match="expected 1 to 16, got 0"):
        filter.remove_sensor("wheel")
    filter.add_sensor(RADAR)
    assert frozen(filter.save()) == before


# Saved filters.


def test_saved_state_is_not_the_filter() -> None:
    """Neither going on, nor changing what was saved, changes the other."""
    filter = make("sensor states")
    streamed(filter, [(0.1, "wheel", 20.0)], 0.5)
    saved = filter.save()
    copy = frozen(saved)
    streamed(filter, [(0.6, "wheel", 20.0)], 1.0)
    assert frozen(saved) == copy
    going = frozen(filter.save())
    saved["x"][:] = 99.0
    saved["P"][:] = 99.0
    assert frozen(filter.save()) == going


def test_saved_state_of_other_states_is_refused() -> None:
    filter = make("fixed size")
    with pytest.raises(sf.ShapeError, match=r"saved: expected states \['speed', 'acceleration'\]"):
        filter.restore(make("sensor states").save())


def test_saved_state_that_waits_for_more_than_fits_is_refused() -> None:
    full, small = make("fixed size"), make("fixed size", capacity=2)
    for stamp in (0.1, 0.2, 0.3):
        full.push(stamp, "wheel", 20.0)
    before = frozen(small.save())
    with pytest.raises(sf.ConfigError, match="saved: more measurements wait than capacity 2 holds"):
        small.restore(full.save())
    assert frozen(small.save()) == before


@pytest.mark.parametrize(
    "damage",
    [
        {"x": np.array([np.nan, 0.0])},
        {"P": np.array([[-1.0, 0.0], [0.0, 1.0]])},
        {"P": np.eye(3)},
        {"waiting": ([100], [7], [20.0], [0])},  # there is no sensor 7
        {"waiting": ([100], [-1], [20.0], [0])},
        {"waiting": ([100, 200], [0], [20.0], [0])},
        {"waiting": ([100], [0], [np.nan], [0])},
        {"counters": (0,)},
    ],
    ids=["x", "P negative", "P size", "sensor", "sensor -1", "lengths", "value", "counters"],
)
def test_damaged_saved_state_is_refused(damage: dict[str, Any]) -> None:
    """A file that was cut or edited is an error of surefix, never a poisoned filter."""
    filter = make("fixed size")
    before = frozen(filter.save())
    with pytest.raises(sf.SurefixError):
        filter.restore({**filter.save(), **damage})
    assert frozen(filter.save()) == before


@pytest.mark.parametrize("missing", ["x", "states", "waiting", "pushes"])
def test_cut_saved_state_is_refused(missing: str) -> None:
    filter = make("fixed size")
    saved = filter.save()
    del saved[missing]
    with pytest.raises(sf.SurefixError, match=missing):
        filter.restore(saved)


def test_pickled_filter_keeps_its_settings() -> None:
    filter = make("sensor states", risk=1e-5, capacity=7)
    filter.add_sensor(sf.Sensor("late", 1.0, latency=0.5))
    copy = pickle.loads(pickle.dumps(filter))
    assert copy.sensors == filter.sensors
    assert (copy.risk, copy.capacity, copy.start) == (1e-5, 7, 0.0)
    assert_same_estimate(copy.estimate(1.0), filter.estimate(1.0))


def test_streaming_does_not_change_what_run_gives() -> None:
    scene = random_scene(5)
    fresh, used = scene.filter, scene.filter
    streamed(used, [(0.1, "s0", 10.0)], 1.0)
    one, other = fresh.run(scene.log, rate=5.0), used.run(scene.log, rate=5.0)
    assert np.array_equal(one.x, other.x)
    assert np.array_equal(one.P, other.P)
