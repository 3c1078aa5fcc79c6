"""How well the onset of a ramp is found, by slope, onset and indicator."""

from __future__ import annotations

from typing import Any

import numpy as np

import surefix as sf
from surefix.core.checks import FloatArray
from surefix.studies import parellier_particle as particle
from surefix.studies.parellier_peers import Rows

INDICATORS = {
    "first_order": "first order, the paper",
    "first_order_magnitude": "first order, in magnitude",
    "exact": "exact ratio",
    "exact_inner": "exact ratio, without the last 5 onsets",
}
SLOPES = (0.05, 0.1, 0.2, 0.3, 0.5, 1.0)
ONSETS = (15, 39, 60, 80)
LAST = 5

# Slope, first sample, then mean absolute errors of the index of (17): of the first-order indicator
# and of the exact ratio, in 200 runs of another implementation.
EXPECTED = (
    (0.3, 15, 5.1, 3.5),
    (0.3, 39, 2.2, 2.3),
    (0.3, 80, 3.9, 2.5),
    (0.1, 39, 8.7, 16.3),
)
EXPECTED_RUNS, ROUNDING = 200, 0.05


def located(found: sf.OnsetResult) -> dict[str, FloatArray]:
    """First sample that carries something (runs,), by each of ``INDICATORS``."""
    inner = found.ratio[:, : particle.N - LAST]
    onsets = {
        "first_order": found.time[found.first_order.argmax(axis=1)],
        "first_order_magnitude": np.asarray(found.onset_first_order),
        "exact": np.asarray(found.onset),
        "exact_inner": found.time[np.nanargmax(inner, axis=1)],
    }
    return {name: onset + 1 for name, onset in onsets.items()}


def onset_errors(z: FloatArray) -> Rows:
    """Mean absolute and mean errors, of each slope and onset, on the same healthy runs z."""
    rows: Rows = []
    for slope in SLOPES:
        for onset in ONSETS:
            row: dict[str, Any] = {"slope": slope, "onset": onset}
            for name, at in _located(z, slope, onset).items():
                error = np.abs(at - onset)
                row[name] = float(error.mean())
                row[f"{name}_se"] = float(error.std(ddof=1) / np.sqrt(len(error)))
                row[f"{name}_bias"] = float((at - onset).mean())
            rows.append(row)
    return rows


def reproduced(z: FloatArray) -> Rows:
    """``EXPECTED`` beside the same here. They agree if the difference is within 3 standard errors
    of both."""
    rows: Rows = []
    for slope, onset, *expected in EXPECTED:
        at = _located(z, slope, onset)
        for name, other in zip(("first_order", "exact"), expected, strict=True):
            error = np.abs(at[name] - 1 - onset)
            deviation = float(error.std(ddof=1))
            both = deviation * np.sqrt(1 / len(error) + 1 / EXPECTED_RUNS)
            rows.append(
                {
                    "slope": slope,
                    "onset": onset,
                    "indicator": name,
                    "expected": other,
                    "error": float(error.mean()),
                    "error_se": deviation / np.sqrt(len(error)),
                    "agrees": bool(abs(error.mean() - other) < 3 * both + ROUNDING),
                }
            )
    return rows


def _located(z: FloatArray, slope: float, onset: int) -> dict[str, FloatArray]:
    record = particle.record(z + particle.ramp(slope, onset))
    return located(sf.OnsetDetector(sf.Profile.ramp(), samples=0).run(record))
