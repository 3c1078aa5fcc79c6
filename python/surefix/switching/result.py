"""What the switching filters return."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from surefix.core.checks import FloatArray


@dataclass(frozen=True, eq=False)
class SwitchingResult:
    """Estimates of T steps of n states, after the measurement of each; for a batch with an axis of
    runs in front of all.

    ``x`` (T, n); ``P`` (T, n, n): its covariance, for the linear filter its mean-square error;
    ``mode_probability`` (T, M) of every mode given all measurements so far, None where the filter
    has none; ``log_likelihood`` of all measurements, a number, or (runs,) for a batch; None for the
    linear filter.
    """

    x: FloatArray
    P: FloatArray
    mode_probability: FloatArray | None
    log_likelihood: float | FloatArray | None
    states: tuple[str, ...] | None = None

    @property
    def sigma(self) -> FloatArray:
        """Standard deviations (T, n)."""
        return np.sqrt(np.diagonal(self.P, axis1=-2, axis2=-1))
