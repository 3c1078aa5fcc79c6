"""TOML tables with checked keys: every complaint names the file, the table and the key."""

from __future__ import annotations

import difflib
import re
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from surefix.errors import ConfigError, SurefixError


def parse(path: Path) -> dict[str, Any]:
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


class Wrong(Exception):
    """A value of the wrong type; its text says what was expected."""


Kind = Callable[[Any], Any]
T = TypeVar("T")


@dataclass(frozen=True)
class Table:
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
                raise self.error(f"unknown key {key!r}; {nearest(key, list(kinds))}")
        for key in required:
            if key not in self.data:
                raise self.error(f"missing key {key!r}")
        values = {}
        for key, value in self.data.items():
            try:
                values[key] = kinds[key](value)
            except Wrong as wrong:
                raise self.error(f"{key}: expected {wrong}, got {value!r}") from None
        return values

    def choice(self, key: str, known: Mapping[str, T]) -> tuple[T, Table]:
        """What the text under ``key`` names among those ``known``, and the table without it."""
        if key not in self.data:
            raise self.error(f"missing key {key!r}")
        name = self.data[key]
        if not isinstance(name, str) or name not in known:
            hint = nearest(str(name), list(known))
            raise self.error(f"{key}: expected one of {', '.join(known)}, got {name!r}; {hint}")
        rest = {other: value for other, value in self.data.items() if other != key}
        return known[name], Table(self.path, self.where, rest)

    def make(
        self, what: Callable[..., Any], required: Mapping[str, Kind], optional: Mapping[str, Kind]
    ) -> Any:
        """``what`` made from the values, its complaints with the place in front."""
        values = self.read(required, optional)
        try:
            return what(**values)
        except SurefixError as error:
            raise self.error(str(error)) from None


def nearest(key: str, known: list[str]) -> str:
    close = difflib.get_close_matches(key, known, n=1, cutoff=0.5)
    return f"did you mean {close[0]!r}?" if close else f"known are {', '.join(known)}"


def number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise Wrong("a number")
    return float(value)


def whole(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise Wrong("a whole number")
    return value


def flag(value: Any) -> bool:
    if not isinstance(value, bool):
        raise Wrong("true or false")
    return value


def text(value: Any) -> str:
    if not isinstance(value, str) or not value:
        raise Wrong("a text")
    return value


def listed(kind: Kind, name: str) -> Kind:
    def read(value: Any) -> tuple[Any, ...]:
        if not isinstance(value, list):
            raise Wrong(name)
        try:
            return tuple(kind(entry) for entry in value)
        except Wrong:
            raise Wrong(name) from None

    return read


def table(value: Any) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise Wrong("a table")
    return value


def tables(form: str) -> Kind:
    def read(value: Any) -> list[dict[str, Any]]:
        if not isinstance(value, list) or not all(isinstance(entry, dict) for entry in value):
            raise Wrong(f"tables, {form}")
        return value

    return read


def columns(value: Any) -> dict[str, str]:
    names = table(value)
    if not names or not all(isinstance(name, str) for name in names.values()):
        raise Wrong('a table of sensor = "column"')
    return names


numbers = listed(number, "a list of numbers")
matrix = listed(numbers, "a list of rows of numbers")
texts = listed(text, "a list of texts")
