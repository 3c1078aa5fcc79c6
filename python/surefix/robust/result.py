"""What a run of the robust filter gives."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from surefix.core.checks import FloatArray
from surefix.core.filtered import Filtered
from surefix.log import Log

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False)
class RobustEstimate:
    """One estimate of a stream: ``time`` [s], ``x`` (n,) and ``P`` (n, n) of the mixture, limits
    ``lower`` and ``upper`` (infinite: none can be claimed at this risk), ``mode_probability``
    (S, M), the most probable ``hypothesis`` as a mode per sensor, its ``sse`` and
    ``degrees_of_freedom``, ``discarded_mass``: probability left out, and taken from the risk. Of
    every measurement used in the step, in order of validity (k,): ``noise_id``, number of its push;
    ``noise``, ``noise_variance`` and ``outlier_probability`` as in ``RobustResult``, NaN where that
    has none."""

    time: float
    x: FloatArray
    P: FloatArray
    lower: float
    upper: float
    mode_probability: FloatArray
    hypothesis: tuple[str, ...]
    discarded_mass: float
    sse: float
    degrees_of_freedom: int
    noise_id: npt.NDArray[np.int64]
    noise: FloatArray
    noise_variance: FloatArray
    outlier_probability: FloatArray

    @property
    def fault_probability(self) -> FloatArray:
        """That each sensor is in any mode but healthy (S,)."""
        total: FloatArray = self.mode_probability[:, 1:].sum(axis=1)
        return total


@dataclass(frozen=True, eq=False)
class RobustResult(Filtered):
    """A log, filtered. T estimates of n states, S sensors with up to M modes, N rows of the log.
    ``sigma`` is the mixture's; limits do not come from it.

    ``time`` (T,) [s]; ``x`` (T, n) and ``P`` (T, n, n): mean and covariance of the mixture;
    ``lower``, ``upper`` (T,): alert limits, infinite where none can be claimed at the risk;
    ``mode_probability`` (T, S, M); ``hypothesis`` (T, S): each sensor's mode under the most
    probable hypothesis, an index into ``mode_names``; ``sse`` and ``degrees_of_freedom`` (T,): of
    the measurements that it does not remove; ``discarded_mass`` (T,): probability that was left
    out, and taken from the risk; ``status`` (N,): what became of every row; ``step`` (N,): the
    estimate that used it, −1 for none; ``outlier_probability`` (N,): of every used row, for
    hypotheses per measurement, empty for those per sensor (then a sensor's probability is that of
    its most doubtful row in the step); ``noise`` and ``noise_variance`` (N,):
    v̂ of every used row and its variance (eqs. 25, 26) under the most probable hypothesis of its
    step, NaN where that removes the row; empty if not asked for or per measurement.
    """

    time: FloatArray
    x: FloatArray
    P: FloatArray
    lower: FloatArray
    upper: FloatArray
    mode_probability: FloatArray
    hypothesis: npt.NDArray[np.int8]
    discarded_mass: FloatArray
    sse: FloatArray
    degrees_of_freedom: npt.NDArray[np.int32]
    log_likelihood: float
    status: npt.NDArray[np.uint8]
    step: npt.NDArray[np.int64]
    outlier_probability: FloatArray
    noise: FloatArray
    noise_variance: FloatArray
    risk: float
    output: int
    state_names: tuple[str, ...]
    sensor_names: tuple[str, ...]
    mode_names: tuple[tuple[str, ...], ...]
    log: Log = field(repr=False)

    @property
    def fault_probability(self) -> FloatArray:
        """That each sensor is in any mode but healthy (T, S)."""
        total: FloatArray = self.mode_probability[:, :, 1:].sum(axis=2)
        return total

    @property
    def available(self) -> npt.NDArray[np.bool_]:
        """Where limits can be claimed at the risk (T,)."""
        return np.isfinite(self.lower) | np.isfinite(self.upper)

    @property
    def rejected(self) -> npt.NDArray[np.bool_]:
        """Rows whose sensor is faulty under the most probable hypothesis of their step, or that
        are outliers rather than not (N,)."""
        used = self.step >= 0
        if len(self.outlier_probability) > 0:
            return used & (np.where(used, self.outlier_probability, 0.0) > 0.5)
        code = self.log.codes_for(list(self.sensor_names))
        return used & (self.hypothesis[np.where(used, self.step, 0), np.maximum(code, 0)] > 0)

    def columns(self) -> dict[str, npt.NDArray[Any]]:
        """Time, states, their standard deviations, limits, fault probability and mode of every
        sensor, SSE, discarded mass: named arrays (T,)."""
        table = super().columns()
        table.update(lower=self.lower, upper=self.upper)
        for s, name in enumerate(self.sensor_names):
            table[f"{name}_fault_probability"] = self.fault_probability[:, s]
            table[f"{name}_mode"] = np.array(self.mode_names[s])[self.hypothesis[:, s]]
        table.update(sse=self.sse, degrees_of_freedom=self.degrees_of_freedom)
        table.update(discarded_mass=self.discarded_mass)
        return table

    def plot(self, **options: Any) -> Figure:
        """Measurements, those rejected as crosses, estimate, dotted alert limits and the fault
        probability of every sensor; see ``surefix.plots``."""
        from surefix.plots import plot_robust

        return plot_robust(self, **options)
