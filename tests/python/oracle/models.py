"""Continuous-time models dx = A x dt + B u dt + L dw, and their exact discretisation, two ways.

    F = exp(A dt),  Q = int_0^dt exp(A s) L Qc L' exp(A s)' ds,  G = int_0^dt exp(A s) B ds

once by one matrix exponential (Van Loan, IEEE Trans. Automatic Control 23, 1978) and once by
numerical quadrature, so that neither has to be believed.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.integrate import quad_vec
from scipy.linalg import expm

from oracle.step import Array, symmetric


@dataclass(frozen=True)
class Model:
    """A linear model driven by white noise w of spectral density Qc, and by a constant input u."""

    A: Array  # (n, n)
    L: Array  # (n, r)
    Qc: Array  # (r, r)
    B: Array = field(default_factory=lambda: np.zeros((0, 0)))  # (n, p); empty: no input

    @property
    def input_matrix(self) -> Array:
        """B, or (n, 0) if there is no input."""
        return self.B if self.B.size else np.zeros((len(self.A), 0))


def integrator_chain(order: int, q: float) -> Model:
    """``order`` states, each the derivative of the one before; noise of root density q drives the
    last, and so does the input u."""
    drive = np.eye(order)[:, -1:]
    return Model(A=np.eye(order, k=1), L=drive, Qc=np.array([[q**2]]), B=drive)


def constant_velocity(q: float, *, position: bool = True) -> Model:
    """[position, speed] or [speed]; q in m/s^2/sqrt(Hz) is a white acceleration."""
    return integrator_chain(2 if position else 1, q)


def constant_acceleration(q: float, *, position: bool = True) -> Model:
    """[position, speed, acceleration] or [speed, acceleration]; q in m/s^3/sqrt(Hz) is the jerk."""
    return integrator_chain(3 if position else 2, q)


def gauss_markov(sigma: float, time: float) -> Model:
    """A bias of stationary deviation sigma and time constant ``time`` (inf: constant)."""
    return Model(
        A=np.array([[-1.0 / time]]),
        L=np.eye(1),
        Qc=np.array([[2.0 * sigma**2 / time]]),
        B=np.eye(1),
    )


def gauss_markov_transition(sigma: float, time: float, dt: float) -> tuple[float, float]:
    """F and Q of ``gauss_markov`` in closed form, for any dt: Van Loan overflows at dt >> time."""
    return float(np.exp(-dt / time)), float(-(sigma**2) * np.expm1(-2.0 * dt / time))


def van_loan(model: Model, dt: float) -> tuple[Array, Array, Array]:
    """F (n, n), Q (n, n) and G (n, p) by matrix exponentials."""
    n, p = model.input_matrix.shape
    with_input = np.zeros((n + p, n + p))
    with_input[:n, :n] = model.A
    with_input[:n, n:] = model.input_matrix
    F_G = expm(with_input * dt)
    F, G = F_G[:n, :n], F_G[:n, n:]
    with_noise = np.zeros((2 * n, 2 * n))
    with_noise[:n, :n] = -model.A
    with_noise[:n, n:] = model.L @ model.Qc @ model.L.T
    with_noise[n:, n:] = model.A.T
    # the lower right block is F' too, but F has more exact digits (and zeros) from its own matrix
    return F, symmetric(F @ expm(with_noise * dt)[:n, n:]), G


def quadrature(model: Model, dt: float) -> tuple[Array, Array, Array]:
    """F (n, n), Q (n, n) and G (n, p) by numerical integration over the unit interval."""
    noise = model.L @ model.Qc @ model.L.T

    def integrand_Q(s: float) -> Array:
        F = expm(model.A * (s * dt))
        return np.asarray(F @ noise @ F.T * dt)

    def integrand_G(s: float) -> Array:
        return np.asarray(expm(model.A * (s * dt)) @ model.input_matrix * dt)

    integrals = []
    for integrand in (integrand_Q, integrand_G):
        scale = np.max(np.abs(integrand(1.0)), initial=0.0)
        tolerance = 1e-14 * scale if scale > 0.0 else 1.0
        integrals.append(np.asarray(quad_vec(integrand, 0.0, 1.0, epsabs=tolerance)[0]))
    return expm(model.A * dt), integrals[0], integrals[1]
