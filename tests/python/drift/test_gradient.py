"""The likelihood's gradient, and what else one pass leaves, against dense algebra."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import surefix as sf
from drift.scenes import LogScene, Scene, irregular, logged, particle
from oracle import drift
from oracle.drift import Dense
from oracle.step import Array

SYSTEMS = {"particle": particle, "irregular": irregular}
LOGS = {
    "plain": logged(),
    "latency": logged(4, latency=0.35),
    "negative latency": logged(5, latency=-0.2),
    "start": logged(6, start=-2.0),
}
each_system = pytest.mark.parametrize("make", SYSTEMS.values(), ids=SYSTEMS.keys())
each_log = pytest.mark.parametrize("scene", LOGS.values(), ids=LOGS.keys())


def assert_gradient(found: Array, precision: Array, d: Dense, tolerance: float = 1e-9) -> None:
    """To a share of itself or, where it is small, of its standard deviation with no fault."""
    assert found.shape == precision.shape == d.shape
    known, variance = d.gradient, 4.0 * d.precision
    there = ~np.isnan(known)
    np.testing.assert_array_equal(np.isnan(found), ~there)
    np.testing.assert_array_equal(np.isnan(precision), ~there)
    scale = np.maximum(np.abs(known), np.sqrt(variance))[there]
    assert np.max(np.abs(found - known)[there] / scale) <= tolerance
    np.testing.assert_allclose(4.0 * precision[there], variance[there], rtol=tolerance)


@each_system
@pytest.mark.parametrize("steps", [1, 2, 60])
def test_gradient_is_the_slope_of_the_engines_own_inconsistency(make: object, steps: int) -> None:
    """Central differences are exact of a quadratic function, but for rounding: 1e-16 of its value,
    some hundreds, over a width of one."""
    scene: Scene = make(steps)  # type: ignore[operator]
    z = scene.simulated(1, 1)[0]
    z[0] = 1.0  # also where only one step is
    places = np.argwhere(~np.isnan(z))
    moved = np.repeat(z[None], 2 * len(places), axis=0)
    for i, (k, c) in enumerate(places):
        moved[2 * i, k, c] += 1.0
        moved[2 * i + 1, k, c] -= 1.0
    inconsistency = scene.record(moved).inconsistency
    assert isinstance(inconsistency, np.ndarray)
    slope = (inconsistency[::2] - inconsistency[1::2]) / 2.0
    gradient = scene.record(z).gradient
    found = np.array([gradient[k, c] for k, c in places])
    np.testing.assert_allclose(found, slope, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("scene", [particle(500), irregular(250)], ids=SYSTEMS)
def test_all_of_it_is_the_dense_systems(scene: Scene) -> None:
    """Up to 500 measurements, in which the particle's covariance grows to a condition number of
    1e8."""
    z = scene.simulated(1, 2)[0]
    z[200:, 0] += 0.2 * np.arange(len(z) - 200)  # and far from what the model expects
    record, d = scene.record(z), scene.dense(z)
    assert_gradient(record.gradient, record.precision, d)
    assert record.inconsistency == pytest.approx(d.inconsistency, rel=1e-10)
    assert record.log_likelihood == pytest.approx(d.log_likelihood, rel=1e-10)
    some = scene.seen.any(axis=1)
    np.testing.assert_allclose(record.nis[some], d.nis[some], rtol=1e-8, atol=1e-8)
    assert record.channels == scene.channels
    np.testing.assert_array_equal(record.time, scene.times)


def test_inputs_move_the_prediction() -> None:
    """The same motion, once as inputs and once as a mean that the measurements are about."""
    scene = irregular()
    z = scene.simulated(1, 3)[0]
    x, mean = np.zeros(3), np.zeros_like(z)
    for k in range(len(z)):
        if k > 0:
            x = scene.plant.A[k - 1] @ x + scene.inputs[k - 1]
        mean[k] = scene.plant.H[k] @ x
    without = sf.ForwardRecord(scene.system, z - mean, times=scene.times)
    with_inputs = scene.record(z)
    np.testing.assert_allclose(with_inputs.gradient, without.gradient, rtol=1e-9, atol=1e-11)
    ignored = sf.ForwardRecord(scene.system, z, times=scene.times)
    assert np.nanmax(np.abs(ignored.gradient - with_inputs.gradient)) > 0.1


def test_defaults() -> None:
    """Times 0, 1, 2...; channels are numbered; no inputs."""
    scene = irregular(10)
    z = scene.simulated(1, 3)[0]
    record = sf.ForwardRecord(scene.system, z)
    assert record.time.tolist() == list(range(10))
    assert record.channels == ("0", "1")
    d = drift.dense(scene.plant, z)
    assert_gradient(record.gradient, record.precision, d)


def test_shapes() -> None:
    scene = irregular(20)
    z = scene.simulated(7, 3)
    many, one = scene.record(z), scene.record(z[0])
    assert many.gradient.shape == (7, 20, 2)
    assert many.precision.shape == one.precision.shape == (20, 2)  # of the schedule only
    assert many.nis.shape == (7, 20)
    assert one.nis.shape == (20,)
    for name in ("log_likelihood", "inconsistency"):
        assert isinstance(getattr(one, name), float)
        assert getattr(many, name).shape == (7,)


@each_system
def test_many_runs_are_one_by_one(make: object) -> None:
    """Bit for bit: a run does not know of the others."""
    scene: Scene = make(50)  # type: ignore[operator]
    z = scene.simulated(11, 4)
    many = scene.record(z)
    for i in range(len(z)):
        one = scene.record(z[i])
        for name in ("gradient", "nis", "log_likelihood", "inconsistency"):
            np.testing.assert_array_equal(getattr(many, name)[i], getattr(one, name), name)
        np.testing.assert_array_equal(many.precision, one.precision)


@each_system
def test_fast_path_is_the_records_gradient(make: object) -> None:
    scene: Scene = make(50)  # type: ignore[operator]
    for z in (scene.simulated(3, 4), scene.simulated(1, 4)[0]):
        found = sf.likelihood_gradient(scene.system, z, inputs=scene.inputs)
        known = scene.record(z).gradient
        assert found.shape == known.shape
        np.testing.assert_allclose(found, known, rtol=1e-12, atol=1e-13)
    without = sf.likelihood_gradient(scene.system, z)
    np.testing.assert_allclose(
        without, sf.ForwardRecord(scene.system, z).gradient, rtol=1e-12, atol=1e-13
    )


def test_steps_without_measurements_change_nothing() -> None:
    """A gap is a longer transition."""
    scene = particle(40)
    z = scene.simulated(1, 5)[0]
    z[10:30] = np.nan
    d = drift.dense(scene.plant, z, scene.times, scene.inputs)
    record = scene.record(z)
    assert_gradient(record.gradient, record.precision, d)
    assert record.inconsistency == pytest.approx(d.inconsistency, rel=1e-12)


def test_arguments_are_left_as_they_are() -> None:
    scene = irregular(20)
    z = scene.simulated(2, 3)
    given = z.copy(), scene.times.copy(), scene.inputs.copy()
    record = scene.record(z)
    np.testing.assert_array_equal(z, given[0])
    np.testing.assert_array_equal(scene.times, given[1])
    np.testing.assert_array_equal(scene.inputs, given[2])
    gradient = record.gradient.copy()
    z[:] = 0.0
    np.testing.assert_array_equal(record.gradient, gradient)


@each_log
def test_log_against_the_dense_system(scene: LogScene) -> None:
    record, d = scene.record, scene.dense
    assert_gradient(record.gradient, record.precision, d)
    assert record.inconsistency == pytest.approx(d.inconsistency, rel=1e-10)
    assert record.log_likelihood == pytest.approx(d.log_likelihood, rel=1e-10)
    white = d.whiten(d.gamma).astype(float)
    np.testing.assert_allclose(record.nis, d.spread(white**2), rtol=1e-8, atol=1e-9)
    assert record.channels == ("wheel", "radar", "gps")
    assert record.time.shape == (len(scene.rows),)


@each_log
def test_log_has_the_filters_likelihood_and_noise(scene: LogScene) -> None:
    """Eq. (25) of Bilenne 2004 is v = Upsilon Gamma^-1 gamma, half sigma^2 times the gradient."""
    record, result = scene.record, scene.filter.run(scene.log, rate=1.0, noise="journey")
    assert record.log_likelihood == pytest.approx(result.log_likelihood, rel=1e-12)
    variance = np.array([scene.sensors[i].sigma ** 2 for _, i, _ in scene.rows])
    np.testing.assert_allclose(
        variance * record.gradient / 2.0, result.noise, rtol=1e-9, atol=1e-12
    )
    np.testing.assert_allclose(variance**2 * record.precision, result.noise_variance, rtol=1e-9)


def test_rows_of_a_log_may_come_in_any_order() -> None:
    scene = LOGS["latency"]
    order = np.random.default_rng(0).permutation(len(scene.rows))
    mixed = replace(scene, rows=tuple(scene.rows[i] for i in order)).record
    known = scene.record
    for name in ("gradient", "precision", "nis", "time"):
        np.testing.assert_array_equal(getattr(mixed, name), getattr(known, name)[order], name)
    assert mixed.log_likelihood == known.log_likelihood


def test_rows_that_are_not_used_have_no_gradient() -> None:
    """A value that is no number, a repeated row, an unknown sensor, a time before the start."""
    scene = replace(LOGS["plain"], start=0.0)
    extra = [(3.0005, 1, np.nan), scene.rows[5], (4.0005, 0, 20.0), (-1.0, 2, 20.0)]
    rows = [*scene.rows, *extra]
    time, index, value = zip(*rows, strict=True)
    names = [scene.channels[i] for i in index]
    names[-2] = "nobody"
    record = sf.ForwardRecord(scene.filter, sf.Log(time, names, value))
    used = len(scene.rows)
    for name in ("gradient", "precision"):
        assert np.isnan(getattr(record, name)[used:]).all()
        np.testing.assert_array_equal(getattr(record, name)[:used], getattr(scene.record, name))
    assert record.log_likelihood == scene.record.log_likelihood


def test_log_is_read_and_the_filter_left_as_it_is() -> None:
    scene = LOGS["plain"]
    filter, log = scene.filter, scene.log
    before = repr(filter.save())
    first = sf.ForwardRecord(filter, log)
    np.testing.assert_array_equal(first.gradient, sf.ForwardRecord(filter, log).gradient)
    np.testing.assert_allclose(
        sf.likelihood_gradient(filter, log), first.gradient, rtol=1e-12, atol=1e-13
    )
    assert repr(filter.save()) == before
