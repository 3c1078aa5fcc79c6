"""What a filter made of a log with a fault in it: are the limits true, are they of use, was the
fault found, were healthy readings rejected?"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from surefix import misleading
from surefix.core.checks import FloatArray
from surefix.core.sensor import Sensor
from surefix.injection.fault import InjectedFault
from surefix.robust.result import RobustResult

KMH = 1 / 3.6  # m/s
GOOD = 0.5  # m/s; a reading further from the reference is not good
FOUND = 0.5  # fault probability from which on a sensor is held faulty

Truth = Callable[[FloatArray], FloatArray]


def odometry_tolerance(speed: FloatArray) -> FloatArray:
    """What ETCS allows an odometer to be wrong by at a speed [m/s]: 2 km/h below 30 km/h, rising
    linearly to 12 km/h at 500 km/h (UNISIG SUBSET-041)."""
    above = np.clip(np.abs(speed) / KMH - 30.0, 0.0, None)
    return KMH * (2.0 + above * 10.0 / 470.0)


def limits(result: RobustResult, truth: Truth, window: tuple[float, float]) -> dict[str, Any]:
    """One run at one risk; see ``misleading.judge``. ``within_2kmh`` and ``within_etcs``: where
    both limits are no further from the estimate than 2 km/h, than ``odometry_tolerance``."""
    found = misleading.judge(result, truth, window)
    shown = misleading.within(result, window)
    estimate = result.estimate[shown]
    reach = np.maximum(result.upper[shown] - estimate, estimate - result.lower[shown])
    error = truth(result.time[shown]) - estimate
    side = np.where(error >= 0, result.upper[shown] - estimate, estimate - result.lower[shown])
    return {
        **found,
        "within_2kmh": reach <= 2.0 * KMH,
        "within_etcs": reach <= odometry_tolerance(estimate),
        "error_of_estimate": np.abs(error),
        "limit": side,
    }


def detection(
    result: RobustResult,
    sensors: Sequence[Sensor],
    truth: Truth,
    window: tuple[float, float],
    fault: InjectedFault | None,
) -> dict[str, Any]:
    """Which readings were rejected, and when the injected fault was found.

    ``delay`` [s]: from the fault's start to the first estimate that holds the sensor faulty, no
    later than one step after its end; infinite for never. ``recovery`` [s]: from its end to the
    first estimate that does not. Of the readings that no fault was put into: ``good`` and ``bad``,
    how many are within ``GOOD`` of the reference and how many not, ``good_rejected`` and
    ``bad_kept``.
    """
    log, rejected = result.log, result.rejected
    latency = {sensor.name: sensor.latency for sensor in sensors}
    delay = np.array([latency.get(name, 0.0) for name in log.names])[log.code]
    valid = log.time - delay
    counted = (result.step >= 0) & (valid > window[0]) & (valid <= window[1])
    if fault is not None:
        counted[fault.rows(log)] = False
    bad = np.abs(log.value - truth(valid)) > GOOD
    found = {
        "good": int((counted & ~bad).sum()),
        "bad": int((counted & bad).sum()),
        "good_rejected": int((counted & ~bad & rejected).sum()),
        "bad_kept": int((counted & bad & ~rejected).sum()),
    }
    return found if fault is None else {**found, **_delays(result, fault)}


def _delays(result: RobustResult, fault: InjectedFault) -> dict[str, float]:
    sensor = result.sensor_names.index(fault.sensor)
    faulty, time = result.fault_probability[:, sensor] >= FOUND, result.time
    ends = time[np.searchsorted(time, fault.end) :][:1].max(initial=fault.end)
    found = time[faulty & (time > fault.start) & (time <= ends)]
    free = time[~faulty & (time > fault.end)]
    return {
        "delay": float(found[0]) - fault.start if len(found) else math.inf,
        "recovery": float(free[0]) - fault.end if len(free) else math.inf,
    }


def summary(runs: Sequence[dict[str, Any]], of_limits: Sequence[list[dict[str, Any]]],
            risks: Sequence[float]) -> dict[str, Any]:  # fmt: skip
    """All runs of one kind of fault. ``of_limits``: for every run, ``limits`` at every risk.

    ``risks``: for every one, what ``misleading.summary`` gives, and the shares of the estimates
    within the two tolerances. ``found``: share of the faults that were; delays [s], median and
    longest (null: never). ``false_exclusion``: share of good readings rejected; ``bad_kept``: share
    of bad ones that were not (null where there are none).
    """
    rows = []
    for i, risk in enumerate(risks):
        judged = [run[i] for run in of_limits]
        shares = {
            name: float(np.concatenate([run[name] for run in judged]).mean())
            for name in ("within_2kmh", "within_etcs")
        }
        rows.append({"claimed": risk, **misleading.summary(judged), **shares})
    total = {name: sum(run[name] for run in runs) for name in ("good", "bad")}
    numbers: dict[str, Any] = {
        "risks": rows,
        "false_exclusion": _share(sum(run["good_rejected"] for run in runs), total["good"]),
        "bad_kept": _share(sum(run["bad_kept"] for run in runs), total["bad"]),
    }
    if "delay" in runs[0]:
        delays = np.array([run["delay"] for run in runs])
        numbers.update(
            found=float(np.isfinite(delays).mean()),
            delay=float(np.median(delays)),
            longest_delay=float(delays.max()),
            recovery=float(np.median([run["recovery"] for run in runs])),
        )
    return numbers


def _share(part: int, whole: int) -> float:
    return part / whole if whole else math.nan
