"""Positions of one epoch after the other, on tracks that come near to themselves."""

from __future__ import annotations

import numpy as np
import pytest

import surefix as sf
from oracle.raim_geodesy import geodetic_to_ecef, local_axes
from oracle.step import Array
from raim.scenes import ORIGIN, local

SKY = np.radians([(15, 35), (70, 60), (130, 25), (190, 50), (250, 30), (300, 65), (340, 20)])


def hairpin(apart: float) -> sf.raim.Track:
    """1 km out to the east and back again ``apart`` metres to the north."""
    radius, straight = apart / 2, np.linspace(0.0, 1000.0, 101)
    turn = np.linspace(-np.pi / 2, np.pi / 2, 41)[1:-1]
    east = np.concatenate([straight, 1000 + radius * np.cos(turn), straight[::-1]])
    north = np.concatenate([0 * straight, radius + radius * np.sin(turn), 0 * straight + apart])
    return sf.raim.Track(local(east, north))


def satellites() -> Array:
    azimuth, elevation = SKY.T
    direction = np.column_stack(
        [
            np.sin(azimuth) * np.cos(elevation),
            np.cos(azimuth) * np.cos(elevation),
            np.sin(elevation),
        ]
    )
    return geodetic_to_ecef(*ORIGIN) + 2.3e7 * direction @ local_axes(*ORIGIN[:2])


def drive(track: sf.raim.Track, along: Array, sigma: float, seed: int) -> sf.raim.Pseudoranges:
    """Noisy epochs a second apart at these mileages, with a clock."""
    sky, T = satellites(), len(along)
    n, random = len(sky), np.random.RandomState(seed)
    ranges = np.linalg.norm(sky[None] - track.position(along)[:, None], axis=2) + 77.0
    return sf.raim.Pseudoranges(
        np.repeat(np.arange(float(T)), n), [f"G{k:02}" for k in range(n)] * T,
        np.tile(sky, (T, 1)), ranges.ravel() + sigma * random.standard_normal(T * n), sigma,
    )  # fmt: skip


def test_the_motion_tells_the_branches_apart_until_both_can_be_reached() -> None:
    """Out and back 5 m apart with a noise of 5 m: an epoch alone does not know which way it goes,
    one after the other from a known start they do, up to the bend; and from there they say so."""
    track = hairpin(5.0)
    truth = np.linspace(100.0, track.length - 100.0, 95)
    data = drive(track, truth, 5.0, 1)
    followed = sf.raim.TrackRaim(track, length=60.0, max_speed=25.0).run(data, near=100.0)
    error, sigma = np.abs(followed.along - truth), followed.sigma.max()
    sure = followed.rival == 0
    assert sure[:35].all()  # the bend is two seconds and a protection level ahead
    assert not sure[60:].any()  # it may have turned back: nothing says that it went round
    assert error[sure].max() < 6 * sigma
    assert (error < followed.rival + 6 * sigma).all()
    assert followed.rival[40:55].max() > 20.0
    assert (followed.status == "ok").all()


def test_another_place_that_passes_is_in_the_protection_level() -> None:
    track = hairpin(5.0)
    truth = np.array([300.0])
    other = track.length - 300.0
    found = sf.raim.TrackRaim(track, length=60.0).run(drive(track, truth, 5.0, 2))
    near = sf.raim.TrackRaim(track, length=60.0, max_speed=1.0).run(
        drive(track, truth, 5.0, 2), near=300.0
    )
    assert found.rival[0] == pytest.approx(other - 300.0, abs=40)
    assert near.rival[0] == 0.0  # it was told where it is
    alone = near.protection[0]
    assert found.protection[0] == pytest.approx(found.rival[0] + alone, rel=0.1)
    assert abs(found.along[0] - 300.0) < found.protection[0]


def test_no_rival_where_branches_are_apart() -> None:
    """100 m apart with a noise of 2 m: the other branch alarms."""
    track = hairpin(100.0)
    truth = np.array([300.0, 900.0, 1500.0])
    found = sf.raim.TrackRaim(track, length=60.0).run(drive(track, truth, 2.0, 3))
    assert found.rival[0] == 0.0
    np.testing.assert_allclose(found.along, truth, atol=6 * 2.0)


def test_what_it_may_have_gone_grows_with_the_time() -> None:
    """After a tunnel of 40 s the position is found again, if the speed allows for it."""
    track = hairpin(200.0)
    truth = np.concatenate([np.full(3, 200.0), np.full(3, 900.0)])
    data = drive(track, truth, 2.0, 4)
    times = np.array([0.0, 1.0, 2.0, 42.0, 43.0, 44.0])
    moved = sf.raim.Pseudoranges(
        times[data.epoch], data.satellite, data.position, data.pseudorange, data.sigma
    )
    fast = sf.raim.TrackRaim(track, length=60.0, max_speed=20.0).run(moved, near=200.0)
    slow = sf.raim.TrackRaim(track, length=60.0, max_speed=2.0).run(moved, near=200.0)
    np.testing.assert_allclose(fast.along, truth, atol=12.0)
    assert slow.declared[3:].tolist() == ["not available"] * 3
    assert slow.status[3:].tolist() == ["off track"] * 3
    assert np.isnan(slow.along[3:]).all()


def test_a_rival_is_not_forgotten() -> None:
    """A start that nobody knows, on branches that noise does not tell apart: wherever it is looked
    for next contains both, so that the level holds at 1e-3 a step, not in the first epoch only."""
    track, wrong = hairpin(12.0), 0
    for seed in range(30):
        truth = np.linspace(500.0, 640.0, 8)
        data = drive(track, truth, 5.0, seed)
        for speed in (40.0, np.inf):
            found = sf.raim.TrackRaim(track, length=100.0, risk=1e-3, max_speed=speed).run(data)
            wrong += int((np.abs(found.along - truth) > found.protection).sum())
    assert wrong <= 3  # of 480; 3 are expected at the most


def test_max_speed_is_checked() -> None:
    with pytest.raises(sf.ConfigError, match="max_speed: expected a number > 0, got 0"):
        sf.raim.TrackRaim(hairpin(5.0), length=50.0, max_speed=0.0)
