"""In how many runs the whole number of cycles of a sinusoid is found, and by what."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

import surefix as sf
from surefix.core.checks import FloatArray
from surefix.studies import parellier_particle as particle
from surefix.studies.parellier_peers import Rows, normalised

LOCATORS = {
    "imaginary": "imaginary part of the gradient's, the paper",
    "imaginary_scaled": "the same over its deviation, in magnitude",
    "power": "magnitude of the gradient's",
    "exact": "exact ratio",
    "innovations": "innovations' spectrum, the paper's comparison",
    "normalised": "spectrum of the normalised innovations",
}
CYCLES = np.arange(1, particle.N // 2)
PRIORS = (1.0, 1e2, 1e4, 1e6)  # variances of x_0

EXPECTED_SPAN = 274  # largest over smallest variance of the gradient's spectrum, in the design
LENGTHS = (particle.N, 200, 400, 800)


def spectra(record: sf.ForwardRecord) -> dict[str, FloatArray]:
    """(runs, cycles) by each of ``LOCATORS``."""
    detector = sf.SpectrumDetector(frequencies=CYCLES / particle.N, samples=0)
    found = detector.run(record)
    return {
        "imaginary": found.imaginary,
        "imaginary_scaled": np.abs(found.imaginary_scaled),
        "power": found.power,
        "exact": found.ratio,
        "innovations": _spectrum(record.innovations),
        "normalised": _spectrum(normalised(record)),
    }


def found_cycles(z: FloatArray, amplitudes: Sequence[float], phase: FloatArray) -> Rows:
    """Shares of runs with 8 cycles, of each amplitude: with the paper's phase, and with drawn
    ones, (runs,)."""
    return [
        {"phase": name, "amplitude": amplitude}
        | _shares(particle.record(z + particle.sine(amplitude, at)))
        for name, at in (("paper", np.zeros(len(z))), ("drawn", phase))
        for amplitude in amplitudes
    ]


def found_by_prior(runs: int, seed: int, amplitude: float) -> Rows:
    """The same for the paper's phase, where less and less is known of x_0."""
    rows: Rows = []
    for prior in PRIORS:
        z = particle.fly(runs, seed, prior).z + particle.sine(amplitude)
        rows.append({"prior": prior} | _shares(particle.record(z, prior)))
    return rows


def spans() -> Rows:
    """Largest over smallest variance, with no fault, of the gradient's spectrum: exact, 4 wᴴΓ⁻¹w.
    A row for each length of record."""
    rows: Rows = []
    for N in LENGTHS:
        unit = sf.ForwardRecord(particle.system(push=0.0), np.eye(N)[:, :, None])
        inverse = unit.gradient[:, :, 0] / 2  # Γ⁻¹
        wave = np.exp(-2j * np.pi / N * np.outer(np.arange(N // 2), np.arange(1, N + 1)))
        power = _forms(wave.real, inverse) + _forms(wave.imag, inverse)
        imaginary = _forms(wave.imag, inverse)[1:]
        span = float(power[1:].max() / power[1:].min())
        rows.append(
            {
                "N": N,
                "power": span,
                "imaginary": float(imaginary.max() / imaginary.min()),
                "with_0": float(power.max() / power.min()),
                "agrees": abs(span / EXPECTED_SPAN - 1) < 0.05,
            }
        )
    return rows


def _shares(record: sf.ForwardRecord) -> dict[str, float]:
    nearest = round(particle.PAPER_CYCLES)
    by = {name: CYCLES[values.argmax(axis=1)] for name, values in spectra(record).items()}
    return {name: float((cycles == nearest).mean()) for name, cycles in by.items()}


def _spectrum(values: FloatArray) -> FloatArray:
    result: FloatArray = np.abs(np.fft.rfft(values, axis=1)[:, CYCLES])
    return result


def _forms(w: FloatArray, inverse: FloatArray) -> FloatArray:
    result: FloatArray = ((w @ inverse) * w).sum(axis=1)
    return result
