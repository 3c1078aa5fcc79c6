"""The tables of a configuration that say what can be wrong: a sensor's ``faults``, ``[[common]]``
faults, and ``[robust]``, how the robust filter weighs them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from typing import Any

from surefix import toml_table as toml
from surefix.core.fault import FaultMode
from surefix.core.sensor import Sensor
from surefix.errors import SurefixError
from surefix.robust.modes import Drifting, Frozen, Interrupted, Noisy, Outage
from surefix.robust.prior import CommonFault
from surefix.toml_table import Kind, Table


@dataclass(frozen=True)
class Robust:
    """Arguments of ``RobustFilter``; those that are None are the filter's own defaults."""

    prior: str | None = None
    carry: str | None = None
    components: int | None = None
    cut: float | None = None
    memory: float | None = None
    max_faults: int | None = None
    hypotheses: str | None = None
    beam: int | None = None
    sides: str | None = None

    def arguments(self) -> dict[str, Any]:
        """Those that are given, by name."""
        given = {field.name: getattr(self, field.name) for field in fields(self)}
        return {name: value for name, value in given.items() if value is not None}


def read_sensor(table: Table) -> Sensor:
    """A sensor and its fault modes."""
    values = table.read(_SENSOR, _SENSOR_OPTIONS)
    faults = [
        _fault(Table(table.path, f"{table.where} faults {i}", entry))
        for i, entry in enumerate(values.pop("faults", ()), start=1)
    ]
    try:
        return Sensor(**values, faults=tuple(faults))
    except SurefixError as error:
        raise table.error(str(error)) from None


def read_robust(table: Table) -> Robust:
    """The table ``[robust]``."""
    robust: Robust = table.make(Robust, {}, _ROBUST)
    return robust


def read_common(table: Table, sensors: Sequence[Sensor]) -> CommonFault:
    """One of the tables ``[[common]]``, whose sensors and modes must be among ``sensors``."""
    fault: CommonFault = table.make(CommonFault, {"modes": toml.table, "rate": toml.number}, {})
    labels = {sensor.name: [mode.label for mode in sensor.faults] for sensor in sensors}
    for name, label in fault.modes.items():
        if name not in labels:
            hint = toml.nearest(name, list(labels))
            raise table.error(f"modes: unknown sensor {name!r}; {hint}")
        if label not in labels[name]:
            known = ", ".join(labels[name]) or "none"
            raise table.error(f"modes: sensor {name!r} has no mode {label!r}; it has {known}")
    return fault


def _fault(table: Table) -> FaultMode:
    (what, required, optional), rest = table.choice("mode", _MODES)
    fault: FaultMode = rest.make(what, required, optional)
    return fault


def _numbers(*names: str) -> dict[str, Kind]:
    return dict.fromkeys(names, toml.number)


_SENSOR: dict[str, Kind] = {"name": toml.text, "sigma": toml.number}
_SENSOR_OPTIONS: dict[str, Kind] = {
    **_numbers("scale_sigma", "scale_time", "bias_sigma", "bias_time", "latency"),
    "observes": toml.numbers,
    "faults": toml.tables('each as { mode = "outage", … }'),
}
_PRIOR = _numbers("probability", "rate", "duration")
_MODES: dict[str, tuple[Callable[..., FaultMode], dict[str, Kind], dict[str, Kind]]] = {
    "outage": (Outage, _numbers("span"), _PRIOR),
    "frozen": (Frozen, _numbers("resolution", "span"), {**_PRIOR, **_numbers("change")}),
    "drifting": (Drifting, _numbers("sigma", "walk"), {**_PRIOR, **_numbers("factor")}),
    "noisy": (Noisy, _numbers("factor"), _PRIOR),
    "interrupted": (Interrupted, {}, {**_PRIOR, **_numbers("factor")}),
}
_ROBUST: dict[str, Kind] = {
    **dict.fromkeys(("prior", "carry", "hypotheses", "sides"), toml.text),
    **dict.fromkeys(("components", "max_faults", "beam"), toml.whole),
    **_numbers("cut", "memory"),
}
