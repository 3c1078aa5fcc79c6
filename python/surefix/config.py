"""Configuration files: a TOML file that says which model, sensors and outputs a run has.

Tables: ``[model]``, ``[initial]``, ``[[sensor]]``, and optionally ``[log]``, ``[output]`` and
``[reference]``. Every key that is not known, is missing or has the wrong type is a ConfigError
that names the file and the key.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from surefix import toml_table as toml
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
from surefix.errors import ConfigError, SurefixError
from surefix.log import Log, Progress, read_log
from surefix.toml_table import Kind, Table


@dataclass(frozen=True)
class LogColumns:
    """Names of a log's columns; ``columns``, from sensor to column, for a wide table."""

    time: str = "time_s"
    sensor: str = "sensor"
    value: str = "value"
    columns: Mapping[str, str] | None = None


@dataclass(frozen=True)
class Output:
    """What a run gives: ``rate`` [Hz], None for an estimate at every measurement; ``risk`` per
    estimate; ``false_alarm`` per run; ``noise``: 'step' or 'journey'; ``delay`` [s]."""

    rate: float | None = None
    risk: float = 1e-11
    false_alarm: float = 0.01
    noise: str = "step"
    delay: float | None = None


@dataclass(frozen=True)
class Reference:
    """The true output over time, in a file beside the log: names of the file and its columns."""

    file: str
    time: str = "time_s"
    value: str = "value"

    def read(self, folder: Path) -> tuple[FloatArray, FloatArray]:
        """Time [s] and value, each (R,), in order of time."""
        columns = {"reference": self.value}
        log = read_log(folder / self.file, time=self.time, columns=columns)
        return log.time, log.value


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

    def make_filter(self) -> DesyncFilter:
        """The filter that this configuration describes."""
        return DesyncFilter(
            self.model, self.sensors, self.state, self.covariance,
            start=self.start, risk=self.output.risk,
        )  # fmt: skip

    def read_log(self, path: str | Path, progress: Progress | None = None) -> Log:
        """Reads a log with this configuration's column names."""
        names = self.log
        return read_log(
            path, time=names.time, sensor=names.sensor, value=names.value,
            columns=names.columns, progress=progress,
        )  # fmt: skip


def load_config(path: str | Path) -> Config:
    """Reads and checks a configuration file. Raises ConfigError naming the file and the key."""
    path = Path(path)
    data = toml.parse(path)
    top = Table(path, "", data)
    wanted = {"model": toml.table, "initial": toml.table, "sensor": toml.tables}
    tables = top.read(wanted, {"log": toml.table, "output": toml.table, "reference": toml.table})
    model = _model(Table(path, "[model]", tables["model"]))
    sensors = []
    for i, entry in enumerate(tables["sensor"], start=1):
        table = Table(path, f"[[sensor]] {i}", entry)
        sensors.append(table.make(Sensor, _SENSOR, _SENSOR_OPTIONS))
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
    config = Config(
        path, model, tuple(sensors), state, covariance, start,
        log=log.make(LogColumns, {}, _LOG), output=_output(output), reference=reference,
    )  # fmt: skip
    try:
        config.make_filter()  # what concerns several tables: equal names, sizes
    except SurefixError as error:
        raise ConfigError(f"{path}: {error}") from None
    return config


def _model(table: Table) -> Model:
    kind = table.data.get("kind")
    if "kind" not in table.data:
        raise table.error("missing key 'kind'")
    if not isinstance(kind, str) or kind not in _MODELS:
        hint = toml.nearest(str(kind), list(_MODELS))
        raise table.error(f"kind: expected one of {', '.join(_MODELS)}, got {kind!r}; {hint}")
    what, required, optional = _MODELS[kind]
    rest = {key: value for key, value in table.data.items() if key != "kind"}
    model: Model = Table(table.path, table.where, rest).make(what, required, optional)
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


_SENSOR: dict[str, Kind] = {"name": toml.text, "sigma": toml.number}
_SENSOR_OPTIONS: dict[str, Kind] = {
    **dict.fromkeys(
        ("scale_sigma", "scale_time", "bias_sigma", "bias_time", "latency"), toml.number
    ),
    "observes": toml.numbers,
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
    "columns": toml.columns,
}
_OUTPUT: dict[str, Kind] = {
    **dict.fromkeys(("rate", "risk", "false_alarm", "delay"), toml.number),
    "noise": toml.text,
}
