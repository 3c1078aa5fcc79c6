"""W4 in what a good user writes in an afternoon."""

from __future__ import annotations

# mypy: ignore-errors
import importlib.util
import os
from typing import Any

import numpy as np


def installed() -> dict[str, Any]:
    """Those of the peers whose libraries there are."""
    peers = {
        "numba": ("numba", numba_loops),
        "jax, differentiated by itself": ("jax", jax_gradient),
    }
    return {
        name: make for name, (module, make) in peers.items() if importlib.util.find_spec(module)
    }


def numba_loops(y, F, Q, R, X0, P0):
    """Both passes in scalars, compiled by numba."""
    import numba

    @numba.njit(cache=False)
    def run(y, f01, q00, q11, r, x0, P0):
        N = len(y)
        out, z, S = np.empty(N), np.empty(N), np.empty(N)
        k0, k1 = np.empty(N), np.empty(N)
        a, b = x0[0], x0[1]
        p00, p01, p11 = P0[0, 0], P0[0, 1], P0[1, 1]
        for n in range(N):
            if n > 0:
                a += f01 * b
                p00 += f01 * (2 * p01 + f01 * p11) + q00
                p01 += f01 * p11
                p11 += q11
            S[n] = p00 + r
            k0[n], k1[n] = p00 / S[n], p01 / S[n]
            z[n] = y[n] - a
            a += k0[n] * z[n]
            b += k1[n] * z[n]
            p11 -= k1[n] * p01
            p01 -= k0[n] * p01
            p00 -= k0[n] * p00
        u, v = 0.0, 0.0
        for n in range(N - 1, -1, -1):
            g = k0[n] * u + k1[n] * v + 2 * z[n] / S[n]
            out[n] = g
            u -= g
            v += f01 * u
        return out

    return lambda: run(y, F[0, 1], Q[0, 0], Q[1, 1], R, X0, P0)


def jax_gradient(y, F, Q, R, X0, P0):
    """The likelihood as a scan, and its gradient by automatic differentiation."""
    os.environ.setdefault("JAX_PLATFORMS", "cpu")
    import jax
    import jax.numpy as jnp

    jax.config.update("jax_enable_x64", True)
    first = jnp.eye(2), jnp.zeros((2, 2))

    def inconsistency(y):
        def step(carry, item):
            x, P, A, noise = carry
            x, P = A @ x, A @ P @ A.T + noise
            S, e = P[0, 0] + R, item - x[0]
            K = P[:, 0] / S
            own = jnp.log(S) + e * e / S
            return (x + K * e, P - jnp.outer(K, P[0]), jnp.asarray(F), jnp.asarray(Q)), own

        carry = (jnp.asarray(X0), jnp.asarray(P0), *first)
        return jax.lax.scan(step, carry, y)[1].sum()

    gradient = jax.jit(jax.grad(inconsistency))
    on_device = jnp.asarray(y)
    return lambda: np.asarray(gradient(on_device))
