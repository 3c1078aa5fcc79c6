"""Real recordings through the track monitor: the figures of docs/recordings-raim.md.

The recordings are not part of the repository; where they are absent these tests are skipped.
"""

from __future__ import annotations

import runpy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from surefix.studies.recorded_station import Station, biased, clean, fitted

EXAMPLES = Path(__file__).parents[2] / "examples"
EAST, NORTH = 90.0, 0.0

Folder = Callable[[str], Path]
Row = dict[str, Any]


def example(name: str) -> dict[str, Any]:
    """What a script of the examples defines."""
    return runpy.run_path(str(EXAMPLES / name))


def station(recording: Folder, name: str, every: int) -> Station:
    """As the example reads it, with biases on fewer epochs."""
    script = f"{name}/raim_{name.split('-')[1]}.py"
    found = example(script)["read"](recording(f"{name}/truth.csv").parent)
    return Station(
        found.name, found.data, found.position, found.mask, found.zenith, found.length, every
    )


def check_biases(rows: list[Row], independent: float, epochs: int) -> None:
    """``independent``: how many epochs the recording's are worth, each with an error of its own for
    every satellite; a share may be off by four standard errors of so many. ``epochs`` had biases.
    """
    for row in rows:
        p, satellites = row["predicted"], row["injected"] / (2 * epochs)
        error = np.sqrt(p * (1 - p) / (max(independent, 1.0) * satellites))
        assert abs(1 - row["unnoticed"] - p) <= 4 * error + 1 / row["injected"]
        # What is not as white noise has it is as the epoch's own residuals have it; but for a bias
        # on the threshold, or one so large that no solution is left to test.
        assert row["as_expected"] + (1 - row["usable"]) >= 1 - 2 / row["injected"]
        assert row["right"] == 1.0
    by_name = {row["bias"]: row for row in rows}
    for name in ("1.25 detectable", "1.5 detectable", "critical v*"):
        assert by_name[name]["unnoticed"] == 0.0


def test_geonet(recording: Folder) -> None:
    """Residuals that hardly change; every bias from 1.25 times the detectable one on is found, the
    right satellite is taken out, and no error is larger than its protection level."""
    place = station(recording, "gnss-geonet-0759", 6)
    zeniths = fitted(place, EAST)
    figures = clean(place, EAST, zeniths)
    assert figures["whiteness"]["lag_1"] > 0.8
    assert figures["whiteness"]["independent"] < 30 < figures["epochs"]
    assert figures["alarms"]["second"][1e-1] > 2 * 1e-1  # fitted to the first half
    assert figures["alarms"]["all"][1e-5] == 0.0
    rows, _ = biased(place, EAST, zeniths, (5.0, 20.0, 200.0))
    check_biases(rows, figures["whiteness"]["independent"], 20)
    assert all(row["misleading"] == 0 for row in rows)
    large = rows[2]
    assert large["detected"] == 1.0
    assert large["worst"] < large["protection"] < large["worst_before"]


def test_nagoya_east(recording: Folder) -> None:
    """Three systems: constant errors of the satellites, BeiDou's the largest, make up nearly all
    of Λ, so that the alarms of five minutes are all or none."""
    place = station(recording, "gnss-nagoya-rover", 150)
    zeniths = fitted(place, EAST)
    assert zeniths["C"] == max(zeniths.values())
    figures = clean(place, EAST, zeniths)
    assert figures["whiteness"]["constant"] > 0.9
    assert figures["whiteness"]["independent"] < 5
    assert set(figures["alarms"]["all"].values()) == {0.0}
    assert clean(place, EAST, place.stated)["alarms"]["all"][1e-4] == 1.0
    rows, _ = biased(place, EAST, zeniths, (10.0, 50.0))
    check_biases(rows, figures["whiteness"]["independent"], 3)
    assert all(row["misleading"] == 0 for row in rows)


def test_nagoya_north(recording: Folder) -> None:
    """The ionosphere moves all satellites: the position is 2 m off to the north, no residual shows
    it, and the protection level does not hold in most of the epochs."""
    place = station(recording, "gnss-nagoya-rover", 60)
    figures = clean(place, NORTH, place.stated)
    assert figures["alarms"]["all"][1e-1] == 0.0
    assert figures["mean_error"] > figures["protection"]
    assert figures["misleading"] > 0.5


@pytest.fixture(scope="module")
def car() -> dict[str, Any]:
    return example("car-smartloc/raim_smartloc.py")


def test_car_monitor(car: dict[str, Any], recording: Folder) -> None:
    """With the stated noise limits mislead a thousand times as often as claimed, and hardly an
    epoch passes the test. With the noise fitted to the first half all hold in the second, wherever
    the search begins: another place that fits as well is in them, and so is the bend."""
    drive = car["read"](recording("car-smartloc/truth.csv").parent, 10)
    sigma = car["noise_models"](drive)
    assert car["outliers"](drive, sigma["stated"]) > 0.2
    assert car["outliers"](drive, sigma["fitted"]) < 0.1
    stated = {
        (kind, risk): car["judged"](drive, limits, drive.back)
        for kind, risk, limits in car["monitored"](drive, sigma["stated"], [1e-5])
    }
    assert stated["no monitor", 1e-5]["misleading"] > 1000 * 1e-5
    assert stated["detection", 1e-5]["limits"] < 0.1
    assert stated["exclusion of 4", 1e-5]["limits"] > stated["exclusion of 2", 1e-5]["limits"]
    assert stated[car["MEASURED"], 1e-5]["limits"] == 0.0  # too many may be faulty at once
    epochs = car["alone"](drive, sigma["fitted"])
    searched, begun = (
        car["monitor"](drive, epochs, known, risk=1e-5, max_excluded=2) for known in (False, True)
    )
    off, held = (
        np.abs(found["along"] - drive.along) > found["half"] for found in (searched, begun)
    )
    assert np.sum(held & drive.back) == 0
    assert np.sum(off & drive.back) == 0
    some = np.isfinite(searched["half"][drive.back]).sum()
    assert 5 < some < 0.9 * np.isfinite(searched["along"][drive.back]).sum()  # corners have none


def test_car_hypotheses(car: dict[str, Any], recording: Folder) -> None:
    """Limits in every epoch; carried from one to the next with the wheel's speed they are much
    narrower, and still hold at 1e-9."""
    drive = car["read"](recording("car-smartloc/truth.csv").parent, 20)
    sigma = car["noise_models"](drive)["fitted"]
    guess = car["monitor"](drive, car["alone"](drive, sigma), max_excluded=4)["along"]
    every = np.ones(len(guess), dtype=bool)
    snapshot, carried = (car["robust"](drive, sigma, guess, on) for on in (False, True))
    rows = {name: {risk: car["judged"](drive, limits, every) for risk, limits in found.items()}
            for name, found in (("snapshot", snapshot), ("carried", carried))}  # fmt: skip
    assert all(row["limits"] == 1.0 for found in rows.values() for row in found.values())
    for risk in car["RISKS"]:
        assert rows["carried"][risk]["half_width"] < rows["snapshot"][risk]["half_width"] / 3
    assert rows["carried"][1e-9]["misleading"] == 0.0
    assert rows["snapshot"][1e-2]["misleading"] < 0.1


def test_availability(recording: Folder) -> None:
    """e₁ costs availability only where the track bends and the position is not known; what the
    tunnel hides is not available."""
    example_ = example("train-infrabel/availability_map.py")
    rows, drawn = example_["analyse"](
        recording("train-infrabel/track_28573.csv").parent,
        recording("car-smartloc/pseudoranges.csv").parent,
    )
    by_name = {(row["run"], row["scene"], row["length"]): row for row in rows}
    for row in rows:
        assert row["share_with_e1"] <= row["share"]
    bent, straight = 28573, 28876
    far = f"open, K ±{example_['FAR']:.0f} m"
    for length in example_["LENGTHS"]:
        near, wide = by_name[bent, "open", length], by_name[bent, far, length]
        assert near["share"] == wide["share"]
        assert wide["share_with_e1"] < near["share_with_e1"]
        assert by_name[bent, "cutting", length]["share"] < near["share"]
    assert by_name[straight, far, 40.0]["share_with_e1"] == 1.0
    tunnel = by_name[bent, "tunnel", 40.0]
    step = example_["STEP"] / tunnel["track"]
    assert tunnel["share"] == pytest.approx(1 - tunnel["tunnel"], abs=2 * step)
    assert not drawn.available[drawn.satellites == 0].any()
    assert np.isnan(drawn.protection[drawn.satellites == 0]).all()


def test_car_with_the_wheel(
    recording: Folder, monkeypatch: pytest.MonkeyPatch, car: dict[str, Any]
) -> None:
    """Position limits at 1e-5 of both sensors hold in the second half, within 25 m; satellites
    alone need twice as much, the wheel alone too."""
    folder = recording("car-smartloc/truth.csv").parent
    monkeypatch.syspath_prepend(str(EXAMPLES / "car-smartloc"))
    fusion = example("car-smartloc/fusion_smartloc.py")
    drive = car["read"](folder)
    true = fusion["truth"](drive, folder)
    log = fusion["fused_log"](
        drive, fusion["monitored"](drive, car["noise_models"](drive)["fitted"])
    )
    time, found = drive.data.epoch_time, {}
    for kind in fusion["KINDS"]:
        result = fusion["make_filter"](drive, kind, "position", 1e-5).run(log, rate=2.0)
        found[kind] = fusion["judge"](result, true["position"], "position", time, np.zeros(0))
        assert found[kind]["misleading"] == 0.0
    assert found["both"]["available"] == 1.0
    for kind in ("satellites", "wheel"):
        assert found[kind]["half_width"] > 2 * found["both"]["half_width"]
