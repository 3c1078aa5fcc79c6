"""What other libraries do wrong in their IMM and MMAE filters; each has a test here."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.special import expit

import surefix as sf
from oracle import switching
from oracle.compare import smallest_correlation
from oracle.step import Array
from oracle.switching import Estimates, Plant
from oracle.switching_chain import Chain
from switching.plants import LEVELS, random_chain, random_plant, simulated, with_missing
from switching.scenes import (
    APPROXIMATIONS,
    FOUR,
    ONE,
    SCALAR,
    STATIC,
    TOLERANCE,
    arrays,
    assert_density,
    assert_equal,
    assert_gaussians,
    mode_chain,
    probability,
    system,
)

Both = tuple[Any, Callable[..., Estimates]]
both = pytest.mark.parametrize("both", APPROXIMATIONS.values(), ids=APPROXIMATIONS.keys())
ABSORBING = Chain(
    ((1.0, 1.0), (1.0, 100.0), (0.0, 1.0)),
    np.array([[0.9, 0.06, 0.04], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]), np.array([1.0, 0.0, 0.0]),
)  # fmt: skip
OUTLIERS = [120.0, 1e3, 1e8]


@pytest.mark.parametrize("outlier", OUTLIERS)
@pytest.mark.parametrize("chain", [STATIC, ABSORBING], ids=["static", "absorbing"])
@both
def test_gross_outlier_leaves_no_tie(both: Both, chain: Chain, outlier: float) -> None:
    """filterpy #70 floors the likelihoods: all modes tie, and the posterior falls back to the prior
    (0.98 for the healthy mode at z = 120, where it is 0.000)."""
    z = np.array([[0.4], [-0.3], [outlier], [0.2]])
    found = both[0](system(SCALAR), mode_chain(chain)).run(z)
    assert_equal(found, both[1](SCALAR, chain, z))
    exact = switching.enumeration(SCALAR, chain, z)
    np.testing.assert_allclose(found.mode_probability[2:], exact.mode[2:], atol=1e-6)
    assert found.mode_probability[2, 0] < 1e-300
    assert found.mode_probability[2, 1] > 0.99


@pytest.mark.parametrize("outlier", OUTLIERS)
def test_static_modes_are_filters_of_their_own(outlier: float) -> None:
    """No formula of mixing in it: a Kalman filter for each mode, and Bayes' rule at the end."""
    z = np.random.default_rng(1).normal(size=(9, 1))
    z[4] = outlier
    found = sf.IMMFilter(system(SCALAR), mode_chain(STATIC)).run(z)
    for k in range(9):
        known = [switching.genie(SCALAR, [m] * (k + 1), z) for m in STATIC.modes]
        evidence = np.log(STATIC.initial) + [e.log_likelihood for e in known]
        p = np.exp(evidence - np.logaddexp.reduce(evidence))
        np.testing.assert_allclose(probability(found)[k], p, rtol=0.0, atol=TOLERANCE)
        x = np.array([e.x[k] for e in known])
        mean, P = switching.merged(p, x, np.array([e.P[k] for e in known]))
        assert_gaussians(found.x[k : k + 1], found.P[k : k + 1], mean[None], P[None])
    assert_density(found, float(np.logaddexp.reduce(evidence)))


def test_a_mode_that_no_double_could_hold_comes_back() -> None:
    """At z = 60 the healthy mode's probability is about e^-900, no double. It stays in the race: a
    thousand ordinary measurements later it is near one again, at the step where it should be."""
    chain = Chain(STATIC.modes[:2], np.eye(2), np.array([0.5, 0.5]))
    z = simulated(SCALAR, Chain(STATIC.modes[:1], ONE, np.ones(1)), 1500, 2)[2]
    z[5] = 60.0
    found = sf.IMMFilter(system(SCALAR), mode_chain(chain)).run(z)
    evidence: tuple[list[float], list[float]] = ([], [])
    for j, mode in enumerate(chain.modes):
        x, P, total = SCALAR.x0, SCALAR.P0, 0.0
        for k in range(len(z)):
            if k > 0:
                x, P = switching.predicted(SCALAR, k, x, P)
            x, P, density = switching.update(SCALAR, k, mode, x, P, z[k])
            total += float(density)
            evidence[j].append(total)
    odds = np.array(evidence[0]) - np.array(evidence[1])
    assert odds[5] < -760.0
    assert odds[-1] > 10.0
    np.testing.assert_allclose(probability(found)[:, 0], expit(odds), rtol=0.0, atol=1e-9)


@both
def test_after_an_outlier_the_estimate_is_what_it_would_be_without(both: Both) -> None:
    """Of an outlier that only an interruption explains nothing is used; and 60 steps later the
    filter does not know of it. In other libraries a bank that has tied never gets away."""
    chain = Chain(
        ((1.0, 1.0), (0.0, 1e6)), np.array([[0.95, 0.05], [0.6, 0.4]]), np.array([1, 0.0])
    )
    z = simulated(SCALAR, Chain(STATIC.modes[:1], ONE, np.ones(1)), 70, 2)[2]
    gone, far = z.copy(), z.copy()
    gone[8], far[8] = np.nan, 1e3
    filter = both[0](system(SCALAR), mode_chain(chain))
    found, known = filter.run(far), filter.run(gone)
    assert_equal(found, both[1](SCALAR, chain, far))
    assert found.mode_probability[8, 1] > 1 - 1e-12
    # The IMM's estimate is that of the runs that are interrupted now, not of all.
    sigma = np.sqrt(known.P[-1, 0, 0])
    assert abs(found.x[8, 0] - known.x[8, 0]) < 1e-2 * sigma
    assert abs(found.x[-1, 0] - known.x[-1, 0]) < 1e-6 * sigma
    np.testing.assert_allclose(found.mode_probability[-1], known.mode_probability[-1], atol=1e-6)
    assert known.mode_probability[-1, 0] > 0.9


@both
def test_prior_of_the_next_step_goes_from_row_to_column(both: Both) -> None:
    """filterpy's IMM weighs with mu where the predicted mu belongs; others read p_ji. By hand, for
    a chain where each mistake shows: after z_0 the modes are mu; z_1 is missing, so that only the
    chain moves them."""
    transition = np.array([[0.7, 0.2, 0.1], [0.0, 0.9, 0.1], [0.5, 0.5, 0.0]])
    chain = sf.ModeChain(LEVELS[:3], transition, [0.2, 0.3, 0.5])
    found = both[0](system(SCALAR), chain).run([[1.3], [np.nan], [0.4]])
    S = [1.0 * 1.0 + 1.0, 3.0, 0.16 + 2.0]  # of z_0, P0 = 1
    mean = [0.5, 0.0, -0.2]
    density = np.exp(-0.5 * (1.3 - np.array(mean)) ** 2 / S) / np.sqrt(S)
    mu = density * [0.2, 0.3, 0.5]
    mu /= mu.sum()
    moved = [sum(mu[i] * transition[i, j] for i in range(3)) for j in range(3)]
    np.testing.assert_allclose(found.mode_probability[0], mu, rtol=1e-13)
    np.testing.assert_allclose(found.mode_probability[1], moved, rtol=1e-13)
    for wrong in (mu, transition @ mu):
        assert np.abs(wrong - moved).max() > 0.05


def test_imm_mixes_by_the_law_of_the_mode_before() -> None:
    """(17) by hand, for two modes of which the second alone sees: what mode 1 starts from, and with
    it its estimate of the second step."""
    p, initial = np.array([[0.8, 0.2], [0.4, 0.6]]), np.array([0.5, 0.5])
    plant = Plant(A=ONE, H=ONE, Q=0.5 * ONE, R=ONE, x0=np.zeros(1), P0=ONE)
    z = np.array([[2.0], [1.0]])

    def normal(v: float, S: float) -> float:
        return float(np.exp(-0.5 * v * v / S) / np.sqrt(2 * np.pi * S))

    mu = initial * [normal(2.0, 1.0), normal(2.0, 2.0)]  # interrupted, healthy
    first = mu.sum()
    mu = mu / first
    means, variances = [0.0, 1.0], [1.0, 0.5]  # after z_0 = 2: K = 1/2
    prior = mu @ p
    x, P = [], []
    for j in range(2):
        w = mu * p[:, j] / prior[j]
        mean = float(w @ means)
        x.append(mean)
        P.append(float(w @ (variances + (np.array(means) - mean) ** 2)) + 0.5)
    K = P[1] / (P[1] + 1.0)
    after = [x[0], x[1] + K * (1.0 - x[1])]
    left = [P[0], (1 - K) * P[1]]
    weight = prior * [normal(1.0, 1.0), normal(1.0 - x[1], P[1] + 1.0)]
    second = weight.sum()
    weight = weight / second
    mean = float(weight @ after)
    found = sf.IMMFilter(system(plant), sf.ModeChain([(0, 1), (1, 1)], p, initial)).run(z)
    assert found.x[1, 0] == pytest.approx(mean, rel=1e-13)
    spread = float(weight @ (left + (np.array(after) - mean) ** 2))
    assert found.P[1, 0, 0] == pytest.approx(spread, rel=1e-13)
    assert found.log_likelihood == pytest.approx(np.log(first * second), rel=1e-13)


@both
def test_covariance_of_the_bank_has_the_spread_of_its_means(both: Both) -> None:
    """filterpy's MMAE sums over the components of the state where it should over the filters."""
    plant = Plant(A=np.eye(3), H=np.eye(3)[:1], Q=np.eye(3), R=0.01 * ONE, x0=np.zeros(3),
                  P0=np.diag([400.0, 4.0, 1.0]))  # fmt: skip
    chain = sf.ModeChain([(1, 1), (0, 1e4)], [[0.5, 0.5]] * 2, [0.5, 0.5])
    found = both[0](system(plant), chain).run([[30.0]])
    densities = np.array([-0.5 * 900 / S - 0.5 * np.log(S) for S in (400.01, 100.0)])
    p = float(1 / (1 + np.exp(densities[1] - densities[0])))
    K = 400 / 400.01
    variance = p * (400 * (1 - K)) + (1 - p) * 400 + p * (1 - p) * (30 * K) ** 2
    assert 0.4 < p < 0.99
    assert found.P[0, 0, 0] == pytest.approx(variance, rel=1e-12)
    np.testing.assert_allclose(np.diag(found.P[0])[1:], [4.0, 1.0], rtol=1e-14)


@both
def test_five_dropouts_in_a_row(both: Both) -> None:
    """All missing: only the chain moves the modes, and only the plant the estimate."""
    plant, chain = random_plant(2, 3, 2), random_chain(7, LEVELS)
    z = simulated(plant, chain, 12, 1)[2]
    z[4:9] = np.nan
    found = both[0](system(plant), mode_chain(chain)).run(z)
    mode, x, P = found.mode_probability[3], found.x[3], found.P[3]
    for k in range(4, 9):
        mode, x, P = mode @ chain.transition, plant.A @ x, plant.A @ P @ plant.A.T + plant.Q
        np.testing.assert_allclose(found.mode_probability[k], mode, rtol=1e-13)
        assert_gaussians(found.x[k : k + 1], found.P[k : k + 1], x[None], P[None], 1e-12)
    before = both[0](system(plant), mode_chain(chain)).run(z[:4])
    after = both[0](system(plant), mode_chain(chain)).run(z[:9])
    assert after.log_likelihood == pytest.approx(before.log_likelihood, rel=1e-14)


@both
def test_nothing_measured_at_all(both: Both) -> None:
    """The prior, and the chain's law; the density of nothing is one."""
    plant, chain = random_plant(2, 2, 2), random_chain(7, LEVELS)
    found = both[0](system(plant), mode_chain(chain)).run(np.full((30, 2), np.nan))
    np.testing.assert_allclose(found.mode_probability, chain.law(30), rtol=1e-12)
    assert np.array_equal(found.x[0], plant.x0)
    np.testing.assert_allclose(found.P[0], plant.P0, rtol=1e-14)
    assert found.log_likelihood == pytest.approx(0.0, abs=1e-13)


@both
def test_covariances_stay_symmetric_and_positive(both: Both) -> None:
    """Other libraries' P = F P F' + Q - K S K' is unsymmetric after 1000 benign steps."""
    plant = random_plant(3, 5, 2)
    plant = replace(plant, R=1e-10 * plant.R, P0=1e8 * plant.P0)
    z = with_missing(simulated(replace(plant, P0=np.eye(5)), FOUR, 3000, 1)[2], 2)
    found = both[0](system(plant), mode_chain(FOUR)).run(z)
    assert np.array_equal(found.P, np.swapaxes(found.P, -1, -2))
    assert min(smallest_correlation(P) for P in found.P[::7]) > 0.0
    np.testing.assert_allclose(found.mode_probability.sum(axis=1), 1.0, rtol=1e-13)
    assert (found.mode_probability >= 0.0).all()


def test_covariance_of_the_linear_filter_stays_symmetric_and_positive() -> None:
    plant = random_plant(3, 5, 2)
    plant = replace(plant, R=1e-6 * plant.R, P0=1e4 * plant.P0)
    found = sf.LinearOptimalFilter(system(plant), mode_chain(FOUR)).run(np.zeros((3000, 2)))
    assert np.array_equal(found.P, np.swapaxes(found.P, -1, -2))
    assert min(smallest_correlation(P) for P in found.P[::7]) > 0.0


@both
def test_log_likelihood_of_several_components(both: Both) -> None:
    """pymc-extras #744: wrong only when dim(y) > 1. Of two systems side by side that do not touch,
    in modes that are known, it is the sum."""
    one, two = random_plant(1, 2, 1), random_plant(2, 1, 2)

    def beside(a: Array, b: Array) -> Array:
        return np.block([[a, np.zeros((a.shape[0], b.shape[1]))],
                         [np.zeros((b.shape[0], a.shape[1])), b]])  # fmt: skip

    joint = Plant(beside(one.A, two.A), beside(one.H, two.H), beside(one.Q, two.Q),
                  beside(one.R, two.R), np.concatenate([one.x0, two.x0]),
                  beside(one.P0, two.P0))  # fmt: skip
    chain = sf.ModeChain([(1, 2.5)], [[1.0]])
    z = with_missing(np.random.default_rng(1).normal(size=(20, 3)), 3)
    parts = [both[0](system(p), chain).run(part) for p, part in ((one, z[:, :1]), (two, z[:, 1:]))]
    whole = both[0](system(joint), chain).run(z)
    assert_density(whole, parts[0].log_likelihood + parts[1].log_likelihood)


@both
def test_components_may_come_in_any_order(both: Both) -> None:
    """crazyflie #169: updates one component after another depend on the order."""
    plant, chain = random_plant(2, 3, 3), random_chain(1, LEVELS)
    z = with_missing(simulated(plant, chain, 20, 1)[2], 2)
    turned = replace(plant, H=plant.H[::-1], R=plant.R[::-1, ::-1])
    one = both[0](system(plant), mode_chain(chain)).run(z)
    two = both[0](system(turned), mode_chain(chain)).run(z[:, ::-1])
    assert_gaussians(two.x, two.P, one.x, one.P)
    np.testing.assert_allclose(two.mode_probability, one.mode_probability, atol=TOLERANCE)
    assert_density(two, one.log_likelihood)


@both
def test_units_do_not_matter(both: Both) -> None:
    """States in nanometres and in gigametres, measurements in their own."""
    plant, chain = random_plant(2, 3, 2), random_chain(1, LEVELS)
    z = with_missing(simulated(plant, chain, 20, 1)[2], 2)
    s, u = np.array([1e9, 1.0, 1e-9]), np.array([1e6, 1e-7])
    scaled = Plant(plant.A * np.outer(s, 1 / s), plant.H * np.outer(u, 1 / s),
                   plant.Q * np.outer(s, s), plant.R * np.outer(u, u), plant.x0 * s,
                   plant.P0 * np.outer(s, s))  # fmt: skip
    one = both[0](system(plant), mode_chain(chain)).run(z)
    two = both[0](system(scaled), mode_chain(chain)).run(z * u)
    assert_gaussians(two.x / s, two.P / np.outer(s, s), one.x, one.P)
    np.testing.assert_allclose(two.mode_probability, one.mode_probability, atol=TOLERANCE)


@both
def test_modes_may_come_in_any_order(both: Both) -> None:
    plant, chain = random_plant(2, 3, 2), random_chain(1, LEVELS)
    z = with_missing(simulated(plant, chain, 20, 1)[2], 2)
    turn = [2, 0, 3, 1]
    turned = Chain(tuple(chain.modes[i] for i in turn), chain.transition[np.ix_(turn, turn)],
                   chain.initial[turn])  # fmt: skip
    one = both[0](system(plant), mode_chain(chain)).run(z)
    two = both[0](system(plant), mode_chain(turned)).run(z)
    assert_gaussians(two.x, two.P, one.x, one.P)
    np.testing.assert_allclose(two.mode_probability, one.mode_probability[:, turn], atol=TOLERANCE)


@both
def test_a_mode_that_cannot_be_reached_is_never_there(both: Both) -> None:
    """0 / 0 in other libraries' mixing weights; and the rest is as if it did not exist."""
    transition = np.array([[0.9, 0.1, 0.0], [0.4, 0.6, 0.0], [0.2, 0.3, 0.5]])
    chain = sf.ModeChain(LEVELS[:3], transition, [0.5, 0.5, 0.0])
    small = sf.ModeChain(LEVELS[:2], transition[:2, :2], [0.5, 0.5])
    z = np.random.default_rng(1).normal(size=(20, 1))
    z[7] = 1e3
    found, known = both[0](system(SCALAR), chain).run(z), both[0](system(SCALAR), small).run(z)
    assert np.array_equal(found.mode_probability[:, 2], np.zeros(20))
    assert_gaussians(found.x, found.P, known.x, known.P)


@both
def test_modes_that_take_turns_are_known(both: Both) -> None:
    """A chain without chance: every weight is 0 or 1, and the filter is the genie's."""
    modes = ((1.0, 1.0), (0.0, 3.0), (0.5, 2.0))
    chain = Chain(modes, np.eye(3)[[1, 2, 0]], np.array([0.0, 1.0, 0.0]))
    plant = random_plant(2, 3, 2)
    z = simulated(plant, chain, 20, 1)[2]
    found = both[0](system(plant), mode_chain(chain)).run(z)
    followed = [(1 + k) % 3 for k in range(20)]
    known = switching.genie(plant, [modes[j] for j in followed], z)
    assert_gaussians(found.x, found.P, known.x, known.P, 1e-12)
    assert np.array_equal(found.mode_probability, np.eye(3)[followed])
    assert_density(found, known.log_likelihood)


@both
def test_a_state_that_is_known_exactly(both: Both) -> None:
    """The paper's x_0 = 0: P0 = 0, and Q = 0 until the first disturbance."""
    steps = 10
    Q = np.array([0.0 * ONE] * 4 + [ONE] * 5)
    plant = replace(SCALAR, Q=Q, P0=0.0 * ONE)
    z = np.random.default_rng(1).normal(size=(steps, 1))
    found = both[0](system(plant), mode_chain(FOUR)).run(z)
    known = both[1](plant, FOUR, z)
    assert_gaussians(found.x[5:], found.P[5:], known.x[5:], known.P[5:])
    np.testing.assert_allclose(found.x[:5, 0], 0.5 * (-0.8) ** np.arange(5), rtol=1e-14)
    assert (np.abs(found.P[:5]) < 1e-30).all()  # the squared rounding of a mean, at most
    np.testing.assert_allclose(found.mode_probability, known.mode, rtol=0.0, atol=TOLERANCE)


@both
def test_what_no_double_can_square(both: Both) -> None:
    """An error by name, never a silent NaN (stan-dev/math #3381); numbers where it can."""
    filter = both[0](system(SCALAR), mode_chain(FOUR))
    for z in (1e200, 1e150, 1e20):  # 1e20 ± 0.3 is no number of sixteen digits
        with pytest.raises(sf.NumericalError, match=rf"at \(1,\).*1\.e\+{np.log10(z):.0f}"):
            filter.run([[0.1], [z], [0.2]])
    found = filter.run([[0.1], [1e10], [0.2]])
    for a in arrays(found):
        assert np.isfinite(a).all()
    assert probability(found)[1].tolist() == [0.0, 1.0, 0.0, 0.0]


def test_the_genie_is_not_fooled() -> None:
    """It knows that the outlier says nothing."""
    z = np.array([[0.4], [1e8], [0.2]])
    chain = sf.ModeChain([(1, 1), (0, 1)], [[0.5, 0.5]] * 2)
    found = sf.GenieFilter(system(SCALAR), chain).run(z, [0, 1, 0])
    z[1] = np.nan
    known = sf.GenieFilter(system(SCALAR)).run(z)
    assert np.array_equal(found.x, known.x)
    assert np.array_equal(found.P, known.P)
