"""Studies: numbers, files, and an independent check of the fitted standard errors."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import surefix as sf
from surefix.studies import STUDIES, bilenne_table_2, run_study, standard_error_fit

pytest.importorskip("matplotlib")


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], Path]:
    folder = tmp_path_factory.mktemp("study") / "out"
    calls: list[tuple[int, int]] = []
    numbers = run_study("bilenne-table-2", folder, lambda done, total: calls.append((done, total)))
    assert calls
    assert all(0 < done <= total for done, total in calls)
    return numbers, folder


def test_unknown_study(tmp_path: Path) -> None:
    with pytest.raises(sf.ConfigError, match="bilenne-table-2"):
        run_study("nothing", tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_every_study_can_be_imported() -> None:
    for known in STUDIES.values():
        assert known.module.startswith("surefix.studies.")
        assert known.title


def test_invariance(study: tuple[dict[str, Any], Path]) -> None:
    numbers, _ = study
    assert numbers["times_compared"] == 150
    assert 0 <= numbers["max_relative_difference"] <= 1e-12
    assert 0 < numbers["composite_max_relative_difference"] <= 1e-12
    assert "not public" in numbers["note"]


def test_files(study: tuple[dict[str, Any], Path]) -> None:
    numbers, folder = study
    stored = json.loads((folder / "study.json").read_text(encoding="utf-8"))
    assert stored["max_relative_difference"] == numbers["max_relative_difference"]
    with (folder / "table.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 8
    assert [row["estimate f0/4"] != "nan" for row in rows] == [i in (3, 7) for i in range(8)]
    full = np.array([float(row["standard_error f0"]) for row in rows])
    half = np.array([float(row["standard_error f0/2"]) for row in rows])[1::2]
    np.testing.assert_allclose(half, full[1::2], rtol=1e-12)
    assert (folder / "figure.png").stat().st_size > 10_000
    assert any("4 T0" in line for line in numbers["report"])


def test_simulation_is_drawn_from_the_model() -> None:
    model = sf.ConstantAcceleration(jerk=bilenne_table_2.JERK)
    first, second = (bilenne_table_2.simulate(model) for _ in range(2))
    np.testing.assert_array_equal(first.value, second.value)
    counts = {name: int((first.sensor == name).sum()) for name in first.names}
    assert counts == {"wheel": 800, "radar": 400, "gps": 40}
    sensors = bilenne_table_2.SENSORS
    engine = sf.DesyncFilter(model, sensors, bilenne_table_2.X0, bilenne_table_2.P0, start=0.0)
    result = engine.run(first, rate=5.0)
    assert np.abs(result.sse.sum() / result.degrees_of_freedom.sum() - 1) < 0.15
    assert not result.flagged(1e-3).any()


@pytest.mark.parametrize(
    ("name", "within"), [("jerk_as_stated", 0.04), ("jerk_free", 0.0075), ("irregular", 0.0016)]
)
def test_fit_against_the_filter(
    study: tuple[dict[str, Any], Path], name: str, within: float
) -> None:
    """The fitted standard errors are those of the filter itself with that schedule."""
    fit = study[0]["standard_error_fit"]
    assert fit["kind"] == "a fit, not a reproduction"
    best, T0 = fit[name], bilenne_table_2.T0
    if name == "irregular":
        times = {sensor: best[f"{sensor}_s"] for sensor in ("wheel", "radar", "gps")}
    else:
        times = {
            sensor: (np.arange(1.6 * best[f"{sensor}_hz"]) + 0.5) / best[f"{sensor}_hz"]
            for sensor in ("wheel", "radar")
        }
        times["gps"] = [best["gps_at_s"], best["gps_at_s"] + 1.0]
    rows = sorted((float(t), sensor) for sensor, column in times.items() for t in column)
    log = sf.Log([t for t, _ in rows], [sensor for _, sensor in rows], np.zeros(len(rows)))
    speed, acceleration = best["start_sigma_speed"], best["start_sigma_acceleration"]
    cross = best["start_correlation"] * speed * acceleration
    P0 = [[speed**2, cross], [cross, acceleration**2]]
    model = sf.ConstantAcceleration(jerk=best["jerk"])
    engine = sf.DesyncFilter(model, bilenne_table_2.SENSORS, [0.0, 0.0], P0, start=0.0)
    sigma = engine.run(log, times=T0 * np.arange(1, 9)).sigma
    np.testing.assert_allclose(sigma, best["standard_error"], rtol=1e-9)
    paper = np.array(bilenne_table_2.PAPER_STANDARD_ERRORS)
    deviation = float(np.abs(sigma / paper - 1).max())
    assert deviation == pytest.approx(best["max_relative_deviation"], rel=1e-6)
    assert deviation <= within


def test_fit_is_deterministic(
    study: tuple[dict[str, Any], Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, values in (("WHEEL_HZ", (20,)), ("RADAR_HZ", (10,)), ("GPS_AT", (0.2,))):
        monkeypatch.setattr(standard_error_fit, name, values)
    paper = np.array(bilenne_table_2.PAPER_STANDARD_ERRORS)
    again = standard_error_fit.search(paper, bilenne_table_2.T0)
    assert again["jerk_free"] == study[0]["standard_error_fit"]["jerk_free"]
