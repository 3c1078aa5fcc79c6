"""Injected faults of the demo, and what a run made of them."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from surefix.cli.summary import AnyResult, compare
from surefix.core.checks import FloatArray
from surefix.log import Log

RECOVERY = 5.0
"""Seconds after a fault in which the filter still suffers from it."""
NEAREST = 5e-5
"""Seconds by which the stamps of the log and of the faults are rounded."""


class Fault(NamedTuple):
    """From ``start`` to ``end`` [s], equal for a single reading."""

    start: float
    end: float
    sensor: str
    kind: str


def read_faults(path: Path) -> list[Fault]:
    """The list of faults, with columns start_s, end_s, sensor, kind."""
    with path.open(encoding="utf-8", newline="") as file:
        return [
            Fault(float(row["start_s"]), float(row["end_s"]), row["sensor"], row["kind"])
            for row in csv.DictReader(file)
        ]


def split_by_faults(
    result: AnyResult,
    truth: tuple[FloatArray, FloatArray],
    faults: list[Fault],
    latency: Mapping[str, float],
) -> dict[str, Any]:
    """Errors of the estimates with no fault, during one, and within ``RECOVERY`` s after one.

    A fault counts from the time at which its readings were valid, ``latency`` [s] before their
    stamps.
    """
    valid = [
        fault._replace(start=fault.start - early, end=fault.end - early)
        for fault in faults
        for early in [latency.get(fault.sensor, 0.0)]
    ]
    during = _within(result.time, valid, 0.0)
    after = _within(result.time, valid, RECOVERY) & ~during
    parts = {"no_fault": ~during & ~after, "during_a_fault": during, "5_s_after_a_fault": after}
    return {name: compare(result, truth, mask) for name, mask in parts.items()}


def found_faults(log: Log, found: npt.NDArray[np.bool_], faults: list[Fault]) -> dict[str, Any]:
    """What was ``found`` (N,) of every fault, and what else was."""
    at_fault = np.zeros(len(log), np.bool_)
    outliers, periods = [], []
    for fault in faults:
        rows = (log.sensor == fault.sensor) & _inside(log.time, fault, 0.0)
        at_fault |= rows
        hits = log.time[rows & found]
        if fault.end <= fault.start:
            outliers.append(len(hits) > 0)
            continue
        periods.append({
            "sensor": fault.sensor, "kind": fault.kind, "start_s": fault.start, "end_s": fault.end,
            "rows": int(rows.sum()), "found": len(hits),
            "first_found_after_s": float(hits.min() - fault.start) if len(hits) else None,
        })  # fmt: skip
    beside = _within(log.time, faults, RECOVERY)
    return {
        "outliers": {"injected": len(outliers), "found": sum(outliers)},
        "periods": periods,
        "found_beside": int((found & ~at_fault & beside).sum()),
        "found_elsewhere": int((found & ~at_fault & ~beside).sum()),
    }


def _inside(time: FloatArray, fault: Fault, after: float) -> npt.NDArray[np.bool_]:
    return (time >= fault.start - NEAREST) & (time <= fault.end + after + NEAREST)


def _within(time: FloatArray, faults: list[Fault], after: float) -> npt.NDArray[np.bool_]:
    inside = np.zeros(len(time), np.bool_)
    for fault in faults:
        inside |= _inside(time, fault, after)
    return inside
