"""What ``RobustFilter`` is asked for, checked before anything is made."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

from surefix import _core
from surefix.core import checks
from surefix.core.sensor import Sensor
from surefix.errors import ConfigError

PRIORS = {"constant": 0, "chains": 1}


def hypotheses(sensors: Sequence[Sensor], max_faults: int) -> int:
    """How many there are, with at most ``max_faults`` faulty sensors at once."""
    counts = [len(sensor.faults) for sensor in sensors]
    for sensor in sensors:
        if len(sensor.faults) >= _core.MAX_MODES:
            raise ConfigError(
                f"sensor {sensor.name!r}, faults: expected at most {_core.MAX_MODES - 1}, "
                f"got {len(sensor.faults)}"
            )
    total = sum(
        math.prod(chosen)
        for size in range(max_faults + 1)
        for chosen in itertools.combinations(counts, size)
    )
    if total > _core.MAX_HYPOTHESES:
        raise ConfigError(
            f"sensors: their modes make {total} hypotheses, expected at most "
            f"{_core.MAX_HYPOTHESES}; max_faults limits them"
        )
    return total


def prior(sensors: Sequence[Sensor], wanted: str | None) -> str:
    """'chains' or 'constant', for which all modes have what it needs."""
    modes = [(s.name, fault) for s in sensors for fault in s.faults]
    chains = all(fault.rate is not None and fault.duration is not None for _, fault in modes)
    if wanted is None:
        wanted = "chains" if chains else "constant"
    name = checks.one_of("prior", wanted, tuple(PRIORS))
    for sensor_name, fault in modes:
        lacks = (
            "rate and duration"
            if name == "chains" and (fault.rate is None or fault.duration is None)
            else "probability"
            if name == "constant" and fault.probability is None
            else None
        )
        if lacks:
            raise ConfigError(
                f"sensor {sensor_name!r}, {fault.label}: prior {name!r} needs {lacks}"
            )
    for sensor in sensors:
        total = sum(fault.probability or 0.0 for fault in sensor.faults)
        if name == "constant" and total >= 1:
            raise ConfigError(
                f"sensor {sensor.name!r}: expected probabilities of its faults that sum to "
                f"less than 1, got {total:g}"
            )
    return name


def memory(sensors: Sequence[Sensor], wanted: float | None) -> float:
    """How long mass that was cut stays in the risk [s]."""
    if wanted is not None:
        return checks.positive("memory", wanted)
    durations = [fault.duration or 0.0 for s in sensors for fault in s.faults]
    return max(durations, default=0.0) or 1.0


def beam(wanted: int, components: int) -> int:
    """Room for hypotheses per measurement."""
    beam = checks.whole("beam", wanted, 8, 1 << 16)
    if beam % 4 or beam < 2 * (components + 3):
        raise ConfigError(
            "beam: expected a multiple of 4, at least twice the components and 6, "
            f"{2 * components + 6}, got {beam}"
        )
    return beam


def outages(sensors: Sequence[Sensor], prior: str | None) -> str:
    """'constant', the prior of hypotheses per measurement, which know no fault but an Outage with a
    probability."""
    if prior not in (None, "constant"):
        raise ConfigError(f"hypotheses: 'measurement' needs prior 'constant', got {prior!r}")
    for sensor in sensors:
        labels = [fault.label for fault in sensor.faults]
        if labels not in ([], ["outage"]):
            raise ConfigError(
                "hypotheses: 'measurement' knows no fault but an Outage; "
                f"sensor {sensor.name!r} has {', '.join(labels)}"
            )
        for fault in sensor.faults:
            if fault.probability is None:
                raise ConfigError(
                    "hypotheses: 'measurement' needs the probability of an Outage; that of sensor "
                    f"{sensor.name!r} has none"
                )
    return "constant"
