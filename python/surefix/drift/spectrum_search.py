"""The likelihood ratios of sinusoids through the whole record, for many frequencies."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from surefix import _core
from surefix.core.checks import FloatArray
from surefix.drift.false_alarm import Indices
from surefix.drift.forward_record import ForwardRecord, threads

GLOBAL_WORK = 100_000
"""Steps of a sample beyond which only the frequencies near the chosen one are looked at."""


class SpectrumSearch:
    """Numerators and inverse Gram matrices of cos and sin of F frequencies [1/time], ascending;
    time counts from the first measurement. ``reach``: how far in frequency ratios depend on one
    another, a few times the inverse of the record's duration."""

    def __init__(
        self, record: ForwardRecord, direction: FloatArray, frequency: FloatArray, reach: float
    ) -> None:
        self._record = record
        self._direction = direction
        self.reach = reach
        self.frequency = frequency
        self.inverse, self.share, self.found = self._sweep(record.innovations, frequency)
        self.usable: Indices = np.flatnonzero(self.share > _core.DETECTABLE)
        everywhere = 3 * record.engine.size * (1 + len(frequency) // 8)
        self._local = everywhere > GLOBAL_WORK
        near = np.searchsorted(frequency, frequency + reach) - np.searchsorted(
            frequency, frequency - reach
        )
        together = int(near.max()) if self._local else len(frequency)
        self.work = 8 * record.engine.size * (1 + together // 8)

    @cached_property
    def variances(self) -> FloatArray:
        return 1 / self._record.engine.inverse

    def near(self, which: int) -> Indices | None:
        """Beyond their reach ratios are independent: that others exceed too is not counted, which
        makes the probability of a false alarm p larger by a factor of at most 1 + p."""
        if not self._local:
            return None
        near: Indices = np.flatnonzero(np.abs(self.frequency - self.frequency[which]) <= self.reach)
        return near

    def numerators(self, innovations: FloatArray, at: Indices | None = None) -> FloatArray:
        return self._sweep(innovations, self.frequency if at is None else self.frequency[at])[2]

    def response(self, which: int) -> FloatArray:
        return self._record.engine.wave(self._direction, 2 * np.pi * float(self.frequency[which]))

    def ratio_at(
        self, frequency: FloatArray, run: int
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Inverse (F, 2, 2), share and numerators (1, F, 2) of one run at other frequencies."""
        return self._sweep(self._record.innovations[run : run + 1], frequency)

    def reason(self) -> str:
        if not np.isfinite(self.share).any():
            return "amplitude and phase cannot be told apart there, as at half the sampling rate"
        return "oscillations at all these frequencies hide in what the model itself can do"

    def _sweep(
        self, innovations: FloatArray, frequency: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        return self._record.engine.spectrum(
            self._direction,
            2 * np.pi * np.ascontiguousarray(frequency),
            innovations,
            threads() if len(frequency) * innovations.size > 1_000_000 else 1,
        )
