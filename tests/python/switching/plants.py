"""Random plants, chains and measurements, for the oracle; the engine is not in it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from oracle.step import Array
from oracle.switching import Plant, at
from oracle.switching_chain import Chain

# gamma and delta: healthy, interrupted, and what the paper does not have.
LEVELS = ((1.0, 1.0), (0.0, 3.0), (-0.4, 2.0), (0.0, 0.2))


def covariance(rng: np.random.Generator, *shape: int) -> Array:
    root = rng.normal(size=(*shape, shape[-1]))
    return np.asarray(root @ np.swapaxes(root, -1, -2) + 0.3 * np.eye(shape[-1]))


def random_plant(seed: int, n: int, m: int, steps: int = 0, states: tuple[str, ...] = ()) -> Plant:
    """Another one in every one of ``steps``; without steps the same in all, and it stays finite."""
    rng = np.random.default_rng(seed)
    before, now = ((steps - 1,), (steps,)) if steps else ((), ())
    A = rng.normal(size=(*before, n, n)) / n
    if not steps:
        A *= 0.97 / np.abs(np.linalg.eigvals(A)).max()
    return Plant(
        A=A, H=rng.normal(size=(*now, m, n)), Q=covariance(rng, *before, n),
        R=covariance(rng, *now, m), x0=rng.normal(size=n), P0=covariance(rng, n), states=states,
    )  # fmt: skip


def random_chain(seed: int, modes: Sequence[tuple[float, float]], steps: int = 0) -> Chain:
    """Another one in every one of ``steps``; without steps the same in all."""
    rng, M = np.random.default_rng(seed), len(modes)
    transition = rng.dirichlet(np.ones(M), (steps - 1, M) if steps else M)
    return Chain(tuple(modes), transition, rng.dirichlet(np.ones(M)))


def simulated(
    plant: Plant, chain: Chain, steps: int, seed: int
) -> tuple[Array, np.ndarray[tuple[int], np.dtype[np.int64]], Array]:
    """States (steps, n), modes (steps,) and measurements (steps, m)."""
    rng = np.random.default_rng(seed)
    x, mode, xs, modes, zs = rng.multivariate_normal(plant.x0, plant.P0), 0, [], [], []
    for k in range(steps):
        if k > 0:
            x = at(plant.A, k - 1) @ x
            x = x + rng.multivariate_normal(np.zeros(len(x)), at(plant.Q, k - 1))
        law = chain.initial if k == 0 else at(chain.transition, k - 1)[mode]
        mode = int(rng.choice(len(law), p=law / law.sum()))
        gamma, delta = chain.gamma[mode], chain.delta[mode]
        R = delta * at(plant.R, k)
        zs.append(gamma * at(plant.H, k) @ x + rng.multivariate_normal(np.zeros(len(R)), R))
        xs.append(x)
        modes.append(mode)
    return np.array(xs), np.array(modes), np.array(zs)


def with_missing(z: Array, seed: int, share: float = 0.3) -> Array:
    """Single components, and whole measurements."""
    rng = np.random.default_rng(seed)
    gone = rng.random(z.shape) < share
    gone |= rng.random((*z.shape[:-1], 1)) < 0.5 * share
    return np.where(gone, np.nan, z)
