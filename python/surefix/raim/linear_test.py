"""Fault detection with linear nuisance parameters (Lacresse, Grall & Nikiforov 2005, section 3)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from surefix import _core
from surefix.core import checks
from surefix.core.checks import FloatArray
from surefix.core.distributions import Values
from surefix.errors import ShapeError
from surefix.raim import chi_squared


@dataclass(frozen=True)
class LinearTestResult:
    """Of one epoch or of each of several. ``parity`` (…, n - q): Z = W Y, whitened. ``statistic``
    (…): Λ (4), ``p_value`` (…): how often it is as large with no fault. ``valid`` (…): False where
    Y is not a number; Λ is NaN there and no alarm raised. ``available``: False where there is
    nothing left to test (no degrees of freedom)."""

    parity: FloatArray
    statistic: Any
    p_value: Any
    alarm: Any
    valid: Any
    degrees: Any
    threshold: Any
    available: Any


class LinearTest:
    """The invariant UBCP test of Y = H X + ε [+ M θ]: is there a fault θ, whatever X (4)-(5)?

    ``H`` (n, m) and ``M`` (n, p) may be of any rank; M None: a fault may be anywhere. ``noise``:
    standard deviation of ε, one number or (n,), or its covariance (n, n).

    ``W`` (n - q, n): the projection on the parity space of whitened data, W Wᵀ = I; ``rank``: q, of
    H; ``degrees``: of the χ², rank of W M; ``threshold``: h(α), NaN where there is nothing to test.
    A direction counts as lost when less than 1e-10 of it is left. Raises ShapeError, ConfigError.
    """

    def __init__(
        self,
        H: npt.ArrayLike,
        M: npt.ArrayLike | None = None,
        *,
        noise: npt.ArrayLike = 1.0,
        false_alarm: float = 1e-5,
    ) -> None:
        nuisance = checks.array("H", H, (None, None))
        n = nuisance.shape[0]
        if n == 0:
            raise ShapeError(f"H: expected at least one row, got {nuisance.shape}")
        faults = np.zeros((n, 0)) if M is None else checks.array("M", M, (n, None))
        if M is not None and faults.shape[1] == 0:
            raise ShapeError(f"M: expected at least one column, got {faults.shape}")
        self.false_alarm = checks.probability("false_alarm", false_alarm)
        self.root = noise_root("noise", noise, n)
        self._engine = _core.LinearTestEngine(nuisance, faults, self.root)
        self.W = checks.read_only(self._engine.W)
        self.whitening = checks.read_only(self._engine.whitening)
        self.rank: int = self._engine.rank
        self.degrees: int = self._engine.degrees
        self.threshold = threshold(self.false_alarm, self.degrees)

    def run(self, Y: npt.ArrayLike) -> LinearTestResult:
        """Tests Y (n,), or every row of Y (epochs, n)."""
        rows, alone = _rows("Y", Y, self.W.shape[1])
        valid = np.asarray(np.isfinite(rows).all(axis=1), dtype=np.bool_)
        clean = np.where(valid[:, None], rows, 0.0)
        parity = np.where(valid[:, None], self._engine.parity(clean), np.nan)
        statistic = np.where(valid, self._engine.statistic(clean), np.nan)
        return result(
            parity, statistic, valid, np.full(len(rows), self.degrees), self.false_alarm, alone
        )

    def noncentrality(self, bias: npt.ArrayLike) -> Values:
        """λ that a bias (…, n) of Y gives the statistic."""
        given = checks.floats("bias", bias)
        if given.ndim == 0 or given.shape[-1] != self.W.shape[1]:
            raise ShapeError(f"bias: expected shape (..., {self.W.shape[1]}), got {given.shape}")
        flat = self._engine.statistic(given.reshape(-1, given.shape[-1]))
        return float(flat[0]) if given.ndim == 1 else flat.reshape(given.shape[:-1])

    def power(self, bias: npt.ArrayLike) -> Values:
        """Probability that a bias (…, n) of Y is detected (6); 0 where nothing is tested."""
        found = self.noncentrality(bias)
        if self.degrees == 0:
            return found * 0.0
        return chi_squared.power(found, float(self.degrees), self.false_alarm)

    def missed(self, bias: npt.ArrayLike) -> Values:
        """Probability that it is not, with its relative precision however small."""
        found = self.noncentrality(bias)
        if self.degrees == 0:
            return found * 0.0 + 1.0
        return chi_squared.missed(found, float(self.degrees), self.false_alarm)

    def minimum_detectable(self, direction: npt.ArrayLike, missed: float = 1e-3) -> Values:
        """The smallest v ≥ 0 so that a bias v ``direction`` (…, n) is missed with that probability
        at most; infinite where no bias shows."""
        rarely = checks.probability("missed", missed)
        unit = np.asarray(self.noncentrality(direction))
        size = np.square(np.asarray(direction) @ self.whitening.T).sum(axis=-1)
        wanted = (
            chi_squared.noncentrality(rarely, float(self.degrees), self.false_alarm)
            if self.degrees > 0
            else np.inf
        )
        with np.errstate(all="ignore"):
            v = np.where(unit > 1e-20 * size, np.sqrt(wanted / unit), np.inf)
            v = np.where(np.isfinite(size), v, np.nan)
        return float(v) if v.ndim == 0 else v


def parity_test(
    Y: npt.ArrayLike, H: npt.ArrayLike, *, noise: npt.ArrayLike = 1.0, false_alarm: float = 1e-5
) -> LinearTestResult:
    """Λ = ‖W Y‖² of each epoch: a fault may be anywhere. Y (n,) or (epochs, n); H (n, m), or
    (epochs, n, m), another one for every epoch."""
    return ubcp_test(Y, H, None, noise=noise, false_alarm=false_alarm)


def ubcp_test(
    Y: npt.ArrayLike,
    H: npt.ArrayLike,
    M: npt.ArrayLike | None,
    *,
    noise: npt.ArrayLike = 1.0,
    false_alarm: float = 1e-5,
) -> LinearTestResult:
    """The same for faults in the columns of M (n, p) only (4)."""
    if np.ndim(H) != 3:
        return LinearTest(H, M, noise=noise, false_alarm=false_alarm).run(Y)
    stack = checks.array("H", H, (None, None, None))
    rows, alone = _rows("Y", Y, stack.shape[1])
    if len(rows) != len(stack) or alone:
        raise ShapeError(f"Y: expected shape {stack.shape[:2]} as H has, got {np.shape(Y)}")
    tests = [LinearTest(h, M, noise=noise, false_alarm=false_alarm) for h in stack]
    found = [test.run(row) for test, row in zip(tests, rows, strict=True)]
    most = max((f.parity.shape[-1] for f in found), default=0)
    parity = np.full((len(rows), most), np.nan)  # where H is of higher rank there are fewer
    for k, f in enumerate(found):
        parity[k, : f.parity.shape[-1]] = f.parity
    return result(
        parity,
        np.array([f.statistic for f in found]),
        np.array([f.valid for f in found], dtype=np.bool_),
        np.array([test.degrees for test in tests]),
        checks.probability("false_alarm", false_alarm),
        False,
    )


def result(
    parity: FloatArray,
    statistic: FloatArray,
    valid: npt.NDArray[np.bool_],
    degrees: npt.NDArray[np.int64],
    false_alarm: float,
    alone: bool,
) -> LinearTestResult:
    """What follows from the statistics of the epochs (T)."""
    tested = np.maximum(degrees, 1).astype(np.float64)
    available = degrees > 0
    h = np.where(available, _core.chi_squared_threshold(false_alarm, tested), np.nan)
    usable = available & valid
    tail = _core.chi_squared_tail(np.where(usable, statistic, 0.0), tested)
    p = np.where(usable, tail, np.nan)
    alarm = np.where(usable, statistic >= np.where(available, h, np.inf), False)
    if not alone:
        return LinearTestResult(parity, statistic, p, alarm, valid, degrees, h, available)
    return LinearTestResult(
        parity[0], float(statistic[0]), float(p[0]), bool(alarm[0]), bool(valid[0]),
        int(degrees[0]), float(h[0]), bool(available[0]),
    )  # fmt: skip


def threshold(false_alarm: float, degrees: int) -> float:
    """h(α), NaN without degrees of freedom."""
    return float(chi_squared.threshold(false_alarm, degrees)) if degrees > 0 else float("nan")


def noise_root(name: str, noise: npt.ArrayLike, n: int) -> FloatArray:
    """Lower triangular L (n, n), L Lᵀ the covariance of the noise."""
    if np.ndim(noise) == 2:
        matrix = checks.covariance(name, noise, n, definite=True)
        return np.asarray(np.linalg.cholesky(matrix), dtype=np.float64)
    sigma = checks.array(name, noise, (), (n,))
    for value in np.atleast_1d(sigma):
        checks.deviation(name, value)
    return np.diag(np.broadcast_to(sigma, (n,)).astype(np.float64))


def _rows(name: str, values: npt.ArrayLike, n: int) -> tuple[FloatArray, bool]:
    """(epochs, n), and whether one epoch was given alone. NaN stays."""
    given = checks.floats(name, values)
    if given.ndim not in (1, 2) or given.shape[-1] != n:
        raise ShapeError(f"{name}: expected shape ({n},) or (any, {n}), got {given.shape}")
    return np.atleast_2d(given), given.ndim == 1
