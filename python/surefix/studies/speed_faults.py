"""The fault modes that the studies of Bilenne's figures give a speed sensor: the paper's, and those
that last. One set of numbers for every drift and every train, chosen on other seeds."""

from __future__ import annotations

from typing import Any

import surefix as sf
from surefix.core.fault import FaultMode

PAPER_JERK = 0.08  # m/s³/√Hz
JERK = 0.1  # with the paper's, even a linear filter misses a healthy train that brakes by 1.3 m/s²
RISK = 1e-11
SPAN = 100.0  # m/s, "a large interval"

RATE = 1 / 3600  # 1/s: each sensor enters each mode once an hour
OUTAGE, DRIFT, FREEZE = 1.0, 5.0, 20.0  # s, mean durations
BIAS = 20.0  # m/s, standard deviation where a drift begins
WALK = 0.2  # m/s/√s
RESOLUTION = 0.01  # m/s, step of a sensor's output

PROBABILITY = 0.1  # that a sensor is faulty in any one step (the paper)

SETTINGS: dict[str, Any] = {
    "paper_jerk": PAPER_JERK, "jerk": JERK, "risk": RISK, "span": SPAN, "rate": RATE,
    "outage_duration": OUTAGE, "drift_duration": DRIFT, "freeze_duration": FREEZE, "sigma": BIAS,
    "walk": WALK, "resolution": RESOLUTION, "probability": PROBABILITY,
}  # fmt: skip


def outage_alone() -> tuple[FaultMode, ...]:
    """The paper's only mode, drawn anew in every step."""
    return (sf.Outage(span=SPAN, probability=PROBABILITY),)


def drawn_anew() -> tuple[FaultMode, ...]:
    """Outage and drift, both drawn anew in every step."""
    return (
        sf.Outage(span=SPAN, probability=PROBABILITY / 2),
        sf.Drifting(sigma=BIAS, walk=WALK, probability=PROBABILITY / 2),
    )


def carried() -> tuple[FaultMode, ...]:
    """Outage and drift that last; a drift's bias is carried from step to step."""
    return (
        sf.Outage(span=SPAN, rate=RATE, duration=OUTAGE),
        sf.Drifting(sigma=BIAS, walk=WALK, rate=RATE, duration=DRIFT),
    )


def carried_and_frozen() -> tuple[FaultMode, ...]:
    """Those of ``carried``, and an output that repeats."""
    frozen = sf.Frozen(resolution=RESOLUTION, span=SPAN, rate=RATE, duration=FREEZE)
    return (*carried(), frozen)
