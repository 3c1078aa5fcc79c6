"""What one rounding of the data does to the exact answer: no algorithm in doubles can be better.

If P0 is strongly correlated, or is seen by a measurement ten decades better than itself, the last
digit of P0 already decides the tenth digit of the result. Comparing an error with this sensitivity
separates a bad algorithm from a hard question.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from oracle.compare import covariance_error, state_error
from oracle.precise import Precise, update
from oracle.step import Array, Arrays
from oracle.strategies import Journey


def precise_journey(journey: Journey) -> list[Precise]:
    """The fifty-digit answer after every step, nothing rounded in between."""
    results: list[Precise] = []
    for step in journey.steps:
        if results:
            results.append(update(step, results[-1].x_digits, results[-1].P_digits))
        else:
            results.append(update(step, journey.x0, journey.P0))
    return results


def sensitivity(journey: Journey, seed: int = 0) -> tuple[float, float]:
    """Errors of x and P (see ``compare``) after the journey, each number of it moved by one eps."""
    rng = np.random.default_rng(seed)
    eps = float(np.finfo(np.float64).eps)

    def moved(a: Array) -> Array:
        return np.asarray(a * (1.0 + eps * rng.choice([-1.0, 1.0], a.shape)))

    def moved_covariance(a: Array) -> Array:
        lower = np.tril(moved(a))
        return np.asarray(lower + np.tril(lower, -1).T)

    def all_moved(blocks: Arrays) -> Arrays:
        return tuple(moved(block) for block in blocks)

    steps = tuple(
        replace(
            step,
            F=all_moved(step.F),
            Q=tuple(moved_covariance(Q) for Q in step.Q),
            H=all_moved(step.H),
            z=all_moved(step.z),
            G=all_moved(step.G),
            J=all_moved(step.J),
            Upsilon=moved_covariance(step.Upsilon),
        )
        for step in journey.steps
    )
    neighbour = Journey(moved(journey.x0), moved_covariance(journey.P0), steps, journey.decades)
    exact, other = precise_journey(journey)[-1], precise_journey(neighbour)[-1]
    return state_error(other.x, exact.x, exact.P), covariance_error(other.P, exact.P)
