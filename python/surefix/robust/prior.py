"""Faults that several sensors share: one Markov chain of all hypotheses."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from surefix.core import checks
from surefix.core.sensor import Sensor
from surefix.errors import ConfigError


@dataclass(frozen=True)
class CommonFault:
    """An event that puts several sensors into fault modes at once.

    ``modes``: from sensor name to the label of its mode, for example ``{"gps": "outage"}``;
    ``rate`` of the event [1/s]. Sensors that are faulty already stay as they are.
    """

    modes: Mapping[str, str]
    rate: float

    def __post_init__(self) -> None:
        if not isinstance(self.modes, Mapping) or not self.modes:
            raise ConfigError(f"common fault, modes: expected sensors, got {self.modes!r}")
        object.__setattr__(self, "modes", dict(self.modes))
        object.__setattr__(self, "rate", checks.positive("common fault, rate", self.rate))

    def settings(self) -> dict[str, Any]:
        """All parameters by name, as plain values."""
        return {"modes": dict(self.modes), "rate": self.rate}


def common_tuple(common: Iterable[CommonFault]) -> tuple[CommonFault, ...]:
    """The common faults given, checked one by one."""
    return checks.tuple_of("common", common, CommonFault, "CommonFault objects")


def joint_rates(sensors: Sequence[Sensor], common: Sequence[CommonFault]) -> list[float]:
    """Rates (R·R,) [1/s] between the R combinations of the sensors' modes, row by row, from each
    sensor's own chain and the common events."""
    table = list(itertools.product(*(range(1 + len(s.faults)) for s in sensors)))
    if len(table) > 256:
        raise ConfigError(f"common: expected at most 256 hypotheses with it, got {len(table)}")
    place = {modes: i for i, modes in enumerate(table)}
    rates = np.zeros((len(table), len(table)))
    events = [_targets(sensors, fault) for fault in common]
    for modes, a in place.items():
        for s, sensor in enumerate(sensors):
            for m, fault in enumerate(sensor.faults, start=1):
                assert fault.rate is not None
                assert fault.duration is not None
                if modes[s] == 0:
                    rates[a, place[(*modes[:s], m, *modes[s + 1 :])]] += fault.rate
                elif modes[s] == m:
                    rates[a, place[(*modes[:s], 0, *modes[s + 1 :])]] += 1 / fault.duration
        for event, shared in zip(events, common, strict=True):
            target = tuple(event.get(s, m) if m == 0 else m for s, m in enumerate(modes))
            if target != modes:
                rates[a, place[target]] += shared.rate
    return list(rates.ravel())


def _targets(sensors: Sequence[Sensor], fault: CommonFault) -> dict[int, int]:
    """From index of a sensor to the index of its mode."""
    names = [sensor.name for sensor in sensors]
    targets = {}
    for name, label in fault.modes.items():
        if name not in names:
            raise ConfigError(f"common fault: no sensor {name!r}; there are {names}")
        labels = [f.label for f in sensors[names.index(name)].faults]
        if label not in labels:
            raise ConfigError(f"common fault: sensor {name!r} has no mode {label!r}, but {labels}")
        if labels.count(label) > 1:
            raise ConfigError(
                f"common fault: sensor {name!r} has several modes {label!r}: {labels}"
            )
        targets[names.index(name)] = 1 + labels.index(label)
    return targets
