"""Random journeys for Hypothesis.

Hypothesis draws sizes, flags and a seed; the numbers come from a NumPy generator. So examples
shrink towards few states, few measurements and plain flags, and every example is well scaled:
the transitions of a step multiply to a condition number of at most about e^2, and the
measurements are simulated from the model, so that no innovation is absurd.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from hypothesis import strategies as st

from oracle.step import Array, Step, block_diagonal

MAX_MEASUREMENTS = 40


@dataclass(frozen=True)
class Journey:
    """A prior, and the steps that follow it."""

    x0: Array  # (n,)
    P0: Array  # (n, n)
    steps: tuple[Step, ...]
    decades: int  # the variances in P0, Q and R are spread over this many powers of ten


def random_journey(
    seed: int,
    *,
    n: int = 3,
    measurements: int = 12,
    step_count: int = 2,
    largest: int = 1,
    inputs: int = 0,
    decades: int = 2,
    singular: bool = False,
    full: bool = False,
) -> Journey:
    """A journey of ``measurements`` scalars, in observations of 1..``largest`` of them.

    ``inputs`` is the size p of u; ``singular`` makes some transitions singular; ``full``
    correlates the measurement noise within each step.
    """
    rng = np.random.default_rng(seed)

    def covariance(size: int, rank: int, scale: float = 1.0) -> Array:
        """A random covariance with ``rank`` axes, in a random frame."""
        root = np.linalg.qr(rng.normal(size=(size, size)))[0] * _variances(size) ** 0.5
        root[:, rank:] = 0.0
        return np.asarray(scale * root @ root.T)

    def _variances(size: int) -> Array:
        return np.asarray(10.0 ** rng.uniform(-0.5 * decades, 0.5 * decades, size))

    def noise(Sigma: Array) -> Array:
        values, vectors = np.linalg.eigh(Sigma)
        deviations = np.sqrt(np.maximum(values, 0.0))
        return np.asarray(vectors @ (deviations * rng.normal(size=len(Sigma))))

    def transition(legs: int) -> Array:
        F = np.eye(n) + rng.uniform(-1.0, 1.0, (n, n)) / (n * legs)
        if rng.random() < 0.3:
            F = F @ np.linalg.qr(rng.normal(size=(n, n)))[0]
        if singular and rng.random() < 0.3:
            axis = rng.normal(size=n)
            F -= np.outer(F @ axis, axis) / (axis @ axis)
        return np.asarray(F)

    x0, P0 = rng.normal(size=n), covariance(n, n)
    truth = x0 + noise(P0)
    steps = []
    for share in rng.multinomial(measurements, np.full(step_count, 1.0 / step_count)):
        sizes: list[int] = []
        while sum(sizes) < share:
            sizes.append(int(min(rng.integers(1, largest + 1), share - sum(sizes))))
        legs = len(sizes) + 1
        F = [transition(legs) for _ in range(legs)]
        Q = [covariance(n, int(rng.integers(0, n + 1)), 1.0 / legs) for _ in range(legs)]
        H = [rng.normal(size=(m, n)) for m in sizes]
        R = [covariance(m, m) for m in sizes]
        u = [rng.normal(size=inputs) for _ in range(legs)]
        G = [rng.normal(size=(n, inputs)) for _ in range(legs)]
        J = [rng.normal(size=(m, inputs)) for m in sizes]
        Upsilon = block_diagonal(R)
        if full and len(Upsilon):
            mixing = np.eye(len(Upsilon)) + rng.normal(size=Upsilon.shape) / (2 * len(Upsilon))
            Upsilon = mixing @ Upsilon @ mixing.T
        v = noise(Upsilon)
        z: list[Array] = []
        for i in range(legs):
            truth = F[i] @ truth + G[i] @ u[i] + noise(Q[i])
            if i < len(sizes):
                rows = slice(sum(sizes[:i]), sum(sizes[: i + 1]))
                z.append(H[i] @ truth + J[i] @ u[i] + v[rows])
        legs_data = tuple(F), tuple(Q), tuple(H), tuple(R), tuple(z)
        steps.append(Step(*legs_data, tuple(u), tuple(G), tuple(J), Upsilon))
    return Journey(x0, P0, tuple(steps), decades)


@st.composite
def journeys(
    draw: Callable[[st.SearchStrategy[int]], int],
    *,
    max_steps: int = 4,
    max_decades: int = 10,
    singular: bool | None = None,
    full: bool | None = None,
) -> Journey:
    """Journeys of every kind; ``singular`` and ``full`` are drawn where they are None."""

    def flag(value: bool | None) -> bool:
        return bool(draw(st.integers(0, 1))) if value is None else value

    return random_journey(
        n=draw(st.integers(1, 6)),
        measurements=draw(st.integers(0, MAX_MEASUREMENTS)),
        step_count=draw(st.integers(1, max_steps)),
        largest=draw(st.integers(1, 3)),
        inputs=draw(st.integers(0, 2)),
        decades=draw(st.integers(0, max_decades)),
        singular=flag(singular),
        full=flag(full),
        seed=draw(st.integers(0, 2**32 - 1)),
    )
