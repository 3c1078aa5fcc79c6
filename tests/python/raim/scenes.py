"""Tracks, skies and epochs of pseudoranges for the engine and for the oracle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import surefix as sf
from oracle.raim_geodesy import geodetic_to_ecef, local_axes
from oracle.raim_monitor import Demand
from oracle.raim_solution import Epoch
from oracle.raim_track import Spline, spline
from oracle.step import Array

ORIGIN = (50.85, 4.35, 60.0)  # latitude, longitude [deg], height [m]
ORBIT = 26_560_000.0  # radius [m] of a GPS satellite's orbit
NAMES = "GER"


def local(east: Array, north: Array, up: Array | float = 0.0) -> Array:
    """(..., 3) Earth-centred of metres in the plane through ORIGIN."""
    offsets = np.stack(np.broadcast_arrays(east, north, up), axis=-1)
    return np.asarray(geodetic_to_ecef(*ORIGIN) + offsets @ local_axes(*ORIGIN[:2]))


def curved_points(radius: float = 800.0, spacing: float = 20.0, length: float = 1600.0) -> Array:
    """Points (k, 3) of an S: half its length turns left, half right, climbing at 1 %."""
    l = np.arange(0.0, length + 0.5 * spacing, spacing)  # noqa: E741
    heading = np.where(l < length / 2, l, length - l) / radius
    east = np.concatenate([[0.0], np.cumsum(spacing * np.cos(heading[:-1]))])
    north = np.concatenate([[0.0], np.cumsum(spacing * np.sin(heading[:-1]))])
    return local(east, north, 0.01 * l)


def straight_points(length: float = 1600.0) -> Array:
    l = np.linspace(0.0, length, 5)  # noqa: E741
    return local(0.8 * l, 0.6 * l)


def winding_points(seed: int = 1, count: int = 60) -> Array:
    """Points (count, 3) 5 to 40 m apart along a winding track."""
    rng = np.random.RandomState(seed)
    step = rng.uniform(5.0, 40.0, count)
    heading = np.cumsum(rng.uniform(-2.0, 2.0, count) * step / 600.0)
    return local(np.cumsum(step * np.cos(heading)), np.cumsum(step * np.sin(heading)),
                 np.cumsum(0.02 * step * np.sin(heading)))  # fmt: skip


@dataclass(frozen=True)
class Scene:
    """Epochs on one track; ``truth`` is the mileage of each."""

    points: Array  # (k, 3) of the track
    truth: Array  # (T,) [m]
    epochs: tuple[Epoch, ...]

    @property
    def spline(self) -> Spline:
        return spline(self.points)

    @property
    def track(self) -> sf.raim.Track:
        return sf.raim.Track(self.points)

    @property
    def pseudoranges(self) -> sf.raim.Pseudoranges:
        """All epochs, a second apart; a satellite's name is its number in the epoch."""
        e = self.epochs
        return sf.raim.Pseudoranges(
            np.concatenate([np.full(one.n, float(t)) for t, one in enumerate(e)]),
            [f"{one.system[i]}{i:02d}" for one in e for i in range(one.n)],
            np.concatenate([one.satellite for one in e]),
            np.concatenate([one.pseudorange for one in e]),
            np.concatenate([one.sigma for one in e]),
            system=[s for one in e for s in one.system],
        )

    @property
    def first(self) -> list[int]:
        """Where each epoch's rows begin, and the number of rows."""
        return [0, *np.cumsum([e.n for e in self.epochs]).tolist()]

    def rows(self, values: Any, t: int) -> Any:
        """Of epoch t, out of one value a row (N,)."""
        return values[self.first[t] : self.first[t + 1]]


def sky(rng: np.random.RandomState, x: Array, n: int, lowest: float = 7.0) -> Array:
    """n satellites (n, 3) at random azimuths and elevations of at least ``lowest`` degrees."""
    azimuth = rng.uniform(0.0, 2 * np.pi, n)
    up = np.sin(rng.uniform(np.radians(lowest), np.pi / 2, n))
    flat = np.sqrt(1.0 - up**2)
    enu = np.stack([flat * np.sin(azimuth), flat * np.cos(azimuth), up], axis=1)
    u = enu @ local_axes(*ORIGIN[:2])
    along = u @ x
    return np.asarray(x + u * (np.sqrt(along**2 + ORBIT**2 - x @ x) - along)[:, None])


def epoch(
    rng: np.random.RandomState,
    track: Spline,
    truth: float,
    system: Sequence[str],
    rotation: bool = False,
) -> Epoch:
    """Noise by sigma of 0.5 to 5 m, each system's clock off by up to a millisecond."""
    x, n = track.position(truth), len(system)
    sigma = rng.uniform(0.5, 5.0, n)
    clock = {name: rng.uniform(-3e5, 3e5) for name in NAMES}
    bare = Epoch(sky(rng, x, n), np.zeros(n), sigma, tuple(system), rotation)
    off = np.array([clock[s] for s in system])
    return Epoch(bare.satellite, bare.ranges(x) + off + sigma * rng.normal(size=n), sigma,
                 bare.system, rotation)  # fmt: skip


def scene(
    seed: int,
    count: int,
    points: Array | None = None,
    systems: tuple[int, int] = (1, 3),
    satellites: tuple[int, int] = (5, 14),
    rotation: bool = False,
) -> Scene:
    """Random epochs; each system that is there has at least one satellite, and there are always two
    more satellites than unknowns."""
    rng = np.random.RandomState(seed)
    given = curved_points() if points is None else points
    track = spline(given)
    truth, epochs = rng.uniform(track.low + 100.0, track.high - 100.0, count), []
    for l in truth:  # noqa: E741
        c = int(rng.randint(systems[0], systems[1] + 1))
        n = int(rng.randint(max(satellites[0], c + 3), satellites[1] + 1))
        names = list(NAMES[:c]) + [NAMES[int(rng.randint(c))] for _ in range(n - c)]
        epochs.append(epoch(rng, track, float(l), names, rotation))
    return Scene(given, truth, tuple(epochs))


def monitor(track: sf.raim.Track, demand: Demand, **more: object) -> sf.raim.TrackRaim:
    return sf.raim.TrackRaim(
        track,
        length=demand.length,
        false_alarm=demand.false_alarm,
        missed=demand.missed,
        risk=demand.risk,
        fault_probability=demand.fault_probability,
        max_faults=demand.max_faults,
        max_excluded=demand.max_excluded,
        **more,  # type: ignore[arg-type]
    )
