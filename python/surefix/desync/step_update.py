"""What a composite step gives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from surefix.core.checks import FloatArray
from surefix.core.distributions import chi_squared_p_value


@dataclass(frozen=True, eq=False)
class StepUpdate:
    """What a step gives: ``x`` (n,), ``P`` (n, n); ``innovation`` γ (M,); ``noise`` v̂ = ΥΓ⁻¹γ (M,)
    and ``noise_variance``, the diagonal of ΥΓ⁻¹Υ (M,); ``sse`` = γᵀΓ⁻¹γ with
    ``degrees_of_freedom`` M; ``log_likelihood`` of γ; ``way``: 'sequential' or 'composite'."""

    x: FloatArray
    P: FloatArray
    innovation: FloatArray
    noise: FloatArray
    noise_variance: FloatArray
    sse: float
    log_likelihood: float
    way: str

    @property
    def degrees_of_freedom(self) -> int:
        return len(self.innovation)

    @property
    def normalised_noise(self) -> FloatArray:
        """v̂ / √variance (M,): N(0, 1) with no fault."""
        return self.noise / np.sqrt(self.noise_variance)

    @property
    def p_value(self) -> float:
        """P(χ² > SSE), NaN without measurements."""
        return float(chi_squared_p_value(self.sse, self.degrees_of_freedom))
