"""Numbers far from one: densities, overflow, modes that are almost impossible, long series."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import surefix as sf
from oracle.compare import covariance_error, state_error
from oracle.step import Array
from oracle.switching import Estimates, Plant
from oracle.switching_chain import Chain
from switching.plants import random_plant
from switching.scenes import (
    APPROXIMATIONS,
    FOUR,
    HEALTHY,
    ONE,
    SCALAR,
    arrays,
    assert_density,
    assert_equal,
    assert_same_bits,
    mode_chain,
    probability,
    system,
)

Both = tuple[Any, Callable[..., Estimates]]
both = pytest.mark.parametrize("both", APPROXIMATIONS.values(), ids=APPROXIMATIONS.keys())
FILTERS: dict[str, Any] = {
    "one step": sf.OneStepFilter, "imm": sf.IMMFilter, "genie": sf.GenieFilter
}  # fmt: skip
every = pytest.mark.parametrize("kind", FILTERS.values(), ids=FILTERS.keys())
runs = pytest.mark.parametrize("shape", [(), (1,), (8,)], ids=["single", "batch of 1", "of 8"])


def wide(scale: float) -> tuple[Plant, Array]:
    """Many components in units of ``scale``, some of the first step's missing."""
    plant = random_plant(1, 2, 32)
    plant = replace(
        plant, Q=scale * plant.Q, R=scale * np.eye(32), x0=np.zeros(2), P0=scale * plant.P0
    )
    z = np.sqrt(scale) * np.random.default_rng(1).normal(size=(2, 32))
    z[0, 3:12] = np.nan
    return plant, z


def log_joint(plant: Plant, z: Array) -> float:
    """Log-density of two measurements as one Gaussian."""
    B = np.vstack([np.eye(2), plant.A])
    X = B @ plant.P0 @ B.T
    X[2:, 2:] += plant.Q
    H = np.kron(np.eye(2), plant.H)
    seen = ~np.isnan(z.ravel())
    S = (H @ X @ H.T + np.kron(np.eye(2), plant.R))[np.ix_(seen, seen)]
    v = z.ravel()[seen]
    size = float(np.linalg.slogdet(2 * np.pi * S)[1])
    return -0.5 * (float(v @ np.linalg.solve(S, v)) + size)


@every
@pytest.mark.parametrize("scale", [1e-12, 1.0, 1e12])
def test_density_of_many_small_or_large_components(kind: Any, scale: float) -> None:
    plant, z = wide(scale)
    filter = kind(system(plant), mode_chain(HEALTHY))
    known = log_joint(plant, z)
    assert_density(filter.run(z), known)
    np.testing.assert_allclose(filter.run(np.array([z] * 8)).log_likelihood, known, rtol=1e-12)


@both
@pytest.mark.parametrize("scale", [1e-12, 1e12])
def test_modes_of_many_small_or_large_components(both: Both, scale: float) -> None:
    plant, z = wide(scale)
    assert_equal(both[0](system(plant), mode_chain(FOUR)).run(z), both[1](plant, FOUR, z))


@every
@runs
def test_a_covariance_that_overflows_is_refused(kind: Any, shape: tuple[int, ...]) -> None:
    """Not P = inf, also where nothing is measured."""
    filter = kind(system(replace(SCALAR, A=10.0 * ONE)), mode_chain(FOUR))
    with pytest.raises(sf.NumericalError, match="overflows"):
        filter.run(np.full((*shape, 700, 1), np.nan))


@runs
def test_a_row_whose_square_overflows_is_refused(shape: tuple[int, ...]) -> None:
    filter = sf.GenieFilter(system(replace(SCALAR, H=1e160 * ONE)))
    with pytest.raises(sf.NumericalError, match="overflows"):
        filter.run(np.zeros((*shape, 3, 1)))


@both
def test_what_is_impossible_in_a_lumped_mode_says_nothing(both: Both) -> None:
    """Its member without a share explains z = 40 far better than those that there are."""
    three = sf.ModeChain([(1, 1), (0, 1), (0, 1e6)], np.eye(3), [0.5, 0.5, 0.0])
    two = sf.ModeChain([(1, 1), (0, 1)], np.eye(2), [0.5, 0.5])
    z = np.zeros((6, 1))
    z[0] = 40.0
    found = both[0](system(SCALAR), three.lumped([[0], [1, 2]])).run(z)
    known = both[0](system(SCALAR), two).run(z)
    assert found.log_likelihood == pytest.approx(known.log_likelihood, rel=1e-14)
    np.testing.assert_allclose(probability(found), probability(known), rtol=1e-12, atol=1e-300)
    np.testing.assert_allclose(found.x, known.x, rtol=1e-13)


@pytest.mark.parametrize("delta", [1e6, 1e12])
@pytest.mark.parametrize("quiet", [1, 2, 4])
@both
def test_a_mode_that_the_width_of_its_noise_rules_out_comes_back(
    both: Both, quiet: int, delta: float
) -> None:
    """A quiet measurement takes a factor of delta^(-m/2), 1e-96 or 1e-192, on 1e-140."""
    chain = Chain(((1.0, 1.0), (1.0, delta)), np.eye(2), np.array([1.0 - 1e-140, 1e-140]))
    plant = replace(random_plant(1, 1, 32), R=np.eye(32))
    rng = np.random.default_rng(1)
    z = rng.choice([-1.0, 1.0], (quiet + 10, 32))
    z[:quiet] *= 0.1
    z[quiet:] *= np.sqrt(2.2 * np.log(delta))
    found = both[0](system(plant), mode_chain(chain)).run(z)
    assert_equal(found, both[1](plant, chain, z))
    assert probability(found)[quiet - 1, 1] < 1e-200
    assert probability(found)[-1, 1] > 0.999


def moving(steps: int, x0: float) -> tuple[sf.LinearSystem, sf.LinearSystem, Array]:
    """A constant velocity, the same with E x x' as its P0 about zero, and measurements."""
    dt, q, P0, start = 0.1, 0.2, np.diag([4.0, 1.0]), np.array([x0, 0.0])
    one: dict[str, Any] = {
        "A": np.array([[1.0, dt], [0.0, 1.0]]),
        "Q": q * np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]]),
        "H": np.array([[1.0, 0.0]]), "R": 0.25 * ONE,
    }  # fmt: skip
    rng = np.random.default_rng(1)
    speed = np.cumsum(np.sqrt(q * dt) * rng.normal(size=steps))
    z = x0 + np.cumsum(dt * speed)[:, None] + 0.5 * rng.normal(size=(steps, 1))
    plain = sf.LinearSystem(**one, x0=start, P0=P0)
    return plain, sf.LinearSystem(**one, x0=np.zeros(2), P0=P0 + np.outer(start, start)), z


@pytest.mark.parametrize("x0", [0.0, 1e6])
def test_without_faults_the_linear_filter_stays_the_kalman_filter(x0: float) -> None:
    """Its moments of x itself would drown its error's digits. A mean is to it a variance."""
    plain, widened, z = moving(10_000, x0)
    found = sf.LinearOptimalFilter(plain, mode_chain(HEALTHY)).run(z)
    known = sf.GenieFilter(widened).run(z)
    for k in (0, 1, 2, 10, 100, 1000, 9999):
        assert state_error(found.x[k], known.x[k], known.P[k]) <= 1e-12, k
        assert covariance_error(found.P[k], known.P[k]) <= 1e-12, k


def test_far_from_zero_the_linear_filter_has_an_answer() -> None:
    plain, _, z = moving(1000, 1e8)
    found = sf.LinearOptimalFilter(plain, mode_chain(HEALTHY)).run(z)
    assert np.isfinite(found.x).all()
    assert (np.diagonal(found.P, axis1=1, axis2=2) > 0).all()
    assert np.abs(found.x[-1, 0] - z[-1, 0]) < 5.0


@every
def test_more_threads_than_runs(kind: Any) -> None:
    filter = kind(system(SCALAR), mode_chain(FOUR))
    z = np.random.default_rng(1).normal(size=(5, 20, 1))
    for count in (1, 2, 5):
        assert_same_bits(filter.run(z[:count], threads=1024), filter.run(z[:count], threads=1))


@every
def test_runs_of_a_single_step(kind: Any) -> None:
    filter = kind(system(SCALAR), mode_chain(FOUR))
    z = np.array([0.3, np.nan, -40.0, 1e8, 0.0])[:, None, None]
    batch = filter.run(z)
    for i in range(len(z)):
        alone, one = filter.run(z[i]), filter.run(z[i : i + 1])
        for many, first, second in zip(arrays(batch), arrays(one), arrays(alone), strict=True):
            assert np.array_equal(many[i], first[0])
            assert np.array_equal(many[i], second)
