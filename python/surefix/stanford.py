"""Errors against the limits that are claimed for them: the regions of the Stanford diagram."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from surefix.core import checks
from surefix.errors import ConfigError, ShapeError

BoolArray = npt.NDArray[np.bool_]


class Regions(NamedTuple):
    """Of every epoch (T,) whether it is in a region; in none of them where the error or the level
    is NaN. With |error| e, protection level PL and limit AL:

    ``available``: e ≤ PL ≤ AL. ``misleading``: PL < e ≤ AL. ``hazardous``, misleading beyond the
    limit: PL ≤ AL < e. ``unavailable``: e ≤ PL, AL < PL. ``unavailable_misleading``: AL < PL < e.
    """

    available: BoolArray
    misleading: BoolArray
    hazardous: BoolArray
    unavailable: BoolArray
    unavailable_misleading: BoolArray

    @property
    def counts(self) -> dict[str, int]:
        """Epochs in each region."""
        return {name: int(inside.sum()) for name, inside in self._asdict().items()}


def regions(error: npt.ArrayLike, protection: npt.ArrayLike, limit: float) -> Regions:
    """Sorts errors (T,) and protection levels (T,), half-widths, by an alert limit; one unit."""
    e = np.abs(checks.floats("error", error))
    level = checks.floats("protection", protection)
    if e.ndim != 1 or level.shape != e.shape:
        raise ShapeError(f"protection: expected shape {e.shape} as error has, got {level.shape}")
    if (level < 0).any():
        raise ConfigError(f"protection: expected numbers >= 0, got {level[level < 0][0]}")
    most = checks.positive("limit", limit)
    held, low = e <= level, level <= most
    known = ~np.isnan(e) & ~np.isnan(level)
    return Regions(
        known & held & low,
        known & ~held & low & (e <= most),
        known & ~held & low & (e > most),
        known & held & ~low,
        known & ~held & ~low,
    )
