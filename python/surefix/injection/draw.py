"""Faults drawn at random: when they begin, how large they are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from surefix.core import checks
from surefix.core.sensor import Sensor
from surefix.errors import ConfigError
from surefix.injection.fault import KINDS, InjectedFault
from surefix.log import Log


@dataclass(frozen=True)
class Sizes:
    """What is drawn: ``duration`` [s] of every fault; smallest and largest ``jump`` [unit of the
    output], ``ramp`` [unit / s] and ``scale`` [1], between which the logarithm of the size is
    uniform; either sign. The defaults are for speeds in m/s."""

    duration: float = 20.0
    jump: Sequence[float] = (1.0, 10.0)
    ramp: Sequence[float] = (0.05, 1.0)
    scale: Sequence[float] = (0.05, 0.5)

    def __post_init__(self) -> None:
        checks.positive("duration", self.duration)
        for name in ("jump", "ramp", "scale"):
            low, high = self.range(name)
            if not 0 < low <= high:
                raise ConfigError(f"{name}: expected 0 < smallest <= largest, got {low}, {high}")

    def range(self, kind: str) -> tuple[float, float]:
        """Smallest and largest size of a kind."""
        low, high = checks.array(kind, getattr(self, kind), (2,)).tolist()
        return low, high


def draw(
    log: Log,
    sensors: Sequence[Sensor],
    window: tuple[float, float],
    sizes: Sizes,
    seeds: int,
    seed: int,
) -> list[InjectedFault]:
    """For every sensor and every kind ``seeds`` faults, each of which begins at a reading and ends
    within ``window`` [s].

    Raises ConfigError if a sensor has no reading at which a fault could begin.
    """
    faults = []
    for s, sensor in enumerate(sensors):
        time = log.time[(log.sensor == sensor.name) & np.isfinite(log.value)]
        onsets = np.sort(time[(time >= window[0]) & (time <= window[1] - sizes.duration)])
        if len(onsets) == 0:
            raise ConfigError(
                f"duration: expected a reading of {sensor.name!r} from {window[0]:g} to "
                f"{window[1] - sizes.duration:g} s, at which a fault of {sizes.duration:g} s could "
                "begin, got none"
            )
        for k, kind in enumerate(KINDS):
            for i in range(seeds):
                random = np.random.RandomState([seed, s, k, i])  # adding seeds changes no other
                start = float(onsets[random.randint(len(onsets))])
                size = sensor.sigma
                if kind in ("jump", "ramp", "scale"):
                    low, high = np.log(sizes.range(kind))
                    size = random.choice([-1.0, 1.0]) * np.exp(random.uniform(low, high))
                faults.append(
                    InjectedFault(
                        sensor=sensor.name,
                        kind=kind,
                        start=start,
                        end=start + sizes.duration,
                        size=0.0 if kind == "freeze" else float(size),
                        seed=int(random.randint(2**31)),
                    )
                )
    return faults
