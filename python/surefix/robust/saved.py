"""Saved robust filters, checked before anything is restored. The engine checks the sizes of the
mixture; what could poison it in silence is checked here."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from surefix import _core
from surefix.core import checks
from surefix.core.sensor import Sensor
from surefix.desync import saved as shared
from surefix.errors import ConfigError, ShapeError

KEYS = (
    "components", "mode", "last", "time", "first", "mass", "oldest", "started", "counters",
    "waiting", "pushes", "settings",
)  # fmt: skip


def checked(
    saved: Mapping[str, Any],
    expected: Mapping[str, Any],
    sensors: Sequence[Sensor],
    capacity: int,
) -> dict[str, Any]:
    """``saved`` in the form that the engine takes, or an error that names what is wrong."""
    if not isinstance(saved, Mapping):
        raise ConfigError(f"saved: expected a mapping, got {type(saved).__name__}")
    for key in KEYS:
        if key not in saved:
            raise ConfigError(f"saved: missing {key!r}")
    shared.compare(expected, saved["settings"])
    for key in ("started", "first"):
        if not isinstance(saved[key], (bool, np.bool_)):
            raise ConfigError(f"saved {key}: expected True or False, got {saved[key]!r}")
    started, first = bool(saved["started"]), bool(saved["first"])
    time = shared.whole("time", saved["time"], -shared.LATEST, shared.LATEST)
    oldest = shared.whole("oldest", saved["oldest"], -shared.LATEST, shared.LATEST + 1)
    if oldest != (time + (not first) if started else 0) or not (started or first):
        raise ConfigError(
            f"saved time: expected one that fits started, first and oldest {oldest}, got {time}"
        )
    pushes = shared.whole("pushes", saved["pushes"], 0, shared.MOST)
    waiting = shared.waiting(
        saved["waiting"], sensors, capacity, oldest if started else None, pushes
    )
    _usable("waiting value", waiting[2])
    return {
        **{key: saved[key] for key in KEYS},
        "components": _mixture(saved["components"], started),
        "mode": _modes(saved["mode"], whole=expected["carry"] == "one" and not first),
        "last": _last(saved["last"], len(sensors)),
        "mass": _mass(saved["mass"]),
        "time": time,
        "oldest": oldest,
        "first": first,
        "started": started,
        "counters": shared.counters(saved["counters"]),
        "waiting": waiting,
        "pushes": pushes,
    }


def _mixture(value: Any, started: bool) -> dict[str, Any]:
    """Weights that are a distribution, finite means, covariances ≥ 0."""
    if not isinstance(value, Mapping):
        raise ConfigError(f"saved components: expected a mapping, got {type(value).__name__}")
    for key in ("log_weight", "hypothesis", "x", "P"):
        if key not in value:
            raise ConfigError(f"saved components: missing {key!r}")
    log_weight = checks.array("saved log_weight", value["log_weight"], (None,))
    x = checks.array("saved x", value["x"], (len(log_weight), None))
    n = x.shape[1]
    P = checks.array("saved P", value["P"], (len(log_weight), n, n))
    hypothesis = value["hypothesis"]
    if not started and len(log_weight) == 0:  # the engine begins anew, whatever stands there
        log_weight, x, P, hypothesis = np.zeros(1), np.zeros((1, n)), np.zeros((1, n, n)), [0]
    if not abs(np.exp(log_weight).sum() - 1) < 1e-9:
        raise ConfigError("saved log_weight: expected weights that sum to 1")
    for i, covariance in enumerate(P):
        checks.covariance(f"saved P {i}", covariance, n)
    return {"log_weight": log_weight, "hypothesis": hypothesis, "x": x, "P": P}


def _modes(value: Any, *, whole: bool) -> list[float]:
    """Probabilities of the hypotheses, of which there are as many as the engine says."""
    mode = checks.array("saved mode", value, (None,))
    if (mode < 0).any() or (whole and not abs(mode.sum() - 1) < 1e-9):
        raise ConfigError("saved mode: expected probabilities that sum to 1")
    return list(mode.tolist())


def _last(value: Any, count: int) -> tuple[list[bool], list[float]]:
    """Whether every sensor's last value is known, and the values."""
    if not isinstance(value, (tuple, list)) or len(value) != 2:
        raise ShapeError(f"saved last: expected 2 entries, got {value!r}")
    known, values = value
    flags = isinstance(known, (tuple, list)) and all(isinstance(k, (bool, np.bool_)) for k in known)
    if not flags or len(known) != count:
        raise ShapeError(f"saved last: expected True or False {count} times, got {known!r}")
    numbers = checks.array("saved last", values, (count,)).tolist()
    _usable("last", numbers)
    return [bool(k) for k in known], numbers


def _mass(value: Any) -> tuple[float, ...]:
    """Two masses cut off, and the log-likelihood."""
    mass = checks.array("saved mass", value, (3,))
    if (mass[:2] < 0).any():
        raise ConfigError(f"saved mass: expected numbers >= 0, got {mass[:2].tolist()}")
    return tuple(mass.tolist())


def _usable(name: str, values: Sequence[float]) -> None:
    for value in values:
        if abs(value) > _core.LARGEST_VALUE:
            raise ConfigError(
                f"saved {name}: expected at most {_core.LARGEST_VALUE:g} in magnitude, got {value}"
            )
