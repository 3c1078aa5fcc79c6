"""Failures of other filters that must not be ours, each named after the failure."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys

import numpy as np
import pytest

import surefix as sf
from oracle import composite_forward, models, sequential
from oracle.compare import smallest_correlation
from oracle.noise import noise_estimate
from oracle.precise import update as precise_update
from oracle.step import Array, Step, concatenate
from oracle.strategies import random_journey

YEAR = 365.25 * 86400.0
SPEED = sf.ConstantAcceleration(jerk=0.08)
WHEEL, RADAR = sf.Sensor("wheel", 1.0), sf.Sensor("radar", 0.5)


def long_log(count: int, seed: int = 0) -> sf.Log:
    rng = np.random.default_rng(seed)
    return sf.Log(
        np.sort(rng.uniform(0.0, 0.1 * count, count)),
        np.where(rng.random(count) < 0.5, "wheel", "radar"),
        20.0 + rng.normal(size=count),
    )


def smallest_correlations(P: Array) -> float:
    """Smallest eigenvalue of all the matrices P (T, n, n), each scaled to a unit diagonal."""
    sigma = np.sqrt(np.diagonal(P, axis1=1, axis2=2))
    unit = np.where(sigma > 0.0, sigma, 1.0)
    return float(np.linalg.eigvalsh(P / (unit[:, :, None] * unit[:, None, :])).min())


@pytest.mark.parametrize(
    "sensors",
    [
        (WHEEL, RADAR),
        (sf.Sensor("wheel", 1.0, scale_sigma=0.01), sf.Sensor("radar", 0.5, bias_sigma=0.3)),
    ],
    ids=["fixed size", "sensor states"],
)
def test_covariance_loses_symmetry_within_1000_benign_steps(
    sensors: tuple[sf.Sensor, ...],
) -> None:
    """P = F P F' + Q - K S K' does. Here it is symmetric to the bit over 100 000."""
    n = 2 + sum(s.scale_sigma > 0 for s in sensors) + sum(s.bias_sigma > 0 for s in sensors)
    filter = sf.DesyncFilter(SPEED, sensors, [20.0, 0.0], np.eye(2))
    P = filter.run(long_log(100_000), noise=None).P
    assert P.shape == (100_000, n, n)
    assert np.array_equal(P, P.transpose(0, 2, 1))
    assert smallest_correlations(P[::20]) >= 0.0


def test_negative_variance_at_condition_1e12() -> None:
    """A prior of a million, a sensor of a millionth, no process noise: twelve decades and more."""
    model = sf.ConstantAcceleration(jerk=0.0, position=True)
    sharp = sf.Sensor("wheel", 1e-6)
    far = sf.Sensor("radar", 1e6, observes=(1.0, 0.0, 0.0))
    filter = sf.DesyncFilter(model, [sharp, far], np.zeros(3), 1e12 * np.eye(3), start=0.0)
    log = long_log(5000, seed=1)
    result = filter.run(sf.Log(log.time / 100, log.sensor, np.zeros(5000)))
    variances = np.diagonal(result.P, axis1=1, axis2=2)
    assert variances.min() > 0.0
    assert smallest_correlations(result.P) >= -1e-15
    condition = np.linalg.cond(result.P)
    assert condition.max() > 1e12
    assert np.array_equal(result.P, result.P.transpose(0, 2, 1))
    assert (result.noise_variance[np.isfinite(result.noise_variance)] > 0.0).all()


@pytest.mark.parametrize("way", ["sequential", "composite"])
@pytest.mark.parametrize("seed", range(5))
def test_negative_variance_of_a_composite_step(way: str, seed: int) -> None:
    """Variances spread over twelve decades."""
    (step,) = (journey := random_journey(seed, n=6, step_count=1, decades=12)).steps
    mine = sf.CompositeStep(step.F, step.Q, step.H, step.R)
    update = mine.update(journey.x0, journey.P0, concatenate(step.z), way=way)
    assert smallest_correlation(update.P) >= -1e-14
    assert (update.noise_variance > 0.0).all()
    assert update.sse >= 0.0


def test_negative_chi_squared() -> None:
    """A sum of squares, even of readings that repeat the estimate to the last digit."""
    filter = sf.DesyncFilter(SPEED, [WHEEL], [20.0, 0.0], 1e-12 * np.eye(2), start=0.0)
    log = sf.Log(np.arange(1, 200) / 10, ["wheel"] * 199, np.full(199, 20.0))
    result = filter.run(log)
    assert (result.sse >= 0.0).all()
    assert (result.p_value <= 1.0).all()


def test_variance_collapses_in_single_precision() -> None:
    """Thousands of equal readings of a constant: the variance goes on falling as 1 / N."""
    filter = sf.DesyncFilter(sf.ConstantVelocity(0.0), [WHEEL], [0.0], [[1e8]], start=0.0)
    count = 50_000
    log = sf.Log(np.arange(count) / 100, ["wheel"] * count, np.full(count, 3.0))
    variance = filter.run(log, noise=None).P[:, 0, 0]
    expected = 1.0 / (1e-8 + np.arange(1, count + 1))
    np.testing.assert_allclose(variance, expected, rtol=1e-10)


def test_late_data_gives_a_negative_covariance_a_lock_up_or_NaN() -> None:
    """Every third reading comes a second late, some of them after the estimate they belong to."""
    log = long_log(3000, seed=2)
    delays = np.where(np.arange(3000) % 3 == 0, 1.0, 0.0)
    arrival = np.argsort(log.time + delays, kind="stable")
    filter = sf.DesyncFilter(SPEED, [WHEEL, RADAR], [20.0, 0.0], np.eye(2), start=0.0)
    last, late = 0.0, 0
    for i in arrival.tolist():
        now = float(log.time[i] + delays[i])
        if now > last + 0.7:
            last = now
            estimate = filter.estimate(now)
            assert np.isfinite(estimate.x).all()
            assert smallest_correlation(estimate.P) >= 0.0
        late += (
            filter.push(float(log.time[i]), str(log.sensor[i]), float(log.value[i])).name != "ok"
        )
    assert late == filter.counters["too_late"] > 100
    assert filter.counters["ok"] == 3000 - late
    assert abs(filter.estimate(last + 1.0).x[0] - 20.0) < 2.0


def test_equal_time_stamps_divide_by_zero_or_lose_a_reading() -> None:
    """Two sensors, and two readings of one sensor, at one time: all count, in closed form."""
    filter = sf.DesyncFilter(sf.ConstantVelocity(1.0), [WHEEL, RADAR], [0.0], [[4.0]], start=0.0)
    log = sf.Log([1.0] * 3, ["wheel", "radar", "wheel"], [1.0, 2.0, 3.0])
    result = filter.run(log)
    assert result.degrees_of_freedom.tolist() == [3]
    information = 1 / 5.0 + 1 / 1.0 + 1 / 0.25 + 1 / 1.0  # 5 = 4 + the walk of one second
    mean = (1.0 / 1.0 + 2.0 / 0.25 + 3.0 / 1.0) / information
    assert result.x[0, 0] == pytest.approx(mean, rel=1e-14)
    assert result.P[0, 0, 0] == pytest.approx(1 / information, rel=1e-14)


def test_repeated_message_counts_twice() -> None:
    """The same sensor, time and value is one reading."""
    filter = sf.DesyncFilter(sf.ConstantVelocity(1.0), [WHEEL], [0.0], [[4.0]], start=0.0)
    once = filter.run(sf.Log([1.0], ["wheel"], [1.0]))
    twice = filter.run(sf.Log([1.0, 1.0], ["wheel", "wheel"], [1.0, 1.0]))
    assert np.array_equal(once.P, twice.P)
    assert twice.counts == {"ok": 1, "repeated": 1}


def test_scalar_updates_with_stale_innovations_depend_on_the_order() -> None:
    """Rows of one instant in any order, with correlated states: the same bits."""
    rng = np.random.default_rng(3)
    sensors = [sf.Sensor(f"s{i}", 0.5 + i, bias_sigma=0.3) for i in range(4)]
    rows = [(1.0, f"s{i % 4}", float(rng.normal(20.0, 1.0))) for i in range(12)]
    filter = sf.DesyncFilter(SPEED, sensors, [20.0, 0.0], np.full((2, 2), 0.5) + np.eye(2))
    results = []
    for _ in range(10):
        order = rng.permutation(12)
        results.append(filter.run(sf.Log(*zip(*(rows[i] for i in order), strict=True))))
    for result in results:
        assert np.array_equal(result.x, results[0].x)
        assert np.array_equal(result.P, results[0].P)
        assert result.log_likelihood == results[0].log_likelihood


@pytest.mark.parametrize("way", ["sequential", "composite"])
def test_log_likelihood_is_wrong_only_when_observations_are_vectors(way: str) -> None:
    for seed in range(10):
        journey = random_journey(seed, n=4, measurements=15, step_count=1, largest=3)
        (step,) = journey.steps
        expected = precise_update(step, journey.x0, journey.P0).log_likelihood
        mine = sf.CompositeStep(step.F, step.Q, step.H, step.R)
        update = mine.update(journey.x0, journey.P0, concatenate(step.z), way=way)
        assert any(z.size > 1 for z in step.z)
        assert update.log_likelihood == pytest.approx(expected, rel=1e-12)


def test_innovation_variance_of_zero_gives_a_silent_NaN() -> None:
    """A state that is known, and a sensor so sharp that its variance underflows: refused. The
    sharpest that there is: answered."""
    with pytest.raises(sf.ConfigError, match=r"'w', sigma: expected .*got 1e-170"):
        sf.Sensor("w", 1e-170)
    sharp = sf.Sensor("w", 1e-150)
    filter = sf.DesyncFilter(sf.ConstantVelocity(0.0), [sharp], [1.0], [[0.0]], start=0.0)
    result = filter.run(sf.Log([0.5, 0.6], ["w", "w"], [1e9, 2e9]), times=[1.0])
    assert result.counts == {"numerical": 2}
    assert result.x.tolist() == [[1.0]]
    assert result.P.tolist() == [[[0.0]]]
    assert result.degrees_of_freedom.tolist() == [0]
    with pytest.raises(sf.ConfigError, match="definite"):
        sf.CompositeStep([np.eye(1)] * 2, [np.zeros((1, 1))] * 2, [np.eye(1)], [[[0.0]]])


@pytest.mark.parametrize(
    "sensor",
    [RADAR, sf.Sensor("radar", 0.5, bias_sigma=0.3, bias_time=5.0)],
    ids=lambda s: s.bias_sigma,
)
def test_a_gap_of_a_year(sensor: sf.Sensor) -> None:
    """The estimate goes on, as wide as the model says, and the next reading brings it back."""
    filter = sf.DesyncFilter(SPEED, [sensor], [20.0, 0.0], np.eye(2), start=0.0)
    log = sf.Log([1.0, YEAR, YEAR + 0.1], ["radar"] * 3, [20.1, 25.0, 25.1])
    result = filter.run(log, times=[1.0, YEAR - 1e-3, YEAR + 0.2])
    assert result.counts == {"ok": 3}
    assert np.isfinite(result.x).all()
    F, Q, _ = models.van_loan(models.constant_acceleration(0.08, position=False), YEAR - 1.001)
    expected = F @ result.P[0, :2, :2] @ F.T + Q
    np.testing.assert_allclose(result.P[1, :2, :2], expected, rtol=1e-9)
    assert smallest_correlations(result.P) >= 0.0
    assert abs(result.x[2, 0] - 25.1) < 5.0
    assert result.sigma[2] < 2.0


REPLAY = """
import hashlib, numpy as np, surefix as sf
rng = np.random.default_rng(4)
sensors = [sf.Sensor("wheel", 1.0, scale_sigma=0.01), sf.Sensor("radar", 0.5, bias_sigma=0.3)]
filter = sf.DesyncFilter(sf.ConstantAcceleration(0.08), sensors, [20.0, 0.0], np.eye(2))
time, who = rng.uniform(0, 100, 2000), np.where(rng.random(2000) < 0.5, "wheel", "radar")
result = filter.run(sf.Log(time, who, rng.normal(20.0, 1.0, 2000)), rate=5.0, noise="journey")
digest = hashlib.sha256()
for a in (result.x, result.P, result.sse, result.noise, result.noise_variance):
    digest.update(a.tobytes())
print(digest.hexdigest(), result.log_likelihood.hex())
"""


def test_replay_is_not_reproducible() -> None:
    """The same bits in another process, and with another number of threads."""
    answers = {
        subprocess.run(
            [sys.executable, "-c", REPLAY],
            capture_output=True,
            text=True,
            check=True,
            env={**os.environ, "OMP_NUM_THREADS": threads, "OPENBLAS_NUM_THREADS": threads},
        ).stdout
        for threads in ("1", "2")
    }
    assert len(answers) == 1
    assert len(answers.pop().split()[0]) == hashlib.sha256().digest_size * 2


def test_gross_fault_leaves_no_NaN_and_no_tie() -> None:
    """Likelihoods floored at the smallest double make all faults equal; logarithms do not."""
    likelihoods = []
    for fault in (120.0, 1e3, 1e100):
        filter = sf.DesyncFilter(SPEED, [WHEEL], [0.0, 0.0], np.eye(2), start=0.0)
        result = filter.run(sf.Log([0.1], ["wheel"], [fault]))
        assert np.isfinite(result.x).all()
        assert result.p_value[0] == 0.0 or fault == 120.0
        likelihoods.append(result.log_likelihood)
    assert likelihoods == sorted(likelihoods, reverse=True)
    assert len(set(likelihoods)) == 3
    assert np.isfinite(likelihoods).all()


def test_an_absurd_reading_is_not_used_in_silence() -> None:
    """So large that its square overflows: refused and counted, and nothing else changes."""
    filter = sf.DesyncFilter(SPEED, [WHEEL], [0.0, 0.0], np.eye(2), start=0.0)
    result = filter.run(sf.Log([0.1, 0.2], ["wheel"] * 2, [1e200, 0.1]), times=[1.0])
    without = filter.run(sf.Log([0.2], ["wheel"], [0.1]), times=[1.0])
    assert result.counts == {"ok": 1, "numerical": 1}
    np.testing.assert_allclose(result.x, without.x, rtol=1e-14)
    assert np.isfinite(result.log_likelihood)


def test_nis_of_a_vector_is_not_the_sum_of_its_components() -> None:
    """SSE of a step is that of the sequential filter, whitened: gamma' Gamma^-1 gamma."""
    journey = random_journey(7, n=3, measurements=9, step_count=1, largest=3)
    step: Step = journey.steps[0]
    mine = sf.CompositeStep(step.F, step.Q, step.H, step.R)
    update = mine.update(journey.x0, journey.P0, concatenate(step.z))
    nis = sequential.kalman(step, journey.x0, journey.P0).nis
    assert update.sse == pytest.approx(float(nis.sum()), rel=1e-12)

    posterior = composite_forward.update(step, journey.x0, journey.P0)
    dense = noise_estimate(posterior, step.Upsilon)
    assert update.sse == pytest.approx(dense.sse, rel=1e-10)
