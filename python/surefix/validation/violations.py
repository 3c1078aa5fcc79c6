"""The scenario that the filter assumes, and scenarios that break one of its assumptions."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass

import surefix as sf
from surefix.validation.importance import FEW_PROPOSALS, PROPOSALS, SHARED_PROPOSALS, Proposal
from surefix.validation.scenario import Scenario, SharedDrift

OUTAGE = sf.Outage(span=80.0, rate=0.02, duration=3.0)
DRIFT = sf.Drifting(sigma=2.0, walk=0.3, rate=0.02, duration=5.0)
ASSUMED = Scenario(
    model=sf.ConstantAcceleration(jerk=0.3),
    sensors=(
        sf.Sensor("wheel", sigma=0.3, faults=(DRIFT,)),
        sf.Sensor("radar", sigma=0.5, faults=(OUTAGE, DRIFT)),
        sf.Sensor("gps", sigma=0.4, latency=0.2, faults=(OUTAGE,)),
    ),
    hz=(4.0, 4.0, 2.0),
    x0=(20.0, 0.0),
    P0=(1.0, 0.25),
    step=1.0,
    steps=10,
    centre=20.0,
)

FASTER, LATER, NOISIER = 5.0, 0.5, 1.5
SHARED = SharedDrift(("wheel", "radar"), rate=0.02, duration=5.0, sigma=2.0, walk=0.3)


@dataclass(frozen=True)
class Setting:
    """What is measured: ``true``, the scenario simulated; ``assumed``, the filter's."""

    title: str
    true: Scenario
    assumed: Scenario = ASSUMED
    window: int = 2
    """Steps of which the modes are gone through, ``condition``."""
    proposals: tuple[Proposal, ...] = PROPOSALS
    exact: bool = False
    """The filter merges and cuts nothing: the measured risk must be the claimed one."""


def _faster(scenario: Scenario) -> Scenario:
    drift = dataclasses.replace(DRIFT, walk=FASTER * DRIFT.walk)
    return _each(
        scenario,
        lambda s: dataclasses.replace(
            s, faults=tuple(drift if f == DRIFT else f for f in s.faults)
        ),
    )


def _later(scenario: Scenario) -> Scenario:
    return _each(
        scenario,
        lambda s: dataclasses.replace(s, latency=s.latency + LATER) if s.name == "gps" else s,
    )


def _noisier(scenario: Scenario) -> Scenario:
    return _each(scenario, lambda s: dataclasses.replace(s, sigma=NOISIER * s.sigma))


def _each(scenario: Scenario, change: Callable[[sf.Sensor], sf.Sensor]) -> Scenario:
    return dataclasses.replace(scenario, sensors=tuple(map(change, scenario.sensors)))


LINEAR = _each(ASSUMED, lambda sensor: dataclasses.replace(sensor, faults=()))
SHORT = dataclasses.replace(ASSUMED, steps=3)

SETTINGS = {
    "linear": Setting("no faults: known answer", LINEAR, LINEAR, exact=True),
    "exact": Setting("nothing merged or cut, 3 steps: known answer", SHORT, SHORT, exact=True),
    "own": Setting("its own model, merged and cut", ASSUMED, window=3),
    "drift-rate": Setting(f"drifts wander {FASTER:g} × as fast", _faster(ASSUMED)),
    "latency": Setting(
        f"gps {LATER:g} s later than assumed", _later(ASSUMED), proposals=FEW_PROPOSALS
    ),
    "sigma": Setting(f"noise {NOISIER:g} × as large", _noisier(ASSUMED)),
    "common-mode": Setting(
        "wheel and radar drift alike, not foreseen",
        dataclasses.replace(ASSUMED, shared=SHARED),
        proposals=SHARED_PROPOSALS,
    ),
}
