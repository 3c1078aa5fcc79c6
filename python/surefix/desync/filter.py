"""The linear filter over asynchronous measurements, for whole logs and as a stream."""

from __future__ import annotations

import enum
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from surefix import _core
from surefix.core import checks
from surefix.core.checks import NANOSECONDS, to_nanoseconds
from surefix.core.distributions import two_sided_quantile
from surefix.core.models import Model
from surefix.core.sensor import Sensor, make_system, sensor_tuple
from surefix.desync.estimate import Estimate
from surefix.desync.result import Result
from surefix.desync.saved import checked, settings
from surefix.desync.stream import (
    Stream,
    check_ended,
    check_estimated,
    factor_of,
    float_or_nan,
    log_factors,
)
from surefix.errors import ConfigError
from surefix.log import NO_TIME, Log

Status = enum.IntEnum("Status", {name: i for i, name in enumerate(_core.STATUS_NAMES)})  # type: ignore[misc]
"""What became of a measurement; see the table in the documentation of ``desync``."""

MAX_CAPACITY = 1_000_000

_NOISE_SCOPES = {None: 0, "step": 1, "journey": 2}


class DesyncFilter(Stream):
    """Bilenne's desynchronized filter (2004, table 1, corrected) as one scalar update per
    measurement.

    ``x0`` (n,) and ``P0`` (n, n): the model's state and its covariance at ``start`` [s]; without
    ``start`` they belong to the earliest measurement of the first step. Scale and bias states of
    the sensors are added behind them. ``risk``: probability, per estimate, that the interval
    misses. ``capacity``: measurements that a step can hold when streaming, up to a million.

    ``run`` filters a whole log and leaves the filter as it is; ``push`` and ``estimate`` stream.
    Both give the same bits. Raises ShapeError and ConfigError for what does not fit.
    """

    _engine: _core.FilterEngine

    def __init__(
        self,
        model: Model,
        sensors: Sequence[Sensor],
        x0: npt.ArrayLike,
        P0: npt.ArrayLike,
        *,
        start: float | None = None,
        risk: float = 1e-11,
        capacity: int = 4096,
    ) -> None:
        self.model = model
        self.sensors = sensor_tuple(sensors)
        system = make_system(model, self.sensors)
        self.x0 = checks.array("x0", x0, (model.size,))
        self.P0 = checks.covariance("P0", P0, model.size)
        self.start = None if start is None else checks.number("start", start)
        self.risk = checks.probability("risk", risk)
        self.capacity = checks.whole("capacity", capacity, 1, MAX_CAPACITY)
        self._quantile = two_sided_quantile(self.risk)
        start_ns = None if start is None else checks.nanoseconds("start", start)
        self._engine = _core.FilterEngine(system, self.x0, self.P0, start_ns, self.capacity)
        self._pushes = 0

    def run(
        self,
        log: Log,
        *,
        rate: float | None = None,
        times: npt.ArrayLike | None = None,
        noise: str | None = "step",
        delay: float | None = None,
    ) -> Result:
        """Filters a whole log, from the filter's initial state.

        Estimates are made ``rate`` times a second from the start until the log is used up, or at
        ``times`` [s], ascending; without either, at every measurement. ``noise``: 'step' estimates
        each measurement's noise from its step and the past (the paper's v̂_k|k), 'journey' from the
        whole log, None not at all. ``delay`` [s]: replays the order of arrival, with the estimate
        for t made at t + delay: rows stamped later than that are too late; by default none is.

        Rows that cannot be used are counted in the result's ``counts``. Raises ConfigError for
        times that go backwards, NumericalError if an estimate overflows.
        """
        if not isinstance(noise, (str, type(None))) or noise not in _NOISE_SCOPES:
            raise ConfigError(f"noise: expected 'step', 'journey' or None, got {noise!r}")
        code, wanted, late = self._request(log, rate, times, delay)
        factor = log_factors(log, self.sensors)
        out = self._engine.run(
            log.stamp, code, log.value, factor, wanted, _NOISE_SCOPES[noise], late
        )
        time_s, x, P, sse, degrees, status, v, variance, log_likelihood, ended, made = out
        check_ended(ended, wanted, made)
        return Result(
            time=time_s, x=x, P=P, sse=sse, degrees_of_freedom=degrees,
            log_likelihood=log_likelihood, status=status, noise=v, noise_variance=variance,
            risk=self.risk, output=self.model.output, state_names=self.state_names, log=log,
        )  # fmt: skip

    def push(self, time: float, sensor: str, value: float, sigma: float | None = None) -> Status:
        """Takes one measurement with its stamp [s]; returns what became of it. ``sigma``: standard
        deviation of this one, by default the sensor's.

        In any order, as long as it was valid after the last estimate. Never raises on data: NaN,
        what is no number at all, unknown sensors and late measurements are answered by their status
        and counted.
        """
        known = isinstance(sensor, str)
        index = next((i for i, s in enumerate(self.sensors) if known and s.name == sensor), -1)
        seconds = float_or_nan(time)
        stamp = to_nanoseconds(seconds) if abs(seconds) <= _core.MAX_SECONDS else NO_TIME
        factor = factor_of(sigma, self.sensors, index)
        status = Status(self._engine.push(stamp, index, float_or_nan(value), self._pushes, factor))
        self._pushes += 1
        return status

    def estimate(self, time: float) -> Estimate:
        """Ends the step at ``time`` [s] and returns the estimate there.

        Raises ConfigError if ``time`` is before the last estimate or between the periods of a
        discrete model, NumericalError on overflow; the filter is then unchanged.
        """
        stamp = checks.nanoseconds("time", time)
        status, x, P, sse, degrees = self._engine.estimate(stamp)
        check_estimated(status, time)
        centre = float(x[self.model.output])
        width = self._quantile * float(np.sqrt(P[self.model.output, self.model.output]))
        return Estimate(
            stamp / NANOSECONDS, x, P, centre - width, centre + width, sse, degrees,
            *self._engine.noise(),
        )  # fmt: skip

    def add_sensor(self, sensor: Sensor) -> None:
        """Adds a sensor while streaming; its scale and bias states start in their stationary
        distribution, all other states go on."""
        self._change((*self.sensors, sensor))

    def remove_sensor(self, name: str) -> None:
        """Removes a sensor while streaming: its states are marginalised out, its measurements
        that wait in the buffer are dropped and counted as of an unknown sensor."""
        if name not in [sensor.name for sensor in self.sensors]:
            known = [sensor.name for sensor in self.sensors]
            raise ConfigError(f"remove_sensor: no sensor {name!r}; there are {known}")
        self._change(tuple(sensor for sensor in self.sensors if sensor.name != name))

    def save(self) -> dict[str, Any]:
        """The state while streaming, as plain values and arrays, and the model and sensors to
        which it belongs: ``restore`` continues from it with the same bits."""
        return {
            **self._engine.save(), "pushes": self._pushes, "states": self.state_names,
            **settings(self.model, self.sensors),
        }  # fmt: skip

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Continues from what ``save`` returned, in a filter of the same model and sensors.

        Raises ShapeError or ConfigError, with the filter unchanged, for anything else; the first
        parameter in which the model or a sensor differs is named.
        """
        fits = checked(saved, self.model, self.sensors, self.capacity)
        pushes = fits.pop("pushes")
        status = self._engine.restore(fits)
        if status != "ok":
            raise ConfigError(f"saved: refused: {status}")
        self._pushes = pushes

    def __getstate__(self) -> dict[str, Any]:
        names = ("model", "sensors", "x0", "P0", "start", "risk", "capacity")
        return {"settings": {name: getattr(self, name) for name in names}, "saved": self.save()}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__init__(**state["settings"])  # type: ignore[misc]
        self.restore(state["saved"])

    def _change(self, sensors: tuple[Sensor, ...]) -> None:
        system = make_system(self.model, sensors)
        old = [sensor.name for sensor in self.sensors]
        index = [old.index(s.name) if s.name in old else -1 for s in sensors]
        self._engine = self._engine.with_system(system, index)
        self.sensors = sensors
