"""A mixture of Gaussians, its weights in the log domain: Bilenne 2004, eqs. (28)-(32)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from oracle.step import Array, symmetric


@dataclass(frozen=True)
class Mixture:
    """R components in a state of n dimensions, and what they say together.

    A label is a vector of p modes, 0 being healthy: one for each sensor, or for each measurement.
    """

    labels: NDArray[np.int64]  # (R, p)
    log_weight: Array  # (R,) log p(h_i | z), normalised; -inf where the prior is zero
    xs: Array  # (R, n) estimates, eq. (28)
    Ps: Array  # (R, n, n) covariances, eq. (29)
    log_evidence: float  # log sum_i p(h_i) p(z | h_i)
    x: Array  # (n,) mean, eq. (30)
    P: Array  # (n, n) covariance, eq. (31)
    fault_probability: Array  # (p,) that the mode is not 0
    map: int  # index of the most probable component; the first of several

    @property
    def weight(self) -> Array:
        """p(h_i | z), (R,)."""
        return np.exp(self.log_weight)


def mixture(labels: NDArray[np.int64], log_joint: Array, xs: Array, Ps: Array) -> Mixture:
    """From log p(h_i) + log p(z | h_i), (R,), and the components' estimates."""
    log_evidence = float(logsumexp(log_joint))
    if not np.isfinite(log_evidence):
        raise ValueError("no hypothesis is possible")
    log_weight = log_joint - log_evidence
    weight = np.exp(log_weight)
    x = weight @ xs
    Delta = np.einsum("ri,rj->rij", xs - x, xs - x)  # (32)
    P = symmetric(np.einsum("r,rij->ij", weight, Ps + Delta))  # (31)
    return Mixture(
        labels=labels,
        log_weight=log_weight,
        xs=xs,
        Ps=Ps,
        log_evidence=log_evidence,
        x=x,
        P=P,
        fault_probability=weight @ (labels != 0).astype(np.float64),
        map=int(np.argmax(log_weight)),
    )
