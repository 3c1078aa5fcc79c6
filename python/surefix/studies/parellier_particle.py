"""Parellier, Barrau & Bonnabel 2023, section IV: a particle whose acceleration is known.

(23), (24) with Δt = 1, Q = diag(1e-8, 1e-4), R = 1.5, N = 100; measurements count from 1, as in the
paper. It tells neither what is known of x_0 (here: mean 0, variance ``prior`` · I) nor the
accelerations (here: ``PUSHES`` in all runs; the filter knows them).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import surefix as sf
from surefix.core.checks import FloatArray

N = 100
COUNT: FloatArray = np.arange(1.0, N + 1)
F = np.array([[1.0, 1.0], [0.0, 1.0]])
Q = np.diag([1e-8, 1e-4])
R = 1.5
PRIOR = 1.0
EVERY, PUSHES = 20, (2.0, -3.0, 1.5, 2.5, -2.0)  # samples from one large acceleration to the next

PAPER_SLOPE, PAPER_ONSET = 0.1, 39  # (25)
PAPER_AMPLITUDE, PAPER_CYCLES = 2.5, N / (4 * np.pi)  # 2.5 sin(k / 2)


@dataclass(frozen=True, eq=False)
class Flights:
    """``state`` (runs, N, 2), its known part ``known`` (N, 2), and the measured position ``z``
    (runs, N)."""

    state: FloatArray
    known: FloatArray
    z: FloatArray


def accelerations() -> FloatArray:
    """(N,): a_0 to a_99."""
    a = np.zeros(N)
    a[::EVERY] = PUSHES
    return a


def system(prior: float = PRIOR, push: float | None = None) -> sf.LinearSystem:
    """From measurement 1 on; ``push``: a_0, None: the one there is."""
    first = accelerations()[0] if push is None else push
    P1 = prior * F @ F.T + Q
    x1 = np.array([0.0, first])
    return sf.LinearSystem(
        A=F, H=np.array([[1.0, 0.0]]), Q=Q, R=np.array([[R]]), x0=x1, P0=P1,
        states=("position", "velocity"),
    )  # fmt: skip


def fly(runs: int, seed: int, prior: float = PRIOR) -> Flights:
    """Runs with no fault."""
    random = np.random.RandomState(seed)
    a = accelerations()
    known, part = np.zeros((N, 2)), np.zeros(2)
    state, x = np.empty((runs, N, 2)), np.sqrt(prior) * random.normal(size=(runs, 2))
    for k in range(N):
        part = F @ part + np.array([0.0, a[k]])
        x = x @ F.T + random.normal(size=(runs, 2)) * np.sqrt(np.diag(Q))
        known[k], state[:, k] = part, part + x
    z = state[:, :, 0] + np.sqrt(R) * random.normal(size=(runs, N))
    return Flights(state, known, z)


def ramp(slope: float, onset: int) -> FloatArray:
    """(25): ``slope`` already at sample ``onset``."""
    result: FloatArray = slope * np.maximum(0.0, COUNT - onset + 1)
    return result


def sine(amplitude: float, phase: FloatArray | float = 0.0) -> FloatArray:
    """(N,), or (runs, N): amplitude sin(k / 2 + phase)."""
    argument = 2 * np.pi * PAPER_CYCLES / N * COUNT + np.asarray(phase)[..., None]
    result: FloatArray = amplitude * np.sin(argument)
    return result


def record(z: FloatArray, prior: float = PRIOR) -> sf.ForwardRecord:
    """One pass of the filter over z (runs, N)."""
    inputs = np.stack([np.zeros(N - 1), accelerations()[1:]], axis=1)
    return sf.ForwardRecord(system(prior), z[..., None], times=COUNT, inputs=inputs)


def estimates(flights: Flights) -> FloatArray:
    """(runs, N, 2): the Kalman filter's."""
    moving = system(push=0.0)
    around = sf.GenieFilter(moving).run((flights.z - flights.known[:, 0])[:, :, None]).x
    result: FloatArray = around + flights.known
    return result
