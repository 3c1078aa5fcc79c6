"""What the drift detectors refuse, before anything runs, and how they say so."""

from __future__ import annotations

from math import inf, nan
from typing import Any

import numpy as np
import pytest

import surefix as sf
from drift.scenes import irregular, logged, particle
from switching.refused import ANY, SHAPE, VALUE, Refused, refuses

wrongly: Any = sf  # called with what a type checker refuses
SCENE = irregular(10)
Z = SCENE.simulated(1, 1)[0]
ONE = particle(10)


def record(**changed: Any) -> Any:
    given = {"z": Z, "times": SCENE.times, "inputs": SCENE.inputs, "channels": ("a", "b")}
    given.update(changed)
    system = given.pop("system", SCENE.system)
    return sf.ForwardRecord(system, given.pop("z"), **given)


def with_value(array: Any, place: tuple[int, ...], value: float) -> Any:
    out = np.array(array)
    out[place] = value
    return out


RUNS = np.stack([Z, Z])
OTHER_PATTERN = with_value(RUNS, (1, 3, 0), nan if not np.isnan(Z[3, 0]) else 1.0)
RECORDS: dict[str, Refused] = {
    "z steps": (lambda: record(z=Z[:5]), SHAPE, "z: "),
    "z components": (lambda: record(z=Z[:, :1]), SHAPE, r"z: .*\(10, 1\)"),
    "z one axis": (lambda: record(z=Z[:, 0]), SHAPE, r"z: .*\(10,\)"),
    "z four axes": (lambda: record(z=RUNS[None]), SHAPE, "z: "),
    "z no step": (
        lambda: sf.ForwardRecord(ONE.system, np.zeros((0, 1))), SHAPE, r"z: .*\(0, 1\)",
    ),
    "z no run": (lambda: record(z=np.zeros((0, 10, 2))), SHAPE, r"z: .*\(0, 10, 2\)"),
    "z infinite": (lambda: record(z=with_value(Z, (0, 0), inf)), VALUE, "z: .*inf"),
    "z minus infinity": (lambda: record(z=with_value(Z, (9, 1), -inf)), VALUE, "z: .*inf"),
    "z infinite in a run": (lambda: record(z=with_value(RUNS, (1, 0, 0), inf)), VALUE, "z: .*inf"),
    "z of texts": (lambda: record(z=[["1", "2"]] * 10), SHAPE, "z: .*'1'"),
    "z missing in one run only": (lambda: record(z=OTHER_PATTERN), ANY, "z: "),
    "times length": (lambda: record(times=SCENE.times[:9]), SHAPE, r"times: .*\(9,\)"),
    "times axes": (lambda: record(times=SCENE.times[None]), SHAPE, r"times: .*\(1, 10\)"),
    "times NaN": (lambda: record(times=with_value(SCENE.times, (4,), nan)), VALUE, "times: .*nan"),
    "times infinite": (
        lambda: record(times=with_value(SCENE.times, (9,), inf)), VALUE, "times: .*inf",
    ),
    "times backwards": (lambda: record(times=SCENE.times[::-1]), VALUE, "times: "),
    "times once backwards": (
        lambda: record(times=with_value(SCENE.times, (5,), 0.0)), VALUE, "times: .*0.0",
    ),
    "times a text": (lambda: record(times="now"), SHAPE, "times: .*'now'"),
    "inputs length": (lambda: record(inputs=np.zeros((10, 3))), SHAPE, r"inputs: .*\(10, 3\)"),
    "inputs states": (lambda: record(inputs=np.zeros((9, 2))), SHAPE, r"inputs: .*\(9, 2\)"),
    "inputs axes": (lambda: record(inputs=np.zeros(9)), SHAPE, r"inputs: .*\(9,\)"),
    "inputs NaN": (
        lambda: record(inputs=with_value(SCENE.inputs, (2, 1), nan)), VALUE, "inputs: .*nan",
    ),
    "inputs infinite": (
        lambda: record(inputs=with_value(SCENE.inputs, (2, 1), inf)), VALUE, "inputs: .*inf",
    ),
    "channels count": (lambda: record(channels=("a",)), ANY, "channels: .*2"),
    "channels twice": (lambda: record(channels=("a", "a")), VALUE, "channels: .*different"),
    "channels numbers": (lambda: record(channels=(0, 1)), VALUE, "channels: "),
    "channels a text": (lambda: record(channels="ab"), VALUE, "channels: .*'ab'"),
    "channels a number": (lambda: record(channels=5), VALUE, "channels: .*5"),
    "system a text": (lambda: record(system="system"), VALUE, "source: .*'system'"),
    "system None": (lambda: record(system=None), VALUE, "source: .*None"),
    "log a path": (
        lambda: wrongly.ForwardRecord(logged().filter, "log.csv"), VALUE, r"data: .*'log\.csv'",
    ),
    "log an array": (lambda: wrongly.ForwardRecord(logged().filter, Z), VALUE, "data: "),
    "times of a log": (
        lambda: wrongly.ForwardRecord(logged().filter, logged().log, times=[0.0]),
        VALUE, "times.*: ",
    ),
    "inputs of a log": (
        lambda: wrongly.ForwardRecord(logged().filter, logged().log, inputs=[[0.0]]),
        VALUE, "inputs.*: ",
    ),
    "gradient's system": (lambda: wrongly.likelihood_gradient("it", Z), VALUE, "source: .*'it'"),
    "gradient's z": (
        lambda: sf.likelihood_gradient(SCENE.system, Z[:, :1]), SHAPE, r"z: .*\(10, 1\)",
    ),
    "gradient's infinity": (
        lambda: sf.likelihood_gradient(SCENE.system, with_value(Z, (0, 0), inf)), VALUE, "z: .*inf",
    ),
    "gradient's inputs": (
        lambda: sf.likelihood_gradient(SCENE.system, Z, inputs=np.zeros((9, 2))),
        SHAPE, r"inputs: .*\(9, 2\)",
    ),
    "gradient's log": (
        lambda: wrongly.likelihood_gradient(logged().filter, Z), VALUE, "data: ",
    ),
}  # fmt: skip


@refuses(RECORDS)
def test_records(make: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        make()


P = wrongly.Profile
PROFILES: dict[str, Refused] = {
    "A not square": (lambda: P(np.ones((2, 3)), [1, 0], [0, 1]), SHAPE, r"A: .*\(2, 3\)"),
    "A a number": (lambda: P(1.0, [1], [1]), SHAPE, "A: "),
    "A empty": (lambda: P(np.zeros((0, 0)), [], []), SHAPE, "(A|output): "),
    "A too large": (lambda: P(np.eye(5), np.eye(5)[0], np.eye(5)[0]), SHAPE, "(A|output): .*4.*5"),
    "A NaN": (lambda: P([[nan]], [1], [1]), VALUE, "A: .*nan"),
    "A infinite": (lambda: P([[inf]], [1], [1]), VALUE, "A: .*inf"),
    "output size": (lambda: P(np.eye(2), [1], [0, 1]), SHAPE, r"(A|output): .*\(2,"),
    "output axes": (lambda: P(np.eye(2), np.eye(2), [0, 1]), SHAPE, "output: "),
    "output NaN": (lambda: P(np.eye(2), [nan, 1], [0, 1]), VALUE, "output: .*nan"),
    "onset size": (lambda: P(np.eye(2), [1, 0], [1]), SHAPE, r"onset: .*\(1,\)"),
    "onset rows": (lambda: P(np.eye(2), [1, 0], np.ones((3, 1))), SHAPE, r"onset: .*\(3, 1\)"),
    "onset axes": (lambda: P(np.eye(2), [1, 0], np.ones((1, 2, 2))), SHAPE, "onset: "),
    "onset NaN": (lambda: P(np.eye(2), [1, 0], [nan, 1]), VALUE, "onset: .*nan"),
    "onset no amplitude": (lambda: P(np.eye(2), [1, 0], np.zeros((2, 0))), ANY, "onset: "),
    "onset more amplitudes than states": (
        lambda: P(np.eye(2), [1, 0], np.ones((2, 3))), ANY, "onset: ",
    ),
    "name a number": (lambda: P([[0]], [1], [1], name=3), VALUE, "name: .*3"),
    "exponential 0": (lambda: P.exponential(0.0), VALUE, "time: .*0"),
    "exponential NaN": (lambda: P.exponential(nan), VALUE, "time: .*nan"),
    "exponential infinite": (lambda: P.exponential(inf), VALUE, "time: .*inf"),
    "exponential a text": (lambda: P.exponential("1"), VALUE, "time: .*'1'"),
    "sine 0": (lambda: P.sine(0.0), VALUE, "frequency: .*0"),
    "sine negative": (lambda: P.sine(-0.1), VALUE, "frequency: .*-0.1"),
    "sine NaN": (lambda: P.sine(nan), VALUE, "frequency: .*nan"),
    "sine infinite": (lambda: P.sine(inf), VALUE, "frequency: .*inf"),
    "elapsed negative": (lambda: P.ramp().value([-1.0]), VALUE, "elapsed: .*-1"),
    "elapsed NaN": (lambda: P.ramp().value([nan]), VALUE, "elapsed: .*nan"),
    "elapsed axes": (lambda: P.ramp().value([[1.0]]), SHAPE, r"elapsed: .*\(1, 1\)"),
}  # fmt: skip


@refuses(PROFILES)
def test_profiles(make: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        make()


def onset(channel: Any = None, **options: Any) -> Any:
    return sf.OnsetDetector(options.pop("profile", P.ramp()), channel, **options)


def spectrum(channel: Any = None, **options: Any) -> Any:
    return sf.SpectrumDetector(channel, **options)


GIVEN = record()
DETECTORS: dict[str, Refused] = {
    "profile a text": (lambda: onset(profile="ramp"), VALUE, "profile: .*'ramp'"),
    "profile a class": (lambda: onset(profile=P), VALUE, "profile: "),
    "profile None": (lambda: wrongly.OnsetDetector(None), VALUE, "profile: .*None"),
    "ends of two amplitudes": (lambda: onset(profile=P.sine(0.1), ends=True), VALUE, "ends: "),
    "frequencies zero": (lambda: spectrum(frequencies=[0.0, 0.1]), VALUE, "frequencies: .*0"),
    "frequencies negative": (lambda: spectrum(frequencies=[-0.1]), VALUE, "frequencies: .*-0.1"),
    "frequencies NaN": (lambda: spectrum(frequencies=[0.1, nan]), VALUE, "frequencies: .*nan"),
    "frequencies infinite": (lambda: spectrum(frequencies=[inf]), VALUE, "frequencies: .*inf"),
    "frequencies none": (lambda: spectrum(frequencies=[]), ANY, "frequencies: "),
    "frequencies axes": (lambda: spectrum(frequencies=[[0.1]]), SHAPE, r"frequencies: .*\(1, 1\)"),
    "frequencies a text": (lambda: spectrum(frequencies="all"), SHAPE, "frequencies: .*'all'"),
    "oversampling 0": (lambda: spectrum(oversampling=0), VALUE, "oversampling: .*0"),
    "oversampling NaN": (lambda: spectrum(oversampling=nan), VALUE, "oversampling: .*nan"),
    "oversampling a text": (lambda: spectrum(oversampling="2"), VALUE, "oversampling: .*'2'"),
}
BAD: dict[str, tuple[Any, ...]] = {
    "false_alarm": (0.0, 1.0, -0.1, nan, "1e-3"),
    "samples": (-1, 1.5, True, nan, "many"),
    "seed": (-1, 0.5, nan, "s", True),
    "channel": (
        *(5, 1.5, ["a"], {}, {1: 1.0}),
        *({"a": 0.0}, {"a": nan}, {"a": inf}, {"a": "1"}),
    ),
}


def bad(make: Any, argument: str, value: Any) -> Refused:
    """As late as at the first run, which knows the channels."""
    options = {"channel": "a", argument: value}
    return lambda: make(**options).run(GIVEN), ANY, f"{argument}.*: "


for _name, _make in (("onset", onset), ("spectrum", spectrum)):
    for _argument, _values in BAD.items():
        DETECTORS |= {
            f"{_name}, {_argument} {value!r}": bad(_make, _argument, value) for value in _values
        }


@refuses(DETECTORS)
def test_detectors(make: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        make()


USES: dict[str, Refused] = {
    "onset of a text": (lambda: onset().run("record"), VALUE, "record: .*'record'"),
    "onset of data": (lambda: onset().run(Z), VALUE, "record: "),
    "threshold of data": (lambda: onset().threshold(Z), VALUE, "record: "),
    "spectrum of None": (lambda: spectrum().run(None), VALUE, "record: .*None"),
    "spectrum's threshold": (lambda: spectrum().threshold(None), VALUE, "record: .*None"),
    "no such channel": (lambda: onset("c").run(GIVEN), VALUE, "channel: (?=.*'c').*a'?, '?b"),
    "no such channel, threshold": (lambda: onset("c").threshold(GIVEN), VALUE, "channel: .*'c'"),
    "one of a direction": (
        lambda: onset({"a": 1.0, "c": 1.0}).run(GIVEN), VALUE, "channel: (?=.*'c').*a'?, '?b",
    ),
    "which of two": (lambda: onset().run(GIVEN), VALUE, "channel: .*a'?, '?b"),
    "spectrum, no such": (lambda: spectrum("c").run(GIVEN), VALUE, "channel: (?=.*'c').*a'?, '?b"),
    "spectrum, which": (lambda: spectrum().run(GIVEN), VALUE, "channel: .*a'?, '?b"),
    "sensor of a log": (
        lambda: onset("lidar").run(logged().record), VALUE, "channel: (?=.*'lidar').*wheel",
    ),
    "which sensor": (lambda: onset().run(logged().record), VALUE, "channel: .*wheel"),
}  # fmt: skip


@refuses(USES)
def test_uses(make: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        make()


def test_a_prediction_that_overflows_is_refused() -> None:
    one = np.eye(1)
    system = wrongly.LinearSystem(1e200 * one, one, one, one, [1.0], one)
    with pytest.raises(sf.NumericalError, match="system"):
        sf.ForwardRecord(system, np.ones((5, 1)))


def test_a_profile_that_overflows_is_refused() -> None:
    """exp(1e6) is no number."""
    growing = sf.OnsetDetector(sf.Profile.exponential(-1e-5))
    with pytest.raises(sf.NumericalError, match="profile"):
        growing.run(ONE.record(ONE.simulated(1, 1)[0]))


def test_refused_data_do_not_poison_what_comes_after() -> None:
    before = record().gradient
    for bad in (RECORDS["z infinite"], RECORDS["times NaN"]):
        with pytest.raises(bad[1], match=bad[2]):
            bad[0]()
    np.testing.assert_array_equal(record().gradient, before)
