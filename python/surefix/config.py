"""Configuration files: a TOML file that says which model, sensors and outputs a run has.

Tables: ``[model]``, ``[initial]``, ``[[sensor]]``, and optionally ``[log]``, ``[output]`` and
``[reference]``. Every key that is not known, is missing or has the wrong type is a ConfigError
that names the file and the key.
"""

from __future__ import annotations

import difflib
import re
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

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
    data = _parse(path)
    top = _Table(path, "", data)
    wanted = {"model": _table, "initial": _table, "sensor": _tables}
    tables = top.read(wanted, {"log": _table, "output": _table, "reference": _table})
    model = _model(_Table(path, "[model]", tables["model"]))
    sensors = []
    for i, entry in enumerate(tables["sensor"], start=1):
        table = _Table(path, f"[[sensor]] {i}", entry)
        sensors.append(table.make(Sensor, _SENSOR, _SENSOR_OPTIONS))
    state, covariance, start = _initial(_Table(path, "[initial]", tables["initial"]), model)
    log = _Table(path, "[log]", tables.get("log", {}))
    output = _Table(path, "[output]", tables.get("output", {}))
    reference = None
    if "reference" in tables:
        table = _Table(path, "[reference]", tables["reference"])
        reference = table.make(Reference, {"file": _text}, {"time": _text, "value": _text})
    config = Config(
        path, model, tuple(sensors), state, covariance, start,
        log=log.make(LogColumns, {}, _LOG), output=_output(output), reference=reference,
    )  # fmt: skip
    try:
        config.make_filter()  # what concerns several tables: equal names, sizes
    except SurefixError as error:
        raise ConfigError(f"{path}: {error}") from None
    return config


def _parse(path: Path) -> dict[str, Any]:
    try:
        if sys.version_info >= (3, 11):
            import tomllib
        else:
            import tomli as tomllib
    except ImportError:
        raise SurefixError(f"{path}: reading it needs tomli: pip install surefix[cli]") from None
    try:
        text = path.read_bytes().decode("utf-8-sig")
        return tomllib.loads(text)
    except OSError as error:
        raise ConfigError(f"{path}: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise ConfigError(f"{path}: not a UTF-8 text: {error}") from None
    except tomllib.TOMLDecodeError as error:
        place = re.search(r" \(at (?:line (\d+), column \d+|end of document)\)$", str(error))
        line = place[1] if place and place[1] else text.count("\n") + 1
        reason = str(error)[: place.start()] if place else str(error)
        raise ConfigError(f"{path}, line {line}: {reason}") from None


class _Wrong(Exception):
    """A value of the wrong type; its text says what was expected."""


Kind = Callable[[Any], Any]


@dataclass(frozen=True)
class _Table:
    """One table of the file. ``where`` names it in errors."""

    path: Path
    where: str
    data: Mapping[str, Any]

    def error(self, text: str) -> ConfigError:
        place = f" {self.where}" if self.where else ""
        return ConfigError(f"{self.path}:{place} {text}")

    def read(self, required: Mapping[str, Kind], optional: Mapping[str, Kind]) -> dict[str, Any]:
        """The values, converted; keys that are absent and optional are left out."""
        kinds = {**required, **optional}
        for key in self.data:
            if key not in kinds:
                raise self.error(f"unknown key {key!r}; {_nearest(key, list(kinds))}")
        for key in required:
            if key not in self.data:
                raise self.error(f"missing key {key!r}")
        values = {}
        for key, value in self.data.items():
            try:
                values[key] = kinds[key](value)
            except _Wrong as wrong:
                raise self.error(f"{key}: expected {wrong}, got {value!r}") from None
        return values

    def make(
        self, what: Callable[..., Any], required: Mapping[str, Kind], optional: Mapping[str, Kind]
    ) -> Any:
        """``what`` made from the values, its complaints with the place in front."""
        values = self.read(required, optional)
        try:
            return what(**values)
        except SurefixError as error:
            raise self.error(str(error)) from None


def _nearest(key: str, known: list[str]) -> str:
    close = difflib.get_close_matches(key, known, n=1, cutoff=0.5)
    return f"did you mean {close[0]!r}?" if close else f"known are {', '.join(known)}"


def _model(table: _Table) -> Model:
    kind = table.data.get("kind")
    if "kind" not in table.data:
        raise table.error("missing key 'kind'")
    if not isinstance(kind, str) or kind not in _MODELS:
        hint = _nearest(str(kind), list(_MODELS))
        raise table.error(f"kind: expected one of {', '.join(_MODELS)}, got {kind!r}; {hint}")
    what, required, optional = _MODELS[kind]
    rest = {key: value for key, value in table.data.items() if key != "kind"}
    model: Model = _Table(table.path, table.where, rest).make(what, required, optional)
    return model


def _initial(table: _Table, model: Model) -> tuple[FloatArray, FloatArray, float | None]:
    optional = {"sigma": _numbers, "covariance": _matrix, "time": _number}
    values = table.read({"state": _numbers}, optional)
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


def _output(table: _Table) -> Output:
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


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise _Wrong("a number")
    return float(value)


def _whole(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise _Wrong("a whole number")
    return value


def _flag(value: Any) -> bool:
    if not isinstance(value, bool):
        raise _Wrong("true or false")
    return value


def _text(value: Any) -> str:
    if not isinstance(value, str) or not value:
        raise _Wrong("a text")
    return value


def _list(kind: Kind, name: str) -> Kind:
    def read(value: Any) -> tuple[Any, ...]:
        if not isinstance(value, list):
            raise _Wrong(name)
        try:
            return tuple(kind(entry) for entry in value)
        except _Wrong:
            raise _Wrong(name) from None

    return read


def _table(value: Any) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise _Wrong("a table")
    return value


def _tables(value: Any) -> list[dict[str, Any]]:
    if not isinstance(value, list) or not all(isinstance(entry, dict) for entry in value):
        raise _Wrong("tables, each headed [[sensor]]")
    return value


def _columns(value: Any) -> dict[str, str]:
    table = _table(value)
    if not table or not all(isinstance(name, str) for name in table.values()):
        raise _Wrong('a table of sensor = "column"')
    return table


_numbers = _list(_number, "a list of numbers")
_matrix = _list(_numbers, "a list of rows of numbers")
_texts = _list(_text, "a list of texts")

_SENSOR: dict[str, Kind] = {"name": _text, "sigma": _number}
_SENSOR_OPTIONS: dict[str, Kind] = {
    **dict.fromkeys(("scale_sigma", "scale_time", "bias_sigma", "bias_time", "latency"), _number),
    "observes": _numbers,
}
_STATES: dict[str, Kind] = {"names": _texts, "reads": _whole}
_MODELS: dict[str, tuple[Callable[..., Model], dict[str, Kind], dict[str, Kind]]] = {
    "constant-acceleration": (ConstantAcceleration, {"jerk": _number}, {"position": _flag}),
    "constant-velocity": (ConstantVelocity, {"acceleration": _number}, {"position": _flag}),
    "linear": (LinearModel, {"A": _matrix, "L": _matrix, "Qc": _matrix}, _STATES),
    "discrete": (DiscreteModel, {"F": _matrix, "Q": _matrix, "period": _number}, _STATES),
}
_LOG: dict[str, Kind] = {"time": _text, "sensor": _text, "value": _text, "columns": _columns}
_OUTPUT: dict[str, Kind] = {
    **dict.fromkeys(("rate", "risk", "false_alarm", "delay"), _number), "noise": _text,
}  # fmt: skip
