"""What becomes of a result: counts, tables, logs for the filters."""

from __future__ import annotations

import numpy as np
import pytest

import surefix as sf
from raim.test_following import drive, hairpin


def result() -> sf.raim.RaimResult:
    """Ten epochs, of which one has a fault, one five faults, one three satellites."""
    track = hairpin(200.0)
    data = drive(track, np.linspace(100, 190, 10), 2.0, 5)
    bias = np.zeros(70)
    bias[2 * 7 + 3] = 90.0
    bias[5 * 7 : 5 * 7 + 5] = [60.0, -150.0, 200.0, -70.0, 320.0]
    sigma = np.where((data.epoch == 8) & (np.arange(70) % 7 > 2), np.inf, 2.0)
    few = data.with_bias(bias).with_sigma(sigma)
    few = few.where(~((data.epoch == 9) & (np.arange(70) % 7 > 1)))
    return sf.raim.TrackRaim(track, length=60.0, max_excluded=1).run(few, near=100.0)


def test_counts() -> None:
    found = result()
    assert found.declared[2] == "excluded"
    assert found.declared[5] == "alarm"
    assert found.status[8] == "ok"  # three satellites: one degree of freedom
    assert found.status[9] == "too few satellites"
    assert found.counts == {
        "not available": 1, "ok": 7, "excluded": 1, "alarm": 1,
        "not available: too few satellites": 1,
    }  # fmt: skip


def test_only_what_may_be_used_becomes_a_measurement() -> None:
    found = result()
    log = found.to_log("gps")
    assert log.names == ("gps",)
    assert log.time.tolist() == [0, 1, 2, 3, 4, 6, 7, 8]
    rows = [0, 1, 2, 3, 4, 6, 7, 8]
    np.testing.assert_array_equal(log.value, found.along[rows])
    assert log.sigma is not None
    np.testing.assert_array_equal(log.sigma, found.sigma[rows])
    filtered = sf.DesyncFilter(
        sf.ConstantVelocity(0.1, position=True),
        [sf.Sensor("gps", 1.0, observes=(1.0, 0.0))],
        [100.0, 10.0],
        np.diag([25.0, 1.0]),
    ).run(log)
    assert filtered.counts == {"ok": 8}
    assert abs(filtered.x[-1, 0] - 180.0) < 5 * np.sqrt(filtered.P[-1, 0, 0])


def test_tables_say_nothing_where_nothing_is_known() -> None:
    pytest.importorskip("pandas")
    found = result()
    frame = found.to_pandas()
    assert len(frame) == 10
    assert frame["clock"].notna().sum() == 9
    assert frame.loc[9, ["along", "sigma", "p_star", "protection"]].isna().all()
    assert frame.loc[9, "declared"] == "not available"


def test_a_satellite_counts_once_an_epoch() -> None:
    data = drive(hairpin(200.0), np.array([100.0, 110.0]), 2.0, 6)
    names = data.satellite.copy()
    names[9] = names[8]
    with pytest.raises(
        sf.ConfigError, match="satellite: expected each once an epoch, got 'G01' twice at 1 s"
    ):
        sf.raim.Pseudoranges(data.time, names, data.position, data.pseudorange, 1.0)
    systems = np.array(["G"] * 14)
    systems[9] = "E"  # E01 is another one
    sf.raim.Pseudoranges(data.time, names, data.position, data.pseudorange, 1.0, systems)


def test_more_than_it_can_hold() -> None:
    track = hairpin(200.0)
    data = drive(track, np.array([100.0]), 2.0, 7)
    many = sf.raim.Pseudoranges(
        np.zeros(70), [f"{k}" for k in range(70)], np.tile(data.position, (10, 1)),
        np.tile(data.pseudorange, 10), 2.0,
    )  # fmt: skip
    found = sf.raim.TrackRaim(track, length=50.0).run(many)
    assert found.status.tolist() == ["too many satellites"]
    assert np.isnan(found.along).all()


def test_progress_reaches_the_end() -> None:
    seen: list[tuple[int, int]] = []
    track = hairpin(200.0)
    data = drive(track, np.full(4100, 150.0), 2.0, 8)
    sf.raim.TrackRaim(track, length=50.0).run(
        data, near=150.0, progress=lambda done, total: seen.append((done, total))
    )
    assert seen == [(2000, 4100), (4000, 4100), (4100, 4100)]


@pytest.mark.parametrize("faulty", [3, 4])
def test_up_to_four_satellites_are_taken_out(faulty: int) -> None:
    track = hairpin(200.0)
    sky = drive(track, np.array([400.0, 400.0]), 1.0, 9)
    # Two epochs as one of fourteen satellites: the second half stands a little to the side.
    data = sf.raim.Pseudoranges(
        np.zeros(14), [f"{k}" for k in range(14)],
        sky.position + np.where(np.arange(14) < 7, 0.0, 1.0)[:, None] * [4e6, -3e6, 2e6],
        np.zeros(14), 1.0,
    )  # fmt: skip
    ranges = np.linalg.norm(data.position - track.position(400.0), axis=1)
    bias = np.zeros(14)
    bias[[1, 4, 8, 12][:faulty]] = [80.0, -120.0, 95.0, 140.0][:faulty]
    noisy = ranges + np.random.RandomState(10).standard_normal(14)
    found = sf.raim.TrackRaim(track, length=50.0, max_excluded=4).run(
        data.with_bias(noisy + bias), near=350.0
    )
    assert found.declared.tolist() == ["excluded"]
    np.testing.assert_array_equal(np.flatnonzero(found.excluded), np.flatnonzero(bias))
    assert abs(found.along[0] - 400.0) < 5 * found.sigma[0]
