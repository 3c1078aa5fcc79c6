"""The amplitudes of the sine track at which e₁ passes γ and e₂ passes α."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import pairwise
from typing import TypeAlias

import numpy as np

from surefix.studies.lacresse_bounds import BOUNDS
from surefix.studies.lacresse_critical import bisect, critical, just_missed
from surefix.studies.lacresse_sine import ALPHA, EAST, GAMMA, KD, SineTrack
from surefix.studies.lacresse_sky import Sky
from surefix.studies.lacresse_worst import worst

SMALLEST, LARGEST = 1e-5, 1e3  # v [m] between which they are looked for
STEPS = 17  # of v, before the first crossing is narrowed down
CREST = 0.25  # l at which the track bends most

Value: TypeAlias = Callable[[SineTrack], float]


def first(sky: Sky, value: Value, limit: float, heading: float = EAST) -> float:
    """The smallest v [m] at which ``value`` passes a limit; 0 where it is beyond it on a straight
    track, whose distances are not linear either; nan where it does not pass it."""

    def above(v: float) -> float:
        return value(SineTrack(sky, v, heading)) - limit

    if above(0.0) > 0:
        return 0.0
    grid = np.geomspace(SMALLEST, LARGEST, STEPS).tolist()
    for low, high in pairwise(grid):
        if above(high) > 0:
            return bisect(above, low, high)
    return float("nan")


def e1(fit: str = "least-squares", bound: str = "tight", half: float = 0.5) -> Value:
    """At λ_γ. ``half``: half the length of K; short of all of it, K is about the crest."""

    def value(track: SineTrack) -> float:
        model = track.model(fit, *_interval(half))
        return float(model.e1(noncentrality=just_missed(model.degrees), bound=bound))

    return value


def e2(fit: str = "least-squares", bound: str = "tight", half: float = 0.5) -> Value:
    """At λ = 0."""
    return lambda track: float(track.model(fit, *_interval(half)).e2(bound=bound))


def crossings(sky: Sky, length: float) -> dict[str, float]:
    """By each bound; of the paper's e₁ also at λ_max and as a supremum; and of what faults of
    single satellites really lose."""
    out: dict[str, float] = {}
    for suffix, (fit, bound) in BOUNDS.items():
        out[f"e1{suffix}"] = first(sky, e1(fit, bound), GAMMA)
        out[f"e2{suffix}"] = first(sky, e2(fit, bound), ALPHA)

    def at_lambda_max(track: SineTrack) -> float:
        most = critical(track, length).max()
        return float(track.model().e1(noncentrality=most, bound="loose"))

    out["e1_lambda_max"] = first(sky, at_lambda_max, GAMMA)
    out["e1_supremum"] = first(sky, lambda track: float(track.model().e1(bound="loose")), GAMMA)
    out["e1_satellite"] = first(sky, lambda track: worst(track, length).e1_satellite, GAMMA)
    return out


def short_crossings(sky: Sky, length: float) -> dict[str, float]:
    """By the tight bound where K is only as long as the protection interval, L [m]; and the radius
    [m] that the track has at its crest there."""
    half = length / KD / 2
    found = {"e1": first(sky, e1(half=half), GAMMA), "e2": first(sky, e2(half=half), ALPHA)}
    radii = {f"radius_{name}": KD**2 / (4 * np.pi**2 * v) for name, v in found.items()}
    return {**found, **radii}


def by_heading(sky: Sky, headings: Iterable[float]) -> list[dict[str, float]]:
    """By the tight bound, for tracks in other directions [degrees]."""
    return [
        {
            "heading": heading,
            "e1_tight": first(sky, e1(), GAMMA, heading),
            "e2_tight": first(sky, e2(), ALPHA, heading),
        }
        for heading in headings
    ]


def _interval(half: float) -> tuple[float, float]:
    return (0.0, 1.0) if half >= 0.5 else (CREST - half, CREST + half)
