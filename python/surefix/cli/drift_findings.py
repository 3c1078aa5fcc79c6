"""What ``surefix drift`` found, as one dictionary."""

from __future__ import annotations

import dataclasses
import platform
from typing import Any

import numpy as np

from surefix import __version__
from surefix.cli.drift_search import Search
from surefix.cli.drift_whiteness import warnings, whiteness
from surefix.drift.diagnosis import Diagnosis
from surefix.drift.fault import Fault
from surefix.drift.searched import Searched

CLOSE = 6.0
"""Difference of scores below which the odds between two explanations are less than 20."""


def summarise(search: Search) -> dict[str, Any]:
    """Everything as plain values: seconds, hertz, the sensors' units."""
    diagnosis, drift, log = search.diagnosis, search.config.drift, search.log
    time = search.before.time[np.isfinite(search.before.time)]
    cut = None if drift.frequencies or search.frequencies is None else float(search.frequencies[-1])
    before, after = whiteness(search.before, log), whiteness(search.after, log)
    return {
        "versions": {
            "surefix": __version__, "python": platform.python_version(), "numpy": np.__version__,
        },
        "rows": len(log),
        "counts": search.counts,
        "duration_s": float(time.max() - time.min()) if len(time) else 0.0,
        "settings": {**dataclasses.asdict(drift), "highest_frequency_hz": cut},
        "detected": diagnosis.detected,
        "faults": [_fault(search, k) for k in range(len(diagnosis.faults))],
        "before": dataclasses.asdict(diagnosis.before) | {"sensors": before},
        "after": dataclasses.asdict(diagnosis.after) | {"sensors": after},
        "warnings": warnings(diagnosis, after, drift.max_faults, cut),
        "searched": [_searched(searched) for searched in diagnosis.searched],
        "repaired": None,
    }  # fmt: skip


def _fault(search: Search, k: int) -> dict[str, Any]:
    fault: Fault = search.diagnosis.faults[k]
    unit = search.units[fault.channel]
    per_time = fault.kind.startswith("ramp")
    return {
        "sensor": fault.channel, "kind": fault.kind, "since_s": fault.onset, "until_s": fault.end,
        "frequency_hz": fault.frequency, "phase_rad": fault.phase,
        "phase_at_s": None if fault.frequency is None else fault.origin,
        "amplitude": fault.amplitude, "amplitude_se": fault.amplitude_se,
        "unit": ("m/s²" if unit == "m/s" else f"{unit}/s") if per_time else unit,
        "drop": fault.drop, "p_value": fault.p_value, "score": fault.score,
        "runner_up": _explanation(fault.runner_up), "as_likely": _rivals(search.diagnosis, k),
    }  # fmt: skip


def _rivals(diagnosis: Diagnosis, k: int) -> list[dict[str, Any]]:
    """Other explanations whose score is ``CLOSE``: all of them for the first fault, of the others
    the runner-up is known."""
    fault = diagnosis.faults[k]
    known = {} if fault.runner_up is None else {fault.runner_up[:2]: fault.runner_up[2]}
    if k == 0:
        known = {(s.channel, s.kind): s.score for s in diagnosis.searched if s.score is not None}
    known.pop((fault.channel, fault.kind), None)
    close = [(*what, score) for what, score in known.items() if score > fault.score - CLOSE]
    named = [_explanation(one) for one in sorted(close, key=lambda one: -one[2])]
    return [one for one in named if one is not None]


def _explanation(one: tuple[str, str, float] | None) -> dict[str, Any] | None:
    return None if one is None else dict(zip(("sensor", "kind", "score"), one, strict=True))


def _searched(one: Searched) -> dict[str, Any]:
    return {
        "sensor": one.channel, "kind": one.kind, "status": one.status, "reason": one.reason or None,
        "drop": one.drop, "p_value": one.p_value, "score": one.score, "since_s": one.onset,
        "frequency_hz": one.frequency,
    }  # fmt: skip
