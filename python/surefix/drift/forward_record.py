"""What one forward pass of a filter leaves, for all detectors."""

from __future__ import annotations

import os
from collections.abc import Sequence
from functools import cached_property
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from surefix import _core
from surefix.core import checks
from surefix.core.checks import FloatArray
from surefix.core.linear_system import LinearSystem
from surefix.desync.filter import DesyncFilter
from surefix.drift.direction import Direction, weights
from surefix.drift.passes import Status, channel_names, pass_log, pass_system
from surefix.errors import ConfigError, NumericalError
from surefix.log import Log

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

    channels: tuple[str, ...]
    x: FloatArray
    P: FloatArray
    status: Status
    """Of a log: what became of every row."""

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
            log = checks.instance("data", data, Log)
            self.channels = tuple(sensor.name for sensor in source.sensors)
            self.engine, self.layout, self.status = pass_log(source, log)
        elif isinstance(source, LinearSystem):
            self.channels = channel_names(channels, source.measured)
            wanted = bool(estimates)
            self.engine, self.layout, x, P = pass_system(source, data, times, inputs, wanted)
            if wanted:
                self.x, self.P = self.layout.one_or_all(x), P
        else:
            raise ConfigError(f"source: expected a LinearSystem or DesyncFilter, got {source!r}")
        self.source = source

    @property
    def time(self) -> FloatArray:
        """Of each step, or the validity of each row."""
        return self.layout.time

    @property
    def innovations(self) -> FloatArray:
        """(runs, measurements) ν of the scalar measurements in the order of their use; of channels
        that are correlated those of L⁻¹z, R = L D Lᵀ."""
        return self.engine.innovations

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
        layout = self.layout
        if not self.engine.mixed:
            return layout.arranged(2 * self.engine.whiten(self.innovations, threads()))
        pulse = _core.DriftProfile.pulse()
        out = np.full((len(self.innovations), *layout.shape), np.nan)
        for c, unit in enumerate(np.eye(len(self.channels))):
            at, _, _ = found(self.engine.onsets(pulse, unit))
            num = found(self.engine.scan(pulse, unit, self.innovations, len(at), threads()))
            out[:, layout.step[at], c] = 2 * num[:, :, 0]
        return layout.one_or_all(out)

    @cached_property
    def precision(self) -> FloatArray:
        """diag Γ⁻¹, Γ the covariance of all measurements: a quarter of the gradient's variance
        with no fault. (steps, m), or (rows,) of a log."""
        out = np.full(self.layout.shape, np.nan)
        if not self.engine.mixed:
            out.reshape(-1)[self.layout.ids] = self.engine.precision()
            return out
        pulse = _core.DriftProfile.pulse()
        for c, unit in enumerate(np.eye(len(self.channels))):
            at, inverse, _ = found(self.engine.onsets(pulse, unit))
            out[self.layout.step[at], c] = 1 / inverse[:, 0, 0]
        return out

    @property
    def nis(self) -> FloatArray:
        """νᵀS⁻¹ν of every step, or of every row of a log: χ², as many degrees of freedom as there
        were measurements. NaN where there were none."""
        return self.layout.summed(self.innovations**2 * self.engine.inverse)

    def direction(self, channel: Direction) -> FloatArray:
        """A weight for every channel."""
        return weights(channel, self.channels)

    def _by_run(self, values: FloatArray) -> float | FloatArray:
        return float(values[0]) if self.layout.alone else values


def threads() -> int:
    """For work whose numbers do not depend on them."""
    return os.cpu_count() or 1


def found(out: T | None) -> T:
    """What the engine found."""
    if out is None:
        raise NumericalError("profile: its states overflow over the time of the record")
    return out
