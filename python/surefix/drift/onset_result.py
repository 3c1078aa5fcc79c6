"""What an onset detector found."""

from __future__ import annotations

from typing import Any

import numpy as np

from surefix.core.checks import FloatArray
from surefix.drift.ending_search import EndingSearch
from surefix.drift.false_alarm import FalseAlarm, quadratic
from surefix.drift.onset_search import OnsetSearch
from surefix.drift.outcome import Outcome, Scalar, magnitude
from surefix.drift.profile import Profile


class OnsetResult(Outcome):
    """A fault of a known course: ratio and amplitude for every onset, and the best of them.

    ``ratio`` (K,): drop of 𝓛 when the fault with that onset and its best amplitude is subtracted;
    χ² with as many degrees of freedom as there are amplitudes, with no fault; NaN where it cannot
    be told from what the model itself can do. ``detectability`` (K,): share of the information on
    the amplitude that not knowing the state leaves, 0 to 1.
    """

    def __init__(
        self,
        profile: Profile,
        search: OnsetSearch | EndingSearch | None,
        numerators: FloatArray | None,
        alone: bool,
        false_alarm: float,
        alarm: FalseAlarm | None,
        reason: str = "",
    ) -> None:
        usable = search is not None and numerators is not None and alarm is not None
        self.profile = profile
        self._search = search
        self._numerators = np.zeros((1, 0, 1)) if numerators is None else numerators
        ratio = quadratic(self._numerators, search.inverse) if search and usable else None
        super().__init__(reason, ratio, alone, false_alarm, alarm)

    @property
    def time(self) -> FloatArray:
        """(K,) possible onsets: when the channel was measured."""
        return np.zeros(0) if self._search is None else self._search.onset

    @property
    def ends(self) -> FloatArray | None:
        """(K,) of each of them, where the fault ends."""
        return None if self._search is None else self._search.end

    @property
    def detectability(self) -> FloatArray:
        return np.zeros(0) if self._search is None else self._search.share

    @property
    def amplitudes(self) -> FloatArray:
        """(K,) or (K, q): the best for each onset."""
        return np.zeros(0) if self._search is None else self._runs(self._of_amplitudes())

    @property
    def amplitude_ses(self) -> FloatArray:
        """(K,) or (K, q): their standard errors, given the onset."""
        return np.zeros(0) if self._search is None else self._errors()

    @property
    def first_order(self) -> FloatArray:
        """(K,) the paper's indicator gᵀd (18) with an amplitude of 1; its norm of several."""
        return self._runs(self._indicator())

    @property
    def onset(self) -> Scalar:
        return None if self._search is None else self._at_best(self._search.onset)

    @property
    def end(self) -> Scalar:
        ends = self.ends
        return None if ends is None else self._at_best(ends)

    @property
    def amplitude(self) -> Scalar:
        return None if self._best is None else self._at_best_of_runs(self._of_amplitudes())

    @property
    def amplitude_se(self) -> Scalar:
        """Given the onset; the onset's own uncertainty is not in it."""
        return None if self._best is None else self._at_best(self._errors())

    @property
    def onset_first_order(self) -> Scalar:
        """Where the first-order indicator is largest in magnitude."""
        if self._best is None or self._search is None:
            return None
        largest = np.argmax(np.nan_to_num(np.abs(self._indicator()), nan=-1.0), axis=1)
        return self._scalar(self._search.onset[largest])

    def found(self) -> dict[str, Any]:
        """The best fault of a single run, by the names of a ``Fault``."""
        best = 0 if self._best is None else int(self._best[0])
        if self._search is None:
            return {}
        inverse = self._search.inverse[best]
        amplitudes = inverse @ self._numerators[0, best]
        size, error = magnitude(amplitudes, inverse)
        return {
            "profile": self.profile, "onset": self.onset, "end": self.end, "amplitude": size,
            "amplitude_se": error, "amplitudes": amplitudes, "covariance": inverse,
        }  # fmt: skip

    def _indicator(self) -> FloatArray:
        num = self._numerators
        result: FloatArray = 2 * (
            num[..., 0] if num.shape[-1] == 1 else np.linalg.norm(num, axis=-1)
        )
        return result

    def _of_amplitudes(self) -> FloatArray:
        assert self._search is not None
        inverse, num = self._search.inverse, self._numerators
        if num.shape[-1] == 1:
            return num[..., 0] * inverse[:, 0, 0]
        result: FloatArray = np.einsum("kab,rkb->rka", inverse, num)
        return result

    def _errors(self) -> FloatArray:
        assert self._search is not None
        errors: FloatArray = np.sqrt(np.diagonal(self._search.inverse, axis1=1, axis2=2))
        return errors[:, 0] if errors.shape[1] == 1 else errors
