"""The same systems, logs and profiles for the engine and for the oracle."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

import surefix as sf
from oracle import drift
from oracle import drift_profiles as profiles
from oracle.drift import Dense
from oracle.sensors import Sensor
from oracle.step import Array
from oracle.switching import Plant
from switching.plants import random_plant

Row = tuple[float, int, float]
Channel = str | Mapping[str, float] | None

# Where less than this share of the information is left, rounding of the forward pass alone (1e-16)
# may move a ratio by 1e-10 of itself and more, and the engine may call the fault hidden.
CLEAR = 1e-6
# Less than rounding of the data can make: a number here would be made of nothing.
HIDDEN = 1e-14


@dataclass(frozen=True)
class Scene:
    """A system and when which of its components are measured."""

    plant: Plant
    times: Array  # (T,)
    inputs: Array  # (T - 1, n)
    channels: tuple[str, ...]
    seen: NDArray[np.bool_]  # (T, m)

    @property
    def system(self) -> sf.LinearSystem:
        p = self.plant
        return sf.LinearSystem(p.A, p.H, p.Q, p.R, p.x0, p.P0)

    def simulated(self, runs: int, seed: int) -> Array:
        """(runs, T, m), no fault."""
        z = drift.simulate(self.plant, runs, len(self.times), seed, self.inputs)
        return np.where(self.seen, z, np.nan)

    def record(self, z: Array) -> sf.ForwardRecord:
        return sf.ForwardRecord(
            self.system, z, times=self.times, inputs=self.inputs, channels=self.channels
        )

    def dense(self, z: Array) -> Dense:
        return drift.dense(self.plant, z, self.times, self.inputs)

    def weights(self, channel: Channel) -> Array:
        return weights(self.channels, channel)


def weights(channels: tuple[str, ...], channel: Channel) -> Array:
    """Of all channels (m,)."""
    if channel is None:
        return np.ones(1)
    given = {channel: 1.0} if isinstance(channel, str) else channel
    return np.array([given.get(name, 0.0) for name in channels])


def particle(steps: int = 100, interval: float = 1.0) -> Scene:
    """The paper's, eqs. (23)-(24): position measured, a known acceleration every 20 steps. The
    matrices are those of one step, whatever the interval."""
    plant = Plant(
        A=np.array([[1.0, 1.0], [0.0, 1.0]]), H=np.array([[1.0, 0.0]]), Q=np.diag([1e-8, 1e-4]),
        R=np.array([[1.5]]), x0=np.zeros(2), P0=np.eye(2),
    )  # fmt: skip
    inputs = np.zeros((steps - 1, 2))
    inputs[::20, 1] = 2.0 * np.random.default_rng(7).normal(size=len(inputs[::20]))
    seen = np.ones((steps, 1), dtype=bool)
    times = np.asarray(interval * np.arange(steps), dtype=np.float64)
    return Scene(plant, times, inputs, ("position",), seen)


def irregular(steps: int = 60) -> Scene:
    """Three states and two outputs; all matrices other ones in every step, R full, components
    missing, inputs on all states, times as they come."""
    rng = np.random.default_rng(11)
    seen = rng.random((steps, 2)) > 0.25
    seen[steps // 2] = False  # a step without any measurement
    times = 5.0 + np.cumsum(rng.exponential(0.8, steps))
    inputs = rng.normal(size=(steps - 1, 3))
    return Scene(random_plant(11, 3, 2, steps), times, inputs, ("a", "b"), seen)


@dataclass(frozen=True)
class LogScene:
    """Constant acceleration; ``rows`` (time, sensor, value) in the order of the log."""

    sensors: tuple[sf.Sensor, ...]
    rows: tuple[Row, ...]
    start: float | None = None

    MODEL = sf.ConstantAcceleration(jerk=0.3)
    X0, P0 = np.array([20.0, 0.1]), np.diag([4.0, 0.5])

    @property
    def channels(self) -> tuple[str, ...]:
        return tuple(s.name for s in self.sensors)

    @property
    def filter(self) -> sf.DesyncFilter:
        return sf.DesyncFilter(self.MODEL, self.sensors, self.X0, self.P0, start=self.start)

    @property
    def log(self) -> sf.Log:
        time, index, value = zip(*self.rows, strict=True)
        return sf.Log(time, [self.channels[i] for i in index], value)

    @property
    def record(self) -> sf.ForwardRecord:
        return sf.ForwardRecord(self.filter, self.log)

    @property
    def dense(self) -> Dense:
        speed = np.array([1.0, 0.0])
        known = [
            Sensor(
                s.name, np.array(s.observes or speed), s.sigma, s.latency,
                bias_sigma=s.bias_sigma, bias_time=s.bias_time,
            )
            for s in self.sensors
        ]  # fmt: skip
        transition = drift.integrator_chain(2, self.MODEL.jerk)
        return drift.dense_log(transition, known, self.X0, self.P0, self.rows, self.start)

    def weights(self, channel: Channel) -> Array:
        return weights(self.channels, channel)


def logged(seed: int = 3, latency: float = 0.0, start: float | None = None) -> LogScene:
    """Three sensors of different rates for 20 s, one with a wandering bias and one that sees some
    of the acceleration; no two readings at the same time, no fault."""
    rng = np.random.default_rng(seed)
    chosen = (
        sf.Sensor("wheel", 0.3, bias_sigma=0.5, bias_time=8.0),
        sf.Sensor("radar", 0.5, latency=latency),
        sf.Sensor("gps", 0.2, observes=(1.0, 0.1)),
    )
    ticks = rng.choice(20_000, 150, replace=False)  # ms
    index = np.sort(rng.choice(3, len(ticks), p=[0.5, 0.35, 0.15]))
    rows = [(round(int(t) / 1e3, 3), int(i), 0.0) for t, i in zip(ticks, index, strict=True)]
    scene = LogScene(chosen, tuple(rows), start)
    d = scene.dense
    value = d.spread((d.L @ rng.normal(size=len(rows)) - d.gamma).astype(float))  # N(0, Gamma)
    read = [(t, i, float(v)) for (t, i, _), v in zip(rows, value, strict=True)]
    return replace(scene, rows=tuple(read))


DAMPED = np.array([[-0.1, 0.5], [-0.5, -0.1]])
SQUARE = np.eye(3, k=1)
CUBE = np.eye(4, k=1)
# The engine's and the oracle's.
PROFILES: dict[str, tuple[Callable[[], sf.Profile], profiles.Profile]] = {
    "step": (lambda: sf.Profile.step(), profiles.step),
    "ramp": (lambda: sf.Profile.ramp(), profiles.ramp),
    "settling": (lambda: sf.Profile.exponential(6.0), profiles.exponential(6.0)),
    "growing": (lambda: sf.Profile.exponential(-9.0), profiles.exponential(-9.0)),
    "sine": (lambda: sf.Profile.sine(0.11), profiles.sine(0.11)),
    "damped": (
        lambda: sf.Profile(DAMPED, np.array([1.0, 0.0]), np.array([0.0, 1.0]), name="damped"),
        profiles.user(DAMPED, np.array([1.0, 0.0]), np.array([0.0, 1.0])),
    ),
    "step and parabola": (
        lambda: sf.Profile(SQUARE, np.eye(3)[0], np.eye(3)[:, [0, 2]]),
        profiles.user(SQUARE, np.eye(3)[0], np.eye(3)[:, [0, 2]]),
    ),
    "cubic": (
        lambda: sf.Profile(CUBE, np.eye(4)[0], np.eye(4)[3]),
        profiles.user(CUBE, np.eye(4)[0], np.eye(4)[3]),
    ),
}
ONE_AMPLITUDE = [name for name in PROFILES if name not in ("sine", "step and parabola")]


def faulty(z: Array, value: Array, channel: int = 0) -> Array:
    """z (..., T, m) with ``value`` (T,) added to one channel."""
    out = z.copy()
    out[..., channel] += value
    return out
