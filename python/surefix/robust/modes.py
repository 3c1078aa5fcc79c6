"""What can be wrong with a sensor: its fault modes (mathematics: ``docs/robust.md``).

Each mode has a prior: ``probability`` of being in it in any one step, or ``rate`` [1/s], at which a
healthy sensor enters it, and ``duration`` [s], the mean time until it is healthy again.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from surefix.core import checks
from surefix.core.fault import FaultMode


@dataclass(frozen=True, kw_only=True)
class Outage(FaultMode):
    """The readings say nothing: uniform over ``span`` [unit of the reading] (Bilenne, sec. 3)."""

    kind: ClassVar[int] = 1
    label: ClassVar[str] = "outage"
    span: float


@dataclass(frozen=True, kw_only=True)
class Noisy(FaultMode):
    """The noise variance is ``factor`` times the healthy one (Sigalov & Oshman, δ = C)."""

    kind: ClassVar[int] = 2
    label: ClassVar[str] = "noisy"
    factor: float


@dataclass(frozen=True, kw_only=True)
class Interrupted(FaultMode):
    """The readings are noise around zero, of ``factor`` times the healthy variance (γ = 0)."""

    kind: ClassVar[int] = 3
    label: ClassVar[str] = "interrupted"
    factor: float = 1.0


@dataclass(frozen=True, kw_only=True)
class Frozen(FaultMode):
    """The output repeats its last value.

    ``resolution``: step of the output [unit of the reading]; a reading repeats the last one if it
    is within half of it. ``change``: probability that a frozen value changes all the same, uniform
    over ``span``. A frozen sensor shows no noise at all, which a Gaussian likelihood takes for an
    excellent one: without this mode it wins against two healthy sensors.
    """

    kind: ClassVar[int] = 4
    label: ClassVar[str] = "frozen"
    resolution: float
    span: float
    change: float = 1e-3

    def __post_init__(self) -> None:
        super().__post_init__()
        checks.probability("frozen change", self.change)


@dataclass(frozen=True, kw_only=True)
class Drifting(FaultMode):
    """A bias of unknown size that wanders: a wheel that slips, a radar that collapses.

    ``sigma``: standard deviation of the bias when the fault begins [unit of the reading];
    ``walk``: root density of the random walk it makes then [unit / √s]; ``factor``: of the noise
    variance while it lasts. Without one a sensor that drifts must be as quiet as a healthy one, and
    when it is not, sensors that are well take the blame.
    """

    kind: ClassVar[int] = 5
    label: ClassVar[str] = "drifting"
    sigma: float
    walk: float
    factor: float = 1.0

    def _check(self, name: str, value: Any) -> None:
        if name == "walk":
            object.__setattr__(self, name, checks.not_negative("drifting walk", value))
        else:
            super()._check(name, value)
