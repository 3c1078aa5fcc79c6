"""Parellier, Barrau & Bonnabel 2023, section IV-C: a sinusoid of unknown frequency.

Figures 6 and 7, and what the paper does not have: an unknown phase, what its comparison with the
innovations depends on, how often a sinusoid is found at a stated probability of false alarm, and
how well its amplitude and its frequency between whole cycles are known.
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
from surefix.studies.parellier_cycles import found_by_prior, found_cycles, spans
from surefix.studies.parellier_particle import PAPER_AMPLITUDE, PAPER_CYCLES
from surefix.studies.parellier_sine_figure import make_figure
from surefix.studies.parellier_sine_report import report

RUNS, HEALTHY = 1000, 10_000
SEED = 11  # of the runs with faults; two more for healthy ones
AMPLITUDES, ESTIMATED = (0.25, 0.5, 0.75, 1.0, PAPER_AMPLITUDE), (0.5, 1.0, PAPER_AMPLITUDE)
GRID = np.arange(2, particle.N) / (2 * particle.N)  # half cycles; at N/2 a sine is 0 in all samples
TESTS = {
    "exact": "exact ratio",
    "imaginary": "imaginary part (the paper), threshold drawn",
    **peers.PEERS,
}

NOTE = (
    "2.5 sin(k/2) has 100/(4π) = 7.96 cycles. The paper's imaginary part is of a sine of known "
    "phase that begins with the record, and its largest value stands for a positive amplitude. "
    "All are compared at 1 to 49 whole cycles; phase drawn: uniform, in every run anew. The paper "
    "states neither x_0's covariance (here: I, unless said) nor the accelerations."
)


def run(
    out: Path, progress: Callable[[int, int], None], runs: int = RUNS, healthy: int = HEALTHY
) -> dict[str, Any]:
    """Writes detection.csv, cycles.csv, study.json and figure.png; returns the numbers."""
    flights = particle.fly(runs, SEED)
    phase = 2 * np.pi * np.random.RandomState(SEED + 3).uniform(size=runs)
    cycles = found_cycles(flights.z, AMPLITUDES, phase)
    priors = found_by_prior(runs, SEED, PAPER_AMPLITUDE)
    progress(1, 4)
    detection = _detection(flights.z, phase, healthy)
    progress(2, 4)
    estimates = [_estimates(flights.z, amplitude, phase) for amplitude in ESTIMATED]
    progress(3, 4)
    example = estimates[-1]
    numbers: dict[str, Any] = {
        "study": "parellier-sine",
        "note": NOTE,
        "runs": runs,
        "healthy_runs": healthy,
        "true_amplitude": PAPER_AMPLITUDE,
        "true_cycles": PAPER_CYCLES,
        **{name: example[name] for name in ("amplitude", "amplitude_se", "cycles")},
        "found_8": cycles,
        "found_8_by_prior": priors,
        "estimates": estimates,
        "detection": detection,
        "variance_span": spans(),
    }
    numbers["report"] = report(numbers, TESTS)
    tables.write_csv(out / "detection.csv", peers.columns(detection))
    tables.write_csv(out / "cycles.csv", peers.columns(cycles))
    tables.plain(out / "study.json", numbers)
    make_figure(numbers, flights, TESTS).savefig(out / "figure.png", dpi=150)
    progress(4, 4)
    return numbers


def _estimates(z: FloatArray, amplitude: float, phase: FloatArray) -> dict[str, Any]:
    """Medians over all runs, phase drawn but for the paper's amplitude, and how well standard
    errors, given the frequency, say how far the amplitude is off."""
    paper = amplitude == PAPER_AMPLITUDE
    record = particle.record(z + particle.sine(amplitude, 0.0 if paper else phase))
    found = sf.SpectrumDetector(frequencies=GRID, samples=0).run(record)
    a, error, cycles = (np.asarray(v) for v in (found.amplitude, found.amplitude_se, found.cycles))
    near = np.abs(cycles - PAPER_CYCLES) < 0.5
    return {
        "true_amplitude": amplitude,
        "phase": "paper" if paper else "drawn",
        "amplitude": float(np.median(a)),
        "amplitude_se": float(np.median(error)),
        "cycles": float(np.median(cycles)),
        "within_half_a_cycle": float(near.mean()),
        "of_these": {
            "cycles_mean": float(cycles[near].mean()),
            "cycles_deviation": float(cycles[near].std(ddof=1)),
            "amplitude_mean": float(a[near].mean()),
            "amplitude_deviation": float(a[near].std(ddof=1)),
            "within_2_se": float((np.abs(a - amplitude) < 2 * error)[near].mean()),
        },
    }


def _detection(z: FloatArray, phase: FloatArray, healthy: int) -> peers.Rows:
    """Shares of runs beyond the thresholds: of healthy ones, and of each sine."""
    drawn = _statistics(particle.fly(healthy, SEED + 1).z)
    limits = peers.thresholds(_threshold, {"imaginary": drawn["imaginary"]}, particle.N)
    others = _statistics(particle.fly(healthy, SEED + 2).z)
    rows = peers.shares(others, limits, phase="none", amplitude=0.0)
    for name, at in (("paper", np.zeros(len(z))), ("drawn", phase)):
        for amplitude in AMPLITUDES:
            of = _statistics(z + particle.sine(amplitude, at))
            rows += peers.shares(of, limits, phase=name, amplitude=amplitude)
    return rows


def _threshold(false_alarm: float) -> float | None:
    record = particle.record(particle.COUNT[None])  # on the schedule alone
    return sf.SpectrumDetector(frequencies=GRID, false_alarm=false_alarm).threshold(record)


def _statistics(z: FloatArray) -> dict[str, FloatArray]:
    record = particle.record(z)
    found = sf.SpectrumDetector(frequencies=GRID, samples=0).run(record)
    own = {"exact": np.asarray(found.drop), "imaginary": found.imaginary.max(axis=1)}
    return own | peers.statistics(record)
