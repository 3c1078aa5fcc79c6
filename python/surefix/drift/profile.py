"""The course of a fault over time."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from surefix import _core
from surefix.core import checks
from surefix.core.checks import FloatArray
from surefix.errors import ConfigError, ShapeError


@dataclass(frozen=True, eq=False)
class Profile:
    """A fault that begins at t₀ has the value ``output`` · s(t), ds/dt = ``A`` s, s(t₀) = ``onset``
    a, where the amplitude a is unknown.

    ``A`` (p, p) [1/time], ``output`` (p,), ``onset`` (p,) or (p, q) for q amplitudes, of full rank;
    p at most 4. ``step``, ``ramp``, ``exponential`` and ``sine`` make the usual ones. Times are in
    the units of the record's: seconds of a log, steps of a linear system without times.

    Raises ShapeError or ConfigError for what does not fit.
    """

    A: FloatArray
    output: FloatArray
    onset: FloatArray
    name: str = "user"
    engine: _core.DriftProfile = field(init=False, repr=False)

    def __post_init__(self) -> None:
        output = checks.array("output", self.output, (None,))
        p = len(output)
        if not 1 <= p <= _core.MAX_PROFILE_STATES:
            raise ShapeError(f"output: expected 1 to {_core.MAX_PROFILE_STATES} states, got {p}")
        A = checks.array("A", self.A, (p, p))
        onset = checks.array("onset", self.onset, (p,), (p, None))
        columns = onset.reshape(p, -1)
        if np.linalg.matrix_rank(columns) < columns.shape[1] or columns.shape[1] == 0:
            raise ConfigError(f"onset: expected columns of full rank, got {onset.tolist()}")
        if not isinstance(self.name, str) or not self.name:
            raise ConfigError(f"name: expected a text, got {self.name!r}")
        for name, value in {"A": A, "output": output, "onset": onset}.items():
            object.__setattr__(self, name, value)
        object.__setattr__(self, "engine", _core.DriftProfile(A, output, columns))

    @property
    def amplitudes(self) -> int:
        """Number of amplitudes q."""
        return 1 if self.onset.ndim == 1 else self.onset.shape[1]

    @classmethod
    def step(cls) -> Profile:
        """A constant; the amplitude in units of the measurement."""
        return _make([[0.0]], [1.0], [1.0], "step")

    @classmethod
    def ramp(cls) -> Profile:
        """t - t₀ (Parellier, Barrau & Bonnabel 2023, (17)): nothing yet at the onset itself; the
        amplitude in units of the measurement per unit of time."""
        return _make([[0.0, 1.0], [0.0, 0.0]], [1.0, 0.0], [0.0, 1.0], "ramp")

    @classmethod
    def exponential(cls, time: float) -> Profile:
        """1 - e^{-(t - t₀)/time}: approaches its amplitude; with ``time`` < 0 it grows."""
        tau = checks.number("time", time)
        if tau == 0 or not math.isfinite(1 / tau):
            raise ConfigError(f"time: expected a number other than 0, got {tau}")
        # As an integral, not as a difference: with a large |time| that would be all rounding.
        A = [[0.0, 1.0], [0.0, -1 / tau]]
        return _make(A, [1.0, 0.0], [0.0, 1 / tau], "exponential")

    @classmethod
    def sine(cls, frequency: float) -> Profile:
        """a₁ sin 2πf(t - t₀) + a₂ cos 2πf(t - t₀): any phase; ``frequency`` f [1/time] > 0."""
        w = 2 * math.pi * checks.positive("frequency", frequency)
        return _make([[0.0, w], [-w, 0.0]], [1.0, 0.0], [[0.0, 1.0], [1.0, 0.0]], "sine")

    def value(self, elapsed: npt.ArrayLike) -> FloatArray:
        """What each unit amplitude is ``elapsed`` (any,) ≥ 0 after the onset: (any, q)."""
        given = checks.array("elapsed", elapsed, (None,))
        if (given < 0).any():
            raise ConfigError(f"elapsed: expected numbers >= 0, got {given.min()}")
        states = self.engine.states(given)  # (any, p, q)
        result: FloatArray = np.einsum("p,kpq->kq", self.output, states)
        return result

    def settings(self) -> dict[str, Any]:
        """Parameters by name, as plain values."""
        return {"name": self.name, "A": self.A.tolist(), "output": self.output.tolist(),
                "onset": self.onset.tolist()}  # fmt: skip

    def __getstate__(self) -> dict[str, Any]:
        return self.settings()

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__init__(**state)  # type: ignore[misc]


def _make(A: Any, output: Any, onset: Any, name: str) -> Profile:
    return Profile(np.array(A), np.array(output), np.array(onset), name)
