"""What one forward pass of a filter leaves, for all detectors."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from surefix import _core
from surefix.core import checks
from surefix.core.checks import NANOSECONDS, FloatArray
from surefix.core.linear_system import LinearSystem
from surefix.core.sensor import make_system
from surefix.desync.filter import DesyncFilter
from surefix.drift.data import measurements
from surefix.errors import ConfigError, NumericalError
from surefix.log import Log

Direction = str | int | Mapping[str, float] | None
T = TypeVar("T")


class ForwardRecord:
    """One pass of a filter over its measurements: the innovations and all that a backward sweep
    needs (Parellier, Barrau & Bonnabel 2023, section II).

    Of a ``DesyncFilter`` and a ``Log``, with the sensors as channels; or of a ``LinearSystem`` and
    z (steps, m), or (runs, steps, m) with one pattern of missing components, NaN, in all runs.
    Then ``times`` (steps,) are ascending (by default 0, 1, 2, …); ``inputs`` (steps - 1, n) are
    what is known to be added to the state between measurements k and k + 1; ``channels`` names the
    m components (by default "0", "1", …); with ``estimates`` the filter's ``x`` (steps, n), or
    (runs, steps, n), and ``P`` (steps, n, n) are kept, too.

    ``time``: of each step, or the validity of each row of the log. Where a scale-factor error is a
    state, the rows are as linearised in the pass. Raises ShapeError or ConfigError for what does
    not fit, NumericalError if an estimate overflows.
    """

    def __init__(
        self,
        source: LinearSystem | DesyncFilter,
        data: npt.ArrayLike | Log,
        times: npt.ArrayLike | None = None,
        inputs: npt.ArrayLike | None = None,
        channels: Sequence[str] | None = None,
        estimates: bool = False,
    ) -> None:
        if isinstance(source, DesyncFilter):
            if times is not None or inputs is not None or channels is not None or estimates:
                raise ConfigError(
                    "times, inputs, channels, estimates: expected none with a filter and a log"
                )
            self._of_log(source, checks.instance("data", data, Log))
        elif isinstance(source, LinearSystem):
            self._of_system(source, data, times, inputs, channels, bool(estimates))
        else:
            raise ConfigError(f"source: expected a LinearSystem or DesyncFilter, got {source!r}")
        self.source = source

    x: FloatArray
    P: FloatArray

    def _of_log(self, filter: DesyncFilter, log: Log) -> None:
        self.channels = tuple(sensor.name for sensor in filter.sensors)
        self.alone = True
        start = None if filter.start is None else checks.nanoseconds("start", filter.start)
        code = log.codes_for(self.channels)
        self.engine, self.status = _core.DriftRecord.of_log(
            make_system(filter.model, filter.sensors), filter.x0, filter.P0, start, log.stamp, code,
            log.value,
        )  # fmt: skip
        latency = np.array([checks.nanoseconds("latency", s.latency) for s in filter.sensors])
        known = np.where(code >= 0, latency[code], 0)
        self.time = np.where(np.isfinite(log.time), (log.stamp - known) / NANOSECONDS, np.nan)
        self._shape: tuple[int, ...] = (len(log),)
        self._step_of = self.engine.ids
        self._values: tuple[FloatArray, npt.NDArray[np.int32] | None] = (log.value, code)
        self._overflow()

    def _of_system(
        self,
        system: LinearSystem,
        data: npt.ArrayLike | Log,
        times: npt.ArrayLike | None,
        inputs: npt.ArrayLike | None,
        channels: Sequence[str] | None,
        estimates: bool,
    ) -> None:
        if isinstance(data, Log):
            raise ConfigError("data: expected measurements (steps, m) of a LinearSystem, got a Log")
        z, known, self.time, self.alone = measurements(system, data, times, inputs)
        m = system.measured
        given = tuple(map(str, range(m))) if channels is None else channels
        self.channels = checks.tuple_of("channels", given, str, "names")
        if isinstance(channels, str) or len(self.channels) != m or len(set(self.channels)) != m:
            raise ConfigError(f"channels: expected {m} different names, got {channels!r}")
        made = _core.DriftRecord.of_system(system.engine, z, known, self.time, estimates)
        if isinstance(made, str):
            raise NumericalError("system, z: an innovation's variance is not positive and finite")
        self.engine, x, P = made
        if estimates:
            self.x, self.P = self._one_or_all(x), P
        self._shape = z.shape[1:]
        self._step_of = self.engine.ids // m if m > 1 else self.engine.ids
        self._values = (z, None)
        self._overflow()

    def _overflow(self) -> None:
        if not np.isfinite(self.engine.log_likelihood).all():
            raise NumericalError("z: the estimate or the likelihood overflows")

    @property
    def log_likelihood(self) -> float | FloatArray:
        """Of all measurements; (runs,) of several runs."""
        return self._by_run(self.engine.log_likelihood)

    @property
    def inconsistency(self) -> float | FloatArray:
        """𝓛 = Σ log det S + νᵀS⁻¹ν (7): twice the negative log-likelihood but for a constant."""
        constant = self.engine.size * np.log(2 * np.pi)
        return self._by_run(-2 * self.engine.log_likelihood - constant)

    @cached_property
    def gradient(self) -> FloatArray:
        """∂𝓛/∂z of every measurement (20)-(22), in the shape of the data; NaN: not used."""
        if not self.engine.mixed:
            return self._arranged(2 * self.engine.whiten(self.innovations, threads()))
        pulse, out = _core.DriftProfile.pulse(), np.full((self.runs, *self._shape), np.nan)
        for c, unit in enumerate(np.eye(len(self.channels))):
            at, _, _ = found(self.engine.onsets(pulse, unit))
            num = found(self.engine.scan(pulse, unit, self.innovations, len(at), threads()))
            out[:, self._step_of[at], c] = 2 * num[:, :, 0]
        return self._one_or_all(out)

    @cached_property
    def precision(self) -> FloatArray:
        """diag Γ⁻¹, Γ the covariance of all measurements: a quarter of the gradient's variance
        with no fault. (steps, m), or (rows,) of a log."""
        if not self.engine.mixed:
            flat = np.full(int(np.prod(self._shape)), np.nan)
            flat[self.engine.ids] = self.engine.precision()
            return flat.reshape(self._shape)
        pulse, out = _core.DriftProfile.pulse(), np.full(self._shape, np.nan)
        for c, unit in enumerate(np.eye(len(self.channels))):
            at, inverse, _ = found(self.engine.onsets(pulse, unit))
            out[self._step_of[at], c] = 1 / inverse[:, 0, 0]
        return out

    @property
    def nis(self) -> FloatArray:
        """νᵀS⁻¹ν of every step, or of every row of a log: χ², as many degrees of freedom as there
        were measurements. NaN where there were none."""
        squares = self.innovations**2 * self.engine.inverse
        out = np.full((self.runs, self._shape[0]), np.nan)
        out[:, self._step_of] = 0.0
        for run, row in zip(out, squares, strict=True):
            np.add.at(run, self._step_of, row)
        return self._one_or_all(out)

    @property
    def innovations(self) -> FloatArray:
        """(runs, measurements) ν of the scalar measurements in the order of their use; of channels
        that are correlated those of L⁻¹z, R = L D Lᵀ."""
        return self.engine.innovations

    @property
    def runs(self) -> int:
        return int(self.engine.log_likelihood.shape[0])

    def onset_time(self, measurement: npt.NDArray[np.int64]) -> FloatArray:
        """Times of scalar measurements."""
        times: FloatArray = self.time[self._step_of[measurement]]
        return times

    @property
    def first_time(self) -> float:
        """Of the first measurement that was used; NaN if none was."""
        return float(self.time[self._step_of[0]]) if self.engine.size else np.nan

    def times_of(self, direction: FloatArray) -> FloatArray:
        """Times at which a channel of the direction was measured, each once."""
        ids, code = self.engine.ids, self._values[1]
        column = ids % len(self.channels) if code is None else code[ids]
        return np.unique(self.time[self._step_of[direction[column] != 0]])

    def direction(self, channel: Direction) -> FloatArray:
        """A weight for every channel."""
        names = self.channels
        if channel is None:
            if len(names) > 1:
                raise ConfigError(f"channel: expected one of {', '.join(names)}, got none")
            return np.ones(1)
        if isinstance(channel, (str, int)) and not isinstance(channel, bool):
            channel = {str(channel): 1.0}
        if not isinstance(channel, Mapping) or not channel or set(channel) - set(names):
            raise ConfigError(
                f"channel: expected one of {', '.join(names)}, or a weight for some of them, "
                f"got {channel!r}"
            )
        weights = {c: checks.number(f"channel {c!r}", w) for c, w in channel.items()}
        if not any(weights.values()):
            raise ConfigError(f"channel: expected a weight other than 0, got {channel!r}")
        return np.array([weights.get(name, 0.0) for name in names])

    def is_constant(self, direction: FloatArray) -> bool:
        """Whether a channel of the direction has several values, all of them the same: no sensor
        with noise does that, so nothing can be said about its faults."""
        values, code = self._values
        used = np.zeros(int(np.prod(self._shape)), bool)
        used[self.engine.ids] = True
        for c in np.flatnonzero(direction):
            if code is None:
                own = values[:, used.reshape(self._shape)[:, c], c]
            else:
                own = values[None, used & (code == c)]
            if own.shape[1] > 1 and bool((own == own[:, :1]).all()):
                return True
        return False

    def _arranged(self, values: FloatArray) -> FloatArray:
        """(runs, measurements) in the shape of the data."""
        out = np.full((self.runs, int(np.prod(self._shape))), np.nan)
        out[:, self.engine.ids] = values
        return self._one_or_all(out.reshape(self.runs, *self._shape))

    def _one_or_all(self, out: FloatArray) -> FloatArray:
        return out[0] if self.alone else out

    def _by_run(self, values: FloatArray) -> float | FloatArray:
        return float(values[0]) if self.alone else values


def threads() -> int:
    """For work whose numbers do not depend on them."""
    return os.cpu_count() or 1


def found(out: T | None) -> T:
    """What the engine found."""
    if out is None:
        raise NumericalError("profile: its states overflow over the time of the record")
    return out
