"""WGS-84 coordinates against forty digits, from below the ground to the satellites."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import surefix as sf
from oracle import raim_geodesy as oracle

wrongly: Any = sf
LATITUDES = (-90.0, -89.9999, -45.0, -1e-7, 0.0, 1e-7, 30.0, 50.85, 89.9999999, 90.0)
HEIGHTS = (-10_000.0, 0.0, 8848.0, 400e3, 20.2e6)
# 1e-9 m is the rounding of an Earth radius, 4e-9 m that of a satellite's orbit.
NEAR = 4e-9


@pytest.mark.parametrize("lat", LATITUDES)
@pytest.mark.parametrize("height", HEIGHTS)
def test_there_and_back(lat: float, height: float) -> None:
    """Longitude of a point r from the axis is known to 1e-9 / r rad."""
    for lon in (-180.0, 4.35):
        known = oracle.geodetic_to_ecef(lat, lon, height)
        x = sf.raim.geodetic_to_ecef(lat, lon, height)
        np.testing.assert_allclose(x, known, rtol=2e-15, atol=NEAR)
        back = sf.raim.ecef_to_geodetic(known)
        expected = oracle.ecef_to_geodetic(known)
        assert back[0] == pytest.approx(expected[0], abs=np.degrees(NEAR / 6e6))
        assert back[2] == pytest.approx(expected[2], abs=2 * NEAR)
        r = float(np.hypot(known[0], known[1]))
        turned = (back[1] - expected[1] + 180.0) % 360.0 - 180.0
        if r > 1.0:
            assert turned == pytest.approx(0.0, abs=np.degrees(NEAR / r))


@given(lat=st.floats(-90.0, 90.0), lon=st.floats(-180.0, 180.0), height=st.floats(-1e4, 3e7))
def test_anywhere(lat: float, lon: float, height: float) -> None:
    x = sf.raim.geodetic_to_ecef(lat, lon, height)
    np.testing.assert_allclose(x, oracle.geodetic_to_ecef(lat, lon, height), atol=NEAR, rtol=2e-15)
    known, found = oracle.ecef_to_geodetic(x), sf.raim.ecef_to_geodetic(x)
    assert found[0] == pytest.approx(known[0], abs=np.degrees(NEAR / 6e6))
    assert found[2] == pytest.approx(known[2], abs=2 * NEAR)
    np.testing.assert_allclose(sf.raim.geodetic_to_ecef(*found), x, atol=4 * NEAR)


@pytest.mark.parametrize("lat", LATITUDES)
def test_local_axes(lat: float) -> None:
    for lon in (-180.0, -77.0, 0.0, 4.35):
        axes = sf.raim.local_axes(lat, lon)
        np.testing.assert_allclose(axes, oracle.local_axes(lat, lon), atol=4e-16)


def test_vectorised() -> None:
    lat, lon = np.linspace(-80.0, 80.0, 6).reshape(2, 3), np.array([0.0, 10.0, 20.0])
    x = sf.raim.geodetic_to_ecef(lat, lon, 100.0)
    assert x.shape == (2, 3, 3)
    np.testing.assert_array_equal(x[1, 2], sf.raim.geodetic_to_ecef(lat[1, 2], lon[2], 100.0))
    found = sf.raim.ecef_to_geodetic(x)
    for values, known in zip(found, (lat, lon + 0 * lat, 100.0 + 0 * lat), strict=True):
        assert values.shape == (2, 3)
        np.testing.assert_allclose(values, known, atol=1e-8)


def test_refused() -> None:
    with pytest.raises(sf.ConfigError, match=r"lat_deg: .*90\.5"):
        sf.raim.geodetic_to_ecef(90.5, 0.0, 0.0)
    with pytest.raises(sf.SurefixError, match=r"position: .*\(2,\)"):
        sf.raim.ecef_to_geodetic(np.zeros(2))
    with pytest.raises(sf.SurefixError, match="lat_deg: "):
        wrongly.raim.geodetic_to_ecef("north", 0.0, 0.0)
