"""The likelihood ratios of a fault for every onset, and how they depend on one another."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from surefix import _core
from surefix.core.checks import FloatArray
from surefix.drift.false_alarm import Indices
from surefix.drift.forward_record import ForwardRecord, found, threads
from surefix.drift.profile import Profile


class OnsetSearch:
    """One sweep: numerators S₀ᵀℓ, inverses of S₀ᵀMS₀, and what share of the information not
    knowing the state leaves, for the K measurements at which a fault can begin."""

    def __init__(self, record: ForwardRecord, profile: Profile, direction: FloatArray) -> None:
        self._record, self._profile = record, profile
        self._fault = (profile.engine, direction)
        self.measurement, self.inverse, self.share = found(record.engine.onsets(*self._fault))
        self.usable: Indices = np.flatnonzero(self.share > _core.DETECTABLE)
        self.work = (2 + profile.amplitudes) * record.engine.size

    @property
    def size(self) -> int:
        """Measurements of all channels, N."""
        return self._record.engine.size

    @cached_property
    def variances(self) -> FloatArray:
        return 1 / self._record.engine.inverse

    @property
    def onset(self) -> FloatArray:
        """(K,) times."""
        return self._record.layout.times(self.measurement)

    @property
    def end(self) -> FloatArray | None:
        return None

    def near(self, which: int) -> Indices | None:
        return None

    def numerators(self, innovations: FloatArray, at: Indices | None = None) -> FloatArray:
        count = len(self.measurement)
        return found(self._record.engine.scan(*self._fault, innovations, count, threads()))

    def response(self, which: int) -> FloatArray:
        return found(self._record.engine.response(*self._fault, int(self.measurement[which])))

    def unit_values(self) -> FloatArray:
        """(K, N) the fault of each onset and unit amplitude in each measurement, over the standard
        deviation of its noise: what would be seen of it if the state were known."""
        record = self._record
        times = record.layout.times(slice(None))
        weight = record.engine.weights(self._fault[1]) / np.sqrt(record.engine.noise)
        out = np.zeros((len(self.measurement), len(times)))
        for row, first, onset in zip(out, self.measurement, self.onset, strict=True):
            row[first:] = self._profile.value(times[first:] - onset)[:, 0] * weight[first:]
        return out

    def reason(self) -> str:
        """Why nothing can be found."""
        if len(self.measurement) == 0:
            return "no measurement of the channel was used"
        return "what the fault would change hides in what the model itself can do, or is not seen"
