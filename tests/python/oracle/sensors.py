"""A dense Kalman filter over a log of sensors with latency, scale error and bias.

The state is [model states, then for each sensor in order: its scale error s if it has one, its
bias b if it has one]. A sensor reads z = (1 + s) h.x + b + v, linearised at the prediction. A
measurement belongs to the time at which it was valid: its time stamp less the sensor's latency.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import inf

import numpy as np

from oracle.models import gauss_markov_transition
from oracle.step import Array, block_diagonal, symmetric

Transition = Callable[[float], tuple[Array, Array]]  # dt in s -> F (n, n), Q (n, n)


@dataclass(frozen=True)
class Sensor:
    """What is known of a sensor; zero means that it has no such error."""

    name: str
    h: Array  # (n,) the row of the model's state that it observes
    sigma: float  # standard deviation of the white noise v, in the unit of the reading
    latency: float = 0.0  # s
    scale_sigma: float = 0.0  # standard deviation of the constant scale error s, no unit
    bias_sigma: float = 0.0  # stationary standard deviation of the bias b
    bias_time: float = inf  # s, time constant of the bias; inf: constant


@dataclass(frozen=True)
class Run:
    """One row for each estimation time; a = n + number of scale and bias states."""

    x: Array  # (K, a)
    P: Array  # (K, a, a)
    sse: Array  # (K,) sum of nu^2 / S over the measurements of the step
    dof: Array  # (K,) their number
    log_likelihood: float  # of all the measurements used


def nanoseconds(time: float) -> int:
    """Time as the filter counts it; ties go to the even number, as Python rounds."""
    return round(Fraction(time) * 10**9)


class _Layout:
    """Where each sensor's error states sit behind the n states of the model."""

    def __init__(self, transition: Transition, sensors: Sequence[Sensor], n: int) -> None:
        self.transition, self.sensors, self.n = transition, sensors, n
        self.scale: dict[int, int] = {}  # sensor -> index of its scale state
        self.bias: dict[int, int] = {}
        self.size = n
        for i, sensor in enumerate(sensors):
            for states, sigma in ((self.scale, sensor.scale_sigma), (self.bias, sensor.bias_sigma)):
                if sigma > 0.0:
                    states[i] = self.size
                    self.size += 1

    def prior(self, x0: Array, P0: Array) -> tuple[Array, Array]:
        variances = np.zeros(self.size - self.n)
        for i, sensor in enumerate(self.sensors):
            if i in self.scale:
                variances[self.scale[i] - self.n] = sensor.scale_sigma**2
            if i in self.bias:
                variances[self.bias[i] - self.n] = sensor.bias_sigma**2
        x = np.zeros(self.size)
        x[: self.n] = x0
        return x, block_diagonal([P0, np.diag(variances)])

    def legs(self, dt: float) -> tuple[Array, Array]:
        """F (a, a) and Q (a, a); a scale error does not change."""
        F, Q = np.eye(self.size), np.zeros((self.size, self.size))
        F[: self.n, : self.n], Q[: self.n, : self.n] = self.transition(dt)
        for i, k in self.bias.items():
            sensor = self.sensors[i]
            F[k, k], Q[k, k] = gauss_markov_transition(sensor.bias_sigma, sensor.bias_time, dt)
        return F, Q

    def observe(self, i: int, x: Array) -> tuple[float, Array]:
        """The predicted reading of sensor i and its derivative H (a,) with respect to x (a,)."""
        ideal = float(self.sensors[i].h @ x[: self.n])
        gain = 1.0 + (x[self.scale[i]] if i in self.scale else 0.0)
        H = np.zeros(self.size)
        H[: self.n] = gain * self.sensors[i].h
        if i in self.scale:
            H[self.scale[i]] = ideal
        if i in self.bias:
            H[self.bias[i]] = 1.0
        return float(gain * ideal + (x[self.bias[i]] if i in self.bias else 0.0)), H


def run(
    transition: Transition,
    sensors: Sequence[Sensor],
    x0: Array,
    P0: Array,
    log: Sequence[tuple[float, int, float]],
    estimation_times: Sequence[float],
    start: float = 0.0,
) -> Run:
    """Filter a log of (time, sensor index, value) from x0 (n,), P0 (n, n) given at ``start``.

    Measurements valid before ``start`` or after the last estimation time are not used. The estimate
    at time t uses all those valid at or before t, whenever they arrived.
    """
    layout = _Layout(transition, sensors, len(x0))
    x, P = layout.prior(x0, P0)
    now = nanoseconds(start)
    valid = sorted(
        (nanoseconds(time) - nanoseconds(sensors[i].latency), i, value) for time, i, value in log
    )
    pending = [measurement for measurement in valid if measurement[0] >= now]
    xs, Ps, sses, dofs, log_likelihood = [], [], [], [], 0.0
    for end in (nanoseconds(time) for time in estimation_times):
        in_step = [measurement for measurement in pending if measurement[0] <= end]
        pending = pending[len(in_step) :]
        sse = 0.0
        for time, i, value in in_step:
            F, Q = layout.legs((time - now) / 1e9)
            x, P, now = F @ x, F @ P @ F.T + Q, time
            predicted, H = layout.observe(i, x)
            nu, r = value - predicted, sensors[i].sigma ** 2
            S = float(H @ P @ H) + r
            K = P @ H / S
            x = x + K * nu
            I_KH = np.eye(layout.size) - np.outer(K, H)
            P = symmetric(I_KH @ P @ I_KH.T + r * np.outer(K, K))
            sse += nu**2 / S
            log_likelihood -= 0.5 * (np.log(2.0 * np.pi * S) + nu**2 / S)
        F, Q = layout.legs((end - now) / 1e9)
        x, P, now = F @ x, symmetric(F @ P @ F.T + Q), end
        xs.append(x)
        Ps.append(P)
        sses.append(sse)
        dofs.append(len(in_step))
    return Run(np.array(xs), np.array(Ps), np.array(sses), np.array(dofs), float(log_likelihood))
