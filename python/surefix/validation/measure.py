"""Measures the risk of settings: simulates, filters, asks how much of the truth is outside."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

import surefix as sf
from surefix.core import checks
from surefix.core.checks import FloatArray
from surefix.errors import ConfigError
from surefix.intervals import CONFIDENCE, share_interval
from surefix.parallel import in_parallel
from surefix.validation import importance
from surefix.validation.condition import outside
from surefix.validation.simulate import Runs, joined, simulate
from surefix.validation.violations import SETTINGS, Setting

RISKS = (1e-2, 1e-3, 1e-5, 1e-7, 1e-9)
RUNS, SEED = 1000, 1
AT_ONCE = 20_000  # histories of modes
ENOUGH = 10.0  # misses expected at the claimed risk, for plain Monte Carlo to say anything

Progress = Callable[[int, int], None]


def validate(
    runs: int = RUNS,
    seed: int = SEED,
    risks: Sequence[float] = RISKS,
    settings: Sequence[str] = tuple(SETTINGS),
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Claimed and measured risk of the last estimate of every run, for each of ``settings``.

    ``plain``: share of runs drawn from the scenario itself whose truth is outside; ``measured``:
    the mean over all weighted runs of the probability that the truth is outside, given the
    readings and the true modes before the last steps (``condition``); ``low``, ``high``: 95 %
    intervals; ``effective``: how many equal runs say as much. Null where too few: importance
    sampling is then not effective.
    """
    count = checks.whole("runs", runs, 20, 10_000_000)
    start = checks.whole("seed", seed, 0, 2**31)
    claimed = [checks.probability("risks", risk) for risk in risks]
    if not claimed:
        raise ConfigError("risks: expected at least one")
    if not settings:
        raise ConfigError("settings: expected at least one")
    for name in settings:
        if name not in SETTINGS:
            raise ConfigError(f"settings: expected one of {', '.join(SETTINGS)}, got {name!r}")
    total, done = len(settings), {}
    for i, name in enumerate(settings):

        def advance(part: int, of: int, i: int = i) -> None:
            if progress is not None:
                progress(round(1000 * (i + part / of)), 1000 * total)

        done[name] = measure(SETTINGS[name], count, start, claimed, advance)
    return {"runs": count, "seed": start, "confidence": CONFIDENCE, "settings": done}


def measure(
    setting: Setting,
    runs: int,
    seed: int,
    risks: Sequence[float],
    progress: Progress,
) -> dict[str, Any]:
    """One setting; see ``validate``."""
    random = np.random.RandomState(seed)
    proposals = setting.proposals
    counts = importance.counts(proposals, runs)
    true = setting.true
    drawn = joined([simulate(true, p, n, random) for p, n in zip(proposals, counts, strict=True)])
    vectors = math.prod(len(G) for G in true.chains())
    size = max(1, AT_ONCE // vectors**setting.window)
    work = [
        partial(_judged, setting, counts, drawn, slice(i, i + size), risks)
        for i in range(0, runs, size)
    ]
    parts = in_parallel(work, progress)
    limits = np.concatenate([part[0] for part in parts])
    weighed = np.concatenate([part[1] for part in parts])
    weight = weighed[:, 0]
    plain = counts[0] if proposals[0].steps == 0 else 0
    lower, upper, truth = limits[:, :, 0], limits[:, :, 1], drawn.truth[:, None]
    missed = ((truth < lower) | (truth > upper))[:plain]
    rows = []
    for r, risk in enumerate(risks):
        row: dict[str, Any] = {"claimed": risk}
        row.update(importance.estimate(weighed[:, 1 + r], weight, counts))
        row["available"] = float(np.isfinite(upper[:plain, r]).mean()) if plain else None
        row["plain"] = row["plain_low"] = row["plain_high"] = None
        row["plain_runs"] = plain
        if risk * plain >= ENOUGH:
            low, high = share_interval(int(missed[:, r].sum()), plain)
            row.update(plain=float(missed[:, r].mean()), plain_low=low, plain_high=high)
        row["verdict"] = _verdict(row)
        rows.append(row)
    return {
        "title": setting.title,
        "weight": {
            "mean": float(weight.mean()),
            "error": importance.error(weight, counts),
            "largest": float(weight.max()),
            "effective": importance.effective(weight),
        },
        "risks": rows,
    }


def _judged(
    setting: Setting,
    counts: Sequence[int],
    runs: Runs,
    part: slice,
    risks: Sequence[float],
) -> tuple[FloatArray, FloatArray]:
    """Limits of some runs (N, risks, 2), and weighted probabilities to be outside."""
    some = Runs(runs.value[part], runs.truth[part], runs.modes[part])
    found = limits_of(setting, some, risks)
    return found, outside(setting.true, setting.proposals, counts, some, found, setting.window)


def _verdict(row: dict[str, Any]) -> str:
    """What the interval says of the claim."""
    slack = 1 + 1e-6
    if row["high"] is None:
        return "not measured"
    if row["low"] > row["claimed"] * slack:
        return "above"
    return "below" if row["high"] * slack < row["claimed"] else "agrees"


def limits_of(setting: Setting, runs: Runs, risks: Sequence[float]) -> FloatArray:
    """Limits at the end of some runs (N, risks, 2)."""
    sensors, times = setting.true.sensors, setting.assumed.times()
    schedule = setting.true.schedule()
    stamp = np.array([time + sensors[s].latency for time, s in schedule])
    order = np.argsort(stamp, kind="stable")
    stamps, names = stamp[order], [sensors[schedule[i][1]].name for i in order]
    found = np.empty((len(runs.value), len(risks), 2))
    filters = [make_filter(setting, risk) for risk in risks]
    start = filters[0].save()
    for i, value in enumerate(runs.value[:, order]):
        if setting.exact:  # the risk plays no part in the mixture
            engine = filters[0]
            engine.restore(start)
            for row in zip(stamps.tolist(), names, value.tolist(), strict=True):
                engine.push(*row)
            for time in times.tolist():
                engine.estimate(time)
            mixture, speed = engine.mixture(), setting.assumed.model.output
            weight, sigma = np.exp(mixture["log_weight"]), np.sqrt(mixture["P"][:, speed, speed])
            for r, risk in enumerate(risks):
                found[i, r] = sf.alert_limits(weight, mixture["x"][:, speed], sigma, risk)
            continue
        log = sf.Log(stamps, names, value)
        for r, engine in enumerate(filters):
            result = engine.run(log, times=times)
            found[i, r] = result.lower[-1], result.upper[-1]
    return found


def make_filter(setting: Setting, risk: float) -> sf.RobustFilter:
    """The filter under test: as it is by default; for a known answer it merges and cuts nothing."""
    assumed = setting.assumed
    options: dict[str, Any] = {}
    if setting.exact:
        hypotheses = math.prod(1 + len(sensor.faults) for sensor in assumed.sensors)
        options = {"cut": 0.0, "components": hypotheses ** (assumed.steps - 1)}
    return sf.RobustFilter(
        assumed.model, assumed.sensors, assumed.x0, np.diag(assumed.P0), start=0.0, risk=risk,
        **options,
    )  # fmt: skip
