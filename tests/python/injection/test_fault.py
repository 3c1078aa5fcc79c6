"""Injected faults: what each does to which rows; draws that repeat; bad arguments."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import surefix as sf
from surefix.injection.draw import Sizes, draw
from surefix.injection.fault import KINDS

TIME = np.array([0.0, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0])
SENSOR = ["a", "a", "b", "a", "a", "a", "b"]
LOG = sf.Log(TIME, SENSOR, np.array([10.0, 11.0, 7.0, 12.0, 13.0, 14.0, 8.0]))


def changed(kind: str, size: float = 0.0, log: sf.Log = LOG) -> Any:
    fault = sf.InjectedFault(sensor="a", kind=kind, start=1.0, end=4.0, size=size, seed=3)
    return fault.apply(log).value.tolist()


def test_each_kind() -> None:
    """Rows at 1, 2 and 3 s: the end is excluded, the other sensor is left alone."""
    assert changed("freeze") == [10, 11, 7, 11, 11, 14, 8]
    assert changed("jump", -2.0) == [10, 9, 7, 10, 11, 14, 8]
    assert changed("ramp", 0.5) == [10, 11, 7, 12.5, 14, 14, 8]
    assert changed("scale", 0.1) == pytest.approx([10, 12.1, 7, 13.2, 14.3, 14, 8])
    noise = 0.3 * np.random.RandomState(3).standard_normal(3)
    assert changed("interruption", 0.3) == [10, noise[0], 7, noise[1], noise[2], 14, 8]


def test_rows_in_any_order() -> None:
    """What repeats is the first reading in time, not in the file."""
    order = [3, 6, 1, 0, 5, 2, 4]
    shuffled = sf.Log(TIME[order], [SENSOR[i] for i in order], LOG.value[order])
    assert changed("freeze", log=shuffled) == [11, 8, 11, 10, 14, 7, 11]


def test_log_is_left_as_it_was() -> None:
    before = LOG.value.copy()
    changed("jump", 1.0)
    np.testing.assert_array_equal(LOG.value, before)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"kind": "melt"}, "kind: expected one of freeze, .*got 'melt'"),
        ({"start": 4.0}, "end: expected later than start, 4, got 4"),
        ({"size": np.nan}, "size"),
        ({"kind": "interruption", "size": 0.0}, "size: expected a deviation > 0, got 0"),
        ({"seed": -1}, "seed"),
    ],
)
def test_bad_arguments(arguments: dict[str, Any], message: str) -> None:
    good: dict[str, Any] = {"sensor": "a", "kind": "jump", "start": 1.0, "end": 4.0, "size": 1.0}
    with pytest.raises(sf.ConfigError, match=message):
        sf.InjectedFault(**{**good, **arguments})


def test_nothing_to_change() -> None:
    fault = sf.InjectedFault(sensor="c", kind="freeze", start=1.0, end=4.0)
    with pytest.raises(sf.ConfigError, match="expected readings of 'c' from 1 to 4 s, got none"):
        fault.apply(LOG)


def test_draws() -> None:
    """Every kind in every sensor, at a reading, within the window and the sizes; more seeds change
    none of those drawn before."""
    log = sf.Log(np.arange(200) / 2, ["a", "b"] * 100, np.zeros(200))
    sensors = [sf.Sensor("a", 0.2), sf.Sensor("b", 0.3)]
    few, many = (draw(log, sensors, (10.0, 60.0), Sizes(), n, 1) for n in (3, 20))
    assert len(many) == 2 * len(KINDS) * 20
    assert all(fault in many for fault in few)
    assert len({fault.seed for fault in many}) == len(many)
    sizes = {"jump": (1, 10), "ramp": (0.05, 1), "scale": (0.05, 0.5), "freeze": (0, 0)}
    for fault in many:
        assert fault.start >= 10
        assert fault.end == fault.start + 20 <= 60
        assert fault.start in log.time[log.sensor == fault.sensor]
        low, high = sizes.get(fault.kind, (0.2, 0.3))
        assert low <= abs(fault.size) <= high
    assert {np.sign(f.size) for f in many if f.kind == "ramp"} == {-1.0, 1.0}
    assert draw(log, sensors, (10.0, 60.0), Sizes(), 3, 2) != few


def test_window_too_short() -> None:
    with pytest.raises(sf.ConfigError, match="duration: expected a reading of 'a' from 1 to -15 s"):
        draw(LOG, [sf.Sensor("a", 0.2)], (1.0, 5.0), Sizes(), 1, 1)


@pytest.mark.parametrize(
    ("sizes", "message"),
    [
        ({"duration": 0.0}, "duration"),
        ({"jump": (2.0, 1.0)}, "jump: expected 0 < smallest <= largest, got 2.0, 1.0"),
        ({"ramp": (0.0, 1.0)}, "ramp: expected 0 <"),
        ({"scale": (0.1,)}, "scale"),
    ],
)
def test_bad_sizes(sizes: dict[str, Any], message: str) -> None:
    with pytest.raises(sf.SurefixError, match=message):
        Sizes(**sizes)


def test_interruptions_differ() -> None:
    """Their noise depends on the seed, the sensor and the number of the draw."""
    log = sf.Log(np.arange(200) / 2, ["a", "b"] * 100, np.zeros(200))
    sensors = [sf.Sensor("a", 0.2), sf.Sensor("b", 0.2)]
    drawn = [f for s in (1, 2) for f in draw(log, sensors, (0.0, 99.0), Sizes(), 2, s)]
    noise = [f.apply(log).value[f.rows(log)[0]] for f in drawn if f.kind == "interruption"]
    assert len(set(noise)) == len(noise) == 8


def test_readings_that_are_no_numbers() -> None:
    """They stay what they are, and no fault begins at one."""
    value = np.where(np.arange(7) == 1, np.nan, LOG.value)
    log = sf.Log(TIME, SENSOR, value)
    for kind, size in (("freeze", 0.0), ("interruption", 0.3)):
        found = changed(kind, size, log)
        assert np.isnan(found[1])
        assert np.isfinite(np.delete(found, 1)).all()
    assert changed("freeze", log=log)[3:5] == [12, 12]
    silent = sf.Log(np.arange(100.0), ["a"] * 100, np.full(100, np.nan))
    with pytest.raises(sf.ConfigError, match="expected a reading of 'a'"):
        draw(silent, [sf.Sensor("a", 0.2)], (0.0, 99.0), Sizes(), 1, 1)


def test_sizes_that_overflow() -> None:
    with pytest.raises(sf.ConfigError, match="size: expected one that leaves finite readings"):
        changed("scale", 1e308)
