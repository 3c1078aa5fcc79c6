"""Availability along a track: what hides satellites, and that the rest is the monitor's answer."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import surefix as sf
from oracle import raim_monitor as oracle
from oracle import raim_protection as protection
from oracle.raim_geodesy import ecef_to_geodetic, elevation_azimuth, local_axes
from oracle.raim_monitor import Demand
from oracle.raim_solution import Epoch, solve
from oracle.raim_track import spline
from oracle.step import Array
from raim.scenes import curved_points, sky

wrongly: Any = sf
Flags = NDArray[np.bool_]
POINTS = curved_points()
KNOWN = spline(POINTS)
SATELLITES = sky(np.random.RandomState(51), KNOWN.position(800.0), 12, lowest=2.0)
SYSTEM = tuple("GGGGGGGEEEEE")
PLACES = np.linspace(50.0, 1550.0, 7)
DEMAND = Demand(60.0, fault_probability=1e-5, max_excluded=0)
SETTINGS: dict[str, Any] = {"length": 60.0, "fault_probability": 1e-5}


@cache
def track() -> sf.raim.Track:
    return sf.raim.Track(POINTS)


def mapped(**more: Any) -> sf.raim.AvailabilityMap:
    given = {**SETTINGS, "along": PLACES, "system": SYSTEM, **more}
    return sf.raim.availability(track(), SATELLITES, **given)


def directions(along: float) -> Array:
    """(n, 3): forward (level), left and up, of lines to the satellites."""
    x, t = KNOWN.position(along), KNOWN.tangent(along)
    lat, lon, _ = ecef_to_geodetic(x)
    up = local_axes(lat, lon)[2]
    left = np.cross(up, t) / np.linalg.norm(np.cross(up, t))
    to = SATELLITES - x
    return np.asarray(to @ np.array([np.cross(left, up), left, up]).T)


def check(found: sf.raim.AvailabilityMap, k: int, seen: Flags, sigma: Array) -> None:
    """The entry of PLACES[k], against an epoch without noise of the satellites that are seen."""
    along, index = float(PLACES[k]), np.flatnonzero(seen)
    assert found.satellites[k] == len(index)
    satellite, system = SATELLITES[index], tuple(SYSTEM[i] for i in index)
    if len(index) < 2 + len(set(system)):
        assert found.status[k] == "too few satellites"
        assert not found.available[k]
        return
    ranges = np.linalg.norm(satellite - KNOWN.position(along), axis=1)
    s = solve(Epoch(satellite, ranges, sigma[index], system), KNOWN, along)
    assert found.sigma[k] == pytest.approx(s.sigma, rel=1e-7)
    p, _ = oracle.at_half_length(s, sigma[index], 30.0, 0.0, DEMAND)
    # the critical bias is short of its tail by 1e-6, and ln p moves by less than 40 times that
    assert found.p_star[k] == pytest.approx(p.max(), rel=1e-4, abs=1e-30)
    assert found.available[k] == (found.p_star[k] <= 1e-3)
    assert found.available_with_e1[k] == (found.p_star[k] + found.e1[k] <= 1e-3)
    asked = protection.Question(s, len(index), DEMAND, float(found.bound_along[k]))
    if np.isinf(asked.answer):
        assert found.protection[k] == np.inf
    elif found.protection[k] > SETTINGS["length"] / 2:  # it bears the bend over more than K
        assert found.protection[k] >= asked.answer * (1 - 1e-6)
    else:
        assert found.protection[k] == pytest.approx(asked.answer, rel=1e-6)


@pytest.mark.parametrize("mask", [0.0, 15.0, 35.0])
def test_elevation_mask(mask: float) -> None:
    """With one sigma at the zenith, growing to the horizon."""
    found = mapped(elevation_mask=mask, sigma=2.0)
    for k, along in enumerate(PLACES):
        elevation, _ = elevation_azimuth(SATELLITES, KNOWN.position(along))
        check(found, k, elevation >= mask, 2.0 / np.sin(np.radians(elevation)))


def test_sigma_of_the_elevation() -> None:
    found = mapped(sigma=lambda elevation: 1.0 + 90.0 / (elevation + 10.0))
    for k, along in enumerate(PLACES):
        elevation, _ = elevation_azimuth(SATELLITES, KNOWN.position(along))
        check(found, k, elevation >= 5.0, 1.0 + 90.0 / (elevation + 10.0))


def test_cutting() -> None:
    """A wall d beside the track is d tan(angle) high: it hides what passes below its edge."""
    found = mapped(sigma=1.0, masks=[sf.raim.Cutting(400.0, 1200.0, 35.0, 10.0)])
    hidden = 0
    for k, along in enumerate(PLACES):
        elevation, _ = elevation_azimuth(SATELLITES, KNOWN.position(along))
        seen = elevation >= 5.0
        if 400.0 <= along <= 1200.0:
            _, left, up = directions(along).T
            edge = np.tan(np.radians(np.where(left > 0.0, 35.0, 10.0))) * np.abs(left)
            hidden += int(np.sum(seen & (up < edge)))
            seen &= up >= edge
        check(found, k, seen, 1.0 / np.sin(np.radians(elevation)))
    assert hidden > 3


def test_left_and_right_change_with_the_direction() -> None:
    back = sf.raim.Track(POINTS[::-1])
    there = mapped(masks=[sf.raim.Cutting(0.0, 1e4, 40.0, 10.0)])
    again = sf.raim.availability(
        back, SATELLITES, **SETTINGS, along=back.high - PLACES, system=SYSTEM,
        masks=[sf.raim.Cutting(0.0, 1e4, 10.0, 40.0)],
    )  # fmt: skip
    np.testing.assert_array_equal(again.satellites, there.satellites)
    np.testing.assert_allclose(again.sigma, there.sigma, rtol=1e-7)


def test_tunnel() -> None:
    free, found = mapped(), mapped(masks=[sf.raim.Tunnel(600.0, 1100.0)])
    inside = (PLACES >= 600.0) & (PLACES <= 1100.0)
    assert 0 < inside.sum() < len(PLACES)
    assert (found.satellites[inside] == 0).all()
    assert (found.status[inside] == "too few satellites").all()
    assert np.isnan(found.sigma[inside]).all()
    assert np.isnan(found.protection[inside]).all()
    assert not found.available[inside].any()
    for name in ("satellites", "sigma", "p_star", "e1", "available", "protection"):
        outside = getattr(found, name)[~inside]
        np.testing.assert_allclose(outside, getattr(free, name)[~inside], rtol=1e-5)


def test_a_mask_that_hides_everything() -> None:
    for found in (mapped(elevation_mask=89.9), mapped(masks=[sf.raim.Cutting(0, 1e4, 90, 90)])):
        assert (found.satellites == 0).all()
        assert not found.available.any()
        assert found.share == found.share_with_e1 == 0.0
        assert set(found.status.tolist()) == {"too few satellites"}


def test_places() -> None:
    every = sf.raim.availability(track(), SATELLITES, **SETTINGS, step=100.0)
    np.testing.assert_allclose(every.along, np.arange(track().low, track().high + 1e-6, 100.0))
    assert len(every.available) == len(every.along)
    assert every.share == np.mean(every.available)
    assert every.share_with_e1 == np.mean(every.available_with_e1)
    assert every.share_with_e1 <= every.share
    table = every.table()
    assert {len(column) for column in table.values()} == {len(every.along)}
    known = [ecef_to_geodetic(KNOWN.position(l)) for l in every.along]  # noqa: E741
    np.testing.assert_allclose(every.latitude, [g[0] for g in known], atol=1e-12)
    np.testing.assert_allclose(every.longitude, [g[1] for g in known], atol=1e-12)


def test_rotation_of_the_earth_hardly_matters() -> None:
    """30 m of range, but 1e-6 of a direction."""
    still, turning = mapped(), mapped(earth_rotation=True)
    np.testing.assert_allclose(turning.sigma, still.sigma, rtol=1e-4)
    assert (turning.status == "ok").all()


def test_more_demands_less_availability() -> None:
    lengths = [mapped(length=L).share for L in (5.0, 20.0, 40.0, 80.0, 300.0)]
    assert lengths == sorted(lengths)
    assert lengths[0] == 0.0
    assert lengths[-1] == 1.0
    assert mapped(missed=1e-12).share <= mapped().share


BAD: dict[str, tuple[dict[str, Any], str]] = {
    "satellites": ({"satellites": SATELLITES[:, :2]}, r"satellites: .*\(12, 2\)"),
    "no satellites": ({"satellites": np.zeros((0, 3))}, r"satellites: .*\(0, 3\)"),
    "satellites NaN": ({"satellites": SATELLITES * np.nan}, "satellites: .*nan"),
    "track": ({"track": POINTS}, "track: "),
    "length": ({"length": -1.0}, "length: .*-1"),
    "step": ({"step": 0.0}, "step: .*0"),
    "along NaN": ({"along": [np.nan]}, "along: .*nan"),
    "sigma": ({"sigma": -2.0}, "sigma: .*-2"),
    "sigma shape": ({"sigma": lambda elevation: elevation[:1]}, r"sigma: .*\(1,\)"),
    "elevation mask": ({"elevation_mask": np.nan}, "elevation_mask: .*nan"),
    "masks": ({"masks": ["tunnel"]}, "masks: .*'tunnel'"),
    "system": ({"system": ["G"] * 11}, "system: .*11"),
}


@pytest.mark.parametrize(("changed", "message"), BAD.values(), ids=BAD.keys())
def test_refused(changed: dict[str, Any], message: str) -> None:
    given: dict[str, Any] = {"track": track(), "satellites": SATELLITES, **SETTINGS, **changed}
    with pytest.raises(sf.SurefixError, match=message):
        wrongly.raim.availability(**given)


def test_refused_masks() -> None:
    with pytest.raises(sf.ConfigError, match=r"high: .*low = 20.*10"):
        sf.raim.Tunnel(20.0, 10.0)
    with pytest.raises(sf.ConfigError, match=r"left_deg: .*-1"):
        sf.raim.Cutting(0.0, 10.0, -1.0, 5.0)
    with pytest.raises(sf.ConfigError, match=r"right_deg: .*95"):
        sf.raim.Cutting(0.0, 10.0, 1.0, 95.0)
