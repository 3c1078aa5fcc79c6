"""How far two answers differ, in units that mean something.

A difference between estimates is measured in standard deviations of the reference, a difference
between covariances as a difference of correlations: |dP_ij| / sqrt(P_ii P_jj). Neither depends on
the units of the states. Where the reference has no variance at all, only equality counts as none.
"""

from __future__ import annotations

import numpy as np

from oracle.step import Array

# A state that is known exactly has sigma = 0 and still a rounding error in x.
ROUNDING = 64 * float(np.finfo(np.float64).eps)


def state_error(x: Array, x_reference: Array, P_reference: Array) -> float:
    """Largest |dx_i| in standard deviations, less the few roundings of x that no one can avoid."""
    allowance = ROUNDING * np.max(np.abs(x_reference), initial=0.0)
    difference = np.maximum(np.abs(x - x_reference) - allowance, 0.0)
    return _largest(difference, np.sqrt(np.diag(P_reference)))


def covariance_error(P: Array, P_reference: Array) -> float:
    """Largest |dP_ij| over sqrt(P_ii P_jj) of the reference."""
    sigma = np.sqrt(np.diag(P_reference))
    return _largest(P - P_reference, np.outer(sigma, sigma))


def smallest_correlation(P: Array) -> float:
    """Smallest eigenvalue of P scaled to a unit diagonal: below zero, P is not a covariance."""
    sigma = np.sqrt(np.diag(P))
    unit = np.where(sigma > 0.0, sigma, 1.0)
    return float(np.min(np.linalg.eigvalsh(P / np.outer(unit, unit))))


def _largest(difference: Array, unit: Array) -> float:
    ratio = np.divide(
        np.abs(difference), unit, out=np.where(difference == 0.0, 0.0, np.inf), where=unit > 0.0
    )
    return float(np.max(ratio, initial=0.0))
