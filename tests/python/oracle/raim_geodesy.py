"""WGS-84 with forty digits: geodetic, Earth-centred and local coordinates.

Back from Earth-centred coordinates by bisection for the foot on the ellipsoid: with the reduced
latitude b of the foot (a cos b, (a - a f) sin b), the line from it to the point is normal where

    r a sin b - z c cos b = (a^2 - c^2) sin b cos b,    c = a - a f, r = hypot(x, y).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from mpmath import mp  # type: ignore[import-untyped]

from oracle.step import Array

DIGITS = 40
SEMI_MAJOR, INVERSE_FLATTENING = "6378137", "298.257223563"


def geodetic_to_ecef(lat_deg: float, lon_deg: float, height: float) -> Array:
    """(3,) [m], by x = (N + h) cos(lat) cos(lon) and so on."""
    with mp.workdps(DIGITS):
        lat, lon = mp.radians(mp.mpf(lat_deg)), mp.radians(mp.mpf(lon_deg))
        a, f = mp.mpf(SEMI_MAJOR), 1 / mp.mpf(INVERSE_FLATTENING)
        e2 = f * (2 - f)
        N, h = a / mp.sqrt(1 - e2 * mp.sin(lat) ** 2), mp.mpf(height)
        r = (N + h) * mp.cos(lat)
        found = [r * mp.cos(lon), r * mp.sin(lon), (N * (1 - e2) + h) * mp.sin(lat)]
        return np.array([float(v) for v in found])


def ecef_to_geodetic(x: Array) -> tuple[float, float, float]:
    """Latitude and longitude [deg], height [m] of x (3,), above the equator's evolute."""
    with mp.workdps(DIGITS):
        a = mp.mpf(SEMI_MAJOR)
        c = a - a / mp.mpf(INVERSE_FLATTENING)
        px, py, z = (mp.mpf(float(v)) for v in x)
        r, north = mp.hypot(px, py), abs(z)
        low, high = mp.mpf(0), mp.pi / 2
        for _ in range(140):
            b = (low + high) / 2
            s, k = mp.sin(b), mp.cos(b)
            if r * a * s - north * c * k < (a**2 - c**2) * s * k:
                low = b
            else:
                high = b
        lat = mp.atan2(a * mp.sin(low), c * mp.cos(low))
        height = (r - a * mp.cos(low)) * mp.cos(lat) + (north - c * mp.sin(low)) * mp.sin(lat)
        signed = mp.degrees(lat) if z >= 0 else -mp.degrees(lat)
        return float(signed), float(mp.degrees(mp.atan2(py, px))), float(height)


def local_axes(lat_deg: float, lon_deg: float) -> Array:
    """(3, 3), rows east, north, up: the derivatives of the Earth-centred position with respect to
    longitude, latitude and height, each of unit length."""
    with mp.workdps(DIGITS):
        lat, lon = mp.radians(mp.mpf(lat_deg)), mp.radians(mp.mpf(lon_deg))
        up = mp.matrix([mp.cos(lat) * mp.cos(lon), mp.cos(lat) * mp.sin(lon), mp.sin(lat)])
        east = mp.matrix([-mp.sin(lon), mp.cos(lon), 0])
        north: Any = mp.matrix([up[1] * east[2] - up[2] * east[1],
                                up[2] * east[0] - up[0] * east[2],
                                up[0] * east[1] - up[1] * east[0]])  # fmt: skip
        return np.array([[float(v) for v in axis] for axis in (east, north, up)])


def elevation_azimuth(satellite: Array, position: Array) -> tuple[Array, Array]:
    """Degrees, (n,) each, of satellites (n, 3) from a position (3,); azimuth from north by east."""
    lat, lon, _ = ecef_to_geodetic(position)
    east, north, up = ((satellite - position) @ local_axes(lat, lon).T).T
    elevation = np.degrees(np.arctan2(up, np.hypot(east, north)))
    return elevation, np.asarray(np.degrees(np.arctan2(east, north)) % 360.0)
