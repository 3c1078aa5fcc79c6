"""Hypotheses per measurement against the enumeration of all 2^N, one Cholesky factor each."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import surefix as sf
from oracle import hypotheses
from oracle.compare import covariance_error, state_error
from oracle.mixture import Mixture
from robust.scenes import FaultScene, random_scene

SEEDS = range(12)


def scene(seed: int) -> FaultScene:
    return random_scene(seed, kinds=(("outage",), ("outage",)), measurements=9)


def estimate(seed: int, **options: float) -> tuple[FaultScene, sf.RobustFilter, Mixture]:
    case = scene(seed)
    filter = case.filter(
        hypotheses="measurement", prior="constant", carry="one", components=1, **options
    )
    return case, filter, hypotheses.per_measurement(case.step(0.0, 1.0, case.x0, case.P0))


def faults(count: int, measurements: int) -> npt.NDArray[np.int64]:
    """Bit i of hypothesis h says whether measurement i is an outlier."""
    return np.arange(count)[:, None] >> np.arange(measurements)[None, :] & 1


@pytest.mark.parametrize("seed", SEEDS)
def test_every_hypothesis(seed: int) -> None:
    case, filter, expected = estimate(seed)
    case.push(filter, until=1.0)
    found = filter.estimate(1.0)
    mixture = filter.mixture()
    bits = faults(len(mixture["log_weight"]), expected.labels.shape[1])
    order = np.lexsort(bits.T[::-1])  # as itertools.product has them, the last one fastest
    assert np.array_equal(bits[order], expected.labels)
    np.testing.assert_allclose(
        mixture["log_weight"][order], expected.log_weight, rtol=1e-12, atol=1e-10
    )
    for x, P, x_k, P_k in zip(
        mixture["x"][order], mixture["P"][order], expected.xs, expected.Ps, strict=True
    ):
        assert state_error(x, x_k, P_k) <= 1e-10
        assert covariance_error(P, P_k) <= 1e-10
    assert state_error(found.x, expected.x, expected.P) <= 1e-10
    assert covariance_error(found.P, expected.P) <= 1e-10
    assert filter.log_likelihood == pytest.approx(expected.log_evidence, rel=1e-10, abs=1e-10)


@pytest.mark.parametrize("seed", SEEDS)
def test_outlier_probabilities(seed: int) -> None:
    case, filter, expected = estimate(seed)
    result = filter.run(case.log, times=[1.0])
    used = result.step == 0
    probability = (np.exp(expected.log_weight)[:, None] * expected.labels).sum(axis=0)
    np.testing.assert_allclose(result.outlier_probability[used], probability, atol=1e-10)
    assert np.array_equal(result.rejected[used], probability > 0.5)
    assert result.discarded_mass[0] == 0.0


def test_a_beam_counts_what_it_leaves_out() -> None:
    case, filter, expected = estimate(3, beam=8)
    case.push(filter, until=1.0)
    found = filter.estimate(1.0)
    kept = filter.mixture()
    assert len(kept["log_weight"]) <= 8
    assert found.discarded_mass > 0
    assert abs(found.x[0] - expected.x[0]) < 3 * np.sqrt(expected.P[0, 0])


@pytest.mark.parametrize("seed", SEEDS[:6])
@pytest.mark.parametrize("most", [0, 1, 3])
def test_at_most_so_many_outliers(seed: int, most: int) -> None:
    """The enumeration of those that are left, renormalised."""
    case, filter, expected = estimate(seed, max_faults=most)
    case.push(filter, until=1.0)
    found = filter.estimate(1.0)
    few = expected.labels.sum(axis=1) <= most
    assert len(filter.mixture()["log_weight"]) == few.sum()
    weight = np.exp(expected.log_weight[few] - np.logaddexp.reduce(expected.log_weight[few]))
    xs, Ps = expected.xs[few], expected.Ps[few]
    x = weight @ xs
    P = np.einsum("h,hij->ij", weight, Ps + np.einsum("hi,hj->hij", xs - x, xs - x))
    assert state_error(found.x, x, P) <= 1e-10
    assert covariance_error(found.P, P) <= 1e-10
    left_out = np.exp(expected.log_weight[~few]).sum()
    assert left_out * (1 - 1e-9) <= found.discarded_mass <= 1


@pytest.mark.parametrize(
    ("good", "off"), [(6, 8), (5, 7), (7, 5)], ids=["most are off", "few", "most are good"]
)
@pytest.mark.parametrize("options", [{}, {"max_faults": 8}, {"beam": 64, "components": 4}])
def test_what_later_readings_would_have_saved(good: int, off: int, options: Any) -> None:
    """Readings of 10, then of 50: what is improbable after the first may be right at the end.
    Limits hold what those of the whole enumeration hold, or there are none."""
    sensor = sf.Sensor("a", 1.0, faults=(sf.Outage(span=100.0, probability=1e-3),))
    arguments: dict[str, Any] = {
        "start": 0.0, "hypotheses": "measurement", "carry": "cut", "risk": 1e-11,
    }  # fmt: skip
    limits = []
    for chosen in ({"cut": 0.0, "beam": 1 << 15, "components": 1}, options):
        filter = sf.RobustFilter(
            sf.ConstantAcceleration(1e-3),
            [sensor],
            [10.0, 0.0],
            np.diag([1e4, 1e-6]),
            **{**arguments, **chosen},
        )
        for i in range(good + off):
            filter.push(0.01 * (i + 1), "a", 10.0 if i < good else 50.0)
        found = filter.estimate(1.0)
        limits.append((found.lower, found.upper))
    (low, high), (lower, upper) = limits
    assert lower <= low + 1e-6
    assert upper >= high - 1e-6


@pytest.mark.parametrize("seed", SEEDS[:6])
def test_what_is_not_worth_it_is_counted(seed: int) -> None:
    """``cut`` bounds the mass left out, and the moments move by no more than that allows."""
    case, filter, expected = estimate(seed, cut=1e-6, risk=1e-3)
    case.push(filter, until=1.0)
    found = filter.estimate(1.0)
    assert len(filter.mixture()["log_weight"]) < len(expected.log_weight)
    assert 0 < found.discarded_mass <= 1e-6  # cut at the end of the step, where weights are known
    assert state_error(found.x, expected.x, expected.P) < 0.05
    result = filter.run(case.log, times=[1.0])
    assert result.discarded_mass[0] == found.discarded_mass


def test_max_faults_counts_measurements() -> None:
    with pytest.raises(sf.ConfigError, match=r"max_faults: .*from 0 to 64, got 65"):
        estimate(0, max_faults=65)


def test_more_than_64_measurements_are_an_error() -> None:
    sensor = sf.Sensor("a", 1.0, faults=(sf.Outage(span=100.0, probability=0.01),))
    filter = sf.RobustFilter(
        sf.ConstantAcceleration(0.1), [sensor], [0.0, 0.0], np.eye(2), hypotheses="measurement",
        start=0.0,
    )  # fmt: skip
    log = sf.Log(np.arange(1, 66) / 100, np.full(65, "a"), np.zeros(65))
    with pytest.raises(sf.NumericalError, match=r"buffer_full, .*\(64 with .*a higher rate"):
        filter.run(log, times=[1.0])
    assert filter.run(log, times=[0.3, 1.0]).time.shape == (2,)


@pytest.mark.parametrize("faults", [(sf.Drifting(sigma=1.0, walk=0.0, probability=0.1),), ()])
def test_only_outages_are_outliers(faults: tuple[sf.Drifting, ...]) -> None:
    sensor = sf.Sensor("a", 1.0, faults=faults)
    arguments = (sf.ConstantAcceleration(0.1), [sensor], [0.0, 0.0], np.eye(2))
    if faults:
        with pytest.raises(sf.ConfigError, match="hypotheses"):
            sf.RobustFilter(*arguments, hypotheses="measurement", prior="constant")
    else:  # nothing can be wrong: one hypothesis
        filter = sf.RobustFilter(*arguments, hypotheses="measurement", prior="constant", start=0.0)
        filter.push(0.5, "a", 1.0)
        filter.estimate(1.0)
        assert len(filter.mixture()["log_weight"]) == 1


def test_what_it_needs_is_named() -> None:
    """And nothing that it does not use: modes of many sensors make no combinations here."""
    chain = sf.Outage(span=100.0, rate=0.01, duration=1.0)
    for faults, message in (
        ((chain,), "probability of an Outage; that of sensor 's0' has none"),
        ((sf.Noisy(factor=4.0, probability=0.1),), "sensor 's0' has noisy"),
    ):
        with pytest.raises(sf.ConfigError, match=message):
            sf.RobustFilter(
                sf.ConstantVelocity(0.1), [sf.Sensor("s0", 1.0, faults=faults)], [0.0], [[1.0]],
                hypotheses="measurement",
            )  # fmt: skip
    faults = (sf.Outage(span=100.0, probability=0.01),)
    many = [sf.Sensor(f"s{i}", 1.0, faults=faults) for i in range(16)]
    filter = sf.RobustFilter(
        sf.ConstantAcceleration(0.1), many, [0.0, 0.0], np.eye(2), hypotheses="measurement"
    )
    assert filter.prior == "constant"
    healthy = [sf.Sensor("s0", 1.0)]
    sf.RobustFilter(sf.ConstantVelocity(0.1), healthy, [0.0], [[1.0]], hypotheses="measurement")


def test_a_sensor_is_as_doubtful_as_its_worst_row() -> None:
    case, filter, _ = estimate(2)
    result = filter.run(case.log, times=[1.0])
    used = result.step == 0
    for s, sensor in enumerate(case.sensors):
        rows = used & (case.log.sensor == sensor.name)
        worst = result.outlier_probability[rows].max(initial=0.0)
        assert result.fault_probability[0, s] == pytest.approx(worst, abs=1e-15)
        assert (result.hypothesis[0, s] == 1) == (worst > 0.5)
