"""Bilenne 2004, figure 1: the GPS freezes in a tunnel, and one value of the radar is far off.

A linear filter, the paper's estimator (outage alone, drawn anew at 10 Hz) and one whose faults
last, with a mode for frozen outputs, on the same journeys (``scenarios.tunnel``). The paper does
not tell how often the GPS reports; that decides whether outage alone is enough.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

import surefix as sf
from surefix import tables
from surefix.misleading import judge, summary
from surefix.parallel import in_parallel
from surefix.robust.result import RobustResult
from surefix.studies import scenarios, speed_faults
from surefix.studies.bilenne_fig_1_figure import make_figure

RATE = 10.0  # Hz, of estimation
GPS_RATES = (1.0, 5.0)  # Hz
WINDOW = (1590.0, 1630.0)  # s, the figure's axis
X0, P0 = np.array([scenarios.SLOW, 0.0]), np.diag([2.0**2, 0.1])
FIRST_SEED = 2000  # those below chose the parameters
KINDS = {
    "linear": "linear filter",
    "outage": "outage alone (the paper)",
    "frozen": "frozen, drift carried, outage",
}

NOTE = (
    "The paper's recording is not public: the journey is simulated, so that the truth is known. "
    "At 30 m/s a value of 103 km/h would be within the radar's noise: the train is at 15 m/s then."
)


def make_filter(kind: str) -> sf.DesyncFilter | sf.RobustFilter:
    """The filter of one of ``KINDS``."""
    modes = {"outage": speed_faults.outage_alone, "frozen": speed_faults.carried_and_frozen}
    faults = modes[kind]() if kind in modes else ()
    sensors = [sf.Sensor(name, s, faults=faults) for name, s in scenarios.TUNNEL_SENSORS.items()]
    jerk = speed_faults.JERK if kind == "frozen" else speed_faults.PAPER_JERK
    model, start = sf.ConstantAcceleration(jerk=jerk), scenarios.TUNNEL_TIME[0]
    if kind == "linear":
        return sf.DesyncFilter(model, sensors, X0, P0, start=start, risk=speed_faults.RISK)
    carry = "one" if kind == "outage" else "merge"
    return sf.RobustFilter(model, sensors, X0, P0, start=start, risk=speed_faults.RISK, carry=carry)


def run(out: Path, progress: Callable[[int, int], None], seeds: int = 50) -> dict[str, Any]:
    """Writes study.json and figure.png; returns the numbers."""
    names = [(kind, gps) for gps in GPS_RATES for kind in KINDS]
    work = [
        partial(_one, kind, gps, FIRST_SEED + seed) for kind, gps in names for seed in range(seeds)
    ]
    runs = in_parallel(work, progress)
    found = {
        f"{kind} gps {gps:g}Hz": _summary(kind, runs[i * seeds : (i + 1) * seeds])
        for i, (kind, gps) in enumerate(names)
    }
    numbers: dict[str, Any] = {
        "study": "bilenne-fig-1",
        "note": NOTE,
        "kinds": KINDS,
        "settings": {**speed_faults.SETTINGS, "estimation_rate": RATE, "first_seed": FIRST_SEED},
        **found,
    }
    numbers["report"] = _report(found)
    tables.plain(out / "study.json", numbers)
    make_figure(make_filter, RATE, GPS_RATES, FIRST_SEED).savefig(out / "figure.png", dpi=150)
    return numbers


def _one(kind: str, gps_rate: float, seed: int) -> dict[str, Any]:
    scene = scenarios.tunnel(seed, gps_rate)
    result = make_filter(kind).run(scene.log, times=scene.times(RATE))
    judged = judge(result, scene.truth, WINDOW)
    if isinstance(result, RobustResult):
        judged.update(_rejections(result))
    return judged


def _rejections(result: RobustResult) -> dict[str, Any]:
    """What the most probable hypotheses made of the frozen GPS, the outlier and the rest.
    Delays [s] are from the first repeated and the first good reading; infinite for never."""
    log, rejected = result.log, result.rejected
    gps = np.flatnonzero(log.sensor == "gps")
    frozen = gps[(log.time[gps] >= scenarios.ENTRY) & (log.time[gps] < scenarios.EXIT)]
    after = gps[log.time[gps] >= scenarios.EXIT]
    outlier = int(np.flatnonzero(log.value == scenarios.OUTLIER)[0])
    good = np.flatnonzero((log.time > WINDOW[0]) & (log.time <= WINDOW[1]))
    good = good[~np.isin(good, [*frozen, outlier])]

    def delay(rows: npt.NDArray[np.intp], wanted: bool) -> float:
        hits = rows[rejected[rows] == wanted]
        if not len(hits):
            return math.inf
        return float(result.time[result.step[hits[0]]] - log.time[rows[0]])

    return {
        "detection_delay": delay(frozen, True),
        "recovery_delay": delay(after, False),
        "frozen_rejected": float(rejected[frozen].mean()),
        "outlier_rejected": bool(rejected[outlier]),
        "healthy_rejected": float(rejected[good].mean()),
    }


def _summary(kind: str, runs: list[dict[str, Any]]) -> dict[str, Any]:
    """As ``misleading.summary``; for filters that reject: the share of frozen readings and of
    healthy ones rejected, of outliers, median and longest delays [s] (null: never)."""
    numbers = summary(runs)
    if kind == "linear":
        return numbers
    for name in ("frozen_rejected", "healthy_rejected", "outlier_rejected"):
        numbers[name] = float(np.mean([run[name] for run in runs]))
    for name in ("detection_delay", "recovery_delay"):
        delays = [run[name] for run in runs]
        numbers[name] = float(np.median(delays))
        numbers[f"longest_{name}"] = float(np.max(delays))
    return numbers


def _report(found: dict[str, dict[str, Any]]) -> list[str]:
    lines = [
        f"limits at risk {speed_faults.RISK:g}, {RATE:g} Hz, {WINDOW[0]:g}–{WINDOW[1]:g} s; "
        "outside: share of the time with the truth outside them",
        f"{'':<40}{'outside':>9}{'error':>12}{'width':>11}{'freeze found':>14}{'outlier':>9}",
    ]
    for name, numbers in found.items():
        kind, gps = name.split(" gps ")
        text = (
            f"{KINDS[kind] + ', GPS ' + gps.replace('Hz', ' Hz'):<40}"
            f"{numbers['misleading_fraction']:>9.2%}{numbers['max_error']:>8.2f} m/s"
            f"{numbers['mean_width']:>7.2f} m/s"
        )
        if "outlier_rejected" in numbers:
            delay = numbers["detection_delay"]
            delay = f"{delay:.1f} s" if delay < math.inf else "never"
            text += f"{delay:>14}{numbers['outlier_rejected']:>9.0%}"
        lines.append(text)
    return [*lines, "", NOTE]
