"""The same plants and chains for the engine and for the oracle."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

import surefix as sf
from oracle import switching
from oracle.compare import covariance_error, state_error
from oracle.step import Array
from oracle.switching import Estimates, Plant
from oracle.switching_chain import Chain, independent

TOLERANCE = 1e-11
ONE = np.ones((1, 1))
SCALAR = Plant(A=-0.8 * ONE, H=ONE, Q=ONE, R=ONE, x0=np.array([0.5]), P0=ONE)  # the paper's
GAMMA = np.array([[0.9, 0.1], [0.3, 0.7]])
DELTA = np.array([[0.8, 0.2], [0.5, 0.5]])
FOUR = independent(GAMMA, DELTA, (1.0, 10.0))
HEALTHY = Chain(((1.0, 1.0),), ONE, np.ones(1))
# Nothing follows from the likelihood of one step: the probabilities run down to e^-1e16.
STATIC = Chain(((1.0, 1.0), (1.0, 100.0), (0.0, 1.0)), np.eye(3), np.array([0.5, 0.3, 0.2]))
APPROXIMATIONS: dict[str, tuple[Any, Callable[..., Estimates]]] = {
    "one step": (sf.OneStepFilter, switching.one_step),
    "imm": (sf.IMMFilter, switching.imm),
}


def system(plant: Plant) -> sf.LinearSystem:
    return sf.LinearSystem(
        plant.A, plant.H, plant.Q, plant.R, plant.x0, plant.P0, states=plant.states or None
    )


def mode_chain(chain: Chain) -> sf.ModeChain:
    """Of modes that have one delta each."""
    modes = list(zip(chain.gamma.tolist(), chain.delta.tolist(), strict=True))
    return sf.ModeChain(modes, chain.transition, chain.initial)


def assert_gaussians(
    x: Array, P: Array, x_known: Array, P_known: Array, tolerance: float = TOLERANCE
) -> None:
    assert x.shape == x_known.shape
    assert P.shape == P_known.shape
    for k in range(len(x_known)):
        assert state_error(x[k], x_known[k], P_known[k]) <= tolerance, f"x of step {k}"
        assert covariance_error(P[k], P_known[k]) <= tolerance, f"P of step {k}"


def assert_equal(found: sf.SwitchingResult, known: Estimates, tolerance: float = TOLERANCE) -> None:
    """One run, with the oracle."""
    assert_gaussians(found.x, found.P, known.x, known.P, tolerance)
    assert found.mode_probability is not None
    assert found.mode_probability.shape == known.mode.shape
    np.testing.assert_allclose(found.mode_probability, known.mode, rtol=0.0, atol=tolerance)
    assert_density(found, known.log_likelihood, tolerance)


def assert_density(found: sf.SwitchingResult, known: float, tolerance: float = TOLERANCE) -> None:
    """To the largest of its terms: a step adds at least about one."""
    assert isinstance(found.log_likelihood, float)
    scale = max(abs(known), float(found.x.size))
    assert abs(found.log_likelihood - known) <= tolerance * scale


def probability(result: sf.SwitchingResult) -> Array:
    assert result.mode_probability is not None
    return result.mode_probability


def arrays(result: sf.SwitchingResult) -> tuple[Array, ...]:
    """All that there is."""
    given = (result.x, result.P, result.mode_probability, result.log_likelihood)
    return tuple(np.asarray(a) for a in given if a is not None)


def assert_same_bits(found: sf.SwitchingResult, known: sf.SwitchingResult) -> None:
    for a, b in zip(arrays(found), arrays(known), strict=True):
        assert np.array_equal(a, b)
