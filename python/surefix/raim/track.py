"""A line on the ground as a curve: position, direction and bend at every mileage."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from surefix import _core
from surefix.core import checks
from surefix.core.checks import FloatArray
from surefix.core.distributions import Values
from surefix.errors import ConfigError, ShapeError
from surefix.raim.geodesy import ecef_to_geodetic, geodetic_to_ecef, local_axes, local_to_ecef

SAME = 1e-6
"""Vertices closer than this [m] are one."""
MAX_VERTICES = 1_000_000


class Projection(NamedTuple):
    """Where a position is as seen from the track, each (…) [m]: mileage of the nearest point,
    distance to the left of it, height above it."""

    along: FloatArray
    across: FloatArray
    up: FloatArray


class Track:
    """A smooth curve near a polyline, over its mileage.

    ``points`` (k, 3) [m]: vertices in the satellites' frame, Cartesian and fixed to the Earth
    (``from_geodetic`` and ``from_local`` convert); vertices within 1e-6 m of the one before are
    left out. The curve is a natural cubic spline over the cumulated distance of the vertices,
    ``start`` [m] at the first. ``tolerance`` [m] > 0: the smoothest curve with no vertex farther
    away. Beyond its ends the track is straight. Raises ConfigError for fewer than two points.

    ``low``, ``high``: mileage of the ends [m]. ``error`` [m]: the largest distance of a vertex.
    ``edge_error`` [m]: bound on the distance from the polyline, vertices and edges.
    """

    def __init__(
        self, points: npt.ArrayLike, *, tolerance: float = 0.0, start: float = 0.0
    ) -> None:
        vertices = checks.array("points", points, (None, 3))
        self._set(_distinct(vertices), None, tolerance, start)

    def _set(
        self, points: FloatArray, mileage: FloatArray | None, tolerance: float, start: float
    ) -> None:
        if not 2 <= len(points) <= MAX_VERTICES:
            raise ConfigError(
                f"points: expected a track of 2 to {MAX_VERTICES} distinct points, "
                f"got {len(points)}"
            )
        self.tolerance = checks.not_negative("tolerance", tolerance)
        begin = checks.number("start", start)
        try:
            self.engine = _core.TrackEngine(points, mileage, self.tolerance, begin)
        except ValueError as error:
            raise ConfigError(f"points: no track through them: {error}") from None
        self.points = checks.read_only(np.array(points))
        self.low: float = self.engine.low
        self.high: float = self.engine.high
        self.error: float = self.engine.error
        self.edge_error: float = self.engine.edge_error

    @classmethod
    def from_geodetic(
        cls,
        lat_deg: npt.ArrayLike,
        lon_deg: npt.ArrayLike,
        height: npt.ArrayLike = 0.0,
        **options: Any,
    ) -> Track:
        """Of latitudes and longitudes (k,) [degrees] and ellipsoidal heights [m], WGS-84."""
        return cls(geodetic_to_ecef(lat_deg, lon_deg, height), **options)

    @classmethod
    def from_local(
        cls,
        east: npt.ArrayLike,
        north: npt.ArrayLike,
        up: npt.ArrayLike = 0.0,
        *,
        origin: tuple[float, float, float],
        **options: Any,
    ) -> Track:
        """Of metres (k,) east, north and up of an origin (latitude, longitude, height)."""
        return cls(local_to_ecef(east, north, up, origin), **options)

    @classmethod
    def analytic(
        cls,
        function: Callable[[FloatArray], npt.ArrayLike],
        low: float,
        high: float,
        *,
        error: float = 1e-4,
    ) -> Track:
        """Of a curve, l (k,) to (k, 3), that keeps its parameter l: samples, doubled until the
        spline is within ``error`` [m] of the curve in the middle between them."""
        a, b = checks.number("low", low), checks.number("high", high)
        if not a < b:
            raise ConfigError(f"high: expected a number above low = {a:g}, got {b:g}")
        wanted = checks.positive("error", error)
        count = 17
        while count < MAX_VERTICES:
            at = np.linspace(a, b, count)
            track = cls.__new__(cls)
            track._set(_curve(function, at), at, 0.0, a)
            middle = (at[1:] + at[:-1]) / 2
            off = np.linalg.norm(track.position(middle) - _curve(function, middle), axis=1).max()
            if off <= wanted:
                track.error = track.edge_error = float(off)
                return track
            count = 2 * count - 1
        raise ConfigError(
            f"error: expected a curve that {MAX_VERTICES} samples follow to {wanted:g}"
        )

    @property
    def length(self) -> float:
        """high - low [m]."""
        return self.high - self.low

    def position(self, along: npt.ArrayLike) -> FloatArray:
        """c(l) at mileage l = ``along``, (…, 3) [m]."""
        return self._at(along)[0]

    def tangent(self, along: npt.ArrayLike) -> FloatArray:
        """dc/dl, (…, 3), of length near 1."""
        return self._at(along)[1]

    def bend(self, along: npt.ArrayLike) -> FloatArray:
        """d²c/dl², (…, 3) [1/m]."""
        return self._at(along)[2]

    def curvature(self, along: npt.ArrayLike) -> Values:
        """‖c' × c''‖/‖c'‖³ (…) [1/m]."""
        _, tangent, bend = self._at(along)
        turn = np.linalg.norm(np.cross(tangent, bend), axis=-1)
        out = turn / np.linalg.norm(tangent, axis=-1) ** 3
        return float(out) if out.ndim == 0 else out

    def curvature_bound(self, low: float, high: float) -> float:
        """Bound on the curvature over [low, high] [1/m]."""
        return self.engine.curvature_bound(*_interval(low, high))

    def bend_bound(self, low: float, high: float) -> float:
        """Bound on ‖d²c/dl²‖ over [low, high] [1/m]."""
        return self.engine.bend_bound(*_interval(low, high))

    def geodetic(self, along: npt.ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Latitude, longitude [degrees] and height [m] of c(l)."""
        return ecef_to_geodetic(self.position(along))

    def axes(self, along: npt.ArrayLike) -> FloatArray:
        """(…, 3, 3), rows forward (horizontal), left and up (that of the ellipsoid)."""
        place, tangent, _ = self._at(along)
        lat, lon, _ = ecef_to_geodetic(place)
        up = local_axes(lat, lon)[..., 2, :]
        level = tangent - (tangent * up).sum(axis=-1, keepdims=True) * up
        forward = level / np.linalg.norm(level, axis=-1, keepdims=True)
        return np.stack([forward, np.cross(up, forward), up], axis=-2)

    def project(self, positions: npt.ArrayLike) -> Projection:
        """Where positions (…, 3) are along, across and above the track."""
        given = checks.floats("positions", positions)
        if given.ndim == 0 or given.shape[-1] != 3:
            raise ShapeError(f"positions: expected shape (..., 3), got {given.shape}")
        flat = given.reshape(-1, 3)
        bad = ~np.asarray(np.isfinite(flat).all(axis=1))
        along = self.engine.nearest(np.where(bad[:, None], 0.0, flat))
        offset = flat - self.position(along)
        _, across, up = np.moveaxis(np.einsum("kij,kj->ki", self.axes(along), offset), -1, 0)
        shape = given.shape[:-1]
        return Projection(*(np.where(bad, np.nan, v).reshape(shape) for v in (along, across, up)))

    def _at(self, along: npt.ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        given = checks.floats("along", along)
        position, tangent, bend = self.engine.at(given.reshape(-1))
        shape = (*given.shape, 3)
        return position.reshape(shape), tangent.reshape(shape), bend.reshape(shape)


def _distinct(points: FloatArray) -> FloatArray:
    """Without vertices that are where the last kept one is."""
    kept: list[int] = []
    for k, point in enumerate(points):
        if not kept or np.linalg.norm(point - points[kept[-1]]) > SAME:
            kept.append(k)
    return points[kept]


def _curve(function: Callable[[FloatArray], npt.ArrayLike], along: FloatArray) -> FloatArray:
    return checks.array("function", function(along), (len(along), 3))


def _interval(low: float, high: float) -> tuple[float, float]:
    a, b = checks.number("low", low), checks.number("high", high)
    if a > b:
        raise ConfigError(f"high: expected a number >= low = {a:g}, got {b:g}")
    return a, b
