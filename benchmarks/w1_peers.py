"""W1 in the libraries that people use, and in what a good user writes in an afternoon."""

from __future__ import annotations

# mypy: ignore-errors
import importlib.util
import os

import numpy as np

from w1 import JERK, Contender, Problem

LOG_2PI = 1.8378770664093453


def numba_loop(problem: Problem) -> Contender:
    """The reference's loop in Python, compiled by numba."""
    import numba

    @numba.njit(cache=False)
    def run(time, sensor, value, variance, q):
        n = len(time)
        x, P = np.empty((n, 2)), np.empty((n, 2, 2))
        x0 = x1 = p01 = total = 0.0
        p00 = p11 = 1.0
        previous = time[0]
        for i in range(n):
            dt = time[i] - previous
            previous = time[i]
            x0 += dt * x1
            p00 += dt * (2 * p01 + dt * p11) + q * dt**3 / 3
            p01 += dt * p11 + q * dt**2 / 2
            p11 += q * dt
            S = p00 + variance[sensor[i]]
            k0, k1 = p00 / S, p01 / S
            innovation = value[i] - x0
            x0 += k0 * innovation
            x1 += k1 * innovation
            p11 -= k1 * p01
            p01 -= k0 * p01
            p00 -= k0 * p00
            total += np.log(S) + innovation**2 / S
            x[i, 0], x[i, 1] = x0, x1
            P[i, 0, 0], P[i, 0, 1], P[i, 1, 0], P[i, 1, 1] = p00, p01, p01, p11
        return x, P, -0.5 * (total + n * LOG_2PI)

    inputs = (problem.time, problem.sensor, problem.value, problem.variance, JERK**2)
    return lambda: run(*inputs)


def jax_scan(problem: Problem) -> Contender:
    """jax.lax.scan, compiled, in float64 on the CPU."""
    os.environ.setdefault("JAX_PLATFORMS", "cpu")
    import jax
    import jax.numpy as jnp

    jax.config.update("jax_enable_x64", True)
    dt = jnp.asarray(np.diff(problem.time, prepend=problem.time[0]))
    r = jnp.asarray(problem.variance[problem.sensor])
    z = jnp.asarray(problem.value)

    def step(carry, item):
        x0, x1, p00, p01, p11, total = carry
        dt, r, z = item
        q = JERK**2
        x0 = x0 + dt * x1
        p00 = p00 + dt * (2 * p01 + dt * p11) + q * dt**3 / 3
        p01 = p01 + dt * p11 + q * dt**2 / 2
        p11 = p11 + q * dt
        S = p00 + r
        k0, k1, e = p00 / S, p01 / S, z - x0
        x0, x1 = x0 + k0 * e, x1 + k1 * e
        p00, p01, p11 = p00 - k0 * p00, p01 - k0 * p01, p11 - k1 * p01
        total = total + jnp.log(S) + e * e / S
        return (x0, x1, p00, p01, p11, total), (
            jnp.stack([x0, x1]),
            jnp.stack([p00, p01, p01, p11]),
        )

    @jax.jit
    def run(dt, r, z):
        start = (0.0, 0.0, 1.0, 0.0, 1.0, 0.0)
        last, (x, P) = jax.lax.scan(step, start, (dt, r, z))
        return x, P, -0.5 * (last[-1] + len(z) * LOG_2PI)

    def contender():
        x, P, value = run(dt, r, z)
        return np.asarray(x), np.asarray(P).reshape(-1, 2, 2), float(value)

    return contender


def filterpy(problem: Problem) -> Contender:
    """filterpy.kalman.KalmanFilter, predict and update for each measurement."""
    from filterpy.kalman import KalmanFilter

    def contender():
        kf = KalmanFilter(dim_x=2, dim_z=1)
        kf.x, kf.P, kf.H = np.zeros((2, 1)), np.eye(2), np.array([[1.0, 0.0]])
        x, P, total = np.empty((len(problem.time), 2)), np.empty((len(problem.time), 2, 2)), 0.0
        for i, dt in enumerate(np.diff(problem.time, prepend=problem.time[0])):
            Q = JERK**2 * np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]])
            kf.predict(F=np.array([[1.0, dt], [0.0, 1.0]]), Q=Q)
            kf.update(problem.value[i], R=problem.variance[problem.sensor[i]])
            total += np.log(kf.S[0, 0]) + kf.y[0, 0] ** 2 / kf.S[0, 0] + LOG_2PI
            x[i], P[i] = kf.x[:, 0], kf.P
        return x, P, -0.5 * float(total)

    return contender


def statsmodels(problem: Problem) -> Contender:
    """statsmodels' state space filter (Cython) with matrices for every time."""
    from statsmodels.tsa.statespace.kalman_filter import KalmanFilter

    n = len(problem.time)
    dt = np.diff(problem.time, append=problem.time[-1])  # its transition t leads to t + 1
    kf = KalmanFilter(k_endog=1, k_states=2, k_posdef=2)
    kf.bind(problem.value[:, None].copy())
    kf["design"] = np.array([[1.0, 0.0]])
    kf["obs_cov"] = problem.variance[problem.sensor][None, None, :]
    kf["selection"] = np.eye(2)
    transition = np.tile(np.eye(2)[:, :, None], n)
    transition[0, 1] = dt
    kf["transition"] = transition
    kf["state_cov"] = JERK**2 * np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]])
    kf.initialize_known(np.zeros(2), np.eye(2))
    kf.tolerance = 0  # no steady-state shortcut: it is wrong for irregular steps

    def contender():
        out = kf.filter()
        return out.filtered_state.T, np.moveaxis(out.filtered_state_cov, 2, 0), float(out.llf)

    return contender


PEERS = {"numba": numba_loop, "jax": jax_scan, "statsmodels": statsmodels, "filterpy": filterpy}


def installed() -> dict[str, object]:
    """The peers that can be imported here."""
    return {name: make for name, make in PEERS.items() if importlib.util.find_spec(name)}
