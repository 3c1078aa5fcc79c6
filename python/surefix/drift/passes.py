"""The forward passes: of the desynchronized filter over a log, of a linear system over its data."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from surefix import _core
from surefix.core import checks
from surefix.core.checks import NANOSECONDS, FloatArray
from surefix.core.linear_system import LinearSystem
from surefix.core.sensor import make_system
from surefix.desync.filter import DesyncFilter
from surefix.desync.stream import log_factors
from surefix.drift.data import measurements
from surefix.drift.layout import Layout
from surefix.errors import ConfigError, NumericalError
from surefix.log import Log

Status = npt.NDArray[np.uint8]


def pass_log(filter: DesyncFilter, log: Log) -> tuple[_core.DriftRecord, Layout, Status]:
    """The engine's record, where its measurements lie, and the status of every row."""
    names = [sensor.name for sensor in filter.sensors]
    start = None if filter.start is None else checks.nanoseconds("start", filter.start)
    code = log.codes_for(names)
    engine, status = _core.DriftRecord.of_log(
        make_system(filter.model, filter.sensors), filter.x0, filter.P0, start, log.stamp, code,
        log.value, log_factors(log, filter.sensors),
    )  # fmt: skip
    latency = np.array([checks.nanoseconds("latency", s.latency) for s in filter.sensors])
    known = np.where(code >= 0, latency[code], 0)
    time = np.where(np.isfinite(log.time), (log.stamp - known) / NANOSECONDS, np.nan)
    ids = engine.ids
    layout = Layout((len(log),), time, ids, code[ids], log.value[None], alone=True)
    return _finite(engine), layout, status


def pass_system(
    system: LinearSystem,
    data: npt.ArrayLike | Log,
    times: npt.ArrayLike | None,
    inputs: npt.ArrayLike | None,
    estimates: bool,
) -> tuple[_core.DriftRecord, Layout, FloatArray, FloatArray]:
    """The engine's record, where its measurements lie, and, if wanted, x (runs, steps, n) and P."""
    if isinstance(data, Log):
        raise ConfigError("data: expected measurements (steps, m) of a LinearSystem, got a Log")
    z, known, time, alone = measurements(system, data, times, inputs)
    made = _core.DriftRecord.of_system(system.engine, z, known, time, estimates)
    if isinstance(made, str):
        raise NumericalError("system, z: an innovation's variance is not positive and finite")
    engine, x, P = made
    ids = engine.ids
    raw = z.reshape(len(z), -1)
    layout = Layout(z.shape[1:], time, ids, ids % system.measured, raw, alone)
    return _finite(engine), layout, x, P


def channel_names(names: Sequence[str] | None, m: int) -> tuple[str, ...]:
    """Of m components: as given, or their numbers."""
    given = tuple(map(str, range(m))) if names is None else names
    checked = checks.tuple_of("channels", given, str, "names")
    if isinstance(names, str) or len(checked) != m or len(set(checked)) != m:
        raise ConfigError(f"channels: expected {m} different names, got {names!r}")
    return checked


def _finite(engine: _core.DriftRecord) -> _core.DriftRecord:
    if not np.isfinite(engine.log_likelihood).all():
        raise NumericalError("z: the estimate or the likelihood overflows")
    return engine
