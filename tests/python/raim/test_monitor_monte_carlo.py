"""What the monitor says of its risks, by drawing noise: 10,000 epochs of one sky.

Risks are made large enough to be counted (1e-2 and 1e-3); within five binomial deviations.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import surefix as sf
from oracle.raim_monitor import Demand
from oracle.raim_solution import Epoch
from oracle.step import Array
from raim.scenes import Scene, curved_points, monitor, scene, straight_points

EPOCHS = 10_000
DEMAND = Demand(16.0, false_alarm=1e-2, risk=1e-4, fault_probability=1e-2, max_faults=2,
                max_excluded=0)  # fmt: skip
POINTS = {"straight": straight_points(), "curved": curved_points(radius=300.0)}


@cache
def sky(name: str) -> Scene:
    return scene(33, 1, POINTS[name], systems=(1, 1), satellites=(8, 8))


def drawn(s: Scene, e: Epoch, bias: Array, epochs: int = EPOCHS) -> sf.raim.Pseudoranges:
    """The epoch again and again with new noise, at the true mileage."""
    rng, n = np.random.RandomState(9), e.n
    exact = e.ranges(s.spline.position(float(s.truth[0]))) + 1234.5
    noise = e.sigma * rng.normal(size=(epochs, n))
    return sf.raim.Pseudoranges(
        np.repeat(np.arange(float(epochs)), n), [f"G{i:02d}" for i in range(n)] * epochs,
        np.tile(e.satellite, (epochs, 1)), (exact + bias + noise).ravel(), np.tile(e.sigma, epochs),
    )  # fmt: skip


def near(rate: float, p: float) -> bool:
    return bool(abs(rate - p) < 5.0 * np.sqrt(p * (1.0 - p) / EPOCHS))


def test_false_alarms() -> None:
    s = sky("straight")
    result = monitor(s.track, DEMAND).run(drawn(s, s.epochs[0], np.zeros(8)))
    assert near(float(np.mean(result.alarm)), 1e-2)
    z = (result.along - s.truth[0]) / result.sigma
    assert np.mean(z) == pytest.approx(0.0, abs=5.0 / np.sqrt(EPOCHS))
    assert np.std(z) == pytest.approx(1.0, abs=5.0 / np.sqrt(2 * EPOCHS))
    # the sum of all sets' alpha bounds the separation's; sets are dependent
    assert np.mean(result.separation_alarm) < 1e-2 + 5.0 * np.sqrt(1e-2 / EPOCHS)


def test_false_alarms_on_a_curve() -> None:
    """At most e_2 more."""
    s = sky("curved")
    result = monitor(s.track, DEMAND).run(drawn(s, s.epochs[0], np.zeros(8)))
    most = 1e-2 + float(result.e2.max())
    assert float(np.mean(result.alarm)) < most + 5.0 * np.sqrt(most / EPOCHS)


@cache
def worst(name: str, rank: int) -> tuple[int, float, float]:
    """The satellite whose critical fault is missed most (rank 1), or second most; how large it is,
    and how often it is missed."""
    s = sky(name)
    healthy = monitor(s.track, DEMAND).run(drawn(s, s.epochs[0], np.zeros(8), 1))
    i = int(np.argsort(healthy.missed_at_critical)[-rank])
    return i, float(healthy.critical_bias[i]), float(healthy.missed_at_critical[i])


@pytest.mark.parametrize("rank", [1, 2])
def test_critical_bias(rank: int) -> None:
    """It moves the estimate out of the interval with p_r / p_f, and is missed with p(i, v_i*)."""
    s = sky("straight")
    i, v, missed = worst("straight", rank)
    result = monitor(s.track, DEMAND).run(drawn(s, s.epochs[0], v * np.eye(8)[i]))
    outside = float(np.mean(np.abs(result.along - s.truth[0]) > DEMAND.length / 2))
    assert near(outside, 1e-2)
    assert 0.01 < missed < 0.99
    assert near(float(np.mean(~result.alarm)), missed)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_critical_bias_on_a_curve(sign: float) -> None:
    """It is missed at most e_1 more often than on a straight track."""
    s = sky("curved")
    i, v, _ = worst("curved", 1)
    result = monitor(s.track, DEMAND).run(drawn(s, s.epochs[0], sign * v * np.eye(8)[i]))
    most = float(np.max(result.p_star + result.e1))
    assert float(np.mean(~result.alarm)) < most + 5.0 * np.sqrt(most * (1.0 - most) / EPOCHS)


@pytest.mark.parametrize("size", [0.8, 1.2])
@pytest.mark.parametrize("rank", [1, 2])
def test_protection_holds_whatever_the_fault(size: float, rank: int) -> None:
    """Integrity: no alarm and yet outside, with a fault of any size, in no more than p_r / p_f."""
    s = sky("straight")
    i, v, _ = worst("straight", rank)
    result = monitor(s.track, DEMAND).run(drawn(s, s.epochs[0], size * v * np.eye(8)[i]))
    outside = np.abs(result.along - s.truth[0]) > result.protection
    quiet = ~result.alarm & ~result.separation_alarm
    assert np.isfinite(result.protection).all()
    assert np.mean(outside & quiet) <= 1e-2 + 5.0 * np.sqrt(1e-2 / EPOCHS)
