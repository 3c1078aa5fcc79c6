"""Biases put on a recording: what is expected of them is what the monitor sees."""

from __future__ import annotations

import numpy as np
import pytest

import surefix as sf
from surefix import raim
from surefix.core.checks import FloatArray
from surefix.core.distributions import two_sided_quantile
from surefix.studies.recorded_alarms import alarm_shares, circle, whiteness
from surefix.studies.recorded_biases import inject, shows, summary
from surefix.studies.recorded_hypotheses import Hypotheses
from surefix.studies.recorded_station import Station, biased, clean, fitted

PLACE = raim.geodetic_to_ecef(50.0, 8.0, 100.0)
EPOCHS, SATELLITES, ZENITH = 60, 10, 1.0


def simulated(seed: int, constant: float = 0.0) -> Station:
    """Two systems; white noise of ``ZENITH`` / sin(elevation), and ``constant`` times that which
    stays the same for each satellite."""
    random = np.random.RandomState(seed)
    azimuth = 2 * np.pi * np.arange(SATELLITES) / SATELLITES
    elevation = random.uniform(0.3, 1.4, SATELLITES)
    level = np.cos(elevation)[:, None] * np.column_stack(
        [np.sin(azimuth), np.cos(azimuth), np.tan(elevation)]
    )
    sky = PLACE + 2.2e7 * level @ raim.local_axes(50.0, 8.0)
    names = [f"{'GE'[k % 2]}{k:02}" for k in range(SATELLITES)] * EPOCHS
    position = np.tile(sky, (EPOCHS, 1))
    spread = raim.elevation_sigma(raim.sky(PLACE, position)[0], ZENITH)
    noise = random.standard_normal(len(position))
    noise += np.tile(constant * random.standard_normal(SATELLITES), EPOCHS)
    ranges = np.linalg.norm(position - PLACE, axis=1) + 250.0 + spread * noise
    time = np.repeat(np.arange(float(EPOCHS)), SATELLITES)
    data = raim.Pseudoranges(time, names, position, ranges, 1.0, [name[0] for name in names])
    return Station("simulated", data, PLACE, 5.0, ZENITH, 50.0, 10)


@pytest.mark.parametrize("heading", [0.0, 90.0, 225.0])
def test_circle(heading: float) -> None:
    track = circle(PLACE, heading, 700.0)
    assert np.linalg.norm(track.position(0.0) - PLACE) < 1e-4
    assert track.curvature(100.0) == pytest.approx(1 / 700.0, rel=1e-3)
    east, north, up = raim.local_axes(50.0, 8.0) @ track.tangent(0.0)
    angle = np.radians(heading)
    assert [east, north] == pytest.approx([np.sin(angle), np.cos(angle)], abs=1e-6)
    assert up == pytest.approx(0.0, abs=1e-6)
    left: FloatArray = np.cross(raim.local_axes(50.0, 8.0)[2], track.tangent(0.0))
    assert (track.position(100.0) - PLACE) @ left > 0


def test_expected_statistic() -> None:
    """Λ of a bias on top of the epoch's own residuals, within what the track's bend may do to √Λ
    between the two solutions."""
    station = simulated(1)
    data = station.weighed(station.stated)
    result, known = shows(station.monitor(90.0), data)
    on = data.satellite == data.satellite[3]
    bias = np.where(on, 8.0, 0.0)
    measured = station.monitor(90.0).run(data.with_bias(bias))
    moved = float(np.abs(measured.along - result.along).max())
    track = circle(PLACE, 90.0)
    bend = raim.TrackRaim(track, length=50.0, interval=moved).run(data).bound
    off = np.sqrt(known.expected(bias)[on]) - np.sqrt(measured.statistic)
    assert (np.abs(off) <= bend).all()
    assert bend.max() < 0.05
    least = known.detectable(1e-3)
    np.testing.assert_allclose(known.predicted(least), 1 - 1e-3, rtol=1e-9)


def test_inject() -> None:
    station = simulated(2)
    data = station.weighed(station.stated)
    _, known = shows(station.monitor(0.0), data)
    found = inject(station.monitor(0.0, 2), data, known, 60.0, truth=0.0)
    figures = summary(found)
    assert figures["injected"] == EPOCHS * SATELLITES
    assert figures["as_expected"] == 1.0
    assert figures["detected"] == figures["right"] == figures["usable"] == 1.0
    assert figures["worst"] < figures["worst_before"]
    assert figures["unnoticed"] == figures["misleading"] == 0


def test_biased_at_the_predicted_rate() -> None:
    """White noise: rows of one epoch share its noise, so that there are as many samples as epochs
    at worst; four standard errors."""
    station = simulated(3)
    rows, _ = biased(station, 90.0, station.stated, (3.0, 6.0))
    for row in rows[:2]:
        p = row["predicted"]
        epochs = EPOCHS / station.every
        assert abs(row["detected"] - p) <= 4 * np.sqrt(p * (1 - p) / epochs)
    assert rows[-1]["unnoticed"] == 0.0


def test_white_and_constant() -> None:
    """α and no correlation with white noise; with errors that stay the same, neither."""
    white, constant = simulated(4), simulated(4, constant=3.0)
    figures = clean(white, 90.0, white.stated)
    for alpha in (1e-1, 1e-2):
        error = np.sqrt(alpha * (1 - alpha) / EPOCHS)
        assert abs(figures["alarms"]["all"][alpha] - alpha) <= 4 * error
    assert figures["whiteness"]["constant"] < 0.1
    assert abs(figures["whiteness"]["lag_1"]) < 4 / np.sqrt(EPOCHS)
    figures = clean(constant, 90.0, constant.stated)
    assert figures["alarms"]["all"][1e-2] == 1.0
    assert figures["whiteness"]["constant"] > 0.8
    assert figures["whiteness"]["independent"] < EPOCHS / 4


def test_fitted() -> None:
    """σ of each system; the residuals of n satellites and half of the epochs know it to 4 of their
    standard errors."""
    station = simulated(5)
    for zenith in fitted(station, 90.0).values():
        assert zenith == pytest.approx(ZENITH, rel=4 / np.sqrt(2 * EPOCHS / 2 * 3))


def test_hypotheses() -> None:
    """The monitor's position while all are healthy; with an outlier, that of the others."""
    station = simulated(7)
    data = station.weighed(station.stated)
    track, outage = circle(PLACE, 90.0), sf.Outage(probability=1e-4, span=400.0)
    epoch = data.where(data.epoch == 0)
    judge = Hypotheses(outage, earth_rotation=False)
    healthy = judge.run(track, epoch, 5.0, (0.0, 300.0))
    alone = station.monitor(90.0).run(epoch)
    assert healthy.along == pytest.approx(alone.along[0], abs=0.01 * alone.sigma[0])
    assert healthy.deviation == pytest.approx(alone.sigma[0], rel=0.01)
    low, high = healthy.limits(1e-5)
    assert high - low >= 2 * two_sided_quantile(1e-5) * alone.sigma[0]
    biased = judge.run(track, epoch.with_bias(np.eye(SATELLITES)[4] * 80.0), 0.0, (0.0, 300.0))
    assert biased.outlier[list(biased.rows).index(4)] > 0.99
    rest = station.monitor(90.0).run(epoch.where(np.arange(SATELLITES) != 4))
    assert biased.along == pytest.approx(rest.along[0], abs=0.01 * rest.sigma[0])
    assert not np.isfinite(healthy.limits(1e-300)).any()


def test_alarm_shares() -> None:
    station = simulated(6)
    result = station.monitor(0.0).run(station.weighed(station.stated))
    assert alarm_shares(result, (0.5,))[0.5] == np.mean(result.p_value <= 0.5)
    assert set(whiteness(station.data, result)["means"]) == set(station.data.satellite)
