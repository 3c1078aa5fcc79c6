"""The oracle of the drift detectors, against what does not share its formulas."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats
from scipy.linalg import expm

from oracle import drift, models, sensors
from oracle import drift_profiles as profiles
from oracle.drift import Dense
from oracle.drift_profiles import Profile
from oracle.step import Array
from oracle.switching import Plant, at
from switching.plants import random_plant, with_missing

PARTICLE = Plant(
    A=np.array([[1.0, 1.0], [0.0, 1.0]]), H=np.array([[1.0, 0.0]]), Q=np.diag([1e-8, 1e-4]),
    R=np.array([[1.5]]), x0=np.array([3.0, -1.0]), P0=np.eye(2),
)  # fmt: skip
I1, ONE, BOTH = np.eye(1), np.ones(1), np.array([1.0, -0.5])
DAMPED = np.array([[-0.1, 0.5], [-0.5, -0.1]])
CUBIC = np.eye(4, k=1)
# Profile, and the same as output exp(A t) onset.
LINEAR: dict[str, tuple[Profile, Array, Array, Array]] = {
    "step": (profiles.step, np.zeros((1, 1)), np.ones(1), np.ones(1)),
    "ramp": (profiles.ramp, np.eye(2, k=1), np.array([1.0, 0.0]), np.array([0.0, 1.0])),
    "exponential": (
        profiles.exponential(6.0), np.diag([0.0, -1 / 6.0]), np.array([1.0, -1.0]), np.ones(2),
    ),
    "growing": (
        profiles.exponential(-9.0), np.diag([0.0, 1 / 9.0]), np.array([1.0, -1.0]), np.ones(2),
    ),
    "sine": (
        profiles.sine(0.11), 2 * np.pi * 0.11 * np.array([[0.0, 1.0], [-1.0, 0.0]]),
        np.array([1.0, 0.0]), np.array([[0.0, 1.0], [1.0, 0.0]]),
    ),
    "damped": (
        profiles.user(DAMPED, np.array([1.0, 0.0]), np.array([0.0, 1.0])),
        DAMPED, np.array([1.0, 0.0]), np.array([0.0, 1.0]),
    ),
    "cubic": (
        profiles.user(CUBIC, np.eye(4)[0], np.eye(4)[:, 2:]), CUBIC, np.eye(4)[0], np.eye(4)[:, 2:],
    ),
}  # fmt: skip
each_profile = pytest.mark.parametrize("name", LINEAR)


def irregular(steps: int = 30, seed: int = 4) -> tuple[Plant, Array, Array, Array]:
    """A plant of its own matrices in every step, z with missing components, times, inputs."""
    plant, rng = random_plant(seed, 3, 2, steps), np.random.default_rng(seed)
    z = with_missing(drift.simulate(plant, 1, steps, seed)[0], seed)
    z[0] = 1.0, np.nan
    return plant, z, np.cumsum(rng.exponential(0.7, steps)), rng.normal(size=(steps - 1, 3))


def particle(steps: int = 100, seed: int = 1) -> Dense:
    return drift.dense(PARTICLE, drift.simulate(PARTICLE, 1, steps, seed)[0])


def test_inconsistency_is_the_filters() -> None:
    """The sum over innovations is the one determinant and the one quadratic form."""
    plant, z, times, inputs = irregular()
    known = drift.estimates(plant, z, inputs)[2]
    found = drift.dense(plant, z, times, inputs)
    assert found.inconsistency == pytest.approx(known, rel=1e-12)
    law = stats.multivariate_normal(np.zeros(len(found.gamma)), found.Gamma.astype(float))
    assert found.log_likelihood == pytest.approx(law.logpdf(found.gamma.astype(float)), rel=1e-11)


def test_gradient_is_that_of_the_filters_inconsistency() -> None:
    plant, z, times, inputs = irregular()
    known = drift.differences(lambda z: drift.estimates(plant, z, inputs)[2], z)
    found = drift.dense(plant, z, times, inputs).gradient
    np.testing.assert_array_equal(np.isnan(found), np.isnan(z))
    np.testing.assert_allclose(found, known, rtol=1e-9, atol=1e-11)


def test_precision_is_the_gradients_slope() -> None:
    """Gamma^-1 is half the Hessian."""
    plant, z, times, inputs = irregular(12)
    precision = drift.dense(plant, z, times, inputs).precision
    for place in np.argwhere(~np.isnan(z)):
        up = z.copy()
        up[tuple(place)] += 1.0
        moved = drift.dense(plant, up, times, inputs).gradient[tuple(place)]
        slope = moved - drift.dense(plant, z, times, inputs).gradient[tuple(place)]
        assert 2.0 * precision[tuple(place)] == pytest.approx(slope, rel=1e-12)


def test_nis_is_that_of_the_steps() -> None:
    plant, z, _, inputs = irregular()
    total = [drift.estimates(plant, z[: k + 1], inputs)[2] for k in range(len(z))]
    log_det = [drift.estimates(plant, np.where(np.isnan(z), z, 0.0)[: k + 1], inputs)[2]
               - drift.dense(plant, np.where(np.isnan(z), z, 0.0)[: k + 1], None, inputs).nis.sum()
               for k in range(len(z))]  # fmt: skip
    found = drift.dense(plant, z, None, inputs).nis
    known = np.diff(np.array(total) - np.array(log_det), prepend=0.0)
    np.testing.assert_allclose(found, known, rtol=1e-9, atol=1e-9)


def test_extended_precision_solves_the_particle() -> None:
    """The residual over 500 steps, in the unit of the measurement noise."""
    d = particle(500)
    assert float(np.abs(d.Gamma @ d.solved - d.gamma).max()) < 1e-12
    assert np.linalg.cond(d.Gamma.astype(float)) > 1e7  # else doubles would do


@each_profile
def test_profiles_are_those_of_small_linear_systems(name: str) -> None:
    profile, A, output, onset = LINEAR[name]
    elapsed = np.array([0.0, 0.1, 1.0, 7.3, 20.0])
    known = profiles.user(A, output, onset)(elapsed)
    np.testing.assert_allclose(profile(elapsed), known, rtol=1e-12, atol=1e-13)


def test_profiles_have_the_contracts_values() -> None:
    elapsed = np.array([0.0, 2.0])
    assert profiles.step(elapsed).tolist() == [[1.0], [1.0]]
    assert profiles.ramp(elapsed).tolist() == [[0.0], [2.0]]
    assert profiles.exponential(2.0)(elapsed)[:, 0] == pytest.approx([0.0, 1.0 - np.exp(-1.0)])
    assert profiles.exponential(-2.0)(elapsed)[:, 0] == pytest.approx([0.0, 1.0 - np.e])
    np.testing.assert_allclose(profiles.sine(0.125)(elapsed), [[0.0, 1.0], [1.0, 0.0]], atol=1e-15)


@each_profile
def test_ratio_is_the_drop_at_the_best_amplitudes(name: str) -> None:
    """Of script-L of the repaired data; any other amplitude leaves more."""
    plant, z, times, inputs = irregular()
    profile, d = LINEAR[name][0], drift.dense(plant, z, times, inputs)
    faults = profiles.onset_faults(d, profile, BOTH)
    found = profiles.fits(d, faults)
    rng = np.random.default_rng(0)

    def left(fault: Array, a: Array) -> float:
        moved = z - np.nan_to_num(d.spread(fault @ a))
        return drift.estimates(plant, moved, inputs)[2]

    for m in np.flatnonzero(found.detectability > 1e-3):
        drop = d.inconsistency - left(faults[m], found.amplitude[m])
        assert drop == pytest.approx(found.ratio[m], rel=1e-9, abs=1e-9)
        other = found.amplitude[m] + found.se[m] * rng.normal(size=len(found.se[m]))
        assert left(faults[m], other) > left(faults[m], found.amplitude[m])


def test_se_is_where_the_drop_falls_by_one() -> None:
    plant, z, times, inputs = irregular()
    d = drift.dense(plant, z, times, inputs)
    faults = profiles.onset_faults(d, profiles.ramp, BOTH)
    found, m = profiles.fits(d, faults), 8
    at_side = z - np.nan_to_num(d.spread(faults[m] @ (found.amplitude[m] + found.se[m])))
    fallen = d.inconsistency - drift.estimates(plant, at_side, inputs)[2]
    assert found.ratio[m] - fallen == pytest.approx(1.0, rel=1e-8)


@pytest.mark.parametrize("name", ["step", "ramp", "sine"])
def test_ratio_is_chi_squared_with_no_fault(name: str) -> None:
    """20,000 runs: a ratio 5 % too large moves the distribution by 0.012, and 0.0115 is
    significant at 1 %: what passes has the right covariance and degrees of freedom."""
    steps, profile = 30, LINEAR[name][0]
    z = drift.simulate(PARTICLE, 20_000, steps, 3)[:, :, 0]
    d = drift.dense(PARTICLE, z[0][:, None])
    white = d.whiten((z - (z[0] - d.gamma)).T).astype(float)
    for m in (0, 14, 25):
        D = d.whiten(profiles.onset_faults(d, profile, ONE)[m]).astype(float)
        ratio = np.sum((np.linalg.qr(D)[0].T @ white) ** 2, axis=0)
        assert ratio[0] == pytest.approx(profiles.onset_fits(d, profile, ONE).ratio[m], rel=1e-9)
        assert stats.kstest(ratio, stats.chi2(D.shape[1]).cdf).pvalue > 0.01


@each_profile
def test_backward_sweep_has_the_same_ratio(name: str) -> None:
    """The recursion of all onsets at once, against the sum over all pairs, in doubles: so much of
    the tolerance of the engine's tests is due to rounding."""
    plant, z, times, inputs = irregular()
    profile, A, output, onset = LINEAR[name]
    cases = (
        (drift.dense(plant, z, times, inputs), plant, times, BOTH),
        (particle(), PARTICLE, np.arange(100.0), ONE),
    )
    for d, given, t, weights in cases:
        num, G = _swept(given, d.spread(d.gamma), t, weights, A, output, onset.reshape(len(A), -1))
        known = profiles.onset_fits(d, profile, weights)
        rows = np.unique(d.step[weights[d.channel] != 0.0])
        clear = known.detectability > 1e-6
        assert clear.sum() > 0.8 * len(clear)
        for k in np.flatnonzero(clear):
            found = float(num[rows[k]] @ np.linalg.solve(G[rows[k]], num[rows[k]]))
            assert found == pytest.approx(known.ratio[k], rel=1e-8, abs=1e-8)


def _swept(
    plant: Plant, z: Array, times: Array, weights: Array, A: Array, output: Array, onset: Array
) -> tuple[Array, Array]:
    """Numerator (T, q) and denominator (T, q, q) of every onset: Kalman's filter forwards, then one
    sweep backwards over [response of the estimate b, profile's state s] (mathematics, section 4).
    z is about the prediction from the initial state, so the filter starts from zero."""
    n, p, T = len(plant.x0), len(A), len(z)
    x, P, record = np.zeros(n), plant.P0, []
    for k in range(T):
        F = np.eye(n) if k == 0 else at(plant.A, k - 1)
        if k > 0:
            x, P = F @ x, F @ P @ F.T + at(plant.Q, k - 1)
        seen = ~np.isnan(z[k])
        H, R = at(plant.H, k)[seen], at(plant.R, k)[np.ix_(seen, seen)]
        nu, S = z[k, seen] - H @ x, H @ P @ H.T + R
        K = np.linalg.solve(S, H @ P).T
        x, P = x + K @ nu, (np.eye(n) - K @ H) @ P
        rate = np.zeros((p, p)) if k + 1 == T else A * (times[k + 1] - times[k])
        record.append((F, H, K, nu, S, np.outer(weights[seen], output), expm(rate)))
    M, ell = np.zeros((n + p, n + p)), np.zeros(n + p)
    num, G = np.zeros((T, onset.shape[1])), np.zeros((T, onset.shape[1], onset.shape[1]))
    for k in reversed(range(T)):
        F, H, K, nu, S, read, move = record[k]
        c = np.hstack([-H @ F, read])  # of (b before this step, s in it)
        Phi = np.block([[F - K @ H @ F, K @ read], [np.zeros((p, n)), move]])
        M = Phi.T @ M @ Phi + c.T @ np.linalg.solve(S, c)
        ell = Phi.T @ ell + c.T @ np.linalg.solve(S, nu)
        num[k], G[k] = onset.T @ ell[n:], onset.T @ M[n:, n:] @ onset
    return num, G


def test_an_end_is_the_difference_of_two_onsets() -> None:
    """A ramp that ends goes on as a constant, a step that ends is a pulse."""
    d = particle(20)
    shapes: list[tuple[Profile, Array]] = [
        (profiles.ramp, np.clip(d.time - 4.0, 0.0, 5.0)),
        (profiles.step, ((d.time >= 4.0) & (d.time < 9.0)).astype(float)),
    ]
    for profile, value in shapes:
        onsets = profiles.onset_faults(d, profile, ONE)
        faults, index = profiles.ended(onsets)
        (pair,) = np.flatnonzero((index == [4, 9]).all(axis=1))
        np.testing.assert_allclose(faults[pair, :, 0], value, atol=1e-12)
        (never,) = np.flatnonzero((index == [4, 20]).all(axis=1))
        onset = profiles.columns(d, profile, 4.0, ONE)
        np.testing.assert_array_equal(faults[never], onset)
        assert len(index) == 20 * 21 / 2
        one, both = profiles.fits(d, faults), profiles.ended_fits(d, onsets)[0]
        for name in ("ratio", "amplitude", "se", "detectability"):
            found, known = getattr(both, name), getattr(one, name)
            np.testing.assert_allclose(found, known, rtol=1e-10, atol=1e-12)


def test_a_sines_phase_does_not_matter() -> None:
    """The ratio is the largest of all the phases', each of a known shape."""
    d, f = particle(), 0.083
    known = profiles.fits(d, profiles.sine_faults(d, np.array([f]), ONE))
    phases = np.linspace(0.0, np.pi, 2001)
    shapes = np.sin(2 * np.pi * f * d.time[None, :, None] + phases[:, None, None])
    each = profiles.fits(d, shapes)
    assert each.ratio.max() == pytest.approx(known.ratio[0], rel=1e-5)  # the grid's spacing squared
    best = np.arctan2(known.amplitude[0, 1], known.amplitude[0, 0]) % np.pi
    assert phases[each.ratio.argmax()] == pytest.approx(best, abs=np.pi / 2000)


@pytest.mark.parametrize("P0", [1e-6, 1.0, 1e6])
def test_detectability_of_a_step_beside_an_unknown_constant(P0: float) -> None:
    """A constant of variance P0, N measurements of variance R: G = n/R - n^2 P0 / R(R + N P0)."""
    N, R = 10, 0.5
    plant = Plant(I1, I1, 0 * I1, R * I1, np.zeros(1), P0 * I1)
    found = profiles.onset_fits(drift.dense(plant, np.zeros((N, 1))), profiles.step, ONE)
    n = np.arange(N, 0, -1)  # after the onset
    np.testing.assert_allclose(found.detectability, 1 - n * P0 / (R + N * P0), rtol=1e-9)
    np.testing.assert_allclose(found.se[:, 0] ** -2, n / R * (1 - n * P0 / (R + N * P0)), rtol=1e-9)


def test_what_cannot_be_seen_has_no_ratio() -> None:
    """A ramp is zero at its onset; one measurement does not tell a sine from a cosine; a prior of
    1e16 hides a step at the start, and only that one."""
    d = particle(5)
    for profile in (profiles.ramp, profiles.exponential(3.0), profiles.sine(0.11)):
        found = profiles.onset_fits(d, profile, ONE)
        assert np.isnan(found.ratio).tolist() == [False] * 4 + [True]
        assert np.isnan(found.amplitude).any(axis=1).tolist() == [False] * 4 + [True]
        assert found.detectability[-1] == 0.0
    plant = Plant(I1, I1, 0 * I1, I1, np.zeros(1), 1e16 * I1)
    hidden = profiles.onset_fits(drift.dense(plant, np.zeros((5, 1))), profiles.step, ONE)
    assert np.isnan(hidden.ratio).tolist() == [True] + [False] * 4


def test_repair_leaves_the_healthy_estimate() -> None:
    """To the amplitude's error, which here is exact, because the data are the prediction."""
    plant, z, times, inputs = irregular()
    d = drift.dense(plant, z, times, inputs)
    healthy = z - d.spread(d.gamma)
    faults = profiles.onset_faults(d, profiles.ramp, BOTH)
    fault = d.spread(0.7 * faults[5, :, 0])
    faulty = drift.dense(plant, healthy + fault, times, inputs)
    a = profiles.onset_fits(faulty, profiles.ramp, BOTH).amplitude[5]
    assert a == pytest.approx([0.7], rel=1e-11)
    repaired = healthy + fault - d.spread(faults[5] @ a)
    x, P, _ = drift.estimates(plant, repaired, inputs)
    x_known, P_known, _ = drift.estimates(plant, healthy, inputs)
    np.testing.assert_allclose(x, x_known, atol=1e-10)
    np.testing.assert_array_equal(P, P_known)


def test_a_missing_component_is_one_of_no_weight() -> None:
    plant, z, times, inputs = irregular()
    R = at(plant.R, 0) * np.ones((len(z), 1, 1))
    R[:, 0, 1] = R[:, 1, 0] = 0.0
    blind = R.copy()
    gone = np.argwhere(np.isnan(z))
    for k, c in gone:
        blind[k, c, c] = 1e14
    given = Plant(plant.A, plant.H, plant.Q, R, plant.x0, plant.P0)
    other = Plant(plant.A, plant.H, plant.Q, blind, plant.x0, plant.P0)
    found = drift.dense(given, z, times, inputs).gradient
    known = drift.dense(other, np.nan_to_num(z), times, inputs).gradient
    np.testing.assert_allclose(found[~np.isnan(z)], known[~np.isnan(z)], rtol=1e-7, atol=1e-9)


LOGGED = (
    sensors.Sensor("wheel", np.array([1.0, 0.0]), 0.3, bias_sigma=0.5, bias_time=8.0),
    sensors.Sensor("radar", np.array([1.0, 0.0]), 0.5, latency=0.25),
    sensors.Sensor("gps", np.array([1.0, 0.1]), 0.2, bias_sigma=0.2),
)


@pytest.mark.parametrize("order", [2, 3])
@pytest.mark.parametrize("dt", [0.0, 1e-3, 1.0, 60.0])
def test_integrator_chain_is_van_loans(order: int, dt: float) -> None:
    F, Q, _ = models.van_loan(models.integrator_chain(order, 0.3), dt)
    found = drift.integrator_chain(order, 0.3)(dt)
    np.testing.assert_allclose(found[0], F, rtol=1e-13, atol=1e-15)
    np.testing.assert_allclose(found[1], Q, rtol=1e-11, atol=1e-30)


@pytest.mark.parametrize("start", [None, 0.0, -3.0])
def test_log_has_the_likelihood_of_the_filter(start: float | None) -> None:
    """Of ``oracle.sensors``; rows in any order, one that is no number, latency, bias states."""
    rng = np.random.default_rng(5)
    rows = [(round(t, 3), int(rng.integers(3)), 20.0 + float(rng.normal()))
            for t in rng.permutation(rng.uniform(0.5, 9.0, 40))]  # fmt: skip
    transition = drift.integrator_chain(2, 0.3)
    x0, P0 = np.array([20.0, 0.1]), np.diag([4.0, 0.5])
    first = min(t - LOGGED[i].latency for t, i, _ in rows) if start is None else start
    known = sensors.run(transition, LOGGED, x0, P0, rows, [20.0], first)
    rows.insert(7, (3.0, 1, np.nan))
    found = drift.dense_log(transition, LOGGED, x0, P0, rows, start)
    assert found.log_likelihood == pytest.approx(known.log_likelihood, rel=1e-11)
    assert found.nis.sum() == pytest.approx(known.sse.sum(), rel=1e-11)

    def inconsistency(values: Array) -> float:
        moved = [(t, i, v) for (t, i, _), v in zip(rows, values.tolist(), strict=True)]
        moved = [row for row in moved if not np.isnan(row[2])]
        run = sensors.run(transition, LOGGED, x0, P0, moved, [20.0], first)
        return -2.0 * run.log_likelihood

    values = np.array([v for _, _, v in rows])
    slopes = drift.differences(inconsistency, values)
    np.testing.assert_allclose(found.gradient, slopes, rtol=1e-8, atol=1e-10)


def test_log_measures_at_the_time_of_validity() -> None:
    rows = [(1.0, 0, 20.0), (1.1, 1, 20.0), (1.2, 2, 20.0), (1.3, 1, 20.0)]
    d = drift.dense_log(drift.integrator_chain(2, 0.3), LOGGED, np.zeros(2), np.eye(2), rows)
    assert d.time.tolist() == pytest.approx([0.85, 1.0, 1.05, 1.2])
    assert d.channel.tolist() == [1, 0, 1, 2]
    assert d.slot.tolist() == [1, 0, 3, 2]
    assert profiles.candidates(d, np.array([0.0, 1.0, 0.0])).tolist() == [0.85, 1.05]
