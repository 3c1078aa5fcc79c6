"""The data without the fault, and the estimates from them with the fault's uncertainty."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import surefix as sf
from drift.scenes import Scene, faulty, irregular
from drift.two_sensors import SpeedLog, doubled, ramp, speed_log, step
from oracle import drift
from oracle.step import Array
from oracle.switching import Plant

FEW = 8  # samples, where p-values do not matter
# Two filters of the same recursion in doubles: a few hundred updates' rounding, of estimates of
# 10 to 100 whose deviations are 0.01 to 1.
TOLERANCE = 1e-9
LATE = (sf.Sensor("wheel", 0.2), sf.Sensor("radar", 0.3, latency=0.75))


def system_diagnosis(where: str, kind: str) -> tuple[Scene, Array, sf.Diagnosis]:
    """The fault is in the second channel."""
    scene = irregular() if where == "irregular" else doubled()
    t, size = scene.times, {"irregular": 30.0, "doubled": 1.0}[where]
    value = {
        "step": step(float(t[20]), 2.0 * size)(t),
        "ramp": ramp(float(t[20]), 0.3 * size)(t),
        "sinusoid": 1.3 * size * np.sin(1.7 * t + 0.5),
        "ramp (ends)": ramp(float(t[20]), size, float(t[30]))(t),
    }[kind]
    z = faulty(scene.simulated(1, 12)[0], value, 1)
    found = sf.diagnose(
        scene.system, z, times=t, inputs=scene.inputs, names=scene.channels, max_faults=1,
        ends="ends" in kind, samples=FEW,
    )  # fmt: skip
    return scene, z, found


def log_diagnosis(kind: str, **settings: Any) -> tuple[SpeedLog, sf.Diagnosis]:
    healthy = speed_log(21, sensors=LATE)
    scene = healthy.with_fault(
        "radar",
        {
            "step": step(8.0, 3.0),
            "ramp": ramp(8.0, 0.4),
            "sinusoid": lambda t: 0.9 * np.sin(2.7 * t + 0.5),
            "ramp (ends)": ramp(8.0, 0.8, 14.0),
        }[kind],
    )
    found = sf.diagnose(
        scene.filter, scene.log, max_faults=1, ends="ends" in kind, samples=FEW, **settings
    )
    return scene, found


def unit_of(fault: sf.Fault, t: Array) -> Array:
    """(any, q), from the numbers of a fault alone."""
    if fault.kind == "sinusoid":
        assert fault.frequency is not None
        angle = 2 * np.pi * fault.frequency * (t - fault.origin)
        return np.stack([np.cos(angle), np.sin(angle)], axis=1)
    assert fault.onset is not None
    end = np.inf if fault.end is None else fault.end
    course = {"step": step(fault.onset, 1.0), "ramp": ramp(fault.onset, 1.0, end)}
    return course[fault.kind.split()[0]](t)[:, None]


def oracle_estimates(
    plant: Plant, z: Array, inputs: Array | None, fault: sf.Fault, unit: Array
) -> tuple[Array, Array]:
    """Of z (T, m) less the fault, whose unit amplitudes in z are ``unit`` (T, m, q): x, and
    P + b C b'."""
    left = z - unit @ fault.amplitudes
    x, P, _ = drift.estimates(plant, left, inputs)
    b = np.stack([x - drift.estimates(plant, left - d, inputs)[0] for d in np.moveaxis(unit, 2, 0)],
                 axis=2)  # fmt: skip
    return x, P + b @ fault.covariance @ np.swapaxes(b, 1, 2)


def assert_near(found: Array, known: Array) -> None:
    np.testing.assert_allclose(found, known, rtol=TOLERANCE, atol=TOLERANCE * np.abs(known).max())


each_kind = pytest.mark.parametrize("kind", ["step", "ramp", "sinusoid", "ramp (ends)"])


@each_kind
@pytest.mark.parametrize("where", ["doubled", "irregular"])
def test_estimates_of_a_system(where: str, kind: str) -> None:
    """Of other matrices in every step, R full, components missing, inputs on all states, too."""
    scene, z, found = system_diagnosis(where, kind)
    (fault,) = found.faults
    assert (fault.channel, fault.kind) == (scene.channels[1], kind)
    before, after = found.estimates()
    x, P, _ = drift.estimates(scene.plant, z, scene.inputs)
    for estimates in (before, after):
        np.testing.assert_array_equal(estimates.time, scene.times)
    assert_near(before.x, x)
    assert_near(before.P, P)
    q = unit_of(fault, scene.times)
    unit = np.stack([np.zeros_like(q), q], axis=1)
    x, P = oracle_estimates(scene.plant, z, scene.inputs, fault, unit)
    assert_near(after.x, x)
    assert_near(after.P, P)
    larger = np.linalg.norm(after.P - before.P, axis=(1, 2)) / np.linalg.norm(P, axis=(1, 2))
    assert larger.max() > 0.01  # what the fault adds is not next to nothing
    np.testing.assert_allclose(
        np.asarray(found.repaired), z - unit @ fault.amplitudes, rtol=1e-12, atol=1e-12
    )


@each_kind
def test_estimates_of_a_log(kind: str) -> None:
    """Of which one sensor is late, so that rows are not in the order of their validity."""
    scene, found = log_diagnosis(kind)
    order = np.argsort(scene.valid)
    assert (order != np.arange(len(order))).any()
    (fault,) = found.faults
    assert (fault.channel, fault.kind) == ("radar", kind)
    before, after = found.estimates()
    np.testing.assert_allclose(after.time, scene.valid[order], rtol=0, atol=1e-9)  # nanoseconds
    radar = np.isin(order, scene.of("radar"))
    own = unit_of(fault, scene.valid[order]) * radar[:, None]
    unit = np.concatenate([np.zeros((1, own.shape[1])), own])[:, None, :]
    x, P = oracle_estimates(scene.plant, scene.z, None, fault, unit)
    assert_near(after.x, x[1:])
    assert_near(after.P, P[1:])
    assert (
        np.max(np.trace(after.P - before.P, axis1=1, axis2=2) / np.trace(P[1:], axis1=1, axis2=2))
        > 0.01
    )


@each_kind
def test_the_repaired_log(kind: str) -> None:
    """The fault at the time of validity of each row of its sensor; all else to the bit."""
    scene, found = log_diagnosis(kind)
    (fault,) = found.faults
    repaired = found.repaired
    assert isinstance(repaired, sf.Log)
    np.testing.assert_array_equal(repaired.stamp, scene.log.stamp)
    np.testing.assert_array_equal(repaired.sensor, scene.log.sensor)
    wheel, radar = scene.of("wheel"), scene.of("radar")
    np.testing.assert_array_equal(repaired.value[wheel], scene.log.value[wheel])
    known = scene.log.value[radar] - unit_of(fault, scene.valid[radar]) @ fault.amplitudes
    np.testing.assert_allclose(repaired.value[radar], known, rtol=1e-10)
    assert found.original is not repaired


def test_before_is_the_filters_run() -> None:
    scene, found = log_diagnosis("step")
    for settings in ({}, {"rate": 4.0}, {"times": [3.0, 10.5, 20.0]}):
        before, after = found.estimates(**settings)
        known = scene.filter.run(scene.log, **settings)
        for name in ("time", "x", "P"):
            np.testing.assert_array_equal(getattr(before, name), getattr(known, name))
        np.testing.assert_array_equal(after.time, known.time)
        assert isinstance(before, sf.Result)
        assert isinstance(after, sf.Result)
        np.testing.assert_array_equal(before.sse, known.sse)


def test_estimates_at_times() -> None:
    """Between measurements b is carried on as x is, without the noise that is added to P."""
    scene, found = log_diagnosis("step")
    (fault,) = found.faults
    times = np.array([3.0, 10.5, 14.0, 25.0])
    _, after = found.estimates(times=times)
    repaired = found.repaired
    assert isinstance(repaired, sf.Log)
    known = scene.filter.run(repaired, times=times)
    np.testing.assert_array_equal(after.x, known.x)
    np.testing.assert_array_equal(after.P[0], known.P[0])  # before the onset
    _, every = found.estimates()
    plain = scene.filter.run(repaired)
    for k, t in enumerate(times):
        last = np.flatnonzero(every.time <= t)[-1]
        F = np.array([[1.0, t - every.time[last]], [0.0, 1.0]])
        added = F @ (every.P[last] - plain.P[last]) @ F.T
        if k > 0:
            assert_near(after.P[k] - known.P[k], added)
    assert fault.onset is not None
    assert fault.onset > times[0]


def test_two_faults_add_their_uncertainties() -> None:
    scene = speed_log(4).with_fault("wheel", step(8.0, -3.0)).with_fault("radar", ramp(14.0, 0.4))
    found = sf.diagnose(scene.filter, scene.log, max_faults=2, samples=FEW)
    assert {f.channel for f in found.faults} == {"wheel", "radar"}
    _, after = found.estimates()
    z = scene.z.copy()
    added = np.zeros((len(z), 2, 2))
    for fault in found.faults:
        own = np.where(np.isnan(z), np.nan, 0.0)
        rows = scene.of(fault.channel)
        own[1 + rows] = unit_of(fault, scene.valid[rows])
        b = drift.estimates(scene.plant, own)[0] - drift.estimates(scene.plant, 0 * own)[0]
        added += np.einsum("ti,tj->tij", b, b) * fault.covariance[0, 0]
        z -= own * fault.amplitude
    x, P, _ = drift.estimates(scene.plant, z)
    assert_near(after.x, x[1:])
    assert_near(after.P, (P + added)[1:])


def test_nothing_found_nothing_repaired() -> None:
    scene = speed_log(22)
    found = sf.diagnose(scene.filter, scene.log, samples=FEW)
    assert not found.detected
    before, after = found.estimates()
    np.testing.assert_array_equal(before.x, after.x)
    np.testing.assert_array_equal(before.P, after.P)


def test_errors_are_as_large_as_they_claim() -> None:
    """200 journeys with a precise sensor that is off from its first reading on: all errors have the
    covariance P, of two states, so that the mean of e'P^-1 e is 2 ± 4 · 2 / sqrt(200). Without the
    fault's own uncertainty they would be much larger."""
    runs = 200
    sensors = (sf.Sensor("wheel", 0.05), sf.Sensor("radar", 0.5))
    at = [10, 20, 39]
    found, naive, healthy = np.zeros((runs, 3)), np.zeros((runs, 3)), np.zeros((runs, 3))
    for run in range(runs):
        good = speed_log(5000 + run, 40, 10.0, sensors)
        bad = good.with_fault("wheel", step(0.0, 30.0))
        diagnosis = sf.diagnose(
            bad.filter, bad.log, [sf.Profile.step()], spectrum=False, max_faults=1, samples=2
        )
        (fault,) = diagnosis.faults
        assert (fault.channel, fault.onset) == ("wheel", bad.valid[bad.of("wheel")[0]])
        assert abs(fault.amplitude - 30.0) < 5 * fault.amplitude_se
        _, after = diagnosis.estimates()
        P = bad.filter.run(bad.log).P
        truth = good.filter.run(good.log)
        error = after.x - np.array(good.truth)
        for k, i in enumerate(at):
            found[run, k] = error[i] @ np.linalg.solve(after.P[i], error[i])
            naive[run, k] = error[i] @ np.linalg.solve(P[i], error[i])
            e = truth.x[i] - np.array(good.truth[i])
            healthy[run, k] = e @ np.linalg.solve(truth.P[i], e)
    bound = 4 * 2 / np.sqrt(runs)
    assert np.all(np.abs(healthy.mean(0) - 2) < bound)
    assert np.all(np.abs(found.mean(0) - 2) < bound)
    assert np.all(naive.mean(0) > 2 + 5 * bound)


def test_stamps_of_a_repaired_log_keep_their_nanoseconds() -> None:
    """Unix times in seconds are known to 240 ns only: a repaired log has the stamps that it had."""
    scene = speed_log(23).with_fault("wheel", step(8.0, 3.0))
    begin = np.datetime64("2024-05-01T12:00:00.000000123")
    nanoseconds = np.array([round(t * 1e9) for t, _, _ in scene.rows])
    stamps = begin + nanoseconds.astype("timedelta64[ns]")
    log = sf.Log(stamps, scene.log.sensor, scene.log.value)
    filter = sf.DesyncFilter(scene.MODEL, scene.sensors, scene.X0, scene.P0)
    found = sf.diagnose(filter, log, max_faults=1, samples=FEW)
    (fault,) = found.faults
    assert (fault.channel, fault.kind) == ("wheel", "step")
    repaired = found.repaired
    assert isinstance(repaired, sf.Log)
    np.testing.assert_array_equal(repaired.stamp, log.stamp)


@pytest.mark.parametrize("kind", ["step", "sinusoid"])
def test_rows_that_cannot_be_used_stay(kind: str) -> None:
    """NaN, infinite times and values, unknown sensors: counted as before, and no harm done."""
    scene, clean = log_diagnosis(kind)
    log = scene.log
    odd = [(np.nan, "radar", 1.0), (5.0, "radar", np.nan), (np.inf, "radar", 2.0),
           (5.5, "gps", 7.0), (6.5, "radar", np.inf)]  # fmt: skip
    time, sensor, value = zip(*odd, strict=True)
    longer = sf.Log(
        np.concatenate([log.time, time]), [*log.sensor.tolist(), *sensor],
        np.concatenate([log.value, value]),
    )  # fmt: skip
    found = sf.diagnose(scene.filter, longer, max_faults=1, samples=FEW)
    repaired = found.repaired
    assert isinstance(repaired, sf.Log)
    assert isinstance(clean.repaired, sf.Log)
    np.testing.assert_array_equal(repaired.value[: len(log)], clean.repaired.value)
    known, plain = clean.estimates(), found.estimates()
    for mine, theirs in zip(plain, known, strict=True):
        np.testing.assert_array_equal(mine.x, theirs.x)
        np.testing.assert_array_equal(mine.P, theirs.P)
    assert isinstance(plain[0], sf.Result)
    assert isinstance(plain[1], sf.Result)
    assert plain[0].counts == plain[1].counts


def test_a_system_has_its_own_steps() -> None:
    _, _, found = system_diagnosis("doubled", "step")
    for settings in ({"rate": 1.0}, {"times": [1.0]}):
        with pytest.raises(sf.ConfigError, match="rate, times"):
            found.estimates(**settings)
