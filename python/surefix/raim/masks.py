"""What hides satellites along a track."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from surefix.core import checks
from surefix.core.checks import FloatArray
from surefix.errors import ConfigError
from surefix.raim.track import Track

BoolArray = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Cutting:
    """From mileage ``low`` to ``high`` [m] long walls beside the track hide what is below
    ``left_deg`` and ``right_deg`` [degrees], seen across the track."""

    low: float
    high: float
    left_deg: float
    right_deg: float

    def __post_init__(self) -> None:
        _check_ends("cutting", self.low, self.high)
        for name in ("left_deg", "right_deg"):
            angle = checks.number(f"cutting {name}", getattr(self, name))
            if not 0 <= angle <= 90:
                raise ConfigError(f"cutting {name}: expected degrees from 0 to 90, got {angle}")

    def hides(self, forward: FloatArray, left: FloatArray, up: FloatArray) -> BoolArray:
        """Of directions (…) in the track's axes. A wall without end hides a direction by its angle
        in the plane across the track."""
        angle = np.degrees(np.arctan2(up, np.abs(left)))
        return np.asarray(angle < np.where(left > 0, self.left_deg, self.right_deg))


@dataclass(frozen=True)
class Tunnel:
    """From mileage ``low`` to ``high`` [m] nothing is seen."""

    low: float
    high: float

    def __post_init__(self) -> None:
        _check_ends("tunnel", self.low, self.high)

    def hides(self, forward: FloatArray, left: FloatArray, up: FloatArray) -> BoolArray:
        return np.ones(np.shape(up), dtype=np.bool_)


Mask = Cutting | Tunnel


def visible(
    track: Track,
    along: FloatArray,
    satellites: FloatArray,
    elevation_mask: float,
    masks: Sequence[Mask],
) -> BoolArray:
    """(K, n): which satellites (n, 3) are seen from the mileages ``along`` (K,), above the
    elevation mask [degrees] and not hidden by a mask."""
    to = satellites[None, :, :] - track.position(along)[:, None, :]
    forward, left, up = np.moveaxis(np.einsum("kij,knj->kni", track.axes(along), to), -1, 0)
    elevation = np.degrees(np.arctan2(up, np.hypot(forward, left)))
    seen: BoolArray = elevation >= elevation_mask
    for mask in masks:
        inside = (mask.low <= along) & (along <= mask.high)
        seen &= ~(inside[:, None] & mask.hides(forward, left, up))
    return seen


def _check_ends(what: str, low: float, high: float) -> None:
    a, b = checks.number(f"{what} low", low), checks.number(f"{what} high", high)
    if a > b:
        raise ConfigError(f"{what} high: expected a mileage >= low = {a:g}, got {b:g}")
