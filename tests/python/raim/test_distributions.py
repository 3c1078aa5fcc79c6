"""Tails, thresholds, powers and noncentralities against forty digits, to 1e-12 of themselves."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import surefix as sf
from oracle import raim_distributions as oracle
from oracle.step import Array
from surefix.core.distributions import (
    noncentral_chi_squared_cdf,
    noncentral_chi_squared_density,
    noncentral_chi_squared_tail,
)

PROMISED = 1e-12


def cases(seed: int, count: int) -> Array:
    """(count, 3): false alarm 1e-1..1e-12, degrees 1..30, noncentrality 0..300."""
    rng = np.random.RandomState(seed)
    alpha = 10.0 ** rng.uniform(-12.0, -1.0, count)
    lam = np.where(rng.uniform(size=count) < 0.1, 0.0, 300.0 * rng.uniform(size=count) ** 2)
    return np.column_stack([alpha, rng.randint(1, 31, count), lam])


def test_thresholds() -> None:
    degrees = np.array([1, 2, 3, 5, 8, 13, 21, 30])
    alpha = 10.0 ** -np.arange(1.0, 13.0)[:, None]
    found = sf.raim.threshold(alpha, degrees)
    known = [[float(oracle.threshold(a, int(k))) for k in degrees] for a in alpha[:, 0]]
    np.testing.assert_allclose(found, known, rtol=PROMISED)


def test_power_and_missed() -> None:
    """Both tails, each with its own digits: the smallest here is 1e-50."""
    alpha, degrees, lam = cases(1, 50).T
    power, missed = sf.raim.power(lam, degrees, alpha), sf.raim.missed(lam, degrees, alpha)
    for i in range(len(lam)):
        h = oracle.threshold(alpha[i], degrees[i])
        known = float(oracle.upper(h, degrees[i], lam[i]))
        assert power[i] == pytest.approx(known, rel=PROMISED, abs=0.0), (alpha[i], degrees[i])
        known = float(oracle.lower(h, degrees[i], lam[i]))
        assert missed[i] == pytest.approx(known, rel=PROMISED, abs=0.0), (alpha[i], degrees[i])
    np.testing.assert_allclose(power + missed, 1.0, rtol=1e-14)


@pytest.mark.parametrize("degrees", [0.5, 1, 8, 30])
@pytest.mark.parametrize("lam", [0.0, 1e-10, 30.0, 300.0])
def test_tails_and_density_at_any_x(degrees: float, lam: float) -> None:
    """From far below to far above the mean, also for degrees that are not whole."""
    x = (degrees + lam) * np.array([1e-3, 0.1, 0.6, 1.0, 1.5, 3.0])
    x[-1] += 40.0
    for found, known in (
        (noncentral_chi_squared_tail, oracle.upper),
        (noncentral_chi_squared_cdf, oracle.lower),
        (noncentral_chi_squared_density, oracle.density),
    ):
        expected = [float(known(v, degrees, lam)) for v in x.tolist()]
        np.testing.assert_allclose(found(x, degrees, lam), expected, rtol=PROMISED, atol=0.0)


def test_inverse_noncentrality() -> None:
    """The root to 1e-12, for P falls by more than lambda grows, in proportion, where P < 0.5."""
    rng = np.random.RandomState(2)
    for _ in range(6):
        alpha, missed = 10.0 ** rng.uniform(-12, -1), 10.0 ** rng.uniform(-12, -0.4)
        degrees = int(rng.randint(1, 31))
        found = sf.raim.noncentrality(missed, degrees, alpha)
        known = float(oracle.noncentrality(missed, degrees, alpha))
        assert found == pytest.approx(known, rel=PROMISED), (alpha, degrees, missed)


@given(
    missed=st.floats(-11.0, -0.01), degrees=st.integers(1, 30), alpha=st.floats(-12.0, -1.0)
)  # fmt: skip
def test_inverse_noncentrality_is_missed_so_often(
    missed: float, degrees: int, alpha: float
) -> None:
    """Where lambda is nearly zero, its own rounding does not matter and that of P(h) does."""
    wanted, false_alarm = 10.0**missed, 10.0**alpha
    lam = sf.raim.noncentrality(wanted, degrees, false_alarm)
    if wanted < 1.0 - false_alarm:
        assert sf.raim.missed(lam, degrees, false_alarm) == pytest.approx(wanted, rel=2e-12)
    else:
        assert lam == 0.0


def test_at_zero_and_infinity() -> None:
    assert noncentral_chi_squared_tail(0.0, 3, 5.0) == 1.0
    assert noncentral_chi_squared_cdf(0.0, 3, 5.0) == 0.0
    assert noncentral_chi_squared_tail(np.inf, 3, 5.0) == 0.0
    assert noncentral_chi_squared_cdf(np.inf, 3, 5.0) == 1.0


def test_large_noncentralities() -> None:
    for lam in (1e3, 1e4, 1e6):
        assert sf.raim.missed(lam, 6, 1e-5) < 1e-100
        assert sf.raim.power(lam, 6, 1e-5) == 1.0
    assert sf.raim.missed(np.inf, 6, 1e-5) == 0.0
    assert sf.raim.power(np.inf, 6, 1e-5) == 1.0
    assert sf.raim.power(0.0, 6, 1e-5) == pytest.approx(1e-5, rel=PROMISED)


def test_far_below_the_mean() -> None:
    """A lower tail of 1e-220 still has its digits, and beyond the smallest double it is zero."""
    for x, lam in ((1e-3, 250.0), (0.3, 300.0), (40.0, 1200.0), (40.0, 1500.0)):
        found = noncentral_chi_squared_cdf(x, 6, lam)
        assert found == pytest.approx(float(oracle.lower(x, 6, lam)), rel=PROMISED, abs=0.0)
    assert noncentral_chi_squared_cdf(1e-3, 6, 3e3) == 0.0


@given(
    degrees=st.integers(1, 30), lam=st.floats(0.0, 290.0), more=st.floats(1e-3, 10.0),
    alpha=st.floats(-12.0, -1.0),
)  # fmt: skip
def test_power_rises_with_noncentrality(
    degrees: int, lam: float, more: float, alpha: float
) -> None:
    low, high = sf.raim.power([lam, lam + more], degrees, 10.0**alpha)
    assert low <= high * (1.0 + PROMISED)
    low, high = sf.raim.missed([lam, lam + more], degrees, 10.0**alpha)
    assert high <= low * (1.0 + PROMISED)


def test_shapes_broadcast_and_scalars_are_floats() -> None:
    found = sf.raim.power(np.zeros((4, 1)), np.arange(1, 4), 1e-3)
    assert found.shape == (4, 3)
    np.testing.assert_allclose(found, 1e-3, rtol=PROMISED)
    assert isinstance(sf.raim.threshold(1e-3, 3), float)
    assert isinstance(sf.raim.power(1.0, 3, 1e-3), float)
    assert isinstance(sf.raim.missed(1.0, 3, 1e-3), float)
    assert isinstance(sf.raim.noncentrality(1e-3, 3, 1e-3), float)
    assert isinstance(noncentral_chi_squared_tail(1.0, 3, 1.0), float)
    assert sf.raim.noncentrality([1e-3, 1e-2], 3, 1e-3).shape == (2,)


@pytest.mark.parametrize("alpha", [-1e-3, 2.0, np.nan])
def test_a_false_alarm_that_is_none(alpha: float) -> None:
    """Not a number, and neither is what follows from it; the others stay."""
    assert np.isnan(sf.raim.threshold(alpha, 3))
    assert np.isnan(sf.raim.power(1.0, 3, alpha))
    assert np.isnan(sf.raim.missed(1.0, 3, alpha))
    assert np.isnan(sf.raim.noncentrality(1e-3, 3, alpha))
    assert np.isnan(sf.raim.threshold([alpha, 1e-3], 3)).tolist() == [True, False]


@pytest.mark.parametrize("value", [-1.0, np.nan])
def test_arguments_out_of_range(value: float) -> None:
    assert np.isnan(sf.raim.threshold(1e-3, value))
    assert np.isnan(sf.raim.power(1.0, value, 1e-3))
    assert np.isnan(sf.raim.power(value, 3, 1e-3))
    assert np.isnan(sf.raim.missed(value, 3, 1e-3))
    assert np.isnan(sf.raim.noncentrality(value, 3, 1e-3))
    assert np.isnan(sf.raim.noncentrality(1e-3, value, 1e-3))
    for call in (noncentral_chi_squared_tail, noncentral_chi_squared_cdf):
        assert np.isnan(call(value, 3, 1.0))
        assert np.isnan(call(1.0, value, 1.0))
        assert np.isnan(call(1.0, 3, value))
