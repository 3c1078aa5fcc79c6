"""Bilenne 2004, table 2: estimates and standard errors do not depend on the rate of estimation.

A journey with the paper's model (eq. 33, σ_τ = 0.08) and sensors (σ 1, 2, 0.5 m/s) is simulated,
then filtered at f₀ = 5 Hz, f₀/2 and f₀/4. At common times the three must agree.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import surefix as sf
from surefix import tables
from surefix.core.checks import FloatArray
from surefix.studies import standard_error_fit
from surefix.studies.bilenne_table_2_figure import make_figure

JERK = 0.08  # m/s³/√Hz
T0 = 0.2  # s, the shortest period of estimation
EVERY = (1, 2, 4)  # periods of estimation, in T₀
STEPS = 200  # of T₀
ROWS = 8  # of the printed table
SENSORS = (sf.Sensor("wheel", 1.0), sf.Sensor("radar", 2.0), sf.Sensor("gps", 0.5))
RATES = {"wheel": 20.0, "radar": 10.0, "gps": 1.0}  # Hz; the paper does not say
X0, P0 = np.array([8.5, 0.1]), np.diag([0.5**2, 0.5**2])

PAPER_ESTIMATES = (8.5211, 8.5482, 8.6938, 8.7135, 8.9498, 8.9741, 8.9562, 9.0269)  # m/s
PAPER_STANDARD_ERRORS = (0.2862, 0.3295, 0.3465, 0.3481, 0.3444, 0.2850, 0.3090, 0.3254)  # m/s

NOTE = (
    "The paper's recording (Arezzo-Pontassieve) is not public: its values cannot be reproduced, "
    "only the invariance can, here on a simulated journey."
)


def run(out: Path, progress: Callable[[int, int], None]) -> dict[str, Any]:
    """Writes table.csv, study.json and figure.png; returns the numbers."""
    model = sf.ConstantAcceleration(jerk=JERK)
    log = simulate(model)
    filtered, composite = {}, {}
    for i, every in enumerate(EVERY):
        times = T0 * every * np.arange(1.0, STEPS // every + 1)
        engine = sf.DesyncFilter(model, SENSORS, X0, P0, start=0.0)
        result = engine.run(log, times=times, noise=None)
        filtered[every] = result.estimate, result.sigma
        composite[every] = by_composite_steps(model, log, times)
        progress(i + 1, len(EVERY) + 2)
    fit = standard_error_fit.search(np.array(PAPER_STANDARD_ERRORS), T0)
    progress(len(EVERY) + 1, len(EVERY) + 2)
    table = _table(filtered)
    numbers = {
        "study": "bilenne-table-2",
        "note": NOTE,
        "times_compared": STEPS // 2 + STEPS // 4,
        "max_relative_difference": max(_difference(filtered, e, filtered, 1) for e in (2, 4)),
        "composite_max_relative_difference": max(
            _difference(composite, e, filtered, e) for e in EVERY
        ),
        "table": {name: column.tolist() for name, column in table.items()},
        "paper": {
            "estimate": list(PAPER_ESTIMATES), "standard_error": list(PAPER_STANDARD_ERRORS),
        },
        "standard_error_fit": fit,
    }  # fmt: skip
    numbers["report"] = _report(numbers, table)
    tables.write_csv(out / "table.csv", table)
    tables.plain(out / "study.json", numbers)
    figure = make_figure(table, T0, PAPER_STANDARD_ERRORS, fit)
    figure.savefig(out / "figure.png", dpi=150)
    progress(1, 1)
    return numbers


def simulate(model: sf.Model, seed: int = 2004) -> sf.Log:
    """A journey drawn from the model, measured at irregular times around each sensor's rate."""
    random = np.random.RandomState(seed)
    rows: list[tuple[float, int]] = []
    for index, sensor in enumerate(SENSORS):
        period = 1 / RATES[sensor.name]
        regular = np.arange(int(STEPS * T0 / period)) * period
        offset = (
            0.9 * T0 if sensor.name == "gps" else random.uniform(0.0, 0.8, len(regular)) * period
        )
        rows += [(round(t, 9), index) for t in regular + offset]
    rows.sort()
    x, now, values = X0 + np.sqrt(np.diag(P0)) * random.normal(size=2), 0.0, []
    for time, index in rows:
        F, Q = model.transition(time - now)
        x, now = F @ x + np.linalg.cholesky(Q + 1e-30 * np.eye(2)) @ random.normal(size=2), time
        values.append(x[0] + SENSORS[index].sigma * random.normal())
    return sf.Log([t for t, _ in rows], [SENSORS[i].name for _, i in rows], values)


def by_composite_steps(
    model: sf.Model, log: sf.Log, times: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Speed and standard error at ``times``, each step taken as one composite observation."""
    x, P, start = X0, P0, 0.0
    speed, error = [], []
    for end in times:
        rows = (log.time > start) & (log.time <= end)
        step, order = sf.CompositeStep.from_measurements(
            model, SENSORS, start, end, log.time[rows], list(log.sensor[rows])
        )
        update = step.update(x, P, log.value[rows][order], way="composite")
        x, P, start = update.x, update.P, float(end)
        speed.append(x[0])
        error.append(np.sqrt(P[0, 0]))
    return np.array(speed), np.array(error)


Estimates = dict[int, tuple[FloatArray, FloatArray]]


def _difference(first: Estimates, every: int, second: Estimates, other: int) -> float:
    """Largest relative difference of estimates and standard errors at the times of ``every``."""
    stride = every // other
    return max(
        float((np.abs(a - b[stride - 1 :: stride]) / np.abs(b[stride - 1 :: stride])).max())
        for a, b in zip(first[every], second[other], strict=True)
    )


def _table(filtered: Estimates) -> dict[str, FloatArray]:
    """Columns of the first rows; NaN where a rate has no estimate."""
    table = {"T/T0": np.arange(1.0, ROWS + 1)}
    for every in EVERY:
        name = "f0" if every == 1 else f"f0/{every}"
        for kind, values in zip(("estimate", "standard_error"), filtered[every], strict=True):
            column = np.full(ROWS, np.nan)
            column[every - 1 :: every] = values[: ROWS // every]
            table[f"{kind} {name}"] = column
    return table


def _report(numbers: dict[str, Any], table: dict[str, FloatArray]) -> list[str]:
    """The table as in the paper, and what it says."""
    names = ["f0" if every == 1 else f"f0/{every}" for every in EVERY]
    lines = ["time   " + "".join(f"{name:<20}" for name in names) + "paper"]
    for i in range(ROWS):
        cells = []
        for name in names:
            x, s = table[f"estimate {name}"][i], table[f"standard_error {name}"][i]
            cells.append("–" if np.isnan(x) else f"{x:.4f}, {s:.4f}")
        paper = f"{PAPER_ESTIMATES[i]:.4f}, {PAPER_STANDARD_ERRORS[i]:.4f}"
        lines.append(f"{i + 1} T0   " + "".join(f"{cell:<20}" for cell in cells) + paper)
    fit = numbers["standard_error_fit"]
    return [
        *lines,
        "",
        f"largest relative difference at {numbers['times_compared']} common times: "
        f"{numbers['max_relative_difference']:.1e}",
        f"whole-step composite way against the engine: "
        f"{numbers['composite_max_relative_difference']:.1e}",
        numbers["note"],
        *standard_error_fit.describe(fit),
    ]
