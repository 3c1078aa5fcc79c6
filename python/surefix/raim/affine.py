"""An affine model of a non-linear nuisance on a compact set, and what it costs the test (Lacresse,
Grall & Nikiforov 2005, section 4)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from surefix import _core
from surefix.core import checks
from surefix.core.checks import FloatArray
from surefix.core.distributions import Values
from surefix.errors import ConfigError, ShapeError
from surefix.raim.linear_test import LinearTest, LinearTestResult

Function = Callable[[FloatArray], npt.ArrayLike]
"""h: X (k, m) to (k, n)."""

FITS = ("least-squares", "minimax")
MAX_SAMPLES = 2_000_000


class AffineModel:
    """h(X) ≈ A X + B on the box K = [``low``, ``high``], and the test that takes it for exact.

    ``A`` (n, m), ``B`` (n,); ``rho`` (n,): the largest error over the samples (10); ``rho_bound``:
    with what may lie between them. b, by which the error can move the statistic's √λ: ``loose``,
    the paper's ‖W‖ ‖R‖; ``tight``, the largest ‖W (h(X) - A X - B)‖; ``loose_bound`` and
    ``tight_bound``, certified between the samples, None where nothing is known of h's curvature.
    """

    def __init__(
        self,
        low: FloatArray,
        high: FloatArray,
        A: FloatArray,
        B: FloatArray,
        error: FloatArray,
        between: FloatArray | None,
        test: LinearTest,
    ) -> None:
        """``error`` (k, n) of the samples; ``between`` (n,): by how much it may be larger between
        them."""
        self.low, self.high = low, high
        self.A, self.B, self.test = A, B, test
        self.W, self.degrees = test.W, test.degrees
        self.rho: FloatArray = np.abs(error).max(axis=0)
        norm = 1.0 if len(test.W) else 0.0  # of a projection
        whitened = np.abs(test.whitening)
        self.loose = float(norm * np.linalg.norm(whitened @ self.rho))
        projected = error @ (test.W @ test.whitening).T
        self.tight = float(np.sqrt(np.square(projected).sum(axis=1).max()))
        self.rho_bound = self.loose_bound = self.tight_bound = None
        if between is not None:
            self.rho_bound = self.rho + between
            self.loose_bound = float(norm * np.linalg.norm(whitened @ self.rho_bound))
            more = float(norm * np.linalg.norm(whitened @ between))
            self.tight_bound = min(self.tight + more, self.loose_bound)

    def run(self, Y: npt.ArrayLike) -> LinearTestResult:
        """Tests Y (n,) or (epochs, n): Λ = ‖W (Y - B)‖²."""
        return self.test.run(checks.floats("Y", Y) - self.B)

    def bound(self, kind: str = "tight") -> float:
        """b, 'tight' or 'loose'; certified where h's curvature is known."""
        checks.one_of("bound", kind, ("tight", "loose"))
        certified = self.tight_bound if kind == "tight" else self.loose_bound
        sampled = self.tight if kind == "tight" else self.loose
        return sampled if certified is None else certified

    def power_bounds(
        self, noncentrality: npt.ArrayLike, false_alarm: float | None = None, bound: str = "tight"
    ) -> tuple[Values, Values]:
        """(β₁, β₂): between these is the power against a fault of that noncentrality."""
        b, k, h = self._test(false_alarm, bound)
        given = np.asarray(noncentrality, dtype=np.float64)
        return _core.least_power(given, b, k, h), _core.most_power(given, b, k, h)

    def e1(
        self,
        false_alarm: float | None = None,
        noncentrality: npt.ArrayLike | None = None,
        bound: str = "tight",
    ) -> Values:
        """e₁ = β - β₁, the power that may be lost: at a noncentrality, or the most at any."""
        b, k, h = self._test(false_alarm, bound)
        if noncentrality is None:
            return _core.worst_power_loss(b, k, h)
        return _core.power_loss(noncentrality, b, k, h)

    def e2(
        self,
        false_alarm: float | None = None,
        noncentrality: npt.ArrayLike | None = 0.0,
        bound: str = "tight",
    ) -> Values:
        """e₂ = β₂ - β, by default at 0, where it is what the false alarms may gain (section 5.3);
        None: the most at any noncentrality."""
        b, k, h = self._test(false_alarm, bound)
        if noncentrality is None:
            return _core.worst_power_gain(b, k, h)
        return _core.power_gain(noncentrality, b, k, h)

    def _test(self, false_alarm: float | None, bound: str) -> tuple[float, float, float]:
        if self.degrees == 0:
            raise ConfigError("h: expected something left to test, got 0 degrees of freedom")
        if false_alarm is None:
            return self.bound(bound), float(self.degrees), self.test.threshold
        alpha = checks.probability("false_alarm", false_alarm)
        h = float(_core.chi_squared_threshold(alpha, float(self.degrees)))
        return self.bound(bound), float(self.degrees), h


def affine_bound(
    h: Function | npt.ArrayLike,
    low: npt.ArrayLike,
    high: npt.ArrayLike,
    *,
    noise: npt.ArrayLike = 1.0,
    linear: npt.ArrayLike | None = None,
    fit: str = "least-squares",
    points: int = 201,
    bend: npt.ArrayLike | None = None,
    false_alarm: float = 1e-5,
) -> AffineModel:
    """The affine model of ``h`` on the box from ``low`` to ``high`` (m,).

    ``h``: a function, X (k, m) to (k, n), evaluated on a grid with ``points`` in every dimension;
    or, of one dimension, its values (k, n) at k equal distances. ``linear`` (n, q): columns of
    nuisance that is linear and unbounded, such as a clock. ``fit``: 'least-squares' (9) or
    'minimax' (8). ``bend``: bounds on |∂²h_i/∂X_j²| over the box, (n, m) or what broadcasts to it;
    without it the bounds are those of the samples. ``noise``, ``false_alarm``: as of LinearTest.
    """
    bottom, top = _box(low, high)
    axes, values = _samples(h, bottom, top, points)
    X = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))
    minimax = checks.one_of("fit", fit, FITS) == "minimax"
    A, B, _ = _core.affine_fit(X, values, minimax)
    n = values.shape[1]
    columns = A if linear is None else np.hstack([A, checks.array("linear", linear, (n, None))])
    test = LinearTest(columns, noise=noise, false_alarm=false_alarm)
    between = None
    if bend is not None:
        curvature = _bend(bend, n, len(axes))
        spacing = np.array([axis[1] - axis[0] for axis in axes])
        # A function is within Σ_j sup|∂_jj| s_j²/8 of what interpolates it linearly in each
        # dimension, and that is largest at a sample.
        between = curvature @ np.square(spacing) / 8
    return AffineModel(bottom, top, A, B, values - X @ A.T - B, between, test)


def _box(low: npt.ArrayLike, high: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
    bottom = np.atleast_1d(checks.array("low", low, (), (None,)))
    top = np.atleast_1d(checks.array("high", high, (), (len(bottom),)))
    if bottom.shape != top.shape:
        raise ShapeError(f"high: expected shape {bottom.shape} as low has, got {top.shape}")
    for a, b in zip(bottom, top, strict=True):
        if not a < b:
            raise ConfigError(f"high: expected a number above low = {a:g}, got {b:g}")
    return bottom, top


def _samples(
    h: Function | npt.ArrayLike, low: FloatArray, high: FloatArray, points: int
) -> tuple[list[FloatArray], FloatArray]:
    """The grid's axes, and h (k, n) on it, the last dimension fastest."""
    m = len(low)
    if not callable(h):
        if m != 1:
            raise ShapeError(f"h: expected a function for a box of {m} dimensions, got samples")
        values = checks.array("h", h, (None, None))
        if len(values) < 3:
            raise ShapeError(f"h: expected at least 3 samples, got shape {values.shape}")
        return [np.linspace(low[0], high[0], len(values))], values
    count = checks.whole("points", points, 3, MAX_SAMPLES)
    if count**m > MAX_SAMPLES:
        raise ConfigError(f"points: expected at most {MAX_SAMPLES} in all, got {count}^{m}")
    axes: list[FloatArray] = [np.linspace(a, b, count) for a, b in zip(low, high, strict=True)]
    X = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, m)
    values = checks.array("h", h(X), (None, None))
    if len(values) != len(X) or values.shape[1] == 0:
        raise ShapeError(f"h: expected shape ({len(X)}, any) of X {X.shape}, got {values.shape}")
    return axes, values


def _bend(bend: npt.ArrayLike, n: int, m: int) -> FloatArray:
    given = checks.floats("bend", bend)
    try:
        out = np.broadcast_to(given, (n, m)).astype(np.float64)
    except ValueError:
        raise ShapeError(f"bend: expected shape ({n}, {m}), got {given.shape}") from None
    if not (np.isfinite(out).all() and (out >= 0).all()):
        raise ConfigError(f"bend: expected finite numbers >= 0, got {given.tolist()}")
    return out
