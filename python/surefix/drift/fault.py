"""A fault that was found."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from surefix.core.checks import FloatArray
from surefix.drift.profile import Profile


@dataclass(frozen=True, eq=False)
class Fault:
    """Which channel, which course, since when, how large.

    ``kind``: name of the profile, with '(ends)' where its end was found too, or 'sinusoid'.
    ``p_value``: of the whole search for it: probability that any of the searched channels and
    courses shows as much with no fault, at most. ``score``: drop of 𝓛 less ln N for each of its
    ``parameters`` (Schwarz's criterion, BIC); ``runner_up``: the next best (channel, kind, score)
    of another channel or course; ``rivals``: other channels whose best score is within 2 ln 20 of
    it, so that the odds between the two are less than 20 to 1 and either may be the faulty one.
    ``amplitudes`` (q,) and their ``covariance`` (q, q), given onset and course.
    """

    channel: str
    kind: str
    amplitude: float
    amplitude_se: float
    drop: float
    p_value: float
    score: float
    parameters: int
    amplitudes: FloatArray = field(repr=False)
    covariance: FloatArray = field(repr=False)
    profile: Profile | None = field(default=None, repr=False)
    onset: float | None = None
    end: float | None = None
    frequency: float | None = None
    phase: float | None = None
    origin: float = 0.0
    runner_up: tuple[str, str, float] | None = None
    rivals: tuple[str, ...] = ()

    def basis(self, time: npt.ArrayLike) -> FloatArray:
        """What each unit amplitude is at ``time`` (any,): (any, q)."""
        t = np.asarray(time, dtype=np.float64)
        if self.frequency is not None:
            angle = 2 * np.pi * self.frequency * (t - self.origin)
            return np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        begun = self._since(t, self.onset)
        return begun if self.end is None else begun - self._since(t, self.end)

    def value(self, time: npt.ArrayLike) -> FloatArray:
        """The fault at ``time`` (any,)."""
        result: FloatArray = self.basis(time) @ self.amplitudes
        return result

    def _since(self, t: FloatArray, onset: float | None) -> FloatArray:
        assert self.profile is not None
        assert onset is not None
        elapsed = np.nan_to_num(t - onset, nan=-1.0)
        shape: FloatArray = self.profile.value(np.maximum(elapsed, 0.0))
        return np.where(elapsed[:, None] >= 0, shape, 0.0)
