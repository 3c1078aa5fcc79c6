"""Real recordings through the drift detectors: the figures of docs/recordings.md.

The recordings are not part of the repository; where they are absent these tests are skipped.
"""

from __future__ import annotations

import runpy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import surefix as sf

EXAMPLES = Path(__file__).parents[2] / "examples"

Folder = Callable[[str], Path]
Row = dict[str, Any]


def example(name: str) -> dict[str, Any]:
    """What a script of the examples defines."""
    return runpy.run_path(str(EXAMPLES / name))


@pytest.fixture(scope="module")
def rotor() -> dict[str, Any]:
    return example("rotor-rosa/find_drift_rotor.py")


@pytest.fixture(scope="module")
def tep() -> dict[str, Any]:
    return example("tep/find_drift_tep.py")


@pytest.fixture(scope="module")
def train() -> dict[str, Any]:
    return example("train-infrabel/find_drift_train.py")


@pytest.fixture(scope="module")
def comma() -> dict[str, Any]:
    return example("car-comma2k19/find_drift_comma2k19.py")


@pytest.fixture(scope="module")
def kingston() -> dict[str, Any]:
    return example("car-kingston/find_drift_kingston.py")


def loads(rotor: dict[str, Any], path: Path) -> dict[str, sf.OnsetResult]:
    """Of a recording, by profile, against the bound."""
    record = rotor["speed_record"](rotor["read"](path))
    return {
        kind: sf.OnsetDetector(profile, samples=0).run(record)
        for kind, profile in rotor["PROFILES"].items()
    }


def test_rotor_healthy(rotor: dict[str, Any], recording: Folder) -> None:
    """White, and no load, also in the recording that was not fitted."""
    for name in ("healthy_101", "healthy_103"):
        path = recording(f"rotor-rosa/{name}.csv")
        record = rotor["speed_record"](rotor["read"](path))
        assert record.nis[100:].mean() == pytest.approx(1.0, abs=0.05)
        assert not any(found.detected for found in loads(rotor, path).values())


@pytest.mark.parametrize(
    ("name", "label"),
    [("damping_401", 5.848), ("damping_403", 15.493), ("lateral_200", 7.237),
     ("vibration_301", 1.646), ("vibration_303", 3.325)],
)  # fmt: skip
def test_rotor_loads(rotor: dict[str, Any], recording: Folder, name: str, label: float) -> None:
    found = loads(rotor, recording(f"rotor-rosa/{name}.csv"))["step"]
    assert found.detected
    assert found.onset == pytest.approx(label, abs=0.25)


def test_rotor_lateral_load_is_not_a_step(rotor: dict[str, Any], recording: Folder) -> None:
    """It takes half a second; the exponential begins at the label."""
    found = loads(rotor, recording("rotor-rosa/lateral_202.csv"))
    slow, step = found["exponential 0.3 s"], found["step"]
    assert slow.onset == pytest.approx(3.411, abs=0.1)
    assert isinstance(slow.drop, float)
    assert isinstance(step.drop, float)
    assert slow.drop > step.drop + 50


def test_rotor_vibration(rotor: dict[str, Any], recording: Folder) -> None:
    """Of the force, in one of the two recordings; the healthy ones have none to look at."""
    data = rotor["read"](recording("rotor-rosa/vibration_301.csv"))
    sections = list(rotor["sections"](data))
    assert [frequency for _, _, frequency in sections] == [5.0, 25.0, 12.0, 3.0]
    for begin, end, frequency in sections:
        record = rotor["force_record"](rotor["part"](data, begin, end))
        found = sf.SpectrumDetector(samples=0).run(record)
        assert found.detected
        assert found.refined_frequency == pytest.approx(frequency, abs=0.7)
    other = rotor["read"](recording("rotor-rosa/vibration_303.csv"))
    for begin, end, _ in rotor["sections"](other):
        record = rotor["force_record"](rotor["part"](other, begin, end))
        assert not sf.SpectrumDetector(samples=0).run(record).detected
    healthy = rotor["read"](recording("rotor-rosa/healthy_103.csv"))
    found = sf.SpectrumDetector(samples=0).run(rotor["force_record"](healthy))
    assert found.status == "undetectable"


def test_tep_model(tep: dict[str, Any], recording: Folder) -> None:
    """Identified on one half of the normal data; nothing is found in the other."""
    normal = tep["read"](recording("tep/d00.csv"))
    model = tep["identify"](normal[: tep["FITTED"]])
    assert model.order == 2
    assert np.abs(np.linalg.eigvals(model.A)).max() < 1
    P = model.stationary
    np.testing.assert_allclose(model.A @ P @ model.A.T + model.Q, P, rtol=1e-8, atol=1e-10)
    record = tep["make_record"](model, normal[tep["FITTED"] :])
    assert record.nis[5:].mean() / 4 == pytest.approx(1.19, abs=0.02)
    assert not any(row["detected"] for row in tep["search"](record).values())
    assert not any(row["detected"] for row in tep["oscillation"](record).values())


@pytest.mark.parametrize(("name", "after", "onset"), [("d13", 0.8, 12.95), ("d14", 0.1, 12.5)])
def test_tep_faults_as_they_come(
    tep: dict[str, Any], recording: Folder, name: str, after: float, onset: float
) -> None:
    normal = tep["read"](recording("tep/d00.csv"))
    model = tep["identify"](normal[: tep["FITTED"]])
    faulty = tep["read"](recording(f"tep/{name}.csv"))
    *_, alarm = tep["as_it_comes"](model, normal[tep["FITTED"] :], faulty)
    assert alarm["detected"]
    assert alarm["after"] == pytest.approx(after, abs=0.11)
    assert alarm["onset"] == pytest.approx(onset, abs=0.11)


def test_tep_sticking_valve(tep: dict[str, Any], recording: Folder) -> None:
    normal = tep["read"](recording("tep/d00.csv"))
    model = tep["identify"](normal[: tep["FITTED"]])
    record = tep["make_record"](model, tep["read"](recording("tep/d14.csv")))
    for row in tep["oscillation"](record).values():
        assert row["detected"]
        assert row["frequency"] == pytest.approx(9.021, abs=0.005)


def test_train_clean_runs(train: dict[str, Any], recording: Folder) -> None:
    """What is found with the noise as fitted is not with 0.1 m."""
    folder = recording("train-infrabel/log_29304.csv").parent
    small, large = sorted(train["WANDER"])
    for number in train["CLEAN"]:
        run = train["read"](folder, number)
        rows = {white: train["search"](run, white) for white in (small, large)}
        assert rows[small][0]["detected"]  # a step
        assert abs(rows[small][0]["amplitude"]) < 0.3  # m
        assert not any(row["detected"] for row in rows[large])


def test_train_drift_as_it_enters_the_tunnel(train: dict[str, Any], recording: Folder) -> None:
    folder = recording("train-infrabel/log_28554.csv").parent
    for number in train["TUNNEL"]:
        run = train["read"](folder, number)
        ramp = train["search"](run.until(135.0), max(train["WANDER"]))[1]
        assert ramp["detected"]
        assert 110 < ramp["onset"] < 130
        assert 0.05 < ramp["amplitude"] < 0.2
        assert run.until(135.0).cross[-1] < 2.5


def test_comma_as_recorded(comma: dict[str, Any], recording: Folder) -> None:
    """The noises of the robust configuration are enough, those of the other are not."""
    log = comma["read"](recording("car-comma2k19/speed_events.csv").parent)
    rows = {
        model: {
            f"{row['sensor']} {row['profile']}": row
            for row in comma["search"](comma["make_filter"](model), log)
        }
        for model in comma["MODELS"]
    }
    falsely = {name for name, row in rows["config"].items() if row["detected"]}
    assert falsely == {"wheel_rl step", "wheel_fr step"}
    assert abs(rows["config"]["wheel_rl step"]["amplitude"]) < 0.04
    assert not any(row["detected"] for row in rows["robust"].values())


@pytest.mark.parametrize("sensor", ["wheel_rl", "gnss_ublox"])
def test_comma_ramps(comma: dict[str, Any], recording: Folder, sensor: str) -> None:
    log = comma["read"](recording("car-comma2k19/speed_events.csv").parent)
    filter = comma["make_filter"]("robust")
    for slope in (0.02, 0.05, 0.1):
        rows = comma["search"](filter, comma["with_ramp"](log, sensor, slope, 30.0))
        own = next(r for r in rows if r["sensor"] == sensor and r["profile"] == "ramp")
        assert own["detected"]
        assert own["onset"] == pytest.approx(30.0, abs=1.5)
        assert own["amplitude"] == pytest.approx(slope, rel=0.06)


def test_kingston_one_sensor_cannot_see_a_ramp(kingston: dict[str, Any], recording: Folder) -> None:
    """0.1 m/s², 6 m/s after a minute; the same search finds it with a second sensor."""
    onset = kingston["ONSETS"][1]
    log = kingston["read"](recording("car-kingston/speed.csv").parent)
    own = kingston["part"](log, onset - kingston["BEFORE"], onset + kingston["LASTS"])
    fault = sf.InjectedFault(sensor="obd", kind="ramp", size=0.1, start=onset, end=onset + 60)
    ramps = {
        (name, put): kingston["search"](filter, fault.apply(own) if put else own)[1]
        for name, filter in kingston["make_filters"]().items()
        for put in (False, True)
    }
    before, after = ramps["alone", False], ramps["alone", True]
    assert after["drop"] == pytest.approx(before["drop"], rel=1e-6)
    assert after["onset"] == before["onset"]
    assert after["se"] > 0.5
    assert not ramps["with the unit", False]["detected"]
    seen = ramps["with the unit", True]
    assert seen["detected"]
    assert seen["onset"] == pytest.approx(onset, abs=2)
    assert seen["amplitude"] == pytest.approx(0.1, rel=0.06)


def test_kingston_dead_zone_is_taken_for_a_step(
    kingston: dict[str, Any], recording: Folder
) -> None:
    """The wheel reads 0 until 0.8 m/s."""
    log = kingston["read"](recording("car-kingston/speed.csv").parent)
    step = kingston["search"](kingston["make_filters"]()["alone"], kingston["part"](log, 360, 720))[
        0
    ]
    assert step["detected"]
    assert step["amplitude"] == pytest.approx(1.1, abs=0.1)
    start = np.flatnonzero((log.sensor == "obd") & np.isclose(log.time, step["onset"]))[0]
    assert log.value[start - 2] == 0
    assert log.value[start] > 0.8
