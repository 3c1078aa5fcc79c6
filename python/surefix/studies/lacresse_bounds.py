"""e₁ and e₂ of the sine track: the paper's and tighter ones (Lacresse, Grall & Nikiforov 2005,
sections 4.3 and 5.3), and the worst that there really is."""

from __future__ import annotations

from surefix.raim.split import split
from surefix.studies.lacresse_critical import critical, just_missed
from surefix.studies.lacresse_sine import ALPHA, GAMMA, SineTrack
from surefix.studies.lacresse_worst import Worst, worst

BOUNDS = {  # fit of the affine model, bound on its error
    "": ("least-squares", "loose"),  # the paper
    "_tight": ("least-squares", "tight"),
    "_minimax": ("minimax", "loose"),
    "_minimax_tight": ("minimax", "tight"),
}


def indicators(track: SineTrack, length: float) -> dict[str, float]:
    """Of one amplitude: b, e₁ at λ_γ and e₂ at λ = 0 by each bound; with the paper's fit also e₁ at
    λ_max (section 5.3) and the suprema over λ (section 4.3)."""
    fitted = {fit: track.model(fit) for fit in ("least-squares", "minimax")}
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


def direct(of: Worst) -> dict[str, float]:
    """What looking at all of K finds, beside ``indicators``."""
    return {
        "b_direct": of.b,
        "e1_direct": of.e1,
        "e2_direct": of.e2,
        "p_star": of.p_star,
        "e1_satellite": of.e1_satellite,
    }


def row(track: SineTrack, length: float) -> dict[str, float]:
    """All of one amplitude."""
    return {**indicators(track, length), **direct(worst(track, length))}


def pieces(track: SineTrack) -> int:
    """Of K, until e₁ ≤ γ and e₂ ≤ α in every one: tests an epoch."""
    at = just_missed(track.model().degrees)
    return split(
        track.distances, 0.0, 1.0, e1=GAMMA, e2=ALPHA, noncentrality=at, **track.options
    ).cost
