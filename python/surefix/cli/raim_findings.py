"""What ``surefix raim`` found, as one dictionary."""

from __future__ import annotations

import platform
from collections import Counter
from typing import Any

import numpy as np

from surefix import __version__
from surefix.cli.raim_monitored import Monitored
from surefix.cli.raim_warnings import warnings
from surefix.core.checks import FloatArray
from surefix.raim.availability import AvailabilityMap
from surefix.raim.monitor import TrackRaim
from surefix.raim.result import BoolArray
from surefix.stanford import regions

SETTINGS = (
    "length", "false_alarm", "missed", "risk", "fault_probability", "max_faults", "max_excluded",
    "interval", "max_speed", "earth_rotation",
)  # fmt: skip


def summarise(monitored: Monitored) -> dict[str, Any]:
    """Everything as plain values: seconds, metres, shares of all epochs unless another is named."""
    result, inputs = monitored.result, monitored.inputs
    data, track = result.data, inputs.track
    seen = np.bincount(data.epoch[monitored.seen], minlength=data.epochs)
    found = {
        "versions": {
            "surefix": __version__, "python": platform.python_version(), "numpy": np.__version__,
        },
        "settings": settings(monitored),
        "rows": len(data.time),
        "rows_not_finite": int((~monitored.finite).sum()),
        "rows_below_mask": int((monitored.finite & ~monitored.seen).sum()),
        "epochs": data.epochs,
        "duration_s": float(result.time[-1] - result.time[0]),
        "track": {
            "length_m": track.length, "vertex_error_m": track.error,
            "edge_error_m": track.edge_error,
        },
        "satellites": {
            "least": int(seen.min()), "median": float(np.median(seen)), "most": int(seen.max()),
        },
        "counts": result.counts,
        "alarms": _alarms(monitored),
        "excluded": _excluded(monitored),
        "availability": {
            "position": float(result.usable.mean()),
            "without_e1": float((result.usable & result.available).mean()),
            "with_e1": float((result.usable & result.available_with_e1).mean()),
        },
        "sigma_m": levels(result.sigma[result.usable]),
        "protection_m": levels(result.protection[result.usable]),
        "protection_chi2_m": levels(result.protection_chi2[result.usable]),
    }  # fmt: skip
    found["warnings"] = warnings(monitored)
    if inputs.truth is not None:
        found["errors"] = _errors(monitored, inputs.truth.along, inputs.truth.beside)
    return found


def settings(monitored: Monitored) -> dict[str, Any]:
    """What the claims rest on."""
    read, monitor = monitored.inputs.config.pseudoranges, monitored.monitor
    return {
        **{name: getattr(monitor, name) for name in SETTINGS},
        "near": monitored.inputs.config.monitor.near,
        "sigma": read.sigma,
        "sigma_zenith": read.sigma_zenith,
        "elevation_mask": read.elevation_mask,
        "tolerance": monitored.inputs.track.tolerance,
    }


def levels(values: FloatArray) -> dict[str, Any]:
    """The median and what 95 % are at most (None where that is infinite), and how many of how many
    epochs have none."""
    there = values[~np.isnan(values)]
    if len(there) == 0:
        return {"epochs": 0, "median": None, "p95": None, "none": 0}
    median, most = (float(np.quantile(there, q, method="inverted_cdf")) for q in (0.5, 0.95))
    return {
        "epochs": len(there), "median": median if np.isfinite(median) else None,
        "p95": most if np.isfinite(most) else None, "none": int(np.isinf(there).sum()),
    }  # fmt: skip


def found_on_map(availability: AvailabilityMap, monitor: TrackRaim, time: float) -> dict[str, Any]:
    """What the map says, with the satellites of the epoch at ``time`` [s]."""
    return {
        "time_s": time,
        "places": len(availability.along),
        "without_e1": availability.share,
        "with_e1": availability.share_with_e1,
        "missed": monitor.missed,
        "not_available": dict(
            Counter(str(s) for s in availability.status if s != "ok").most_common()
        ),
        "protection_m": levels(availability.protection),
        "protection_chi2_m": levels(availability.protection_chi2),
    }


def _alarms(monitored: Monitored) -> dict[str, Any]:
    """Rates are of the epochs that could be tested."""
    result = monitored.result
    tested = result.degrees > 0
    count = int(tested.sum())

    def rate(alarm: BoolArray) -> float | None:
        return float((alarm & tested).sum() / count) if count else None

    return {
        "tested": count,
        "snapshot": int(result.alarm.sum()),
        "snapshot_rate": rate(result.alarm),
        "separation": int(result.separation_alarm.sum()),
        "separation_rate": rate(result.separation_alarm),
        "raised": int(raised(monitored).sum()),
    }


def raised(monitored: Monitored) -> BoolArray:
    """(T,): there was an alarm, or a satellite was excluded."""
    result = monitored.result
    declared = np.isin(result.declared, ("alarm", "excluded"))
    return np.asarray(declared | result.alarm | result.separation_alarm)


def _excluded(monitored: Monitored) -> dict[str, int]:
    """In how many epochs each satellite was, the most frequent first."""
    names = monitored.result.data.satellite[monitored.result.excluded]
    return {str(name): count for name, count in Counter(names.tolist()).most_common()}


def _errors(monitored: Monitored, truth: FloatArray, beside: FloatArray | None) -> dict[str, Any]:
    """Of the positions that may be used; shares are of those compared."""
    result, limit = monitored.result, monitored.monitor.length / 2
    error = np.where(result.usable, result.along - truth, np.nan)
    size = np.abs(error[np.isfinite(error)])
    if len(size) == 0:
        return {"compared": 0}
    parts = regions(error, result.protection, limit)
    chi2 = regions(error, result.protection_chi2, limit)
    return {
        "compared": len(size),
        "rms_m": float(np.sqrt(np.mean(size**2))),
        "median_m": float(np.median(size)),
        "max_m": float(size.max()),
        "truth_off_track_m": None if beside is None else float(np.nanmax(beside)),
        "risk": monitored.monitor.risk,
        "beyond_protection": _beyond(error, result.protection),
        "beyond_protection_chi2": _beyond(error, result.protection_chi2),
        "beyond_half_length": float((size > limit).mean()),
        "stanford": parts.counts,
        "stanford_chi2": chi2.counts,
    }


def _beyond(error: FloatArray, level: FloatArray) -> float | None:
    """Share of the epochs with an error and a level whose error is larger."""
    both = np.isfinite(error) & ~np.isnan(level)
    return float((np.abs(error) > level)[both].mean()) if both.any() else None
