"""What the monitor says of its risks, by drawing noise: 10,000 epochs of one sky.

Risks are made large enough to be counted (1e-2 and 1e-3); within five binomial deviations.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

import surefix as sf
from oracle.raim_monitor import Demand
from oracle.raim_solution import Epoch
from oracle.step import Array
from raim import scenes
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


def test_false_alarms(record_property: Callable[[str, object], None]) -> None:
    s = sky("straight")
    result = monitor(s.track, DEMAND).run(drawn(s, s.epochs[0], np.zeros(8)))
    share = float(np.mean(result.alarm))
    record_property("figure", f"false alarms of the track monitor: {share:.2%} for 1 %")
    assert near(share, 1e-2)
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


@pytest.mark.parametrize(("radius", "bias"), [(300.0, 50.0), (150.0, 40.0), (600.0, -50.0)])
def test_protection_holds_on_a_curve_whatever_the_fault(radius: float, bias: float) -> None:
    """Straight, a quarter of a circle, straight: the faulty satellite moves the estimate far enough
    along for the tangent to be no track. Given the fault, p_r/p_f = 1e-2 may be outside."""
    turn = np.linspace(0, np.pi / 2, 40)
    east = np.concatenate(
        [np.arange(0.0, 300.0, 5.0), 300 + radius * np.sin(turn), np.full(60, 300 + radius)]
    )
    north = np.concatenate([
        np.zeros(60), radius * (1 - np.cos(turn)), radius + np.linspace(5, 300, 60)
    ])  # fmt: skip
    track, random = sf.raim.Track(scenes.local(east, north)), np.random.RandomState(7)
    for seed, where in ((0, 290.0), (2, 290.0), (2, 300 + 0.78 * radius)):
        place = track.position(where)
        satellites = scenes.sky(np.random.RandomState(seed), place, 5)
        ranges = np.linalg.norm(satellites - place, axis=1)
        for faulty in range(5):
            errors = 3.0 * random.standard_normal((100, 5))
            errors[:, faulty] += bias
            data = sf.raim.Pseudoranges(
                np.repeat(np.arange(100.0), 5), [f"G{k}" for k in range(5)] * 100,
                np.tile(satellites, (100, 1)), (ranges + errors).ravel(), 3.0,
            )  # fmt: skip
            found = sf.raim.TrackRaim(
                track, length=100.0, risk=1e-5, fault_probability=1e-3, max_excluded=0,
                max_speed=1e-3,
            ).run(data, near=where)  # fmt: skip
            outside = found.usable & (np.abs(found.along - where) > found.protection)
            assert outside.sum() <= 5  # of 100; more than five of 1e-2: 5e-4
