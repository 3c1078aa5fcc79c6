"""Affine models of a nuisance: the fits (8) and (9), the bound (10), and what they do to powers."""

from __future__ import annotations

from typing import Literal

import numpy as np
import pytest

import surefix as sf
from oracle import raim_affine as oracle
from oracle import raim_distributions as distributions
from oracle.raim_linear import Linear, Noise
from oracle.step import Array
from raim import sine

ALPHA = 1e-5
Fit = Literal["least-squares", "minimax"]
FITS: tuple[Fit, Fit] = ("least-squares", "minimax")
CLOCK = np.ones((8, 1))
each_fit = pytest.mark.parametrize("fit", FITS)


def fitted(fit: Fit, X: Array, values: Array) -> oracle.Affine:
    return oracle.minimax(X, values) if fit == "minimax" else oracle.least_squares(X, values)


def surface(X: Array) -> Array:
    """Two states, five outputs: smooth, one of them affine."""
    x, y = X.T
    return np.stack([np.sin(x + 2 * y), x * y, np.exp(0.3 * x) - y**2, np.cos(x), 3 - x + y], 1)


BEND = np.array([[1.0, 4.0], [0.0, 0.0], [0.09 * np.exp(0.6), 2.0], [1.0, 0.0], [0.0, 0.0]])
LOW, HIGH = np.array([-1.0, 0.0]), np.array([2.0, 1.5])


def noises() -> dict[str, Noise]:
    rng = np.random.RandomState(3)
    B = rng.normal(size=(8, 8))
    return {"scalar": 5.0, "vector": rng.uniform(2.0, 8.0, 8), "full": B @ B.T + 4.0 * np.eye(8)}


@each_fit
@pytest.mark.parametrize("amplitude", [0.0, 1.0, 20.0])
def test_fit_of_the_sine_track(fit: Fit, amplitude: float) -> None:
    """Distances of 1e3 m to 2e7 m: rounding is 4e-9 m, and so much of it reaches rho and B; A is
    per unit of l, a kilometre."""
    h, X = sine.distances(amplitude), oracle.grid(np.zeros(1), np.ones(1), 101)
    known = fitted(fit, X, h(X))
    found = sf.raim.affine_bound(h, 0.0, 1.0, noise=sine.SIGMA, linear=CLOCK, fit=fit, points=101)
    assert found.A.shape == (8, 1)
    np.testing.assert_allclose(found.A, known.A, atol=1e-7)
    np.testing.assert_allclose(found.B, known.B, atol=1e-7)
    np.testing.assert_allclose(found.rho, known.rho(X, h(X)), rtol=1e-7, atol=2e-8)
    assert found.rho_bound is None
    assert found.loose_bound is None
    assert found.tight_bound is None


@each_fit
def test_fit_in_two_dimensions(fit: Fit) -> None:
    """The minimax plane need not be the only one; its error is."""
    X = oracle.grid(LOW, HIGH, 21)
    known = fitted(fit, X, surface(X))
    found = sf.raim.affine_bound(surface, LOW, HIGH, fit=fit, points=21, bend=BEND)
    own = oracle.Affine(found.A, found.B)
    np.testing.assert_allclose(found.rho, known.rho(X, surface(X)), rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose(found.rho, own.rho(X, surface(X)), rtol=1e-12, atol=1e-13)
    if fit == "least-squares":
        np.testing.assert_allclose(found.A, known.A, atol=1e-12)
        np.testing.assert_allclose(found.B, known.B, atol=1e-12)
    np.testing.assert_allclose(found.A[4], [-1.0, 1.0], atol=1e-9)
    between = (3.0 / 20) ** 2 / 8 * BEND[:, 0] + (1.5 / 20) ** 2 / 8 * BEND[:, 1]
    assert found.rho_bound is not None
    np.testing.assert_allclose(found.rho_bound, found.rho + between, rtol=1e-12)


@pytest.mark.parametrize("amplitude", [0.3, 3.0, 100.0])
def test_minimax_is_never_worse(amplitude: float) -> None:
    h = sine.distances(amplitude)
    square, least = (sf.raim.affine_bound(h, 0.0, 1.0, linear=CLOCK, fit=fit) for fit in FITS)
    assert np.all(least.rho <= square.rho * (1 + 1e-9) + 1e-8)
    assert np.linalg.norm(least.rho) < 0.8 * np.linalg.norm(square.rho)  # 28 % less on a sine


@each_fit
@pytest.mark.parametrize("noise", ["scalar", "vector", "full"])
def test_bounds_on_the_disturbance(fit: Fit, noise: str) -> None:
    """tight = max ||W L^-1 E||, loose = ||W|| || |L^-1| rho ||, from the engine's A and B and the
    oracle's projection; certified by what bend allows between two samples."""
    given, h = noises()[noise], sine.distances(5.0)
    bend, X = sine.bend(5.0), oracle.grid(np.zeros(1), np.ones(1), 101)
    found = sf.raim.affine_bound(h, 0.0, 1.0, noise=given, linear=CLOCK, fit=fit, points=101,
                                 bend=bend)  # fmt: skip
    own = oracle.Affine(found.A, found.B)
    H, E = np.column_stack([found.A, CLOCK]), own.error(X, h(X))
    assert found.test.degrees == 6
    np.testing.assert_allclose(found.test.W, found.W, atol=0.0)
    tight = oracle.disturbance(H, given, E).max()
    assert found.tight == pytest.approx(tight, rel=1e-6)
    assert found.loose == pytest.approx(oracle.loose(given, found.rho), rel=1e-12)
    between = 0.01**2 / 8 * bend[:, 0]
    more = oracle.loose(given, between)
    assert found.tight_bound == pytest.approx(found.tight + more, rel=1e-9)
    assert found.rho_bound is not None
    assert found.loose_bound == pytest.approx(oracle.loose(given, found.rho_bound), rel=1e-9)
    assert found.tight <= found.loose


@each_fit
def test_samples_are_a_function(fit: Fit) -> None:
    h, l = sine.distances(4.0), np.linspace(0.25, 0.5, 41)  # noqa: E741
    called = sf.raim.affine_bound(h, 0.25, 0.5, linear=CLOCK, fit=fit, points=41)
    table = sf.raim.affine_bound(h(l[:, None]), 0.25, 0.5, linear=CLOCK, fit=fit)
    for name in ("A", "B", "rho", "W"):
        np.testing.assert_allclose(getattr(table, name), getattr(called, name), atol=1e-12)
    assert (table.tight, table.loose) == pytest.approx((called.tight, called.loose), rel=1e-12)


def test_run_takes_the_constant_off() -> None:
    h, rng = sine.distances(3.0), np.random.RandomState(2)
    model = sf.raim.affine_bound(h, 0.2, 0.4, noise=sine.SIGMA, linear=CLOCK)
    Y = h(rng.uniform(0.2, 0.4, (50, 1))) + 77.0 + sine.SIGMA * rng.normal(size=(50, 8))
    H = np.column_stack([model.A, CLOCK])
    known = Linear(H, None, sine.SIGMA).statistic(Y - model.B)
    np.testing.assert_allclose(model.run(Y).statistic, known, rtol=1e-9)


@pytest.mark.parametrize("bound", ["tight", "loose"])
@pytest.mark.parametrize("certified", [False, True])
def test_powers(bound: Literal["tight", "loose"], certified: bool) -> None:
    """beta_1, beta_2 and e_1, e_2. A difference of powers has their rounding, 1e-12 of them."""
    h, bend = sine.distances(3.0), sine.bend(3.0) if certified else None
    model = sf.raim.affine_bound(h, 0.0, 1.0, noise=sine.SIGMA, linear=CLOCK, bend=bend)
    b = getattr(model, f"{bound}_bound" if certified else bound)
    for lam in (0.0, 0.1 * b**2, 20.0, 60.0, 250.0):
        low, high = model.power_bounds(lam, ALPHA, bound=bound)
        known = oracle.powers(lam, b, 6, ALPHA)
        assert low == pytest.approx(float(known[0]), rel=1e-11)
        assert high == pytest.approx(float(known[1]), rel=1e-11)
        beta = float(distributions.power(lam, 6, ALPHA))
        rounding = 2e-12 * (float(known[1]) + beta)
        e1 = oracle.losses(b, 6, ALPHA, lam, False)
        assert model.e1(ALPHA, lam, bound=bound) == pytest.approx(e1, rel=1e-11, abs=rounding)
        e2 = oracle.losses(b, 6, ALPHA, lam, True)
        assert model.e2(ALPHA, lam, bound=bound) == pytest.approx(e2, rel=1e-11, abs=rounding)
    assert model.e2(ALPHA, bound=bound) == model.e2(ALPHA, 0.0, bound=bound)


@pytest.mark.parametrize("amplitude", [0.3, 3.0, 30.0])
def test_largest_losses(amplitude: float) -> None:
    """Section 4.3's e_1 and e_2, over all faults."""
    model = sf.raim.affine_bound(sine.distances(amplitude), 0.0, 1.0, noise=sine.SIGMA,
                                 linear=CLOCK)  # fmt: skip
    b = model.tight
    assert model.e1(ALPHA) == pytest.approx(oracle.losses(b, 6, ALPHA, None, False), rel=1e-7)
    found = model.e2(ALPHA, None)
    assert found == pytest.approx(oracle.losses(b, 6, ALPHA, None, True), rel=1e-7)
    assert model.e1(ALPHA) <= model.e1(ALPHA, bound="loose")


def test_powers_of_many_faults() -> None:
    model = sf.raim.affine_bound(sine.distances(3.0), 0.0, 1.0, noise=5.0, linear=CLOCK)
    lam = np.array([[0.0, 10.0], [50.0, 90.0]])
    low, high = model.power_bounds(lam, ALPHA)
    assert low.shape == high.shape == (2, 2)
    assert np.all(low <= high)
    one = model.power_bounds(50.0, ALPHA)
    assert (low[1, 0], high[1, 0]) == one


def test_an_affine_nuisance_has_no_error() -> None:
    """Neither loss nor gain: 1e-12 of a power is not told from none."""

    def h(X: Array) -> Array:
        return np.asarray(X @ np.array([[1.0, 2.0, -1.0, 0.5]]) + 3.0)

    for fit in FITS:
        model = sf.raim.affine_bound(h, -1.0, 1.0, fit=fit, bend=np.zeros((4, 1)))
        np.testing.assert_allclose(model.rho, 0.0, atol=1e-14)
        assert model.tight_bound == pytest.approx(0.0, abs=1e-14)
        assert model.e1(ALPHA) == pytest.approx(0.0, abs=1e-11)
        assert model.e2(ALPHA) == pytest.approx(0.0, abs=1e-16)


HOW: dict[str, tuple[dict[str, object], str]] = {
    "fit": ({"fit": "best"}, "fit: .*'best'"),
    "points": ({"points": 1}, "points: .*1"),
    "low above high": ({"low": 2.0}, "high: .*low = 2"),
    "low no number": ({"low": np.nan}, "low: .*nan"),
    "high infinite": ({"high": np.inf}, "high: .*inf"),
    "linear rows": ({"linear": np.ones((7, 1))}, r"linear: .*\(7, 1\)"),
    "noise": ({"noise": -1.0}, "noise: .*-1"),
    "noise zero": ({"noise": 0.0}, "noise: .*0"),
    "noise length": ({"noise": np.ones(7)}, r"noise: .*\(7,\)"),
    "noise indefinite": ({"noise": np.diag([1.0] * 7 + [-1.0])}, "noise: "),
    "bend": ({"bend": -np.ones((8, 1))}, "bend: .*-1"),
    "bend rows": ({"bend": np.ones((7, 1))}, r"bend: .*\(7, 1\)"),
    "h no function": ({"h": "h"}, "h: .*'h'"),
    "h one axis": ({"h": lambda X: X[:, 0]}, r"h: .*\(201,\)"),
    "h not a number": ({"h": lambda X: np.nan * X}, "h: .*nan"),
}


@pytest.mark.parametrize(("changed", "message"), HOW.values(), ids=HOW.keys())
def test_refused(changed: dict[str, object], message: str) -> None:
    given: dict[str, object] = {
        "h": sine.distances(1.0), "low": 0.0, "high": 1.0, "linear": CLOCK, **changed,
    }  # fmt: skip
    with pytest.raises(sf.SurefixError, match=message):
        sf.raim.affine_bound(**given)  # type: ignore[arg-type]
