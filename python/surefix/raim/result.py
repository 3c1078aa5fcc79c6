"""What a monitor says of many epochs."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from surefix import _core
from surefix.core.checks import FloatArray, read_only
from surefix.errors import SurefixError
from surefix.log import Log
from surefix.raim.pseudoranges import Pseudoranges

if TYPE_CHECKING:
    import pandas

BoolArray = npt.NDArray[np.bool_]
IntArray = npt.NDArray[np.int32]
TextArray = npt.NDArray[np.str_]

STATUS = np.array(_core.RAIM_STATUS_NAMES)
DECLARED = np.array(_core.DECLARED_NAMES)


class RaimResult:
    """Of T epochs and N rows; NaN (or False) where there is no answer.

    Of every epoch: ``time`` [s]. ``status``: 'ok', or why there is no solution that could be
    tested: 'too few satellites', 'too many satellites', 'geometry' (all in one direction as seen
    along the track), 'off track', 'diverged'. ``declared``: 'not available', 'ok', 'excluded' (an
    alarm, which ended when satellites were taken out) or 'alarm' (do not use the position).
    ``statistic`` Λ, ``degrees``, ``threshold``, ``p_value``, ``alarm`` (13): of all satellites in
    view, or their solution was beyond K and without some of them there is one (the statistic is
    NaN then); ``separation_alarm``: a solution without one or two of them is too far off.

    Of the solution, after an exclusion without those: ``used`` satellites, ``along`` l̂ [m],
    ``sigma`` [m], ``clock`` (T, systems) [m], ``p_star``, ``bound`` b, ``bound_along`` c (by
    how much the bend may move l̂, in σ), ``e1``, ``e2``,
    ``available`` (p* ≤ γ), ``available_with_e1`` (p* + e₁ ≤ γ); half-widths [m] ``protection_chi2``
    (the smallest L/2 with p* + e₁ ≤ γ that holds a healthy error but for p_r; single faults, and no
    price for the choice of an exclusion) and ``protection`` (fault hypotheses), infinite where
    there is none. ``rival`` [m]: distance of another place in K that passes the test as well, 0 if
    there is none; it is in both protection levels. It is looked for where nothing is known of the
    position, or K turns. Of every row: ``excluded``, ``residual`` (whitened),
    ``critical_bias`` v_i* [m], ``missed_at_critical`` p(i, v_i*).
    """

    time: FloatArray
    status: TextArray
    declared: TextArray
    statistic: FloatArray
    degrees: IntArray
    threshold: FloatArray
    p_value: FloatArray
    alarm: BoolArray
    separation_alarm: BoolArray
    used: IntArray
    excluded_count: IntArray
    along: FloatArray
    sigma: FloatArray
    clock: FloatArray
    rival: FloatArray
    p_star: FloatArray
    bound: FloatArray
    bound_along: FloatArray
    e1: FloatArray
    e2: FloatArray
    available: BoolArray
    available_with_e1: BoolArray
    protection_chi2: FloatArray
    protection: FloatArray
    excluded: BoolArray
    residual: FloatArray
    critical_bias: FloatArray
    missed_at_critical: FloatArray

    def __init__(
        self, columns: dict[str, Any], data: Pseudoranges, length: float, risk: float
    ) -> None:
        self.data, self.length, self.risk = data, length, risk
        columns["time"] = data.epoch_time
        columns["status"] = STATUS[columns["status"]]
        columns["declared"] = DECLARED[columns["declared"]]
        columns["clock"] = columns["clock"][:, : len(data.system_names)]
        tested = columns["degrees"] > 0
        tail = _core.chi_squared_tail(
            np.where(tested, columns["statistic"], 0.0), np.maximum(columns["degrees"], 1)
        )
        columns["p_value"] = np.where(tested, tail, np.nan)
        for name, column in columns.items():
            setattr(self, name, read_only(np.array(column)))

    @property
    def usable(self) -> BoolArray:
        """(T,): there is a position and no alarm stands against it."""
        return np.isin(self.declared, ("ok", "excluded"))

    @property
    def counts(self) -> dict[str, int]:
        """Epochs by what was declared, and by why not available."""
        declared = Counter(self.declared.tolist())
        reasons = Counter(self.status[self.status != "ok"].tolist())
        return {
            **{str(name): declared[name] for name in DECLARED if declared[name]},
            **{f"not available: {name}": count for name, count in sorted(reasons.items())},
        }

    def to_log(self, sensor: str = "gnss", *, protected: bool = True) -> Log:
        """The positions that may be used as measurements, each with its own σ. Left out is what is
        not available or alarmed, what has a rival (a Gaussian stands for one place), and, if
        ``protected``, what has no finite protection level: without that, such positions are for
        filters with fault modes of their own."""
        rows = self.usable & (self.rival == 0)
        if protected:
            rows = rows & np.isfinite(self.protection)
        return Log(
            self.time[rows], np.full(int(rows.sum()), sensor), self.along[rows],
            sigma=self.sigma[rows],
        )  # fmt: skip

    def to_pandas(self) -> pandas.DataFrame:
        """One row an epoch."""
        try:
            import pandas
        except ImportError:
            raise SurefixError("to_pandas needs pandas: pip install surefix[io]") from None
        return pandas.DataFrame(self.table())

    def table(self) -> dict[str, npt.NDArray[Any]]:
        """The columns with one entry an epoch, a clock for each system."""
        names = (
            "time", "status", "declared", "used", "excluded_count", "along", "sigma", "statistic",
            "degrees", "threshold", "p_value", "alarm", "separation_alarm", "rival", "p_star",
            "bound", "bound_along", "e1", "e2", "available", "available_with_e1", "protection_chi2",
            "protection",
        )  # fmt: skip
        columns = {name: getattr(self, name) for name in names}
        for c, system in enumerate(self.data.system_names):
            columns[f"clock_{system}" if system else "clock"] = self.clock[:, c]
        return columns

    def plot(self, truth: npt.ArrayLike | None = None) -> Any:
        """A figure: position, protection levels and alarms over time; with the true mileage (T,)
        the error and, in it, what is misleading."""
        from surefix.plots.raim import draw_raim

        return draw_raim(self, truth)
