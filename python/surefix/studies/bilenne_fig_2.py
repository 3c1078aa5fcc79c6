"""Bilenne 2004, figure 2: three radars fail at once, and the limits must still hold the truth.

Two collapse to one value and the third drifts to it (``scenarios.collapse``): all agree on a train
that brakes. Three ways to model faults, three rates of estimation; beside them a train that really
brakes, and radars that drift alike.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import surefix as sf
from surefix import tables
from surefix.studies import scenarios, speed_faults
from surefix.studies.bilenne_fig_2_figure import make_figure
from surefix.studies.misleading import in_parallel, judge, summary

RATES = (10.0, 5.0, 1.25)  # Hz
DRIFTS = (0.1, 0.25, 0.5, 1.0, 1.5, 2.0, 3.0)  # m/s²
BRAKES = tuple((a, ramp) for a in (0.3, 0.7, 1.0, 1.3) for ramp in (0.0, 1.0, 2.0))  # m/s², s
X0, P0 = np.array([scenarios.SPEED, 0.0]), np.diag([2.0**2, 0.1])
AFTER = 5.0  # s: judged from there on
FIRST_SEED = 1000  # those below chose the parameters
COMPONENTS = 54  # twice the hypotheses
COUNTS = (("merge", 27), ("merge", 54), ("merge", 108), ("cut", 24), ("cut", 100), ("cut", 400))
COUNTS_SEEDS, COUNTS_DRIFTS = 5, (0.25, 0.5, 1.0, 2.0)

KINDS = {
    "outage": "outage alone (the paper)",
    "anew": "drift drawn anew",
    "carried": "drift carried",
}

NOTE = (
    "The paper's recording is not public: the scene is simulated, so that the truth is known. "
    "What no filter can know: three radars that drift alike, within what a train can do, are a "
    "train that brakes; the limits then follow them."
)


def make_filter(kind: str, components: int = COMPONENTS, carry: str = "merge") -> sf.RobustFilter:
    """The filter of one of ``KINDS``."""
    make = {"outage": speed_faults.outage_alone, "anew": speed_faults.drawn_anew}
    faults = make.get(kind, speed_faults.carried)()
    sensors = [sf.Sensor(name, s, faults=faults) for name, s in scenarios.RADARS.items()]
    lasting = kind == "carried"
    return sf.RobustFilter(
        sf.ConstantAcceleration(jerk=speed_faults.JERK), sensors, X0, P0, start=0.0,
        risk=speed_faults.RISK, carry=carry if lasting else "one",
        components=components if lasting else None,
    )  # fmt: skip


def scenes() -> Iterator[tuple[str, Callable[[int], scenarios.Scene]]]:
    """The end of a configuration's key, and the scene of a seed."""
    for drift in DRIFTS:
        yield f"{drift:g}", partial(scenarios.collapse, drift=drift)
    for deceleration, ramp in BRAKES:
        key = f"brakes {deceleration:g} ramp {ramp:g}"
        yield key, partial(scenarios.braking, deceleration=deceleration, ramp=ramp)
    for drift in DRIFTS:
        yield f"alike {drift:g}", partial(scenarios.common_drift, drift=drift)


def run(
    out: Path, progress: Callable[[int, int], None], seeds: int = 100, fewer: int = 25
) -> dict[str, Any]:
    """Writes study.json and figure.png; returns the numbers. ``seeds``: of drift carried at
    1.25 Hz; ``fewer``: of all others."""
    keys, work = [], []
    for kind in KINDS:
        for rate in RATES:
            number = seeds if (kind, rate) == ("carried", 1.25) else fewer
            for key, scene in scenes():
                keys.append(f"{rate:g}Hz {kind} {key}")
                work.append(partial(_judged, make_filter(kind), [(scene, rate, number)]))
    for carry, count in COUNTS:
        drifts = [(partial(scenarios.collapse, drift=d), 1.25, COUNTS_SEEDS) for d in COUNTS_DRIFTS]
        work.append(partial(_judged, make_filter("carried", count, carry), drifts))
    results = in_parallel(work, progress)
    found = dict(zip(keys, results, strict=False))
    counts = [
        {"carry": carry, "components": count, **result}
        for (carry, count), result in zip(COUNTS, results[len(keys) :], strict=True)
    ]
    numbers: dict[str, Any] = {
        "study": "bilenne-fig-2",
        "note": NOTE,
        "settings": {**speed_faults.SETTINGS, "components": COMPONENTS, "first_seed": FIRST_SEED},
        **found,
        "mean_width": {f"{r:g}Hz {k}": _mean_width(found, f"{r:g}Hz {k}") for k in KINDS for r in RATES},
        "components": counts,
    }
    numbers["report"] = _report(numbers)
    tables.plain(out / "study.json", numbers)
    make_figure(numbers, make_filter, FIRST_SEED).savefig(out / "figure.png", dpi=150)
    return numbers


Case = tuple[Callable[[int], scenarios.Scene], float, int]


def _judged(engine: sf.RobustFilter, cases: Sequence[Case]) -> dict[str, Any]:
    runs = []
    for make, rate, seeds in cases:
        for seed in range(FIRST_SEED, FIRST_SEED + seeds):
            scene = make(seed)
            result = engine.run(scene.log, times=scene.times(rate))
            runs.append(judge(result, scene.truth, (AFTER, scene.end)))
    return summary(runs)


def _mean_width(found: dict[str, Any], name: str) -> float:
    return float(np.mean([found[f"{name} {drift:g}"]["mean_width"] for drift in DRIFTS]))


def _report(numbers: dict[str, Any]) -> list[str]:
    """Shares of time with the truth outside the limits, in per cent; mean widths."""
    blocks = {
        "two radars collapse, one drifts by … m/s²": [f"{d:g}" for d in DRIFTS],
        "healthy radars, the train brakes by … m/s² (worst of three jerks)": ["0.3", "0.7", "1", "1.3"],
        "three radars drift alike by … m/s² (no filter can know)": [f"alike {d:g}" for d in DRIFTS],
    }
    lines = [f"truth outside limits claimed at 1 − {speed_faults.RISK:g}, % of the time"]
    for title, ends in blocks.items():
        brakes = "brakes" in title
        lines += ["", title, " " * 18 + "".join(f"{e.split()[-1]:>7}" for e in ends) + "   width, m/s"]
        for kind in KINDS:
            for rate in RATES:
                name = f"{rate:g}Hz {kind}"
                cells = [
                    [numbers[f"{name} brakes {e} ramp {j}"] for j in (0, 1, 2)] if brakes
                    else [numbers[f"{name} {e}"]] for e in ends
                ]  # fmt: skip
                shares = [100 * max(c["misleading_fraction"] for c in cell) for cell in cells]
                widths = np.mean([[c["mean_width"] for c in cell] for cell in cells])
                row = "".join(f"{share:7.2f}" if share else f"{'0':>7}" for share in shares)
                lines.append(f"{name:<18}{row}   {widths:.2f}")
    lines += ["", f"components, 1.25 Hz, drifts {', '.join(f'{d:g}' for d in COUNTS_DRIFTS)} m/s²"]
    for row in numbers["components"]:
        width = "no limits" if not row["available_fraction"] else f"width {row['mean_width']:.2f}"
        lines.append(
            f"  {row['carry']} {row['components']}: {width}, available "
            f"{row['available_fraction']:.1%}, misleading {row['misleading_fraction']:.2%}, "
            f"left out up to {row['max_discarded_mass']:.0e}"
        )
    return [*lines, "", numbers["note"]]
