"""Two sensors of one thing: logs of speed with the course that it took, and a linear system."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

import surefix as sf
from drift.scenes import LogScene, Scene
from oracle.drift import integrator_chain
from oracle.step import Array
from oracle.switching import Plant

Course = Callable[[Array], Array]
JERK = 0.01  # so stiff that speed and sensor can be told apart: 0.03 m/s² in 10 s
TWO = (sf.Sensor("wheel", 0.2), sf.Sensor("radar", 0.3))


@dataclass(frozen=True)
class SpeedLog(LogScene):
    """``truth`` (rows, 2): speed and acceleration at the validity of each row."""

    truth: tuple[tuple[float, float], ...] = ()

    MODEL = sf.ConstantAcceleration(jerk=JERK)

    @property
    def valid(self) -> Array:
        """Time of validity of each row."""
        return np.array([t - self.sensors[i].latency for t, i, _ in self.rows])

    def of(self, name: str) -> Array:
        """Which rows are of one sensor, as an index."""
        return np.array([k for k, row in enumerate(self.rows) if self.channels[row[1]] == name])

    def with_fault(self, name: str, course: Course) -> SpeedLog:
        """``course`` of the time of validity is added to one sensor."""
        added = course(self.valid)
        own = self.channels.index(name)
        rows = [
            (t, i, v + float(d) if i == own else v)
            for (t, i, v), d in zip(self.rows, added, strict=True)
        ]
        return replace(self, rows=tuple(rows))

    @property
    def plant(self) -> Plant:
        """One step for each row in the order of validity; the first step is the start, where
        nothing is measured."""
        assert self.start is not None
        order = np.argsort(self.valid)
        when = np.concatenate([[self.start], self.valid[order]])
        moves = [integrator_chain(2, JERK)(dt) for dt in np.diff(when)]
        A, Q = (np.array(each) for each in zip(*moves, strict=True))
        sigma = np.array([1.0, *(self.sensors[self.rows[k][1]].sigma for k in order)])
        H = np.tile(np.array([[1.0, 0.0]]), (len(when), 1, 1))
        return Plant(A, H, Q, (sigma**2)[:, None, None], self.X0, self.P0)

    @property
    def z(self) -> Array:
        """(1 + rows, 1) of ``plant``."""
        value = [self.rows[k][2] for k in np.argsort(self.valid)]
        return np.array([np.nan, *value])[:, None]


def speed_log(
    seed: int, count: int = 150, duration: float = 20.0, sensors: Sequence[sf.Sensor] = TWO
) -> SpeedLog:
    """No fault; readings at ``count`` times, to the millisecond, no two of them at the same time or
    of the same validity, half of each sensor, in the
    order of their stamps; the filter starts at 0 with the law that the state was drawn from."""
    rng = np.random.default_rng(seed)
    ticks = np.sort(rng.choice(np.arange(1, round(duration * 1e3)), count, replace=False))
    index = rng.permutation(np.arange(count) % len(sensors))
    x = LogScene.X0 + np.sqrt(np.diag(LogScene.P0)) * rng.normal(size=2)
    now, rows, truth = 0, [], []
    for tick, i in zip(ticks.tolist(), index.tolist(), strict=True):
        F, Q = integrator_chain(2, JERK)((tick - now) / 1e3)
        x, now = F @ x + np.linalg.cholesky(Q) @ rng.normal(size=2), tick
        value = x[0] + sensors[i].sigma * rng.normal()
        latency = round(1e3 * sensors[i].latency)
        rows.append(((tick + latency) / 1e3, i, float(value)))
        truth.append((float(x[0]), float(x[1])))
    come = sorted(range(count), key=lambda k: rows[k][0])
    return SpeedLog(
        tuple(sensors), tuple(rows[k] for k in come), 0.0, tuple(truth[k] for k in come)
    )


def doubled(steps: int = 120) -> Scene:
    """A position that two sensors measure, every half second; known accelerations."""
    plant = Plant(
        A=np.array([[1.0, 0.5], [0.0, 1.0]]), H=np.array([[1.0, 0.0], [1.0, 0.0]]),
        Q=np.diag([1e-4, 1e-5]), R=np.diag([0.04, 0.09]), x0=np.zeros(2), P0=np.diag([4.0, 0.1]),
    )  # fmt: skip
    inputs = np.zeros((steps - 1, 2))
    inputs[::20, 1] = 0.3
    seen = np.ones((steps, 2), dtype=bool)
    return Scene(plant, 0.5 * np.arange(float(steps)), inputs, ("wheel", "radar"), seen)


def step(onset: float, amplitude: float) -> Course:
    return lambda t: np.where(t >= onset, amplitude, 0.0)


def pulse(onset: float, amplitude: float, end: float) -> Course:
    return lambda t: np.where((t >= onset) & (t < end), amplitude, 0.0)


def ramp(onset: float, slope: float, end: float = np.inf) -> Course:
    return lambda t: slope * (np.clip(t, onset, end) - onset)
