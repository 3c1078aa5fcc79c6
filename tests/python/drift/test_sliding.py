"""The window of a filter that runs: what an onset detector finds in the same measurements."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from math import inf, nan
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2

import surefix as sf
from drift.scenes import PROFILES, Channel, LogScene, logged
from drift.two_sensors import SpeedLog, ramp, speed_log, step
from switching.refused import VALUE, refuses

wrongly: Any = sf  # called with what a type checker refuses
STEP, RAMP = sf.Profile.step(), sf.Profile.ramp()
Row = tuple[float, int, float]
FEW = 2  # samples, where p-values do not matter


def rows_between(scene: LogScene, after: float, until: float) -> list[Row]:
    """Valid after one time and until another, in the order of validity."""
    valid = {row: row[0] - scene.sensors[row[1]].latency for row in scene.rows}
    inside = [row for row in scene.rows if after < valid[row] <= until]
    return sorted(inside, key=lambda row: valid[row])


def pushed(detector: sf.SlidingDetector, scene: LogScene, rows: Sequence[Row]) -> list[str]:
    return [detector.push(t, scene.channels[i], v).name for t, i, v in rows]


def log_of(scene: LogScene, rows: Sequence[Row]) -> sf.Log:
    time, index, value = zip(*rows, strict=True)
    return sf.Log(time, [scene.channels[i] for i in index], value)


def assert_same(found: sf.SlidingFinding, record: sf.ForwardRecord, tolerance: float = 0.0) -> None:
    """As an onset detector says of the record; without a tolerance bit for bit, but for the last
    digit where Python multiplies the same numbers in another order: in the drop, and in sums over
    several amplitudes, of which some cancel."""
    known: Any = found.detector.run(record)
    if known.drop is None:
        assert found.status == "undetectable"
        return
    assert found.onset == known.onset
    q = found.detector.profile.amplitudes
    several = {"drop": 1e-15 if q == 1 else 1e-13, "amplitude": 0.0 if q == 1 else 1e-11}
    for name in ("drop", "amplitude", "amplitude_se"):
        mine, theirs = getattr(found, name), getattr(known, name)
        rtol = max(tolerance, several.get(name, 0.0))
        np.testing.assert_allclose(mine, theirs, rtol=rtol, atol=tolerance, err_msg=name)
    assert found.drop is not None
    usable = int(np.sum(np.isfinite(known.ratio)))
    assert found.onsets == usable
    bound = min(1.0, usable * float(chi2.sf(found.drop, q)))
    assert found.p_bound == pytest.approx(bound, rel=1e-10)
    beyond = bound <= found.detector.false_alarm
    assert found.status == ("detected" if beyond else "not detected")


@cache
def scenes() -> dict[str, LogScene]:
    return {
        "two sensors": speed_log(1).with_fault("radar", ramp(8.0, 0.4)),
        "three, of which one wanders": logged(start=0.0),
        "without a start": logged(),
        "one is late": logged(latency=0.7, start=-1.0),
    }


STEPS = (2.5, 2.6, 7.0, 12.0, 20.0)
# An estimate between two measurements carries the filter's belief to the second in two pieces:
# rounding of doubles, in as many steps, of which the ill-conditioned ones lose some digits more.
PIECES = 1e-9


def detectors_of(scene: LogScene, profile: sf.Profile) -> list[sf.OnsetDetector]:
    """For each sensor, and for a direction over all of them."""
    direction = dict(zip(scene.channels, (1.0, 0.5, -0.3), strict=False))
    channels: list[Channel] = [*scene.channels, direction]
    return [sf.OnsetDetector(profile, channel, 1e-3, samples=FEW) for channel in channels]


@pytest.mark.parametrize("where", scenes())
@pytest.mark.parametrize("name", PROFILES)
def test_a_window_that_holds_everything(where: str, name: str) -> None:
    """Bit for bit, estimates being made where measurements are: at each, then some together that
    came in any order."""
    scene, rng = scenes()[where], np.random.default_rng(1)
    detectors = detectors_of(scene, PROFILES[name][0]())
    sliding, filter = sf.SlidingDetector(scene.filter, 1000, detectors), scene.filter
    rows = rows_between(scene, -inf, inf)
    ends = [*range(1, 60), 61, 75, 110, len(rows)]
    begin = 0
    for end in ends:
        step_rows = [rows[k] for k in begin + rng.permutation(end - begin)]
        assert set(pushed(sliding, scene, step_rows)) == {"ok"}
        for t, i, v in rows[begin:end]:
            filter.push(t, scene.channels[i], v)
        t, i, _ = rows[end - 1]
        now = round(t - scene.sensors[i].latency, 3)
        estimate, known = sliding.estimate(now), filter.estimate(now)
        np.testing.assert_array_equal(estimate.x, known.x)
        np.testing.assert_array_equal(estimate.P, known.P)
        assert estimate.time == now
        assert sliding.measurements == end
        if end in (1, 2, 7, 50, 75, len(rows)):
            record = sf.ForwardRecord(scene.filter, log_of(scene, rows[:end]))
            assert [found.detector for found in estimate.findings] == detectors
            for found in estimate.findings:
                assert_same(found, record)
        assert estimate.detected == tuple(
            found for found in estimate.findings if found.status == "detected"
        )
        begin = end


@pytest.mark.parametrize("where", scenes())
@pytest.mark.parametrize("name", PROFILES)
def test_estimates_between_measurements(where: str, name: str) -> None:
    scene, rng = scenes()[where], np.random.default_rng(1)
    sliding = sf.SlidingDetector(scene.filter, 1000, detectors_of(scene, PROFILES[name][0]()))
    filter, before = scene.filter, -inf
    for now in STEPS:
        rows = rows_between(scene, before, now)
        shuffled = [rows[k] for k in rng.permutation(len(rows))]
        assert set(pushed(sliding, scene, shuffled)) <= {"ok"}
        for t, i, v in rows:
            filter.push(t, scene.channels[i], v)
        estimate, known = sliding.estimate(now), filter.estimate(now)
        np.testing.assert_array_equal(estimate.x, known.x)
        np.testing.assert_array_equal(estimate.P, known.P)
        past = rows_between(scene, -inf, now)
        record = sf.ForwardRecord(scene.filter, log_of(scene, past))
        for found in estimate.findings:
            assert_same(found, record, PIECES)
        before = now


def belief_before(scene: LogScene, rows: Sequence[Row], k: int) -> sf.DesyncFilter:
    """A filter that begins with the belief at the measurement before the k-th in validity."""
    if k == 0:
        return scene.filter
    last = rows[k - 1][0] - scene.sensors[rows[k - 1][1]].latency
    run = scene.filter.run(log_of(scene, rows[:k]), times=[last])
    return sf.DesyncFilter(scene.MODEL, scene.sensors, run.x[-1], run.P[-1], start=last)


@pytest.mark.parametrize("window", [2, 7, 40, 149, 150])
@pytest.mark.parametrize("kind", ["step", "ramp", "sine"])
def test_a_short_window(window: int, kind: str) -> None:
    """Of a filter that begins with the belief before it."""
    scene = speed_log(2).with_fault("wheel", step(8.0, 1.0))
    detector = sf.OnsetDetector(PROFILES[kind][0](), samples=FEW)
    sliding = sf.SlidingDetector(scene.filter, window, [detector])
    assert sliding.window == window
    before = -inf
    for now in STEPS:
        pushed(sliding, scene, rows_between(scene, before, now))
        estimate = sliding.estimate(now)
        past = rows_between(scene, -inf, now)
        first = max(0, len(past) - window)
        assert sliding.measurements == min(window, len(past))
        record = sf.ForwardRecord(belief_before(scene, past, first), log_of(scene, past[first:]))
        for found in estimate.findings:
            assert_same(found, record, PIECES)
        before = now


def test_a_fault_in_the_window_is_found_and_leaves_it() -> None:
    """A window of 60 measurements, 8 s: a step of the past 4 s is known to the sample; one that is
    older than the window is part of the belief."""
    scene = speed_log(3).with_fault("wheel", step(8.0, 1.5))
    sliding = sf.SlidingDetector(scene.filter, 60, [sf.OnsetDetector(STEP, samples=FEW)])
    statuses: dict[float, tuple[sf.SlidingFinding, ...]] = {}
    before = -inf
    for now in (7.9, 12.0):
        pushed(sliding, scene, rows_between(scene, before, now))
        statuses[now], before = sliding.estimate(now).detected, now
    assert statuses[7.9] == ()
    best = max(statuses[12.0], key=lambda found: found.drop or 0.0)
    assert best.detector.channel == "wheel"
    own = scene.valid[scene.of("wheel")]
    assert best.onset == own[own >= 8.0][0]
    assert isinstance(best.amplitude, float)
    assert isinstance(best.amplitude_se, float)
    assert abs(best.amplitude - 1.5) < 4 * best.amplitude_se
    assert best.p_bound is not None
    assert best.p_bound < 1e-12


def test_what_cannot_be_used_is_answered_and_left_out() -> None:
    scene = speed_log(4)
    given: Any = [sf.OnsetDetector(STEP, samples=FEW)]
    clean = sf.SlidingDetector(scene.filter, 100, given)
    sliding: Any = sf.SlidingDetector(scene.filter, 100, given)
    filter: Any = scene.filter
    early, late = rows_between(scene, -inf, 10.0), rows_between(scene, 10.0, 20.0)
    odd: list[tuple[Any, Any, Any, str]] = [
        (3.0, "wheel", nan, "not_finite"), (3.0, "wheel", inf, "not_finite"),
        (nan, "wheel", 1.0, "not_finite"), (inf, "wheel", 1.0, "not_finite"),
        (1e300, "wheel", 1.0, "not_finite"), (3.0, "gps", 1.0, "unknown_sensor"),
        (3.0, None, 1.0, "unknown_sensor"), (3.0, 0, 1.0, "unknown_sensor"),
        (3.0, ["wheel"], 1.0, "unknown_sensor"), (3.0, "wheel", None, "not_finite"),
        (3.0, "wheel", "x", "not_finite"), (None, "wheel", 1.0, "not_finite"),
        (3.0, np.array(["wheel", "radar"]), 1.0, "unknown_sensor"),
    ]  # fmt: skip
    pushed(clean, scene, early)
    pushed(sliding, scene, early[:20])
    for time, sensor, value, status in odd:
        assert filter.push(time, sensor, value).name == status
        assert sliding.push(time, sensor, value).name == status
    t, i, v = early[5]
    assert sliding.push(t, scene.channels[i], v).name == "repeated"
    pushed(sliding, scene, early[20:])
    assert sliding.measurements == 0  # until the step ends
    assert_findings(clean.estimate(10.0), sliding.estimate(10.0))
    pushed(clean, scene, late)
    pushed(sliding, scene, late[:9])
    for stamp in (9.999999999, 5.0, -3.0):
        assert sliding.push(stamp, "radar", 1.0).name == "too_late"
    pushed(sliding, scene, late[9:])
    assert_findings(clean.estimate(20.0), sliding.estimate(20.0))
    assert sliding.measurements == clean.measurements == 100
    for estimate in (sliding.estimate, clean.estimate):
        with pytest.raises(sf.ConfigError, match="time"):
            estimate(19.0)
    assert_findings(clean.estimate(20.0), sliding.estimate(20.0))


def assert_findings(known: sf.SlidingEstimate, found: sf.SlidingEstimate) -> None:
    """To the bit."""
    np.testing.assert_array_equal(found.x, known.x)
    np.testing.assert_array_equal(found.P, known.P)
    assert len(found.findings) == len(known.findings) > 0
    for mine, theirs in zip(found.findings, known.findings, strict=True):
        for name in ("status", "onset", "amplitude", "amplitude_se", "drop", "p_bound", "onsets"):
            assert getattr(mine, name) == getattr(theirs, name)


def test_a_full_buffer() -> None:
    scene = speed_log(5)
    filter = sf.DesyncFilter(scene.MODEL, scene.sensors, scene.X0, scene.P0, start=0.0, capacity=10)
    sliding = sf.SlidingDetector(filter, 100, [sf.OnsetDetector(STEP, "radar")])
    rows = rows_between(scene, -inf, 20.0)[:12]
    assert pushed(sliding, scene, rows) == ["ok"] * 10 + ["buffer_full"] * 2
    sliding.estimate(20.0)
    assert sliding.measurements == 10


def test_measurements_of_the_future_wait() -> None:
    """What is valid after the estimate is of the next step."""
    scene = speed_log(6)
    rows = rows_between(scene, -inf, 20.0)
    given = [sf.OnsetDetector(STEP, samples=FEW)]
    sliding = sf.SlidingDetector(scene.filter, 1000, given)
    pushed(sliding, scene, rows)
    for now in (5.0, 20.0):
        past = rows_between(scene, -inf, now)
        estimate = sliding.estimate(now)
        assert sliding.measurements == len(past)
        for found in estimate.findings:
            record = sf.ForwardRecord(scene.filter, log_of(scene, past))
            assert_same(found, record, PIECES)


def test_clear() -> None:
    """Of the window alone: what comes after it is a record that begins with the belief."""
    scene = speed_log(7).with_fault("wheel", step(5.0, 2.0))
    sliding = sf.SlidingDetector(scene.filter, 1000, [sf.OnsetDetector(STEP, samples=FEW)])
    whole = scene.filter
    past, later = rows_between(scene, -inf, 8.0), rows_between(scene, 8.0, 20.0)
    pushed(sliding, scene, past)
    assert sliding.estimate(8.0).detected
    sliding.clear()
    assert sliding.measurements == 0
    pushed(sliding, scene, later)
    estimate = sliding.estimate(20.0)
    assert sliding.measurements == len(later)
    record = sf.ForwardRecord(belief_before(scene, past, len(past)), log_of(scene, later))
    for found in estimate.findings:
        assert_same(found, record, PIECES)
    for t, i, v in (*past, *later):
        whole.push(t, scene.channels[i], v)
    np.testing.assert_array_equal(estimate.x, whole.estimate(20.0).x)
    sliding.clear()
    (one, two) = sliding.estimate(21.0).findings
    assert one.status == two.status == "undetectable"


def test_nothing_in_the_window() -> None:
    scene = speed_log(8)
    sliding = sf.SlidingDetector(scene.filter, 10, [sf.OnsetDetector(STEP), sf.OnsetDetector(RAMP)])
    estimate = sliding.estimate(1.0)
    assert len(estimate.findings) == 4
    for found in estimate.findings:
        assert found.status == "undetectable"
        numbers = (found.onset, found.amplitude, found.amplitude_se, found.drop, found.p_bound)
        assert numbers == (None,) * 5
        assert found.onsets == 0
    assert estimate.detected == ()


def test_detectors_of_all_sensors() -> None:
    """Without a channel one for each in turn, all else as it was given."""
    scene = logged()
    given = [sf.OnsetDetector(RAMP, None, 1e-4, samples=5), sf.OnsetDetector(STEP, "gps", 1e-2)]
    sliding = sf.SlidingDetector(scene.filter, 50, given)
    channels = [detector.channel for detector in sliding.detectors]
    assert channels == ["wheel", "radar", "gps", "gps"]
    for detector in sliding.detectors[:3]:
        assert (detector.profile, detector.false_alarm, detector.samples) == (RAMP, 1e-4, 5)
    assert sliding.detectors[3] is given[1]


def test_as_many_searches_as_there_can_be() -> None:
    scene = speed_log(9)
    sliding = sf.SlidingDetector(scene.filter, 50, [sf.OnsetDetector(STEP)] * 16)
    pushed(sliding, scene, scene.rows)
    assert len(sliding.estimate(20.0).findings) == 32
    sensors = [sf.Sensor(f"s{i}", 0.1 + 0.1 * i) for i in range(16)]
    many = sf.DesyncFilter(scene.MODEL, sensors, scene.X0, scene.P0)
    last = sf.SlidingDetector(many, 50, [sf.OnsetDetector(STEP)]).detectors[-1]
    assert last.channel == "s15"


def test_the_filter_stays_as_it_is() -> None:
    scene = speed_log(10)
    filter = scene.filter
    sliding = sf.SlidingDetector(filter, 50, [sf.OnsetDetector(STEP)])
    pushed(sliding, scene, scene.rows)
    sliding.estimate(20.0)
    assert set(filter.counters.values()) == {0}
    np.testing.assert_array_equal(filter.estimate(0.0).x, scene.X0)


def healthy_stream(count: int, seed: int) -> SpeedLog:
    return speed_log(seed, count, count / 8.0)


@pytest.mark.parametrize("profile", [STEP, RAMP], ids=["step", "ramp"])
def test_false_alarms_of_a_long_stream(profile: sf.Profile) -> None:
    """4000 estimates, each after a measurement, of a window of 60. The bound over all onsets is
    kept at each estimate and channel, and so in the mean, however estimates depend on one another;
    it is a generous one, so that no Monte Carlo error is needed."""
    scene = healthy_stream(4000, 11)
    sliding = sf.SlidingDetector(scene.filter, 60, [sf.OnsetDetector(profile, None, 1e-2)])
    alarms = np.zeros(2)
    for t, i, v in rows_between(scene, -inf, inf):
        sliding.push(t, scene.channels[i], v)
        alarms += [found.status == "detected" for found in sliding.estimate(t).findings]
    assert np.all(alarms / 4000 <= 1e-2)
    # at the level at which each single onset would be looked at, there are many
    loose = sf.SlidingDetector(scene.filter, 60, [sf.OnsetDetector(profile, None, 0.9)])
    some = 0
    for t, i, v in rows_between(scene, -inf, 60.0):
        loose.push(t, scene.channels[i], v)
        some += len(loose.estimate(t).detected)
    assert some > 0


FILTER = speed_log(12, 4).filter


def made(**changed: Any) -> Any:
    given = {"filter": FILTER, "window": 10, "detectors": [sf.OnsetDetector(STEP)], **changed}
    return wrongly.SlidingDetector(**given)


@refuses(
    {
        "filter None": (lambda: made(filter=None), VALUE, "filter: .*None"),
        "filter a log": (lambda: made(filter=speed_log(1, 4).log), VALUE, "filter: .*Log"),
        "window one": (lambda: made(window=1), VALUE, "window: .*2 to .*1"),
        "window zero": (lambda: made(window=0), VALUE, "window: .*0"),
        "window a float": (lambda: made(window=10.0), VALUE, "window: .*10.0"),
        "window beyond": (lambda: made(window=10**9), VALUE, "window: .*1000000000"),
        "no detectors": (lambda: made(detectors=[]), VALUE, "detectors: .*1 to 32.*0"),
        "too many": (
            lambda: made(detectors=[sf.OnsetDetector(STEP)] * 17), VALUE, "detectors: .*32.*34",
        ),
        "too many of one channel": (
            lambda: made(detectors=[sf.OnsetDetector(STEP, "wheel")] * 33), VALUE,
            "detectors: .*32.*33",
        ),
        "detectors profiles": (lambda: made(detectors=[STEP]), VALUE, "detectors: "),
        "detectors a spectrum": (
            lambda: made(detectors=[sf.SpectrumDetector("wheel")]), VALUE, "detectors: ",
        ),
        "detectors one": (lambda: made(detectors=sf.OnsetDetector(STEP)), VALUE, "detectors: "),
        "an end": (
            lambda: made(detectors=[sf.OnsetDetector(RAMP, "wheel", ends=True)]), VALUE, "ends",
        ),
        "channel unknown": (
            lambda: made(detectors=[sf.OnsetDetector(STEP, "gps")]), VALUE, "channel: .*'gps'",
        ),
        "channel unknown, weighted": (
            lambda: made(detectors=[sf.OnsetDetector(STEP, {"wheel": 1.0, "gps": 1.0})]), VALUE,
            "channel: .*'gps'",
        ),
        "weights of zero": (
            lambda: made(detectors=[sf.OnsetDetector(STEP, {"wheel": 0.0})]), VALUE,
            "channel|detectors",
        ),
        "weights NaN": (
            lambda: made(detectors=[sf.OnsetDetector(STEP, {"wheel": nan})]), VALUE, "channel",
        ),
    }
)  # fmt: skip
def test_refused(make: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        make()
