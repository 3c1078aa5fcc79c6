"""Configuration files: a TOML file that says which model, sensors and outputs a run has.

Tables: ``[model]``, ``[initial]``, ``[[sensor]]``, and optionally ``[robust]``, ``[[common]]``,
``[log]``, ``[output]``, ``[reference]``, ``[inject]`` and ``[drift]``. Every key that is not known,
is missing or has the wrong type is a ConfigError that names the file and the key.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from surefix import toml_table as toml
from surefix.config_drift import Drift, read_drift
from surefix.config_faults import Robust, read_common, read_robust, read_sensor
from surefix.core import checks
from surefix.core.checks import FloatArray
from surefix.core.models import (
    ConstantAcceleration,
    ConstantVelocity,
    DiscreteModel,
    LinearModel,
    Model,
)
from surefix.core.sensor import Sensor
from surefix.desync.filter import DesyncFilter
from surefix.desync.result import Result
from surefix.errors import ConfigError, SurefixError
from surefix.injection.draw import Sizes
from surefix.log import Log
from surefix.reading.columns import Progress
from surefix.reading.log import read_log
from surefix.reading.reference import Reference
from surefix.robust.filter import RobustFilter
from surefix.robust.prior import CommonFault
from surefix.robust.result import RobustResult
from surefix.toml_table import Kind, Table


@dataclass(frozen=True)
class LogColumns:
    """Names of a log's columns, ``sigma`` where readings say how good they are; ``columns``, from
    sensor to column, for a wide table."""

    time: str = "time_s"
    sensor: str = "sensor"
    value: str = "value"
    sigma: str | None = None
    columns: Mapping[str, str] | None = None


@dataclass(frozen=True)
class Output:
    """What a run gives: ``rate`` [Hz], None for an estimate at every measurement; ``risk`` per
    estimate; ``delay`` [s]; of the linear filter ``false_alarm`` per run, and ``noise``: 'step' or
    'journey'."""

    rate: float | None = None
    risk: float = 1e-11
    false_alarm: float = 0.01
    noise: str = "step"
    delay: float | None = None


@dataclass(frozen=True, eq=False)
class Config:
    """A configuration, as ``load_config`` reads it. ``state`` (n,) and ``covariance`` (n, n) belong
    to ``start`` [s], or to the first measurement if that is None."""

    path: Path
    model: Model
    sensors: tuple[Sensor, ...]
    state: FloatArray
    covariance: FloatArray
    start: float | None = None
    log: LogColumns = field(default_factory=LogColumns)
    output: Output = field(default_factory=Output)
    reference: Reference | None = None
    robust: Robust = field(default_factory=Robust)
    common: tuple[CommonFault, ...] = ()
    inject: Sizes = field(default_factory=Sizes)
    drift: Drift = field(default_factory=Drift)

    def make_filter(self) -> DesyncFilter | RobustFilter:
        """The filter that this configuration describes: robust if a sensor has faults."""
        if any(sensor.faults for sensor in self.sensors):
            return RobustFilter(
                self.model, self.sensors, self.state, self.covariance, start=self.start,
                risk=self.output.risk, common=self.common, **self.robust.arguments(),
            )  # fmt: skip
        return self.make_linear_filter()

    def make_linear_filter(self) -> DesyncFilter:
        """The linear filter, to which all sensors are healthy."""
        return DesyncFilter(
            self.model, self._healthy(), self.state, self.covariance,
            start=self.start, risk=self.output.risk,
        )  # fmt: skip

    def without_faults(self) -> Config:
        """The same for the linear filter, to which all sensors are healthy."""
        return dataclasses.replace(self, sensors=self._healthy(), robust=Robust(), common=())

    def _healthy(self) -> tuple[Sensor, ...]:
        return tuple(dataclasses.replace(sensor, faults=()) for sensor in self.sensors)

    def run(self, log: Log) -> Result | RobustResult:
        """Filters a log with ``make_filter`` and gives the output that is asked for."""
        engine, output = self.make_filter(), self.output
        if isinstance(engine, RobustFilter):
            return engine.run(log, rate=output.rate, delay=output.delay)
        return engine.run(log, rate=output.rate, delay=output.delay, noise=output.noise)

    def read_log(self, path: str | Path, progress: Progress | None = None) -> Log:
        """Reads a log with this configuration's column names."""
        names = self.log
        return read_log(
            path, time=names.time, sensor=names.sensor, value=names.value,
            sigma=names.sigma, columns=names.columns, progress=progress,
        )  # fmt: skip


def load_config(path: str | Path) -> Config:
    """Reads and checks a configuration file. Raises ConfigError naming the file and the key."""
    path = Path(path)
    data = toml.parse(path)
    top = Table(path, "", data)
    tables = top.read(_TABLES, _TABLES_OPTIONS)
    model = _model(Table(path, "[model]", tables["model"]))
    sensors = [
        read_sensor(Table(path, f"[[sensor]] {i}", entry))
        for i, entry in enumerate(tables["sensor"], start=1)
    ]
    state, covariance, start = _initial(Table(path, "[initial]", tables["initial"]), model)
    log = Table(path, "[log]", tables.get("log", {}))
    output = Table(path, "[output]", tables.get("output", {}))
    reference = None
    if "reference" in tables:
        table = Table(path, "[reference]", tables["reference"])
        reference = table.make(
            Reference,
            {"file": toml.text},
            {"time": toml.text, "value": toml.text},
        )
    for name in ("robust", "common"):
        if name in tables and not any(sensor.faults for sensor in sensors):
            raise top.error(f"{name}: expected a sensor with faults")
    common = [
        read_common(Table(path, f"[[common]] {i}", entry), sensors)
        for i, entry in enumerate(tables.get("common", ()), start=1)
    ]
    config = Config(
        path, model, tuple(sensors), state, covariance, start,
        log=log.make(LogColumns, {}, _LOG), output=_output(output), reference=reference,
        robust=read_robust(Table(path, "[robust]", tables.get("robust", {}))),
        common=tuple(common),
        inject=Table(path, "[inject]", tables.get("inject", {})).make(Sizes, {}, _INJECT),
        drift=read_drift(Table(path, "[drift]", tables.get("drift", {})), sensors),
    )  # fmt: skip
    try:
        config.make_filter()  # what concerns several tables: equal names, sizes
    except SurefixError as error:
        raise ConfigError(f"{path}: {error}") from None
    return config


def _model(table: Table) -> Model:
    (what, required, optional), rest = table.choice("kind", _MODELS)
    model: Model = rest.make(what, required, optional)
    return model


def _initial(table: Table, model: Model) -> tuple[FloatArray, FloatArray, float | None]:
    optional = {
        "sigma": toml.numbers,
        "covariance": toml.matrix,
        "time": toml.number,
    }
    values = table.read({"state": toml.numbers}, optional)
    if ("sigma" in values) == ("covariance" in values):
        raise table.error("expected either 'sigma' or 'covariance'")
    try:
        state = checks.array("state", values["state"], (model.size,))
        if "sigma" in values:
            sigma = checks.array("sigma", values["sigma"], (model.size,))
            if (sigma < 0).any():
                raise ConfigError(f"sigma: expected numbers >= 0, got {sigma.tolist()}")
            covariance = np.diag(sigma**2)
        else:
            covariance = checks.covariance("covariance", values["covariance"], model.size)
    except SurefixError as error:
        raise table.error(str(error)) from None
    return state, covariance, values.get("time")


def _output(table: Table) -> Output:
    output: Output = table.make(Output, {}, _OUTPUT)
    try:
        check_output(output)
    except SurefixError as error:
        raise table.error(str(error)) from None
    return output


def check_output(output: Output) -> None:
    """Raises ConfigError if a value of ``output`` is out of range."""
    if output.rate is not None:
        checks.positive("rate", output.rate)
    checks.probability("risk", output.risk)
    checks.probability("false_alarm", output.false_alarm)
    if output.delay is not None:
        checks.not_negative("delay", output.delay)
        if output.rate is None:
            raise ConfigError("delay: expected rate with it")
    if output.noise not in ("step", "journey"):
        raise ConfigError(f"noise: expected 'step' or 'journey', got {output.noise!r}")


_TABLES: dict[str, Kind] = {
    "model": toml.table,
    "initial": toml.table,
    "sensor": toml.tables("each headed [[sensor]]"),
}
_TABLES_OPTIONS: dict[str, Kind] = {
    **dict.fromkeys(("robust", "log", "output", "reference", "inject", "drift"), toml.table),
    "common": toml.tables("each headed [[common]]"),
}
_STATES: dict[str, Kind] = {"names": toml.texts, "reads": toml.whole}
_MODELS: dict[str, tuple[Callable[..., Model], dict[str, Kind], dict[str, Kind]]] = {
    "constant-acceleration": (
        ConstantAcceleration,
        {"jerk": toml.number},
        {"position": toml.flag},
    ),
    "constant-velocity": (
        ConstantVelocity,
        {"acceleration": toml.number},
        {"position": toml.flag},
    ),
    "linear": (
        LinearModel,
        {"A": toml.matrix, "L": toml.matrix, "Qc": toml.matrix},
        _STATES,
    ),
    "discrete": (
        DiscreteModel,
        {"F": toml.matrix, "Q": toml.matrix, "period": toml.number},
        _STATES,
    ),
}
_LOG: dict[str, Kind] = {
    "time": toml.text,
    "sensor": toml.text,
    "value": toml.text,
    "sigma": toml.text,
    "columns": toml.columns,
}
_OUTPUT: dict[str, Kind] = {
    **dict.fromkeys(("rate", "risk", "false_alarm", "delay"), toml.number),
    "noise": toml.text,
}
_INJECT: dict[str, Kind] = {
    "duration": toml.number,
    **dict.fromkeys(("jump", "ramp", "scale"), toml.numbers),
}
