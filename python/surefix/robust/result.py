"""What a run of the robust filter gives."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from surefix import _core
from surefix.core.checks import FloatArray
from surefix.desync.result import to_frame
from surefix.log import Log

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False)
class RobustEstimate:
    """One estimate of a stream: ``time`` [s], ``x`` (n,) and ``P`` (n, n) of the mixture, limits
    ``lower`` and ``upper`` (infinite: none can be claimed at this risk), ``mode_probability``
    (S, M), the most probable ``hypothesis`` as a mode per sensor, its ``sse`` and
    ``degrees_of_freedom``, ``discarded_mass``: probability left out, and taken from the risk."""

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

    @property
    def fault_probability(self) -> FloatArray:
        """That each sensor is in any mode but healthy (S,)."""
        total: FloatArray = self.mode_probability[:, 1:].sum(axis=1)
        return total


@dataclass(frozen=True, eq=False)
class RobustResult:
    """A log, filtered. T estimates of n states, S sensors with up to M modes, N rows of the log.

    ``time`` (T,) [s]; ``x`` (T, n) and ``P`` (T, n, n): mean and covariance of the mixture;
    ``lower``, ``upper`` (T,): alert limits, infinite where none can be claimed at the risk;
    ``mode_probability`` (T, S, M); ``hypothesis`` (T, S): each sensor's mode under the most
    probable hypothesis, an index into ``mode_names``; ``sse`` and ``degrees_of_freedom`` (T,): of
    the measurements that it does not remove; ``discarded_mass`` (T,): probability that was left
    out, and taken from the risk; ``status`` (N,): what became of every row; ``step`` (N,): the
    estimate that used it, −1 for none; ``outlier_probability`` (N,): of every used row, for
    hypotheses per measurement, empty for those per sensor.
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
    risk: float
    output: int
    state_names: tuple[str, ...]
    sensor_names: tuple[str, ...]
    mode_names: tuple[tuple[str, ...], ...]
    log: Log = field(repr=False)

    @property
    def estimate(self) -> FloatArray:
        """The model's output, usually the speed (T,)."""
        return self.x[:, self.output]

    @property
    def sigma(self) -> FloatArray:
        """Standard deviation of the mixture's output (T,). Limits do not come from it."""
        return np.sqrt(self.P[:, self.output, self.output])

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

    @property
    def counts(self) -> dict[str, int]:
        """How many rows had each status; those that did not occur are left out."""
        found = np.bincount(self.status, minlength=len(_core.STATUS_NAMES))
        return {_core.STATUS_NAMES[i]: int(found[i]) for i in np.flatnonzero(found)}

    def to_pandas(self) -> pd.DataFrame:
        """One row per estimate: the columns of ``columns``."""
        return to_frame(self.columns())

    def columns(self) -> dict[str, npt.NDArray[Any]]:
        """Time, states, their standard deviations, limits, fault probability and mode of every
        sensor, SSE, discarded mass: named arrays (T,)."""
        deviation = np.sqrt(np.diagonal(self.P, axis1=1, axis2=2))
        table: dict[str, npt.NDArray[Any]] = {"time_s": self.time}
        table.update({name: self.x[:, i] for i, name in enumerate(self.state_names)})
        table.update({f"{n}_sigma": deviation[:, i] for i, n in enumerate(self.state_names)})
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
