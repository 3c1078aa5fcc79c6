"""The composite step (Bilenne 2004, table 1 and appendix A.1, corrected), with its matrices."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from surefix import _core
from surefix.core import checks
from surefix.core.checks import FloatArray
from surefix.core.models import Model
from surefix.core.sensor import Sensor, make_system, sensor_tuple
from surefix.desync.step_matrices import StepMatrices
from surefix.desync.step_update import StepUpdate
from surefix.errors import ConfigError, NumericalError, ShapeError

Matrices = Sequence[npt.ArrayLike]


class CompositeStep(StepMatrices):
    """One step of N observations between two estimation times, as one observation of the state at
    its end.

    ``F``, ``Q``: N + 1 transitions and noise covariances (n, n), leg by leg; observation i comes
    after leg i, the last leg leads to the estimation time. ``H`` (m_i, n), ``R`` (m_i, m_i): N
    observation matrices and noise covariances. ``G`` (n, p) for every leg and ``J`` (m_i, p) for
    every observation: effect of the known inputs. ``Upsilon`` (M, M): any symmetric positive
    definite noise covariance of all M components, instead of ``R``.

    The paper's matrices are attributes, read-only: F, G, W, Omega, Upsilon, J (eqs. 35-47) and the
    inverse-free pair HF, L, right for singular F too; H, Theta, Xi, Jtilde need the inverses of
    the transitions and raise NumericalError where one is singular.
    """

    def __init__(
        self,
        F: Matrices,
        Q: Matrices,
        H: Matrices,
        R: Matrices | None = None,
        *,
        G: Matrices | None = None,
        J: Matrices | None = None,
        Upsilon: npt.ArrayLike | None = None,
    ) -> None:
        given = {"F": F, "Q": Q, "H": H, "R": R, "G": G, "J": J}
        lists = {name: _listed(name, value) for name, value in given.items() if value is not None}
        for name in ("F", "Q", "H"):
            if name not in lists:
                raise ShapeError(f"{name}: expected a sequence of matrices, got None")
        if not lists["F"]:
            raise ShapeError("F: expected N + 1 transitions for N observations, got none")
        N = len(lists["H"])
        n = checks.array("F[0]", lists["F"][0], (None, None)).shape[0]
        if G is not None and not lists["G"]:
            raise ShapeError(f"G: expected {N + 1} matrices for {N} observations, got 0")
        p = 0 if G is None else checks.array("G[0]", lists["G"][0], (n, None)).shape[1]
        transitions = [checks.array(f"F[{i}]", f, (n, n)) for i, f in enumerate(lists["F"])]
        rows = [checks.array(f"H[{i}]", h, (None, n)) for i, h in enumerate(lists["H"])]
        sizes = [len(h) for h in rows]
        M = sum(sizes)
        if Upsilon is not None:
            Upsilon = checks.covariance("Upsilon", Upsilon, M, definite=M > 0)
        elif R is None:
            raise ConfigError("R: expected R or Upsilon")
        lists.setdefault("R", [np.eye(m) for m in sizes])
        lists.setdefault("G", [np.zeros((n, 0))] * (N + 1))
        lists.setdefault("J", [np.zeros((m, p)) for m in sizes])
        for name, expected in (("F", N + 1), ("Q", N + 1), ("G", N + 1), ("R", N), ("J", N)):
            if len(lists[name]) != expected:
                raise ShapeError(
                    f"{name}: expected {expected} matrices for {N} observations, "
                    f"got {len(lists[name])}"
                )
        self._arguments = (
            transitions,
            [checks.covariance(f"Q[{i}]", q, n) for i, q in enumerate(lists["Q"])],
            [checks.array(f"G[{i}]", g, (n, p)) for i, g in enumerate(lists["G"])],
            rows,
            [
                checks.covariance(f"R[{i}]", r, m, definite=True)
                for i, (r, m) in enumerate(zip(lists["R"], sizes, strict=True))
            ],
            [
                checks.array(f"J[{i}]", j, (m, p))
                for i, (j, m) in enumerate(zip(lists["J"], sizes, strict=True))
            ],
            Upsilon,
        )
        self._engine = _core.CompositeEngine(*self._arguments)
        self._inputs = p
        self.size = n
        self.components = M
        self.legs = N + 1

    def __reduce__(self) -> tuple[Any, ...]:
        F, Q, G, H, R, J, Upsilon = self._arguments
        return partial(type(self), F, Q, H, R, G=G, J=J, Upsilon=Upsilon), ()

    @classmethod
    def from_measurements(
        cls,
        model: Model,
        sensors: Sequence[Sensor],
        start: float,
        end: float,
        time: npt.ArrayLike,
        sensor: Sequence[str],
        x: npt.ArrayLike | None = None,
    ) -> tuple[CompositeStep, npt.NDArray[np.intp]]:
        """The step of a filter's measurements: rows with stamps ``time`` (N,) [s] of the named
        ``sensor`` (N,), between ``start`` and ``end``.

        Also returns the order in which z is to be given (N,), by validity. ``x`` (n,): where scale
        factors are linearised (the state at ``start``, carried along); needed only if there are
        any.
        """
        sensors = sensor_tuple(sensors)
        system = make_system(model, sensors)
        names = [s.name for s in sensors]
        stamps = checks.nanoseconds_array("time", time)
        for label in sensor:
            if label not in names:
                raise ConfigError(f"sensor: expected one of {names}, got {label!r}")
        if len(sensor) != len(stamps):
            raise ShapeError(
                f"sensor: expected {len(stamps)} names for as many times, got {len(sensor)}"
            )
        index = np.array([names.index(s) for s in sensor], dtype=np.intp)
        latency = np.array([checks.nanoseconds("latency", s.latency) for s in sensors])
        valid = stamps - latency[index].astype(np.int64)
        order = np.lexsort((index, valid))
        ends = [*valid[order].tolist(), checks.nanoseconds("end", end)]
        state = np.zeros(system.size) if x is None else checks.array("x", x, (system.size,))
        now = checks.nanoseconds("start", start)
        if min(ends) < now or max(ends) > ends[-1]:
            raise ConfigError(f"time: expected validity between {start} and {end}")
        F, Q, H, R = [], [], [], []
        for i, then in enumerate(ends):
            status, f, q = system.transition(then - now)
            if f is None or q is None:
                raise NumericalError(f"transition over {(then - now) / 1e9} s: {status}")
            F.append(f)
            Q.append(q)
            now, state = then, f @ state
            if i < len(order):
                which = int(index[order[i]])
                H.append(system.row(which, state)[0][None, :])
                R.append(np.array([[sensors[which].sigma ** 2]]))
        return cls(F, Q, H, R), order

    @property
    def separable(self) -> bool:
        """Whether Υ is block diagonal by observation: then the sequential way exists."""
        return self._engine.separable

    def update(
        self,
        x: npt.ArrayLike,
        P: npt.ArrayLike,
        z: npt.ArrayLike,
        u: npt.ArrayLike | None = None,
        *,
        way: str = "auto",
    ) -> StepUpdate:
        """From ``x`` (n,), ``P`` (n, n) at the start of the step and ``z`` (M,) to its end.

        ``u`` (N + 1, p): known inputs. ``way``: 'sequential' (one scalar update per component),
        'composite' (one square-root array for all; any Υ), or 'auto': sequential where it exists.
        Raises NumericalError if a covariance is not positive definite.
        """
        if way not in ("auto", "sequential", "composite"):
            raise ConfigError(f"way: expected 'auto', 'sequential' or 'composite', got {way!r}")
        if way == "sequential" and not self.separable:
            raise ConfigError("way: Upsilon is not block diagonal, only 'composite' exists")
        sequential = way != "composite" and self.separable
        inputs = np.zeros((self.legs, self._inputs)) if u is None else u
        out: dict[str, Any] = self._engine.update(
            checks.array("x", x, (self.size,)),
            checks.covariance("P", P, self.size),
            checks.array("z", z, (self.components,)),
            checks.array("u", inputs, (self.legs, self._inputs)).reshape(-1),
            sequential,
        )
        if out.pop("status") != "ok":
            raise NumericalError("update: a covariance is not positive definite, or it overflows")
        return StepUpdate(**out, way="sequential" if sequential else "composite")

    def Gamma(self, P: npt.ArrayLike) -> FloatArray:
        """Γ (M, M): covariance of the innovation, for ``P`` (n, n) at the start of the step."""
        return self._engine.Gamma(checks.covariance("P", P, self.size))


def _listed(name: str, value: Any) -> list[Any]:
    try:
        return list(value)
    except TypeError:
        raise ShapeError(f"{name}: expected a sequence of matrices, got {value!r}") from None
