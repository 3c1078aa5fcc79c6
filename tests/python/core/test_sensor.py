"""Sensors: what they read, which states they bring, and what they refuse."""

from __future__ import annotations

import pickle
from math import inf, nan
from typing import Any

import numpy as np
import pytest

import surefix as sf
from oracle.step import Array
from surefix.core.sensor import make_system, state_names

CHAIN = sf.ConstantAcceleration(jerk=0.1, position=True)

BAD: dict[str, tuple[dict[str, Any], type[Exception], str]] = {
    "no name": ({"name": ""}, sf.ConfigError, "sensor name: expected a text, got ''"),
    "a number for a name": ({"name": 3}, sf.ConfigError, "sensor name: expected a text, got 3"),
    "no noise": ({"sigma": 0.0}, sf.ConfigError, "sensor 'w', sigma: .* > 0, got 0.0"),
    "negative sigma": ({"sigma": -1.0}, sf.ConfigError, "'w', sigma: .* > 0, got -1.0"),
    "NaN sigma": ({"sigma": nan}, sf.ConfigError, "'w', sigma: expected a finite.*got nan"),
    "infinite sigma": ({"sigma": inf}, sf.ConfigError, "'w', sigma: .*finite.*got inf"),
    "sigma of no variance": ({"sigma": 1e-160}, sf.ConfigError, "'w', sigma: .*1e-160"),
    "sigma too large": ({"sigma": 1e160}, sf.ConfigError, r"'w', sigma: .*1e\+160"),
    "scale too small": ({"scale_sigma": 1e-160}, sf.ConfigError, "'w', scale_sigma: .*1e-160"),
    "bias too large": ({"bias_sigma": 1e160}, sf.ConfigError, r"'w', bias_sigma: .*1e\+160"),
    "sigma text": ({"sigma": "1.0"}, sf.ConfigError, r"'w', sigma: expected a number, got '1\.0'"),
    "sigma missing": ({"sigma": None}, sf.ConfigError, "'w', sigma: .*number, got None"),
    "negative scale": ({"scale_sigma": -0.1}, sf.ConfigError, "'w', scale_sigma: .*got -0.1"),
    "infinite scale": ({"scale_sigma": inf}, sf.ConfigError, "'w', scale_sigma: .*got inf"),
    "negative bias": ({"bias_sigma": -0.1}, sf.ConfigError, "'w', bias_sigma: .*got -0.1"),
    "NaN bias": ({"bias_sigma": nan}, sf.ConfigError, "'w', bias_sigma: .*got nan"),
    "no scale time": ({"scale_time": 0.0}, sf.ConfigError, "'w', scale_time: .* > 0, got 0.0"),
    "NaN scale time": ({"scale_time": nan}, sf.ConfigError, "'w', scale_time: .*got nan"),
    "negative bias time": ({"bias_time": -1.0}, sf.ConfigError, "'w', bias_time: .*got -1.0"),
    "bias time -inf": ({"bias_time": -inf}, sf.ConfigError, "'w', bias_time: .*got -inf"),
    "endless latency": ({"latency": inf}, sf.ConfigError, "'w', latency: .*got inf"),
    "latency of weeks": ({"latency": 1.1e6}, sf.ConfigError, "'w', latency: .*1e.06 s.*1100000"),
    "observes a matrix": (
        {"observes": ((1.0, 0.0),)},
        sf.ShapeError,
        r"'w', observes: expected shape \(any,\), got \(1, 2\)",
    ),
    "observes NaN": (
        {"observes": (1.0, nan)},
        sf.ConfigError,
        r"'w', observes: .*got nan at \(1,\)",
    ),
    "observes text": ({"observes": ("v",)}, sf.ShapeError, r"'w', observes: .*got \('v',\)"),
}


@pytest.mark.parametrize(("arguments", "error", "message"), BAD.values(), ids=BAD.keys())
def test_bad_argument_is_named(
    arguments: dict[str, Any], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        sf.Sensor(**{"name": "w", "sigma": 1.0, **arguments})


def test_sensor_reads_the_speed_unless_it_says_otherwise() -> None:
    sensor = sf.Sensor("wheel", 1.0)
    assert sensor.row(sf.ConstantVelocity(1.0)) == [1.0]
    assert sensor.row(sf.ConstantVelocity(1.0, position=True)) == [0.0, 1.0]
    assert sensor.row(sf.ConstantAcceleration(1.0)) == [1.0, 0.0]
    assert sensor.row(CHAIN) == [0.0, 1.0, 0.0]
    assert sensor.row(sf.DiscreteModel(np.eye(2), np.eye(2), reads=1)) == [0.0, 1.0]


def test_sensor_reads_what_it_observes() -> None:
    array = sf.Sensor("gps", 1.0, observes=np.array([1.0, 0.0, 0.5]))  # type: ignore[arg-type]
    assert array == sf.Sensor("gps", 1.0, observes=(1.0, 0.0, 0.5))
    assert array.row(CHAIN) == [1.0, 0.0, 0.5]


@pytest.mark.parametrize("observes", [(), (1.0,), (1.0, 0.0, 0.0, 0.0)])
def test_row_of_the_wrong_length_names_the_sensor(observes: tuple[float, ...]) -> None:
    sensor = sf.Sensor("gps", 1.0, observes=observes)
    with pytest.raises(sf.ShapeError, match=r"'gps', observes: expected shape \(3,\), got"):
        sf.DesyncFilter(CHAIN, [sensor], np.zeros(3), np.eye(3))


SENSORS = [
    sf.Sensor("plain", 1.0),
    sf.Sensor("both", 1.0, scale_sigma=0.1, scale_time=2.0, bias_sigma=0.5, bias_time=3.0),
    sf.Sensor("scaled", 1.0, scale_sigma=0.2),
    sf.Sensor("biased", 1.0, bias_sigma=0.3, latency=0.1),
]


def test_errors_become_states_in_the_order_of_the_sensors() -> None:
    names = (*CHAIN.state_names, "both.scale", "both.bias", "scaled.scale", "biased.bias")
    assert state_names(CHAIN, SENSORS) == names
    system = make_system(CHAIN, SENSORS)
    assert system.size == len(names)
    places = [(system.scale_state(i), system.bias_state(i)) for i in range(len(SENSORS))]
    assert places == [(-1, -1), (3, 4), (5, -1), (-1, 6)]


def test_errors_wander_as_gauss_markov_processes() -> None:
    """phi = exp(-dt / tau) and sigma^2 (1 - phi^2), a constant where tau is infinite."""
    status, F, Q = make_system(CHAIN, SENSORS).transition(1_500_000_000)
    assert status == "ok"
    assert F is not None
    assert Q is not None
    F_model, Q_model = CHAIN.transition(1.5)
    decay = np.array([np.exp(-1.5 / 2.0), np.exp(-1.5 / 3.0), 1.0, 1.0])
    variance = np.array([0.1, 0.5, 0.2, 0.3]) ** 2
    np.testing.assert_allclose(np.diag(F)[3:], decay, rtol=1e-15)
    np.testing.assert_allclose(np.diag(Q)[3:], variance * (1 - decay**2), rtol=1e-15)
    blocks: list[tuple[Array, Array]] = [(F, F_model), (Q, Q_model)]
    for whole, model in blocks:
        assert np.array_equal(whole[:3, :3], model)
        assert not np.any((whole - np.diag(np.diag(whole)))[3:])
        assert not np.any(whole[:3, 3:])


def test_reading_is_scaled_and_biased() -> None:
    """z = (1 + s) h x + b, and its derivative."""
    system = make_system(CHAIN, SENSORS)
    x = np.array([5.0, 20.0, 0.3, 0.02, 0.7, -0.01, 0.4])
    rows = [
        ([0, 1, 0, 0, 0, 0, 0], 20.0),
        ([0, 1.02, 0, 20, 1, 0, 0], 1.02 * 20 + 0.7),
        ([0, 0.99, 0, 0, 0, 20, 0], 0.99 * 20),
        ([0, 1, 0, 0, 0, 0, 1], 20.4),
    ]
    for sensor, (row, reading) in enumerate(rows):
        expected = np.array(row, dtype=np.float64)
        h, z = system.row(sensor, x)
        np.testing.assert_allclose(h, expected, rtol=1e-15)
        assert z == pytest.approx(reading, rel=1e-15)


def test_sensors_need_different_names() -> None:
    twice = [sf.Sensor("w", 1.0), sf.Sensor("w", 2.0)]
    with pytest.raises(sf.ConfigError, match=r"sensors: expected different.*\['w', 'w'\]"):
        make_system(CHAIN, twice)


@pytest.mark.parametrize("count", [0, 17])
def test_number_of_sensors_is_bounded(count: int) -> None:
    sensors = [sf.Sensor(f"s{i}", 1.0) for i in range(count)]
    with pytest.raises(sf.ConfigError, match=f"sensors: expected 1 to 16, got {count}"):
        make_system(CHAIN, sensors)


def test_largest_system_has_forty_states() -> None:
    model = sf.LinearModel(np.zeros((8, 8)), np.eye(8), np.eye(8))
    sensors = [sf.Sensor(f"s{i}", 1.0, scale_sigma=0.1, bias_sigma=1.0) for i in range(16)]
    assert make_system(model, sensors).size == 40
    filter = sf.DesyncFilter(model, sensors, np.zeros(8), np.eye(8), start=0.0)
    result = filter.run(sf.Log([1.0], ["s15"], [1.0]))
    assert result.x.shape == (1, 40)
    assert result.counts == {"ok": 1}


def test_what_is_no_sensor_and_no_model_is_named() -> None:
    with pytest.raises(sf.ConfigError, match="sensors: expected Sensor objects, got 'wheel'"):
        make_system(CHAIN, ["wheel"])  # type: ignore[list-item]
    with pytest.raises(sf.ConfigError, match="model: expected a motion model, got None"):
        make_system(None, SENSORS)  # type: ignore[arg-type]


def test_sensor_is_a_value() -> None:
    sensor = SENSORS[1]
    assert pickle.loads(pickle.dumps(sensor)) == sensor
    assert len({sensor, sf.Sensor("both", 1.0)}) == 2
    with pytest.raises(AttributeError):
        sensor.sigma = 2.0  # type: ignore[misc]
