"""Hypotheses per measurement against the enumeration of all 2^N, one Cholesky factor each."""

from __future__ import annotations

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
    assert found.discarded_mass > 0


@pytest.mark.parametrize("seed", SEEDS[:6])
def test_what_is_not_worth_it_is_counted(seed: int) -> None:
    """``cut`` bounds the mass left out, and the moments move by no more than that allows."""
    case, filter, expected = estimate(seed, cut=1e-6, risk=1e-3)
    case.push(filter, until=1.0)
    found = filter.estimate(1.0)
    assert len(filter.mixture()["log_weight"]) < len(expected.log_weight)
    assert 0 < found.discarded_mass <= 1e-6
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
    with pytest.raises(sf.NumericalError, match="buffer_full"):
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
