"""Every fault hypothesis of one step, and their mixture: Bilenne 2004, section 3, eqs. (28)-(32).

A hypothesis gives every sensor, or every measurement, a fault mode; its weight is its prior times
the joint density of all the values of the step (``fault_step``).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from oracle.fault_modes import Healthy, Outage
from oracle.fault_step import Evidence, FaultStep, evaluate
from oracle.mixture import Mixture, mixture
from oracle.step import Array


def per_sensor(step: FaultStep, log_prior: Array | None = None) -> Mixture:
    """All mode vectors (S,), the last sensor's mode running fastest (itertools.product).

    ``log_prior`` (number of vectors,) comes from a chain; None: the product of the sensors' priors.
    """
    labels = list(product(*(range(len(sensor.modes)) for sensor in step.sensors)))
    if log_prior is None:
        with np.errstate(divide="ignore"):
            log_p = [np.log(sensor.prior) for sensor in step.sensors]
        log_prior = np.array([sum(log_p[s][m] for s, m in enumerate(v)) for v in labels])
    evidence = []
    for vector in labels:
        modes = [step.sensors[s].modes[vector[s]] for _, s, _ in step.measurements]
        evidence.append(evaluate(step, modes))
    return _collect(labels, log_prior, evidence)


def per_measurement(step: FaultStep) -> Mixture:
    """All mode vectors (N,): each measurement is healthy or out on its own, with the sensor's
    prior. Sensors that know only these two modes make 2^N hypotheses."""
    owners = [step.sensors[s] for _, s, _ in step.measurements]
    if not all(isinstance(mode, Healthy | Outage) for o in owners for mode in o.modes):
        raise ValueError("a measurement of its own can only be healthy or out")
    labels = list(product(*(range(len(owner.modes)) for owner in owners)))
    with np.errstate(divide="ignore"):
        log_p = [np.log(owner.prior) for owner in owners]
    log_prior = np.array([float(sum(log_p[i][m] for i, m in enumerate(v))) for v in labels])
    evidence = [evaluate(step, [owners[i].modes[m] for i, m in enumerate(v)]) for v in labels]
    return _collect(labels, log_prior, evidence)


def _collect(
    labels: list[tuple[int, ...]], log_prior: Array, evidence: Sequence[Evidence]
) -> Mixture:
    return mixture(
        np.array(labels, dtype=np.int64).reshape(len(evidence), -1),
        log_prior + np.array([e.log_density for e in evidence]),
        np.array([e.x for e in evidence]),
        np.array([e.P for e in evidence]),
    )
