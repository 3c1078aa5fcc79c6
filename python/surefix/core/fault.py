"""What all fault modes of a sensor share; the modes themselves are in ``surefix.robust.modes``."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any, ClassVar

from surefix.core import checks
from surefix.errors import ConfigError


@dataclass(frozen=True, kw_only=True)
class FaultMode:
    """What all modes share. Not to be made itself."""

    kind: ClassVar[int] = 0
    label: ClassVar[str] = "healthy"

    probability: float | None = None
    rate: float | None = None
    duration: float | None = None

    def __post_init__(self) -> None:
        if type(self) is FaultMode:
            raise ConfigError("FaultMode: expected one of its kinds, such as Outage")
        for field in fields(self):
            value = getattr(self, field.name)
            prior = field.name in ("probability", "rate", "duration")
            if value is None and prior:
                continue
            self._check(field.name, value)
        if self.probability is not None and not 0 < self.probability < 1:
            raise ConfigError(
                f"{self.label} probability: expected 0 < probability < 1, got {self.probability!r}"
            )
        if self.probability is None and (self.rate is None or self.duration is None):
            raise ConfigError(f"{self.label}: expected a probability, or a rate and a duration")

    def _check(self, name: str, value: Any) -> None:
        object.__setattr__(self, name, checks.positive(f"{self.label} {name}", value))

    def settings(self) -> dict[str, Any]:
        """Kind and all parameters by name, as plain values."""
        return {
            "mode": self.label, **{field.name: getattr(self, field.name) for field in fields(self)}
        }  # fmt: skip

    def engine(self) -> tuple[int, float, float, float, float, float, float, float, float, float]:
        """As the engine takes it; a parameter that a mode does not have is neutral."""

        def get(name: str, neutral: float = 0.0) -> float:
            value = getattr(self, name, None)
            return neutral if value is None else float(value)

        return (
            self.kind, get("span"), get("factor", 1.0), get("resolution"), get("change"),
            get("sigma"), get("walk"), get("probability"), get("rate"), get("duration"),
        )  # fmt: skip
