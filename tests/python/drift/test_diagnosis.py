"""Diagnosis: the right sensor, the right course, and nothing where there is nothing."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from itertools import product
from math import inf, log, nan
from typing import Any

import numpy as np
import pytest

import surefix as sf
from drift.scenes import faulty, irregular, particle
from drift.two_sensors import Course, SpeedLog, doubled, pulse, ramp, speed_log, step
from oracle.drift import Dense
from oracle.step import Array
from switching.refused import ANY, SHAPE, VALUE, refuses

wrongly: Any = sf  # called with what a type checker refuses
STEP, RAMP = sf.Profile.step(), sf.Profile.ramp()
PARAMETERS = {"step": 2, "ramp": 2, "step (ends)": 3, "ramp (ends)": 3, "sinusoid": 3, "sine": 3}
FEW = 16  # samples, where p-values do not matter
SAMPLES = 256


class Case:
    """Data with faults, as the library and as the oracle take them."""

    def __init__(self, where: str, seed: int, faults: dict[str, Course]) -> None:
        self._dense: Callable[[], Dense]
        if where == "log":
            scene: SpeedLog = speed_log(seed)
            for name, course in faults.items():
                scene = scene.with_fault(name, course)
            self.source: Any = scene.filter
            self.data: Any = scene.log
            self.settings: dict[str, Any] = {}
            self._dense = lambda: scene.dense
            self.time = {name: scene.valid[scene.of(name)] for name in scene.channels}
            return
        both = doubled()
        z = both.simulated(1, seed)[0]
        for name, course in faults.items():
            z = faulty(z, course(both.times), both.channels.index(name))
        self.source, self.data = both.system, z
        self.settings = {"times": both.times, "inputs": both.inputs, "names": both.channels}
        self._dense = lambda: both.dense(z)
        self.time = dict.fromkeys(both.channels, both.times)

    def diagnosed(self, **settings: Any) -> sf.Diagnosis:
        return sf.diagnose(
            self.source, self.data, **{"samples": SAMPLES, **self.settings, **settings}
        )

    def record(self) -> sf.ForwardRecord:
        given = {{"names": "channels"}.get(k, k): v for k, v in self.settings.items()}
        return sf.ForwardRecord(self.source, self.data, **given)

    @property
    def oracle(self) -> Dense:
        return self._dense()


each_source = pytest.mark.parametrize("where", ["log", "system"])
each_channel = pytest.mark.parametrize("channel", ["wheel", "radar"])
ONSET, SECOND = {"log": 8.0, "system": 20.0}, {"log": 14.0, "system": 40.0}
SLOPE = {"log": 0.4, "system": 0.2}
PULSE = {"log": (4.0, 7.0), "system": (10.0, 18.0)}
SMALL = {"log": 0.25, "system": 0.35}


def standard_errors(case: Case, channel: str, derivatives: Array) -> Array:
    """Of all parameters of a course together, from the dense covariance and the course's
    ``derivatives`` (M, parameters) by them; those claimed are given the onset or frequency."""
    d = case.oracle
    own = d.channel == ["wheel", "radar"].index(channel)
    white = d.whiten(np.where(own[:, None], derivatives, 0.0)).astype(np.float64)
    return np.asarray(np.sqrt(np.diag(np.linalg.inv(white.T @ white))))


def ramp_errors(case: Case, channel: str, onset: float, slope: float, end: float = inf) -> Array:
    """Of slope and onset, and of an end if there is one."""
    t = case.oracle.time
    by = [ramp(onset, 1.0, end)(t), step(onset, -slope)(t), step(end, slope)(t)]
    return standard_errors(case, channel, np.stack(by[: 3 if end < inf else 2], axis=1))


def interval(times: Array) -> float:
    """The longest: an onset is one of the times."""
    return float(np.diff(times).max())


@each_channel
@each_source
def test_a_ramp(where: str, channel: str) -> None:
    began, slope = ONSET[where], SLOPE[where]
    case = Case(where, 1, {channel: ramp(began, slope)})
    found = case.diagnosed(max_faults=1)
    (fault,) = found.faults
    assert (fault.channel, fault.kind) == (channel, "ramp")
    assert fault.onset is not None
    se = ramp_errors(case, channel, began, slope)
    assert abs(fault.amplitude - slope) < 4 * se[0]
    assert abs(fault.onset - began) < 4 * se[1] + interval(case.time[channel])
    assert np.all(se < [0.1 * slope, 1.0])  # so that this says something
    assert fault.amplitude_se <= se[0]
    assert fault.p_value < found.false_alarm == 1e-3
    assert found.detected


@each_channel
@each_source
def test_a_step(where: str, channel: str) -> None:
    """Of 10 and 15 σ: to the sample."""
    case = Case(where, 2, {channel: step(ONSET[where], 3.0)})
    (fault,) = case.diagnosed(max_faults=1).faults
    assert (fault.channel, fault.kind) == (channel, "step")
    assert fault.onset == min(t for t in case.time[channel] if t >= ONSET[where])
    assert abs(fault.amplitude - 3.0) < 4 * fault.amplitude_se
    assert fault.amplitude_se < 0.3
    assert (fault.end, fault.frequency, fault.phase) == (None, None, None)


@each_channel
@each_source
def test_a_sinusoid(where: str, channel: str) -> None:
    """All three against the standard errors of frequency, amplitude and phase together, from the
    dense covariance and the derivatives by them."""
    frequency, amplitude, phase = 0.43, 0.6, 0.7
    begins = min(float(case_times[0]) for case_times in Case(where, 3, {}).time.values())

    def course(t: Array, f: float = frequency, p: float = phase) -> Array:
        return np.asarray(amplitude * np.sin(2 * np.pi * f * (t - begins) + p))

    case = Case(where, 3, {channel: course})
    (fault,) = case.diagnosed(max_faults=1).faults
    assert (fault.channel, fault.kind) == (channel, "sinusoid")
    assert (fault.onset, fault.end, fault.origin) == (None, None, begins)
    t = case.oracle.time
    slope = amplitude * np.cos(2 * np.pi * frequency * (t - begins) + phase)
    by = [2 * np.pi * (t - begins) * slope, course(t) / amplitude, slope]
    se = standard_errors(case, channel, np.stack(by, axis=1))
    assert fault.frequency is not None
    assert fault.phase is not None
    error = np.array(
        [fault.frequency - frequency, fault.amplitude - amplitude, fault.phase - phase]
    )
    assert np.all(np.abs(error) < 4 * se)
    assert np.all(se < [0.01, 0.1, 0.4])  # so that this says something


@each_source
def test_two_faults_in_different_sensors(where: str) -> None:
    """One after the other: none knows of the other, so that both are as good as alone."""
    began, ended = PULSE[where]
    course = {"wheel": pulse(began, -1.0, ended), "radar": ramp(SECOND[where], SLOPE[where])}
    found = Case(where, 4, course).diagnosed(ends=True, max_faults=3)
    by = {f.channel: f for f in found.faults}
    assert [(c, by[c].kind) for c in ("wheel", "radar")] == [
        ("wheel", "step (ends)"), ("radar", "ramp"),
    ]  # fmt: skip
    assert len(found.faults) == 2
    case = Case(where, 4, course)
    own = case.time["wheel"]
    assert (by["wheel"].onset, by["wheel"].end) == (own[own >= began][0], own[own >= ended][0])
    assert abs(by["wheel"].amplitude + 1.0) < 4 * by["wheel"].amplitude_se
    se = ramp_errors(case, "radar", SECOND[where], SLOPE[where])
    assert abs(by["radar"].amplitude - SLOPE[where]) < 4 * se[0]
    onset = by["radar"].onset
    assert onset is not None
    assert abs(onset - SECOND[where]) < 4 * se[1] + interval(case.time["radar"])
    one = case.diagnosed(ends=True, max_faults=1)
    assert [f.channel for f in one.faults] == [found.faults[0].channel]


def test_two_faults_at_once() -> None:
    """The first is fitted while the second is still there, which moves its numbers, not its
    sensor."""
    case = Case("log", 4, {"wheel": step(8.0, -3.0), "radar": ramp(14.0, 0.4)})
    found = case.diagnosed(max_faults=2).faults
    assert {(f.channel, f.kind) for f in found} == {("wheel", "step"), ("radar", "ramp")}


@each_source
def test_each_fault_is_subtracted_before_the_next_is_sought(where: str) -> None:
    """The second of two is the first of what a diagnosis of one left, to the bit."""
    case = Case(
        where, 4, {"wheel": step(ONSET[where], -3.0), "radar": ramp(SECOND[where], SLOPE[where])}
    )
    both = case.diagnosed(max_faults=2, samples=FEW)
    first = case.diagnosed(max_faults=1, samples=FEW)
    case.data = first.repaired
    second = case.diagnosed(max_faults=1, samples=FEW)
    for known, fault in zip((first.faults[0], second.faults[0]), both.faults, strict=True):
        assert (known.channel, known.kind, known.onset) == (fault.channel, fault.kind, fault.onset)
        assert (known.drop, known.score, known.p_value) == (fault.drop, fault.score, fault.p_value)
        assert known.runner_up == fault.runner_up
    assert both.searched == first.searched != second.searched
    assert both.before == first.before
    assert both.after == second.after


@each_source
def test_healthy_data(where: str) -> None:
    """Six records with a false alarm of one in a thousand each."""
    for seed in range(6):
        case = Case(where, 100 + seed, {})
        found = case.diagnosed(samples=64)
        assert not found.detected
        assert found.faults == ()
        assert found.before == found.after
        assert found.before.nis == pytest.approx(
            1.0, abs=4 * np.sqrt(2 / found.before.measurements)
        )
        assert {s.status for s in found.searched} == {"not detected"}
        if where == "log":
            np.testing.assert_array_equal(found.repaired.value, case.data.value)  # type: ignore[union-attr]
        else:
            np.testing.assert_array_equal(np.asarray(found.repaired), case.data)


def test_share_of_false_alarms() -> None:
    """Of 300 healthy records: that each search has its share of the risk makes it at most this."""
    scene, runs, false_alarm = doubled(20), 300, 0.05
    system = scene.system
    alarms = sum(
        sf.diagnose(
            system, z, (STEP,), spectrum=False, false_alarm=false_alarm, max_faults=1,
            times=scene.times, inputs=scene.inputs, samples=64,
        ).detected
        for z in scene.simulated(runs, 31)
    )  # fmt: skip
    error = np.sqrt(false_alarm * (1 - false_alarm) / runs)
    assert 0 < alarms / runs < false_alarm + 4 * error


def test_false_alarms_of_a_log() -> None:
    """The same of logs of 40 measurements, three searches, of a larger risk so that fewer runs say
    as much."""
    runs, alarms = 80, 0
    for seed in range(runs):
        scene = speed_log(1000 + seed, 40, 5.0)
        alarms += sf.diagnose(
            scene.filter, scene.log, channels=["radar"], frequencies=[0.5, 1.0, 2.0],
            false_alarm=0.2, max_faults=1, samples=64,
        ).detected  # fmt: skip
    assert 0 < alarms / runs < 0.2 + 4 * np.sqrt(0.2 * 0.8 / runs)


@cache
def three_kinds(where: str) -> tuple[Case, sf.Diagnosis]:
    case = Case(where, 5, {"wheel": ramp(ONSET[where], SLOPE[where])})
    profiles = (STEP, RAMP, sf.Profile.sine(0.3))
    return case, case.diagnosed(profiles=profiles, ends=True, max_faults=1, samples=FEW)


@each_source
def test_every_search_is_listed(where: str) -> None:
    """With ends only where there is one amplitude."""
    _, found = three_kinds(where)
    kinds = ["step", "step (ends)", "ramp", "ramp (ends)", "sine", "sinusoid"]
    listed = [(s.channel, s.kind) for s in found.searched]
    assert len(listed) == 12
    assert set(listed) == set(product(["wheel", "radar"], kinds))
    for s in found.searched:
        assert (s.onset is None) == (s.kind == "sinusoid")
        assert (s.frequency is None) == (s.kind != "sinusoid")
        assert s.reason == ""


@each_source
def test_scores(where: str) -> None:
    """𝓛's drop less ln N for every parameter; the onset, the end, the frequency are some."""
    _, found = three_kinds(where)
    size = found.before.measurements
    assert size == (150 if where == "log" else 240)
    for s in found.searched:
        assert s.drop is not None
        assert s.score == pytest.approx(s.drop - PARAMETERS[s.kind] * log(size), rel=1e-14)
    (fault,) = found.faults
    assert fault.parameters == PARAMETERS[fault.kind]
    assert fault.score == pytest.approx(fault.drop - fault.parameters * log(size), rel=1e-14)
    detected = [s.score for s in found.searched if s.status == "detected" and s.score is not None]
    assert fault.score == max(detected)
    assert len(detected) > 1


@each_source
def test_the_runner_up_is_the_next_best(where: str) -> None:
    _, found = three_kinds(where)
    (fault,) = found.faults
    scores = {(s.channel, s.kind): s.score for s in found.searched if s.score is not None}
    assert scores.pop((fault.channel, fault.kind)) == fault.score
    next_best = max(scores, key=lambda key: scores[key])
    assert fault.runner_up == (*next_best, scores[next_best])


@pytest.mark.parametrize("slope", [0.1, 0.4])
def test_rivals(slope: float) -> None:
    """Channels that may as well be the faulty one: odds of less than 20 to 1, of a score that is
    twice a logarithm of them. Of a weak ramp there is one, of a strong one there is none."""
    case = Case("log", 5, {"radar": ramp(14.0, slope)})
    found = case.diagnosed(max_faults=1, samples=FEW)
    (fault,) = found.faults
    least = fault.score - 2 * log(20)
    close = {s.channel for s in found.searched if s.score is not None and s.score > least}
    close.remove("radar")
    assert fault.rivals == tuple(close)
    assert len(close) == (slope == 0.1)


def test_no_runner_up_of_one_search() -> None:
    case = Case("log", 2, {"wheel": step(8.0, 3.0)})
    (fault,) = case.diagnosed(
        profiles=[STEP], channels=["wheel"], spectrum=False, max_faults=1
    ).faults
    assert fault.runner_up is None


@each_source
@pytest.mark.parametrize("kind", ["step", "ramp", "sinusoid", "step (ends)", "ramp (ends)"])
def test_the_drop_is_the_difference_of_the_fits(where: str, kind: str) -> None:
    """Exact, for every course: two passes of the filter know nothing of sweeps."""
    began, ended = ONSET[where], SECOND[where]
    course: dict[str, Course] = {
        "step": step(began, 3.0),
        "ramp": ramp(began, SLOPE[where]),
        "sinusoid": lambda t: 0.6 * np.sin(2 * np.pi * 0.43 * t + 0.7),
        "step (ends)": lambda t: step(began, 3.0)(t) - step(ended, 3.0)(t),
        "ramp (ends)": ramp(began, 2 * SLOPE[where], ended),
    }
    case = Case(where, 6, {"wheel": course[kind]})
    found = case.diagnosed(ends="ends" in kind, max_faults=1, samples=FEW)
    (fault,) = found.faults
    assert (fault.channel, fault.kind) == ("wheel", kind)
    assert found.before.inconsistency == pytest.approx(case.oracle.inconsistency, rel=1e-9)
    drop = found.before.inconsistency - found.after.inconsistency
    assert drop == pytest.approx(fault.drop, rel=1e-8)
    assert found.after.nis < found.before.nis


def test_the_drop_with_correlated_noise_and_missing_components() -> None:
    """Matrices of every step, R full, inputs on all states."""
    scene = irregular()
    z = faulty(scene.simulated(1, 9)[0], step(float(scene.times[20]), 40.0)(scene.times), 1)
    found = sf.diagnose(
        scene.system, z, times=scene.times, inputs=scene.inputs, names=scene.channels,
        spectrum=False, max_faults=1, samples=FEW,
    )  # fmt: skip
    (fault,) = found.faults
    assert (fault.channel, fault.kind) == ("b", "step")
    drop = found.before.inconsistency - found.after.inconsistency
    assert drop == pytest.approx(fault.drop, rel=1e-8)
    value = fault.value(scene.times)
    np.testing.assert_array_equal(found.repaired, faulty(z, -value, 1))


@each_source
def test_p_values_are_of_all_searches_together(where: str) -> None:
    """Six of them: each search's own, six times; at most 1."""
    case = Case(where, 7, {"radar": pulse(ONSET[where], SMALL[where], SECOND[where])})
    record, found = case.record(), case.diagnosed()
    share = found.false_alarm / 6
    own: dict[tuple[str, str], Any] = {}
    for channel in case.time:
        for profile in (STEP, RAMP):
            detector = sf.OnsetDetector(profile, channel, share, samples=SAMPLES)
            own[channel, profile.name] = detector.run(record)
        waves = sf.SpectrumDetector(channel, false_alarm=share, samples=SAMPLES)
        own[channel, "sinusoid"] = waves.run(record)
    assert len(found.searched) == 6
    for s in found.searched:
        known = own[s.channel, s.kind]
        assert s.p_value is not None
        assert s.p_value == min(1.0, 6 * known.p_at_most)
        assert s.p_value >= min(1.0, 6 * known.p_value)  # a bound where that decides
        assert s.drop is not None
        # between the frequencies that p-values are of it is larger
        assert s.drop >= known.drop if s.kind == "sinusoid" else s.drop == known.drop
        assert s.status == known.status
    values = [s.p_value for s in found.searched if s.p_value is not None]
    assert 0.0 < min(values) < 1.0 == max(values)  # both cases are met
    one = case.diagnosed(profiles=[STEP], channels=["radar"], spectrum=False)
    alone: Any = sf.OnsetDetector(STEP, "radar", found.false_alarm, samples=SAMPLES).run(record)
    assert one.searched[0].p_value == alone.p_at_most


@each_source
def test_where_a_ramp_ends(where: str) -> None:
    began, ended = ONSET[where], SECOND[where]
    case = Case(where, 8, {"radar": ramp(began, 2 * SLOPE[where], ended)})
    (fault,) = case.diagnosed(ends=True, max_faults=1, samples=64).faults
    assert (fault.channel, fault.kind) == ("radar", "ramp (ends)")
    assert fault.onset is not None
    assert fault.end is not None
    se = ramp_errors(case, "radar", began, 2 * SLOPE[where], ended)
    away = np.array([fault.amplitude - 2 * SLOPE[where], fault.onset - began, fault.end - ended])
    sample = interval(case.time["radar"])
    assert np.all(np.abs(away) < 4 * se + [0.0, sample, sample])
    assert np.all(se < [0.1, 1.0, 1.0])
    unending = case.diagnosed(max_faults=1, samples=FEW)
    assert "ends" not in unending.faults[0].kind
    assert unending.faults[0].score < fault.score


@each_source
def test_only_the_channels_that_may_be_at_fault(where: str) -> None:
    """The fault is in the other one: what is searched is listed, no other is."""
    case = Case(where, 2, {"wheel": step(ONSET[where], 3.0)})
    found = case.diagnosed(channels=["radar"], max_faults=1, samples=FEW)
    assert {s.channel for s in found.searched} == {"radar"}
    assert all(f.channel == "radar" for f in found.faults)


def test_channels_without_names() -> None:
    scene = particle(60)
    z = faulty(scene.simulated(1, 1)[0], step(30.0, 12.0)(scene.times))
    (fault,) = sf.diagnose(
        scene.system, z[:, 0], inputs=scene.inputs, max_faults=1, samples=FEW
    ).faults
    assert (fault.channel, fault.kind, fault.onset) == ("0", "step", 30.0)


def test_a_constant_channel_is_undetectable() -> None:
    """No sensor with noise repeats itself: nothing is said of it, and the other is searched."""
    scene = speed_log(9)
    stuck = tuple((t, i, 20.0 if i == 1 else v) for t, i, v in scene.rows)
    found = sf.diagnose(scene.filter, SpeedLog(scene.sensors, stuck, 0.0).log, samples=FEW)
    by = {(s.channel, s.kind): s for s in found.searched}
    assert len(by) == 6
    for kind in ("step", "ramp", "sinusoid"):
        s = by["radar", kind]
        assert s.status == "undetectable"
        assert "constant" in s.reason
        assert [s.drop, s.score, s.p_value, s.onset, s.frequency] == [None] * 5
        assert by["wheel", kind].drop is not None
    assert all(f.channel == "wheel" for f in found.faults)


def test_all_undetectable() -> None:
    scene = particle(30)
    found = sf.diagnose(scene.system, np.full((30, 1), 5.0), samples=FEW)
    assert {s.status for s in found.searched} == {"undetectable"}
    assert not found.detected
    assert found.before == found.after


def test_a_missing_channel_is_undetectable() -> None:
    both = doubled()
    z = both.simulated(1, 1)[0]
    z[:, 1] = nan
    found = sf.diagnose(both.system, z, samples=FEW)
    assert {s.channel for s in found.searched if s.status == "undetectable"} == {"1"}
    assert all(s.reason for s in found.searched if s.status == "undetectable")


def test_progress() -> None:
    told: list[tuple[int, int]] = []
    case = Case("log", 2, {"wheel": step(8.0, 3.0)})
    case.diagnosed(progress=lambda *now: told.append(now), max_faults=2, samples=FEW)
    assert told[:2] == [(1, 12), (2, 12)]
    assert told == sorted(told)
    assert told[-1] == (12, 12)
    assert {total for _, total in told} == {12}


BOTH = doubled(12)
GIVEN = BOTH.simulated(2, 1)
LOG = speed_log(1, 12)


def of_system(data: Any = GIVEN[0], **settings: Any) -> Any:
    return wrongly.diagnose(BOTH.system, data, **{"samples": FEW, **settings})


def of_log(**settings: Any) -> Any:
    return wrongly.diagnose(LOG.filter, LOG.log, **{"samples": FEW, **settings})


@refuses(
    {
        "channel unknown": (lambda: of_log(channels=["gps"]), VALUE, "channel.*'gps'"),
        "channel unknown, system": (lambda: of_system(channels=["wheel"]), VALUE, "channel.*wheel"),
        "channels a number": (lambda: of_log(channels=5), VALUE, "channels: .*5"),
        "channels none at all": (lambda: of_log(channels=[]), VALUE, "channels"),
        "profiles names": (lambda: of_log(profiles=["step"]), VALUE, "profiles: .*'step'"),
        "profiles a detector": (
            lambda: of_log(profiles=[sf.OnsetDetector(STEP)]), VALUE, "profiles: ",
        ),
        "profiles one of them": (lambda: of_log(profiles=STEP), VALUE, "profiles: "),
        "profiles none at all": (
            lambda: of_log(profiles=[], spectrum=False), VALUE, "profiles, spectrum: ",
        ),
        "several runs": (lambda: of_system(GIVEN), SHAPE, r"data: .*\(2, 12, 2\)"),
        "one run with an axis": (lambda: of_system(GIVEN[:1]), SHAPE, r"data: .*\(1, 12, 2\)"),
        "data components": (lambda: of_system(GIVEN[0, :, :1]), SHAPE, r"z: .*\(12, 1\)"),
        "data infinite": (lambda: of_system(np.full((12, 2), inf)), VALUE, "z: .*inf"),
        "data a log of a system": (lambda: of_system(LOG.log), VALUE, "data: .*Log"),
        "data an array of a filter": (
            lambda: wrongly.diagnose(LOG.filter, GIVEN[0]), VALUE, "data: .*Log",
        ),
        "source None": (lambda: wrongly.diagnose(None, GIVEN[0]), VALUE, "source: .*None"),
        "source None, a log": (lambda: wrongly.diagnose(None, LOG.log), VALUE, "source: .*None"),
        "times length": (lambda: of_system(times=np.arange(11.0)), SHAPE, r"times: .*\(11,\)"),
        "times of a log": (lambda: of_log(times=np.arange(12.0)), VALUE, "times"),
        "inputs length": (lambda: of_system(inputs=np.zeros((12, 2))), SHAPE, "inputs: "),
        "inputs of a log": (lambda: of_log(inputs=np.zeros((11, 2))), VALUE, "inputs"),
        "names count": (lambda: of_system(names=["a"]), ANY, "(channels|names): "),
        "names of a log": (lambda: of_log(names=["a", "b"]), VALUE, "(channels|names)"),
        "false_alarm zero": (lambda: of_log(false_alarm=0.0), VALUE, "false_alarm: .*0.0"),
        "false_alarm one": (lambda: of_log(false_alarm=1), VALUE, "false_alarm: .*1"),
        "max_faults zero": (lambda: of_log(max_faults=0), VALUE, "max_faults: .*0"),
        "max_faults a float": (lambda: of_log(max_faults=1.5), VALUE, "max_faults: .*1.5"),
        "samples": (lambda: of_log(samples=-1), VALUE, "samples: .*-1"),
        "frequencies": (lambda: of_log(frequencies=[2.0, 1.0]), VALUE, "frequencies: "),
    }
)  # fmt: skip
def test_refused(make: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        make()
