"""Tests with linear nuisance against the paper's formulas (section 3), whatever the ranks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

import surefix as sf
from oracle import raim_distributions as distributions
from oracle.raim_linear import Linear, Noise, covariance
from oracle.step import Array

NOISES = ("scalar", "vector", "full")
FAULTS = ("any", "one", "several", "repeated", "hidden in part")


@dataclass(frozen=True)
class Case:
    n: int
    H: Array  # (n, m)
    M: Array | None  # (n, p)
    noise: Noise
    rng: np.random.RandomState

    @property
    def oracle(self) -> Linear:
        return Linear(self.H, self.M, self.noise)

    def engine(self, false_alarm: float = 1e-5) -> sf.raim.LinearTest:
        return sf.raim.LinearTest(self.H, self.M, noise=self.noise, false_alarm=false_alarm)

    def rounding(self, Y: Array) -> float:
        """Of whitened data: 1e-16 of Y, times the number of operations, over the least sigma."""
        least = float(np.sqrt(np.linalg.eigvalsh(covariance(self.noise, self.n))[0]))
        return 64 * float(np.finfo(float).eps) * self.n * float(np.linalg.norm(Y)) / least

    def data(self, epochs: int) -> Array:
        """(epochs, n), far along H and a few deviations elsewhere."""
        X = 100.0 * self.rng.normal(size=(epochs, self.H.shape[1]))
        return np.asarray(X @ self.H.T + 3.0 * self.rng.normal(size=(epochs, self.n)))


def case(seed: int, noise: str, fault: str, deficient: bool) -> Case:
    rng = np.random.RandomState(seed)
    n, m = int(rng.randint(5, 13)), int(rng.randint(1, 4))
    H = rng.normal(size=(n, m)) * 10.0 ** rng.uniform(-2, 2, m)
    if deficient:  # all zero, or a column twice in another unit
        H = np.column_stack([H, 1e3 * H[:, 0], np.zeros(n)])
    B = rng.normal(size=(n, n))
    sigma: dict[str, Noise] = {
        "scalar": float(rng.uniform(0.1, 10.0)),
        "vector": rng.uniform(0.5, 5.0, n),
        "full": B @ B.T + np.eye(n),
    }
    M = rng.normal(size=(n, 2))
    faults: dict[str, Array | None] = {
        "any": None,
        "one": M[:, :1],
        "several": M,
        "repeated": np.column_stack([M, M @ [1.0, -2.0]]),
        "hidden in part": np.column_stack([M[:, 0], H[:, 0]]),
    }
    return Case(n, H, faults[fault], sigma[noise], rng)


each = pytest.mark.parametrize("noise", NOISES)
each_fault = pytest.mark.parametrize("fault", FAULTS)
each_rank = pytest.mark.parametrize("deficient", [False, True])


@each
@each_fault
@each_rank
def test_statistic_degrees_and_p_value(noise: str, fault: str, deficient: bool) -> None:
    """Data are up to 1e7 off along H. Their rounding r moves the root of lambda by r."""
    for seed in range(3):
        c = case(seed, noise, fault, deficient)
        test, Y = c.engine(1e-2), c.data(20)
        found, known = test.run(Y), c.oracle.statistic(Y)
        assert (test.rank, test.degrees) == (c.oracle.rank, c.oracle.degrees)
        near = max(c.rounding(y) for y in Y)
        np.testing.assert_allclose(np.sqrt(found.statistic), np.sqrt(known), rtol=1e-12, atol=near)
        threshold = float(distributions.threshold(1e-2, test.degrees))
        assert test.threshold == pytest.approx(threshold, rel=1e-12)
        assert np.all(found.degrees == test.degrees)
        assert np.all(found.threshold == test.threshold)
        # d ln p / d root lambda is less than root lambda + 1 in size
        p, slope = stats.chi2.sf(known, test.degrees), 1.0 + np.sqrt(known)
        assert np.all(np.abs(found.p_value / p - 1.0) <= 1e-11 + 2.0 * near * slope)
        clear = np.abs(np.sqrt(known / threshold) - 1.0) > near
        np.testing.assert_array_equal(found.alarm[clear], (known > threshold)[clear])
        assert found.valid.all()


@each
@each_rank
def test_parity_space(noise: str, deficient: bool) -> None:
    """W W' = I and W L^-1 H = 0, and the parity vector's length is the root of the statistic."""
    c = case(5, noise, "any", deficient)
    test, L = c.engine(), np.linalg.cholesky(covariance(c.noise, c.n))
    W, H, Y = test.W, np.linalg.solve(L, c.H), c.data(7)
    assert W.shape == (c.n - c.oracle.rank, c.n)
    np.testing.assert_allclose(W @ W.T, np.eye(len(W)), atol=1e-14)
    scale = np.where(H.any(axis=0), np.linalg.norm(H, axis=0), 1.0)
    np.testing.assert_allclose(W @ (H / scale), 0.0, atol=1e-13)
    found = test.run(Y)
    assert found.parity.shape == (7, len(W))
    white = np.linalg.solve(L, Y.T).T
    np.testing.assert_allclose(found.parity, white @ W.T, atol=max(c.rounding(y) for y in Y))
    np.testing.assert_allclose(np.sum(found.parity**2, axis=1), found.statistic, rtol=1e-12)
    narrower = case(5, noise, "one", deficient).engine()
    assert narrower.W.shape == W.shape  # the nuisance alone decides what is left


@each
@each_fault
def test_power_of_a_bias(noise: str, fault: str) -> None:
    """The noncentrality is the statistic of the bias, and the power that of chi2(k, lambda)."""
    c = case(7, noise, fault, False)
    test, bias = c.engine(1e-4), c.rng.normal(size=(2, 3, c.n))
    lam = c.oracle.statistic(bias)
    np.testing.assert_allclose(test.noncentrality(bias), lam, rtol=1e-9)
    power, missed = test.power(bias), test.missed(bias)
    assert power.shape == missed.shape == (2, 3)
    for index in np.ndindex(2, 3):
        known = float(distributions.power(lam[index], test.degrees, 1e-4))
        assert power[index] == pytest.approx(known, rel=1e-9)
        known = float(distributions.missed(lam[index], test.degrees, 1e-4))
        assert missed[index] == pytest.approx(known, rel=1e-9)


@each
@each_fault
@each_rank
def test_minimum_detectable(noise: str, fault: str, deficient: bool) -> None:
    c = case(8, noise, fault, deficient)
    test, direction = c.engine(), c.rng.normal(size=(4, c.n))
    wanted = float(distributions.noncentrality(1e-3, test.degrees, 1e-5))
    known = np.sqrt(wanted / c.oracle.statistic(direction))
    found = test.minimum_detectable(direction)
    np.testing.assert_allclose(found, known, rtol=1e-9)
    np.testing.assert_allclose(test.missed(found[:, None] * direction), 1e-3, rtol=1e-8)
    twice = test.minimum_detectable(2.0 * direction[0], missed=1e-3)
    assert twice == pytest.approx(known[0] / 2.0, rel=1e-9)


@each
@each_fault
@each_rank
def test_what_hides_in_the_nuisance_is_undetectable(
    noise: str, fault: str, deficient: bool
) -> None:
    c = case(9, noise, fault, deficient)
    hidden = c.H @ c.rng.normal(size=c.H.shape[1])
    assert c.engine().minimum_detectable(hidden) == np.inf
    assert c.engine().minimum_detectable(np.zeros(c.n)) == np.inf
    assert c.engine().missed(hidden) == pytest.approx(1.0 - 1e-5, rel=1e-12)


def test_what_is_missed_anyway_needs_no_bias() -> None:
    """With alpha = 0.5, half of nothing is missed."""
    c = case(9, "scalar", "any", False)
    found = c.engine(0.5).minimum_detectable(np.eye(c.n)[0], missed=0.6)
    assert found == 0.0


@given(
    seed=st.integers(0, 10_000), noise=st.sampled_from(NOISES), fault=st.sampled_from(FAULTS),
    deficient=st.booleans(), size=st.floats(-6.0, 6.0),
)  # fmt: skip
def test_invariance_under_the_nuisance(
    seed: int, noise: str, fault: str, deficient: bool, size: float
) -> None:
    """Y + H X for any X, to the rounding of Y + H X itself."""
    c = case(seed, noise, fault, deficient)
    test, Y = c.engine(), c.rng.normal(size=c.n)
    shift = c.H @ (10.0**size * c.rng.normal(size=c.H.shape[1]))
    before, after = test.run(Y), test.run(Y + shift)
    root = np.sqrt(before.statistic)
    assert abs(np.sqrt(after.statistic) - root) <= c.rounding(Y + shift) + 1e-12 * root


@pytest.mark.parametrize("broken", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("fault", ["any", "one"])
def test_rows_that_are_no_numbers(broken: float, fault: str) -> None:
    c = case(11, "full", fault, False)
    test, Y = c.engine(0.5), c.data(6)
    whole = test.run(Y)
    Y[2, 1] = Y[5, c.n - 1] = broken
    found = test.run(Y)
    assert found.valid.tolist() == [True, True, False, True, True, False]
    assert np.isnan(found.statistic[~found.valid]).all()
    assert np.isnan(found.p_value[~found.valid]).all()
    assert not found.alarm[~found.valid].any()
    for name in ("statistic", "p_value", "alarm", "parity"):
        kept = getattr(found, name)[found.valid]
        np.testing.assert_array_equal(kept, getattr(whole, name)[found.valid])
    one = test.run(Y[2])
    assert not one.valid
    assert not one.alarm
    assert np.isnan(one.statistic)


def test_one_epoch_is_the_same_as_in_a_batch() -> None:
    c = case(12, "vector", "several", False)
    test, Y = c.engine(), c.data(300)
    batch = test.run(Y)
    assert batch.statistic.shape == batch.alarm.shape == (300,)
    for i in (0, 1, 17, 299):
        one = test.run(Y[i])
        assert np.ndim(one.statistic) == 0
        assert one.statistic == batch.statistic[i]
        assert one.p_value == batch.p_value[i]
        np.testing.assert_array_equal(one.parity, batch.parity[i])
    assert test.run(np.zeros((0, c.n))).statistic.shape == (0,)


@pytest.mark.parametrize("m", [4, 6])
def test_nothing_left_to_test(m: int) -> None:
    rng = np.random.RandomState(1)
    test = sf.raim.LinearTest(rng.normal(size=(4, m)))
    assert (test.rank, test.degrees) == (4, 0)
    assert test.W.shape == (0, 4)
    assert np.isnan(test.threshold)
    found = test.run(rng.normal(size=(3, 4)))
    assert found.available.tolist() == [False] * 3
    assert found.statistic.tolist() == [0.0] * 3
    assert np.isnan(found.p_value).all()
    assert not found.alarm.any()
    assert test.minimum_detectable(np.eye(4)[0]) == np.inf
    hidden = sf.raim.LinearTest(rng.normal(size=(6, 2)))
    assert hidden.run(np.zeros(6)).available is True


def test_a_fault_inside_the_nuisance() -> None:
    rng = np.random.RandomState(2)
    H = rng.normal(size=(6, 2))
    test = sf.raim.LinearTest(H, H @ rng.normal(size=(2, 2)))
    assert (test.rank, test.degrees) == (2, 0)
    assert test.run(rng.normal(size=6)).available is False


@pytest.mark.parametrize("H", [np.zeros((5, 0)), np.zeros((5, 2))])
def test_no_nuisance(H: Array) -> None:
    Y = np.random.RandomState(3).normal(size=(4, 5))
    test = sf.raim.LinearTest(H, noise=2.0)
    assert (test.rank, test.degrees) == (0, 5)
    np.testing.assert_allclose(test.run(Y).statistic, np.sum(Y**2, axis=1) / 4.0, rtol=1e-14)


@each
def test_functions_are_the_class(noise: str) -> None:
    c = case(14, noise, "several", False)
    Y, M = c.data(5), c.M
    assert M is not None
    parity = sf.raim.parity_test(Y, c.H, noise=c.noise, false_alarm=1e-3)
    every = sf.raim.LinearTest(c.H, noise=c.noise, false_alarm=1e-3).run(Y)
    np.testing.assert_array_equal(parity.statistic, every.statistic)
    ubcp = sf.raim.ubcp_test(Y, c.H, M, noise=c.noise, false_alarm=1e-3)
    np.testing.assert_array_equal(ubcp.statistic, c.engine(1e-3).run(Y).statistic)
    np.testing.assert_array_equal(ubcp.alarm, c.engine(1e-3).run(Y).alarm)


@each
def test_another_nuisance_each_epoch(noise: str) -> None:
    c = case(15, noise, "several", False)
    Y, M = c.data(6), c.M
    H = c.rng.normal(size=(6, c.n, 2))
    parity = sf.raim.parity_test(Y, H, noise=c.noise, false_alarm=1e-3)
    ubcp = sf.raim.ubcp_test(Y, H, M, noise=c.noise, false_alarm=1e-3)
    for t in range(6):
        known = Linear(H[t], None, c.noise).statistic(Y[t])
        assert parity.statistic[t] == pytest.approx(known, rel=1e-9)
        known = Linear(H[t], M, c.noise).statistic(Y[t])
        assert ubcp.statistic[t] == pytest.approx(known, rel=1e-9)
