"""The table ``[drift]`` of a configuration: which slow faults ``surefix drift`` looks for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from surefix import toml_table as toml
from surefix.core import checks
from surefix.core.checks import FloatArray
from surefix.core.sensor import Sensor
from surefix.drift.profile import Profile
from surefix.errors import ConfigError
from surefix.toml_table import Kind, Table

PROFILES = ("step", "ramp", "exponential")
MOST_FREQUENCIES = 20_000
PER_CYCLE = 2
"""Frequencies for each cycle in the log: the peak of a sinusoid is one cycle wide."""


@dataclass(frozen=True)
class Drift:
    """What is searched for. ``profiles``: courses since an unknown onset; ``exponential_time`` [s]
    of the exponential, negative for one that grows; ``ends``: also faults that end; ``spectrum``:
    sinusoids, ``frequencies`` (lowest, highest) [Hz], by default all that the log can show;
    ``sensors``: those that may be at fault, None for all; ``false_alarm`` of the whole search;
    ``max_faults`` that are looked for, each in what the ones before left."""

    profiles: tuple[str, ...] = ("step", "ramp")
    exponential_time: float | None = None
    ends: bool = False
    spectrum: bool = True
    frequencies: tuple[float, ...] | None = None
    sensors: tuple[str, ...] | None = None
    false_alarm: float = 1e-3
    max_faults: int = 3

    def __post_init__(self) -> None:
        for name in self.profiles:
            checks.one_of("profiles", name, PROFILES)
        _differ("profiles", self.profiles)
        if not self.profiles and not self.spectrum:
            raise ConfigError("profiles, spectrum: expected something to search for")
        if ("exponential" in self.profiles) != (self.exponential_time is not None):
            raise ConfigError("exponential_time: expected with the profile 'exponential' only")
        self.courses()
        if self.frequencies is not None:
            _check_range(self.frequencies, self.spectrum)
        if self.sensors is not None:
            _differ("sensors", self.sensors)
            if not self.sensors:
                raise ConfigError("sensors: expected the name of one at least")
        checks.probability("false_alarm", self.false_alarm, 1e-12)
        checks.whole("max_faults", self.max_faults, 1, 100)

    def courses(self) -> tuple[Profile, ...]:
        """The profiles themselves."""
        return tuple(self._course(name) for name in self.profiles)

    def grid(self, duration: float, interval: float) -> FloatArray | None:
        """The frequencies [Hz] that are searched in a log of ``duration`` [s] whose fastest sensor
        reports every ``interval`` [s]; None: for every sensor all that it can show. Those are cut
        off where they are too many; raises ConfigError if so are those that the table asks for."""
        if duration <= 0 or interval <= 0:
            return None
        spacing = 1 / (PER_CYCLE * duration)
        if self.frequencies is None:
            if duration / interval <= MOST_FREQUENCIES:
                return None
            return spacing * np.arange(PER_CYCLE, MOST_FREQUENCIES + 1, dtype=np.float64)
        low, high = self.frequencies
        count = int((high - low) / spacing * (1 + 1e-9)) + 1
        if count > MOST_FREQUENCIES:
            raise ConfigError(
                f"frequencies: {low:g} to {high:g} Hz in a log of {duration:g} s are {count} "
                f"frequencies, expected at most {MOST_FREQUENCIES}: end at "
                f"{low + (MOST_FREQUENCIES - 1) * spacing:.5g} Hz, or search a part of the log"
            )
        return low + spacing * np.arange(count, dtype=np.float64)

    def _course(self, name: str) -> Profile:
        if name != "exponential":
            return Profile.step() if name == "step" else Profile.ramp()
        time = self.exponential_time
        if time is None or not 1e-9 <= abs(time) < np.inf:
            raise ConfigError(f"exponential_time: expected a number of s, not 0, got {time}")
        return Profile.exponential(time)


def read_drift(table: Table, sensors: Sequence[Sensor]) -> Drift:
    """The table ``[drift]``, whose sensors must be among ``sensors``."""
    drift: Drift = table.make(Drift, {}, _DRIFT)
    names = [sensor.name for sensor in sensors]
    for name in drift.sensors or ():
        if name not in names:
            raise table.error(f"sensors: unknown sensor {name!r}; {toml.nearest(name, names)}")
    return drift


def _check_range(frequencies: tuple[float, ...], spectrum: bool) -> None:
    if not spectrum:
        raise ConfigError("frequencies: expected with spectrum = true only")
    if len(frequencies) != 2 or not 0 < frequencies[0] < frequencies[1] < np.inf:
        raise ConfigError(
            f"frequencies: expected [lowest, highest] in Hz, 0 < lowest < highest, "
            f"got {list(frequencies)}"
        )


def _differ(key: str, names: tuple[str, ...]) -> None:
    if len(set(names)) < len(names):
        raise ConfigError(f"{key}: expected different names, got {', '.join(names)}")


_DRIFT: dict[str, Kind] = {
    **dict.fromkeys(("profiles", "sensors"), toml.texts),
    **dict.fromkeys(("exponential_time", "false_alarm"), toml.number),
    **dict.fromkeys(("ends", "spectrum"), toml.flag),
    "frequencies": toml.numbers,
    "max_faults": toml.whole,
}
