"""Saved robust filters: they continue with the same bits, and damaged ones are refused."""

from __future__ import annotations

import copy
import json
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import surefix as sf
from robust.scenes import CARRIES, KINDS, MODELS, bits, frozen, make, random_scene


def streaming(**options: Any) -> sf.RobustFilter:
    """A filter that has made an estimate at 1 s and holds two measurements."""
    filter = make(**options)
    filter.push(0.5, "a", 20.3)
    filter.push(0.6, "b", 20.1)
    filter.estimate(1.0)
    filter.push(1.5, "a", 25.0)
    filter.push(1.6, "b", 20.2)
    return filter


def restored(filter: sf.RobustFilter, **options: Any) -> sf.RobustFilter:
    other = make(**options)
    other.push(0.2, "a", 3.0)
    other.restore(filter.save())
    return other


WAYS: dict[str, Callable[..., sf.RobustFilter]] = {
    "restore": restored,
    "pickle": lambda filter, **_: pickle.loads(pickle.dumps(filter)),
    "deepcopy": lambda filter, **_: copy.deepcopy(filter),
}


def assert_continue_alike(one: sf.RobustFilter, other: sf.RobustFilter) -> None:
    assert one.counters == other.counters
    for k in (2, 3, 4):
        assert bits(one.estimate(float(k))) == bits(other.estimate(float(k)))
        assert one.log_likelihood == other.log_likelihood
        for filter in (one, other):
            filter.push(k + 0.5, "a", 20.0)
    assert frozen(one.save()) == frozen(other.save())


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("carry", CARRIES)
def test_saved_filter_continues_with_the_same_bits(way: str, carry: str) -> None:
    filter = streaming(carry=carry)
    other = WAYS[way](filter, carry=carry)
    assert frozen(other.save()) == frozen(filter.save())
    assert_continue_alike(filter, other)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("start", [None, 0.0])
@pytest.mark.parametrize("pushed", [False, True])
def test_filter_before_its_first_estimate_continues(
    way: str, start: float | None, pushed: bool
) -> None:
    filter = make(start=start)
    if pushed:
        filter.push(0.5, "a", 20.3)
    assert_continue_alike(filter, WAYS[way](filter, start=start))


@given(
    seed=st.integers(0, 2**32 - 1),
    name=st.sampled_from([*MODELS]),
    carry=st.sampled_from(CARRIES),
    components=st.sampled_from([1, 4, 36]),
)
def test_every_filter_can_be_restored(seed: int, name: str, carry: str, components: int) -> None:
    scene = random_scene(seed, name, (KINDS, ("drifting",)), measurements=20, duration=3.0)
    filter, now = scene.filter(carry=carry, components=components), -1.0
    for end in (0.5, 1.0, 2.0):
        scene.push(filter, end, now)
        filter.estimate(end)
        copied, now = pickle.loads(pickle.dumps(filter)), end
        assert frozen(copied.save()) == frozen(filter.save())
    for f in (filter, copied):
        scene.push(f, 3.0, now)
    assert bits(filter.estimate(3.0)) == bits(copied.estimate(3.0))


def test_pickled_filter_keeps_its_settings() -> None:
    options: dict[str, Any] = {
        "risk": 1e-5, "sides": "upper", "direction": [0.0, 1.0], "max_faults": 2, "carry": "cut",
        "components": 7, "cut": 1e-12, "memory": 3.0, "capacity": 5, "prior": "chains",
        "common": (sf.CommonFault({"a": "outage", "b": "outage"}, 1e-4),),
    }  # fmt: skip
    copied = pickle.loads(pickle.dumps(make(**options)))
    for name, value in options.items():
        assert np.array_equal(getattr(copied, name), value), name


def test_settings_are_plain_values() -> None:
    common = [sf.CommonFault({"a": "outage", "b": "outage"}, 1e-4)]
    settings = make(common=common).save()["settings"]
    assert json.loads(json.dumps(settings)) == settings
    assert settings["common"] == [{"modes": {"a": "outage", "b": "outage"}, "rate": 1e-4}]


@pytest.mark.parametrize("other", [
    {"carry": "one"}, {"components": 3}, {"max_faults": 1}, {"cut": 1e-13}, {"memory": 5.0},
    {"common": [sf.CommonFault({"a": "outage"}, 1e-4)]}, {"model": sf.ConstantVelocity(1.0)},
])  # fmt: skip
def test_saved_filter_of_another_kind_is_refused(other: dict[str, Any]) -> None:
    filter = make(**other)
    before = frozen(filter.save())
    with pytest.raises(sf.SurefixError, match="saved "):
        filter.restore(streaming().save())
    assert frozen(filter.save()) == before


MIXTURE = streaming().save()["components"]
C = len(MIXTURE["log_weight"])
DAMAGES: dict[str, dict[str, Any]] = {
    "no components": {"components": None},
    "no weights": {"components": {k: v for k, v in MIXTURE.items() if k != "log_weight"}},
    "no hypotheses": {"components": {k: v for k, v in MIXTURE.items() if k != "hypothesis"}},
    "empty": {"components": {k: v[:0] for k, v in MIXTURE.items()}},
    "sum": {"components": {**MIXTURE, "log_weight": MIXTURE["log_weight"] + 1e-6}},
    "weight": {"components": {**MIXTURE, "log_weight": np.full(C, np.nan)}},
    "hypothesis": {"components": {**MIXTURE, "hypothesis": [99] * C}},
    "hypothesis -1": {"components": {**MIXTURE, "hypothesis": [-1] * C}},
    "hypothesis 0.5": {"components": {**MIXTURE, "hypothesis": [0.5] * C}},
    "hypotheses": {"components": {**MIXTURE, "hypothesis": [0] * (C - 1)}},
    "x": {"components": {**MIXTURE, "x": MIXTURE["x"] + np.inf}},
    "x size": {"components": {**MIXTURE, "x": np.zeros((C, 2)), "P": np.zeros((C, 2, 2))}},
    "P negative": {"components": {**MIXTURE, "P": -MIXTURE["P"]}},
    "mass NaN": {"mass": (np.nan, 0.0, 0.0)},
    "mass negative": {"mass": (0.0, -1e-3, 0.0)},  # it would make the limits too tight
    "mass short": {"mass": (0.0, 0.0)},
    "likelihood": {"mass": (0.0, 0.0, np.inf)},
    "mode NaN": {"mode": [np.nan] * 6},
    "mode negative": {"mode": [-1.0] * 6},
    "mode short": {"mode": [1.0]},
    "mode a text": {"mode": "healthy"},
    "last NaN": {"last": ([True, True], [np.nan, 1.0])},
    "last 1e31": {"last": ([True, True], [1e31, 1.0])},
    "last short": {"last": ([True], [1.0])},
    "last no flags": {"last": ([1.5, 0], [1.0, 1.0])},
    "time later": {"time": 5 * 10**9},
    "time earlier": {"time": -5 * 10**9},
    "time 1.5": {"time": 1.5},
    "oldest": {"oldest": 0},
    "first": {"first": True},
    "first 0": {"first": 0},
    "started": {"started": False},
    "counters": {"counters": (0,)},
    "pushes": {"pushes": 1},
    "waiting before": {"waiting": ([5 * 10**8], [0], [20.0], [0], [1.0])},
    "waiting NaN": {"waiting": ([15 * 10**8], [0], [np.nan], [0], [1.0])},
    "waiting 1e31": {"waiting": ([15 * 10**8], [0], [1e31], [0], [1.0])},
    "waiting sensor": {"waiting": ([15 * 10**8], [2], [20.0], [0], [1.0])},
    "waiting factor": {"waiting": ([15 * 10**8], [0], [20.0], [0], [1e7])},
    "waiting lengths": {"waiting": ([15 * 10**8], [0, 1], [20.0], [0], [1.0])},
    "settings": {"settings": None},
}


@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES.keys())
def test_damaged_saved_state_is_refused(damage: dict[str, Any]) -> None:
    """A file that was cut or edited is an error of surefix, never a poisoned filter."""
    filter, twin = make(), make()
    for f in (filter, twin):
        f.push(0.3, "a", 20.1)
    with pytest.raises((sf.ConfigError, sf.ShapeError), match="saved"):
        filter.restore({**streaming().save(), **damage})
    assert frozen(filter.save()) == frozen(twin.save())
    assert filter.counters == twin.counters
    assert bits(filter.estimate(1.0)) == bits(twin.estimate(1.0))


@pytest.mark.parametrize("missing", sorted(streaming().save()))
def test_cut_saved_state_is_refused(missing: str) -> None:
    filter, saved = make(), streaming().save()
    del saved[missing]
    with pytest.raises(sf.ConfigError, match=f"saved: missing '{missing}'"):
        filter.restore(saved)


@pytest.mark.parametrize("saved", [None, 5, [], "saved"])
def test_saved_state_that_is_none_is_refused(saved: Any) -> None:
    with pytest.raises(sf.ConfigError, match="saved: expected a mapping"):
        make().restore(saved)


def test_posterior_of_the_modes_is_a_distribution() -> None:
    """Of one Gaussian; without it the next prior would be wrong."""
    filter = make(carry="one")
    saved = streaming(carry="one").save()
    with pytest.raises(sf.ConfigError, match="saved mode: "):
        filter.restore({**saved, "mode": [0.5 * p for p in saved["mode"]]})


def test_more_than_fits_is_refused() -> None:
    small = make(capacity=1)
    with pytest.raises(sf.ConfigError, match="more measurements wait than capacity 1 holds"):
        small.restore(streaming().save())


def test_saved_state_is_not_the_filter() -> None:
    filter = streaming()
    saved = filter.save()
    kept = frozen(saved)
    filter.estimate(2.0)
    assert frozen(saved) == kept
    going = frozen(filter.save())
    saved["components"]["x"][:] = 99.0
    saved["components"]["P"][:] = 99.0
    assert frozen(filter.save()) == going


def test_no_mixture_of_another_state() -> None:
    """The hypotheses of the last step are not saved; a restored filter shows none."""
    filter = sf.RobustFilter(
        sf.ConstantVelocity(0.1),
        [sf.Sensor("a", 1.0, faults=(sf.Outage(span=50.0, probability=0.1),))],
        [0.0], [[1.0]], start=0.0,
    )  # fmt: skip
    saved = filter.save()
    filter.push(0.5, "a", 1.0)
    filter.estimate(1.0)
    assert len(filter.mixture()["log_weight"]) == 2
    filter.restore(saved)
    assert len(filter.mixture()["log_weight"]) == 0
