"""Readings that say how good they are: a standard deviation of their own, not their sensor's."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import surefix as sf
from oracle.step import Array

SIGMAS = (0.5, 2.0)


def readings(seed: int) -> tuple[Array, Array, npt.NDArray[np.intp]]:
    """Times, values, and which of the two standard deviations each has."""
    random = np.random.RandomState(seed)
    time = np.sort(random.uniform(0, 20, 200)).round(6)
    which = np.asarray(random.randint(2, size=200), dtype=np.intp)
    value = 20 + 0.1 * time + np.array(SIGMAS)[which] * random.standard_normal(200)
    return time, value, which


def make(*sensors: sf.Sensor, kind: type = sf.DesyncFilter, **options: Any) -> Any:
    return kind(
        sf.ConstantAcceleration(jerk=0.1), sensors, [20.0, 0.0], np.diag([1.0, 0.1]), start=0.0,
        risk=1e-6, **options,
    )  # fmt: skip


def two_ways(seed: int) -> tuple[sf.Log, sf.Log]:
    """One sensor whose readings have their own sigma, and a sensor for each sigma."""
    time, value, which = readings(seed)
    own = np.where(np.arange(200) % 7 == 0, np.nan, np.array(SIGMAS)[which])
    own[np.isnan(own) & (which == 1)] = SIGMAS[1]  # NaN: the sensor's own, which is the first
    names = np.array(["good", "poor"])[which]
    return sf.Log(time, ["gnss"] * 200, value, own), sf.Log(time, names, value)


def kalman(time: Array, value: Array, sigma: Array, jerk: float) -> tuple[Array, Array]:
    """x and P after all readings, plainly; white jerk of density jerk² (the model's)."""
    x, P, last = np.array([20.0, 0.0]), np.diag([1.0, 0.1]), 0.0
    for t, z, s in zip(time, value, sigma, strict=True):
        dt, last = t - last, t
        F = np.array([[1.0, dt], [0.0, 1.0]])
        Q = jerk**2 * np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]])
        x, P = F @ x, F @ P @ F.T + Q
        k = P[:, 0] / (P[0, 0] + s**2)
        x, P = x + k * (z - x[0]), P - np.outer(k, P[0])
    return x, P


def test_estimates_are_those_of_a_plain_filter() -> None:
    time, value, which = readings(1)
    sigma = np.array(SIGMAS)[which]
    result = make(sf.Sensor("gnss", 1.0)).run(sf.Log(time, ["gnss"] * 200, value, sigma))
    x, P = kalman(time, value, sigma, 0.1)
    np.testing.assert_allclose(result.x[-1], x, rtol=1e-11)
    np.testing.assert_allclose(result.P[-1], P, rtol=1e-10)


@pytest.mark.parametrize("noise", ["step", "journey"])
def test_one_sensor_with_two_sigmas_is_two_sensors(noise: str) -> None:
    one, two = two_ways(2)
    a = make(sf.Sensor("gnss", SIGMAS[0])).run(one, rate=2.0, noise=noise)
    b = make(sf.Sensor("good", SIGMAS[0]), sf.Sensor("poor", SIGMAS[1])).run(
        two, rate=2.0, noise=noise
    )
    np.testing.assert_allclose(a.x, b.x, rtol=1e-12)
    np.testing.assert_allclose(a.noise, b.noise, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(a.noise_variance, b.noise_variance, rtol=1e-10)
    assert a.log_likelihood == pytest.approx(b.log_likelihood, rel=1e-12)


def test_hypotheses_per_measurement_take_it() -> None:
    one, two = two_ways(3)
    faults = (sf.Outage(probability=0.05, span=100.0),)
    options: dict[str, Any] = {"kind": sf.RobustFilter, "hypotheses": "measurement", "beam": 64}
    a = make(sf.Sensor("gnss", SIGMAS[0], faults=faults), **options).run(one, rate=1.0)
    b = make(
        sf.Sensor("good", SIGMAS[0], faults=faults), sf.Sensor("poor", SIGMAS[1], faults=faults),
        **options,
    ).run(two, rate=1.0)  # fmt: skip
    np.testing.assert_allclose(a.x, b.x, rtol=1e-9)
    np.testing.assert_allclose(a.lower, b.lower, rtol=1e-9)


def test_hypotheses_per_sensor_take_it() -> None:
    """With one mode more likely than any other by far, the numbers are those of the linear filter
    with that mode's noise; an interrupted or removed reading has no sigma to speak of."""
    one, _ = two_ways(4)
    faults = (sf.Outage(probability=1e-12, span=1e9), sf.Noisy(factor=9.0, probability=1e-12))
    robust = make(
        sf.Sensor("gnss", SIGMAS[0], faults=faults), kind=sf.RobustFilter, carry="one"
    ).run(one, rate=1.0)
    linear = make(sf.Sensor("gnss", SIGMAS[0])).run(one, rate=1.0)
    np.testing.assert_allclose(robust.x, linear.x, rtol=1e-6)
    np.testing.assert_allclose(robust.noise, linear.noise, rtol=1e-4, atol=1e-6)


def test_drift_takes_it() -> None:
    one, two = two_ways(5)
    a = sf.ForwardRecord(make(sf.Sensor("gnss", SIGMAS[0])), one)
    b = sf.ForwardRecord(make(sf.Sensor("good", SIGMAS[0]), sf.Sensor("poor", SIGMAS[1])), two)
    np.testing.assert_allclose(a.gradient, b.gradient, rtol=1e-9, atol=1e-10)
    np.testing.assert_allclose(a.nis, b.nis, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("kind", [sf.DesyncFilter, sf.RobustFilter])
def test_a_stream_gives_the_same_bits_through_save_and_restore(kind: type) -> None:
    time, value, which = readings(6)
    sigma = np.array(SIGMAS)[which]
    log = sf.Log(time, ["gnss"] * 200, value, sigma)
    batch = make(sf.Sensor("gnss", 0.7), kind=kind).run(log, times=[10.0, 20.0])
    stream = make(sf.Sensor("gnss", 0.7), kind=kind)
    for t, z, s in zip(time, value, sigma, strict=True):
        if t > 10.0 and stream.counters["ok"] == (time <= 10.0).sum():
            first = stream.estimate(10.0)
        stream.push(t, "gnss", z, s)
    stream = pickle.loads(pickle.dumps(stream))
    last = stream.estimate(20.0)
    np.testing.assert_array_equal([first.x, last.x], batch.x)


@pytest.mark.parametrize("sigma", [0.0, -1.0, np.inf, 1e-9, 1e9])
def test_a_sigma_that_is_none_is_counted(sigma: float) -> None:
    filter = make(sf.Sensor("gnss", 1.0))
    log = sf.Log([1.0, 2.0], ["gnss", "gnss"], [20.0, 20.0], [sigma, 1.0])
    assert filter.run(log).counts == {"ok": 1, "not_finite": 1}
    assert filter.push(1.0, "gnss", 20.0, sigma).name == "not_finite"
    assert filter.push(2.0, "gnss", 20.0, "good").name == "not_finite"
    assert filter.push(2.0, "gnss", 20.0, float("nan")).name == "ok"  # as in a log: the sensor's


def test_wrong_lengths_are_named() -> None:
    with pytest.raises(sf.ShapeError, match=r"log, sigma: expected shape \(2,\), got \(1,\)"):
        sf.Log([1.0, 2.0], ["a", "a"], [1.0, 2.0], [1.0])


def test_read_from_a_file(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("time_s,sensor,value,sd\n1,a,20,0.5\n2,a,21,\n")
    log = sf.read_log(path, sigma="sd")
    assert log.sigma is not None
    np.testing.assert_array_equal(log.sigma, [0.5, np.nan])
    with pytest.raises(sf.ConfigError, match="sigma: expected none with a wide table"):
        sf.read_log(path, sigma="sd", columns={"a": "value"})


def test_an_injected_fault_leaves_it() -> None:
    one, _ = two_ways(7)
    changed = sf.InjectedFault(sensor="gnss", kind="jump", start=5.0, end=10.0, size=3.0).apply(one)
    np.testing.assert_array_equal(changed.sigma, one.sigma)
