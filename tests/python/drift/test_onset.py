"""Onsets: every candidate's ratio, amplitude and indicator against the dense sum over all pairs."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.stats import ncx2

import surefix as sf
from drift.scenes import (
    CLEAR,
    HIDDEN,
    ONE_AMPLITUDE,
    PROFILES,
    Channel,
    LogScene,
    Scene,
    faulty,
    irregular,
    logged,
    particle,
)
from oracle import drift_profiles as profiles
from oracle.drift import Dense
from oracle.drift_profiles import Fits
from oracle.step import Array

TOLERANCE = 1e-8  # of the contract, in the unit of the ratio: a chi-square


@cache
def particle_data() -> tuple[sf.ForwardRecord, Dense, Scene]:
    scene = particle()
    z = faulty(scene.simulated(1, 1)[0], 0.05 * np.maximum(scene.times - 60.0, 0.0))
    return scene.record(z), scene.dense(z), scene


@cache
def short_data() -> tuple[sf.ForwardRecord, Dense, Scene]:
    scene = particle(40)
    z = faulty(
        scene.simulated(1, 1)[0], np.where((scene.times > 10) & (scene.times < 25), 3.0, 0.0)
    )
    return scene.record(z), scene.dense(z), scene


@cache
def irregular_data() -> tuple[sf.ForwardRecord, Dense, Scene]:
    scene = irregular()
    z = scene.simulated(1, 2)[0]
    return scene.record(z), scene.dense(z), scene


@cache
def log_data() -> tuple[sf.ForwardRecord, Dense, LogScene]:
    scene = logged()
    return scene.record, scene.dense, scene


Data = Callable[[], tuple[sf.ForwardRecord, Dense, Scene | LogScene]]
WHERE: dict[str, tuple[Data, Channel]] = {
    "particle": (particle_data, None),
    "short": (short_data, None),
    "irregular, one": (irregular_data, "b"),
    "irregular, both": (irregular_data, {"a": 1.0, "b": -0.4}),
    "log, the biased sensor": (log_data, "wheel"),
    "log, another": (log_data, "gps"),
    "log, two of three": (log_data, {"wheel": 1.0, "radar": 0.5}),
}
each_place = pytest.mark.parametrize("where", [where for where in WHERE if where != "short"])
FEW = 8  # samples, where p-values do not matter


def assert_fits(found: sf.OnsetResult, known: Fits, times: Array) -> None:
    """Ratios in their own unit, amplitudes in standard errors, indicators in their standard
    deviation with no fault; or, where they are large, relative to themselves."""
    q = known.amplitude.shape[1]
    np.testing.assert_allclose(found.time, times, rtol=1e-12)
    clear, hidden = known.detectability > CLEAR, known.detectability < HIDDEN
    assert clear.sum() > 0.8 * len(clear)
    K = len(times)
    assert found.ratio.shape == found.first_order.shape == found.detectability.shape == (K,)
    assert found.amplitudes.shape == found.amplitude_ses.shape == ((K,) if q == 1 else (K, q))
    ratio = np.abs(found.ratio - known.ratio)[clear]
    assert np.max(ratio / (1.0 + known.ratio[clear])) <= TOLERANCE
    se = known.se[clear]
    a, deviation = found.amplitudes.reshape(K, q), found.amplitude_ses.reshape(K, q)
    away = np.abs(a[clear] - known.amplitude[clear]) / (se + np.abs(known.amplitude[clear]))
    assert np.max(away) <= TOLERANCE
    np.testing.assert_allclose(deviation[clear], se, rtol=TOLERANCE)
    scale = known.first_order_sigma + np.abs(known.first_order)
    wrong = np.abs(found.first_order - known.first_order)
    assert np.all(wrong <= TOLERANCE * scale)
    # a share of no information at all, 0 / 0, may be no number
    share = np.where(
        known.detectability == 0.0, np.nan_to_num(found.detectability), found.detectability
    )
    np.testing.assert_allclose(share, known.detectability, atol=TOLERANCE)
    assert np.all((share >= 0.0) & (share <= 1.0 + 1e-12))
    assert np.isnan(found.ratio[hidden]).all()
    assert np.isnan(a[hidden]).any(axis=1).all()


@each_place
@pytest.mark.parametrize("name", PROFILES)
def test_every_onset_against_the_dense_sum(where: str, name: str) -> None:
    data, channel = WHERE[where]
    record, d, scene = data()
    make, profile = PROFILES[name]
    weights = scene.weights(channel)
    found: Any = sf.OnsetDetector(make(), channel, samples=FEW).run(record)
    assert_fits(found, profiles.onset_fits(d, profile, weights), profiles.candidates(d, weights))


@each_place
@pytest.mark.parametrize("name", PROFILES)
def test_scalars_are_those_of_the_largest_ratio(where: str, name: str) -> None:
    data, channel = WHERE[where]
    found: Any = sf.OnsetDetector(PROFILES[name][0](), channel, samples=FEW).run(data()[0])
    best = int(np.nanargmax(found.ratio))
    assert found.onset == found.time[best]
    assert found.drop == found.ratio[best]
    np.testing.assert_array_equal(found.amplitude, found.amplitudes[best])
    np.testing.assert_array_equal(found.amplitude_se, found.amplitude_ses[best])
    assert found.onset_first_order == found.time[np.nanargmax(np.abs(found.first_order))]
    assert found.status == ("detected" if found.detected else "not detected")


@pytest.mark.parametrize("name", ["step", "ramp", "sine"])
def test_indicator_is_the_gradients_product_with_the_profile(name: str) -> None:
    """g'd of the paper's eq. (11), from the engine's own gradient."""
    record, d, scene = irregular_data()
    make, profile = PROFILES[name]
    weights = scene.weights({"a": 1.0, "b": -0.4})
    found: Any = sf.OnsetDetector(make(), {"a": 1.0, "b": -0.4}, samples=FEW).run(record)
    g = record.gradient[~np.isnan(record.gradient)]
    faults = profiles.onset_faults(d, profile, weights)
    product = np.einsum("m,kmq->kq", g, faults)
    known = product[:, 0] if faults.shape[2] == 1 else np.linalg.norm(product, axis=1)
    scale = np.einsum("m,kmq->k", np.abs(g), np.abs(faults)) + 1e-12  # what cancels in the sum
    assert np.max(np.abs(found.first_order - known) / scale) <= 1e-10


@pytest.mark.parametrize("name", ["step", "ramp", "sine"])
def test_drop_is_what_repair_takes_off_the_inconsistency(name: str) -> None:
    """The engine against itself: its own pass over the repaired data."""
    _, d, scene = particle_data()
    assert isinstance(scene, Scene)
    z = d.spread(d.gamma)
    system: Any = sf.ForwardRecord(scene.system, z, times=scene.times)
    found: Any = sf.OnsetDetector(PROFILES[name][0]()).run(system)
    assert found.onset is not None
    after = scene.times >= found.onset
    value = np.zeros(len(z))
    unit = PROFILES[name][0]().value(scene.times[after] - found.onset)
    value[after] = unit @ np.atleast_1d(found.amplitude)
    repaired: Any = sf.ForwardRecord(scene.system, z - value[:, None], times=scene.times)
    drop = system.inconsistency - repaired.inconsistency
    assert drop == pytest.approx(found.drop, rel=1e-8, abs=1e-8)


@pytest.mark.parametrize("name", PROFILES)
def test_values_of_profiles(name: str) -> None:
    make, profile = PROFILES[name]
    elapsed = np.array([0.0, 0.1, 1.0, 7.3, 20.0])
    np.testing.assert_allclose(make().value(elapsed), profile(elapsed), rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("name", ONE_AMPLITUDE)
@pytest.mark.parametrize("where", ["short", "irregular, both", "log, another"])
def test_every_onset_with_every_end(where: str, name: str) -> None:
    """All pairs of an onset and a later end (K,); a fault that never ends may be among them."""
    data, channel = WHERE[where]
    record, d, scene = data()
    make, profile = PROFILES[name]
    weights = scene.weights(channel)
    times = profiles.candidates(d, weights)
    known, index = profiles.ended_fits(d, profiles.onset_faults(d, profile, weights))
    found: Any = sf.OnsetDetector(make(), channel, ends=True, samples=FEW).run(record)
    rank = {
        (float(times[m]), float(times[e]) if e < len(times) else np.inf): i
        for i, (m, e) in enumerate(index.tolist())
    }
    assert found.ends is not None
    at = np.array(
        [rank[pair] for pair in zip(found.time.tolist(), found.ends.tolist(), strict=True)]
    )
    assert len(set(at.tolist())) == len(at) >= len(times) * (len(times) - 1) / 2
    clear = known.detectability[at] > CLEAR
    assert clear.sum() > 0.8 * len(at)
    ratio, a, se = known.ratio[at], known.amplitude[at, 0], known.se[at, 0]
    wrong = np.abs(found.ratio - ratio)[clear] / (1.0 + ratio[clear])
    assert np.max(wrong) <= TOLERANCE
    away = np.abs(found.amplitudes - a)[clear] / (se + np.abs(a))[clear]
    assert np.max(away) <= TOLERANCE
    np.testing.assert_allclose(found.amplitude_ses[clear], se[clear], rtol=TOLERANCE)
    best = int(np.nanargmax(found.ratio))
    assert (found.onset, found.end) == (found.time[best], found.ends[best])
    assert found.drop == found.ratio[best]
    assert found.amplitude == found.amplitudes[best]


def test_share_of_information_of_a_fault_that_ends() -> None:
    """The same share as of a fault that does not: of what a known state would give."""
    record, d, _ = irregular_data()
    weights = np.array([1.0, 0.0])
    times = profiles.candidates(d, weights)
    fits, index = profiles.ended_fits(d, profiles.onset_faults(d, profiles.step, weights))
    known = fits.detectability[index[:, 1] < len(times)]
    found: Any = sf.OnsetDetector(sf.Profile.step(), "a", ends=True, samples=FEW).run(record)
    assert found.ends is not None
    inside = np.isfinite(found.ends)
    order = np.lexsort((found.ends[inside], found.time[inside]))
    np.testing.assert_allclose(found.detectability[inside][order], known, atol=TOLERANCE)


@pytest.mark.parametrize("name", ["step", "ramp"])
def test_a_fault_that_ends(name: str) -> None:
    """A pulse, and a ramp that stays where it has come to, each large: found to the sample."""
    scene = particle(80)
    unit = PROFILES[name][1]
    value = np.zeros(80)
    value[30:] += 3.0 * unit(np.arange(50.0))[:, 0]
    value[50:] -= 3.0 * unit(np.arange(30.0))[:, 0]
    z = faulty(scene.simulated(1, 3)[0], 4.0 * value)
    found: Any = sf.OnsetDetector(PROFILES[name][0](), ends=True).run(scene.record(z))
    assert (found.onset, found.end) == (30.0, 50.0)
    assert found.amplitude == pytest.approx(12.0, abs=4.0 * found.amplitude_se)
    assert found.detected
    without: Any = sf.OnsetDetector(PROFILES[name][0]()).run(scene.record(z))
    assert without.drop < found.drop


def test_the_papers_ramps() -> None:
    """Slope 0.3 from 39 on, 100 samples, 200 runs. The design measured mean absolute errors of the
    onset of 2.3 samples (exact) and 2.2 (first order); their standard error is 0.2 (of 200 errors
    of deviation 3). Detected are at least as many as the true onset's ratio alone would be."""
    scene = particle()
    z = faulty(scene.simulated(200, 1), 0.3 * np.maximum(scene.times - 39.0, 0.0))
    found: Any = sf.OnsetDetector(sf.Profile.ramp()).run(scene.record(z))
    assert found.onset.shape == found.onset_first_order.shape == (200,)
    assert np.mean(np.abs(found.onset - 39.0)) < 2.3 + 4 * 0.2
    assert np.mean(np.abs(found.onset_first_order - 39.0)) < 2.2 + 4 * 0.2
    d = scene.dense(z[0])
    fault = profiles.columns(d, profiles.ramp, 39.0, np.ones(1))
    se = profiles.fits(d, fault[None]).se[0, 0]
    power = ncx2.sf(found.threshold, 1, (0.3 / se) ** 2)
    assert np.mean(found.detected) > power - 4.0 * np.sqrt(power * (1.0 - power) / 200)


def test_amplitudes_have_the_errors_that_they_claim() -> None:
    """2000 runs at the true onset: the deviation of normalised errors is known to 1.6 %, their mean
    to 0.022; both within four of those."""
    scene = particle()
    z = faulty(scene.simulated(2000, 5), 0.1 * np.maximum(scene.times - 39.0, 0.0))
    found: Any = sf.OnsetDetector(sf.Profile.ramp()).run(scene.record(z))
    error = (found.amplitudes[:, 39] - 0.1) / found.amplitude_ses[..., 39]
    assert np.abs(error.mean()) < 0.09
    assert error.std() == pytest.approx(1.0, abs=0.064)


@pytest.mark.parametrize("ends", [False, True])
def test_many_runs_are_one_by_one(ends: bool) -> None:
    """Bit for bit: a run does not know of the others."""
    scene = irregular(30)
    z = scene.simulated(5, 6)
    detector = sf.OnsetDetector(sf.Profile.ramp(), "a", ends=ends, samples=FEW)
    many = detector.run(scene.record(z))
    names = ["ratio", "amplitudes", "amplitude_ses", "first_order", "onset", "amplitude", "drop",
             "amplitude_se", "onset_first_order"]  # fmt: skip
    if ends:
        names.append("end")
    for i in range(len(z)):
        one = detector.run(scene.record(z[i]))
        for name in names:
            known, mine = np.asarray(getattr(many, name)), np.asarray(getattr(one, name))
            # what follows from the schedule alone may be there once for all the runs
            known = known[i] if known.ndim > mine.ndim else known
            np.testing.assert_array_equal(known, mine, name)


def test_the_unit_of_time_does_not_matter() -> None:
    """Slopes are per second: ten times slower data have the same ratios."""
    scene = particle()
    z = scene.simulated(1, 8)[0]
    fast = sf.ForwardRecord(scene.system, z, times=0.1 * scene.times, inputs=scene.inputs)
    slow = scene.record(z)
    detector = sf.OnsetDetector(sf.Profile.ramp())
    known, found = detector.run(slow), detector.run(fast)
    np.testing.assert_allclose(found.ratio[:-1], known.ratio[:-1], rtol=1e-8, atol=1e-8)
    np.testing.assert_allclose(found.amplitudes[:-1], 10 * known.amplitudes[:-1], rtol=1e-7)


def test_weights_scale_the_amplitude_only() -> None:
    record, _, _ = irregular_data()
    one = sf.OnsetDetector(sf.Profile.step(), {"a": 1.0, "b": 2.0}).run(record)
    five = sf.OnsetDetector(sf.Profile.step(), {"a": -5.0, "b": -10.0}).run(record)
    np.testing.assert_allclose(five.ratio, one.ratio, rtol=1e-9)
    np.testing.assert_allclose(five.amplitudes, -one.amplitudes / 5, rtol=1e-9)
    np.testing.assert_allclose(five.amplitude_ses, one.amplitude_ses / 5, rtol=1e-9)
    name = sf.OnsetDetector(sf.Profile.step(), "a").run(record)
    alone = sf.OnsetDetector(sf.Profile.step(), {"a": 1.0}).run(record)
    np.testing.assert_array_equal(name.ratio, alone.ratio)
