"""What all detectors answer."""

from __future__ import annotations

from functools import cached_property

import numpy as np
import numpy.typing as npt

from surefix.core.checks import FloatArray
from surefix.drift.false_alarm import FalseAlarm

Scalar = float | FloatArray | None

CONSTANT = "constant data: a sensor with noise does not repeat itself"
"""Why nothing is said of a channel that does."""


class Outcome:
    """The largest of many likelihood ratios, how often one as large comes with no fault, and so
    whether there is one.

    Of a record of several runs everything has the runs as its first axis. Where nothing can be
    said, ``status`` is 'undetectable', ``reason`` says why, and every number is None.
    """

    def __init__(
        self, reason: str, ratio: FloatArray | None, alone: bool, false_alarm: float,
        alarm: FalseAlarm | None,
    ) -> None:  # fmt: skip
        self.reason = reason
        self.false_alarm = false_alarm
        self._alarm = alarm
        self._alone = alone
        self._ratio = ratio
        self._best: npt.NDArray[np.intp] | None = None
        self._largest: FloatArray | None = None
        if ratio is not None and alarm is not None:
            self._best = np.argmax(np.where(np.isnan(ratio), -1.0, ratio), axis=1)
            self._largest = ratio[np.arange(len(ratio)), self._best]

    @property
    def ratio(self) -> FloatArray:
        """(K,) of every onset or frequency: drop of 𝓛 when the best fault there is subtracted."""
        return np.zeros(0) if self._ratio is None else self._runs(self._ratio)

    @property
    def drop(self) -> Scalar:
        """The largest ratio: by how much 𝓛 drops when the fault is subtracted."""
        return None if self._largest is None else self._one(self._largest)

    @property
    def p_value(self) -> Scalar:
        """Probability that this search finds a drop as large, anywhere in the record, with no
        fault; an upper bound on it where ``calibration`` is 'bound'."""
        return None if self._probability is None else self._one(self._probability[0])

    @property
    def p_value_se(self) -> Scalar:
        """Its standard error by simulation; 0 where it is a bound."""
        return None if self._probability is None else self._one(self._probability[1])

    @property
    def calibration(self) -> str | None:
        """'simulation', or 'bound' where that would take too long."""
        return None if self._alarm is None else self._alarm.method

    @cached_property
    def threshold(self) -> float | None:
        """The drop that a healthy record exceeds with probability ``false_alarm``."""
        return None if self._alarm is None else self._alarm.threshold(self.false_alarm)

    @property
    def p_at_most(self) -> Scalar:
        """The bound on ``p_value`` where it decides, without a simulation; else ``p_value``."""
        if self._largest is None or self._alarm is None:
            return None
        if self._alarm.decides(self._largest, self.false_alarm).all():
            return self._one(self._alarm.bound(self._largest))
        return self.p_value

    @property
    def detected(self) -> bool | npt.NDArray[np.bool_]:
        """Whether the drop is beyond the threshold."""
        if self._largest is None or self._alarm is None:
            return False
        beyond = self._alarm.bound(self._largest) <= self.false_alarm
        if not self._alarm.decides(self._largest, self.false_alarm).all():
            assert self.threshold is not None
            beyond = self._largest > self.threshold
        return bool(beyond[0]) if self._alone else beyond

    @property
    def status(self) -> str | npt.NDArray[np.str_]:
        """'detected', 'not detected' or 'undetectable'."""
        if self._largest is None:
            return "undetectable"
        names = np.where(self.detected, "detected", "not detected")
        names = np.where(np.isnan(self._largest), "undetectable", names)
        return str(names[0]) if self._alone else names

    @cached_property
    def _probability(self) -> tuple[FloatArray, FloatArray] | None:
        if self._largest is None or self._alarm is None:
            return None
        return self._alarm.of(self._largest)

    def _one(self, values: FloatArray) -> float | FloatArray:
        """Of every run; of the only one."""
        return values[0] if values.ndim > 1 else float(values[0]) if self._alone else values

    def _runs(self, values: FloatArray) -> FloatArray:
        return values[0] if self._alone else values

    def _at_best(self, values: FloatArray) -> Scalar:
        """(K, …) of all runs alike, at the largest ratio; None where there is none."""
        return None if self._best is None else self._scalar(values[self._best])

    def _at_best_of_runs(self, values: FloatArray) -> Scalar:
        """(runs, K, …), at the largest ratio of each."""
        if self._best is None:
            return None
        return self._scalar(values[np.arange(len(self._best)), self._best])

    def _scalar(self, chosen: FloatArray) -> Scalar:
        if not self._alone:
            silent = (
                np.zeros(len(chosen), bool) if self._largest is None else np.isnan(self._largest)
            )
            return np.where(silent.reshape(-1, *(1,) * (chosen.ndim - 1)), np.nan, chosen)
        return float(chosen[0]) if chosen.ndim == 1 else chosen[0]


def magnitude(amplitudes: FloatArray, covariance: FloatArray) -> tuple[float, float]:
    """Of one amplitude itself and its standard error, of several the norm and, to first order, the
    norm's."""
    if len(amplitudes) == 1:
        return float(amplitudes[0]), float(np.sqrt(covariance[0, 0]))
    size = float(np.linalg.norm(amplitudes))
    unit = amplitudes / size if size > 0 else np.eye(len(amplitudes))[0]
    return size, float(np.sqrt(unit @ covariance @ unit))
