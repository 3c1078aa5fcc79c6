"""Motion models: how the state moves over any duration.

Each has ``size`` (number of states), ``state_names`` and ``transition(dt) -> F, Q``, and each is
exact over any Δt: going Δt₁ and then Δt₂ is going Δt₁ + Δt₂.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from surefix import _core
from surefix.core import checks
from surefix.core.checks import FloatArray
from surefix.errors import ConfigError, NumericalError, ShapeError


@dataclass(frozen=True, eq=False)
class Model:
    """Base of the motion models. Not to be made directly: raises ConfigError."""

    engine: _core.Model = field(init=False, repr=False)
    state_names: tuple[str, ...] = field(init=False, repr=False)
    output: int = field(init=False, repr=False)
    """Index of the state that a sensor reads unless it says otherwise."""

    def __post_init__(self) -> None:
        kinds = ", ".join(kind.__name__ for kind in Model.__subclasses__())
        raise ConfigError(f"Model: expected one of its kinds, {kinds}")

    @property
    def size(self) -> int:
        """Number of states n."""
        return len(self.state_names)

    def transition(self, dt: float) -> tuple[FloatArray, FloatArray]:
        """F (n, n) and Q (n, n) over ``dt`` ≥ 0 seconds.

        Raises ConfigError if ``dt`` is negative, not finite, or not a whole number of periods of a
        discrete model; NumericalError if F or Q overflows.
        """
        elapsed = checks.nanoseconds("dt", dt)
        if elapsed < 0:
            raise ConfigError(f"dt: expected a number >= 0, got {dt}")
        status, F, Q = self.engine.transition(elapsed)
        if status == "off_grid":
            raise ConfigError(f"dt: expected a whole number of the model's periods, got {dt}")
        if F is None or Q is None:
            raise NumericalError(f"transition: F or Q overflows over dt = {dt} s")
        return F, Q

    def settings(self) -> dict[str, Any]:
        """Kind and parameters by name, as plain values."""
        plain = {
            name: value.tolist() if isinstance(value, np.ndarray)
            else list(value) if isinstance(value, tuple) else value
            for name, value in self.__getstate__().items()
        }  # fmt: skip
        return {"kind": type(self).__name__, **plain}

    def _set(self, **fields: Any) -> None:
        """Those of the base, and the parameters in the form in which they were checked."""
        for name, value in fields.items():
            object.__setattr__(self, name, value)

    def __getstate__(self) -> dict[str, Any]:
        return {name: self.__dict__[name] for name in self._parameters()}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__init__(**state)  # type: ignore[misc]

    @classmethod
    def _parameters(cls) -> list[str]:
        return [name for name, f in cls.__dataclass_fields__.items() if f.init]


@dataclass(frozen=True, eq=False)
class ConstantVelocity(Model):
    """Speed driven by white acceleration; states ``[speed]`` or ``[position, speed]``.

    ``acceleration``: root spectral density of the acceleration [m/s²/√Hz], so that the variance of
    the speed grows by acceleration² Δt.
    """

    acceleration: float
    position: bool = False

    def __post_init__(self) -> None:
        q = checks.not_negative("acceleration", self.acceleration)
        position = bool(self.position)
        names = ("position", "speed") if position else ("speed",)
        engine = _core.Model.chain(len(names), position, q)
        self._set(engine=engine, state_names=names, output=len(names) - 1)
        self._set(acceleration=q, position=position)


@dataclass(frozen=True, eq=False)
class ConstantAcceleration(Model):
    """Acceleration driven by white jerk (Bilenne 2004, eq. 33).

    States ``[speed, acceleration]`` or ``[position, speed, acceleration]``. ``jerk``: root spectral
    density of the jerk [m/s³/√Hz], so that the variance of the acceleration grows by jerk² Δt.
    """

    jerk: float
    position: bool = False

    def __post_init__(self) -> None:
        q = checks.not_negative("jerk", self.jerk)
        names: tuple[str, ...] = ("speed", "acceleration")
        position = bool(self.position)
        if position:
            names = ("position", *names)
        engine = _core.Model.chain(len(names), position, q)
        self._set(engine=engine, state_names=names, output=len(names) - 2)
        self._set(jerk=q, position=position)


@dataclass(frozen=True, eq=False)
class LinearModel(Model):
    """Any continuous linear model dx = A x dt + L dw, cov(dw) = Qc dt, discretised exactly.

    ``A`` (n, n) [1/s], ``L`` (n, s), ``Qc`` (s, s); n ≤ 8. ``names``: names of the states.
    """

    A: npt.ArrayLike
    L: npt.ArrayLike
    Qc: npt.ArrayLike
    names: tuple[str, ...] | None = None
    reads: int = 0
    """Index of the state that a sensor reads unless it says otherwise."""

    def __post_init__(self) -> None:
        A = _square("A", self.A)
        L = checks.array("L", self.L, (len(A), None))
        Qc = checks.covariance("Qc", self.Qc, L.shape[1])
        W = L @ Qc @ L.T
        engine = _core.Model.linear(A, (W + W.T) / 2)
        names, reads = _names(self.names, len(A)), _index("reads", self.reads, len(A))
        self._set(engine=engine, state_names=names, output=reads)
        self._set(A=A, L=L, Qc=Qc, names=names, reads=reads)


@dataclass(frozen=True, eq=False)
class DiscreteModel(Model):
    """A model known only at a fixed period: x ← F x + w, cov(w) = Q, every ``period`` seconds.

    ``F`` (n, n), ``Q`` (n, n); n ≤ 8. It has transitions over whole periods only: a measurement
    between them is answered by the status ``off_grid``.
    """

    F: npt.ArrayLike
    Q: npt.ArrayLike
    period: float = 1.0
    names: tuple[str, ...] | None = None
    reads: int = 0
    """Index of the state that a sensor reads unless it says otherwise."""

    def __post_init__(self) -> None:
        F = _square("F", self.F)
        Q = checks.covariance("Q", self.Q, len(F))
        period = checks.positive("period", self.period)
        elapsed = checks.nanoseconds("period", period)
        if elapsed == 0:
            raise ConfigError(f"period: expected at least 1e-9 s, got {period}")
        engine = _core.Model.discrete(F, Q, elapsed)
        names, reads = _names(self.names, len(F)), _index("reads", self.reads, len(F))
        self._set(engine=engine, state_names=names, output=reads)
        self._set(F=F, Q=Q, period=period, names=names, reads=reads)


def _square(name: str, value: Any) -> FloatArray:
    matrix = checks.array(name, value, (None, None))
    largest = _core.MAX_MODEL_STATES
    if matrix.shape[0] != matrix.shape[1] or not 1 <= len(matrix) <= largest:
        raise ShapeError(f"{name}: expected (n, n) with 1 <= n <= {largest}, got {matrix.shape}")
    return matrix


def _names(names: Any, size: int) -> tuple[str, ...]:
    if names is None:
        return tuple(f"x{i + 1}" for i in range(size))
    try:
        found = () if isinstance(names, str) else tuple(names)
    except TypeError:
        found = ()
    texts = all(isinstance(name, str) for name in found)
    if not texts or not len(found) == len(set(found)) == size:
        raise ConfigError(f"names: expected {size} different names, got {names!r}")
    return found


def _index(name: str, value: Any, size: int) -> int:
    if not isinstance(value, (int, np.integer)) or not 0 <= value < size:
        raise ConfigError(f"{name}: expected the index of a state, 0 to {size - 1}, got {value}")
    return int(value)
