"""Simulated runs of a scenario: modes, truth and readings."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

import surefix as sf
from surefix.core.checks import FloatArray
from surefix.validation.importance import Proposal, chains, draw_modes
from surefix.validation.scenario import Modes, Scenario

Flags = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Runs:
    """N runs. ``value`` (N, R) of the readings in the order of ``Scenario.schedule``; ``truth``
    (N,): the speed at the end; ``modes`` (N, chains, T)."""

    value: FloatArray
    truth: FloatArray
    modes: Modes


def joined(parts: Sequence[Runs]) -> Runs:
    """All runs of several parts."""
    return Runs(
        np.concatenate([part.value for part in parts]),
        np.concatenate([part.truth for part in parts]),
        np.concatenate([part.modes for part in parts]),
    )


def simulate(
    scenario: Scenario, proposal: Proposal, runs: int, random: np.random.RandomState
) -> Runs:
    """Runs with modes from ``proposal``, and all else as in the scenario."""
    modes = draw_modes(chains(scenario, proposal), runs, random)
    model, biases = scenario.model, scenario.biases()
    n, schedule = model.size, scenario.schedule()
    x = np.array(scenario.x0) + np.sqrt(scenario.P0) * random.normal(size=(runs, n))
    bias = np.zeros((runs, len(biases)))
    value, now, i = np.empty((runs, len(schedule))), 0.0, 0

    def move(x: FloatArray, active: Flags, dt: float) -> FloatArray:
        if dt <= 0:
            return x
        F, Q = model.transition(dt)
        for j, state in enumerate(biases):
            bias[:, j] += active[:, j] * state.walk * math.sqrt(dt) * random.normal(size=runs)
        moved: FloatArray = x @ F.T + random.normal(size=(runs, n)) @ np.linalg.cholesky(Q).T
        return moved

    before = np.zeros((runs, len(biases)), dtype=bool)
    for k, end in enumerate(scenario.times().tolist()):
        active = np.array([modes[:, b.chain, k] == b.mode for b in biases]).reshape(-1, runs).T
        for j, state in enumerate(biases):
            new = state.sigma * random.normal(size=runs)
            bias[:, j] = np.where(active[:, j] & ~before[:, j], new, bias[:, j]) * active[:, j]
        while i < len(schedule) and schedule[i][0] <= end:
            time, s = schedule[i]
            x = move(x, active, time - now)
            sensor, now = scenario.sensors[s], time
            shown = bias[:, [s in state.sensors for state in biases]].sum(axis=1)
            reading = x[:, model.output] + shown + sensor.sigma * random.normal(size=runs)
            for mode, fault in enumerate(sensor.faults, start=1):
                if isinstance(fault, sf.Outage):
                    any_value = scenario.centre + fault.span * random.uniform(-0.5, 0.5, size=runs)
                    reading = np.where(modes[:, s, k] == mode, any_value, reading)
            value[:, i] = reading
            i += 1
        x, now, before = move(x, active, end - now), end, active
    return Runs(value, x[:, model.output], modes)
