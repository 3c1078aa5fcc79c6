"""A sensor's drift as a state, and one step of Kalman's filter with such states.

The state is [system state (n,), one bias for every sensor that can drift (d,)]. A mode vector gives
every sensor a mode, which holds from the start of the step to its end. At that start a bias

- begins with variance b0^2, independent of everything, if its sensor enters a drifting mode;
- stays as it is, and walks with bq, if the sensor remains in the same drifting mode;
- becomes zero, exactly, if the sensor leaves it.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import TypeAlias

import numpy as np

from oracle.fault_modes import Drifting, FallibleSensor, log_removed, noise_variance
from oracle.fault_step import Measurement, Transition
from oracle.step import Array, symmetric

Vector: TypeAlias = tuple[int, ...]  # a mode for each sensor


class DriftStates:
    """Where the biases stand behind the n states of the system, and how they begin and end."""

    def __init__(self, sensors: Sequence[FallibleSensor], n: int) -> None:
        self.sensors, self.n = sensors, n
        can_drift = [
            s for s, o in enumerate(sensors) if any(isinstance(m, Drifting) for m in o.modes)
        ]
        self.column = {s: n + k for k, s in enumerate(can_drift)}
        self.size = n + len(can_drift)
        self.vectors = list(product(*(range(len(sensor.modes)) for sensor in sensors)))

    def enter(self, x: Array, P: Array, old: Vector | None, new: Vector) -> tuple[Array, Array]:
        """x and P as modes ``new`` begin; after ``old``, or at the start (None)."""
        x, P = x.copy(), P.copy()
        for s, j in self.column.items():
            mode = self.sensors[s].modes[new[s]]
            if isinstance(mode, Drifting) and old is not None and old[s] == new[s]:
                continue
            x[j] = P[j, :] = P[:, j] = 0.0
            if isinstance(mode, Drifting):
                P[j, j] = mode.b0**2
        return x, P

    def leg(self, model: Transition, vector: Vector, dt: float) -> tuple[Array, Array]:
        """F and Q (n + d, n + d)."""
        F, Q = np.eye(self.size), np.zeros((self.size, self.size))
        F[: self.n, : self.n], Q[: self.n, : self.n] = model(dt)
        for s, j in self.column.items():
            mode = self.sensors[s].modes[vector[s]]
            if isinstance(mode, Drifting):
                Q[j, j] = mode.bq**2 * dt
        return F, Q

    def row(self, s: int, drifting: bool) -> Array:
        """H (n + d,)."""
        H = np.zeros(self.size)
        H[: self.n] = self.sensors[s].h
        if drifting:
            H[self.column[s]] = 1.0
        return H


def kalman(
    model: Transition,
    layout: DriftStates,
    vector: Vector,
    measurements: Sequence[Measurement],
    last: Sequence[float | None],
    x: Array,
    P: Array,
    now: float,
    end: float,
) -> tuple[float, Array, Array]:
    """Kalman's filter from ``now`` to ``end`` with the modes ``vector``; log-density first."""
    log_density, previous = 0.0, list(last)
    for time, s, value in measurements:
        F, Q = layout.leg(model, vector, time - now)
        x, P, now = F @ x, F @ P @ F.T + Q, time
        sensor, mode = layout.sensors[s], layout.sensors[s].modes[vector[s]]
        removed = log_removed(mode, sensor.sigma, value, previous[s])
        previous[s] = value
        if removed is not None:
            log_density += removed
            continue
        H, r = layout.row(s, isinstance(mode, Drifting)), noise_variance(mode, sensor.sigma)
        nu, S = value - H @ x, H @ P @ H + r
        K = P @ H / S
        I_KH = np.eye(layout.size) - np.outer(K, H)
        x, P = x + K * nu, symmetric(I_KH @ P @ I_KH.T + r * np.outer(K, K))
        log_density -= float(0.5 * (np.log(2.0 * np.pi * S) + nu**2 / S))
    F, Q = layout.leg(model, vector, end - now)
    return log_density, F @ x, symmetric(F @ P @ F.T + Q)
