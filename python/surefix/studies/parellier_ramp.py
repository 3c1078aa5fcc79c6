"""Parellier, Barrau & Bonnabel 2023, section IV-B: a ramp that begins at an unknown time.

Figures 3 to 5, and what the paper does not have: how often a ramp is found at a stated probability
of false alarm, beside tests of the innovations, and how well its onset is found.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import surefix as sf
from surefix import tables
from surefix.core.checks import FloatArray
from surefix.studies import parellier_particle as particle
from surefix.studies import parellier_peers as peers
from surefix.studies.parellier_onsets import located, onset_errors, reproduced
from surefix.studies.parellier_particle import PAPER_ONSET, PAPER_SLOPE
from surefix.studies.parellier_ramp_figure import make_figure
from surefix.studies.parellier_ramp_report import report

RUNS, HEALTHY = 1000, 20_000
SEED = 1  # of the runs with faults; two more for healthy ones
SLOPES, ONSETS = (0.05, 0.1, 0.2, 0.3, 0.5), (39, 15, 80)
DRAWN = ("first_order", "first_order_magnitude")  # those without a threshold of their own
TESTS = {
    "exact": "exact ratio",
    "first_order": "first order (the paper), threshold drawn",
    "first_order_magnitude": "first order, in magnitude, threshold drawn",
    **peers.PEERS,
}

NOTE = (
    "Onsets count as in (25), where the first sample that carries something is 39; a ramp that is "
    "0 at its onset, as in (17) and in surefix, begins one sample earlier. The paper's indicator "
    "has the sign of a growing ramp; in magnitude it is what onset_first_order of surefix is. The "
    "paper states neither x_0's covariance (here: I) nor the accelerations (here: one sequence)."
)


def run(
    out: Path, progress: Callable[[int, int], None], runs: int = RUNS, healthy: int = HEALTHY
) -> dict[str, Any]:
    """Writes detection.csv, onset_error.csv, study.json and figure.png; returns the numbers."""
    flights = particle.fly(runs, SEED)
    example = _example(flights.z)
    progress(1, 4)
    detection = _detection(flights.z, healthy)
    progress(2, 4)
    errors = onset_errors(flights.z)
    progress(3, 4)
    numbers: dict[str, Any] = {
        "study": "parellier-ramp",
        "note": NOTE,
        "runs": runs,
        "healthy_runs": healthy,
        "slope": PAPER_SLOPE,
        "onset": PAPER_ONSET,
        **example,
        "reproduced": reproduced(flights.z),
        "detection": detection,
        "onset_error": errors,
    }
    numbers["report"] = report(numbers, TESTS)
    tables.write_csv(out / "detection.csv", peers.columns(detection))
    tables.write_csv(out / "onset_error.csv", peers.columns(errors))
    tables.plain(out / "study.json", numbers)
    make_figure(numbers, flights, TESTS).savefig(out / "figure.png", dpi=150)
    progress(4, 4)
    return numbers


def _example(z: FloatArray) -> dict[str, Any]:
    """The paper's ramp in all runs: where each indicator has it, how large it is."""
    record = particle.record(z + particle.ramp(PAPER_SLOPE, PAPER_ONSET))
    found = sf.OnsetDetector(sf.Profile.ramp()).run(record)
    truth = int(np.flatnonzero(found.time == PAPER_ONSET - 1)[0])
    best, error = np.asarray(found.amplitude), np.asarray(found.amplitude_se)
    at_truth, its_error = found.amplitudes[:, truth], float(found.amplitude_ses[truth])
    onsets = {name: _spread(onset) for name, onset in located(found).items()}
    return {
        "onset_first_order": onsets["first_order"]["median"],
        "onset_exact": onsets["exact"]["median"],
        "amplitude": float(np.median(best)),
        "amplitude_se": float(np.median(error)),
        "onsets": onsets,
        "amplitude_at_true_onset": {
            "mean": float(at_truth.mean()),
            "deviation": float(at_truth.std(ddof=1)),
            "amplitude_se": its_error,
        },
        "within_2_se": {
            "at_best_onset": float((np.abs(best - PAPER_SLOPE) < 2 * error).mean()),
            "at_true_onset": float((np.abs(at_truth - PAPER_SLOPE) < 2 * its_error).mean()),
        },
    }


def _spread(onset: FloatArray) -> dict[str, Any]:
    """Median, its interval of 95 % (by order statistics), quartiles, and how many are near."""
    order, n = np.sort(onset), len(onset)
    half = sf.two_sided_quantile(0.05) * np.sqrt(n) / 2
    low, high = max(0, int(np.floor(n / 2 - half))), min(n - 1, int(np.ceil(n / 2 + half)))
    error = np.abs(onset - PAPER_ONSET)
    return {
        "median": float(np.median(onset)),
        "median_interval": [float(order[low]), float(order[high])],
        "median_as_17": float(np.median(onset)) - 1,
        "quartiles": np.percentile(onset, [25, 75]).tolist(),
        "mean_absolute_error": float(error.mean()),
        "within_5": float((error <= 5).mean()),
        "within_10": float((error <= 10).mean()),
    }


def _detection(z: FloatArray, healthy: int) -> peers.Rows:
    """Shares of runs beyond the thresholds: of healthy ones (onset 0), and of each ramp."""
    drawn = _statistics(particle.fly(healthy, SEED + 1).z)
    limits = peers.thresholds(_threshold, {name: drawn[name] for name in DRAWN}, particle.N)
    others = _statistics(particle.fly(healthy, SEED + 2).z)
    rows = peers.shares(others, limits, onset=0, slope=0.0)
    for onset in ONSETS:
        for slope in SLOPES:
            of = _statistics(z + particle.ramp(slope, onset))
            rows += peers.shares(of, limits, onset=onset, slope=slope)
    return rows


def _threshold(false_alarm: float) -> float | None:
    record = particle.record(particle.COUNT[None])  # on the schedule alone
    detector = sf.OnsetDetector(sf.Profile.ramp(), false_alarm=false_alarm, samples=2048)
    return detector.threshold(record)


def _statistics(z: FloatArray) -> dict[str, FloatArray]:
    record = particle.record(z)
    found = sf.OnsetDetector(sf.Profile.ramp(), samples=0).run(record)
    indicator = found.first_order
    own = {
        "exact": np.asarray(found.drop),
        "first_order": indicator.max(axis=1),
        "first_order_magnitude": np.abs(indicator).max(axis=1),
    }
    return own | peers.statistics(record)
