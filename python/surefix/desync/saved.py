"""Saved filters, checked before anything is restored: a file may have been cut or edited."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from surefix import _core
from surefix.core import checks
from surefix.errors import ConfigError, ShapeError

KEYS = ("x", "P", "time", "oldest", "started", "likelihood", "counters", "waiting", "pushes")


def checked(
    saved: Mapping[str, Any], states: Sequence[str], sensors: int, capacity: int
) -> dict[str, Any]:
    """``saved`` in the form that the engine takes, or an error that names what is wrong."""
    for key in (*KEYS, "states"):
        if key not in saved:
            raise ConfigError(f"saved: missing {key!r}")
    if tuple(saved["states"]) != tuple(states):
        found = list(saved["states"])
        raise ShapeError(f"saved: expected states {list(states)}, got {found}")
    n = len(states)
    return {
        "x": checks.array("saved x", saved["x"], (n,)),
        "P": checks.covariance("saved P", saved["P"], n),
        "time": _whole("time", saved["time"]),
        "oldest": _whole("oldest", saved["oldest"]),
        "started": bool(saved["started"]),
        "likelihood": _likelihood(saved["likelihood"]),
        "counters": _counters(saved["counters"]),
        "waiting": _waiting(saved["waiting"], sensors, capacity),
        "pushes": _whole("pushes", saved["pushes"]),
    }


def _whole(name: str, value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)):
        raise ConfigError(f"saved {name}: expected a whole number, got {value!r}")
    return int(value)


def _likelihood(value: Any) -> tuple[float, int, float, int]:
    product, exponent, squares, count = _parts("likelihood", value, 4)
    if not 0 < product < math.inf or not squares >= 0:
        raise ConfigError(f"saved likelihood: expected positive numbers, got {value!r}")
    return (
        float(product), _whole("likelihood", exponent), float(squares), _whole("likelihood", count)
    )  # fmt: skip


def _counters(value: Any) -> tuple[int, ...]:
    counts = _parts("counters", value, len(_core.STATUS_NAMES))
    return tuple(_whole("counters", count) for count in counts)


def _waiting(value: Any, sensors: int, capacity: int) -> tuple[list[Any], ...]:
    valid, sensor, reading, number = (list(part) for part in _parts("waiting", value, 4))
    if not len(valid) == len(sensor) == len(reading) == len(number):
        raise ShapeError(f"saved waiting: expected lists of one length, got {value!r}")
    if len(valid) > capacity:
        raise ConfigError(f"saved: more measurements wait than capacity {capacity} holds")
    for index in sensor:
        if not 0 <= _whole("waiting sensor", index) < sensors:
            raise ConfigError(f"saved waiting: expected sensors 0 to {sensors - 1}, got {index}")
    return (
        [_whole("waiting time", time) for time in valid],
        [int(index) for index in sensor],
        [checks.number("saved waiting value", entry) for entry in reading],
        [_whole("waiting number", entry) for entry in number],
    )


def _parts(name: str, value: Any, count: int) -> Sequence[Any]:
    if not isinstance(value, (tuple, list)) or len(value) != count:
        raise ShapeError(f"saved {name}: expected {count} entries, got {value!r}")
    return value
