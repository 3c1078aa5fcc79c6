"""The estimate of the measurement noise itself: Bilenne 2004, section 2.2, eqs. (25)-(27)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from oracle.step import Array, Posterior, log_determinant, solve, symmetric


@dataclass(frozen=True)
class NoiseEstimate:
    """What the innovations of one step say about its measurement noise."""

    v: Array  # (M,) estimate of the noise, eq. (25)
    covariance: Array  # (M, M) covariance of that estimate when nothing fails, eq. (26)
    normalised: Array  # (M,) v_i over its standard deviation: standard normal when nothing fails
    sse: float  # sum of squared errors, eq. (27): chi-square of ``dof`` when nothing fails
    dof: int  # M
    log_likelihood: float  # log N(gamma; 0, Gamma)


def noise_estimate(posterior: Posterior, Upsilon: Array) -> NoiseEstimate:
    """Eqs. (25)-(27) from gamma (M,), Gamma (M, M) of a step and its Upsilon (M, M)."""
    gamma, Gamma = posterior.gamma, posterior.Gamma
    v = Upsilon @ solve(Gamma, gamma)
    covariance = symmetric(Upsilon @ solve(Gamma, Upsilon.T))
    # v' (Upsilon Gamma^-1 Upsilon)^-1 v without the outer inverse
    sse = float(gamma @ solve(Gamma, gamma))
    log_likelihood = -0.5 * (gamma.size * np.log(2.0 * np.pi) + log_determinant(Gamma) + sse)
    normalised = v / np.sqrt(np.diag(covariance))
    return NoiseEstimate(v, covariance, normalised, sse, gamma.size, float(log_likelihood))
