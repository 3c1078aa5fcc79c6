"""The fault-free system of the switching filters."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from dataclasses import dataclass, field, fields
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
    needed where systems with different states meet in one IMM. A stack is for its number of steps
    only, also one of a single matrix (``steps``); one matrix is for any.

    Raises ShapeError or ConfigError for what does not fit.
    """

    A: FloatArray
    H: FloatArray
    Q: FloatArray
    R: FloatArray
    x0: FloatArray
    P0: FloatArray
    states: tuple[str, ...] | None = None
    steps: int | None = field(init=False, repr=False)
    """The number of measurements that it is for; None: any."""
    engine: _core.LinearSystemEngine = field(init=False, repr=False)

    def __post_init__(self) -> None:
        n = _size("A", self._states())
        H = checks.array("H", self.H, (None, n), (None, None, n))
        m = _size("H", H.shape[-2])
        checked: dict[str, Any] = {
            "A": checks.array("A", self.A, (n, n), (None, n, n)),
            "H": H,
            "x0": checks.array("x0", self.x0, (n,)),
            "Q": checks.covariances("Q", self.Q, n),
            "R": checks.covariances("R", self.R, m, definite=True),
            "P0": checks.covariance("P0", self.P0, n),
            "states": _names(self.states, n),
        }
        for name, value in checked.items():
            object.__setattr__(self, name, value)
        _check_pivots(checked["R"])
        stacks = {name: checked[name] for name in ("A", "Q", "H", "R") if checked[name].ndim == 3}
        lengths = {name: len(stack) + (name in "AQ") for name, stack in stacks.items()}
        steps = checks.one_length("A, Q, H, R", lengths)
        if steps == 0:
            raise ShapeError(f"{', '.join(stacks)}: expected matrices of 1 or more steps, got none")
        A, Q, H, R = (_for_engine(checked[name]) for name in ("A", "Q", "H", "R"))
        engine = _core.LinearSystemEngine(A, Q, H, R, self.x0, self.P0)
        object.__setattr__(self, "steps", steps)
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
        if not isinstance(model, Model):
            raise ConfigError(
                f"model: expected a motion model such as ConstantAcceleration, got {model!r}"
            )
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
        given: dict[str, Any] = {"H": H, "R": R, "x0": x0, "P0": P0}
        return cls(
            A=np.array([F for F, _ in pairs]), Q=np.array([Q for _, Q in pairs]),
            states=model.state_names, **given,
        )  # fmt: skip

    @property
    def size(self) -> int:
        """Number of states n."""
        return len(self.x0)

    @property
    def measured(self) -> int:
        """Number of measured components m."""
        return int(self.H.shape[-2])

    def _states(self) -> int:
        """The number of states that most arguments are for: one that is not will be named."""
        names = ("A", "P0", "x0", "H", "Q")
        shapes = [checks.floats(name, getattr(self, name)).shape for name in names]
        return statistics.mode(shape[-1] if shape else 1 for shape in shapes)

    def __getstate__(self) -> dict[str, Any]:
        return {f.name: getattr(self, f.name) for f in fields(self) if f.init}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__init__(**state)  # type: ignore[misc]


def _for_engine(matrices: FloatArray) -> FloatArray:
    """(k, rows, columns), k >= 1: where a single step leaves no A and Q, one that nothing reads."""
    stack = checks.per_step(matrices)
    return stack if len(stack) else np.zeros((1, *stack.shape[1:]))


def _check_pivots(R: FloatArray) -> None:
    """What the engine asks of R, with a margin: no component whose noise is, but for rounding, that
    of those before it."""
    given = checks.per_step(R)
    C = given.copy()
    variance = np.diagonal(C, axis1=1, axis2=2).copy()
    for i in range(C.shape[-1]):
        pivot = C[:, i, i].copy()
        bad = np.flatnonzero(~(pivot > 2e-14 * variance[:, i]))
        if len(bad):
            name, k = ("R", 0) if R.ndim == 2 else (f"R[{bad[0]}]", bad[0])
            left = pivot[k] / variance[k, i]
            raise ConfigError(
                f"{name}: expected a positive definite matrix, got {given[k].tolist()}, in which "
                f"the components before it leave component {i} only {left:.2g} of its variance"
            )
        column = C[:, :, i] / pivot[:, None]
        C -= column[:, :, None] * C[:, None, i, :]


def _size(name: str, size: int) -> int:
    if not 1 <= size <= _core.MAX_LINEAR_SIZE:
        raise ShapeError(f"{name}: expected 1 to {_core.MAX_LINEAR_SIZE} rows, got {size}")
    return size


def _names(states: Sequence[str] | None, n: int) -> tuple[str, ...] | None:
    if states is None:
        return None
    names = checks.tuple_of("states", states, str, "names")
    if isinstance(states, str) or len(names) != n or len(set(names)) != n:
        raise ConfigError(f"states: expected {n} different names, got {states!r}")
    return names
