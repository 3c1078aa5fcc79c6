"""Random scenes: a model, its sensors and a log, for the engine and for the oracle alike."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from math import inf

import numpy as np
from hypothesis import strategies as st

import surefix as sf
from oracle import models
from oracle import sensors as oracle
from oracle.step import Array

OSCILLATOR = models.Model(
    A=np.array([[0.0, 1.0], [-4.0, -0.3]]), L=np.eye(2), Qc=np.array([[0.1, 0.03], [0.03, 0.5]])
)

MODELS: dict[str, tuple[sf.Model, models.Model]] = {
    "speed": (sf.ConstantVelocity(0.7), models.constant_velocity(0.7, position=False)),
    "position, speed": (sf.ConstantVelocity(0.7, position=True), models.constant_velocity(0.7)),
    "speed, acceleration": (
        sf.ConstantAcceleration(jerk=0.3),
        models.constant_acceleration(0.3, position=False),
    ),
    "position, speed, acceleration": (
        sf.ConstantAcceleration(jerk=0.3, position=True),
        models.constant_acceleration(0.3),
    ),
    "oscillator": (sf.LinearModel(OSCILLATOR.A, OSCILLATOR.L, OSCILLATOR.Qc), OSCILLATOR),
}
GRID = 0.01  # s, period of the discrete model


@dataclass(frozen=True)
class Scene:
    """``rows``: (time, sensor index, value) in the order of the log."""

    model: sf.Model
    transition: oracle.Transition
    sensors: tuple[sf.Sensor, ...]
    x0: Array
    P0: Array
    rows: tuple[tuple[float, int, float], ...]

    @property
    def log(self) -> sf.Log:
        time, index, value = zip(*self.rows, strict=True)
        return sf.Log(time, [self.sensors[i].name for i in index], value)

    @property
    def filter(self) -> sf.DesyncFilter:
        return sf.DesyncFilter(self.model, self.sensors, self.x0, self.P0, start=0.0)

    @property
    def latest(self) -> float:
        """Of all validity times, rounded up to a tenth of a second."""
        valid = [time - self.sensors[i].latency for time, i, _ in self.rows]
        return float(np.ceil(10 * max([*valid, 0.1]))) / 10

    def permuted(self, seed: int) -> Scene:
        order = np.random.default_rng(seed).permutation(len(self.rows))
        return replace(self, rows=tuple(self.rows[i] for i in order))

    def expected(self, times: Array) -> oracle.Run:
        known = [
            oracle.Sensor(
                s.name,
                np.array(s.row(self.model)),
                s.sigma,
                s.latency,
                s.scale_sigma,
                s.bias_sigma,
                s.bias_time,
            )
            for s in self.sensors
        ]
        return oracle.run(self.transition, known, self.x0, self.P0, self.rows, times.tolist())


def exact_transition(name: str) -> oracle.Transition:
    """From the matrix exponential; of the discrete model, powers."""

    @cache
    def transition(dt: float) -> tuple[Array, Array]:
        if name != "discrete":
            F, Q, _ = models.van_loan(MODELS[name][1], dt)
            return F, Q
        F, Q = np.eye(2), np.zeros((2, 2))
        one_F, one_Q = models.van_loan(OSCILLATOR, GRID)[:2]
        for _ in range(round(dt / GRID)):
            F, Q = one_F @ F, one_F @ Q @ one_F.T + one_Q
        return F, Q

    return transition


def random_scene(
    seed: int,
    name: str = "speed, acceleration",
    *,
    count: int = 2,
    measurements: int = 30,
    duration: float = 5.0,
    scale: bool = False,
    bias: bool = False,
    latency: bool = False,
    observes: bool = False,
) -> Scene:
    """Readings simulated from the model along the oracle's transitions, at milliseconds (of the
    discrete model, at its periods). The flags give some of the sensors such errors, or rows."""
    rng = np.random.default_rng(seed)
    if name == "discrete":
        F, Q, _ = models.van_loan(OSCILLATOR, GRID)
        model: sf.Model = sf.DiscreteModel(F, Q, period=GRID)
    else:
        model = MODELS[name][0]
    n, grid = model.size, GRID if name == "discrete" else 1e-3

    def sometimes(flag: bool, value: float) -> float:
        return value if flag and rng.random() < 0.7 else 0.0

    chosen = tuple(
        sf.Sensor(
            f"s{i}",
            sigma=float(10.0 ** rng.uniform(-1.5, 0.5)),
            scale_sigma=sometimes(scale, 0.02),
            bias_sigma=sometimes(bias, 0.5),
            bias_time=float(rng.choice([2.0, 30.0, inf])),
            latency=round(sometimes(latency, float(rng.integers(-30, 60)) * GRID), 9),
            observes=tuple(rng.normal(size=n).tolist()) if observes and i % 2 else None,
        )
        for i in range(count)
    )
    transition = exact_transition(name)
    root = rng.normal(size=(n, n))
    P0 = root @ root.T + 0.1 * np.eye(n)
    x0 = rng.normal(size=n) + 10.0 * np.eye(n)[model.output]
    truth = rng.multivariate_normal(x0, P0, method="cholesky")
    scales = [rng.normal() * s.scale_sigma for s in chosen]
    biases = [rng.normal() * s.bias_sigma for s in chosen]
    ticks = np.sort(rng.integers(0, round(duration / grid), measurements))
    rows, now = [], 0
    for tick in ticks:
        F, Q = transition(round((int(tick) - now) * grid, 9))
        noise = np.linalg.eigh(Q)
        deviation = np.sqrt(np.maximum(noise.eigenvalues, 0.0)) * rng.normal(size=n)
        truth, now = F @ truth + noise.eigenvectors @ deviation, int(tick)
        i = int(rng.integers(count))
        s = chosen[i]
        value = (1.0 + scales[i]) * float(np.array(s.row(model)) @ truth) + biases[i]
        stamp = round(round(tick * grid, 9) + s.latency, 9)
        rows.append((stamp, i, value + s.sigma * float(rng.normal())))
    return Scene(model, transition, chosen, x0, P0, tuple(rows))


@st.composite
def scenes(
    draw: Callable[[st.SearchStrategy[int]], int],
    *,
    names: tuple[str, ...] = (*MODELS, "discrete"),
    scale: bool | None = None,
) -> Scene:
    """Scenes of every kind; ``scale`` is drawn where it is None."""

    def flag() -> bool:
        return bool(draw(st.integers(0, 1)))

    return random_scene(
        name=names[draw(st.integers(0, len(names) - 1))],
        count=draw(st.integers(1, 4)),
        measurements=draw(st.integers(1, 40)),
        scale=flag() if scale is None else scale,
        bias=flag(),
        latency=flag(),
        observes=flag(),
        seed=draw(st.integers(0, 2**32 - 1)),
    )
