"""False alarms of a track monitor on a recording without faults, and why they are not as rare as
claimed: a station that stands still, on a track through it."""

from __future__ import annotations

from typing import Any

import numpy as np

from surefix.core import checks
from surefix.core.checks import FloatArray
from surefix.raim.geodesy import ecef_to_geodetic, local_axes
from surefix.raim.pseudoranges import Pseudoranges
from surefix.raim.result import RaimResult
from surefix.raim.track import Track

ALPHAS = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5)


def circle(position: FloatArray, heading_deg: float, radius: float = 1000.0) -> Track:
    """A track that passes through ``position`` (3,) [m] at mileage 0 with that heading (from north
    over east) and bends to the left; an eighth of the circle on each side."""
    lat, lon, _ = ecef_to_geodetic(position)
    east, north, _ = local_axes(lat, lon)
    angle = np.radians(checks.number("heading_deg", heading_deg))
    forward = np.sin(angle) * east + np.cos(angle) * north
    left = np.sin(angle) * north - np.cos(angle) * east

    def curve(along: FloatArray) -> FloatArray:
        turned = np.asarray(along)[:, None] / radius
        return np.asarray(
            position + radius * (np.sin(turned) * forward + (1 - np.cos(turned)) * left)
        )

    end = radius * np.pi / 4
    return Track.analytic(curve, -end, end, error=1e-5)


def alarm_shares(result: RaimResult, alphas: tuple[float, ...] = ALPHAS) -> dict[float, float]:
    """Share of the epochs that were tested whose p-value is at most α, by α."""
    p = result.p_value[np.isfinite(result.p_value)]
    return {alpha: float(np.mean(p <= alpha)) for alpha in alphas}


def whiteness(data: Pseudoranges, result: RaimResult) -> dict[str, Any]:
    """Of the whitened residuals, by satellite. ``constant``: share of ΣΛ that the satellites' means
    over the recording make up; ``lag_1``: correlation with the epoch before, as it is, and
    ``lag_1_less_mean`` without the means; ``independent``: epochs that are worth as much as all,
    T (1 - ρ²)/(1 + ρ²) with that first correlation ρ, for a mean of squares."""
    square = constant = 0.0
    pairs = np.zeros(2)
    spread = np.zeros(2)
    means = {}
    for name in np.unique(data.satellite):
        at = (data.satellite == name) & np.isfinite(result.residual)
        r = result.residual[at]
        if len(r) < 3:
            continue
        square += float(r @ r)
        constant += len(r) * float(r.mean()) ** 2
        means[str(name)] = float(r.mean())
        follows = np.diff(data.epoch[at]) == 1
        for k, values in enumerate((r, r - r.mean())):
            pairs[k] += float((values[1:] * values[:-1])[follows].sum())
            spread[k] += float((values[1:] ** 2 + values[:-1] ** 2)[follows].sum() / 2)
    raw, centred = pairs / spread
    return {
        "constant": constant / square, "lag_1": float(raw), "lag_1_less_mean": float(centred),
        "independent": float(len(result.time) * (1 - raw**2) / (1 + raw**2)), "means": means,
    }  # fmt: skip
