"""Saved filters, checked before anything is restored: a file may have been cut or edited, or belong
to another filter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from surefix import _core
from surefix.core import checks
from surefix.core.models import Model
from surefix.core.sensor import Sensor, state_names
from surefix.errors import ConfigError, ShapeError
from surefix.tables import flattened

KEYS = ("x", "P", "time", "oldest", "started", "likelihood", "counters", "waiting", "pushes")

LATEST = int(_core.MAX_SECONDS) * 10**9  # ns
MOST = 2**62  # of what is counted: half of what the engine holds, so that counting can go on


def settings(model: Model, sensors: Sequence[Sensor]) -> dict[str, Any]:
    """What a saved state belongs to, as plain values."""
    return {"model": model.settings(), "sensors": [sensor.settings() for sensor in sensors]}


def checked(
    saved: Mapping[str, Any], model: Model, sensors: Sequence[Sensor], capacity: int
) -> dict[str, Any]:
    """``saved`` in the form that the engine takes, or an error that names what is wrong."""
    if not isinstance(saved, Mapping):
        raise ConfigError(f"saved: expected a mapping, got {type(saved).__name__}")
    states = state_names(model, sensors)
    for key in (*KEYS, "states", "model", "sensors"):
        if key not in saved:
            raise ConfigError(f"saved: missing {key!r}")
    if not isinstance(saved["states"], (tuple, list)) or list(saved["states"]) != list(states):
        raise ShapeError(f"saved: expected states {list(states)}, got {saved['states']!r}")
    compare(settings(model, sensors), {key: saved[key] for key in ("model", "sensors")})
    if not isinstance(saved["started"], (bool, np.bool_)):
        raise ConfigError(f"saved started: expected True or False, got {saved['started']!r}")
    n, started = len(states), bool(saved["started"])
    time = whole("time", saved["time"], -LATEST, LATEST)
    oldest = whole("oldest", saved["oldest"], time, time + 1)  # start, or just after the last step
    pushes = whole("pushes", saved["pushes"], 0, MOST)
    return {
        "x": checks.array("saved x", saved["x"], (n,)),
        "P": checks.covariance("saved P", saved["P"], n),
        "time": time,
        "oldest": oldest,
        "started": started,
        "likelihood": _likelihood(saved["likelihood"]),
        "counters": counters(saved["counters"]),
        "waiting": waiting(
            saved["waiting"], sensors, capacity, oldest if started else None, pushes
        ),
        "pushes": pushes,
    }


def compare(expected: Mapping[str, Any], found: Mapping[str, Any]) -> None:
    """Names the first setting in which two filters differ."""
    ours, theirs = flattened(expected), flattened(found)
    for name in (*ours, *theirs):
        want, got = (f"{side[name]!r}" if name in side else "nothing" for side in (ours, theirs))
        plain = name in theirs and isinstance(theirs[name], (str, int, float, type(None)))
        if name not in ours or not plain or ours[name] != theirs[name]:
            raise ConfigError(f"saved {name}: expected {want}, got {got}")


def _likelihood(value: Any) -> tuple[float, int, float, int]:
    product, exponent, squares, count = _parts("likelihood", value, 4)
    return (
        checks.positive("saved likelihood", product),
        whole("likelihood", exponent, -MOST, MOST),
        checks.not_negative("saved likelihood", squares),
        whole("likelihood", count, 0, MOST),
    )


def counters(value: Any) -> tuple[int, ...]:
    counts = _parts("counters", value, len(_core.STATUS_NAMES))
    return tuple(whole("counters", count, 0, MOST) for count in counts)


def waiting(
    value: Any, sensors: Sequence[Sensor], capacity: int, oldest: int | None, pushes: int
) -> tuple[list[Any], ...]:
    """Valid times [ns], indices of sensors, values, numbers of push and factors of the sensors'
    standard deviations, each (waiting,)."""
    columns = [_parts("waiting", part) for part in _parts("waiting", value, 5)]
    if len({len(column) for column in columns}) != 1:
        raise ShapeError(f"saved waiting: expected lists of one length, got {value!r}")
    if len(columns[0]) > capacity:
        raise ConfigError(f"saved: more measurements wait than capacity {capacity} holds")
    rows = []
    for valid, sensor, reading, number, factor in zip(*columns, strict=True):
        which = whole("waiting sensor", sensor, 0, len(sensors) - 1)
        latency = checks.nanoseconds("latency", sensors[which].latency)
        earliest = -LATEST - latency if oldest is None else oldest
        rows.append((
            whole("waiting time", valid, earliest, LATEST - latency),
            which,
            checks.number("saved waiting value", reading),
            whole("waiting number", number, 0, pushes - 1),
            _factor(factor),
        ))  # fmt: skip
    return (
        tuple(list(column) for column in zip(*rows, strict=True)) if rows else ([], [], [], [], [])
    )


def _factor(value: Any) -> float:
    """Of a sensor's standard deviation, as the engine takes it."""
    low, high = _core.SIGMA_FACTORS
    factor = checks.number("saved waiting factor", value)
    if not low <= factor <= high:
        raise ConfigError(
            f"saved waiting factor: expected a number from {low:g} to {high:g}, got {factor:g}"
        )
    return factor


def whole(name: str, value: Any, smallest: int, largest: int) -> int:
    return checks.whole(f"saved {name}", value, smallest, largest)


def _parts(name: str, value: Any, count: int | None = None) -> Sequence[Any]:
    if not isinstance(value, (tuple, list)) or count not in (None, len(value)):
        wanted = "a list" if count is None else f"{count} entries"
        raise ShapeError(f"saved {name}: expected {wanted}, got {value!r}")
    return value
