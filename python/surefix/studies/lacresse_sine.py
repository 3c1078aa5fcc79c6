"""The sine track of Lacresse, Grall & Nikiforov 2005, section 5.3, and affine models of the
distances to the satellites from it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from surefix.core.checks import FloatArray
from surefix.raim.affine import AffineModel, affine_bound
from surefix.studies.lacresse_sky import Sky

KD = 1000.0  # k_d [m], of one period
SIGMA = 5.0  # σ_i [m], of every pseudorange
ALPHA, GAMMA = 1e-5, 1e-3  # of the paper
EAST = 90.0  # heading of the x-axis, from north over east [degrees]
POINTS = 401  # of K at which the distances are sampled


@dataclass(frozen=True)
class SineTrack:
    """x = k_d l, y = v sin(2πl), z constant, for l in K = [0, 1], in the horizontal plane of a
    receiver at l = 0. ``amplitude``: v [m]; ``heading``: of x, from north over east [degrees]; y is
    to the left of it."""

    sky: Sky
    amplitude: float
    heading: float = EAST

    @property
    def satellites(self) -> FloatArray:
        """(n, 3) [m], in the track's x, y and z."""
        turn = np.radians(self.heading)
        forward = np.array([np.sin(turn), np.cos(turn), 0.0])
        left = np.array([-np.cos(turn), np.sin(turn), 0.0])
        axes = np.array([forward, left, [0.0, 0.0, 1.0]])
        return np.asarray(self.sky.satellites @ axes.T)

    def position(self, l: FloatArray) -> FloatArray:  # noqa: E741
        """(k, 3) [m] of l (k,)."""
        return np.stack([KD * l, self.amplitude * np.sin(2 * np.pi * l), 0.0 * l], axis=1)

    def distances(self, X: FloatArray) -> FloatArray:
        """D (k, n) [m] of X = l (k, 1), less the distances from the origin, which B would take."""
        to = self.satellites - self.position(X[:, 0])[:, None]
        ranges = np.linalg.norm(to, axis=2)
        return np.asarray(ranges - np.linalg.norm(self.satellites, axis=1))

    @property
    def bend(self) -> FloatArray:
        """(n, 1): bound on |d''| = |(‖c'‖² - (u·c')²)/d - u·c''| over K, c the track and u the
        direction to the satellite: ‖c'‖²/d + |u_y| ‖c''‖."""
        rate = 2 * np.pi * abs(self.amplitude)
        reach = KD + abs(self.amplitude)  # how far from the origin the track comes at most
        nearest = np.linalg.norm(self.satellites, axis=1) - reach
        sideways = (np.abs(self.satellites[:, 1]) + abs(self.amplitude)) / nearest
        bound = (KD**2 + rate**2) / nearest + np.minimum(sideways, 1.0) * 2 * np.pi * rate
        return np.asarray(bound[:, None])

    def model(
        self, fit: str = "least-squares", low: float = 0.0, high: float = 1.0, points: int = POINTS
    ) -> AffineModel:
        """D ≈ A l + B over K, or a part of it, and its test with the clocks, which are linear, as
        further columns; bounds certified between the samples."""
        return affine_bound(self.distances, low, high, fit=fit, points=points, **self.options)

    @property
    def options(self) -> dict[str, Any]:
        """Of ``affine_bound`` and ``split``."""
        return {
            "noise": SIGMA, "linear": self.sky.clocks, "bend": self.bend, "false_alarm": ALPHA
        }  # fmt: skip
