"""The result of the study ``lacresse-fig-2`` as lines of text."""

from __future__ import annotations

from math import isnan
from typing import Any

import numpy as np

from surefix.studies.lacresse_measured import Row, inside

NOTE = (
    "The paper states neither satellites nor σ, k_d, L, p_r, p_f nor numbers in its figure, whose "
    "axes' values are unknown: what can be compared is its shape and its claim that e₁ and e₂ "
    "quickly become non-negligible. Here σ = 5 m and k_d = 1000 m; E(l) is nearly proportional to "
    "v/σ, so an amplitude stands for v σ/5 m. e₁ is at λ of a fault missed with γ; at the λ_max of "
    "section 5.3, that of the satellite whose fault shows best, nothing is lost."
)
SHOWN = (0.1, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0)  # v [m], the nearest of the study's
COLUMNS = {
    "e1": "e1",
    "e1_tight": "tight",
    "e1_minimax_tight": "minimax",
    "e1_satellite": "1 sat.",
    "e1_lambda_max": "λ_max",
    "e1_supremum": "sup",
    "e2": "e2",
    "e2_tight": "tight",
    "e2_minimax_tight": "minimax",
}
"""tight, minimax: max ‖W E(l)‖, and with the other fit; 1 sat.: what faults of single satellites
lose; λ_max, sup: the paper's bound at other λ."""


def report(numbers: dict[str, Any]) -> list[str]:
    """The numbers of the study."""
    lines: list[str] = []
    for sky in numbers["skies"]:
        lines += [*_sky(sky), ""]
    return [*lines, *_headings(numbers), "", *_drawn(numbers), "", NOTE]


def _sky(sky: dict[str, Any]) -> list[str]:
    of = sky["indicators"]
    v = np.array(of["v"])
    at = sorted({int(np.argmin(np.abs(np.log(v / shown)))) for shown in SHOWN})
    found, short = sky["crossings"], sky["crossings_of_short_k"]
    cut = ", ".join(f"{row['pieces']} at {row['v']:g} m" for row in sky["pieces"])
    return [
        f"{sky['name']}: satellites {sky['satellites']}, clocks {sky['clocks']}, degrees of "
        f"freedom {sky['degrees']}; p* = γ with L = {sky['length']:.1f} m",
        f"{'v (m)':>8}" + "".join(f"{label:>11}" for label in COLUMNS.values()),
        *(f"{v[k]:8.3g}" + "".join(f"{of[name][k]:11.2g}" for name in COLUMNS) for k in at),
        f"{'passes':>8}" + "".join(f"{_metres(found[name]):>11}" for name in COLUMNS),
        f"K only L long, at the crest: e1 passes γ at v = {_metres(short['e1'])} (radius "
        f"{_metres(short['radius_e1'])}), e2 α at {_metres(short['e2'])} (radius "
        f"{_metres(short['radius_e2'])})",
        f"pieces of K until e1 <= γ and e2 <= α: {cut}",
    ]


def _metres(v: float) -> str:
    return "nowhere" if isnan(v) else f"{v:.3g} m"


def _headings(numbers: dict[str, Any]) -> list[str]:
    """What was expected is of 8 other satellites, and a track in one direction."""
    rows, expected = numbers["headings"], numbers["expected"]
    spans = {name: [row[f"{name}_tight"] for row in rows] for name in expected}
    within = all(min(spans[name]) <= v <= max(spans[name]) for name, v in expected.items())
    return [
        f"{len(rows)} headings of the track, {numbers['skies'][0]['name']}, tight: "
        + "; ".join(f"{k} passes at {min(v):.2f} to {max(v):.2f} m" for k, v in spans.items()),
        f"expected, of 8 other satellites: {expected['e1']:g} and {expected['e2']:g} m: "
        + ("within these" if within else "NOT within these"),
    ]


def _drawn(numbers: dict[str, Any]) -> list[str]:
    rows = [row for sky in numbers["skies"] for row in sky["measured"]]
    lines = [f"drawn where it is worst, {numbers['runs']:,} epochs each, importance sampling"]
    lines += [
        f"{row['sky']:<18}v = {row['v']:<4g}{row['what']:<23}{row['value']:9.3g} ± "
        f"{row['error']:<8.1g} exact {row['exact']:<9.3g} bounds {row['low_tight']:.2g} to "
        f"{row['high_tight']:.3g}, the paper's to {row['high_loose']:.3g}"
        for row in rows
    ]
    off = np.array([row["off"] for row in rows])
    lines.append(
        f"{len(rows)} shares: {np.mean(np.abs(off) < 1):.0%} within 1 standard error of the exact "
        f"probability, the farthest {np.abs(off).max():.1f}; within the tight bounds, which the "
        f"worst case reaches: {_count(rows, 'tight', 0)}, but for 3 standard errors "
        f"{_count(rows, 'tight', 3)}; within the paper's: {_count(rows, 'loose', 0)} and "
        f"{_count(rows, 'loose', 3)}"
    )
    return lines


def _count(rows: list[Row], bound: str, errors: float) -> int:
    return sum(inside(row, bound, errors) for row in rows)
