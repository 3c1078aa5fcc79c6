"""Legal, but at the edge: each of these gave a wrong number once."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import surefix as sf

SYSTEM = sf.LinearSystem(
    A=np.array([[1, 0.1], [0, 1]]), H=np.array([[1.0, 0.0]]), Q=np.diag([1e-4, 1e-3]),
    R=np.array([[0.25]]), x0=np.zeros(2), P0=np.eye(2),
)  # fmt: skip


def healthy(runs: int, steps: int, seed: int) -> Any:
    """(runs, steps, 1) drawn from the model."""
    rng = np.random.RandomState(seed)
    x = rng.normal(size=(runs, 2))
    z = np.empty((runs, steps, 1))
    for k in range(steps):
        if k > 0:
            x = x @ SYSTEM.A.T + rng.normal(size=(runs, 2)) * np.sqrt(np.diag(SYSTEM.Q))
        z[:, k, 0] = x[:, 0] + 0.5 * rng.normal(size=runs)
    return z


@pytest.mark.parametrize("time", [-1e8, 1e8, 1e12, -1e15])
def test_exponentials_far_longer_than_the_record_are_ramps(time: float) -> None:
    record = sf.ForwardRecord(SYSTEM, healthy(300, 100, 1))
    found = sf.OnsetDetector(sf.Profile.exponential(time)).run(record)
    ramp = sf.OnsetDetector(sf.Profile.ramp()).run(record)
    apart = 100 / (2 * abs(time))  # how much the course differs from a ramp's in 100 steps
    np.testing.assert_allclose(found.ratio, ramp.ratio, rtol=1e-5, atol=1e-9 + 100 * apart)
    assert np.mean(found.detected) < 0.02
    np.testing.assert_allclose(
        found.amplitudes / time, ramp.amplitudes, rtol=1e-5, atol=1e-9 + 100 * apart
    )


@pytest.mark.parametrize("time", [-0.5, -0.24])
def test_growth_that_almost_overflows(time: float) -> None:
    """Numerators of 1e170 whose ratios are those of any other fault."""
    record = sf.ForwardRecord(SYSTEM, healthy(1, 200, 2)[0])
    found = sf.OnsetDetector(sf.Profile.exponential(time)).run(record)
    assert found.drop is not None
    assert 0 <= float(found.drop) < 30
    assert not found.detected


def test_amplitudes_and_errors_of_as_many_runs_as_onsets() -> None:
    z = healthy(20, 20, 3)
    detector = sf.OnsetDetector(sf.Profile.sine(0.1))
    together = detector.run(sf.ForwardRecord(SYSTEM, z))
    for run in range(20):
        alone = detector.run(sf.ForwardRecord(SYSTEM, z[run]))
        for name in ("amplitude", "amplitude_se", "onset", "onset_first_order"):
            np.testing.assert_array_equal(getattr(together, name)[run], getattr(alone, name))


@pytest.mark.parametrize("detector", [sf.OnsetDetector(sf.Profile.ramp()), sf.SpectrumDetector()])
def test_a_stuck_run_among_others(detector: sf.OnsetDetector | sf.SpectrumDetector) -> None:
    z = healthy(3, 50, 4)
    z[1] = 1.0
    found: Any = detector.run(sf.ForwardRecord(SYSTEM, z))
    assert found.status.tolist() == ["not detected", "undetectable", "not detected"]
    assert np.isnan(found.drop).tolist() == [False, True, False]
    assert np.isnan(found.amplitude).tolist() == [False, True, False]
    assert np.isnan(found.p_value).tolist() == [False, True, False]
    assert not found.detected[1]


def test_one_row_far_away_does_not_stop_a_diagnosis() -> None:
    rng = np.random.RandomState(5)
    time = np.append(np.arange(599) * 0.1, 1e9)
    log = sf.Log(time, ["a"] * 600, 20 + 0.4 * rng.normal(size=600))
    model = sf.ConstantAcceleration(jerk=0.1)
    filter = sf.DesyncFilter(model, [sf.Sensor("a", 0.4)], [20.0, 0.0], np.diag([1.0, 0.1]))
    found = sf.diagnose(filter, log, samples=0)
    waves = [one for one in found.searched if one.kind == "sinusoid"]
    assert [one.status for one in waves] == ["undetectable"]
    assert "frequencies" in waves[0].reason


def test_at_the_sampling_rate_the_reason_is_not_that_there_is_no_data() -> None:
    record = sf.ForwardRecord(SYSTEM, healthy(1, 100, 6)[0])
    found = sf.SpectrumDetector(frequencies=[1.0]).run(record)
    assert found.status == "undetectable"
    assert "amplitude and phase" in found.reason
    assert found.amplitude is None


def test_unknown_ends_ask_for_too_much_memory() -> None:
    wide = sf.LinearSystem(
        A=np.eye(1), H=np.ones((30, 1)), Q=np.eye(1), R=np.eye(30), x0=np.zeros(1), P0=np.eye(1)
    )
    z = np.random.RandomState(7).normal(size=(1000, 30))
    detector = sf.OnsetDetector(sf.Profile.step(), channel="3", ends=True)
    with pytest.raises(sf.ShapeError, match=r"ends: .*1000 times 30000"):
        detector.run(sf.ForwardRecord(wide, z))
