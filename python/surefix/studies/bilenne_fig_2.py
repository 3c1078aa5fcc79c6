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
from surefix.misleading import judge, summary
from surefix.parallel import in_parallel
from surefix.studies import scenarios, speed_faults
from surefix.studies.bilenne_fig_2_figure import make_figure

RATES = (10.0, 5.0, 1.25)  # Hz
DRIFTS = (0.1, 0.25, 0.5, 1.0, 1.5, 2.0, 3.0)  # m/s²
VISIBLE = 0.25  # m/s²: mean widths are over the drifts from here on
BRAKES = tuple((a, ramp) for a in (0.3, 0.7, 1.0, 1.3) for ramp in (0.0, 1.0, 2.0))  # m/s², s
X0, P0 = np.array([scenarios.SPEED, 0.0]), np.diag([2.0**2, 0.1])
AFTER = 5.0  # s: judged from there on
FIRST_SEED = 2000  # those below chose the parameters
COMPONENTS = 108  # four times the hypotheses: merging must not cost what the limits claim
COUNTS = (
    *(("merge", count, rate) for rate in (1.25, 10.0) for count in (27, 54, 108)),
    *(("cut", count, 1.25) for count in (24, 100, 400)),
)
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


def make_filter(kind: str, components: int | None = None, carry: str = "merge") -> sf.RobustFilter:
    """The filter of one of ``KINDS``; ``components`` and ``carry`` of drift carried."""
    make = {"outage": speed_faults.outage_alone, "anew": speed_faults.drawn_anew}
    faults = make.get(kind, speed_faults.carried)()
    sensors = [sf.Sensor(name, s, faults=faults) for name, s in scenarios.RADARS.items()]
    lasting = kind == "carried"
    jerk = speed_faults.PAPER_JERK if kind == "outage" else speed_faults.JERK
    return sf.RobustFilter(
        sf.ConstantAcceleration(jerk=jerk), sensors, X0, P0, start=0.0,
        risk=speed_faults.RISK, carry=carry if lasting else "one",
        components=(components or COMPONENTS) if lasting else None,
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
    for carry, count, rate in COUNTS:
        cases = [partial(scenarios.collapse, drift=drift) for drift in COUNTS_DRIFTS]
        cases.append(partial(scenarios.braking, deceleration=BRAKES[-1][0], ramp=0.0))
        several = [(scene, rate, COUNTS_SEEDS) for scene in cases]
        work.append(partial(_judged, make_filter("carried", count, carry), several))
    results = in_parallel(work, progress)
    found = dict(zip(keys, results, strict=False))
    counts = [
        {"carry": carry, "components": count, "rate": rate, **result}
        for (carry, count, rate), result in zip(COUNTS, results[len(keys) :], strict=True)
    ]
    numbers: dict[str, Any] = {
        "study": "bilenne-fig-2",
        "note": NOTE,
        "kinds": KINDS,
        "settings": {**speed_faults.SETTINGS, "components": COMPONENTS, "first_seed": FIRST_SEED},
        **found,
        "mean_width": {
            f"{r:g}Hz {k}": _mean_width(found, f"{r:g}Hz {k}") for k in KINDS for r in RATES
        },
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
    """Over the collapses with visible drifts."""
    drifts = [drift for drift in DRIFTS if drift >= VISIBLE]
    return float(np.mean([found[f"{name} {drift:g}"]["mean_width"] for drift in drifts]))


def _report(numbers: dict[str, Any]) -> list[str]:
    """Shares of time with the truth outside the limits, in per cent; mean widths."""
    brakes: dict[str, list[str]] = {}
    for deceleration, ramp in BRAKES:
        ends = brakes.setdefault(f"{deceleration:g}", [])
        ends.append(f"brakes {deceleration:g} ramp {ramp:g}")
    lines = [f"truth outside limits claimed at 1 − {speed_faults.RISK:g}, % of the time"]
    for title, columns in (
        (
            f"two radars collapse, radar 2 drifts by … m/s² (width: from {VISIBLE} on)",
            {f"{drift:g}": [f"{drift:g}"] for drift in DRIFTS},
        ),
        ("healthy radars, the train brakes by … m/s² (worst of the jerks)", brakes),
        (
            "three radars drift alike by … m/s² (no filter can know)",
            {f"{drift:g}": [f"alike {drift:g}"] for drift in DRIFTS},
        ),
    ):
        head = "".join(f"{column:>7}" for column in columns)
        lines += ["", title, f"{'':<18}{head}   width, m/s"]
        for name in (f"{rate:g}Hz {kind}" for kind in KINDS for rate in RATES):
            cells = [[numbers[f"{name} {end}"] for end in ends] for ends in columns.values()]
            shares = [100 * max(cell["misleading_fraction"] for cell in row) for row in cells]
            width = (
                numbers["mean_width"][name]
                if title.startswith("two")
                else np.mean([[cell["mean_width"] for cell in row] for row in cells])
            )
            row = "".join(f"{share:7.2f}" if share else f"{'0':>7}" for share in shares)
            lines.append(f"{name:<18}{row}   {width:.2f}")
    drifts = ", ".join(f"{drift:g}" for drift in COUNTS_DRIFTS)
    title = f"components carried; radar 2 drifts by {drifts} m/s², the train brakes by"
    lines += ["", f"{title} {BRAKES[-1][0]:g} m/s² at once"]
    for row in numbers["components"]:
        width = f"width {row['mean_width']:.2f}" if row["available_fraction"] else "no limits"
        lines.append(
            f"  {row['carry']} {row['components']}, {row['rate']:g} Hz: {width}, available "
            f"{row['available_fraction']:.1%}, misleading {row['misleading_fraction']:.2%}, "
            f"left out up to {row['max_discarded_mass']:.0e}"
        )
    return [*lines, "", numbers["note"]]
