"""A train below ten satellites that stay, one of them low: as objects and as files."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

import surefix as sf
from oracle.raim_geodesy import local_axes
from oracle.step import Array
from raim.scenes import ORIGIN, curved_points

EPOCHS = 30
ZENITH = 1.5
"""σ overhead [m]."""
SKY = {
    "G01": (20, 60), "G02": (95, 25), "G03": (170, 40), "G04": (250, 30), "G05": (310, 55),
    "G06": (60, 3), "E01": (45, 35), "E02": (140, 70), "E03": (225, 20), "E04": (350, 45),
}  # fmt: skip
"""Azimuth and elevation [degrees] from the middle of the track."""
NAMES = tuple(SKY)
LOW = NAMES.index("G06")
DISTANCE = 2.3e7  # [m]


@dataclass(frozen=True)
class Journey:
    """``pseudorange`` (T, n) [m], NaN where there is none; ``truth`` (T,) mileages [m]."""

    points: Array  # (k, 3)
    satellites: Array  # (n, 3)
    truth: Array
    pseudorange: Array

    @property
    def track(self) -> sf.raim.Track:
        return sf.raim.Track(self.points)

    @property
    def data(self) -> sf.raim.Pseudoranges:
        """Without the low satellite."""
        T, n = self.pseudorange.shape
        data = sf.raim.Pseudoranges(
            np.repeat(np.arange(float(T)), n), np.tile(NAMES, T), np.tile(self.satellites, (T, 1)),
            self.pseudorange.reshape(-1), np.tile(sigma(), T), [name[0] for name in NAMES] * T,
        )  # fmt: skip
        return data.with_sigma(np.where(data.satellite == NAMES[LOW], np.inf, data.sigma))

    def biased(self, name: str, epochs: slice, bias: float) -> Journey:
        """With ``bias`` [m] added to one satellite; NaN takes it away."""
        changed = self.pseudorange.copy()
        changed[epochs, NAMES.index(name)] += bias
        return replace(self, pseudorange=changed)

    def blocked(self, kept: int, epochs: slice) -> Journey:
        """Only the first ``kept`` satellites are received."""
        changed = self.pseudorange.copy()
        changed[epochs, kept:] = np.nan
        return replace(self, pseudorange=changed)

    def write(self, folder: Path) -> None:
        """pseudoranges.csv, track.csv, truth.csv."""
        lines = ["t_s,sat,sat_x_m,sat_y_m,sat_z_m,pr_corr_m"]
        for t, row in enumerate(self.pseudorange):
            for name, place, value in zip(NAMES, self.satellites, row, strict=True):
                cell = "" if np.isnan(value) else f"{value:.4f}"
                lines.append(f"{t},{name},{','.join(f'{x:.4f}' for x in place)},{cell}")
        write_rows(folder / "pseudoranges.csv", lines[0], lines[1:])
        true = np.column_stack([np.arange(len(self.truth)), self.track.position(self.truth)])
        for name, header, rows in (
            ("track.csv", "x_m,y_m,z_m", self.points), ("truth.csv", "t_s,x_m,y_m,z_m", true),
        ):  # fmt: skip
            write_rows(folder / name, header, [",".join(map(repr, r)) for r in rows.tolist()])


def write_rows(path: Path, header: str, rows: list[str]) -> None:
    path.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")


def sigma() -> Array:
    """(n,) [m]."""
    return sf.raim.elevation_sigma([float(elevation) for _, elevation in SKY.values()], ZENITH)


def journey(seed: int = 3) -> Journey:
    """Without faults, 20 m a second on an S; the clocks of the two systems differ and drift."""
    random = np.random.RandomState(seed)
    points = curved_points()
    azimuth, elevation = np.radians(np.array([*SKY.values()], dtype=np.float64)).T
    flat = np.cos(elevation)
    to = np.stack([flat * np.sin(azimuth), flat * np.cos(azimuth), np.sin(elevation)], axis=1)
    satellites = points[len(points) // 2] + DISTANCE * to @ local_axes(*ORIGIN[:2])
    truth = np.linspace(200.0, 200.0 + 20.0 * (EPOCHS - 1), EPOCHS)
    place = sf.raim.Track(points).position(truth)
    ranges = np.linalg.norm(satellites - place[:, None, :], axis=2)
    clock = np.where([name[0] == "G" for name in NAMES], 120.0, -45.0) + np.arange(EPOCHS)[:, None]
    noise = sigma() * random.normal(size=ranges.shape)
    return Journey(points, satellites, truth, ranges + clock + noise)
