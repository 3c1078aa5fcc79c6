"""Random scenes with sensors that fail, for the robust filter and for the oracle alike."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

import surefix as sf
from desync import scenes
from oracle import fault_modes as oracle
from oracle import mode_chain, models
from oracle.fault_step import FaultStep, Measurement, Transition
from oracle.mixture import Mixture
from oracle.step import Array
from surefix.core.fault import FaultMode

THREE = models.Model(
    A=np.array([[-0.2, 1.0, 0.0], [-1.0, -0.1, 0.3], [0.0, 0.2, -0.5]]),
    L=np.array([[0.5, 0.0], [0.0, 0.3], [0.2, 0.1]]),
    Qc=np.array([[0.4, 0.1], [0.1, 0.6]]),
)
MODELS: dict[str, tuple[sf.Model, models.Model]] = {
    "speed": scenes.MODELS["speed"],
    "position, speed": scenes.MODELS["position, speed"],
    "speed, acceleration": scenes.MODELS["speed, acceleration"],
    "three states": (sf.LinearModel(THREE.A, THREE.L, THREE.Qc), THREE),
}
KINDS = ("outage", "noisy", "interrupted", "frozen", "drifting")


def random_fault(rng: np.random.Generator, kind: str) -> FaultMode:
    """With both kinds of prior."""
    prior: dict[str, Any] = {
        "probability": float(10.0 ** rng.uniform(-4, -1)),
        "rate": float(10.0 ** rng.uniform(-5, -1)),
        "duration": float(10.0 ** rng.uniform(-1, 2)),
    }
    if kind == "outage":
        return sf.Outage(span=float(rng.uniform(20, 100)), **prior)
    if kind == "noisy":
        return sf.Noisy(factor=float(10.0 ** rng.uniform(-1, 4)), **prior)
    if kind == "interrupted":
        return sf.Interrupted(factor=float(rng.uniform(0.5, 5)), **prior)
    if kind == "frozen":
        return sf.Frozen(resolution=0.01, span=80.0, change=float(rng.uniform(0.001, 0.1)), **prior)
    return sf.Drifting(
        sigma=float(rng.uniform(0.5, 5)), walk=float(rng.choice([0.0, 0.7])),
        factor=float(rng.choice([1.0, 30.0])), **prior,
    )  # fmt: skip


def twin(fault: FaultMode) -> oracle.Mode:
    """The oracle's mode."""
    if isinstance(fault, sf.Outage):
        return oracle.Outage(fault.span)
    if isinstance(fault, sf.Noisy):
        return oracle.Noisy(fault.factor)
    if isinstance(fault, sf.Interrupted):
        return oracle.Interrupted(fault.factor)
    if isinstance(fault, sf.Frozen):
        return oracle.Frozen(fault.change, fault.resolution, fault.span)
    assert isinstance(fault, sf.Drifting)
    return oracle.Drifting(fault.sigma, fault.walk, fault.factor)


@dataclass(frozen=True)
class FaultScene:
    """``rows``: (validity, sensor index, value) in the order of validity."""

    model: sf.Model
    transition: Transition
    sensors: tuple[sf.Sensor, ...]
    x0: Array
    P0: Array
    rows: tuple[Measurement, ...]

    def filter(self, **options: Any) -> sf.RobustFilter:
        """Nothing is cut, unless the options say so."""
        arguments = {"start": 0.0, "cut": 0.0, "carry": "cut", **options}
        return sf.RobustFilter(self.model, self.sensors, self.x0, self.P0, **arguments)

    @property
    def known(self) -> tuple[oracle.FallibleSensor, ...]:
        sensors = []
        for s in self.sensors:
            p = [f.probability or 0.0 for f in s.faults]
            modes = (oracle.Healthy(), *map(twin, s.faults))
            h = np.array(s.row(self.model))
            sensors.append(oracle.FallibleSensor(h, s.sigma, modes, (1.0 - sum(p), *p)))
        return tuple(sensors)

    def generator(self, events: Sequence[mode_chain.CommonEvent] = ()) -> Array:
        """Of the joint chain."""
        stars = [
            mode_chain.star(
                [f.rate or 0.0 for f in s.faults], [f.duration or 0.0 for f in s.faults]
            )
            for s in self.sensors
        ]
        return mode_chain.joint(stars, events)

    def log_stationary(self) -> Array:
        """Of the joint chain: p_m = p_0 λ_m d_m for each sensor, and they are independent. (A
        solution of p G = 0 has an absolute error, which is too much for the rarest modes.)"""
        total = np.zeros(1)
        for s in self.sensors:
            p = np.array([1.0, *((f.rate or 0.0) * (f.duration or 0.0) for f in s.faults)])
            total = np.add.outer(total, np.log(p / p.sum())).ravel()
        return total

    def step(self, t0: float, t1: float, x: Array, P: Array, last: Any = ()) -> FaultStep:
        """After t0, or from the start on."""
        rows = tuple(r for r in self.rows if t0 < r[0] <= t1 or r[0] == t0 == 0.0)
        return FaultStep(t0, t1, x, P, self.transition, self.known, rows, last)

    def push(self, filter: sf.RobustFilter, until: float = np.inf, after: float = -1.0) -> None:
        for valid, s, value in self.rows:
            if after < valid <= until:
                stamp = round(valid + self.sensors[s].latency, 9)
                assert filter.push(stamp, self.sensors[s].name, value).name == "ok"

    @property
    def log(self) -> sf.Log:
        stamps = [round(t + self.sensors[s].latency, 9) for t, s, _ in self.rows]
        names = [self.sensors[s].name for _, s, _ in self.rows]
        return sf.Log(stamps, names, [z for _, _, z in self.rows])


def exact_transition(name: str) -> Transition:
    @cache
    def transition(dt: float) -> tuple[Array, Array]:
        F, Q, _ = models.van_loan(MODELS[name][1], dt)
        return F, Q

    return transition


def random_scene(
    seed: int,
    name: str = "speed, acceleration",
    kinds: Sequence[Sequence[str]] = (KINDS, ("outage",)),
    *,
    measurements: int = 8,
    duration: float = 1.0,
) -> FaultScene:
    """One sensor for each entry of ``kinds``, in one of its modes for the whole of the scene."""
    rng, (model, _) = np.random.default_rng(seed), MODELS[name]
    transition, n = exact_transition(name), MODELS[name][0].size
    sensors = tuple(
        sf.Sensor(
            f"s{i}",
            sigma=float(10.0 ** rng.uniform(-1, 0.3)),
            latency=float(rng.integers(-3, 5)) / 100,
            observes=tuple(rng.normal(size=n).tolist()) if i % 2 else None,
            faults=tuple(random_fault(rng, kind) for kind in chosen),
        )
        for i, chosen in enumerate(kinds)
    )
    root = rng.normal(size=(n, n))
    P0, x0 = root @ root.T + 0.1 * np.eye(n), rng.normal(size=n) + 10.0 * np.eye(n)[model.output]
    truth = rng.multivariate_normal(x0, P0, method="cholesky")
    modes = [twin(s.faults[k - 1]) if k else None for s in sensors
             for k in [int(rng.integers(len(s.faults) + 1))]]  # fmt: skip
    bias, rows = rng.normal(size=len(sensors)), []
    last: dict[int, float] = {}
    for tick in np.sort(rng.choice(round(1000 * duration) + 1, measurements, replace=False)):
        i = int(rng.integers(len(sensors)))
        s, mode, v = sensors[i], modes[i], float(rng.normal())
        value = float(np.array(s.row(model)) @ transition(tick / 1000)[0] @ truth) + s.sigma * v
        if isinstance(mode, oracle.Outage):
            value = mode.span * float(rng.uniform(-0.5, 0.5))
        elif isinstance(mode, oracle.Interrupted):
            value = s.sigma * v
        elif isinstance(mode, oracle.Frozen):
            value = last.get(i, value)
        elif isinstance(mode, oracle.Drifting):
            value += mode.b0 * float(bias[i])
        last[i] = value
        rows.append((int(tick) / 1000, i, value))
    return FaultScene(model, transition, sensors, x0, P0, tuple(rows))


def by_modes(
    modes: npt.NDArray[np.integer[Any]], log_weight: Array, x: Array, P: Array
) -> dict[tuple[int, ...], tuple[float, Array, Array]]:
    """Log-weight, mean and covariance of all components in the same modes."""
    out = {}
    for vector in sorted({tuple(int(m) for m in row) for row in modes}):
        mine = (modes == vector).all(axis=1)
        total = float(np.logaddexp.reduce(log_weight[mine]))
        w = np.exp(log_weight[mine] - total)
        mean = w @ x[mine]
        Delta = x[mine] - mean
        out[vector] = (total, mean, np.einsum("k,kij->ij", w, P[mine])
                       + np.einsum("k,ki,kj->ij", w, Delta, Delta))  # fmt: skip
    return out


def grouped(mixture: Mixture) -> dict[tuple[int, ...], tuple[float, Array, Array]]:
    return by_modes(mixture.labels, mixture.log_weight, mixture.xs, mixture.Ps)


CARRIES = ("one", "merge", "cut")
FIELDS = ("x", "P", "lower", "upper", "mode_probability", "discarded_mass", "sse",
          "degrees_of_freedom")  # fmt: skip
FAULTS = (
    sf.Outage(span=50.0, rate=1e-3, duration=10.0),
    sf.Drifting(sigma=3.0, walk=0.5, rate=1e-3, duration=20.0),
)
A = sf.Sensor("a", 0.5, faults=FAULTS)
B = sf.Sensor("b", 0.3, latency=0.25, faults=FAULTS[:1])


def make(model: sf.Model | None = None, **options: Any) -> sf.RobustFilter:
    """A small filter of sensors a and b around 20 m/s."""
    model = model or sf.ConstantAcceleration(jerk=0.3)
    x0, P0 = 20.0 * np.eye(model.size)[model.output], 4.0 * np.eye(model.size)
    return sf.RobustFilter(model, [A, B], x0, P0, **{"start": 0.0, **options})


def bits(estimate: sf.RobustEstimate) -> tuple[Any, ...]:
    """All of an estimate, to the last bit."""
    values = (np.asarray(getattr(estimate, name)).tobytes() for name in FIELDS)
    return (estimate.time, estimate.hypothesis, *values)


def frozen(saved: dict[str, Any]) -> str:
    """All of a saved filter but its counters, to the last bit, in a form that compares."""
    with np.printoptions(precision=17, floatmode="unique", threshold=10**6):
        return repr(sorted((key, value) for key, value in saved.items() if key != "counters"))
