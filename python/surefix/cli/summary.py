"""What a run found, as one dictionary: counts, rates, noise per sensor, errors to a reference.
Of the robust filter see ``robust_summary``."""

from __future__ import annotations

import platform
from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from surefix import __version__, _core
from surefix.config import Config
from surefix.core.checks import FloatArray
from surefix.desync.result import Result
from surefix.robust.result import RobustResult
from surefix.tables import Columns

AnyResult = Result | RobustResult

RISKS = (0.1, 0.01, 1e-3, 1e-7, 1e-11)
"""Claimed risks at which intervals are compared with a reference."""


def summarise(
    result: Result, config: Config, reference: tuple[FloatArray, FloatArray] | None
) -> dict[str, Any]:
    """The summary of a run. Times in seconds, rates in hertz, the rest in the output's unit."""
    log, output = result.log, config.output
    flagged = result.flagged(output.false_alarm)
    used = np.isfinite(result.noise)
    p_value = result.p_value[np.isfinite(result.p_value)]
    level = output.false_alarm / max(len(p_value), 1)
    summary = basics(result, config, used)
    for name, sensor in summary["sensors"].items():
        rows = log.sensor == name
        sensor["rms_normalised_noise"] = _rms(result.normalised_noise[rows & used])
        sensor["flagged"] = int((rows & flagged).sum())
    summary |= {
        "noise": output.noise,
        "false_alarm": output.false_alarm,
        "flagged": int(flagged.sum()),
        "flagged_beyond": result.flagged_beyond(output.false_alarm),
        "steps": {"p_value_below": level, "count": int((p_value < level).sum())},
    }
    if reference is not None:
        summary["reference"] = compare(result, reference)
    return summary


def basics(result: AnyResult, config: Config, used: npt.NDArray[np.bool_]) -> dict[str, Any]:
    """What summaries of all filters have. ``used`` (N,): rows that the filter used."""
    log = result.log
    time = log.time[np.isfinite(log.time)]
    duration = float(time.max() - time.min()) if len(time) else 0.0
    sensors = {}
    silent = [sensor.name for sensor in config.sensors if sensor.name not in log.names]
    for code, name in enumerate([*log.names, *silent]):
        rows = log.code == code
        count = int((rows & used).sum())
        sensors[name] = {
            "rows": int(rows.sum()),
            "used": count,
            "rate_hz": count / duration if duration > 0 else None,
        }
    return {
        "versions": {
            "surefix": __version__, "python": platform.python_version(), "numpy": np.__version__,
        },
        "rows": len(log),
        "counts": result.counts,
        "duration_s": duration,
        "estimates": len(result.time),
        "rate_hz": config.output.rate,
        "risk": result.risk,
        "mean_sigma": float(result.sigma.mean()) if len(result.time) else None,
        "log_likelihood": result.log_likelihood,
        "sensors": sensors,
    }  # fmt: skip


def compare(
    result: AnyResult,
    reference: tuple[FloatArray, FloatArray],
    mask: npt.NDArray[np.bool_] | None = None,
) -> dict[str, Any]:
    """Errors to the reference, interpolated linearly, of the estimates in ``mask`` (T,); those
    beyond the ends of the reference are left out. A width is the mean of those that are finite."""
    truth = np.interp(result.time, *reference, left=np.nan, right=np.nan)
    there = np.isfinite(truth) & (True if mask is None else mask)
    if not there.any():
        return {"compared": 0}
    error = (result.estimate - truth)[there]
    claims = []
    for risk, lower, upper in _claimed(result):
        width = (upper - lower)[there]
        width = width[np.isfinite(width)]
        claims.append({
            "risk": risk,
            "share_outside": float(((truth < lower) | (truth > upper))[there].mean()),
            "mean_width": float(width.mean()) if len(width) else None,
        })  # fmt: skip
    return {
        "compared": int(there.sum()),
        "mean_absolute_error": float(np.abs(error).mean()),
        "rms_error": _rms(error),
        "max_error": float(np.abs(error).max()),
        "claims": claims,
    }


def _claimed(result: AnyResult) -> Iterator[tuple[float, FloatArray, FloatArray]]:
    """Risks with their limits: any, of a Gaussian; of a mixture, the one that was asked for."""
    if isinstance(result, RobustResult):
        yield result.risk, result.lower, result.upper
        return
    for risk in RISKS:
        yield risk, *result.interval(risk)


def event_table(result: Result, false_alarm: float) -> Columns:
    """Rows that were not used, with their status, and rows that were flagged; in the log's
    order."""
    log = result.log
    flagged = result.flagged(false_alarm)
    rows = np.flatnonzero(flagged | (result.status != 0))
    kinds = np.array([*_core.STATUS_NAMES, "flagged"])
    kind = np.where(flagged[rows], len(_core.STATUS_NAMES), result.status[rows])
    return {
        "time_s": log.time[rows],
        "sensor": log.sensor[rows],
        "value": log.value[rows],
        "event": kinds[kind],
        "normalised_noise": result.normalised_noise[rows],
    }


def _rms(values: FloatArray) -> float | None:
    return float(np.sqrt(np.mean(values**2))) if len(values) else None
