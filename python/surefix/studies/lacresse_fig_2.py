"""Lacresse, Grall & Nikiforov 2005, section 5.3 and figure 2: what a track that is not straight
does to a test that takes it for straight, with real satellites.

e₁ and e₂ against the amplitude v of a sine track, α = 1e-5 and γ = 1e-3. e₂ is that of section 5.3,
at λ = 0. e₁ needs a noncentrality, of which the paper gives no number:

- ``e1``: at λ_γ, that of a fault missed with probability γ on a straight track. It is the smallest
  critical λ_i where the monitor is just available, p* = γ: the protection interval is as short as
  it can be. The study takes that L. Nothing else need be stated.
- ``e1_lambda_max``: at λ_max = max_i ‖W v_i*‖², as section 5.3 says, for that L, p_r and p_f. It is
  that of the satellite whose fault shows best, which is always seen.
- ``e1_supremum``: the supremum over all λ (section 4.3); that of e₂ is the same number.

Without a suffix the bound is the paper's, ‖W‖‖R‖ with a least-squares fit; ``_tight`` is
max ‖W E(l)‖, ``_minimax`` another fit. ``e1_satellite``: what faults of single satellites really
lose, by looking for the worst.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from surefix import tables
from surefix.core.checks import FloatArray
from surefix.studies.lacresse_bounds import pieces, row
from surefix.studies.lacresse_critical import FAULT, RISK, just_missed, shortest_interval
from surefix.studies.lacresse_crossings import by_heading, crossings, short_crossings
from surefix.studies.lacresse_fig_2_figure import make_figure
from surefix.studies.lacresse_fig_2_report import NOTE, report
from surefix.studies.lacresse_measured import Row, measure
from surefix.studies.lacresse_sine import ALPHA, GAMMA, KD, SIGMA, SineTrack
from surefix.studies.lacresse_sky import Sky, skies

AMPLITUDES = np.geomspace(0.1, 100.0, 31)  # v [m]
HEADINGS = np.arange(0.0, 180.0, 15.0)  # [degrees]; the other half mirrors it
DRAWN = (1.0, 2.0, 5.0, 10.0)  # v [m] of what is drawn, and of K in pieces
RUNS = 50_000
EXPECTED = {"e1": 1.0, "e2": 2.0}  # v [m], about, from another implementation, n = 8, σ = 5 m
SEED = 2005


def run(
    out: Path,
    progress: Callable[[int, int], None],
    *,
    recordings: Path | None = None,
    amplitudes: FloatArray = AMPLITUDES,
    headings: FloatArray = HEADINGS,
    drawn: Sequence[float] = DRAWN,
    runs: int = RUNS,
) -> dict[str, Any]:
    """Writes indicators.csv, measured.csv, study.json and figure.png; returns the numbers.
    ``recordings``: the folder with those that ``lacresse_sky`` reads where they are."""
    over = skies(recordings)
    found = []
    for k, sky in enumerate(over):
        found.append(_sky(sky, amplitudes, drawn, runs, SEED + 1000 * k))
        progress(k + 1, len(over) + 1)
    first = found[0]
    numbers: dict[str, Any] = {
        "study": "lacresse-fig-2",
        "note": NOTE,
        "false_alarm": ALPHA,
        "missed": GAMMA,
        "sigma": SIGMA,
        "kd": KD,
        "risk": RISK,
        "fault_probability": FAULT,
        "runs": runs,
        **first["indicators"],
        "crossings": first["crossings"],
        "expected": EXPECTED,
        "headings": by_heading(over[0], headings.tolist()),
        "skies": found,
    }
    numbers["report"] = report(numbers)
    tables.write_csv(out / "indicators.csv", _all(found))
    tables.write_csv(out / "measured.csv", _columns([r for sky in found for r in sky["measured"]]))
    tables.plain(out / "study.json", numbers)
    make_figure(numbers).savefig(out / "figure.png", dpi=150)
    progress(len(over) + 1, len(over) + 1)
    return numbers


def _sky(
    sky: Sky, amplitudes: FloatArray, drawn: Sequence[float], runs: int, seed: int
) -> dict[str, Any]:
    straight = SineTrack(sky, 0.0)
    length = shortest_interval(straight)
    test = straight.model().test
    rows = [row(SineTrack(sky, v), length) for v in amplitudes.tolist()]
    measured: list[Row] = []
    for k, v in enumerate(drawn):
        measured += measure(SineTrack(sky, v), length, runs, seed + 10 * k)
    return {
        "name": sky.name,
        "satellites": len(sky.satellites),
        "clocks": sky.clocks.shape[1],
        "degrees": test.degrees,
        "threshold": test.threshold,
        "lambda_gamma": just_missed(test.degrees),
        "length": length,
        "crossings": crossings(sky, length),
        "crossings_of_short_k": short_crossings(sky, length),
        "indicators": {name: column.tolist() for name, column in _columns(rows).items()},
        "pieces": [{"v": v, "pieces": pieces(SineTrack(sky, v))} for v in drawn],
        "measured": measured,
    }


def _all(found: list[dict[str, Any]]) -> dict[str, Any]:
    """The indicators of all skies, one below the other."""
    names = [sky["name"] for sky in found for _ in sky["indicators"]["v"]]
    columns = {
        name: np.concatenate([sky["indicators"][name] for sky in found])
        for name in found[0]["indicators"]
    }
    return {"sky": np.array(names), **columns}


def _columns(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    return {name: np.array([r[name] for r in rows]) for name in rows[0]}
