"""What the filters' faces share: the state of a stream, and the request of a batch."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from surefix import _core
from surefix.core import checks
from surefix.core.checks import NANOSECONDS, FloatArray
from surefix.core.models import Model
from surefix.core.sensor import Sensor, state_names
from surefix.desync.times import Nanoseconds, estimation_times
from surefix.errors import ConfigError, NumericalError
from surefix.log import Log


class Engine(Protocol):
    """What every filter's engine tells of its stream."""

    @property
    def counters(self) -> tuple[int, ...]: ...
    @property
    def log_likelihood(self) -> float: ...


class Stream:
    """A filter that streams: a model, sensors, and the engine behind them."""

    model: Model
    sensors: tuple[Sensor, ...]
    start: float | None
    _engine: Engine

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of all states: the model's, then each sensor's scale and bias (not the biases of
        drifting sensors)."""
        return state_names(self.model, self.sensors)

    @property
    def counters(self) -> dict[str, int]:
        """How often each status was answered while streaming."""
        return dict(zip(_core.STATUS_NAMES, self._engine.counters, strict=True))

    @property
    def log_likelihood(self) -> float:
        """log p of all measurements used while streaming."""
        return self._engine.log_likelihood

    def _request(
        self, log: Log, rate: float | None, times: npt.ArrayLike | None, delay: float | None
    ) -> tuple[Any, Nanoseconds | None, int | None]:
        """Sensor codes (N,) of a log, estimation times [ns] and delay [ns], checked."""
        if not isinstance(log, Log):
            raise ConfigError(f"log: expected a Log, got {log!r}")
        if delay is not None and rate is None and times is None:
            raise ConfigError("delay: expected rate or times with it")
        code = log.codes_for([sensor.name for sensor in self.sensors])
        late = (
            None
            if delay is None
            else checks.nanoseconds("delay", checks.not_negative("delay", delay))
        )
        return code, estimation_times(log, self.sensors, self.start, rate, times), late


def check_ended(ended: str, wanted: Nanoseconds | None, made: int) -> None:
    """Raises the error of a batch that could not make its estimate number ``made``."""
    if ended == "ok":
        return
    at = f"number {made}" if wanted is None else f"{wanted[made] / NANOSECONDS} s"
    kind = ConfigError if ended in ("time_backwards", "off_grid") else NumericalError
    hint = ""
    if ended == "buffer_full":
        hint = (
            ", more measurements than a step can hold "
            f"({_core.MAX_MEASUREMENTS} with hypotheses per measurement); a higher rate makes "
            "shorter steps"
        )
    raise kind(f"run: no estimate at {at}: {ended}{hint}")


def check_estimated(status: str, time: float) -> None:
    """Raises the error of an estimate that could not be made."""
    if status in ("time_backwards", "off_grid"):
        raise ConfigError(f"time: no estimate at {time} s: {status}")
    if status != "ok":
        raise NumericalError(f"estimate: no estimate at {time} s: {status}")


def factor_of(sigma: Any, sensors: Sequence[Sensor], index: int) -> float:
    """Of a reading that says how good it is: its standard deviation in units of its sensor's. NaN,
    as in a log: the sensor's own."""
    if sigma is None or index < 0 or (isinstance(sigma, (float, np.floating)) and np.isnan(sigma)):
        return 1.0
    return float_or_nan(sigma) / sensors[index].sigma


def log_factors(log: Log, sensors: Sequence[Sensor]) -> FloatArray | None:
    """The same of a log's rows (N,)."""
    return log.factors([s.name for s in sensors], [s.sigma for s in sensors])


def float_or_nan(value: Any) -> float:
    """A number, or NaN for what is none: a text, None, a list."""
    try:
        return math.nan if isinstance(value, (str, bytes)) else float(value)
    except (TypeError, ValueError, OverflowError):
        return math.nan
