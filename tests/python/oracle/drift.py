"""All measurements of a window at once: Gamma, gamma, and the likelihood's gradient from them.

x_{k+1} = A_k x_k + inputs_k + w_k, z_k = H_k x_k + v_k, k = 0, 1, ...; x_0 is N(x0, P0) and the
first measurement is of x_0. A component that is not a number is missing: its row is left out. With
gamma = z - (its prediction from the initial state) and Gamma = cov(gamma), of Cholesky factor L,

    script-L = sum_k log det S_k + nu_k' S_k^-1 nu_k = log det Gamma + gamma' Gamma^-1 gamma
    d script-L / dz = 2 Gamma^-1 gamma                    (Parellier, Barrau & Bonnabel 2023, eq. 8)

No recursion of Kalman's is in it, but for ``estimates``. Everything is in extended precision: over
500 steps the prediction's variance grows to 1e8 times the noise's, which leaves a dense solve in
doubles eight digits.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import factorial
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from oracle.models import gauss_markov_transition
from oracle.sensors import Sensor, Transition, nanoseconds
from oracle.step import Array, symmetric
from oracle.switching import Plant, at

Long: TypeAlias = NDArray[np.longdouble]


def _long(values: Any) -> Long:
    return np.asarray(values, dtype=np.longdouble)


@dataclass(frozen=True)
class Dense:
    """The M measurements that are there, of one series."""

    gamma: Long  # (M,)
    Gamma: Long  # (M, M)
    L: Long  # (M, M) lower triangular, L L' = Gamma
    R: Array  # (M, M) covariance of the measurement noise alone
    time: Array  # (M,)
    channel: NDArray[np.int64]  # (M,)
    step: NDArray[np.int64]  # (M,)
    slot: NDArray[np.int64]  # (M,) where each stands in the data as they were given, flat
    shape: tuple[int, ...]  # of the data as they were given

    def whiten(self, b: Array | Long) -> Long:
        """L^-1 b; b (M,) or (M, r)."""
        y = _long(b).copy()
        for j in range(len(y)):
            y[j] /= self.L[j, j]
            y[j + 1 :] -= np.multiply.outer(self.L[j + 1 :, j], y[j])
        return y

    def spread(self, values: Array | Long) -> Array:
        """(M,) in the shape of the data, NaN where nothing was measured."""
        out = np.full(int(np.prod(self.shape)), np.nan)
        out[self.slot] = values
        return out.reshape(self.shape)

    @property
    def solved(self) -> Long:
        """Gamma^-1 gamma (M,)."""
        x = self.whiten(self.gamma)
        for j in range(len(x) - 1, -1, -1):
            x[j] = (x[j] - self.L[j + 1 :, j] @ x[j + 1 :]) / self.L[j, j]
        return x

    @property
    def gradient(self) -> Array:
        return self.spread(2.0 * self.solved)

    @property
    def precision(self) -> Array:
        """diag(Gamma^-1)."""
        return self.spread(np.sum(self.whiten(np.eye(len(self.gamma))) ** 2, axis=0))

    @property
    def nis(self) -> Array:
        """nu' S^-1 nu of every step: L^-1 gamma are the whitened innovations."""
        white = np.zeros(self.shape[0])
        np.add.at(white, self.step, self.whiten(self.gamma).astype(np.float64) ** 2)
        return white

    @property
    def inconsistency(self) -> float:
        log_det = 2.0 * np.sum(np.log(np.diag(self.L)))
        return float(log_det + np.sum(self.whiten(self.gamma) ** 2))

    @property
    def log_likelihood(self) -> float:
        return -0.5 * (self.inconsistency + len(self.gamma) * float(np.log(2.0 * np.pi)))


def dense(plant: Plant, z: Array, times: Array | None = None, inputs: Array | None = None) -> Dense:
    """Of z (T, m) at ``times`` (T,), by default 0, 1, 2...; ``inputs`` (T - 1, n)."""
    T = len(z)
    known = np.zeros((T, len(plant.x0))) if inputs is None else inputs
    when = np.arange(float(T)) if times is None else times
    seen = ~np.isnan(z)
    M = int(seen.sum())
    step, channel = np.nonzero(seen)
    x, P, C = _long(plant.x0), _long(plant.P0), _long(np.zeros((len(plant.x0), 0)))
    gamma, Gamma, R = _long(np.zeros(M)), _long(np.zeros((M, M))), np.zeros((M, M))
    for k in range(T):
        if k > 0:
            A = _long(at(plant.A, k - 1))
            x, P, C = A @ x + _long(known[k - 1]), A @ P @ A.T + _long(at(plant.Q, k - 1)), A @ C
        H, past = _long(at(plant.H, k)[seen[k]]), C.shape[1]  # C = cov(x_k, the past's z)
        now = slice(past, past + len(H))
        R[now, now] = at(plant.R, k)[np.ix_(seen[k], seen[k])]
        gamma[now] = z[k, seen[k]] - H @ x
        Gamma[now, :past] = H @ C
        Gamma[:past, now] = Gamma[now, :past].T
        Gamma[now, now] = H @ P @ H.T + R[now, now]
        C = np.hstack([C, P @ H.T])
    slot = np.flatnonzero(seen)
    return Dense(gamma, Gamma, _cholesky(Gamma), R, when[step], channel, step, slot, z.shape)


def _cholesky(Gamma: Long) -> Long:
    """LAPACK's has no extended precision."""
    rest, L = Gamma.copy(), np.zeros_like(Gamma)
    for j in range(len(rest)):
        L[j:, j] = rest[j:, j] / np.sqrt(rest[j, j])
        rest[j + 1 :, j + 1 :] -= np.multiply.outer(L[j + 1 :, j], L[j + 1 :, j])
    return L


def integrator_chain(order: int, q: float) -> Transition:
    """F and Q in closed form; each state is the derivative of the one before, white noise of root
    density q drives the last: constant acceleration is [speed, acceleration], q the jerk."""

    def transition(dt: float) -> tuple[Array, Array]:
        F, Q = np.zeros((order, order)), np.zeros((order, order))
        for i in range(order):
            for j in range(order):
                a, b = order - 1 - i, order - 1 - j
                Q[i, j] = q**2 * dt ** (a + b + 1) / ((a + b + 1) * factorial(a) * factorial(b))
                F[i, j] = dt ** (j - i) / factorial(j - i) if j >= i else 0.0
        return F, Q

    return transition


def dense_log(
    transition: Transition,
    sensors: Sequence[Sensor],
    x0: Array,
    P0: Array,
    rows: Sequence[tuple[float, int, float]],
    start: float | None = None,
) -> Dense:
    """Of a log of (time, sensor, value); ``x0`` and ``P0`` are at ``start``, without it at the
    earliest measurement, each valid at its time less the sensor's latency. The state is [model's,
    then one bias of every sensor that has one, in stationary distribution at the start]. A value
    that is not a number is not there. ``time`` is that of validity, ``step`` the rank in time."""
    n, ids = len(x0), [i for i, s in enumerate(sensors) if s.bias_sigma > 0.0]
    size, biased = n + len(ids), {i: n + k for k, i in enumerate(ids)}
    valid = [nanoseconds(t) - nanoseconds(sensors[i].latency) for t, i, _ in rows]
    order = sorted((k for k in range(len(rows)) if not np.isnan(rows[k][2])), key=valid.__getitem__)
    now = valid[order[0]] if start is None else nanoseconds(start)
    T = len(order) + 1  # the first step is the start, where nothing is measured
    A, Q, H = np.zeros((T - 1, size, size)), np.zeros((T - 1, size, size)), np.zeros((T, 1, size))
    R, z, x, P = np.ones((T, 1, 1)), np.full((T, 1), np.nan), np.zeros(size), np.zeros((size, size))
    x[:n], P[:n, :n] = x0, P0
    for i, j in biased.items():
        P[j, j] = sensors[i].bias_sigma ** 2
    for k, row in enumerate(order):
        dt, (_, s, value) = (valid[row] - now) / 1e9, rows[row]
        now = valid[row]
        A[k, :n, :n], Q[k, :n, :n] = transition(dt)
        for i, j in biased.items():
            A[k, j, j], Q[k, j, j] = gauss_markov_transition(
                sensors[i].bias_sigma, sensors[i].bias_time, dt
            )
        H[k + 1, 0, :n] = sensors[s].h
        if s in biased:
            H[k + 1, 0, biased[s]] = 1.0
        R[k + 1], z[k + 1] = sensors[s].sigma ** 2, value
    found = dense(Plant(A, H, Q, R, x, P), z, np.array([np.nan, *(valid[k] / 1e9 for k in order)]))
    channel = np.array([rows[k][1] for k in order])
    return replace(found, channel=channel, slot=np.array(order), shape=(len(rows),),
                   step=np.arange(len(order)))  # fmt: skip


def estimates(plant: Plant, z: Array, inputs: Array | None = None) -> tuple[Array, Array, float]:
    """Kalman's filter over z (T, m): x (T, n) and P (T, n, n) after every measurement, and
    script-L. Of repaired data, z less the fault, it is the repaired estimate."""
    known = np.zeros((len(z), len(plant.x0))) if inputs is None else inputs
    x, P, xs, Ps, total = plant.x0, plant.P0, [], [], 0.0
    for k in range(len(z)):
        if k > 0:
            A = at(plant.A, k - 1)
            x, P = A @ x + known[k - 1], symmetric(A @ P @ A.T + at(plant.Q, k - 1))
        seen = ~np.isnan(z[k])
        H, R = at(plant.H, k)[seen], at(plant.R, k)[np.ix_(seen, seen)]
        nu, S = z[k, seen] - H @ x, symmetric(H @ P @ H.T + R)
        K = np.linalg.solve(S, H @ P).T
        I_KH = np.eye(len(x)) - K @ H
        x, P = x + K @ nu, symmetric(I_KH @ P @ I_KH.T + K @ R @ K.T)
        total += float(np.linalg.slogdet(S)[1] + nu @ np.linalg.solve(S, nu))
        xs.append(x)
        Ps.append(P)
    return np.array(xs), np.array(Ps), total


def simulate(plant: Plant, runs: int, steps: int, seed: int, inputs: Array | None = None) -> Array:
    """Measurements (runs, steps, m) with no fault, all of them there."""
    rng, n = np.random.default_rng(seed), len(plant.x0)

    def noise(covariance: Array) -> Array:
        variance, axes = np.linalg.eigh(covariance)  # it may be singular
        root = axes * np.sqrt(np.maximum(variance, 0.0))
        return np.asarray(rng.normal(size=(runs, len(root))) @ root.T)

    x, z = plant.x0 + noise(plant.P0), []
    for k in range(steps):
        if k > 0:
            known = np.zeros(n) if inputs is None else inputs[k - 1]
            x = x @ at(plant.A, k - 1).T + known + noise(at(plant.Q, k - 1))
        z.append(x @ at(plant.H, k).T + noise(at(plant.R, k)))
    return np.stack(z, axis=1)


Function: TypeAlias = Callable[[Array], float]


def differences(function: Function, z: Array, width: float = 1.0) -> Array:
    """Central differences in every component that is there. Exact but for rounding, whatever the
    width, of a quadratic function; rounding is least with wide ones."""
    out = np.full(z.shape, np.nan)
    for place in zip(*np.nonzero(~np.isnan(z)), strict=True):
        up, down = z.copy(), z.copy()
        up[place] += width
        down[place] -= width
        out[place] = (function(up) - function(down)) / (2.0 * width)
    return out
