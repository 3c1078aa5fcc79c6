"""The fault-free system of the switching filters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from surefix import _core
from surefix.core import checks
from surefix.core.checks import FloatArray
from surefix.core.models import Model
from surefix.errors import ConfigError, ShapeError


@dataclass(frozen=True, eq=False)
class LinearSystem:
    """x_{k+1} = A x_k + w, cov(w) = Q; z_k = H x_k + v, cov(v) = R; x_0 ~ N(x0, P0).

    The first measurement is of x_0. ``A``, ``Q``: (n, n), or (steps - 1, n, n) where entry k leads
    from measurement k to k + 1; ``H`` (m, n), or (steps, m, n); ``R`` (m, m), or (steps, m, m),
    positive definite; ``x0`` (n,), ``P0`` (n, n); n and m at most 32. ``states`` names the states,
    needed where systems with different states meet in one IMM. All are kept with their axis of
    steps, of length 1 where there is one matrix for all.

    Raises ShapeError or ConfigError for what does not fit.
    """

    A: FloatArray
    H: FloatArray
    Q: FloatArray
    R: FloatArray
    x0: FloatArray
    P0: FloatArray
    states: tuple[str, ...] | None = None
    engine: _core.LinearSystemEngine = field(init=False, repr=False)

    def __post_init__(self) -> None:
        x0 = checks.array("x0", self.x0, (None,))
        n = _size("x0", len(x0))
        H = _stack("H", self.H, (None, n))
        m = _size("H", H.shape[1])
        checked: dict[str, Any] = {
            "x0": x0,
            "H": H,
            "A": _stack("A", self.A, (n, n)),
            "Q": checks.covariances("Q", self.Q, n),
            "R": checks.covariances("R", self.R, m, definite=True),
            "P0": checks.covariance("P0", self.P0, n),
            "states": _names(self.states, n),
        }
        for name, value in checked.items():
            object.__setattr__(self, name, value)
        lengths = {
            name: len(getattr(self, name)) + (name in "AQ")
            for name in ("A", "Q", "H", "R")
            if len(getattr(self, name)) > 1
        }
        if len(set(lengths.values())) > 1:
            text = ", ".join(f"{name} for {length}" for name, length in lengths.items())
            raise ShapeError(f"A, Q, H, R: expected matrices for one number of steps, got {text}")
        engine = _core.LinearSystemEngine(self.A, self.Q, self.H, self.R, self.x0, self.P0)
        object.__setattr__(self, "engine", engine)

    @classmethod
    def from_model(
        cls,
        model: Model,
        times: npt.ArrayLike,
        H: npt.ArrayLike,
        R: npt.ArrayLike,
        x0: npt.ArrayLike,
        P0: npt.ArrayLike,
    ) -> LinearSystem:
        """The system of a motion model that is measured at ``times`` (steps,) [s], ascending."""
        t = checks.array("times", times, (None,))
        backwards = np.flatnonzero(np.diff(t) < 0)
        if len(t) < 2 or len(backwards):
            where = (
                f"{t[backwards[0] + 1]} after {t[backwards[0]]}" if len(backwards) else f"{len(t)}"
            )
            raise ConfigError(f"times: expected 2 or more in ascending order, got {where}")
        known: dict[float, tuple[FloatArray, FloatArray]] = {}
        for dt in np.diff(t):
            if dt not in known:
                known[dt] = model.transition(float(dt))
        pairs = [known[dt] for dt in np.diff(t)]
        return cls(
            A=np.array([F for F, _ in pairs]), H=np.asarray(H, dtype=np.float64),
            Q=np.array([Q for _, Q in pairs]), R=np.asarray(R, dtype=np.float64),
            x0=np.asarray(x0, dtype=np.float64), P0=np.asarray(P0, dtype=np.float64),
            states=model.state_names,
        )  # fmt: skip

    @property
    def size(self) -> int:
        """Number of states n."""
        return len(self.x0)

    @property
    def measured(self) -> int:
        """Number of measured components m."""
        return len(self.H[0])

    @property
    def steps(self) -> int | None:
        """The number of measurements that it is for; None: any."""
        for name in ("A", "Q", "H", "R"):
            count = len(getattr(self, name))
            if count > 1:
                return count + 1 if name in "AQ" else count
        return None

    def __getstate__(self) -> dict[str, Any]:
        return {n: f for n, f in self.__dict__.items() if n != "engine"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__init__(**state)  # type: ignore[misc]


def _stack(name: str, value: Any, shape: tuple[int | None, int]) -> FloatArray:
    """(1, rows, columns) or (steps, rows, columns)."""
    if np.ndim(value) == 3:
        return checks.array(name, value, (None, *shape))
    return checks.array(name, value, shape)[None]


def _size(name: str, size: int) -> int:
    if not 1 <= size <= _core.MAX_SWITCHING_SIZE:
        raise ShapeError(f"{name}: expected 1 to {_core.MAX_SWITCHING_SIZE} rows, got {size}")
    return size


def _names(states: Sequence[str] | None, n: int) -> tuple[str, ...] | None:
    if states is None:
        return None
    names = checks.tuple_of("states", states, str, "names")
    if isinstance(states, str) or len(names) != n or len(set(names)) != n:
        raise ConfigError(f"states: expected {n} different names, got {states!r}")
    return names
