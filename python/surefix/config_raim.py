"""Configuration of ``surefix raim``: a TOML file that says how pseudoranges and a track are read,
and what the monitor is to hold.

Tables, all optional: ``[pseudoranges]``, ``[track]``, ``[monitor]``, ``[truth]`` and ``[[mask]]``.
Every key that is not known or has the wrong type is a ConfigError that names the file and the key.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from surefix import toml_table as toml
from surefix.config_raim_tables import MonitorTable, PseudorangeTable, TrackTable, TruthTable
from surefix.raim.masks import Cutting, Mask, Tunnel
from surefix.toml_table import Kind, Table


@dataclass(frozen=True)
class RaimConfig:
    """A configuration, as ``load_raim_config`` reads it."""

    pseudoranges: PseudorangeTable = field(default_factory=PseudorangeTable)
    track: TrackTable = field(default_factory=TrackTable)
    monitor: MonitorTable = field(default_factory=MonitorTable)
    truth: TruthTable = field(default_factory=TruthTable)
    masks: tuple[Mask, ...] = ()


def load_raim_config(path: str | Path) -> RaimConfig:
    """Reads and checks a configuration file. Raises ConfigError naming the file and the key."""
    path = Path(path)
    tables = Table(path, "", toml.parse(path)).read({}, _TABLES)

    def one(name: str, what: Callable[..., Any], kinds: dict[str, Kind]) -> Any:
        return Table(path, f"[{name}]", tables.get(name, {})).make(what, {}, kinds)

    masks = [
        _mask(Table(path, f"[[mask]] {i}", entry))
        for i, entry in enumerate(tables.get("mask", ()), start=1)
    ]
    return RaimConfig(
        one("pseudoranges", PseudorangeTable, _PSEUDORANGES), one("track", TrackTable, _TRACK),
        one("monitor", MonitorTable, _MONITOR), one("truth", TruthTable, _TRUTH), tuple(masks),
    )  # fmt: skip


def _mask(table: Table) -> Mask:
    (what, required), rest = table.choice("kind", _MASKS)
    mask: Mask = rest.make(what, required, {})
    return mask


def _text_or_number(value: Any) -> str | float:
    if isinstance(value, str) and value:
        return value
    try:
        return toml.number(value)
    except toml.Wrong:
        raise toml.Wrong("the name of a column, or a number of metres") from None


def _numbers(*names: str) -> dict[str, Kind]:
    return dict.fromkeys(names, toml.number)


def _texts(*names: str) -> dict[str, Kind]:
    return dict.fromkeys(names, toml.text)


_TABLES: dict[str, Kind] = {
    **dict.fromkeys(("pseudoranges", "track", "monitor", "truth"), toml.table),
    "mask": toml.tables("each headed [[mask]]"),
}
_PSEUDORANGES: dict[str, Kind] = {
    **_texts("time", "satellite", "pseudorange", "system"),
    **_numbers("sigma_zenith", "elevation_mask"),
    "position": toml.texts,
    "sigma": _text_or_number,
    "earth_rotation": toml.flag,
}
_TRACK: dict[str, Kind] = {"columns": toml.texts, **_numbers("tolerance", "height", "start")}
_MONITOR: dict[str, Kind] = {
    **_numbers("length", "false_alarm", "missed", "risk", "fault_probability", "interval"),
    **_numbers("max_speed", "near"),
    **dict.fromkeys(("max_faults", "max_excluded"), toml.whole),
}
_TRUTH: dict[str, Kind] = {**_texts("time", "along"), "position": toml.texts}
_MASKS: dict[str, tuple[Callable[..., Mask], dict[str, Kind]]] = {
    "cutting": (Cutting, _numbers("low", "high", "left_deg", "right_deg")),
    "tunnel": (Tunnel, _numbers("low", "high")),
}
