"""Faults with an unknown end: the difference of two profiles, for every pair of onset and end."""

from __future__ import annotations

import numpy as np

from surefix import _core
from surefix.core.checks import FloatArray
from surefix.drift.false_alarm import Indices
from surefix.drift.onset_search import OnsetSearch
from surefix.errors import ShapeError

MAX_ONSETS = 2000
MAX_NUMBERS = 2e7  # of which it holds some at once


class EndingSearch:
    """d_m - d_m' for every m < m': truncated ramps from ramps, pulses from steps. O(K²) ratios for
    K onsets, from the K numerators and one K × K matrix of how they depend on one another; O(K N)
    memory for N measurements."""

    def __init__(self, onsets: OnsetSearch) -> None:
        K = len(onsets.measurement)
        if K > MAX_ONSETS:
            raise ShapeError(
                f"ends: expected at most {MAX_ONSETS} possible onsets, got {K}: use a window"
            )
        if K * onsets.size > MAX_NUMBERS:
            raise ShapeError(
                f"ends: expected onsets times measurements up to {MAX_NUMBERS:g}, got {K} times "
                f"{onsets.size}: use a window"
            )
        self._onsets = onsets
        self._first, self._second = np.triu_indices(K, 1)
        responses = np.concatenate([np.zeros((0, onsets.size)), *map(onsets.response, range(K))])
        gram = self._of_pairs(onsets.numerators(responses)[:, :, 0])
        unit = onsets.unit_values()
        with np.errstate(divide="ignore", invalid="ignore"):
            self.share = gram / self._of_pairs(unit @ unit.T)
            self.inverse = np.where(self.share > _core.DETECTABLE, 1 / gram, np.nan)[:, None, None]
        self.usable: Indices = np.flatnonzero(self.share > _core.DETECTABLE)
        self.work = onsets.work + 4 * len(gram)

    @property
    def variances(self) -> FloatArray:
        return self._onsets.variances

    @property
    def onset(self) -> FloatArray:
        return self._onsets.onset[self._first]

    @property
    def end(self) -> FloatArray | None:
        return self._onsets.onset[self._second]

    def _of_pairs(self, cross: FloatArray) -> FloatArray:
        """Of the differences, from a bilinear form of the profiles themselves (K, K)."""
        own = np.diagonal(cross)
        first, second = self._first, self._second
        result: FloatArray = own[first] + own[second] - 2 * cross[first, second]
        return result

    def near(self, which: int) -> Indices | None:
        return None

    def numerators(self, innovations: FloatArray, at: Indices | None = None) -> FloatArray:
        num = self._onsets.numerators(innovations)
        return num[:, self._first] - num[:, self._second]

    def response(self, which: int) -> FloatArray:
        first = self._onsets.response(int(self._first[which]))
        return first - self._onsets.response(int(self._second[which]))

    def reason(self) -> str:
        return self._onsets.reason()
