"""With no fault: how often a threshold is passed, and what a p-value is worth.

The engine calibrates by drawing ratios from their joint distribution, which follows from the
schedule; here measurements are simulated from the model, which knows nothing of ratios.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2

import surefix as sf
from drift.scenes import CLEAR, Scene, faulty, irregular, particle
from oracle import drift_profiles as profiles
from oracle.step import Array

RUNS = 10_000
DRAWS = 100_000
Make = Callable[..., Any]
DETECTORS: dict[str, Make] = {
    "step": lambda **o: sf.OnsetDetector(sf.Profile.step(), **o),
    "ramp": lambda **o: sf.OnsetDetector(sf.Profile.ramp(), **o),
    "sine": lambda **o: sf.OnsetDetector(sf.Profile.sine(0.11), **o),
    "spectrum": lambda **o: sf.SpectrumDetector(**o),
}
ONSETS = {"step": profiles.step, "ramp": profiles.ramp, "sine": profiles.sine(0.11)}
each = pytest.mark.parametrize("name", DETECTORS)


@cache
def healthy() -> tuple[sf.ForwardRecord, Scene, Array]:
    scene = particle()
    z = scene.simulated(RUNS, 1)
    return scene.record(z), scene, z


@cache
def found_in_healthy(name: str) -> Any:
    """All the runs, at a false alarm in a hundred."""
    return DETECTORS[name](false_alarm=1e-2).run(healthy()[0])


@cache
def candidates(name: str) -> tuple[list[Array], int]:
    """Orthonormal whitened faults (M, q) of every candidate that is not hidden, and q."""
    _, scene, z = healthy()
    d = scene.dense(z[0])
    if name == "spectrum":
        faults = profiles.sine_faults(d, found_in_healthy(name).frequency, np.ones(1))
    else:
        faults = profiles.onset_faults(d, ONSETS[name], np.ones(1))
    seen = profiles.fits(d, faults).detectability > CLEAR
    white = [d.whiten(fault).astype(float) for fault in faults[seen]]
    return [np.linalg.qr(w / np.linalg.norm(w, axis=0))[0] for w in white], faults.shape[2]


@cache
def largest(name: str) -> Array:
    """The largest ratio in every one of DRAWS drawn windows, ascending."""
    directions, q = candidates(name)
    D, rng, out = np.hstack(directions).astype(np.float32), np.random.default_rng(5), []
    for _ in range(DRAWS // 20_000):
        ratio = (rng.normal(size=(20_000, len(D))).astype(np.float32) @ D) ** 2
        out.append(ratio.reshape(20_000, -1, q).sum(axis=2).max(axis=1))
    return np.sort(np.concatenate(out))


def exceeded(name: str, level: Array | float) -> Array:
    """The share of drawn windows whose largest ratio is at least so large."""
    return 1.0 - np.searchsorted(largest(name), level) / DRAWS


@each
def test_share_of_healthy_runs_beyond_the_threshold(
    name: str, record_property: Callable[[str, object], None]
) -> None:
    """10,000 runs: 100 +- 10 expected at 1e-2, and so five standard deviations to a factor of 1.5.
    At 1e-3 they would be 10 +- 3, so there 100,000 drawn windows count: 100 +- 10."""
    _, scene, z = healthy()
    record = scene.record(z[0])
    drop = np.nanmax(found_in_healthy(name).ratio, axis=1)
    two = DETECTORS[name](false_alarm=1e-2).threshold(record)
    assert 1e-2 / 1.5 < np.mean(drop > two) < 1.5e-2
    assert 1e-2 / 1.5 < exceeded(name, two) < 1.5e-2
    three = DETECTORS[name](false_alarm=1e-3).threshold(record)
    share = exceeded(name, three)
    record_property("figure", f"false alarms of {name}: {share:.2%} for 0.1 %")
    assert 1e-3 / 1.5 < share < 1.5e-3
    assert three > two


@each
def test_share_of_healthy_runs_detected(name: str) -> None:
    """``detected`` is the p-value's, and the threshold's, word."""
    found = found_in_healthy(name)
    assert found.detected.shape == (RUNS,)
    assert found.detected.dtype == np.bool_
    assert 1e-2 / 1.5 < np.mean(found.detected) < 1.5e-2
    drop = np.nanmax(found.ratio, axis=1)
    # at the threshold itself, interpolation may decide either way
    apart = np.abs(drop - found.threshold) > 0.1
    np.testing.assert_array_equal(found.detected[apart], (drop > found.threshold)[apart])


@each
def test_p_values_are_uniform(name: str) -> None:
    """10,000 of them: the share below 0.05 is known to 0.0022, seven standard deviations from the
    limits, and that below 0.5 to 0.005."""
    p = found_in_healthy(name).p_value
    assert p.shape == (RUNS,)
    assert np.all((p > 0.0) & (p <= 1.0))
    assert 0.035 <= np.mean(p <= 0.05) <= 0.065
    most = 0.55
    least = 0.38 if name == "spectrum" else 0.45  # see the next test: p = 0.38 (1 + 0.38) is 0.52
    assert least <= np.mean(p <= 0.5) <= most


@each
def test_p_values_against_drawn_windows(name: str) -> None:
    """Within four standard errors, the engine's own as it claims them and the draws' binomial. Of a
    spectrum only frequencies near one another count as dependent: p may be too large, never too
    small, by a factor of up to 1 + p."""
    found = found_in_healthy(name)
    assert np.all(np.asarray(found.calibration) == "simulation")
    drop = np.nanmax(found.ratio, axis=1)
    order = np.argsort(drop)
    for rank in (1000, 5000, 9000, 9900, 9990):
        i = order[rank]
        p, se = float(found.p_value[i]), float(found.p_value_se[i])
        drawn = float(exceeded(name, drop[i]))
        assert 0.0 <= se < 0.1 * p + 1e-12  # 1024 samples
        error = 4.0 * np.hypot(se, np.sqrt(drawn * (1.0 - drawn) / DRAWS))
        assert drawn - error <= p <= drawn * (1.0 + (drawn if name == "spectrum" else 0.0)) + error


@each
@pytest.mark.parametrize("size", [1.0, 20.0])
def test_p_values_in_the_far_tail(name: str, size: float) -> None:
    """Never below one candidate's own tail, never above the sum of all of them."""
    _, scene, z = healthy()
    late = np.where(scene.times > 50.0, 0.3, 0.0)
    wave = size * (np.sin(2 * np.pi * 0.11 * scene.times) + late)
    found = DETECTORS[name]().run(scene.record(faulty(z[0], wave)))
    directions, q = candidates(name)
    drop = float(np.nanmax(found.ratio))
    single = chi2.sf(drop, q)
    # the Nyquist frequency and hidden onsets may or may not be among the engine's
    assert single * (1 - 1e-9) <= found.p_value <= (len(found.ratio) + 1) * single
    assert len(found.ratio) >= len(directions)
    assert found.p_value_se <= 0.2 * found.p_value
    if size >= 20.0:
        assert found.p_value < 1e-30
        assert found.detected
        assert found.status == "detected"


@each
def test_no_fault_at_all(name: str) -> None:
    """Measurements that are their own prediction: nothing to find, and the p-value says so."""
    _, scene, z = healthy()
    d = scene.dense(z[0])
    found = DETECTORS[name]().run(scene.record(z[0] - d.spread(d.gamma)))
    assert np.nanmax(found.ratio) < 1e-9
    assert found.p_value == pytest.approx(1.0, abs=1e-3)
    assert found.detected is False
    assert found.status == "not detected"


# What follows is not about rates, and needs no long windows.
SHORT = particle(40)
FEW_RUNS = SHORT.simulated(40, 2)
PULSE = np.where((SHORT.times > 10.0) & (SHORT.times < 25.0), 1.0, 0.0)


@each
def test_p_value_of_a_run_does_not_depend_on_how_many_there_are(name: str) -> None:
    """Bit for bit: it is a function of the ratio and the schedule."""
    found = [DETECTORS[name]().run(SHORT.record(FEW_RUNS[:runs])) for runs in (2, 20)]
    alone = DETECTORS[name]().run(SHORT.record(FEW_RUNS[0]))
    assert [float(f.p_value[0]) for f in found] == [alone.p_value] * 2
    assert [f.threshold for f in found] == [alone.threshold] * 2


@each
def test_a_gross_fault_in_one_run_does_not_change_the_others(name: str) -> None:
    """p-values of healthy runs, by themselves and beside one whose ratio is ten thousand times
    theirs: the same within four standard errors."""
    runs = FEW_RUNS[:20].copy()
    runs[0] += 500.0 * PULSE[:, None]
    beside = DETECTORS[name]().run(SHORT.record(runs))
    assert beside.p_value[0] < 1e-30
    for i in (1, 2, 3):
        alone = DETECTORS[name]().run(SHORT.record(runs[i]))
        error = np.hypot(alone.p_value_se, beside.p_value_se[i])
        assert abs(beside.p_value[i] - alone.p_value) <= 4.0 * error + 1e-12


@each
def test_threshold_depends_on_the_schedule_only(name: str) -> None:
    detector = DETECTORS[name]()
    threshold = detector.threshold(SHORT.record(FEW_RUNS))
    assert isinstance(threshold, float)
    other = SHORT.record(100.0 + 3.0 * FEW_RUNS[5])
    assert detector.threshold(other) == threshold
    assert detector.run(other).threshold == threshold
    gone = FEW_RUNS[5].copy()
    gone[25:] = np.nan
    assert detector.threshold(SHORT.record(gone)) != threshold


@each
def test_seed_decides_the_calibration_and_nothing_else(name: str) -> None:
    record = SHORT.record(FEW_RUNS[3])
    one, again, other = (DETECTORS[name](seed=seed).run(record) for seed in (0, 0, 1))
    assert one.p_value == again.p_value
    assert one.p_value != other.p_value
    assert abs(one.p_value - other.p_value) <= 4.0 * np.hypot(one.p_value_se, other.p_value_se)
    np.testing.assert_array_equal(one.ratio, other.ratio)


@each
def test_standard_error_is_the_spread_over_seeds(name: str) -> None:
    """Sixteen: their deviation is itself known to 18 %, and the limits are three of that."""
    record = SHORT.record(faulty(FEW_RUNS[3], PULSE))
    found = [DETECTORS[name](samples=64, seed=seed).run(record) for seed in range(16)]
    p = np.array([f.p_value for f in found])
    se = np.array([f.p_value_se for f in found])
    assert 0.46 < p.std(ddof=1) / np.sqrt(np.mean(se**2)) < 1.54


@pytest.mark.parametrize("ends", [False, True])
def test_irregular_schedules_and_unknown_ends(ends: bool) -> None:
    """2000 runs at 0.05: 100 +- 10; components missing, two channels, the end unknown too."""
    scene = irregular(40)
    z = scene.simulated(2000, 9)
    direction = {"a": 1.0, "b": -0.4}
    detector = sf.OnsetDetector(sf.Profile.step(), direction, ends=ends, false_alarm=0.05)
    found: Any = detector.run(scene.record(z))
    assert 0.035 <= np.mean(found.detected) <= 0.065
    assert 0.035 <= np.mean(found.p_value <= 0.05) <= 0.065
