"""The raim oracle against what is known without it: closed forms, symmetric cases, other sums."""

from __future__ import annotations

import numpy as np
import pytest
from mpmath import mp  # type: ignore[import-untyped]
from numpy.polynomial.chebyshev import Chebyshev
from scipy import stats

from oracle import raim_affine, raim_distributions, raim_geodesy, raim_linear, raim_monitor
from oracle import raim_protection as protection
from oracle.raim_distributions import Digits
from oracle.raim_monitor import Demand
from oracle.raim_solution import Epoch, estimable, solve
from oracle.raim_track import Spline, spline
from oracle.step import Array


@pytest.mark.parametrize(("x", "k", "lam"), [(3.0, 1, 0.5), (30.0, 6, 25.0), (90.0, 30, 120.0)])
def test_tails_are_integrals_of_the_density(x: float, k: int, lam: float) -> None:
    def integral(a: Digits, b: Digits) -> Digits:
        # of t^2, which takes away the singularity of one degree of freedom
        return mp.quad(lambda t: 2 * t * raim_distributions.density(t * t, k, lam), [a, b])

    with mp.workdps(25):
        root = mp.sqrt(x)
        lower = integral(0, root / 2) + integral(root / 2, root)
        assert abs(lower / raim_distributions.lower(x, k, lam) - 1) < 1e-15
    both = raim_distributions.lower(x, k, lam) + raim_distributions.upper(x, k, lam)
    assert abs(both - 1) < 1e-32


def test_tails_are_scipys() -> None:
    for x, k, lam in ((3.0, 1, 0.5), (60.0, 6, 10.0), (9.0, 4, 120.0), (80.0, 4, 0.0)):
        law = stats.chi2(k) if lam == 0.0 else stats.ncx2(k, lam)
        assert float(raim_distributions.upper(x, k, lam)) == pytest.approx(law.sf(x), rel=1e-11)
        assert float(raim_distributions.lower(x, k, lam)) == pytest.approx(law.cdf(x), rel=1e-11)


def test_tails_in_doubles() -> None:
    for x, k, lam in ((3.0, 1, 0.0), (60.0, 6, 10.0), (30.0, 9, 290.0), (35.0, 4, 33.0)):
        upper, lower = raim_distributions.upper(x, k, lam), raim_distributions.lower(x, k, lam)
        found = raim_distributions.upper_in_doubles(x, k, lam)
        assert found == pytest.approx(float(upper), rel=1e-12)
        found = raim_distributions.lower_in_doubles(x, k, lam)
        assert found == pytest.approx(float(lower), rel=1e-12)


def test_thresholds_and_noncentralities_have_their_probabilities() -> None:
    for alpha, k in ((1e-2, 1), (1e-12, 30)):
        h = raim_distributions.threshold(alpha, k)
        assert abs(raim_distributions.upper(h, k, 0) / mp.mpf(alpha) - 1) < 1e-35
        lam = raim_distributions.noncentrality(1e-3, k, alpha)
        assert abs(raim_distributions.missed(lam, k, alpha) / mp.mpf(1e-3) - 1) < 1e-30
    assert raim_distributions.noncentrality(0.995, 3, 1e-2) == 0


@pytest.mark.parametrize("noise", ["scalar", "vector", "full"])
def test_linear_statistic_is_the_likelihood_ratio(noise: str) -> None:
    """(4) is what M theta takes off the squared residuals beside H X (Nikiforov 2002)."""
    rng = np.random.RandomState(1)
    n, B = 9, rng.normal(size=(9, 9))
    given: dict[str, float | Array] = {
        "scalar": 0.7, "vector": rng.uniform(0.5, 2.0, n), "full": B @ B.T + np.eye(n),
    }  # fmt: skip
    L = np.linalg.cholesky(raim_linear.covariance(given[noise], n))
    H, M, Y = rng.normal(size=(n, 3)), rng.normal(size=(n, 2)), rng.normal(size=(4, n))
    H, M = np.column_stack([H, H @ [1.0, 2.0, 3.0]]), np.column_stack([M, H[:, 0], M.sum(axis=1)])
    test = raim_linear.Linear(H, M, given[noise])
    assert (test.rank, test.degrees) == (3, 2)
    assert raim_linear.Linear(H, None, given[noise]).degrees == 6

    def left(columns: Array) -> Array:
        A, white = np.linalg.solve(L, columns), np.linalg.solve(L, Y.T)
        rest = white - A @ np.linalg.lstsq(A, white, rcond=1e-9)[0]
        return np.asarray(np.sum(rest**2, axis=0))

    both = np.column_stack([H, M])
    np.testing.assert_allclose(test.statistic(Y), left(H) - left(both), rtol=1e-11)
    every = raim_linear.Linear(H, None, given[noise])
    np.testing.assert_allclose(every.statistic(Y), left(H), rtol=1e-11)


def test_minimax_of_known_functions() -> None:
    """T_2 and T_3 are their own errors of the best straight line to x^2 and 4 x^3 - 3 x + a x."""
    X = np.cos(np.linspace(0.0, np.pi, 13))[:, None]  # holds the extremes of both
    values = np.column_stack([X[:, 0] ** 2, Chebyshev([0, 0, 0, 1])(X[:, 0]) + 5.0 * X[:, 0] - 1.0])
    fit = raim_affine.minimax(X, values)
    np.testing.assert_allclose(fit.A[:, 0], [0.0, 5.0], atol=1e-9)
    np.testing.assert_allclose(fit.B, [0.5, -1.0], atol=1e-9)
    np.testing.assert_allclose(fit.rho(X, values), [0.5, 1.0], rtol=1e-9)
    square = raim_affine.least_squares(X, values)
    line = np.polynomial.polynomial.polyfit(X[:, 0], values, 1)
    np.testing.assert_allclose(np.column_stack([square.B, square.A]), line.T, atol=1e-12)


def test_losses_at_their_largest() -> None:
    """Against a plain search, in SciPy's doubles."""
    b, k, alpha = 0.6, 5, 1e-3
    h, t = stats.chi2.isf(alpha, k), np.linspace(1e-3, 14.0, 20_001)
    beta = np.asarray(stats.ncx2.sf(h, k, t**2))
    less = np.asarray(stats.ncx2.sf(h, k, np.maximum(t - b, 1e-9) ** 2))
    more = np.asarray(stats.ncx2.sf(h, k, (t + b) ** 2))
    assert raim_affine.losses(b, k, alpha, None, False) == pytest.approx((beta - less).max(), 1e-6)
    assert raim_affine.losses(b, k, alpha, None, True) == pytest.approx((more - beta).max(), 1e-6)
    at_zero = stats.ncx2.sf(h, k, b**2) - alpha
    assert raim_affine.losses(b, k, alpha, 0.0, True) == pytest.approx(at_zero, 1e-9)


@pytest.mark.parametrize("lat", [-90.0, -33.3, 0.0, 1e-9, 50.85, 89.9999999, 90.0])
@pytest.mark.parametrize("height", [-5000.0, 0.0, 8848.0, 2e7])
def test_geodesy_there_and_back(lat: float, height: float) -> None:
    x = raim_geodesy.geodetic_to_ecef(lat, -123.4, height)
    found = raim_geodesy.ecef_to_geodetic(x)
    assert found[0] == pytest.approx(lat, rel=1e-14, abs=2e-14)
    assert found[2] == pytest.approx(height, abs=1e-8)
    if abs(lat) < 89.0:
        assert found[1] == pytest.approx(-123.4, rel=1e-14)
    east, north, up = raim_geodesy.local_axes(lat, -123.4)
    np.testing.assert_allclose(np.cross(east, north), up, atol=1e-15)
    above = raim_geodesy.geodetic_to_ecef(lat, -123.4, height + 1000.0)
    np.testing.assert_allclose((above - x) / 1000.0, up, atol=1e-11)
    if abs(lat) < 89.0:
        beside = raim_geodesy.geodetic_to_ecef(lat, -123.4 + 1e-5, height) - x
        np.testing.assert_allclose(beside / np.linalg.norm(beside), east, atol=2e-7)


def test_corner_points_of_the_ellipsoid() -> None:
    points: list[tuple[tuple[float, float, float], list[float]]] = [
        ((0.0, 0.0, 0.0), [6378137.0, 0.0, 0.0]),
        ((0.0, 90.0, 10.0), [0.0, 6378147.0, 0.0]),
        ((90.0, 0.0, 0.0), [0.0, 0.0, 6356752.314245179]),
    ]
    for where, known in points:
        found = raim_geodesy.geodetic_to_ecef(*where)
        np.testing.assert_allclose(found, known, rtol=1e-15, atol=1e-9)


def circle(radius: float, count: int) -> Spline:
    angle = np.linspace(0.0, 1.0, count)
    flat = radius * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    return spline(flat + np.array([4e6, 3e5, 5e6]), start=1000.0)


def test_spline_of_a_circle() -> None:
    """Its length is the polyline's, its curvature away from the ends that of the circle."""
    track = circle(500.0, 101)
    assert track.low == 1000.0
    assert track.high - track.low == pytest.approx(500.0 * 200.0 * np.sin(0.005), rel=1e-10)
    middle = np.linspace(track.low + 100.0, track.high - 100.0, 50)
    np.testing.assert_allclose(track.curvature(middle), 1 / 500.0, rtol=1e-4)
    for l in (track.low - 20.0, 1234.5, track.high + 20.0):  # noqa: E741
        side = np.cross(track.tangent(l), [0.0, 0.0, 1.0])
        assert track.nearest(track.position(l) + 3.0 * side) == pytest.approx(l, abs=1e-6)
    np.testing.assert_allclose(track.position(track.low), track.points[0], atol=1e-8)
    gap = np.linalg.norm(track.polyline(middle) - track.position(middle), axis=1).max()
    assert gap < 5.0**2 / 8 / 500.0 * 1.01


def epoch() -> Epoch:
    rng = np.random.RandomState(4)
    u = rng.normal(size=(8, 3)) + np.array([2.0, 0.2, 2.0])
    at = circle(500.0, 101).position(1300.0)
    satellite = at + 2.2e7 * u / np.linalg.norm(u, axis=1)[:, None]
    sigma = rng.uniform(1.0, 4.0, 8)
    ranges = np.linalg.norm(satellite - at, axis=1) + sigma * rng.normal(size=8)
    return Epoch(satellite, ranges, sigma, tuple("GGGGEEEE"))


def test_solution_is_the_smallest_sum_of_squares() -> None:
    track, e = circle(500.0, 101), epoch()
    s = solve(e, track, 1250.0)
    assert s.along == pytest.approx(1300.0, abs=6 * s.sigma)

    def squares(l: float, clock: Array) -> float:  # noqa: E741
        modelled = e.ranges(track.position(l)) + np.repeat([clock[1], clock[0]], 4)
        return float(np.sum(((e.pseudorange - modelled) / e.sigma) ** 2))

    clock = np.array([s.clock["E"], s.clock["G"]])
    assert squares(s.along, clock) == pytest.approx(s.statistic, rel=1e-9)
    for moved in (-1e-2, 1e-2):
        assert squares(s.along + moved, clock) > s.statistic
        assert squares(s.along, clock + np.array([moved, 0.0])) > s.statistic
    beyond = raim_monitor.linearisation_error(e, track, s, np.array([s.along, s.along + 50.0]))
    assert beyond[0] == pytest.approx(0.0, abs=1e-8)
    assert beyond[1] > 0.1


@pytest.mark.parametrize("gone", [(0,), (5,), (1, 6), (2, 3)])
def test_leaving_out_is_adding_unknown_biases(gone: tuple[int, ...]) -> None:
    """Two ways to know nothing of a satellite, and two sums of the same variance."""
    s = solve(epoch(), circle(500.0, 101), 1250.0)
    w = protection.without(s, gone)
    biases = np.eye(8)[:, list(gone)]
    J = np.column_stack([s.J, biases])
    assert estimable(J)
    inverse = np.linalg.pinv(J)
    assert w.separation == pytest.approx(-float(inverse[0] @ s.r), rel=1e-9)
    assert w.sigma == pytest.approx(float(np.linalg.norm(inverse[0])), rel=1e-11)
    difference = float(np.sqrt(w.sigma**2 - s.sigma**2))
    assert w.separation_sigma == pytest.approx(difference, rel=1e-9)


def test_critical_shift_has_its_probability() -> None:
    demand = Demand(60.0)
    shift = raim_monitor.critical_shift(30.0, 2.5, demand)
    assert raim_monitor.outside(30.0, shift, 2.5) == pytest.approx(1e-3, rel=1e-11)
    assert raim_monitor.critical_shift(1.0, 2.5, demand) == 0.0
    assert raim_monitor.critical_shift(30.0, 2.5, Demand(60.0, risk=1e-3)) == np.inf


def test_protection_meets_its_budget() -> None:
    s = solve(epoch(), circle(500.0, 101), 1250.0)
    asked = protection.Question(s, 8, Demand(60.0, max_excluded=0))
    assert asked.budget == pytest.approx(1e-7 - 56 * 1e-12, rel=1e-6)
    assert asked.risk(asked.answer) == pytest.approx(asked.budget, rel=1e-9)
    assert len(asked.sets[0]) == 8 + 28
    outcomes = [protection.budget(8, Demand(60.0), k) for k in (0, *[1] * 8, *[2] * 28)]
    assert sum(outcomes) == pytest.approx(asked.budget, rel=1e-12)
    too_many = Demand(60.0, fault_probability=1e-2, max_excluded=0)
    assert protection.Question(s, 8, too_many).answer == np.inf
