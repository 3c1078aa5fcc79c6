"""The mixture that carries drifts from step to step, with nothing cut and nothing merged.

A component is a whole history of mode vectors, one for each step, with its own Gaussian of system
state and biases (``drift_states``). In every step each component branches into all mode vectors,
with the chain's transition over the length of the step. There are R^k components after k steps:
this is for small cases.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from oracle.drift_states import DriftStates, Vector, kalman
from oracle.fault_modes import FallibleSensor
from oracle.fault_step import Measurement, Transition
from oracle.mixture import Mixture, mixture
from oracle.mode_chain import transition as chain_transition
from oracle.step import Array


@dataclass(frozen=True)
class Component:
    """One history. The first mode vector is that of the start, before any step."""

    path: tuple[Vector, ...]  # k + 1 after k steps
    log_joint: float  # log p(path) + log p(all the values | path)
    x: Array  # (n + d,)
    P: Array  # (n + d, n + d)


@dataclass(frozen=True)
class Carried:
    """The exact posterior at one estimation time; log_evidence is of all the values since start."""

    time: float  # s
    components: list[Component]
    mixture: Mixture  # its labels are the modes of the last step


def run(
    model: Transition,
    sensors: Sequence[FallibleSensor],
    generator: Array,
    x0: Array,
    P0: Array,
    log: Sequence[Measurement],
    times: Sequence[float],
    start: float = 0.0,
    initial: Array | None = None,
) -> list[Carried]:
    """The posterior at each of ``times``, from x0 (n,) and P0 (n, n) at ``start``.

    ``generator`` (R, R) is that of the joint chain and ``initial`` (R,) the probability of each
    mode vector at ``start``; None: all healthy. The modes of a step are those that the chain has
    reached by its end. ``log`` is in the order of time; a measurement at an estimation time belongs
    to the step that ends there.
    """
    layout = DriftStates(sensors, len(x0))
    x, P = np.zeros(layout.size), np.zeros((layout.size, layout.size))
    x[: layout.n], P[: layout.n, : layout.n] = x0, P0
    p0 = np.eye(len(layout.vectors))[0] if initial is None else initial
    components = [
        Component((vector,), float(np.log(p)), *layout.enter(x, P, None, vector))
        for vector, p in zip(layout.vectors, p0, strict=True)
        if p > 0.0
    ]
    last: list[float | None] = [None] * len(sensors)
    pending = [measurement for measurement in log if measurement[0] >= start]
    results, now = [], start
    for end in times:
        in_step = [measurement for measurement in pending if measurement[0] <= end]
        pending = pending[len(in_step) :]
        T = chain_transition(generator, end - now)
        children = []
        for parent in components:
            old = parent.path[-1]
            for vector, p in zip(layout.vectors, T[layout.vectors.index(old)], strict=True):
                if p > 0.0:  # what the chain cannot do is no component
                    x, P = layout.enter(parent.x, parent.P, old, vector)
                    log_z, x, P = kalman(model, layout, vector, in_step, last, x, P, now, end)
                    log_joint = parent.log_joint + float(np.log(p)) + log_z
                    children.append(Component((*parent.path, vector), log_joint, x, P))
        for _, s, value in in_step:
            last[s] = value
        components, now = children, end
        results.append(Carried(end, components, _mixture(components)))
    return results


def _mixture(components: Sequence[Component]) -> Mixture:
    return mixture(
        np.array([c.path[-1] for c in components], dtype=np.int64),
        np.array([c.log_joint for c in components]),
        np.array([c.x for c in components]),
        np.array([c.P for c in components]),
    )
