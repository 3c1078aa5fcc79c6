"""Tracks: against SciPy's natural cubic spline, and what they promise of themselves."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import surefix as sf
from oracle import raim_geodesy as geodesy
from oracle.raim_track import Spline, spline
from oracle.step import Array
from raim.scenes import ORIGIN, curved_points, local, straight_points, winding_points

wrongly: Any = sf
# Coordinates of 4e6 m are known to 5e-10 m; a few of them make a position.
ROUNDING = 4e-9


POINTS = {"curved": curved_points(), "uneven": winding_points(), "two": straight_points()[:2],
          "three": winding_points(2, 3)}  # fmt: skip
each = pytest.mark.parametrize("name", POINTS)


def mileages(known: Spline) -> Array:
    """Dense, at the knots, between, and beyond both ends."""
    inside = np.linspace(known.low, known.high, 997)
    beyond = [known.low - 300.0, known.low - 1.0, known.high + 1.0, known.high + 5e3]
    return np.concatenate([known.knots, inside, beyond])


@each
def test_spline(name: str) -> None:
    """A position is known to ROUNDING; over the smallest spacing d, a slope to ROUNDING / d and a
    second derivative to some 6 ROUNDING / d^2. Far beyond the end, the slope's error grows."""
    known = spline(POINTS[name], start=-20.0)
    track, l = sf.raim.Track(POINTS[name], start=-20.0), mileages(known)  # noqa: E741
    d = float(np.diff(known.knots).min())
    assert (track.low, track.high) == pytest.approx((known.low, known.high), rel=1e-12)
    assert track.length == pytest.approx(known.high - known.low, rel=1e-12)
    away = np.maximum(np.maximum(known.low - l, l - known.high), 0.0)[:, None]
    off = np.abs(track.position(l) - known.position(l))
    assert np.all(off <= 4 * ROUNDING * (1.0 + away / d))
    np.testing.assert_allclose(track.tangent(l), known.tangent(l), atol=4 * ROUNDING / d)
    np.testing.assert_allclose(track.bend(l), known.bend(l), atol=24 * ROUNDING / d**2)
    np.testing.assert_allclose(track.curvature(l), known.curvature(l), atol=24 * ROUNDING / d**2)


@each
def test_shapes(name: str) -> None:
    track = sf.raim.Track(POINTS[name])
    l = np.linspace(track.low, track.high, 6).reshape(2, 3)  # noqa: E741
    assert track.position(l).shape == track.tangent(l).shape == track.bend(l).shape == (2, 3, 3)
    assert track.curvature(l).shape == (2, 3)
    for one in (track.position, track.tangent, track.bend):
        assert one(l[1, 2]).shape == (3,)
        np.testing.assert_array_equal(one(l[1, 2]), one(l)[1, 2])


@each
def test_bounds_between_two_mileages(name: str) -> None:
    """|c''| has no maximum between two knots: its supremum over the pieces that the interval
    touches is at a knot. A bound is no less than over the interval, and no more than over those;
    for curvature, over the square of the least speed that the middle of a piece allows, h/2 off."""
    known, track = spline(POINTS[name]), sf.raim.Track(POINTS[name])
    rng, knots = np.random.RandomState(3), known.knots
    tolerance = 1e-12 + 24 * ROUNDING / float(np.diff(knots).min()) ** 2
    at_knots = np.linalg.norm(known.bend(knots), axis=1)
    for length in (0.0, 1.0, 50.0, 400.0):
        l0 = float(rng.uniform(known.low - 50.0, known.high + 50.0))
        l1, inside = l0 + length, np.linspace(l0, l0 + length, 2001)
        first = int(np.clip(np.searchsorted(knots, l0, "right") - 1, 0, len(knots) - 2))
        last = int(np.clip(np.searchsorted(knots, l1, "left"), first + 1, len(knots) - 1))
        most = float(at_knots[first : last + 1].max())
        bend = float(np.linalg.norm(known.bend(inside), axis=1).max())
        assert bend - tolerance <= track.bend_bound(l0, l1) <= most + tolerance
        touched = np.linspace(knots[first], knots[last], 2001)
        speed = float(np.linalg.norm(known.tangent(touched), axis=1).min())
        speed -= 0.5 * most * float(np.diff(knots[first : last + 1]).max())
        curvature = float(known.curvature(inside).max())
        assert curvature - tolerance <= track.curvature_bound(l0, l1)
        assert track.curvature_bound(l0, l1) <= (most + 2 * tolerance) / speed**2


@each
def test_distance_from_the_polyline(name: str) -> None:
    """Through every vertex; between two the bound is no beyond what |c''| alone allows."""
    known, track = spline(POINTS[name]), sf.raim.Track(POINTS[name])
    l = np.linspace(known.low, known.high, 20_001)  # noqa: E741
    off = np.linalg.norm(track.position(l) - known.polyline(l), axis=1).max()
    assert track.error == 0.0
    assert off - ROUNDING <= track.edge_error
    most = np.linalg.norm(known.bend(known.knots), axis=1).max()
    assert track.edge_error <= 1.001 * most * np.diff(known.knots).max() ** 2 / 8 + 1e-6


def roughness(track: sf.raim.Track) -> float:
    """Integral of |c''|^2."""
    l = np.linspace(track.low, track.high, 20_001)  # noqa: E741
    return float(np.trapezoid(np.sum(track.bend(l) ** 2, axis=1), l))


def surveyed(noise: float) -> Array:
    rng = np.random.RandomState(5)
    points = curved_points(spacing=10.0)
    return np.asarray(points + rng.uniform(-noise, noise, points.shape) / np.sqrt(3.0))


@pytest.mark.parametrize("tolerance", [0.2, 1.0, 5.0])
def test_smoothing_stays_within_its_tolerance(tolerance: float) -> None:
    """Of every vertex; the bound for the edges follows from the curve."""
    points = surveyed(0.5)
    track, exact = sf.raim.Track(points, tolerance=tolerance), sf.raim.Track(points)
    known = spline(points)
    assert (track.low, track.high) == (exact.low, exact.high)
    l = np.linspace(known.low, known.high, 20_001)  # noqa: E741
    off = np.linalg.norm(track.position(known.knots) - points, axis=1)
    assert track.error == pytest.approx(off.max(), abs=2 * ROUNDING)
    assert 0.9 * tolerance < off.max() <= tolerance + ROUNDING  # the smoothest goes to the limit
    between = np.linalg.norm(track.position(l) - known.polyline(l), axis=1)
    assert max(between.max(), off.max()) <= track.edge_error + ROUNDING
    assert roughness(track) < roughness(exact)


def test_more_tolerance_is_smoother() -> None:
    tracks = [sf.raim.Track(surveyed(0.5), tolerance=t) for t in (0.0, 0.3, 1.0, 3.0, 10.0)]
    values = [roughness(track) for track in tracks]
    assert values == sorted(values, reverse=True)
    assert values[2] < 0.1 * values[0]


def test_smoothing_finds_the_curvature_again() -> None:
    """Half a metre of survey noise every 10 m makes radii of some tens of metres."""
    noisy = sf.raim.Track(surveyed(0.5))
    smooth = sf.raim.Track(surveyed(0.5), tolerance=1.0)
    assert noisy.curvature_bound(noisy.low, noisy.high) > 1 / 100.0
    assert smooth.curvature_bound(smooth.low, smooth.high) < 1 / 200.0


def test_straight_lines_stay_straight() -> None:
    for tolerance in (0.0, 1.0):
        track = sf.raim.Track(straight_points(), tolerance=tolerance)
        assert track.length == pytest.approx(1600.0, rel=1e-12)
        assert track.edge_error < 1e-6
        assert track.bend_bound(track.low, track.high) < 1e-9
        np.testing.assert_allclose(np.linalg.norm(track.tangent(700.0)), 1.0, rtol=1e-12)


def test_points_on_top_of_each_other_are_dropped() -> None:
    points = curved_points()
    twice = np.repeat(points, 2, axis=0)
    twice[1::2] += 3e-7
    one, other = sf.raim.Track(points), sf.raim.Track(twice)
    assert other.length == pytest.approx(one.length, abs=1e-9)
    l = np.linspace(one.low, one.high, 500)  # noqa: E741
    np.testing.assert_allclose(other.position(l), one.position(l), atol=1e-8)


@each
def test_project(name: str) -> None:
    """Beside the track: along to the foot, across to the left, up."""
    known, track = spline(POINTS[name]), sf.raim.Track(POINTS[name])
    rng = np.random.RandomState(6)
    l = rng.uniform(known.low + 1.0, known.high - 1.0, 12)  # noqa: E741
    x = known.position(l)
    across, above = rng.uniform(-4.0, 4.0, 12), rng.uniform(-3.0, 3.0, 12)
    for i in range(12):
        lat, lon, _ = geodesy.ecef_to_geodetic(x[i])
        ahead = known.tangent(l[i]) / np.linalg.norm(known.tangent(l[i]))
        left = np.cross(geodesy.local_axes(lat, lon)[2], ahead)
        left /= np.linalg.norm(left)
        x[i] += across[i] * left + above[i] * np.cross(ahead, left)
    found = track.project(x)
    np.testing.assert_allclose(found.along, l, atol=1e-6)
    np.testing.assert_allclose(found.along, [known.nearest(p) for p in x], atol=1e-6)
    np.testing.assert_allclose(found.across, across, atol=1e-6)
    # whether up is the Earth's or the track's own, they differ by the slope's square
    np.testing.assert_allclose(found.up, above, atol=3.0 * 2e-2**2)
    alone = track.project(x[3])
    assert (alone.along, alone.across, alone.up) == (found.along[3], found.across[3], found.up[3])
    assert track.project(x.reshape(3, 4, 3)).along.shape == (3, 4)


def test_project_beyond_the_ends() -> None:
    track = sf.raim.Track(straight_points())
    found = track.project(track.position(np.array([-250.0, 1900.0])))
    np.testing.assert_allclose(found.along, [-250.0, 1900.0], atol=1e-6)
    np.testing.assert_allclose(found.across, 0.0, atol=1e-6)


def test_from_geodetic_and_local() -> None:
    points = curved_points()
    geodetic = np.array([geodesy.ecef_to_geodetic(p) for p in points])
    found = sf.raim.Track.from_geodetic(*geodetic.T)
    flat = sf.raim.Track.from_geodetic(geodetic[:, 0], geodetic[:, 1])
    enu = (points - geodesy.geodetic_to_ecef(*ORIGIN)) @ geodesy.local_axes(*ORIGIN[:2]).T
    other = sf.raim.Track.from_local(*enu.T, origin=ORIGIN)
    l = np.linspace(0.0, 1600.0, 300)  # noqa: E741
    known = sf.raim.Track(points).position(l)
    np.testing.assert_allclose(found.position(l), known, atol=1e-7)
    np.testing.assert_allclose(other.position(l), known, atol=1e-7)
    assert flat.length == pytest.approx(found.length, rel=1e-3)
    level = sf.raim.Track.from_local(enu[:, 0], enu[:, 1], origin=ORIGIN, start=500.0)
    assert level.low == 500.0
    np.testing.assert_allclose(level.position(500.0), local(enu[0, 0], enu[0, 1]), atol=ROUNDING)


def test_analytic() -> None:
    def circle(l: Array) -> Array:  # noqa: E741
        return local(500.0 * np.sin(l / 500.0), 500.0 - 500.0 * np.cos(l / 500.0))

    track = sf.raim.Track.analytic(circle, 10.0, 900.0, error=1e-5)
    assert (track.low, track.high) == (10.0, 900.0)
    l = np.linspace(10.0, 900.0, 4001)  # noqa: E741
    assert np.linalg.norm(track.position(l) - circle(l), axis=1).max() <= 1e-5
    np.testing.assert_allclose(np.linalg.norm(track.tangent(l), axis=1), 1.0, atol=1e-4)
    inside = l[(l > 60.0) & (l < 850.0)]
    np.testing.assert_allclose(track.curvature(inside), 1 / 500.0, rtol=1e-2)
    # its own parameter, not a length: twice as slow
    slow = sf.raim.Track.analytic(lambda at: circle(at / 2.0), 20.0, 1800.0)
    assert (slow.low, slow.high) == (20.0, 1800.0)
    np.testing.assert_allclose(slow.position(600.0), circle(np.array([300.0]))[0], atol=1e-4)
    assert np.linalg.norm(slow.tangent(600.0)) == pytest.approx(0.5, rel=1e-3)


BAD: dict[str, tuple[Any, dict[str, Any], str]] = {
    "one point": (POINTS["curved"][:1], {}, "points: "),
    "one place": (np.repeat(POINTS["curved"][:1], 5, axis=0), {}, "points: "),
    "no points": (np.zeros((0, 3)), {}, "points: "),
    "two columns": (POINTS["curved"][:, :2], {}, r"points: .*\(\d+, 2\)"),
    "one axis": (POINTS["curved"][0], {}, r"points: .*\(3,\)"),
    "not a number": (POINTS["curved"] * [1.0, np.nan, 1.0], {}, "points: .*nan"),
    "infinite": (POINTS["curved"] * np.inf, {}, "points: .*inf"),
    "a text": ("track", {}, "points: .*'track'"),
    "tolerance": (POINTS["curved"], {"tolerance": -1.0}, "tolerance: .*-1"),
    "tolerance nan": (POINTS["curved"], {"tolerance": np.nan}, "tolerance: .*nan"),
    "start": (POINTS["curved"], {"start": np.inf}, "start: .*inf"),
}


@pytest.mark.parametrize(("points", "more", "message"), BAD.values(), ids=BAD.keys())
def test_refused(points: Any, more: dict[str, Any], message: str) -> None:
    with pytest.raises((sf.ConfigError, sf.ShapeError), match=message):
        wrongly.raim.Track(points, **more)
