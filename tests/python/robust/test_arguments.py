"""What the robust filter refuses, before anything runs, and how it says so."""

from __future__ import annotations

import time
from collections.abc import Callable
from math import inf, nan
from typing import Any

import numpy as np
import pytest

import surefix as sf
from robust.scenes import FAULTS, A, B, make
from surefix.core.fault import FaultMode

CHAIN: dict[str, Any] = {"rate": 1e-3, "duration": 10.0}
OUT = sf.Outage(span=50.0, probability=0.1)


def sensors(count: int, faults: int, **prior: Any) -> list[sf.Sensor]:
    modes = tuple(sf.Noisy(factor=2.0 + k, **(prior or CHAIN)) for k in range(faults))
    return [sf.Sensor(f"s{i}", 1.0, faults=modes) for i in range(count)]


def with_sensors(given: Any, **options: Any) -> sf.RobustFilter:
    return sf.RobustFilter(sf.ConstantVelocity(1.0), given, [0.0], [[1.0]], **options)


def one(*faults: FaultMode) -> list[sf.Sensor]:
    return [sf.Sensor("w", 1.0, faults=faults)]


def common(modes: Any) -> list[sf.CommonFault]:
    return [sf.CommonFault(modes, 0.1)]


BAD: dict[str, tuple[dict[str, Any], type[Exception], str]] = {
    "x0 too long": ({"x0": [0.0] * 3}, sf.ShapeError, r"x0: .*\(2,\), got \(3,\)"),
    "x0 NaN": ({"x0": [0.0, nan]}, sf.ConfigError, r"x0: .*got nan at \(1,\)"),
    "P0 size": ({"P0": np.eye(3)}, sf.ShapeError, r"P0: .*\(2, 2\), got \(3, 3\)"),
    "P0 negative": ({"P0": -np.eye(2)}, sf.ConfigError, "P0: .*positive semidefinite"),
    "start NaN": ({"start": nan}, sf.ConfigError, "start: .*got nan"),
    "start beyond time": ({"start": 4e9}, sf.ConfigError, "start: .*got 4000000000.0"),
    "risk 0": ({"risk": 0.0}, sf.ConfigError, r"risk: .*\[1e-15, 1\), got 0.0"),
    "risk 1": ({"risk": 1.0}, sf.ConfigError, "risk: .*got 1.0"),
    "risk negative": ({"risk": -1e-9}, sf.ConfigError, "risk: .*got -1e-09"),
    "risk too small": ({"risk": 1e-16}, sf.ConfigError, "risk: .*got 1e-16"),
    "risk NaN": ({"risk": nan}, sf.ConfigError, "risk: .*got nan"),
    "risk a text": ({"risk": "1e-9"}, sf.ConfigError, "risk: .*got '1e-9'"),
    "sides": ({"sides": "up"}, sf.ConfigError, "sides: .*both, lower, upper, got 'up'"),
    "sides None": ({"sides": None}, sf.ConfigError, "sides: .*got None"),
    "sides a list": ({"sides": ["both"]}, sf.ConfigError, "sides: .*got .'both'"),
    "direction size": ({"direction": [1.0]}, sf.ShapeError, r"direction: .*\(2,\), got \(1,\)"),
    "direction NaN": ({"direction": [nan, 0]}, sf.ConfigError, "direction: .*got nan"),
    "prior": ({"prior": "chain"}, sf.ConfigError, "prior: .*constant, chains, got 'chain'"),
    "prior a list": ({"prior": ["chains"]}, sf.ConfigError, "prior: .*got .'chains'"),
    "carry": ({"carry": "two"}, sf.ConfigError, "carry: .*one, merge, cut, got 'two'"),
    "carry a list": ({"carry": ["one"]}, sf.ConfigError, "carry: .*got .'one'"),
    "components 0": ({"components": 0}, sf.ConfigError, "components: .*1 to 4096, got 0"),
    "components many": ({"components": 4097}, sf.ConfigError, "components: .*got 4097"),
    "components 2.5": ({"components": 2.5}, sf.ConfigError, "components: .*got 2.5"),
    "components True": ({"components": True}, sf.ConfigError, "components: .*got True"),
    "cut negative": ({"cut": -1e-20}, sf.ConfigError, "cut: .*>= 0, got -1e-20"),
    "cut NaN": ({"cut": nan}, sf.ConfigError, "cut: .*got nan"),
    "cut the risk": ({"cut": 1e-11}, sf.ConfigError, "cut: .*the risk 1e-11, got 1e-11"),
    "cut above risk": ({"cut": 0.5, "risk": 0.1}, sf.ConfigError, "cut: .*risk 0.1, got 0.5"),
    "memory 0": ({"memory": 0.0}, sf.ConfigError, "memory: .*> 0, got 0.0"),
    "memory infinite": ({"memory": inf}, sf.ConfigError, "memory: .*got inf"),
    "max_faults -1": ({"max_faults": -1}, sf.ConfigError, "max_faults: .*0 to 2, got -1"),
    "max_faults 3": ({"max_faults": 3}, sf.ConfigError, "max_faults: .*0 to 2, got 3"),
    "max_faults 1.0": ({"max_faults": 1.0}, sf.ConfigError, "max_faults: .*got 1.0"),
    "capacity": ({"capacity": 0}, sf.ConfigError, "capacity: .*got 0"),
    "common no list": ({"common": sf.CommonFault({"a": "outage"}, 1)}, sf.ConfigError, "common: "),
    "common a number": ({"common": 5}, sf.ConfigError, "common: .*got 5"),
    "common texts": ({"common": ["outage"]}, sf.ConfigError, "common: .*got 'outage'"),
    "common unknown": (
        {"common": common({"gps": "outage"})}, sf.ConfigError,
        r"no sensor 'gps'; there are \['a', 'b'\]",
    ),
    "common mode": (
        {"common": common({"a": "outage", "b": "drifting"})}, sf.ConfigError,
        r"sensor 'b' has no mode 'drifting', but \['outage'\]",
    ),
    "common healthy": (
        {"common": common({"a": "healthy"})}, sf.ConfigError, "'a' has no mode 'healthy'"
    ),
    "common max_faults": (
        {"common": common({"a": "outage"}), "max_faults": 1}, sf.ConfigError, "common: .*max_faults"
    ),
}  # fmt: skip


@pytest.mark.parametrize(("changed", "error", "message"), BAD.values(), ids=BAD.keys())
def test_bad_argument_is_named(
    changed: dict[str, Any], error: type[Exception], message: str
) -> None:
    arguments = {"x0": [20.0, 0.0], "P0": np.eye(2), **changed}
    with pytest.raises(error, match=message):
        sf.RobustFilter(sf.ConstantAcceleration(jerk=0.3), [A, B], **arguments)


Case = tuple[Callable[[], object], str]
MODES: dict[str, Case] = {
    "no prior": (lambda: sf.Outage(span=5.0), "outage: expected a probability, or a rate and a"),
    "rate alone": (lambda: sf.Outage(span=5.0, rate=1.0), "outage: .*a rate and a duration"),
    "probability 0": (lambda: sf.Outage(span=5.0, probability=0.0), "outage probability: .*0.0"),
    "probability 1": (lambda: sf.Noisy(factor=5.0, probability=1), "noisy probability: .*got 1"),
    "probability NaN": (lambda: sf.Noisy(factor=5.0, probability=nan), "noisy probability: .*nan"),
    "rate 0": (lambda: sf.Outage(span=5.0, rate=0, duration=1), "outage rate: .*got 0.0"),
    "duration 0": (lambda: sf.Outage(span=5.0, rate=1, duration=0), "outage duration: .*got 0.0"),
    "duration inf": (lambda: sf.Outage(span=5, rate=1, duration=inf), "outage duration: .*got inf"),
    "span 0": (lambda: sf.Outage(span=0.0, **CHAIN), "outage span: .*got 0.0"),
    "span a text": (lambda: sf.Outage(span="5", **CHAIN), "outage span: .*got '5'"),  # type: ignore[arg-type]
    "factor": (lambda: sf.Noisy(factor=-1.0, **CHAIN), "noisy factor: .*got -1.0"),
    "interrupted": (lambda: sf.Interrupted(factor=0.0, **CHAIN), "interrupted factor: .*got 0.0"),
    "resolution": (lambda: sf.Frozen(resolution=0, span=9, **CHAIN), "frozen resolution: .*0.0"),
    "frozen span": (lambda: sf.Frozen(resolution=1, span=0, **CHAIN), "frozen span: .*got 0.0"),
    "change 0": (lambda: sf.Frozen(resolution=1, span=9, change=0, **CHAIN), "frozen change: .*0"),
    "change 1": (lambda: sf.Frozen(resolution=1, span=9, change=1, **CHAIN), "frozen change: .*1"),
    "drift sigma": (lambda: sf.Drifting(sigma=0, walk=1, **CHAIN), "drifting sigma: .*got 0.0"),
    "walk": (lambda: sf.Drifting(sigma=1, walk=-1, **CHAIN), "drifting walk: .*got -1.0"),
    "walk NaN": (lambda: sf.Drifting(sigma=1, walk=nan, **CHAIN), "drifting walk: .*got nan"),
    "no kind": (lambda: FaultMode(probability=0.1), "FaultMode: expected one of its kinds"),
    "two drifts": (lambda: one(FAULTS[1], FAULTS[1]), "'w', faults: .*at most one that drifts"),
    "one mode": (lambda: sf.Sensor("w", 1.0, faults=OUT), "'w', faults: expected .*fault modes"),  # type: ignore[arg-type]
    "a text": (lambda: sf.Sensor("w", 1.0, faults="frozen"), "'w', faults: .*got 'f'"),  # type: ignore[arg-type]
    "a class": (lambda: one(sf.Outage), "'w', faults: expected .*fault modes, got <class"),  # type: ignore[arg-type]
    "common empty": (lambda: sf.CommonFault({}, 1.0), "common fault, modes: .*got {}"),
    "common modes": (lambda: common(["outage"]), "common fault, modes: expected sensors"),
    "common rate": (lambda: sf.CommonFault({"a": "outage"}, 0.0), "common fault, rate: .*got 0.0"),
    "sum 1": (lambda: with_sensors(sensors(1, 2, probability=0.5)), "'s0': .*less than 1, got 1"),
    "sum 1.5": (lambda: with_sensors(sensors(1, 3, probability=0.5)), "'s0': .*1, got 1.5"),
    "chains": (lambda: with_sensors(one(OUT), prior="chains"), "'w', outage: .*rate and duration"),
    "constant": (
        lambda: with_sensors(sensors(1, 1), prior="constant"), "'s0', noisy: .*needs probability"
    ),
    "mixed": (lambda: with_sensors(one(OUT, *FAULTS)), "'w', outage: .*'constant' needs prob"),
    "1 / duration": (
        lambda: with_sensors(one(sf.Noisy(factor=2.0, rate=1.0, duration=1e-310))),
        "fault modes refused: not finite",
    ),
    "sum of rates": (
        lambda: with_sensors(sensors(1, 2, rate=1e308, duration=1.0)),
        "fault modes refused: not finite",
    ),
    "constant common": (
        lambda: with_sensors(one(OUT), prior="constant", common=common({"w": "outage"})),
        "common: expected prior 'chains'",
    ),
    "common of which": (
        lambda: with_sensors(sensors(1, 2), common=common({"s0": "noisy"})),
        "'s0' has several modes 'noisy'",
    ),
    "six faults": (lambda: with_sensors(sensors(1, 6)), "'s0', faults: expected at most 5, got 6"),
    "no sensors": (lambda: with_sensors([]), "sensors: expected 1 to 16, got 0"),
    "a name": (lambda: with_sensors(["w"]), "sensors: expected Sensor objects, got 'w'"),
    "same names": (lambda: with_sensors([A, A]), "sensors: expected different names"),
    "no model": (lambda: sf.RobustFilter("CV", [A], [0.0], [[1.0]]), "model: .*got 'CV'"),  # type: ignore[arg-type]
}  # fmt: skip


@pytest.mark.parametrize(("make_it", "message"), MODES.values(), ids=MODES.keys())
def test_impossible_mode_or_prior_is_named(make_it: Callable[[], object], message: str) -> None:
    with pytest.raises(sf.ConfigError, match=message):
        make_it()


@pytest.mark.parametrize(("count", "faults", "most", "hypotheses"), [
    (16, 3, None, "4294967296"), (16, 5, None, "2821109907456"), (16, 3, 5, "1225093"),
    (15, 1, None, "32768"), (16, 5, 4, "1210581"),
])  # fmt: skip
@pytest.mark.parametrize("events", [(), (sf.CommonFault({"s0": "noisy"}, 0.1),)])
def test_too_many_hypotheses_are_refused_at_once(
    count: int, faults: int, most: int | None, hypotheses: str, events: Any
) -> None:
    begin = time.process_time()
    with pytest.raises(sf.ConfigError, match=f"{hypotheses} hypotheses, expected at most 16384"):
        with_sensors(sensors(count, faults), max_faults=most, common=events)
    assert time.process_time() - begin < 1.0


def test_as_many_hypotheses_as_there_may_be() -> None:
    filter = with_sensors(sensors(14, 1), start=0.0, carry="one", cut=0.0)
    filter.estimate(1.0)
    assert len(filter.mixture()["log_weight"]) == 2**14
    few = with_sensors(sensors(16, 3), start=0.0, max_faults=2, cut=0.0, carry="one")
    few.estimate(1.0)
    assert len(few.mixture()["log_weight"]) == 1 + 16 * 3 + 120 * 9


def test_as_many_components_as_there_may_be() -> None:
    """The beam is for hypotheses per measurement, and asks nothing of others."""
    assert make(components=4096).components == 4096


def test_joint_chain_has_a_limit_of_its_own() -> None:
    with pytest.raises(sf.ConfigError, match=r"common: expected at most 256 hypotheses.*got 512"):
        with_sensors(sensors(9, 1), common=common({"s0": "noisy"}))


LIMITS: dict[str, tuple[tuple[Any, ...], dict[str, Any], type[Exception], str]] = {
    "sum": (([0.5], [0.0], [1.0], 0.1), {}, sf.ConfigError, "weights: .*sum 0.5"),
    "negative": (([1.5, -0.5], [0, 0], [1, 1], 0.1), {}, sf.ConfigError, "weights: .*>= 0"),
    "empty": (([], [], [], 0.1), {}, sf.ConfigError, "weights: .*sum 0.0"),
    "lengths": (([1.0], [0, 1], [1.0], 0.1), {}, sf.ShapeError, r"means: .*\(1,\), got \(2,\)"),
    "matrix": (([[1.0]], [0], [1.0], 0.1), {}, sf.ShapeError, r"weights: .*got \(1, 1\)"),
    "mean": (([1.0], [nan], [1.0], 0.1), {}, sf.ConfigError, "means: .*got nan"),
    "sigma": (([1.0], [0.0], [-1.0], 0.1), {}, sf.ConfigError, "sigmas: .*>= 0, got -1.0"),
    "risk 0": (([1.0], [0.0], [1.0], 0.0), {}, sf.ConfigError, "risk: .*got 0.0"),
    "risk 1": (([1.0], [0.0], [1.0], 1.0), {}, sf.ConfigError, "risk: .*got 1.0"),
    "side": (([1.0], [0.0], [1.0], 0.1), {"sides": "up"}, sf.ConfigError, "sides: .*got 'up'"),
    "side list": (([1.0], [0.0], [1.0], 0.1), {"sides": []}, sf.ConfigError, r"sides: .*got \[\]"),
}


@pytest.mark.parametrize(("given", "named", "error", "message"), LIMITS.values(), ids=LIMITS.keys())
def test_mixture_that_is_none_is_refused(
    given: tuple[Any, ...], named: dict[str, Any], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        sf.alert_limits(*given, **named)


@pytest.mark.parametrize(("given", "message"), [
    ((0.0, 1.0), "risk_per_hour: .*got 0.0"), ((1.0, 1.0), "risk_per_hour: .*got 1.0"),
    ((0.1, 0.0), "exposures_per_hour: .*got 0.0"), ((0.1, nan), "exposures_per_hour: .*got nan"),
])  # fmt: skip
def test_risk_per_hour_that_is_none_is_refused(given: tuple[float, float], message: str) -> None:
    with pytest.raises(sf.ConfigError, match=message):
        sf.risk_per_estimate(*given)


LOG = sf.Log([0.5, 1.5], ["a", "b"], [20.0, 20.0])


@pytest.mark.parametrize(("arguments", "message"), [
    ({"rate": 1.0, "times": [1.0]}, "expected rate or times, got both"),
    ({"rate": 0.0}, "rate: expected a number > 0, got 0.0"),
    ({"times": []}, "times: expected 1 or more times"),
    ({"times": [2.0, 1.0]}, r"no estimate at 1.0 s: time_backwards"),
    ({"times": [-1.0]}, r"no estimate at -1.0 s: time_backwards"),
    ({"rate": 1.0, "delay": -0.1}, "delay: expected a number >= 0, got -0.1"),
    ({"delay": 0.1}, "delay: expected rate or times"),
])  # fmt: skip
def test_bad_argument_of_run_is_named(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(sf.ConfigError, match=message):
        make().run(LOG, **arguments)


def test_run_wants_a_log() -> None:
    with pytest.raises(sf.ConfigError, match=r"log: expected a Log, got 'log\.csv'"):
        make().run("log.csv")  # type: ignore[arg-type]


@pytest.mark.parametrize("when", [nan, inf, 4e9, "now", None])
def test_estimate_at_no_time_is_refused(when: Any) -> None:
    with pytest.raises(sf.ConfigError, match="time: expected"):
        make().estimate(when)


def test_arguments_are_kept_as_they_were() -> None:
    """What is done to them later changes nothing."""
    modes, direction = {"a": "outage"}, np.array([1.0, 0.0])
    filter = make(common=[sf.CommonFault(modes, 0.1)], direction=direction)
    modes["b"] = "outage"
    direction[0] = 5.0
    assert filter.common[0].modes == {"a": "outage"}
    assert filter.direction.tolist() == [1.0, 0.0]


def test_arguments_are_named_not_the_modes() -> None:
    make = (sf.ConstantVelocity(0.1), [sf.Sensor("a", 1.0)], [0.0], [[1.0]])
    with pytest.raises(
        sf.ConfigError, match=r"^sides: expected one of both, lower, upper, got 'up'"
    ):
        sf.RobustFilter(*make, sides="up")
    with pytest.raises(sf.ConfigError, match=r"^start: "):
        sf.RobustFilter(*make, start=1e20)


def test_noise_that_could_not_be_told_from_a_removed_row() -> None:
    faults = (sf.Noisy(factor=1e300, probability=0.1),)
    with pytest.raises(sf.ConfigError, match="fault modes refused: not finite"):
        sf.RobustFilter(
            sf.ConstantVelocity(0.1), [sf.Sensor("a", 1e10, faults=faults)], [0.0], [[1.0]]
        )
