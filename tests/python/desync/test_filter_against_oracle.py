"""The filter over whole logs against a dense Kalman filter, the batch estimator and itself."""

from __future__ import annotations

from math import inf

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import surefix as sf
from desync.scenes import MODELS, Scene, random_scene, scenes
from oracle import sensors
from oracle.compare import covariance_error, state_error
from oracle.step import Array, Step
from oracle.wiener import wiener_noise

ALL = (*MODELS, "discrete")


def assert_equals_oracle(result: sf.Result, expected: sensors.Run, tolerance: float) -> None:
    assert len(result.time) == len(expected.x)
    for x, P, x_k, P_k in zip(result.x, result.P, expected.x, expected.P, strict=True):
        assert state_error(x, x_k, P_k) <= tolerance
        assert covariance_error(P, P_k) <= tolerance
    np.testing.assert_allclose(result.sse, expected.sse, rtol=tolerance, atol=tolerance)
    assert np.array_equal(result.degrees_of_freedom, expected.dof)
    assert result.log_likelihood == pytest.approx(
        expected.log_likelihood, rel=tolerance, abs=tolerance
    )


def assert_same_bits(one: sf.Result, other: sf.Result) -> None:
    for name in ("time", "x", "P", "sse", "degrees_of_freedom"):
        assert np.array_equal(getattr(one, name), getattr(other, name)), name
    assert one.log_likelihood == other.log_likelihood


@given(scene=scenes())
def test_estimates_at_a_rate_equal_the_oracle(scene: Scene) -> None:
    result = scene.filter.run(scene.log, rate=5.0)
    assert_equals_oracle(result, scene.expected(result.time), 1e-10)


@given(scene=scenes())
def test_estimates_at_every_measurement_equal_the_oracle(scene: Scene) -> None:
    result = scene.filter.run(scene.log)
    nanoseconds = sensors.nanoseconds
    valid = {nanoseconds(t) - nanoseconds(scene.sensors[i].latency) for t, i, _ in scene.rows}
    times = np.array(sorted(t for t in valid if t >= 0)) / 1e9
    assert np.array_equal(result.time, times)
    if len(times) > 0:
        assert_equals_oracle(result, scene.expected(times), 1e-10)


@given(scene=scenes(), seed=st.integers(0, 1000))
def test_estimates_at_chosen_times_equal_the_oracle(scene: Scene, seed: int) -> None:
    """Some steps hold no measurement, some all; equal times are a step of no length."""
    rng = np.random.default_rng(seed)
    ticks = np.sort(rng.integers(0, round(100 * scene.latest) + 100, 6))
    times = np.append(ticks, ticks[-1]) / 100.0
    result = scene.filter.run(scene.log, times=times)
    assert np.array_equal(result.time, times)
    assert_equals_oracle(result, scene.expected(times), 1e-10)


@pytest.mark.parametrize("name", ALL)
@pytest.mark.parametrize("seed", range(3))
def test_every_model_with_every_error_equals_the_oracle(name: str, seed: int) -> None:
    scene = random_scene(
        seed,
        name,
        count=4,
        measurements=60,
        scale=True,
        bias=True,
        latency=True,
        observes=True,
    )
    result = scene.filter.run(scene.log, rate=2.0)
    assert_equals_oracle(result, scene.expected(result.time), 1e-10)
    assert sum(result.counts.values()) == 60


@given(seed=st.integers(0, 1000), time=st.floats(0.5, 50.0))
def test_wandering_scale_of_a_known_speed_is_a_wandering_bias(seed: int, time: float) -> None:
    """The oracle's scale is constant; at a known constant speed v, (1 + s) v = v + (s v)."""
    speed, rng = 25.0, np.random.default_rng(seed)
    rows = sf.Log(rng.uniform(0.0, 20.0, 30), ["w"] * 30, rng.normal(25.2, 0.5, 30))
    runs = []
    for sensor in (
        sf.Sensor("w", 0.5, scale_sigma=0.02, scale_time=time),
        sf.Sensor("w", 0.5, bias_sigma=0.02 * speed, bias_time=time),
    ):
        filter = sf.DesyncFilter(sf.ConstantVelocity(0.0), [sensor], [speed], [[0.0]], start=0.0)
        runs.append(filter.run(rows, rate=1.0))
    scaled, biased = runs
    np.testing.assert_allclose(scaled.x[:, 1] * speed, biased.x[:, 1], rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(scaled.P[:, 1, 1] * speed**2, biased.P[:, 1, 1], rtol=1e-11)
    np.testing.assert_allclose(scaled.sse, biased.sse, rtol=1e-11, atol=1e-12)
    assert scaled.log_likelihood == pytest.approx(biased.log_likelihood, rel=1e-12)


@given(scene=scenes(), seed=st.integers(0, 1000))
def test_order_of_the_rows_changes_no_bit(scene: Scene, seed: int) -> None:
    shuffled = scene.permuted(seed)
    for noise in ("step", "journey"):
        one = scene.filter.run(scene.log, rate=5.0, noise=noise)
        other = shuffled.filter.run(shuffled.log, rate=5.0, noise=noise)
        assert_same_bits(one, other)
        order = [scene.rows.index(row) for row in shuffled.rows]
        assert np.array_equal(one.noise[order], other.noise, equal_nan=True)
        assert np.array_equal(one.noise_variance[order], other.noise_variance, equal_nan=True)
        assert np.array_equal(one.status[order], other.status)


@given(scene=scenes(scale=False))
def test_every_step_equals_the_composite_step(scene: Scene) -> None:
    """All at once, by the square-root array, from the measurements of the step in any order."""
    result = scene.filter.run(scene.log, rate=2.0)
    names = [s.name for s in scene.sensors]
    n, size = scene.model.size, result.x.shape[1]
    x, P = np.zeros(size), np.zeros((size, size))
    x[:n], P[:n, :n] = scene.x0, scene.P0
    sigmas = [s.bias_sigma for s in scene.sensors if s.bias_sigma > 0]
    P[range(n, size), range(n, size)] = np.square(sigmas)
    start, log_likelihood = 0.0, 0.0
    for k, end in enumerate(result.time.tolist()):
        rows = []
        for row in scene.rows:
            valid = round(row[0] - scene.sensors[row[1]].latency, 9)
            if valid <= end and (valid > start or (k == 0 and valid == start)):
                rows.append(row)
        step, order = sf.CompositeStep.from_measurements(
            scene.model,
            scene.sensors,
            start,
            end,
            [row[0] for row in rows],
            [names[row[1]] for row in rows],
        )
        z = np.array([rows[i][2] for i in order])
        update = step.update(x, P, z, way="composite")
        assert state_error(result.x[k], update.x, update.P) <= 1e-10
        assert covariance_error(result.P[k], update.P) <= 1e-10
        assert result.sse[k] == pytest.approx(update.sse, rel=1e-10, abs=1e-10)
        assert result.degrees_of_freedom[k] == update.degrees_of_freedom
        ids = [scene.rows.index(rows[i]) for i in order]
        np.testing.assert_allclose(result.noise[ids], update.noise, rtol=1e-9, atol=1e-10)
        np.testing.assert_allclose(result.noise_variance[ids], update.noise_variance, rtol=1e-9)
        log_likelihood += update.log_likelihood
        x, P, start = update.x, update.P, end
    assert result.log_likelihood == pytest.approx(log_likelihood, rel=1e-10, abs=1e-9)


def whole_journey(scene: Scene, times: Array) -> tuple[list[Step], list[int]]:
    """The steps of the oracle up to each estimation time, and the row of every measurement."""
    valid = [(round(t - scene.sensors[i].latency, 9), i, z) for t, i, z in scene.rows]
    order = sorted((k for k in range(len(valid)) if valid[k][0] >= 0.0), key=lambda k: valid[k])
    steps, ids, now = [], [], 0.0
    for end in times.tolist():
        mine = [k for k in order if valid[k][0] <= end and k not in ids]
        F, Q = [], []
        for then in [*(valid[k][0] for k in mine), end]:
            f, q = scene.transition(round(then - now, 9))
            F.append(f)
            Q.append(q)
            now = then
        H = [np.array([scene.sensors[valid[k][1]].row(scene.model)]) for k in mine]
        R = [np.array([[scene.sensors[valid[k][1]].sigma ** 2]]) for k in mine]
        z = [np.array([valid[k][2]]) for k in mine]
        steps.append(Step(tuple(F), tuple(Q), tuple(H), tuple(R), tuple(z)))
        ids += mine
    return steps, ids


@pytest.mark.parametrize("name", ALL)
@given(seed=st.integers(0, 2**32 - 1))
def test_noise_of_the_journey_is_the_wiener_estimate(name: str, seed: int) -> None:
    """Eq. (23): every measurement's noise from all the measurements, with no recursion."""
    scene = random_scene(seed, name, count=3, latency=True, observes=True)
    result = scene.filter.run(scene.log, rate=1.0, noise="journey")
    steps, ids = whole_journey(scene, result.time)
    v, covariance = wiener_noise(scene.x0, scene.P0, steps)
    assert state_error(result.noise[ids], v, covariance) <= 1e-9
    np.testing.assert_allclose(result.noise_variance[ids], np.diag(covariance), rtol=1e-9)
    unused = np.setdiff1d(np.arange(len(scene.rows)), ids)
    assert np.isnan(result.noise[unused]).all()


@given(scene=scenes())
def test_noise_of_the_journey_does_not_depend_on_the_rate(scene: Scene) -> None:
    fast = scene.filter.run(scene.log, rate=10.0, noise="journey")
    slow = scene.filter.run(scene.log, rate=1.0, noise="journey")
    np.testing.assert_allclose(fast.noise, slow.noise, rtol=1e-9, atol=1e-11)
    np.testing.assert_allclose(fast.noise_variance, slow.noise_variance, rtol=1e-10)


@given(scene=scenes())
def test_estimates_do_not_depend_on_the_rate(scene: Scene) -> None:
    """At the times that they share, to 1e-12: the models are exact over any duration."""
    seconds = np.arange(1.0, np.ceil(scene.latest) + 1.0)
    slow = scene.filter.run(scene.log, times=seconds)
    fast = scene.filter.run(scene.log, times=np.arange(1, 10 * int(seconds[-1]) + 1) / 10)
    for k, second in enumerate(seconds):
        (j,) = np.flatnonzero(fast.time == second)
        assert state_error(fast.x[j], slow.x[k], slow.P[k]) <= 1e-12
        assert covariance_error(fast.P[j], slow.P[k]) <= 1e-12
    assert fast.degrees_of_freedom.sum() == slow.degrees_of_freedom.sum()
    assert fast.sse.sum() == pytest.approx(slow.sse.sum(), rel=1e-11, abs=1e-12)
    assert fast.log_likelihood == pytest.approx(slow.log_likelihood, rel=1e-11, abs=1e-11)


def test_noise_is_not_estimated_unasked() -> None:
    scene = random_scene(1)
    quiet = scene.filter.run(scene.log, rate=5.0, noise=None)
    assert quiet.noise.shape == quiet.noise_variance.shape == (0,)
    assert_same_bits(quiet, scene.filter.run(scene.log, rate=5.0))


def test_run_leaves_the_filter_as_it_is() -> None:
    scene = random_scene(2, latency=True)
    filter = scene.filter
    before = repr(filter.save())
    assert_same_bits(filter.run(scene.log, rate=5.0), filter.run(scene.log, rate=5.0))
    assert repr(filter.save()) == before


def test_without_start_the_earliest_measurement_is_the_start() -> None:
    scene = random_scene(3, latency=True)
    free = sf.DesyncFilter(scene.model, scene.sensors, scene.x0, scene.P0)
    earliest = min(t - scene.sensors[i].latency for t, i, _ in scene.rows)
    bound = sf.DesyncFilter(
        scene.model, scene.sensors, scene.x0, scene.P0, start=round(earliest, 9)
    )
    assert_same_bits(free.run(scene.log, rate=5.0), bound.run(scene.log, rate=5.0))
    assert free.run(scene.log).counts == {"ok": 30}


def test_rate_covers_the_log() -> None:
    """From the start to the first step at or after the last measurement, and no further."""
    model, sensor = sf.ConstantVelocity(1.0), sf.Sensor("w", 1.0)
    filter = sf.DesyncFilter(model, [sensor], [0.0], [[1.0]], start=0.0)
    for last, expected in ((1.0, 1.0), (1.0000001, 1.1), (0.05, 0.1), (0.0, 0.1)):
        result = filter.run(sf.Log([0.0, last], ["w", "w"], [1.0, 2.0]), rate=10.0)
        np.testing.assert_allclose(result.time, np.arange(1, round(expected * 10) + 1) / 10)
        assert result.degrees_of_freedom.sum() == 2
    third = filter.run(sf.Log([1.0], ["w"], [1.0]), rate=3.0)
    np.testing.assert_allclose(third.time, [1 / 3, 2 / 3, 1.0], atol=1e-9)
    assert third.degrees_of_freedom.sum() == 1


def test_delay_replays_the_order_of_arrival() -> None:
    """A row stamped later than t + delay is too late for the estimate that it belongs to."""
    model = sf.ConstantVelocity(1.0)
    slow, quick = sf.Sensor("slow", 1.0, latency=0.5), sf.Sensor("quick", 1.0)
    filter = sf.DesyncFilter(model, [slow, quick], [0.0], [[1.0]], start=0.0)
    log = sf.Log([0.9, 1.3, 1.5], ["quick", "slow", "slow"], [1.0, 2.0, 3.0])
    for delay, counts in ((0.0, [1, 0]), (0.3, [2, 0]), (0.5, [3, 0])):
        result = filter.run(log, times=[1.0, 2.0], delay=delay)
        assert result.degrees_of_freedom.tolist() == counts
        late = 3 - sum(counts)
        assert result.counts == {"ok": 3 - late, **({"too_late": late} if late else {})}
    assert filter.run(log, times=[1.0, 2.0]).degrees_of_freedom.tolist() == [3, 0]


def test_rows_outside_the_run_are_counted() -> None:
    model = sf.ConstantVelocity(1.0)
    filter = sf.DesyncFilter(model, [sf.Sensor("w", 1.0)], [0.0], [[1.0]], start=1.0)
    log = sf.Log(
        [0.9, 1.0, 1.5, 1.5, np.nan, 1.6, 1.7, 2.5, inf],
        ["w", "w", "w", "w", "w", "w", "x", "w", "w"],
        [1.0, 1.0, 2.0, 2.0, 1.0, np.nan, 1.0, 1.0, 1.0],
    )
    result = filter.run(log, times=[2.0])
    names = [list(sf.Status)[code].name for code in result.status]
    assert names == [
        *("too_late", "ok", "ok", "repeated", "not_finite", "not_finite"),
        *("unknown_sensor", "waiting", "not_finite"),
    ]
    assert result.degrees_of_freedom.tolist() == [2]
    assert np.flatnonzero(np.isfinite(result.noise)).tolist() == [1, 2]


def test_reading_between_the_periods_is_counted() -> None:
    model = sf.DiscreteModel(0.9 * np.eye(1), 0.1 * np.eye(1), period=0.1)
    filter = sf.DesyncFilter(model, [sf.Sensor("w", 1.0)], [0.0], [[1.0]], start=0.0)
    log = sf.Log([0.1, 0.15, 0.2], ["w"] * 3, [1.0, 50.0, 1.0])
    result = filter.run(log, times=[0.5])
    assert result.counts == {"ok": 2, "off_grid": 1}
    without = filter.run(sf.Log([0.1, 0.2], ["w"] * 2, [1.0, 1.0]), times=[0.5])
    assert np.array_equal(result.x, without.x)


FILTER = sf.DesyncFilter(sf.ConstantVelocity(1.0), [sf.Sensor("w", 1.0)], [0.0], [[1.0]], start=0.0)
LOG = sf.Log([0.5, 1.5], ["w", "w"], [1.0, 2.0])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"rate": 1.0, "times": [1.0]}, "expected rate or times, got both"),
        ({"rate": 0.0}, "rate: expected a number > 0, got 0.0"),
        ({"rate": np.nan}, "rate: .*got nan"),
        ({"times": []}, "times: expected 1 or more times"),
        ({"times": [1.0, np.nan]}, r"times: .*got nan at \(1,\)"),
        ({"times": [4e9]}, "times: .*4"),
        ({"times": [2.0, 1.0]}, r"no estimate at 1.0 s: time_backwards"),
        ({"times": [-1.0]}, r"no estimate at -1.0 s: time_backwards"),
        ({"noise": "all"}, "noise: expected 'step', 'journey' or None, got 'all'"),
        ({"rate": 1.0, "delay": -0.1}, "delay: expected a number >= 0, got -0.1"),
        ({"delay": 0.1}, "delay: expected rate or times"),
    ],
)
def test_bad_argument_of_run_is_named(arguments: dict[str, object], message: str) -> None:
    with pytest.raises(sf.ConfigError, match=message):
        FILTER.run(LOG, **arguments)  # type: ignore[arg-type]


def test_run_wants_a_log() -> None:
    with pytest.raises(sf.ConfigError, match=r"log: expected a Log, got 'log\.csv'"):
        FILTER.run("log.csv")  # type: ignore[arg-type]


def test_estimate_between_the_periods_is_refused() -> None:
    model = sf.DiscreteModel(0.9 * np.eye(1), 0.1 * np.eye(1), period=0.1)
    filter = sf.DesyncFilter(model, [sf.Sensor("w", 1.0)], [0.0], [[1.0]], start=0.0)
    with pytest.raises(sf.ConfigError, match=r"no estimate at 0\.25 s: off_grid"):
        filter.run(sf.Log([0.1], ["w"], [1.0]), times=[0.1, 0.25])


def test_overflow_is_refused() -> None:
    model = sf.LinearModel(np.eye(1), np.eye(1), np.eye(1))
    filter = sf.DesyncFilter(model, [sf.Sensor("w", 1.0)], [0.0], [[1.0]], start=0.0)
    with pytest.raises(sf.NumericalError, match=r"no estimate at 2000\.0 s: numerical"):
        filter.run(sf.Log([0.1], ["w"], [1.0]), times=[1.0, 2000.0])


ONE = sf.Sensor("w", 1.0)
BAD: dict[str, tuple[dict[str, object], type[Exception], str]] = {
    "x0 too long": ({"x0": [0.0, 0.0]}, sf.ShapeError, r"x0: .*\(1,\), got \(2,\)"),
    "x0 NaN": ({"x0": [np.nan]}, sf.ConfigError, r"x0: .*got nan at \(0,\)"),
    "P0 does not fit": ({"P0": np.eye(2)}, sf.ShapeError, r"P0: .*\(1, 1\), got \(2, 2\)"),
    "P0 negative": ({"P0": [[-1.0]]}, sf.ConfigError, "P0: .*positive semidefinite"),
    "start NaN": ({"start": np.nan}, sf.ConfigError, "start: .*got nan"),
    "start beyond time": ({"start": 4e9}, sf.ConfigError, "start: .*got 4000000000.0"),
    "risk zero": ({"risk": 0.0}, sf.ConfigError, "risk: .*got 0.0"),
    "risk one": ({"risk": 1.0}, sf.ConfigError, "risk: .*got 1.0"),
    "no capacity": ({"capacity": 0}, sf.ConfigError, "capacity: .*got 0"),
    "half a capacity": ({"capacity": 1.5}, sf.ConfigError, "capacity: .*got 1.5"),
    "capacity NaN": ({"capacity": np.nan}, sf.ConfigError, "capacity: .*got nan"),
    "capacity infinite": ({"capacity": inf}, sf.ConfigError, "capacity: .*got inf"),
    "capacity a text": ({"capacity": "many"}, sf.ConfigError, "capacity: .*got 'many'"),
    "no sensors": ({"sensors": []}, sf.ConfigError, "sensors: expected 1 to 16, got 0"),
}


@pytest.mark.parametrize(("changed", "error", "message"), BAD.values(), ids=BAD.keys())
def test_bad_argument_is_named(
    changed: dict[str, object], error: type[Exception], message: str
) -> None:
    arguments = {"sensors": [ONE], "x0": [0.0], "P0": [[1.0]], **changed}
    with pytest.raises(error, match=message):
        sf.DesyncFilter(sf.ConstantVelocity(1.0), **arguments)  # type: ignore[arg-type]
