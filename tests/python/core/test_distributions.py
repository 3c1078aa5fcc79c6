"""Thresholds and tails against SciPy, far beyond where 1 - cdf has any digits."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

import surefix as sf

# The root of erfc(K / sqrt(2)) = risk with 60 decimal digits: neither SciPy's nor Boost's.
QUANTILES = {
    1e-1: 1.6448536269514726879,
    1e-3: 3.2905267314918947873,
    1e-7: 5.3267238863844963260,
    1e-9: 6.1094102048693971299,
    1e-11: 6.8065024907406262869,
    1e-15: 8.0268588825345408828,
}


@pytest.mark.parametrize(("risk", "quantile"), QUANTILES.items())
def test_quantile_equals_sixty_digits(risk: float, quantile: float) -> None:
    assert sf.two_sided_quantile(risk) == pytest.approx(quantile, rel=1e-15)


@given(exponent=st.floats(-15.0, -1e-9))
def test_quantile_equals_scipy(exponent: float) -> None:
    risk = max(10.0**exponent, 1e-15)
    expected = float(stats.norm.isf(0.5 * risk))
    assert sf.two_sided_quantile(risk) == pytest.approx(expected, rel=1e-13, abs=1e-15)


@given(exponent=st.floats(-15.0, -0.01))
def test_quantile_has_its_risk_beyond_it(exponent: float) -> None:
    risk = max(10.0**exponent, 1e-15)
    beyond = 2.0 * float(stats.norm.sf(sf.two_sided_quantile(risk)))
    assert beyond == pytest.approx(risk, rel=1e-12)


@pytest.mark.parametrize("risk", [0.0, -0.1, 1.0, 1.5, 9e-16, np.nan, np.inf, "small"])
def test_risk_that_is_none_names_itself(risk: float) -> None:
    with pytest.raises(sf.ConfigError, match=f"risk: expected .*got {risk!r}"):
        sf.two_sided_quantile(risk)


@given(
    degrees=st.integers(1, 200),
    excess=st.floats(0.0, 1300.0),
)
def test_chi_squared_tail_equals_scipy(degrees: int, excess: float) -> None:
    """Down to 1e-285 and below."""
    sse = degrees + excess
    expected = float(stats.chi2.sf(sse, degrees))
    assert float(sf.chi_squared_p_value(sse, degrees)) == pytest.approx(expected, rel=1e-11)


def test_chi_squared_tail_reaches_1e_300() -> None:
    """With two degrees of freedom the tail is exp(-x / 2)."""
    x = np.array([0.0, 1e-300, 1.0, 100.0, 690.0 * 2, 1400.0])
    np.testing.assert_allclose(sf.chi_squared_p_value(x, 2), np.exp(-x / 2), rtol=1e-12)
    assert 0.0 < float(sf.chi_squared_p_value(1381.0, 2)) < 1e-299


@given(degrees=st.integers(1, 100), x=st.floats(0.0, 1e4), more=st.floats(1e-3, 1e3))
def test_tail_falls(degrees: int, x: float, more: float) -> None:
    here, beyond = sf.chi_squared_p_value([x, x + more], degrees)
    assert 0.0 <= beyond <= here * (1.0 + 1e-12)
    assert here <= 1.0


def test_an_infinite_error_is_impossible() -> None:
    """Not unknown: an SSE that overflows must not hide the fault behind a NaN."""
    assert float(sf.chi_squared_p_value(1e308, 3)) == 0.0
    assert float(sf.chi_squared_p_value(np.inf, 3)) == 0.0


def test_no_measurements_have_no_p_value() -> None:
    p = sf.chi_squared_p_value([0.0, 1.0, 2.0], [0, 1, 0])
    assert np.isnan(p).tolist() == [True, False, True]
    assert np.isnan(sf.chi_squared_p_value(3.0, 0))


def test_shapes_broadcast() -> None:
    p = sf.chi_squared_p_value(np.arange(6.0).reshape(2, 3), np.array([1, 2, 3]))
    assert p.shape == (2, 3)
    np.testing.assert_allclose(p, stats.chi2.sf(np.arange(6.0).reshape(2, 3), [1, 2, 3]))
