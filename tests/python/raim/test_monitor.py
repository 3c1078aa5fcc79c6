"""The monitor, epoch by epoch, against least squares solved again for every question.

Rounding: a distance of 2.6e7 m is known to 4e-9 m, whitened 1e-8 (sigma is at least 0.5 m); some
six of them (the root of the sum over 14 satellites, twice) reach the mileage, in units of its
deviation, and the residuals. Where the engine solves an equation for a length, it says to which
accuracy: the mileage moves by less than SETTLED in the next step, and a tail is short of its target
by SHORT of it at most, on the safe side.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy import stats

import surefix as sf
from oracle import raim_distributions as distributions
from oracle import raim_monitor as oracle
from oracle import raim_protection as protection
from oracle.raim_monitor import Demand
from oracle.raim_solution import Solution, solve
from raim.scenes import monitor, scene, straight_points

ROUNDING = 6e-8
SETTLED = 1e-6  # [m]
SHORT = 1e-6
# No exclusion: what is said is said of all satellites in view.
PLAIN = Demand(80.0, false_alarm=1e-5, max_excluded=0)
SCENES = {
    "curved": scene(1, 24),
    "straight": scene(2, 12, straight_points()),
    "turning Earth": scene(3, 12, rotation=True),
}
each = pytest.mark.parametrize("name", SCENES)


@cache
def solutions(name: str) -> list[Solution]:
    s = SCENES[name]
    return [solve(e, s.spline, at) for e, at in zip(s.epochs, s.truth, strict=True)]


@cache
def found(name: str, demand: Demand = PLAIN, interval: float | None = None) -> sf.raim.RaimResult:
    s = SCENES[name]
    run = monitor(s.track, demand, interval=interval, earth_rotation=name == "turning Earth")
    return run.run(s.pseudoranges)


def meets(half: float, asked: protection.Question, interval: float = 40.0) -> None:
    """The risk beyond it is the budget; that of deviations known to 1e-9 is known to 1e-7. Longer
    than the interval, it has to bear the bend over more than that."""
    if half > interval:
        assert half >= asked.answer * (1 - 1e-7)
        return
    assert -SHORT - 1e-7 <= asked.risk(half) / asked.budget - 1.0 <= 1e-7


@each
def test_solution(name: str) -> None:
    result = found(name)
    for t, s in enumerate(solutions(name)):
        assert result.status[t] == "ok"
        assert result.used[t] == len(s.r)
        assert result.along[t] == pytest.approx(s.along, abs=1.1 * SETTLED + ROUNDING * s.sigma)
        assert result.sigma[t] == pytest.approx(s.sigma, rel=1e-8)
        clocks = result.clock[t][np.isfinite(result.clock[t])]
        np.testing.assert_allclose(np.sort(clocks), np.sort(list(s.clock.values())), atol=1e-5)
        rows = SCENES[name].rows(result.residual, t)
        np.testing.assert_allclose(rows, s.r, atol=ROUNDING)
    assert result.time.tolist() == [float(t) for t in range(len(SCENES[name].epochs))]


@each
def test_estimate_is_of_the_truth(name: str) -> None:
    """Errors over deviations are standard normal: within 5, their squares chi2."""
    result = found(name)
    z = (result.along - SCENES[name].truth) / result.sigma
    assert np.abs(z).max() < 5.0
    assert 1e-4 < stats.chi2.sf(np.sum(z**2), len(z)) < 1.0 - 1e-4


@each
def test_snapshot_test(name: str) -> None:
    """(13)."""
    demand = Demand(80.0, false_alarm=0.2, max_excluded=0)
    result = found(name, demand)
    assert 0 < result.alarm.sum() < len(result.alarm)
    for t, s in enumerate(solutions(name)):
        h = float(distributions.threshold(0.2, s.degrees))
        near = 2.0 * ROUNDING * np.sqrt(s.statistic)
        assert result.statistic[t] == pytest.approx(s.statistic, abs=near)
        assert result.degrees[t] == s.degrees
        assert result.threshold[t] == pytest.approx(h, rel=1e-12)
        p = stats.chi2.sf(s.statistic, s.degrees)
        assert result.p_value[t] == pytest.approx(p, rel=near + 1e-10)
        assert result.alarm[t] == (s.statistic >= h)


@each
def test_separation_alarm(name: str) -> None:
    """Some set of satellites without which the estimate is farther off than T_J."""
    demand = Demand(80.0, false_alarm=0.9, max_excluded=0)
    result = found(name, demand)
    for k, s in enumerate(solutions(name)):
        all_ = protection.every_without(s, 2)
        T = protection.separation_thresholds(all_, 0.9)
        ratio = [abs(w.separation) / t for w, t in zip(all_, T, strict=True)
                 if np.isfinite(w.sigma) and not protection.harmless(s, w)]  # fmt: skip
        assert result.separation_alarm[k] == (max(ratio, default=0.0) > 1.0)
        alarm = bool(result.alarm[k] or result.separation_alarm[k])
        assert result.declared[k] == ("alarm" if alarm else "ok")
    assert result.separation_alarm.any()


@each
@pytest.mark.parametrize("length", [30.0, 80.0])
def test_critical_biases(name: str, length: float) -> None:
    """All move the estimate by the same, which is the largest that may happen unseen. Of the tail
    beyond half an interval, 1e-8 of the shift is z half / sigma times that."""
    demand, critical = Demand(length, max_excluded=0), 0
    result, scene_ = found(name, demand), SCENES[name]
    for t, s in enumerate(solutions(name)):
        effect, bias = np.abs(s.gain) / scene_.epochs[t].sigma, scene_.rows(result.critical_bias, t)
        known = oracle.critical_biases(s, scene_.epochs[t].sigma, length / 2, demand)
        np.testing.assert_array_equal(np.isinf(bias), np.isinf(known))
        if oracle.critical_shift(length / 2, s.sigma, demand) == 0.0:
            np.testing.assert_array_equal(bias[np.isfinite(known)], 0.0)
            continue
        critical += 1
        shift, most = 1.0 / np.max(1.0 / (bias * effect.max())), effect.max()
        np.testing.assert_allclose(shift / bias, effect, rtol=1e-9, atol=1e-8 * most)
        tail = oracle.outside(length / 2, shift, s.sigma) / 1e-3 - 1.0
        near = 1e-8 * 3.1 * length / s.sigma
        assert -SHORT - near <= tail <= near
    assert critical > 5


@each
@pytest.mark.parametrize("length", [30.0, 80.0])
def test_critical_biases_missed(name: str, length: float) -> None:
    """ln p moves by root lambda (root lambda - root h) times the relative error of a bias."""
    result, scene_ = found(name, Demand(length, max_excluded=0)), SCENES[name]
    for t, s in enumerate(solutions(name)):
        sigma, bias = scene_.epochs[t].sigma, scene_.rows(result.critical_bias, t)
        lam = oracle.noncentralities(s, sigma, bias)
        p = oracle.missed(lam, 0.0, s.degrees, 1e-5)
        missed = scene_.rows(result.missed_at_critical, t)
        np.testing.assert_allclose(missed, p, rtol=1e-5, atol=1e-30)
        assert result.p_star[t] == missed.max()
        assert result.available[t] == (missed.max() <= 1e-3)


@each
def test_availability_is_mixed(name: str) -> None:
    """Or the tests above say little."""
    for length in (30.0, 80.0):
        available = found(name, Demand(length, max_excluded=0)).available
        assert 0 < available.sum() < len(available) or name != "curved"


@each
@pytest.mark.parametrize("interval", [None, 10.0, 100.0])
def test_linearisation(name: str, interval: float | None) -> None:
    """The bound holds at 101 places of K and is not far above the largest; e_1, e_2 follow."""
    result, scene_ = found(name, PLAIN, interval), SCENES[name]
    half = PLAIN.length / 2 if interval is None else interval
    for t, s in list(enumerate(solutions(name)))[:8]:
        places = s.along + np.linspace(-half, half, 101)
        largest = oracle.linearisation_error(scene_.epochs[t], scene_.spline, s, places).max()
        b = float(result.bound[t])
        assert largest - 2 * ROUNDING <= b <= 1.1 * largest + 1e-4
        whole = oracle.linearisation_error(
            scene_.epochs[t], scene_.spline, s, places, whole=True
        ).max()
        c = float(result.bound_along[t])
        assert whole - 2 * ROUNDING <= c <= 1.1 * whole + 1e-4
        bias = scene_.rows(result.critical_bias, t)
        lam = oracle.noncentralities(s, scene_.epochs[t].sigma, bias).min()
        p, worst = (oracle.missed(np.array([lam]), loss, s.degrees, 1e-5)[0] for loss in (0.0, b))
        assert result.e1[t] == pytest.approx(worst - p, abs=1e-5 * worst + 1e-30)
        gain = distributions.power(b**2, s.degrees, 1e-5) - 1e-5
        assert result.e2[t] == pytest.approx(float(gain), rel=1e-9, abs=1e-16)
        if abs(worst / PLAIN.missed - 1.0) > 1e-4:
            assert result.available_with_e1[t] == (worst <= PLAIN.missed)


@each
def test_protection_of_the_snapshot_test(name: str) -> None:
    """With b of an interval that is longer than the protection. SHORT of a tail of 1e-3 is a
    length of SHORT sigma / 3.1 at most."""
    interval = 300.0
    result = found(name, PLAIN, interval)
    for t, s in list(enumerate(solutions(name)))[:5]:
        b, sigma = float(result.bound[t]), SCENES[name].epochs[t].sigma
        known = oracle.protection_chi2(s, sigma, b, PLAIN, float(result.bound_along[t]))
        if known <= interval:
            more = result.protection_chi2[t] - known
            assert -1e-8 * known <= more <= 1e-8 * known + 0.33 * SHORT * s.sigma
        else:
            assert not result.protection_chi2[t] <= interval


@each
@pytest.mark.parametrize("max_faults", [1, 2])
@pytest.mark.parametrize("fault_probability", [1e-4, 1e-5])
def test_protection(name: str, max_faults: int, fault_probability: float) -> None:
    """None where 1e-4 leaves more than one fault in fourteen with more than the risk."""
    demand = Demand(80.0, fault_probability=fault_probability, max_faults=max_faults,
                    max_excluded=0)  # fmt: skip
    result, unavailable = found(name, demand), 0
    for t, s in enumerate(solutions(name)):
        asked = protection.Question(s, len(s.r), demand, float(result.bound_along[t]))
        if np.isinf(asked.answer):
            unavailable += 1
            assert result.protection[t] == np.inf
        else:
            meets(float(result.protection[t]), asked)
    assert unavailable < len(result.protection) or (max_faults, fault_probability) == (1, 1e-4)


@each
def test_without_fault_hypotheses(name: str) -> None:
    """The snapshot test alone: the same numbers, no separation and no level from hypotheses."""
    alone, whole = (found(name, Demand(80.0, max_faults=k, max_excluded=0)) for k in (0, 2))
    assert np.isnan(alone.protection).all()
    assert not alone.separation_alarm.any()
    for column in ("along", "statistic", "p_star", "e1", "e2", "protection_chi2", "available"):
        np.testing.assert_array_equal(getattr(alone, column), getattr(whole, column))
    assert np.array_equal(alone.declared == "ok", ~whole.alarm & (whole.status == "ok"))


@each
@pytest.mark.parametrize("max_excluded", [1, 2])
def test_protection_pays_for_exclusions(name: str, max_excluded: int) -> None:
    """Half of the risk where nothing was taken out."""
    demand = Demand(80.0, fault_probability=1e-5, max_excluded=max_excluded)
    result = found(name, demand)
    for t, s in enumerate(solutions(name)):
        if result.declared[t] == "ok":
            c = float(result.bound_along[t])
            meets(float(result.protection[t]), protection.Question(s, len(s.r), demand, c))


def test_a_risk_that_faults_alone_do_not_reach() -> None:
    """p_r >= p_f: no bias is critical."""
    demand = Demand(80.0, risk=1e-3, fault_probability=1e-4, max_excluded=0)
    result = found("curved", demand)
    assert np.isinf(result.critical_bias).all()
    assert (result.missed_at_critical == 0.0).all()
    assert (result.p_star == 0.0).all()
    assert result.available.all()
    assert result.available_with_e1.all()


def test_a_length_that_noise_alone_leaves() -> None:
    """Nothing needs to fail: every bias is critical, and missed like no fault."""
    demand = Demand(0.1, max_excluded=0)
    result = found("curved", demand)
    assert not result.available.any()
    matters = np.isfinite(result.critical_bias)
    assert (result.critical_bias[matters] == 0.0).all()
    np.testing.assert_allclose(result.missed_at_critical[matters], 1.0 - 1e-5, rtol=1e-12)
