"""Sensors as they are: noise, latency, a scale factor that is not quite one, a wandering bias."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from surefix import _core
from surefix.core import checks
from surefix.core.fault import FaultMode
from surefix.core.models import Model
from surefix.errors import ConfigError


@dataclass(frozen=True)
class Sensor:
    """One sensor: z(t + latency) = (1 + s) h x(t) + b + v.

    ``sigma``: standard deviation of the white noise v [unit of the reading].
    ``latency``: a reading belongs to the time of its stamp minus this [s]; may be negative.
    ``scale_sigma``, ``scale_time``: standard deviation and time constant [s] of the relative
    scale-factor error s; a constant with the default ``inf``.
    ``bias_sigma``, ``bias_time``: the same of the bias b [unit of the reading].
    ``observes``: h, what it reads of the model's state; by default the speed (the first state of a
    general model).
    ``faults``: what can be wrong with it, for ``RobustFilter``: Outage, Frozen, Drifting, Noisy,
    Interrupted.

    s and b are first-order Gauss–Markov processes. Each becomes an extra state of the filter,
    named ``<sensor>.scale`` or ``<sensor>.bias``, if its sigma is above zero. Raises ConfigError
    for a sigma that is negative, infinite or has no variance (1.5e-154 is the smallest that has),
    a time constant ≤ 0, an empty name.
    """

    name: str
    sigma: float
    scale_sigma: float = 0.0
    scale_time: float = math.inf
    bias_sigma: float = 0.0
    bias_time: float = math.inf
    latency: float = 0.0
    observes: tuple[float, ...] | None = None
    faults: tuple[FaultMode, ...] = ()

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name:
            raise ConfigError(f"sensor name: expected a text, got {self.name!r}")
        where = f"sensor {self.name!r}, "
        self._check(where, "sigma", checks.deviation)
        for name in ("scale_sigma", "bias_sigma"):
            self._check(where, name, checks.not_negative)
            if getattr(self, name) > 0:
                self._check(where, name, checks.deviation)
        for name in ("scale_time", "bias_time"):
            self._check(where, name, checks.time_constant)
        self._check(where, "latency", checks.number)
        checks.nanoseconds(where + "latency", self.latency, _core.MAX_LATENCY)
        object.__setattr__(self, "faults", _fault_tuple(where, self.faults))
        if self.observes is not None:
            row = checks.array(where + "observes", self.observes, (None,))
            object.__setattr__(self, "observes", tuple(row.tolist()))

    def _check(self, where: str, name: str, check: Callable[[str, Any], float]) -> None:
        """Puts a field in the form that ``check`` gives it."""
        object.__setattr__(self, name, check(where + name, getattr(self, name)))

    def settings(self) -> dict[str, Any]:
        """All parameters by name, as plain values."""
        observes = None if self.observes is None else list(self.observes)
        faults = [fault.settings() for fault in self.faults]
        return {**asdict(self), "observes": observes, "faults": faults}

    def row(self, model: Model) -> list[float]:
        """h for ``model``."""
        if self.observes is None:
            return [1.0 if i == model.output else 0.0 for i in range(model.size)]
        name = f"sensor {self.name!r}, observes"
        return list(checks.array(name, self.observes, (model.size,)))


def _fault_tuple(where: str, faults: Iterable[FaultMode]) -> tuple[FaultMode, ...]:
    """The fault modes given, at most one of them drifting."""
    given = checks.tuple_of(f"{where}faults", faults, FaultMode, "fault modes")
    labels = [fault.label for fault in given]
    if labels.count("drifting") > 1:
        raise ConfigError(f"{where}faults: expected at most one that drifts, got {labels}")
    return given


def sensor_tuple(sensors: Iterable[Sensor]) -> tuple[Sensor, ...]:
    """The sensors given, checked one by one."""
    return checks.tuple_of("sensors", sensors, Sensor, "Sensor objects")


def make_system(model: Model, sensors: Sequence[Sensor]) -> _core.System:
    """The engine's system of a model and its sensors."""
    if not isinstance(model, Model):
        raise ConfigError(f"model: expected a motion model, got {model!r}")
    sensors = sensor_tuple(sensors)
    names = [sensor.name for sensor in sensors]
    if len(set(names)) != len(names):
        raise ConfigError(f"sensors: expected different names, got {names}")
    if not 1 <= len(sensors) <= _core.MAX_SENSORS:
        raise ConfigError(f"sensors: expected 1 to {_core.MAX_SENSORS}, got {len(sensors)}")

    def column(attribute: str) -> Any:
        return np.array([getattr(sensor, attribute) for sensor in sensors], dtype=np.float64)

    latency = [checks.nanoseconds("latency", s.latency, _core.MAX_LATENCY) for s in sensors]
    return _core.System(
        model.engine,
        np.array([sensor.row(model) for sensor in sensors]),
        column("sigma"),
        np.array(latency, dtype=np.int64),
        column("scale_sigma"),
        column("scale_time"),
        column("bias_sigma"),
        column("bias_time"),
    )


def state_names(model: Model, sensors: Sequence[Sensor]) -> tuple[str, ...]:
    """Names of all states in the engine's order: the model's, then each sensor's scale and bias."""
    names = list(model.state_names)
    for sensor in sensors:
        if sensor.scale_sigma > 0:
            names.append(f"{sensor.name}.scale")
        if sensor.bias_sigma > 0:
            names.append(f"{sensor.name}.bias")
    return tuple(names)
