"""Satellites over the sine track of the study ``lacresse-fig-2``.

One sky is held here: station 0759 of GEONET (Japan), GPS, 2 April 2005, week 1316, 521640 s, the
satellites above 10°. The observations are those in RTKLIB's repository (``test/data/rinex``); the
positions were computed from their broadcast ephemeris and are rounded to 1 km, which turns no line
of sight by more than 5e-5. Two more are read where the recordings are: see ``skies``.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from surefix.core.checks import FloatArray
from surefix.raim.geodesy import ecef_to_geodetic, geodetic_to_ecef, local_axes, sky
from surefix.raim.pseudorange_files import read_pseudoranges
from surefix.reading.from_csv import read_csv

STATION = (35.160875, 139.613837, 70.2)  # latitude, longitude [degrees], height [m]
SATELLITES = {  # fixed to the Earth [km]
    "G01": (-17459, -14989, 13473),
    "G04": (5378, 25809, 691),
    "G07": (2691, 16514, 21073),
    "G11": (-17010, 625, 20385),
    "G19": (-25419, -7464, 1836),
    "G20": (-21705, 10945, 10597),
    "G24": (-5566, 21948, 14009),
    "G28": (-8362, 21100, 13748),
}
MASK = 10.0  # elevation [degrees]
RECORDED = {  # columns of the receiver's positions
    "gnss-nagoya-rover": ("x_m", "y_m", "z_m"),
    "car-smartloc": ("ecef_x_m", "ecef_y_m", "ecef_z_m"),
}


@dataclass(frozen=True)
class Sky:
    """``satellites`` (n, 3): metres east, north and up of the receiver. ``clocks`` (n, c): a
    column of ones and zeros for every constellation, whose receiver clocks differ."""

    name: str
    satellites: FloatArray
    clocks: FloatArray

    @property
    def elevation(self) -> FloatArray:
        """(n,) [degrees]."""
        east, north, up = self.satellites.T
        return np.asarray(np.degrees(np.arctan2(up, np.hypot(east, north))))


def make_sky(
    name: str, receiver: FloatArray, satellites: FloatArray, system: npt.NDArray[np.str_]
) -> Sky:
    """Of positions fixed to the Earth, receiver (3,) and satellites (n, 3) [m]; those above the
    mask."""
    seen = sky(receiver, satellites)[0] > MASK
    latitude, longitude, _ = ecef_to_geodetic(receiver)
    local = (satellites[seen] - receiver) @ local_axes(latitude, longitude).T
    names = np.unique(system[seen])
    return Sky(name, local, (system[seen, None] == names).astype(np.float64))


def held() -> Sky:
    """The one held here: 8 satellites of one constellation."""
    satellites = 1e3 * np.array(list(SATELLITES.values()), dtype=np.float64)
    system = np.full(len(satellites), "G")
    return make_sky("gnss-geonet-0759", geodetic_to_ecef(*STATION), satellites, system)


def recorded(folder: Path, columns: tuple[str, ...]) -> Sky:
    """That of the first epoch of a recording."""
    data = read_pseudoranges(folder / "pseudoranges.csv")
    truth = read_csv(folder / "truth.csv", columns, None, None)
    receiver = np.array([truth[column].values[0] for column in columns])
    rows = slice(0, int(data.begin[1]))
    return make_sky(folder.name, receiver, data.position[rows], data.system[rows])


def skies(recordings: Path | None = None) -> list[Sky]:
    """The one held here, and those of the recordings that there are in a folder: by default the one
    that SUREFIX_DATA names, else ``../shared/data``."""
    root = recordings or Path(os.environ.get("SUREFIX_DATA", "../shared/data"))
    return [
        held(),
        *(recorded(root / name, columns) for name, columns in RECORDED.items()
          if (root / name / "pseudoranges.csv").exists()),
    ]  # fmt: skip
