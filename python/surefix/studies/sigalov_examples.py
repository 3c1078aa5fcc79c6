"""Sigalov & Oshman, section VI: the system of both examples, and the filters that are compared.

x_{k+1} = −0.8 x_k + w_k from x_0 = 0; z_k = γ_k x_k + v_k with cov v_k = δ_k, which is 1 or C = 10,
drawn anew in every step; γ = 1 − α + αβ, where α, drawn once a run, is 1 with probability q, and β
is a chain. Rows of a transition matrix are the state before; healthy (1) stands before faulty.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

import surefix as sf
from surefix.core.checks import FloatArray

A, C = -0.8, 10.0
r, p = 0.8, 0.9  # Pr(δ = 1); of β, see the examples
GAMMA, DELTA = (1, 0), (1.0, C)
DELTA_TRANSITION = np.tile([r, 1 - r], (2, 1))
RUNS, STEPS = 10_000, 100

NAMES = {
    "linear": "linear optimal (23)",
    "as_printed": "one-step, (7) and (9) as printed",
    "one_step": "one-step",
    "imm3": "IMM, 3 modes",
    "imm4": "IMM, 4 modes",
    "augmented": "one-step, modes (α, β, δ)",
    "augmented_imm": "IMM, modes (α, β, δ)",
}


@dataclass(frozen=True, eq=False)
class Example:
    """``switching``: (γ, δ) as a chain, as the nonlinear filters take it; ``exact``: the chain of
    (α, β, δ) where γ alone is none. ``said``: of this example, in the paper."""

    name: str
    q: float
    beta: FloatArray  # (2, 2)
    switching: sf.ModeChain
    exact: sf.ModeChain | None
    p11: float  # Pr(γ_{k+1} = 1 | γ_k = 1), by the paper
    said: str


@dataclass(frozen=True, eq=False)
class Simulated:
    """x, z, γ and whether δ = C, (runs, steps) each."""

    x: FloatArray
    z: FloatArray
    gamma: npt.NDArray[np.bool_]
    noisy: npt.NDArray[np.bool_]

    @property
    def modes(self) -> npt.NDArray[np.int64]:
        """Index into (1, 1), (1, C), (0, 1), (0, C)."""
        return 2 * ~self.gamma + 1 * self.noisy


def system() -> sf.LinearSystem:
    """(25), with what is known of x_0."""
    return sf.LinearSystem(
        A=np.array([[A]]),
        H=np.eye(1),
        Q=np.eye(1),
        R=np.eye(1),
        x0=np.zeros(1),
        P0=np.zeros((1, 1)),
    )


def chain(gamma: FloatArray) -> sf.ModeChain:
    """(γ, δ) where γ follows this transition matrix."""
    return sf.ModeChain.independent_chains(GAMMA, gamma, DELTA, DELTA_TRANSITION)


def simulate(example: Example, runs: int, steps: int = STEPS, seed: int = 1) -> Simulated:
    """Runs drawn as section VI says; β starts from its stationary law."""
    random = np.random.RandomState(seed)
    switched = random.uniform(size=runs) < example.q  # α = 1
    stays, heals = example.beta[:, 0]
    drawn = random.uniform(size=(steps, runs))
    beta = np.empty((steps, runs), dtype=bool)
    beta[0] = drawn[0] < heals / (1 - stays + heals)
    x = np.zeros((steps, runs))
    w = random.normal(size=(steps, runs))
    for k in range(1, steps):
        beta[k] = drawn[k] < np.where(beta[k - 1], stays, heals)
        x[k] = A * x[k - 1] + w[k]
    gamma = beta | ~switched
    noisy = random.uniform(size=(steps, runs)) >= r
    z = gamma * x + np.where(noisy, np.sqrt(C), 1.0) * random.normal(size=(steps, runs))
    return Simulated(x.T, z.T.copy(), gamma.T, noisy.T)


def errors(example: Example, made: Simulated) -> dict[str, FloatArray]:
    """Squared errors (runs, steps) of the genie's filter and of those of ``NAMES``."""
    plant, switching, z = system(), example.switching, made.z[:, :, None]
    estimates = {
        "genie": sf.GenieFilter(plant, switching).run(z, modes=made.modes).x,
        "linear": sf.LinearOptimalFilter(plant, example.exact or switching).run(z).x,
        "one_step": sf.OneStepFilter(plant, switching).run(z).x,
        "imm3": sf.IMMFilter(plant, switching.lumped_interruptions()).run(z).x,
        "imm4": sf.IMMFilter(plant, switching).run(z).x,
    }
    if example.exact is not None:
        estimates["augmented"] = sf.OneStepFilter(plant, example.exact).run(z).x
        estimates["augmented_imm"] = sf.IMMFilter(plant, example.exact).run(z).x
    found = {name: (x[:, :, 0] - made.x) ** 2 for name, x in estimates.items()}
    return {**found, "as_printed": (as_printed(switching, made.z) - made.x) ** 2}


def as_printed(modes: sf.ModeChain, z: FloatArray) -> FloatArray:
    """The one-step filter with (7) and (9) taken literally, z (runs, steps).

    (7) carries the covariance after an update with γ = 1, δ = 1, whatever the modes' weights; (9)
    has the estimate and the covariance *after* the update where those before it belong.
    """
    gamma, delta = np.array(modes.modes, dtype=np.float64).T
    x, P, weight = np.zeros(len(z)), 0.0, np.tile(modes.initial, (len(z), 1))
    estimates = np.empty(z.shape)
    for k, measured in enumerate(z.T):
        if k > 0:
            x, P, weight = A * x, A * P * A + 1.0, weight @ modes.transition
        F2 = gamma * P / (P + delta)  # (6)
        updated = x[:, None] + F2 * (measured - x)[:, None]  # (5)
        P = (1 - P / (P + 1.0)) * P  # (7)
        S = gamma * P + delta
        residual = measured[:, None] - gamma * updated
        weight = weight * np.exp(-0.5 * residual**2 / S) / np.sqrt(S)  # (8), (9)
        weight /= weight.sum(axis=1, keepdims=True)
        x = estimates[:, k] = (weight * updated).sum(axis=1)  # (3)
    return estimates
