"""WGS-84: latitude, longitude and height to Cartesian coordinates fixed to the Earth, and back."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from surefix.core import checks
from surefix.core.checks import FloatArray
from surefix.errors import ConfigError, ShapeError

SEMI_MAJOR = 6378137.0
"""a [m]."""
FLATTENING = 1 / 298.257223563
ECCENTRICITY_2 = FLATTENING * (2 - FLATTENING)


def geodetic_to_ecef(
    lat_deg: npt.ArrayLike, lon_deg: npt.ArrayLike, height: npt.ArrayLike = 0.0
) -> FloatArray:
    """(…, 3) [m] of latitude and longitude [degrees] and ellipsoidal height [m]."""
    lat, lon = np.radians(_latitude(lat_deg)), np.radians(_finite("lon_deg", lon_deg))
    h = _finite("height", height)
    normal = SEMI_MAJOR / np.sqrt(1 - ECCENTRICITY_2 * np.sin(lat) ** 2)
    try:
        x, y, z = np.broadcast_arrays(
            (normal + h) * np.cos(lat) * np.cos(lon),
            (normal + h) * np.cos(lat) * np.sin(lon),
            (normal * (1 - ECCENTRICITY_2) + h) * np.sin(lat),
        )
    except ValueError:
        shapes = f"{lat.shape}, {lon.shape}, {h.shape}"
        raise ShapeError(f"lat_deg, lon_deg, height: expected one shape, got {shapes}") from None
    return np.stack([x, y, z], axis=-1)


def ecef_to_geodetic(position: npt.ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Latitude, longitude [degrees], height [m], each (…), of positions (…, 3) [m]. Bowring's
    first step, then fixed-point steps: 1e-9 m from the Earth's centre's neighbourhood out."""
    x, y, z = np.moveaxis(_vectors("position", position), -1, 0)
    across = np.hypot(x, y)
    lat = np.arctan2(z, across * (1 - ECCENTRICITY_2))
    for _ in range(8):
        normal = SEMI_MAJOR / np.sqrt(1 - ECCENTRICITY_2 * np.sin(lat) ** 2)
        lat = np.arctan2(z + ECCENTRICITY_2 * normal * np.sin(lat), across)
    normal = SEMI_MAJOR / np.sqrt(1 - ECCENTRICITY_2 * np.sin(lat) ** 2)
    # The longer of the two projections gives the height, at the poles as at the equator.
    height = across * np.cos(lat) + z * np.sin(lat) - SEMI_MAJOR**2 / normal
    return np.degrees(lat), np.degrees(np.arctan2(y, x)), height


def local_axes(lat_deg: npt.ArrayLike, lon_deg: npt.ArrayLike) -> FloatArray:
    """(…, 3, 3), rows east, north, up, at a point of the ellipsoid."""
    lat, lon = np.broadcast_arrays(
        np.radians(_latitude(lat_deg)), np.radians(_finite("lon_deg", lon_deg))
    )
    sin_lat, cos_lat, sin_lon, cos_lon = np.sin(lat), np.cos(lat), np.sin(lon), np.cos(lon)
    east = np.stack([-sin_lon, cos_lon, np.zeros_like(lon)], axis=-1)
    north = np.stack([-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat], axis=-1)
    up = np.stack([cos_lat * cos_lon, cos_lat * sin_lon, sin_lat], axis=-1)
    return np.stack([east, north, up], axis=-2)


def local_to_ecef(
    east: npt.ArrayLike,
    north: npt.ArrayLike,
    up: npt.ArrayLike,
    origin: tuple[float, float, float],
) -> FloatArray:
    """(…, 3) of metres east, north and up of ``origin`` (latitude, longitude, height)."""
    lat, lon, height = checks.array("origin", origin, (3,)).tolist()
    offset = np.stack(
        np.broadcast_arrays(*(_finite(*v) for v in (("east", east), ("north", north), ("up", up)))),
        axis=-1,
    )
    return geodetic_to_ecef(lat, lon, height) + offset @ local_axes(lat, lon)


def sky(position: npt.ArrayLike, satellites: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Elevation and azimuth [degrees], each (…), of satellites (…, 3) seen from positions (3,) or
    (…, 3): above the horizon of the ellipsoid, and from north over east."""
    at = _vectors("position", position)
    lat, lon, _ = ecef_to_geodetic(at)
    to = _vectors("satellites", satellites) - at
    east, north, up = np.moveaxis(np.einsum("...ij,...j->...i", local_axes(lat, lon), to), -1, 0)
    elevation = np.degrees(np.arctan2(up, np.hypot(east, north)))
    return elevation, np.degrees(np.arctan2(east, north)) % 360


def _finite(name: str, values: npt.ArrayLike) -> FloatArray:
    given = checks.floats(name, values)
    if not np.isfinite(given).all():
        raise ConfigError(f"{name}: expected finite numbers, got {given[~np.isfinite(given)][0]}")
    return given


def _latitude(values: npt.ArrayLike) -> FloatArray:
    given = _finite("lat_deg", values)
    if (np.abs(given) > 90).any():
        wrong = given[np.abs(given) > 90].flat[0]
        raise ConfigError(f"lat_deg: expected degrees from -90 to 90, got {wrong}")
    return given


def _vectors(name: str, values: npt.ArrayLike) -> FloatArray:
    given = checks.floats(name, values)
    if given.ndim == 0 or given.shape[-1] != 3:
        raise ShapeError(f"{name}: expected shape (..., 3), got {given.shape}")
    return given
