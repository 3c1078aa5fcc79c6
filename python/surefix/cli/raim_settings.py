"""The configuration of ``surefix raim`` with the options of the command line."""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Mapping
from typing import Any, TypeVar

import typer

from surefix.config_raim import RaimConfig
from surefix.errors import ConfigError
from surefix.raim.monitor import TrackRaim

Table = TypeVar("Table")

PSEUDORANGES = {"mask": "elevation_mask", "sigma": "sigma_zenith"}
"""Options that are keys of ``[pseudoranges]`` under another name."""
MONITOR = (
    "length", "false_alarm", "missed", "risk", "fault_probability", "max_excluded", "max_speed",
    "near",
)  # fmt: skip


def overridden(config: RaimConfig, options: Mapping[str, Any]) -> RaimConfig:
    """With the ``options`` that are not None; raises BadParameter for what is wrong in them or
    still missing: L, and what the pseudoranges' noise is, have no defaults."""
    given = {name: value for name, value in options.items() if value is not None}
    read = {key: given[name] for name, key in PSEUDORANGES.items() if name in given}
    if "sigma" in given:
        read["sigma"] = None  # that of the file
    if given.get("earth_rotation"):
        read["earth_rotation"] = True
    config = dataclasses.replace(
        config,
        pseudoranges=_with(config.pseudoranges, read),
        track=_with(config.track, {k: given[k] for k in ("tolerance",) if k in given}),
        monitor=_with(config.monitor, {k: given[k] for k in MONITOR if k in given}),
    )
    if config.monitor.length is None:
        raise typer.BadParameter("--length: expected it, or length in [monitor] of --config")
    if config.pseudoranges.sigma is None and config.pseudoranges.sigma_zenith is None:
        raise typer.BadParameter(
            "--sigma: expected it, or sigma or sigma_zenith in [pseudoranges] of --config"
        )
    return config


def with_default(name: str, text: str) -> str:
    """A help text with the default of ``TrackRaim``'s argument."""
    return f"{text}; {inspect.signature(TrackRaim).parameters[name].default:g} if not given."


def _with(table: Table, changes: Mapping[str, Any]) -> Table:
    try:
        return dataclasses.replace(table, **changes)  # type: ignore[type-var]
    except ConfigError as error:
        names = {key: name for name, key in PSEUDORANGES.items()}
        key, _, text = str(error).partition(":")
        option = names.get(key, key).replace("_", "-")
        raise typer.BadParameter(f"--{option}:{text}") from None
