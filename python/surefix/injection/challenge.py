"""A recording with a reference, as it is and with faults put into it, against a configuration."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from surefix.config import Config
from surefix.core import checks
from surefix.core.checks import FloatArray
from surefix.errors import ConfigError
from surefix.injection import judge
from surefix.injection.draw import draw
from surefix.injection.fault import KINDS, InjectedFault
from surefix.log import Log
from surefix.parallel import in_parallel
from surefix.robust.result import RobustResult

RISKS = (1e-3, 1e-7, 1e-11)
SEEDS, SEED = 5, 1
WARM_UP = 5.0  # s after the reference's first sample that are not judged

Progress = Callable[[int, int], None]


def challenge(
    config: Config,
    log: Log,
    folder: str | Path,
    *,
    seeds: int = SEEDS,
    seed: int = SEED,
    risks: Sequence[float] = RISKS,
    kinds: Sequence[str] = KINDS,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Runs ``log`` as it is and with every kind of fault in every sensor, one at a time.

    ``config``: with faults of sensors, a rate of output and a reference, whose file is in
    ``folder``. ``seeds``: how many faults of every kind in every sensor, drawn by ``seed``; without
    ``kinds`` only the log as it is.
    Returns numbers by name (``judge.summary``): ``recorded``, and ``injected`` by sensor and kind.
    ``points``: for the figure, by kind, (error, limit) of every estimate at the smallest risk.
    Raises ConfigError for arguments out of range and what the configuration lacks.
    """
    count = checks.whole("seeds", seeds, 1, 10_000)
    first = checks.whole("seed", seed, 0, 2**32 - 1)
    claimed = sorted({checks.probability("risks", risk) for risk in risks}, reverse=True)
    if not claimed:
        raise ConfigError("risks: expected at least one")
    wanted = [checks.one_of("kinds", kind, KINDS) for kind in kinds]
    truth, window = _truth(config, Path(folder), log)
    sensors = [s for s in config.sensors if s.name in log.names]
    drawn = [
        fault
        for fault in draw(log, sensors, window, config.inject, count, first)
        if fault.kind in wanted
    ]
    cases: list[InjectedFault | None] = [None, *drawn]
    work = [partial(_run, config, log, fault, claimed, truth, window) for fault in cases]
    runs = in_parallel(work, progress or (lambda done, total: None))
    groups: dict[str, list[int]] = {"recorded": [0]}
    for i, fault in enumerate(drawn, start=1):
        groups.setdefault(f"{fault.sensor} {fault.kind}", []).append(i)
    found = {
        name: judge.summary([runs[i][0] for i in rows], [runs[i][1] for i in rows], claimed)
        for name, rows in groups.items()
    }
    points: dict[str, list[FloatArray]] = {}
    for case, (_, limits) in zip(cases, runs, strict=True):
        kind = "recorded" if case is None else case.kind
        points.setdefault(kind, []).append(
            np.stack([limits[-1]["error_of_estimate"], limits[-1]["limit"]])
        )
    return {
        "seeds": count,
        "seed": first,
        "risks": claimed,
        "sizes": dataclasses.asdict(config.inject),
        "recorded": found.pop("recorded"),
        "injected": found,
        "faults": [
            {**dataclasses.asdict(fault), "delay": run[0]["delay"], "recovery": run[0]["recovery"]}
            for fault, run in zip(drawn, runs[1:], strict=True)
        ],
        "points": {kind: np.concatenate(parts, axis=1) for kind, parts in points.items()},
    }


def _truth(config: Config, folder: Path, log: Log) -> tuple[judge.Truth, tuple[float, float]]:
    """The reference as a function of time, and the window in which there is one and a log."""
    if config.reference is None:
        raise ConfigError(f"{config.path}: expected a table [reference]")
    if not any(sensor.faults for sensor in config.sensors):
        raise ConfigError(f"{config.path}: expected a sensor with faults")
    if config.output.rate is None:
        raise ConfigError(f"{config.path}, [output]: expected a rate")
    time, value = config.reference.read(folder)

    def truth(at: FloatArray) -> FloatArray:
        return np.interp(at, time, value)

    ends = min(float(time[-1]), float(log.time[np.isfinite(log.time)].max(initial=-np.inf)))
    window = float(time[0]) + WARM_UP, ends
    if not window[1] - window[0] > 1 / config.output.rate:
        raise ConfigError(
            f"{config.path}: expected a log and a reference that have more in common than the time "
            f"between two estimates, {1 / config.output.rate:g} s, after the first {WARM_UP:g} s "
            f"of the reference; they have {window[1] - window[0]:g} s"
        )
    return truth, window


def _run(
    config: Config,
    log: Log,
    fault: InjectedFault | None,
    risks: Sequence[float],
    truth: judge.Truth,
    window: tuple[float, float],
) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """What was detected at the smallest risk, and the limits at every risk, of one run."""
    changed = log if fault is None else fault.apply(log)
    results = [_filtered(config, changed, risk) for risk in risks]
    found = judge.detection(results[-1], config.sensors, truth, window, fault)
    return found, [judge.limits(result, truth, window) for result in results]


def _filtered(config: Config, log: Log, risk: float) -> RobustResult:
    output = dataclasses.replace(config.output, risk=risk)
    result = dataclasses.replace(config, output=output).run(log)
    if not isinstance(result, RobustResult):
        raise TypeError("a sensor has faults, so the filter is robust")
    return result
