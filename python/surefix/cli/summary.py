"""What a run found, as one dictionary: counts, rates, noise per sensor, errors to a reference."""

from __future__ import annotations

import platform
from typing import Any

import numpy as np
import numpy.typing as npt

from surefix import __version__, _core
from surefix.config import Config
from surefix.core.checks import FloatArray
from surefix.core.distributions import two_sided_quantile
from surefix.desync.result import Result
from surefix.tables import Columns

RISKS = (0.1, 0.01, 1e-3, 1e-7, 1e-11)
"""Claimed risks at which intervals are compared with a reference."""


def summarise(
    result: Result, config: Config, reference: tuple[FloatArray, FloatArray] | None
) -> dict[str, Any]:
    """The summary of a run. Times in seconds, rates in hertz, the rest in the output's unit."""
    log, output = result.log, config.output
    flagged = result.flagged(output.false_alarm)
    used = np.isfinite(result.noise)
    time = log.time[np.isfinite(log.time)]
    duration = float(time.max() - time.min()) if len(time) else 0.0
    p_value = result.p_value[np.isfinite(result.p_value)]
    level = output.false_alarm / max(len(p_value), 1)
    sensors = {}
    for code, name in enumerate(log.names):
        rows = log.code == code
        noise = result.normalised_noise[rows & used]
        sensors[name] = {
            "rows": int(rows.sum()),
            "used": len(noise),
            "rate_hz": len(noise) / duration if duration > 0 else None,
            "rms_normalised_noise": _rms(noise),
            "flagged": int((rows & flagged).sum()),
        }
    summary: dict[str, Any] = {
        "versions": {
            "surefix": __version__, "python": platform.python_version(), "numpy": np.__version__,
        },
        "rows": len(log),
        "counts": result.counts,
        "duration_s": duration,
        "estimates": len(result.time),
        "rate_hz": output.rate,
        "risk": result.risk,
        "mean_sigma": float(result.sigma.mean()) if len(result.time) else None,
        "noise": output.noise,
        "log_likelihood": result.log_likelihood,
        "false_alarm": output.false_alarm,
        "flagged": int(flagged.sum()),
        "flagged_beyond": two_sided_quantile(
            max(output.false_alarm / max(int(used.sum()), 1), 1e-15)
        ),
        "steps": {"p_value_below": level, "count": int((p_value < level).sum())},
        "sensors": sensors,
    }  # fmt: skip
    if reference is not None:
        summary["reference"] = compare(result, reference)
    return summary


def compare(
    result: Result,
    reference: tuple[FloatArray, FloatArray],
    mask: npt.NDArray[np.bool_] | None = None,
) -> dict[str, Any]:
    """Errors to the reference, interpolated linearly, of the estimates in ``mask`` (T,); those
    beyond the ends of the reference are left out."""
    truth = np.interp(result.time, *reference, left=np.nan, right=np.nan)
    there = np.isfinite(truth) & (True if mask is None else mask)
    if not there.any():
        return {"compared": 0}
    error = (result.estimate - truth)[there]
    claims = []
    for risk in RISKS:
        lower, upper = result.interval(risk)
        claims.append({
            "risk": risk,
            "share_outside": float(((truth < lower) | (truth > upper))[there].mean()),
            "mean_width": float((upper - lower)[there].mean()),
        })  # fmt: skip
    return {
        "compared": int(there.sum()),
        "mean_absolute_error": float(np.abs(error).mean()),
        "rms_error": _rms(error),
        "max_error": float(np.abs(error).max()),
        "claims": claims,
    }


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
