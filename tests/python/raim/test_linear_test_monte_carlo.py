"""How often the linear test alarms, by drawing data; rare events by drawing them more often.

Healthy noise is drawn with its part beside the nuisance s times too large, and counts for
s^k exp(-|z|^2 (1 - 1/s^2) / 2), z its whitened part; missed faults are drawn from a smaller fault
and count for the ratio of the two densities. Within five standard errors of the drawn mean, which
the draws give themselves.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

import surefix as sf
from oracle import raim_distributions as distributions
from oracle.raim_linear import Linear, covariance, pseudo_inverse
from oracle.step import Array

DRAWS = 100_000
ERRORS = 5.0


@dataclass(frozen=True)
class Drawn:
    H: Array
    M: Array | None
    noise: Array

    @property
    def oracle(self) -> Linear:
        return Linear(self.H, self.M, self.noise)

    @property
    def beside(self) -> Array:
        """Projection of whitened data, (n, n), on what M adds beside H."""
        PM = self.oracle.seen
        return PM @ pseudo_inverse(PM)

    def run(self, white: Array, false_alarm: float) -> Array:
        """Whether there is an alarm (draws,) of whitened data (draws, n) and some nuisance."""
        root = np.linalg.inv(self.oracle.root)
        Y = white @ root + self.H @ np.ones(self.H.shape[1])
        test = sf.raim.LinearTest(self.H, self.M, noise=self.noise, false_alarm=false_alarm)
        return np.asarray(test.run(Y).alarm)


def drawn(columns: int | None) -> Drawn:
    rng = np.random.RandomState(5)
    n, B = 8, rng.normal(size=(8, 8))
    M = None if columns is None else rng.normal(size=(n, columns))
    return Drawn(rng.normal(size=(n, 2)), M, covariance(B @ B.T + np.eye(n), n))


def agrees(weights: Array, known: float) -> None:
    error = weights.std() / np.sqrt(len(weights))
    assert error < 0.1 * known  # or there was nothing to see
    assert abs(weights.mean() - known) < ERRORS * error


@pytest.mark.parametrize("columns", [None, 1, 3])
@pytest.mark.parametrize("false_alarm", [1e-2, 1e-3, 1e-4, 1e-5])
def test_false_alarms(columns: int | None, false_alarm: float) -> None:
    d = drawn(columns)
    k = d.oracle.degrees
    white = np.random.RandomState(6).normal(size=(DRAWS, 8))
    s = max(1.0, 0.8 * np.sqrt(float(distributions.threshold(false_alarm, k)) / k))
    part = white @ d.beside
    alarm = d.run(white + (s - 1.0) * part, false_alarm)
    z = s**2 * np.sum(part**2, axis=1)
    agrees(np.where(alarm, s**k * np.exp(-0.5 * z * (1.0 - s**-2)), 0.0), false_alarm)


@pytest.mark.parametrize("columns", [None, 1, 3])
@pytest.mark.parametrize("missed", [0.7, 1e-2, 1e-5])
def test_missed_faults(columns: int | None, missed: float) -> None:
    d = drawn(columns)
    k = d.oracle.degrees
    rng = np.random.RandomState(7)
    direction = d.beside @ rng.normal(size=8)
    lam = float(distributions.noncentrality(missed, k, 1e-5))
    mean = np.sqrt(lam) * direction / np.linalg.norm(direction)
    h = float(distributions.threshold(1e-5, k))
    c = min(1.0, np.sqrt(h / lam))  # on the sphere of the threshold
    white = c * mean + rng.normal(size=(DRAWS, 8))
    quiet = np.logical_not(d.run(white, 1e-5))
    shift = (1.0 - c) * mean
    ratio = np.exp((white - c * mean) @ shift - 0.5 * shift @ shift)
    agrees(np.where(quiet, ratio, 0.0), missed)
    test = sf.raim.LinearTest(d.H, d.M, noise=d.noise)
    bias = mean @ np.linalg.inv(d.oracle.root)
    assert test.missed(bias) == pytest.approx(missed, rel=1e-8)
    assert test.minimum_detectable(bias, missed=missed) == pytest.approx(1.0, rel=1e-8)
