"""Arguments of the filter: bad ones are named, arrays are copied, and nothing of data raises."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import surefix as sf

WHEEL = sf.Sensor("wheel", 0.5)
SPEED = sf.ConstantAcceleration(jerk=0.3)
LOG = sf.Log([0.1, 0.2], ["wheel", "wheel"], [20.0, 20.1])
Filter: Any = sf.DesyncFilter  # without its types: what is refused here, type checkers refuse too


def make(sensors: Any = (WHEEL,), **options: Any) -> sf.DesyncFilter:
    made: sf.DesyncFilter = Filter(SPEED, sensors, [20.0, 0.0], np.eye(2), start=0.0, **options)
    return made


BAD: dict[str, tuple[Callable[[Any], object], str]] = {
    "one sensor": (lambda _: make(WHEEL), "sensors: expected a sequence of Sensor .*got Sensor"),
    "sensors none": (lambda _: make(None), "sensors: expected a sequence .*got None"),
    "sensors text": (lambda _: make("wheel"), "sensors: expected Sensor objects, got 'w'"),
    "capacity huge": (
        lambda _: make(capacity=10**15),
        "capacity: expected a whole number from 1 to 1000000, got 1000000000000000",
    ),
    "capacity a flag": (lambda _: make(capacity=True), "capacity: expected .*got True"),
    "capacity half": (lambda _: make(capacity=1.5), r"capacity: expected .*got 1\.5"),
    "risk text": (lambda _: make(risk="0.1"), r"risk: expected a number, got '0\.1'"),
    "add text": (lambda f: f.add_sensor("x"), "sensors: expected Sensor objects, got 'x'"),
    "add none": (lambda f: f.add_sensor(None), "sensors: expected Sensor objects, got None"),
    "noise a list": (lambda f: f.run(LOG, noise=[1]), r"noise: expected .*got \[1\]"),
    "noise a number": (lambda f: f.run(LOG, noise=1), "noise: expected .*got 1"),
    "rate a list": (lambda f: f.run(LOG, rate=[1]), r"rate: expected a number, got \[1\]"),
    "times 1e30": (lambda f: f.run(LOG, times=[1e30]), r"times: expected .*got 1e\+30"),
    "estimate huge": (lambda f: f.estimate(10**400), "time: expected a number, got 1000"),
}


@pytest.mark.parametrize(("call", "message"), BAD.values(), ids=BAD.keys())
def test_bad_argument_is_named(call: Callable[[Any], object], message: str) -> None:
    filter = make()
    before = repr(filter.save())
    with pytest.raises(sf.ConfigError, match=message):
        call(filter)
    assert repr(filter.save()) == before


@pytest.mark.parametrize(
    ("row", "status"),
    [
        ((1.0, "wheel", None), "not_finite"),
        ((1.0, "wheel", "20"), "not_finite"),
        ((1.0, "wheel", [20.0, 20.0]), "not_finite"),
        ((1.0, "wheel", 10**400), "not_finite"),
        (("30", "wheel", 20.0), "not_finite"),
        ((None, "wheel", 20.0), "not_finite"),
        ((1j, "wheel", 20.0), "not_finite"),
        ((1.0, None, 20.0), "unknown_sensor"),
        ((1.0, ["wheel"], 20.0), "unknown_sensor"),
        ((1.0, np.array(["wheel", "wheel"]), 20.0), "unknown_sensor"),
        ((np.float32(1.0), np.str_("wheel"), np.int64(20)), "ok"),
    ],
)
def test_push_never_raises_on_data(row: tuple[Any, Any, Any], status: str) -> None:
    filter = make()
    assert filter.push(*row).name == status
    assert filter.counters[status] == 1


def test_arrays_are_copied_and_read_only() -> None:
    x0, P0 = np.array([20.0, 0.0]), np.eye(2)
    filter = sf.DesyncFilter(SPEED, [WHEEL], x0, P0, start=0.0)
    expected = filter.run(LOG).x
    x0[:], P0[:] = 99.0, 99.0
    assert filter.x0.tolist() == [20.0, 0.0]
    assert np.array_equal(filter.P0, np.eye(2))
    for array in (filter.x0, filter.P0):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0
    assert np.array_equal(filter.run(LOG).x, expected)


@pytest.mark.parametrize("time", [0.1, 0.30000000004, 1.7e9 + 0.1, 1 / 3])
def test_time_of_an_estimate_is_that_of_the_result(time: float) -> None:
    """Seconds of the nanosecond at which it was made."""
    (expected,) = make().run(LOG, times=[time]).time.tolist()
    assert make().estimate(time).time == expected
