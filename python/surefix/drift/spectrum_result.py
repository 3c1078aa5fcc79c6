"""What a spectrum detector found."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from surefix.core.checks import FloatArray
from surefix.drift.false_alarm import FalseAlarm, quadratic
from surefix.drift.outcome import Outcome, Scalar, magnitude
from surefix.drift.spectrum_search import SpectrumSearch

ZOOM = 17  # frequencies on either side of the best one, twice


class _Sinusoid(NamedTuple):
    """a cos ω(t - t₁) + b sin ω(t - t₁)."""

    frequency: float
    amplitude: float
    amplitude_se: float
    amplitudes: FloatArray  # a, b
    covariance: FloatArray
    ratio: float

    @property
    def phase(self) -> float:
        return float(np.arctan2(self.amplitudes[0], self.amplitudes[1]))


class SpectrumResult(Outcome):
    """A sinusoid a sin(2πf(t - t₁) + φ), t₁ the record's first measurement: ratio for every
    frequency, and the best of them. ``ratio`` (F,): drop of 𝓛 when the best sinusoid of that
    frequency is subtracted; χ² with two degrees of freedom with no fault.
    """

    def __init__(
        self,
        search: SpectrumSearch | None,
        interval: float,
        duration: float,
        origin: float,
        alone: bool,
        false_alarm: float,
        alarm: FalseAlarm | None,
        reason: str = "",
    ) -> None:
        self._search = search
        self._interval, self._duration, self._origin = interval, duration, origin
        usable = search is not None and alarm is not None
        ratio = quadratic(search.found, search.inverse) if search and usable else None
        super().__init__(reason, ratio, alone, false_alarm, alarm)

    @property
    def frequency(self) -> FloatArray:
        """(F,) [1/time]."""
        return np.zeros(0) if self._search is None else self._search.frequency

    @property
    def detectability(self) -> FloatArray:
        """(F,): share of the information that not knowing the state leaves."""
        return np.zeros(0) if self._search is None else self._search.share

    @property
    def power(self) -> FloatArray:
        """(F,) magnitude of the gradient's Fourier transform."""
        return self._runs(2 * np.linalg.norm(self._found(), axis=-1))

    @property
    def imaginary(self) -> FloatArray:
        """(F,) the paper's -Im of the gradient's Fourier transform (16), counted from 1: the drop
        to first order, per unit of amplitude, of a sine that begins with the record."""
        return self._runs(2 * np.einsum("rfa,fa->rf", self._found(), self._phase()))

    @property
    def imaginary_scaled(self) -> FloatArray:
        """``imaginary`` over its standard deviation with no fault."""
        if self._search is None:
            return np.zeros(0)
        phase = self._phase()
        gram = np.full_like(self._search.inverse, np.nan)
        usable = self._search.usable
        gram[usable] = np.linalg.inv(self._search.inverse[usable])
        deviation = 2 * np.sqrt(np.einsum("fa,fab,fb->f", phase, gram, phase))
        scaled: FloatArray = self.imaginary / deviation
        return scaled

    @property
    def best_frequency(self) -> Scalar:
        """The one of the largest ratio on the grid, on which false alarms are calibrated."""
        return self._at_best(self.frequency)

    @property
    def refined_frequency(self) -> Scalar:
        """Between those of the grid."""
        return self._each(lambda wave: wave.frequency)

    @property
    def cycles(self) -> Scalar:
        """Of the refined frequency, in the record: regular sampling counts one interval more than
        there is between the first and the last measurement."""
        return self._each(lambda wave: wave.frequency * self._duration)

    @property
    def amplitude(self) -> Scalar:
        return self._each(lambda wave: wave.amplitude)

    @property
    def amplitude_se(self) -> Scalar:
        """Given the frequency."""
        return self._each(lambda wave: wave.amplitude_se)

    @property
    def phase(self) -> Scalar:
        """φ [rad], -π to π."""
        return self._each(lambda wave: wave.phase)

    def found(self) -> dict[str, Any]:
        """The best sinusoid of a single run, by the names of a ``Fault``."""
        wave = self._refined[0]
        return {
            "frequency": wave.frequency, "amplitude": wave.amplitude,
            "amplitude_se": wave.amplitude_se, "amplitudes": wave.amplitudes,
            "covariance": wave.covariance, "phase": wave.phase, "origin": self._origin,
            "drop": wave.ratio,
        }  # fmt: skip

    def _each(self, of: Callable[[_Sinusoid], float]) -> Scalar:
        if self._best is None:
            return None
        return self._scalar(np.array([of(wave) for wave in self._refined]))

    @cached_property
    def _refined(self) -> list[_Sinusoid]:
        best = [] if self._best is None else self._best.tolist()
        return [self._refine(run, k) for run, k in enumerate(best)]

    def _refine(self, run: int, best: int) -> _Sinusoid:
        assert self._search is not None
        grid = self._search.frequency
        centre = float(grid[best])
        below = centre - float(grid[best - 1]) if best > 0 else 0.0
        above = float(grid[best + 1]) - centre if best + 1 < len(grid) else 0.0
        for _ in range(3):
            tried = np.concatenate(
                [centre - below * np.linspace(1, 0, ZOOM), centre + above * np.linspace(0, 1, ZOOM)]
            )
            inverse, _, found = self._search.ratio_at(tried, run)
            ratio = quadratic(found, inverse)[0]
            k = int(np.nanargmax(ratio))
            centre, below, above = float(tried[k]), below / (ZOOM - 1), above / (ZOOM - 1)
        amplitudes = inverse[k] @ found[0, k]
        size, error = magnitude(amplitudes, inverse[k])
        return _Sinusoid(centre, size, error, amplitudes, inverse[k], float(ratio[k]))

    def _found(self) -> FloatArray:
        return np.zeros((1, 0, 2)) if self._search is None else self._search.found

    def _phase(self) -> FloatArray:
        """(F, 2): cos and sin of the sine that is 0 one interval before the first measurement."""
        angle = 2 * np.pi * self.frequency * self._interval
        return np.stack([np.sin(angle), np.cos(angle)], axis=-1)
