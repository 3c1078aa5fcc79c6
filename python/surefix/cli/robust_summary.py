"""What a run of the robust filter found: which sensors it held faulty, for how long, and whether
its limits held."""

from __future__ import annotations

from typing import Any

import numpy as np

from surefix import _core
from surefix.cli.summary import basics, compare
from surefix.config import Config
from surefix.core.checks import FloatArray
from surefix.robust.result import RobustResult
from surefix.tables import Columns


def summarise_robust(
    result: RobustResult, config: Config, reference: tuple[FloatArray, FloatArray] | None
) -> dict[str, Any]:
    """The summary of a run. Times in seconds, rates in hertz, the rest in the output's unit."""
    log, rejected = result.log, result.rejected
    summary = basics(result, config, result.step >= 0)
    lasted = _durations(result)
    for name, sensor in summary["sensors"].items():
        sensor["rejected"] = int((rejected & (log.sensor == name)).sum())
        sensor.update(_held(result, name, lasted) if name in result.sensor_names else {})
    width = (result.upper - result.lower)[np.isfinite(result.upper - result.lower)]
    summary |= {
        "rejected": int(rejected.sum()),
        "available_share": float(result.available.mean()) if len(result.time) else None,
        "mean_width": float(width.mean()) if len(width) else None,
        "largest_width": float(width.max()) if len(width) else None,
        "largest_discarded_mass": float(result.discarded_mass.max(initial=0.0)),
    }
    if reference is not None:
        summary["reference"] = compare(result, reference)
    return summary


def robust_event_table(result: RobustResult) -> Columns:
    """Rows that were not used, with their status, and rows that were rejected, with the mode that
    their sensor was held to be in and the probability that it was faulty; in the log's order."""
    log, rejected = result.log, result.rejected
    rows = np.flatnonzero(rejected | (result.status != 0))
    kinds = np.array([*_core.STATUS_NAMES, "rejected"])
    kind = np.where(rejected[rows], len(_core.STATUS_NAMES), result.status[rows])
    modes = np.full(len(rows), "", dtype=object)
    probability = np.full(len(rows), np.nan)
    for s, name in enumerate(result.sensor_names):
        at = np.flatnonzero(rejected[rows] & (log.sensor[rows] == name))
        step = result.step[rows[at]]
        modes[at] = np.array(result.mode_names[s])[result.hypothesis[step, s]]
        probability[at] = result.fault_probability[step, s]
    if len(result.outlier_probability):  # hypotheses per measurement
        modes[rejected[rows]] = "outage"
        probability = np.where(rejected[rows], result.outlier_probability[rows], np.nan)
    return {
        "time_s": log.time[rows],
        "sensor": log.sensor[rows],
        "value": log.value[rows],
        "event": kinds[kind],
        "mode": modes,
        "fault_probability": probability,
    }


def _durations(result: RobustResult) -> FloatArray:
    """How long every step lasted (T,) [s]; the first, from the first measurement."""
    used = result.log.time[result.step == 0]
    first = used.min(initial=result.time[0]) if len(result.time) else 0.0
    lasted: FloatArray = np.diff(result.time, prepend=first)
    return lasted


def _held(result: RobustResult, name: str, lasted: FloatArray) -> dict[str, Any]:
    """How long the sensor was in which mode, under the most probable hypothesis [s]."""
    s = result.sensor_names.index(name)
    mode = result.hypothesis[:, s]
    modes = {
        label: float(lasted[mode == m].sum())
        for m, label in enumerate(result.mode_names[s][1:], start=1)
    }
    return {"held_faulty_s": sum(modes.values()), "modes_s": modes}
