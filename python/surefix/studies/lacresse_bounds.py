"""e₁ and e₂ of the sine track: the paper's, tighter ones, and the amplitudes at which they pass γ
and α (Lacresse, Grall & Nikiforov 2005, sections 4.3 and 5.3)."""

from __future__ import annotations

from typing import Any

import numpy as np

from surefix.raim.affine import AffineModel
from surefix.studies.lacresse_critical import bisect, critical, just_missed
from surefix.studies.lacresse_sine import ALPHA, GAMMA, SineTrack
from surefix.studies.lacresse_sky import Sky

BOUNDS = {  # fit of the affine model, bound on its error
    "": ("least-squares", "loose"),  # the paper
    "_tight": ("least-squares", "tight"),
    "_minimax": ("minimax", "loose"),
    "_minimax_tight": ("minimax", "tight"),
}
SMALLEST, LARGEST = 1e-3, 1e3  # v [m] between which crossings are looked for
HEADINGS = np.arange(0.0, 180.0, 15.0)  # of the track [degrees]; the other half mirrors it


def models(track: SineTrack) -> dict[str, AffineModel]:
    """By fit."""
    return {fit: track.model(fit) for fit in ("least-squares", "minimax")}


def indicators(track: SineTrack, length: float) -> dict[str, float]:
    """Of one amplitude: b, e₁ at λ_γ and e₂ at λ = 0 by each bound; with the paper's fit also e₁ at
    λ_max (section 5.3) and the suprema over λ (section 4.3)."""
    fitted = models(track)
    paper = fitted["least-squares"]
    at = just_missed(paper.degrees)
    most = float(critical(track, length).max())
    out = {"v": track.amplitude}
    for suffix, (fit, bound) in BOUNDS.items():
        out[f"b{suffix}"] = fitted[fit].bound(bound)
        out[f"e1{suffix}"] = fitted[fit].e1(noncentrality=at, bound=bound)
        out[f"e2{suffix}"] = fitted[fit].e2(bound=bound)
    out["lambda_max"] = most
    for suffix, bound in (("", "loose"), ("_tight", "tight")):
        out[f"e1_lambda_max{suffix}"] = paper.e1(noncentrality=most, bound=bound)
        out[f"e1_supremum{suffix}"] = paper.e1(bound=bound)
        out[f"e2_supremum{suffix}"] = paper.e2(noncentrality=None, bound=bound)
    return out


def crossings(sky: Sky, heading: float = 90.0) -> dict[str, float]:
    """The amplitudes [m] at which e₁ passes γ and e₂ passes α, by each bound."""
    at = just_missed(SineTrack(sky, 1.0).model().degrees)
    out = {}
    for suffix, (fit, bound) in BOUNDS.items():

        def e1(v: float, fit: str = fit, bound: str = bound) -> float:
            model = SineTrack(sky, v, heading).model(fit)
            return float(model.e1(noncentrality=at, bound=bound)) - GAMMA

        def e2(v: float, fit: str = fit, bound: str = bound) -> float:
            return float(SineTrack(sky, v, heading).model(fit).e2(bound=bound)) - ALPHA

        out[f"e1{suffix}"] = bisect(e1, SMALLEST, LARGEST)
        out[f"e2{suffix}"] = bisect(e2, SMALLEST, LARGEST)
    return out
