"""Saved filters: they continue in a filter of the same model and sensors, and in no other."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import surefix as sf

WHEEL = sf.Sensor("wheel", 0.5)
RADAR = sf.Sensor("radar", 0.2, latency=0.25)
SENSORS = [WHEEL, RADAR]
SPEED = sf.ConstantAcceleration(jerk=0.3)


def make(
    model: sf.Model = SPEED, sensors: list[sf.Sensor] = SENSORS, **options: Any
) -> sf.DesyncFilter:
    n = model.size
    return sf.DesyncFilter(model, sensors, np.zeros(n), np.eye(n), **{"start": 0.0, **options})


def streaming() -> sf.DesyncFilter:
    """A filter that has made an estimate at 1 s and holds two measurements."""
    filter = make()
    filter.push(0.5, "wheel", 0.1)
    filter.estimate(1.0)
    filter.push(1.5, "wheel", 0.2)
    filter.push(1.6, "radar", 0.1)
    return filter


def general(factor: float = 1.0, **options: Any) -> sf.Model:
    A = np.array([[0.0, factor], [0.0, 0.0]])
    return sf.LinearModel(A, np.array([[0.0], [1.0]]), [[0.09]], **options)


def test_settings_are_plain_values() -> None:
    """They survive JSON; a model's arrays are lists."""
    sensors = [replace(WHEEL, bias_sigma=0.1, observes=(1.0, 0.0))]
    saved = make(general(), sensors).save()
    settings = {name: saved[name] for name in ("model", "sensors")}
    assert json.loads(json.dumps(settings)) == settings
    assert settings["model"] == {
        "kind": "LinearModel", "A": [[0.0, 1.0], [0.0, 0.0]], "L": [[0.0], [1.0]], "Qc": [[0.09]],
        "names": ["x1", "x2"], "reads": 0,
    }  # fmt: skip
    assert {**settings["sensors"][0], "faults": []} == {
        "faults": [], "name": "wheel", "sigma": 0.5, "scale_sigma": 0.0, "scale_time": math.inf,
        "bias_sigma": 0.1, "bias_time": math.inf, "latency": 0.0, "observes": [1.0, 0.0],
    }  # fmt: skip


OTHERS: dict[str, tuple[sf.DesyncFilter, sf.DesyncFilter, str]] = {
    "jerk": (
        make(), make(sf.ConstantAcceleration(jerk=0.4)),
        r"saved model\.jerk: expected 0\.4, got 0\.3",
    ),
    "kind": (
        make(general(names=("speed", "acceleration"))), make(),
        r"saved model\.kind: expected 'ConstantAcceleration', got 'LinearModel'",
    ),
    "matrix": (
        make(general()), make(general(2.0)), r"saved model\.A\.0\.1: expected 2\.0, got 1\.0",
    ),
    "sigma": (
        make(), make(sensors=[WHEEL, replace(RADAR, sigma=2.0)]),
        r"saved sensors\.1\.sigma: expected 2\.0, got 0\.2",
    ),
    "latency": (
        make(), make(sensors=[WHEEL, replace(RADAR, latency=0.0)]),
        r"saved sensors\.1\.latency: expected 0\.0, got 0\.25",
    ),
    "names": (
        make(), make(sensors=[RADAR, WHEEL]),
        r"saved sensors\.0\.name: expected 'radar', got 'wheel'",
    ),
    "one more": (
        make(), make(sensors=[WHEEL]), r"saved sensors\.1\.name: expected nothing, got 'radar'",
    ),
    "one less": (
        make(sensors=[WHEEL]), make(), r"saved sensors\.1\.name: expected 'radar', got nothing",
    ),
}  # fmt: skip


@pytest.mark.parametrize(("one", "other", "message"), OTHERS.values(), ids=OTHERS.keys())
def test_another_model_or_sensor_is_refused(
    one: sf.DesyncFilter, other: sf.DesyncFilter, message: str
) -> None:
    before = repr(other.save())
    with pytest.raises(sf.ConfigError, match=message):
        other.restore(one.save())
    assert repr(other.save()) == before


def test_equal_settings_may_be_written_differently() -> None:
    one = make(sf.ConstantAcceleration(jerk=np.float64(1)), [sf.Sensor("wheel", 2)])
    make(sf.ConstantAcceleration(jerk=1), [sf.Sensor("wheel", 2.0)]).restore(one.save())
    make(general(names=("x1", "x2"))).restore(make(general()).save())


def test_sensors_that_came_while_streaming_are_those_saved() -> None:
    filter = make(sensors=[WHEEL])
    filter.add_sensor(RADAR)
    make().restore(filter.save())
    with pytest.raises(sf.ConfigError, match=r"sensors\.1\.name"):
        make(sensors=[WHEEL]).restore(filter.save())


S = 10**9
COUNTS = [0] * len(sf.Status)
DAMAGE: dict[str, tuple[Any, str]] = {
    "no mapping": ([1, 2], "saved: expected a mapping, got list"),
    "time text": ({"time": "now"}, "saved time: expected a whole .*got 'now'"),
    "time huge": ({"time": 10**30}, "saved time: expected .*, got 1000000000"),
    "oldest of another time": ({"oldest": S - 1}, "saved oldest: expected .*, got 999999999"),
    "time beyond": ({"time": 4 * 10**18}, "saved time: expected"),
    "oldest beyond": ({"oldest": -4 * 10**18}, "saved oldest: expected"),
    "started": ({"started": 1}, "saved started: expected True or False, got 1"),
    "pushes negative": ({"pushes": -1}, "saved pushes: expected .*, got -1"),
    "pushes huge": ({"pushes": 2**63}, "saved pushes: expected"),
    "counter negative": ({"counters": (-1, *COUNTS[1:])}, "saved counters: expected"),
    "counters none": ({"counters": None}, "saved counters: expected"),
    "likelihood none": ({"likelihood": None}, "saved likelihood: expected 4 entries, got None"),
    "likelihood text": ({"likelihood": ("a", 0, 0.0, 0)}, "saved likelihood: expected"),
    "likelihood zero": ({"likelihood": (0.0, 0, 0.0, 0)}, "saved likelihood: expected"),
    "likelihood NaN": ({"likelihood": (1.0, 0, math.nan, 0)}, "saved likelihood: expected"),
    "likelihood inf": ({"likelihood": (math.inf, 0, 0.0, 0)}, "saved likelihood: expected"),
    "squares inf": ({"likelihood": (1.0, 0, math.inf, 0)}, "saved likelihood: expected"),
    "exponent huge": ({"likelihood": (1.0, 2**70, 0.0, 0)}, "saved likelihood: expected"),
    "count negative": ({"likelihood": (1.0, 0, 0.0, -1)}, "saved likelihood: expected"),
    "x of objects": ({"x": [None, {}]}, "saved x: expected"),
    "P of text": ({"P": "P"}, "saved P: expected"),
    "states none": ({"states": None}, "saved: expected states"),
    "model none": ({"model": None}, r"saved model\.kind: expected .*got nothing"),
    "model an array": (
        {"model": {"kind": "ConstantAcceleration", "jerk": np.ones(2), "position": False}},
        r"saved model\.jerk: expected 0\.3, got array",
    ),
    "sensors an array": ({"sensors": np.ones(2)}, r"saved sensors\.0\.name: expected"),
    "waiting none": ({"waiting": (None, [], [], [], [])}, "saved waiting: expected"),
    "waiting number": ({"waiting": (5, 5, 5, 5, 5)}, "saved waiting: expected"),
    "waiting too early": (
        {"waiting": ([S], [0], [0.2], [1], [1.0])},
        r"saved waiting time: expected .* 1000000001 .*got 1000000000",
    ),
    "waiting too late": (
        {"waiting": ([3 * 10**18 - S // 4 + 1], [1], [0.2], [1], [1.0])},
        "saved waiting time: expected",
    ),
    "waiting sensor": (
        {"waiting": ([2 * S], ["radar"], [0.2], [1], [1.0])},
        "saved waiting sensor",
    ),
    "waiting value": (
        {"waiting": ([2 * S], [0], ["x"], [1], [1.0])},
        "saved waiting value: expected",
    ),
    "waiting factor": (
        {"waiting": ([2 * S], [0], [0.2], [1], [0.0])},
        "saved waiting factor: expected a number from 1e-06 to 1e.06, got 0",
    ),
    "waiting push to come": (
        {"waiting": ([2 * S], [0], [0.2], [3], [1.0])},
        "saved waiting number: expected .*got 3",
    ),
}


@pytest.mark.parametrize(("damage", "message"), DAMAGE.values(), ids=DAMAGE.keys())
def test_damaged_state_is_named(damage: Any, message: str) -> None:
    filter = streaming()
    before = repr(filter.save())
    saved = {**filter.save(), **damage} if isinstance(damage, dict) else damage
    with pytest.raises((sf.ShapeError, sf.ConfigError), match=message):
        filter.restore(saved)
    assert repr(filter.save()) == before


def test_a_filter_without_start_may_wait_for_anything() -> None:
    """Before its first step nothing is too late."""
    one, other = make(start=None), make(start=None)
    assert one.push(-5.0, "wheel", 1.0).name == "ok"
    assert one.push(3e9, "wheel", 1.0).name == "ok"
    other.restore(one.save())
    assert other.estimate(-4.0).degrees_of_freedom == 1
