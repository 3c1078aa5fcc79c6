"""One step under one fault hypothesis, as one composite Gaussian: mathematics, section 2.

A hypothesis gives every measurement a fault mode. Its evidence is the joint density of all the
values of the step: the values that stay are N(z - HF x; 0, Gamma) at once, by one Cholesky factor,
and the removed ones have densities of their own. No measurement updates anything on the way, so
this is no Kalman filter in disguise.

A drifting sensor is written in two ways that must agree: its bias as coloured noise,
Upsilon += b0^2 11' + bq^2 min(tau_i, tau_j), tau counted from the start of the step, or as a state
of variance b0^2 that walks.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from oracle.fault_modes import Drifting, FallibleSensor, Mode, log_removed, noise_variance
from oracle.step import Array, block_diagonal, symmetric

Transition: TypeAlias = Callable[[float], tuple[Array, Array]]  # dt in s -> F (n, n), Q (n, n)
Measurement: TypeAlias = tuple[float, int, float]  # time in s, sensor, value


@dataclass(frozen=True)
class FaultStep:
    """One step from t0 to t1, in seconds, and the N measurements in it, in the order of time."""

    t0: float
    t1: float
    x: Array  # (n,) estimate at t0
    P: Array  # (n, n) its covariance
    transition: Transition
    sensors: tuple[FallibleSensor, ...]  # S
    measurements: tuple[Measurement, ...]  # N, of times t0 <= t <= t1
    last: tuple[float | None, ...] = ()  # S: each sensor's last value before the step; (): none

    def __post_init__(self) -> None:
        times = [self.t0, *(time for time, _, _ in self.measurements), self.t1]
        if times != sorted(times):
            raise ValueError("the measurements must be in order of time, within the step")


@dataclass(frozen=True)
class Evidence:
    """One hypothesis: how probable it makes the values, and the estimate at t1 that it implies."""

    log_density: float  # of all N values
    x: Array  # (n,), or (n + d,) with the d biases behind
    P: Array  # (n, n), or (n + d, n + d)
    noise: Array  # (N,) the white noise's estimate, eq. (25); NaN for values that were removed
    noise_variance: Array  # (N,) of that estimate, eq. (26)


def evaluate(step: FaultStep, modes: Sequence[Mode]) -> Evidence:
    """``modes`` holds one mode for each measurement; a drift is drawn anew at t0, as noise."""
    kept, log_density = _split(step, modes)
    rows = np.array([step.sensors[step.measurements[i][1]].h for i in kept])
    white = _white(step, modes, kept)
    Upsilon = white.copy()
    for a, i in enumerate(kept):
        for b, j in enumerate(kept):
            (time_i, sensor_i, _), (time_j, sensor_j, _) = (
                step.measurements[i],
                step.measurements[j],
            )
            mode = modes[i]
            if isinstance(mode, Drifting) and sensor_i == sensor_j:
                Upsilon[a, b] += mode.b0**2 + mode.bq**2 * (min(time_i, time_j) - step.t0)
    return _condition(
        step, step.transition, step.x, step.P, rows, Upsilon, white, kept, log_density
    )


def evaluate_with_biases(step: FaultStep, sensor_modes: Sequence[Mode]) -> Evidence:
    """``sensor_modes`` holds one mode for each sensor; the bias of every drifting one is a state.

    The d biases stand behind the state in the order of their sensors, whether measured or not.
    """
    n = len(step.x)
    drifts = {s: mode for s, mode in enumerate(sensor_modes) if isinstance(mode, Drifting)}
    column = {s: n + k for k, s in enumerate(drifts)}

    def transition(dt: float) -> tuple[Array, Array]:
        F, Q = step.transition(dt)
        walk = np.diag([mode.bq**2 * dt for mode in drifts.values()])
        return block_diagonal([F, np.eye(len(drifts))]), block_diagonal([Q, walk])

    modes = [sensor_modes[s] for _, s, _ in step.measurements]
    kept, log_density = _split(step, modes)
    rows = np.zeros((len(kept), n + len(drifts)))
    for a, i in enumerate(kept):
        s = step.measurements[i][1]
        rows[a, :n] = step.sensors[s].h
        if s in column:
            rows[a, column[s]] = 1.0
    x = np.concatenate([step.x, np.zeros(len(drifts))])
    P = block_diagonal([step.P, np.diag([mode.b0**2 for mode in drifts.values()])])
    white = _white(step, modes, kept)
    return _condition(step, transition, x, P, rows, white, white, kept, log_density)


def _split(step: FaultStep, modes: Sequence[Mode]) -> tuple[list[int], float]:
    """Which measurements stay in the step, and the log-density of the others."""
    last = list(step.last or (None,) * len(step.sensors))
    kept, log_density = [], 0.0
    for i, (_, s, value) in enumerate(step.measurements):
        removed = log_removed(modes[i], step.sensors[s].sigma, value, last[s])
        last[s] = value
        if removed is None:
            kept.append(i)
        else:
            log_density += removed
    return kept, log_density


def _white(step: FaultStep, modes: Sequence[Mode], kept: Sequence[int]) -> Array:
    sigmas = [step.sensors[step.measurements[i][1]].sigma for i in kept]
    return np.diag([noise_variance(modes[i], s) for i, s in zip(kept, sigmas, strict=True)])


def _condition(
    step: FaultStep,
    transition: Transition,
    x: Array,
    P: Array,
    rows: Array,
    Upsilon: Array,
    white: Array,
    kept: Sequence[int],
    log_density: float,
) -> Evidence:
    """The joint Gaussian of x(t1) and the M kept values, whose rows are (M, a), conditioned once.
    ``white`` (M, M) is the part of Upsilon that is white noise.

    Along the legs ``C`` (a, M) is cov(x(t), z), so that a new row of Gamma is h C; see mathematics,
    section 1: Gamma = HF P HF' + L Omega L' + Upsilon, C = F P HF' + W Omega L'.
    """
    M, now = len(kept), step.t0
    C, Gamma, gamma = np.zeros((len(x), M)), Upsilon.copy(), np.zeros(M)
    for a in range(M + 1):
        time = step.measurements[kept[a]][0] if a < M else step.t1
        F, Q = transition(time - now)
        x, P, C, now = F @ x, F @ P @ F.T + Q, F @ C, time
        if a < M:
            C[:, a] = P @ rows[a]
            Gamma[a, : a + 1] += rows[a] @ C[:, : a + 1]
            Gamma[:a, a] = Gamma[a, :a]
            gamma[a] = step.measurements[kept[a]][2] - rows[a] @ x
    noise, variance = np.full((2, len(step.measurements)), np.nan)
    if M:
        L = np.linalg.cholesky(Gamma)
        w, W, V = np.linalg.solve(L, gamma), np.linalg.solve(L, C.T), np.linalg.solve(L, white)
        log_density -= float(0.5 * w @ w + np.sum(np.log(np.diag(L))))
        log_density -= 0.5 * M * float(np.log(2.0 * np.pi))
        x, P = x + W.T @ w, P - W.T @ W
        noise[list(kept)] = V.T @ w
        variance[list(kept)] = np.sum(V**2, axis=0)
    return Evidence(log_density, x, symmetric(P), noise, variance)
