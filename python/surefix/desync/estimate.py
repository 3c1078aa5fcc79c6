"""What a stream gives: the estimate at the end of one step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from surefix.core.checks import FloatArray
from surefix.core.distributions import chi_squared_p_value


@dataclass(frozen=True, eq=False)
class Estimate:
    """The estimate at the end of one step, when streaming.

    ``time`` [s]; ``x`` (n,), ``P`` (n, n); ``lower``, ``upper``: interval of the model's output at
    the filter's risk; ``sse`` and ``degrees_of_freedom`` of the step. ``noise_id``, ``noise``,
    ``noise_variance``: number of push, v̂ and its variance of every measurement used in the step.
    """

    time: float
    x: FloatArray
    P: FloatArray
    lower: float
    upper: float
    sse: float
    degrees_of_freedom: int
    noise_id: npt.NDArray[np.int64]
    noise: FloatArray
    noise_variance: FloatArray

    @property
    def p_value(self) -> float:
        """P(χ² > SSE), NaN for a step without measurements."""
        return float(chi_squared_p_value(self.sse, self.degrees_of_freedom))
