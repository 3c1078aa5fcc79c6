"""What is certified holds: between the samples, and in the rates of alarms.

A sampled maximum is not a supremum (mathematics, section 5): with few samples the sampled bound is
passed between them, and the certified one never.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Literal

import numpy as np
import pytest

import surefix as sf
from oracle import raim_affine as oracle
from oracle import raim_distributions as distributions
from oracle.raim_linear import Linear
from oracle.step import Array
from raim import sine

ALPHA = 1e-2  # so that 40,000 epochs hold 400 alarms
EPOCHS = 40_000
CLOCK = np.ones((8, 1))
FITS: tuple[Literal["least-squares", "minimax"], ...] = ("least-squares", "minimax")


def model(
    amplitude: float, points: int, fit: Literal["least-squares", "minimax"], low: float = 0.0,
    high: float = 1.0,
) -> sf.raim.AffineModel:  # fmt: skip
    return sf.raim.affine_bound(
        sine.distances(amplitude), low, high, noise=sine.SIGMA, linear=CLOCK, fit=fit,
        points=points, bend=sine.bend(amplitude),
    )  # fmt: skip


def errors(found: sf.raim.AffineModel, amplitude: float, X: Array) -> tuple[Array, Array]:
    """|E_i| (k, 8) and ||W L^-1 E|| (k,) at X (k, 1)."""
    E = oracle.Affine(found.A, found.B).error(X, sine.distances(amplitude)(X))
    return np.abs(E), oracle.disturbance(np.column_stack([found.A, CLOCK]), sine.SIGMA, E)


@pytest.mark.parametrize("fit", FITS)
@pytest.mark.parametrize("points", [6, 50])
def test_a_million_places_are_inside(fit: Literal["least-squares", "minimax"], points: int) -> None:
    """The rounding of distances, 4e-9 m, is let pass."""
    rng = np.random.RandomState(1)
    found = model(10.0, points, fit)
    assert found.rho_bound is not None
    assert found.tight_bound is not None
    assert found.loose_bound is not None
    largest, disturbed = np.zeros(8), 0.0
    for _ in range(4 if points == 6 else 1):  # a million of the few samples
        E, d = errors(found, 10.0, rng.uniform(size=(250_000, 1)))
        largest, disturbed = np.maximum(largest, E.max(axis=0)), max(disturbed, float(d.max()))
    assert np.all(largest <= found.rho_bound + 1e-8)
    assert disturbed <= found.tight_bound + 1e-8
    assert found.tight <= found.loose <= found.loose_bound
    assert found.tight <= found.tight_bound
    if points == 6:  # what the certificate is for
        assert np.any(largest > found.rho * (1 + 1e-3))


def test_two_dimensions() -> None:
    """h = cos x + sin(2 y) x and others: second derivatives in x and y alone count."""

    def h(X: Array) -> Array:
        x, y = X.T
        return np.stack([np.cos(3 * x) + x * np.sin(2 * y), np.cos(x + y), x * y, y**3], axis=1)

    low, high = np.array([-1.0, 0.0]), np.array([1.0, 2.0])
    bend = np.array([[9.0, 4.0], [1.0, 1.0], [0.0, 0.0], [0.0, 12.0]])
    found = sf.raim.affine_bound(h, low, high, noise=0.3, points=9, bend=bend)
    X = low + (high - low) * np.random.RandomState(2).uniform(size=(200_000, 2))
    E = oracle.Affine(found.A, found.B).error(X, h(X))
    assert found.rho_bound is not None
    assert found.tight_bound is not None
    assert np.all(np.abs(E).max(axis=0) <= found.rho_bound)
    assert oracle.disturbance(found.A, 0.3, E).max() <= found.tight_bound


def test_more_samples_are_more_certain() -> None:
    """The best fit to some places has no more error there than the best fit to all, whose error is
    no more than any other's: the least possible error is between rho and its bound."""
    models = [model(10.0, points, "minimax") for points in (11, 101, 1001)]
    for few, many in pairwise(models):
        assert few.rho_bound is not None
        assert many.rho_bound is not None
        assert np.all(few.rho <= many.rho * (1 + 1e-9) + 1e-8)
        assert np.all(many.rho <= few.rho_bound)
        assert np.all(many.rho_bound - many.rho < 0.02 * (few.rho_bound - few.rho))


def test_shorter_interval_loses_less() -> None:
    """The error goes with the square of the length, as long as the track is a parabola there."""
    lengths = (0.02, 0.04)
    bounds = [model(10.0, 101, "minimax", 0.24, 0.24 + d).tight for d in lengths]
    assert bounds[1] / bounds[0] == pytest.approx(4.0, rel=0.1)


@pytest.mark.parametrize("amplitude", [2.0, 10.0])
@pytest.mark.parametrize("faulty", [False, True])
def test_measured_power_is_between_the_bounds(amplitude: float, faulty: bool) -> None:
    """Drawn at the place that disturbs most, and anywhere: within five binomial deviations."""
    found = model(amplitude, 201, "minimax")
    rng = np.random.RandomState(3)
    H = np.column_stack([found.A, CLOCK])
    bias = 30.0 * np.eye(8)[2] if faulty else np.zeros(8)
    lam = float(Linear(H, None, sine.SIGMA).statistic(bias))
    low, high = (float(b) for b in found.power_bounds(lam, ALPHA))
    rounding = 1.0 + 1e-12
    assert low / rounding <= float(distributions.power(lam, 6, ALPHA)) <= high * rounding
    X = np.linspace(0.0, 1.0, 5001)[:, None]
    worst = X[np.argmax(errors(found, amplitude, X)[1])]
    for places in (np.tile(worst, (EPOCHS, 1)), rng.uniform(size=(EPOCHS, 1))):
        noise = sine.SIGMA * rng.normal(size=(EPOCHS, 8))
        clock = rng.uniform(-3e4, 3e4, (EPOCHS, 1))
        Y = sine.distances(amplitude)(places) + clock + noise + bias
        test = sf.raim.LinearTest(H, noise=sine.SIGMA, false_alarm=ALPHA)
        rate = float(np.mean(test.run(Y - found.B).alarm))
        deviation = 5.0 * np.sqrt(max(rate, 1.0 / EPOCHS) * (1.0 - rate) / EPOCHS)
        assert low - deviation <= rate <= high + deviation
    if not faulty and amplitude == 10.0:
        # and the bend of the track is seen: these bounds are not wide for nothing
        Y = sine.distances(amplitude)(np.tile(worst, (EPOCHS, 1))) - found.B
        Y += sine.SIGMA * rng.normal(size=(EPOCHS, 8))
        assert np.mean(test.run(Y).alarm) > 1.2 * ALPHA
