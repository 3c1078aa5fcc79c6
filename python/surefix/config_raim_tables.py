"""The tables of a configuration of ``surefix raim``, each checked by itself."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

from surefix.core import checks
from surefix.errors import ConfigError
from surefix.raim.monitor import TrackRaim
from surefix.raim.track import Track

ELEVATION_MASK = 5.0


@dataclass(frozen=True)
class PseudorangeTable:
    """Names of the columns, those that are None as ``read_pseudoranges`` has them; ``sigma`` may be
    a number [m] for all instead. ``sigma_zenith`` [m]: σ overhead, divided by the sine of the
    elevation; instead of ``sigma``. ``elevation_mask`` [degrees]: what is lower is not used.
    ``earth_rotation``: positions are in the frame at transmission."""

    time: str | None = None
    satellite: str | None = None
    position: tuple[str, ...] | None = None
    pseudorange: str | None = None
    system: str | None = None
    sigma: str | float | None = None
    sigma_zenith: float | None = None
    elevation_mask: float = ELEVATION_MASK
    earth_rotation: bool = False

    def __post_init__(self) -> None:
        _check_three("position", self.position)
        if self.sigma is not None and self.sigma_zenith is not None:
            raise ConfigError("sigma, sigma_zenith: expected one of them, got both")
        if isinstance(self.sigma, float):
            checks.positive("sigma", self.sigma)
        if self.sigma_zenith is not None:
            checks.positive("sigma_zenith", self.sigma_zenith)
        if not -90 <= checks.number("elevation_mask", self.elevation_mask) <= 90:
            raise ConfigError(
                f"elevation_mask: expected degrees from -90 to 90, got {self.elevation_mask:g}"
            )

    def columns(self) -> dict[str, Any]:
        """Arguments of ``read_pseudoranges``, those that are given. With ``sigma_zenith`` the
        elevations give σ, later."""
        names = ("time", "satellite", "position", "pseudorange", "system", "sigma")
        return {name: v for name in names if (v := getattr(self, name)) is not None}


@dataclass(frozen=True)
class TrackTable:
    """Arguments of ``read_track``."""

    columns: tuple[str, ...] | None = None
    tolerance: float = 0.0
    height: float = 0.0
    start: float = 0.0

    def __post_init__(self) -> None:
        if self.columns is not None and len(self.columns) not in (2, 3):
            raise ConfigError(f"columns: expected two or three, got {list(self.columns)}")
        checks.not_negative("tolerance", self.tolerance)
        checks.number("height", self.height)
        checks.number("start", self.start)


@dataclass(frozen=True)
class MonitorTable:
    """Arguments of ``TrackRaim``; those that are None are its own defaults. ``length`` may instead
    be given on the command line. ``near`` [m]: where the journey begins, of ``TrackRaim.run``."""

    length: float | None = None
    false_alarm: float | None = None
    missed: float | None = None
    risk: float | None = None
    fault_probability: float | None = None
    max_faults: int | None = None
    max_excluded: int | None = None
    interval: float | None = None
    max_speed: float | None = None
    near: float | None = None

    def __post_init__(self) -> None:
        anywhere = Track([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
        TrackRaim(anywhere, **{"length": 1.0, **self.arguments()})  # which complains itself
        if self.near is not None:
            checks.number("near", self.near)

    def arguments(self) -> dict[str, Any]:
        """Those of ``TrackRaim`` itself that are given, by name."""
        given = {one.name: getattr(self, one.name) for one in fields(self) if one.name != "near"}
        return {name: value for name, value in given.items() if value is not None}


@dataclass(frozen=True)
class TruthTable:
    """Names of the columns of a file with the true positions: ``along``, mileages, or ``position``,
    three Cartesian ones, fixed to the Earth; None: those of ``position``'s usual names that are
    there. ``time`` None: as of the pseudoranges."""

    time: str | None = None
    along: str | None = None
    position: tuple[str, ...] | None = None

    def __post_init__(self) -> None:
        _check_three("position", self.position)
        if self.along is not None and self.position is not None:
            raise ConfigError("along, position: expected one of them, got both")


def _check_three(key: str, names: tuple[str, ...] | None) -> None:
    if names is not None and len(names) != 3:
        raise ConfigError(f"{key}: expected three names of columns, got {list(names)}")
