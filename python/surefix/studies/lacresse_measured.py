"""The bounds of ``lacresse_bounds`` against what is drawn."""

from __future__ import annotations

from typing import Any

import numpy as np

from surefix.core.checks import FloatArray
from surefix.raim.affine import AffineModel
from surefix.raim.chi_squared import missed
from surefix.studies.lacresse_critical import critical, just_missed
from surefix.studies.lacresse_sampling import Share, false_alarms, missed_faults
from surefix.studies.lacresse_sine import ALPHA, GAMMA, SineTrack
from surefix.studies.lacresse_worst import Worst, parity_error, worst

Row = dict[str, Any]


def measure(track: SineTrack, length: float, runs: int, seed: int) -> list[Row]:
    """Where each is worst: false alarms, how often a fault of λ_γ in the worst direction is missed,
    and the critical bias of the worst satellite. ``exact`` follows from λ_t; the power is 1 less
    what is missed."""
    model, of = track.model(), worst(track, length)
    least = just_missed(model.degrees)
    own = float(critical(track, length)[of.satellite])
    quiet = false_alarms(track, of.l, runs, seed)
    fault = missed_faults(track, of.l, worst_bias(track, model, of), runs, seed + 1)
    single = missed_faults(track, of.l_satellite, satellite_bias(model, of, own), runs, seed + 2)
    return [
        {
            **_row("false alarms", track, of.l, quiet, ALPHA + of.e2),
            **{f"low_{bound}": ALPHA for bound in ("loose", "tight")},
            **{f"high_{bound}": ALPHA + model.e2(bound=bound) for bound in ("loose", "tight")},
        },
        {
            **_row("missed, any fault", track, of.l, fault, GAMMA + of.e1),
            **_limits(model, least),
        },
        {
            **_row("missed, one satellite", track, of.l_satellite, single, of.missed_satellite),
            **_limits(model, own),
        },
    ]


def worst_bias(track: SineTrack, model: AffineModel, of: Worst) -> FloatArray:
    """(n,) [m] of λ_γ, against the error at the worst place."""
    error = parity_error(track, model, np.array([of.l]))[0]
    against = -np.sqrt(just_missed(model.degrees)) * error / np.linalg.norm(error)
    return np.asarray(model.test.root @ (against @ model.W))


def satellite_bias(model: AffineModel, of: Worst, noncentrality: float) -> FloatArray:
    """(n,) [m] of the worst satellite, with that λ."""
    unit = np.eye(len(model.A))[of.satellite] * of.sign
    return np.asarray(unit * np.sqrt(noncentrality / model.test.noncentrality(unit)))


def inside(row: Row, bound: str, errors: float) -> bool:
    """Whether a measured share is within the bounds, or beyond them by so many standard errors:
    where the truth reaches a bound, half of the shares are beyond it."""
    margin = errors * row["error"]
    return bool(row[f"low_{bound}"] - margin <= row["value"] <= row[f"high_{bound}"] + margin)


def _row(what: str, track: SineTrack, l: float, share: Share, exact: float) -> Row:  # noqa: E741
    return {
        "sky": track.sky.name,
        "v": track.amplitude,
        "what": what,
        "l": l,
        "value": share.value,
        "error": share.error,
        "exact": exact,
        "off": (share.value - exact) / share.error,
    }


def _limits(model: AffineModel, noncentrality: float) -> Row:
    """1 - β₂ and 1 - β₁."""
    out, root = {}, np.sqrt(noncentrality)
    for bound in ("loose", "tight"):
        b = model.bound(bound)
        for name, shifted in (("low", root + b), ("high", max(root - b, 0.0))):
            out[f"{name}_{bound}"] = float(missed(shifted**2, model.degrees, ALPHA))
    return out
