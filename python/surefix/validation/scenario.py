"""What is simulated: a model, sensors that read at a fixed rate, their faults, what they share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

import surefix as sf
from surefix.core.checks import FloatArray
from surefix.errors import ConfigError


@dataclass(frozen=True)
class SharedDrift:
    """An event that adds one and the same bias to the readings of several sensors: it begins with
    N(0, ``sigma``²) at ``rate`` [1/s], walks by ``walk`` [unit/√s], lasts ``duration`` [s]."""

    sensors: tuple[str, ...]
    rate: float
    duration: float
    sigma: float
    walk: float


@dataclass(frozen=True)
class Bias:
    """A bias state: there while ``chain`` is in ``mode``; ``sensors`` show it."""

    chain: int
    mode: int
    sensors: tuple[int, ...]
    sigma: float
    walk: float


@dataclass(frozen=True, eq=False)
class Scenario:
    """``steps`` estimates, ``step`` [s] apart, from ``x0``, ``P0`` at 0 s; ``hz``: of each sensor.
    A value in an outage is uniform over an interval of its span around ``centre``."""

    model: sf.ConstantAcceleration
    sensors: tuple[sf.Sensor, ...]
    hz: tuple[float, ...]
    x0: tuple[float, ...]
    P0: tuple[float, ...]  # its diagonal
    step: float
    steps: int
    centre: float
    shared: SharedDrift | None = None

    def __post_init__(self) -> None:
        if len(self.hz) != len(self.sensors):
            raise ConfigError(f"hz: expected {len(self.sensors)} rates, got {len(self.hz)}")
        for sensor in self.sensors:
            if sensor.scale_sigma or sensor.bias_sigma or sensor.observes is not None:
                raise ConfigError(f"sensor {sensor.name!r}: expected white noise and speed only")
            if not all(isinstance(fault, (sf.Outage, sf.Drifting)) for fault in sensor.faults):
                raise ConfigError(f"sensor {sensor.name!r}: expected Outage and Drifting only")

    def times(self) -> FloatArray:
        """Ends of the steps (T,) [s]."""
        return self.step * np.arange(1.0, self.steps + 1)

    def schedule(self) -> list[tuple[float, int]]:
        """(time of validity [s], sensor), sorted. Stamps are later by the sensor's latency."""
        end = self.steps * self.step
        readings = []
        for s, (sensor, hz) in enumerate(zip(self.sensors, self.hz, strict=True)):
            first = (s + 1) / (len(self.sensors) + 1) / hz
            stamps = np.round(np.arange(first, end + 10 / hz, 1 / hz), 6)
            valid = np.round(stamps - sensor.latency, 6)
            readings += [(float(t), s) for t in valid[(valid > 0) & (valid <= end)]]
        return sorted(readings)

    def chains(self) -> list[FloatArray]:
        """Generator of the modes of every sensor, and of the shared drift at the end [1/s]."""
        chains = [
            _star([(f.rate or 0.0, f.duration or 1.0) for f in sensor.faults])
            for sensor in self.sensors
        ]
        if self.shared is not None:
            chains.append(_star([(self.shared.rate, self.shared.duration)]))
        return chains

    def biases(self) -> list[Bias]:
        """Of drifting sensors, and the shared one."""
        found = [
            Bias(s, i, (s,), fault.sigma, fault.walk)
            for s, sensor in enumerate(self.sensors)
            for i, fault in enumerate(sensor.faults, start=1)
            if isinstance(fault, sf.Drifting)
        ]
        if self.shared is not None:
            names = [sensor.name for sensor in self.sensors]
            members = tuple(names.index(name) for name in self.shared.sensors)
            found.append(Bias(len(names), 1, members, self.shared.sigma, self.shared.walk))
        return found


def raised(generator: FloatArray, factor: float) -> FloatArray:
    """The chain whose faults begin ``factor`` times as often, and last as long."""
    G = generator.copy()
    G[0] *= factor
    return G


def transition(generator: FloatArray, dt: float) -> FloatArray:
    """e^{GΔt}, by squaring a Taylor series."""
    scaled = generator * dt
    halvings = max(0, int(np.ceil(np.log2(max(1e-300, np.abs(scaled).sum(axis=1).max())))) + 4)
    scaled = scaled / 2.0**halvings
    total, term = np.eye(len(scaled)), np.eye(len(scaled))
    for k in range(1, 14):
        term = term @ scaled / k
        total = total + term
    for _ in range(halvings):
        total = total @ total
    result: FloatArray = total / total.sum(axis=1, keepdims=True)
    return result


def stationary(generator: FloatArray) -> FloatArray:
    """p with p G = 0."""
    equations = generator.T.copy()
    equations[-1] = 1.0
    result: FloatArray = np.linalg.solve(equations, np.eye(len(generator))[-1])
    return result


def _star(faults: list[tuple[float, float]]) -> FloatArray:
    G = np.zeros((len(faults) + 1, len(faults) + 1))
    for mode, (rate, duration) in enumerate(faults, start=1):
        G[0, mode], G[mode, 0] = rate, 1 / duration
    result: FloatArray = G - np.diag(G.sum(axis=1))
    return result


Modes = npt.NDArray[np.int8]
