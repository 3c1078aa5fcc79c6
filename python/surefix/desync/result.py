"""What a run gives: estimates with their intervals, what became of every row, noise estimates."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from surefix import _core
from surefix.core import checks
from surefix.core.checks import FloatArray
from surefix.core.distributions import chi_squared_p_value, two_sided_quantile
from surefix.core.filtered import Filtered
from surefix.errors import SurefixError
from surefix.log import Log

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False)
class Result(Filtered):
    """A log, filtered. T estimates of n states, N rows of the log.

    ``time`` (T,) [s]; ``x`` (T, n); ``P`` (T, n, n); ``sse`` (T,) and ``degrees_of_freedom`` (T,):
    sum of squared errors of every step (eq. 27); ``status`` (N,): what became of every row, an
    index into ``STATUS_NAMES``; ``noise`` and ``noise_variance`` (N,): estimated measurement noise
    v̂ and its variance (eqs. 25, 26), NaN where a row was not used; empty if not asked for.
    """

    time: FloatArray
    x: FloatArray
    P: FloatArray
    sse: FloatArray
    degrees_of_freedom: npt.NDArray[np.int32]
    log_likelihood: float
    status: npt.NDArray[np.uint8]
    noise: FloatArray
    noise_variance: FloatArray
    risk: float
    output: int
    state_names: tuple[str, ...]
    log: Log = field(repr=False)

    @property
    def lower(self) -> FloatArray:
        """Lower end of the interval that misses the output with probability ``risk`` (T,)."""
        return self.interval()[0]

    @property
    def upper(self) -> FloatArray:
        """Upper end of the same interval (T,)."""
        return self.interval()[1]

    def interval(
        self, risk: float | None = None, direction: npt.ArrayLike | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """(lower, upper) of aᵀx, each (T,), per estimate at ``risk``, half of it on each side.

        ``direction``: a (n,); by default the model's output alone. Exact for Gaussian errors: a
        linear filter's interval assumes that no sensor is faulty.
        """
        K = two_sided_quantile(self.risk if risk is None else risk)
        if direction is None:
            mean, deviation = self.estimate, self.sigma
        else:
            a = checks.array("direction", direction, (self.x.shape[1],))
            mean, deviation = self.x @ a, np.sqrt(np.einsum("i,tij,j->t", a, self.P, a))
        return mean - K * deviation, mean + K * deviation

    @property
    def p_value(self) -> FloatArray:
        """P(χ² > SSE) of every step (T,), NaN for a step without measurements."""
        return chi_squared_p_value(self.sse, self.degrees_of_freedom)

    def flagged(self, false_alarm: float = 0.01) -> npt.NDArray[np.bool_]:
        """Rows whose noise is too large (N,): |normalised noise| > ``flagged_beyond``.

        With healthy sensors and a right model the probability that any row of the run is flagged
        is at most ``false_alarm`` (Bonferroni: each row at false_alarm / rows used).
        """
        if len(self.noise) == 0:
            raise SurefixError("flagged: run with noise='step' or noise='journey'")
        threshold = self.flagged_beyond(false_alarm)
        size = np.abs(np.where(np.isfinite(self.noise), self.normalised_noise, 0.0))
        return size > threshold

    def flagged_beyond(self, false_alarm: float = 0.01) -> float:
        """Size of the normalised noise beyond which a row is flagged."""
        used = int(np.isfinite(self.noise).sum())
        rate = checks.probability("false_alarm", false_alarm) / max(used, 1)
        return float(_core.normal_two_sided(rate))

    def columns(self) -> dict[str, npt.NDArray[Any]]:
        """Time, states, their standard errors, interval, SSE, p-value as named arrays (T,)."""
        table = super().columns()
        table.update(lower=self.lower, upper=self.upper, sse=self.sse)
        table.update(degrees_of_freedom=self.degrees_of_freedom, p_value=self.p_value)
        return table

    def plot(self, **options: Any) -> Figure:
        """Measurements, estimate, interval and what was flagged; see ``surefix.plots``."""
        from surefix.plots import plot_result

        return plot_result(self, **options)
