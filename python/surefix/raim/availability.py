"""Where along a track the monitor is available, with a given sky."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from surefix import _core
from surefix.core import checks
from surefix.core.checks import FloatArray
from surefix.errors import ShapeError
from surefix.raim.geodesy import ecef_to_geodetic, sky
from surefix.raim.masks import Cutting, Mask, Tunnel, visible
from surefix.raim.monitor import TrackRaim
from surefix.raim.pseudoranges import Pseudoranges, elevation_sigma
from surefix.raim.result import RaimResult
from surefix.raim.track import Track


class AvailabilityMap:
    """Along the track, at every mileage ``along`` (K,) [m]: ``satellites`` in view, ``sigma`` [m]
    of the position, ``p_star``, ``e1``, ``e2``, ``available`` with and without e₁, ``protection``
    and ``protection_chi2`` [m], ``status``. ``share``: of the length that is available;
    ``share_with_e1``. ``latitude``, ``longitude`` (K,) [degrees]."""

    def __init__(self, track: Track, along: FloatArray, result: RaimResult, missed: float) -> None:
        self.track, self.along = track, checks.read_only(along)
        self.latitude, self.longitude, _ = ecef_to_geodetic(track.position(along))
        self.satellites = result.used
        self.sigma, self.p_star, self.e1, self.e2 = (
            result.sigma, result.p_star, result.e1, result.e2
        )  # fmt: skip
        self.available, self.available_with_e1 = result.available, result.available_with_e1
        self.protection, self.protection_chi2 = result.protection, result.protection_chi2
        self.bound_along, self.rival = result.bound_along, result.rival
        self.status, self.length, self.risk = result.status, result.length, result.risk
        self.missed = missed

    @property
    def share(self) -> float:
        return float(self.available.mean())

    @property
    def share_with_e1(self) -> float:
        return float(self.available_with_e1.mean())

    def table(self) -> dict[str, npt.NDArray[Any]]:
        """Columns, one row a mileage."""
        names = (
            "along", "latitude", "longitude", "satellites", "status", "sigma", "rival", "p_star",
            "bound_along", "e1", "e2", "available", "available_with_e1", "protection_chi2",
            "protection",
        )  # fmt: skip
        return {name: getattr(self, name) for name in names}

    def plot(self) -> Any:
        """A figure: the line coloured by availability and protection level."""
        from surefix.plots.raim import draw_availability

        return draw_availability(self, missed=self.missed)


def availability(
    track: Track,
    satellites: npt.ArrayLike,
    *,
    length: float,
    system: Sequence[str] | None = None,
    sigma: float | Callable[[FloatArray], npt.ArrayLike] = 5.0,
    along: npt.ArrayLike | None = None,
    step: float = 10.0,
    elevation_mask: float = 5.0,
    masks: Sequence[Mask] = (),
    progress: Callable[[int, int], None] | None = None,
    **monitor: Any,
) -> AvailabilityMap:
    """The monitor's availability along a track, with the satellites (n, 3) [m] of one epoch.

    ``sigma`` [m]: of all pseudoranges, or a function of the elevation [degrees]; a number is that
    at the zenith, divided by the sine of the elevation. ``along``: mileages, by default every
    ``step`` [m]. ``elevation_mask`` [degrees]; ``masks``: Cutting and Tunnel. ``length`` and
    ``monitor``: arguments of ``TrackRaim``, with ``max_excluded`` 0 unless given: exclusion needs
    a share of the risk. Nothing is measured: p*, e₁ and the protection levels
    follow from the geometry.
    """
    line = checks.instance("track", track, Track)
    positions = checks.array("satellites", satellites, (None, 3))
    if len(positions) == 0:
        raise ShapeError(f"satellites: expected at least one, got shape {positions.shape}")
    places = _places(line, along, step)
    hidden: tuple[Mask, ...] = checks.tuple_of(
        "masks", masks, (Cutting, Tunnel), "Cutting or Tunnel"
    )
    if system is not None and len(system) != len(positions):
        raise ShapeError(f"system: expected {len(positions)} names, got {len(system)}")
    mask = checks.number("elevation_mask", elevation_mask)
    seen = visible(line, places, positions, mask, hidden)
    K, n = seen.shape
    at = np.repeat(line.position(places), n, axis=0)
    rows = np.tile(positions, (K, 1))
    elevation, _ = sky(at, rows)
    if callable(sigma):
        spread = checks.floats("sigma", sigma(elevation))
    else:
        spread = elevation_sigma(elevation, checks.positive("sigma", sigma))
    if spread.shape != elevation.shape:
        raise ShapeError(f"sigma: expected shape {elevation.shape}, got {spread.shape}")
    raim = TrackRaim(line, length=length, **{"max_excluded": 0, **monitor})
    ranges = np.linalg.norm(rows - at, axis=1)
    if raim.earth_rotation:
        ranges = ranges + sagnac(at, rows)
    data = Pseudoranges(
        np.repeat(np.arange(float(K)), n), np.tile([f"{k}" for k in range(n)], K), rows, ranges,
        np.where(seen.reshape(-1), spread, np.inf),
        None if system is None else np.tile(np.asarray(system), K),
    )  # fmt: skip
    result = raim.run(data, near=float(places[0]), progress=progress)
    return AvailabilityMap(line, places, result, raim.missed)


def sagnac(receiver: FloatArray, satellite: FloatArray) -> FloatArray:
    """By how much the Earth's rotation during the signal's travel lengthens the range [m]."""
    turn = satellite[:, 0] * receiver[:, 1] - satellite[:, 1] * receiver[:, 0]
    return np.asarray(_core.EARTH_ROTATION / 299792458.0 * turn)


def _places(track: Track, along: npt.ArrayLike | None, step: float) -> FloatArray:
    if along is not None:
        given = np.array(checks.array("along", along, (None,)))
        if len(given) == 0:
            raise ShapeError(f"along: expected at least one mileage, got shape {given.shape}")
        return given
    apart = checks.positive("step", step)
    return np.arange(track.low, track.high + 1e-9 * apart, apart)
