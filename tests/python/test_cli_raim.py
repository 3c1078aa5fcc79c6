"""``surefix raim``: what is found in pseudoranges with known faults, exit codes, files, errors."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import surefix as sf
from raim.journey import EPOCHS, LOW, NAMES, ZENITH, journey, write_rows

pytest.importorskip("typer")
pytest.importorskip("rich")
pytest.importorskip("matplotlib")

from typer.testing import CliRunner

from surefix.cli.app import app

CLAIM = ("--length", "60", "--sigma", f"{ZENITH}")
BIAS = 60.0  # [m]
FAULTY, BLOCKED = slice(5, 9), slice(20, 23)


def raim(folder: Path, *options: str | Path, claim: tuple[str, ...] = CLAIM) -> Any:
    files = (folder / "pseudoranges.csv", "--track", folder / "track.csv", "--out", folder / "out")
    arguments = ["raim", *files, *claim, *options]
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def found(done: Any, code: int) -> Any:
    assert done.exit_code == code, done.output
    return json.loads(done.stdout)


def refused(done: Any, code: int, *parts: str) -> None:
    assert done.exit_code == code, done.output
    text = " ".join(done.output.replace("│", " ").split())
    for part in parts:
        assert part in text


def table(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """No figures."""
    monkeypatch.setattr("surefix.cli.raim.outputs.can_plot", lambda: False)


def test_a_fault_and_an_outage(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("surefix.cli.outputs.PLOT_DPI", 40)
    one = journey().biased("E02", FAULTY, BIAS).blocked(2, BLOCKED)
    one.write(tmp_path)
    done = raim(tmp_path, "--truth", tmp_path / "truth.csv", "--availability", "--step", "100")
    assert done.exit_code == 3, done.output
    assert done.stderr == ""
    out = tmp_path / "out"
    assert {path.name for path in out.iterdir()} == {
        "epochs.csv", "satellites.csv", "raim.json", "raim.png", "stanford.png", "availability.csv",
        "availability.png",
    }  # fmt: skip
    for name in ("raim", "stanford", "availability"):
        assert (out / f"{name}.png").read_bytes().startswith(b"\x89PNG")
    numbers = json.loads((out / "raim.json").read_text(encoding="utf-8"))
    assert numbers["counts"] == {
        "not available": 3, "ok": 23, "excluded": 4, "not available: too few satellites": 3,
    }  # fmt: skip
    assert numbers["excluded"] == {"E02": 4}
    assert numbers["alarms"]["snapshot"] == numbers["alarms"]["raised"] == 4
    assert numbers["alarms"]["snapshot_rate"] == pytest.approx(4 / 27)
    assert numbers["rows_below_mask"] == EPOCHS - 3
    assert numbers["rows_not_finite"] == 3 * (len(NAMES) - 2)
    assert numbers["availability"]["position"] == pytest.approx(27 / 30)
    assert numbers["protection_m"]["epochs"] == 27
    assert numbers["errors"]["compared"] == 27
    assert numbers["errors"]["beyond_protection"] == 0.0
    assert numbers["errors"]["max_m"] < 10
    assert numbers["errors"]["truth_off_track_m"] < 1e-6
    assert sum(numbers["errors"]["stanford"].values()) == 27
    assert numbers["map"]["places"] == len(table(out / "availability.csv")) == 17
    for text in ("excluded", "E02 (4)", "too few satellites", "too low", "without e1", "rms"):
        assert text in done.stdout


@pytest.mark.usefixtures("quick")
def test_epochs_without_an_answer_hold_no_number(tmp_path: Path) -> None:
    journey().blocked(2, BLOCKED).write(tmp_path)
    assert raim(tmp_path).exit_code == 0
    rows = table(tmp_path / "out" / "epochs.csv")
    assert len(rows) == EPOCHS
    for row in rows[BLOCKED]:
        assert row["declared"] == "not available"
        assert row["status"] == "too few satellites"
        given = {key for key, cell in row.items() if cell}
        assert given == {"time_s", "declared", "status", "satellites"}
    for row in rows[:20]:
        cells = {key: cell for key, cell in row.items() if key != "excluded"}
        assert all(cells.values())
        assert "nan" not in cells.values()
        assert float(row["protection_m"]) > 0


@pytest.mark.usefixtures("quick")
def test_tables_are_what_the_library_says(tmp_path: Path) -> None:
    one = journey().biased("E02", FAULTY, BIAS)
    one.write(tmp_path)
    assert raim(tmp_path).exit_code == 3
    result = sf.raim.TrackRaim(one.track, length=60.0).run(one.data)
    rows = table(tmp_path / "out" / "epochs.csv")
    for name, column, tolerance in (
        ("along_m", result.along, 1e-2), ("sigma_m", result.sigma, 1e-3),
        ("protection_m", result.protection, 1e-2), ("statistic", result.statistic, 0.3),
        ("threshold", result.threshold, 1e-9),
    ):  # fmt: skip
        values = [float(row[name]) for row in rows]
        np.testing.assert_allclose(values, column, rtol=1e-3, atol=tolerance)
    assert [row["declared"] for row in rows] == result.declared.tolist()
    assert [row["excluded"] for row in rows[FAULTY]] == ["E02"] * 4
    satellites = table(tmp_path / "out" / "satellites.csv")
    assert len(satellites) == EPOCHS * len(NAMES)
    assert [row["satellite"] for row in satellites[: len(NAMES)]] == list(NAMES)
    low = satellites[LOW]
    assert (low["seen"], low["sigma_m"], low["residual"]) == ("False", "", "")
    assert float(low["elevation_deg"]) == pytest.approx(3.0, abs=0.1)
    at = 5 * len(NAMES) + NAMES.index("E02")
    assert (satellites[at]["satellite"], satellites[at]["excluded"]) == ("E02", "True")
    residuals = [float(row["residual"]) for row in satellites if row["residual"]]
    np.testing.assert_allclose(
        residuals, result.residual[np.isfinite(result.residual)], rtol=0, atol=0.05
    )


@pytest.mark.usefixtures("quick")
def test_options_override_the_configuration(tmp_path: Path) -> None:
    journey().write(tmp_path)
    config = tmp_path / "config.toml"
    config.write_text(
        "[pseudoranges]\nsigma = 3\nelevation_mask = 32\n[monitor]\nlength = 80\nrisk = 1e-8\n"
    )
    numbers = found(raim(tmp_path, "--config", config, "--json", claim=()), 0)
    assert numbers["settings"]["length"] == 80.0
    assert numbers["settings"]["sigma"] == 3.0
    assert numbers["rows_below_mask"] == 4 * EPOCHS
    options = (
        "--mask", "2", "--false-alarm", "1e-4", "--missed", "1e-2", "--risk", "1e-6",
        "--fault-probability", "1e-3", "--max-excluded", "1", "--tolerance", "0.5",
        "--max-speed", "40", "--near", "210", "--earth-rotation", "--json",
    )  # fmt: skip
    numbers = found(raim(tmp_path, "--config", config, *options), 3)
    assert numbers["settings"] | {"interval": None} == {
        "length": 60.0, "false_alarm": 1e-4, "missed": 1e-2, "risk": 1e-6,
        "fault_probability": 1e-3, "max_faults": 2, "max_excluded": 1, "interval": None,
        "max_speed": 40.0, "near": 210.0, "earth_rotation": True, "sigma": None,
        "sigma_zenith": ZENITH, "elevation_mask": 2.0, "tolerance": 0.5,
    }  # fmt: skip
    assert numbers["rows_below_mask"] == 0
    assert 0 < numbers["track"]["vertex_error_m"] <= 0.5


@pytest.mark.usefixtures("quick")
def test_masks_hide_part_of_the_track(tmp_path: Path) -> None:
    journey().write(tmp_path)
    config = tmp_path / "config.toml"
    config.write_text('[[mask]]\nkind = "tunnel"\nlow = 400\nhigh = 800\n')
    options = ("--config", config, "--availability", "--step", "50", "--json")
    numbers = found(raim(tmp_path, *options), 0)
    assert numbers["map"]["not_available"] == {"too few satellites": 9}
    rows = table(tmp_path / "out" / "availability.csv")
    hidden = [row for row in rows if row["status"] != "ok"]
    assert [float(row["along_m"]) for row in hidden] == [400.0 + 50 * k for k in range(9)]
    assert {row["protection_m"] + row["p_star"] + row["available"] for row in hidden} == {""}
    assert {row["satellites"] for row in rows if row["status"] == "ok"} == {"9"}
    assert raim(tmp_path).exit_code == 0
    assert not (tmp_path / "out" / "availability.csv").exists()  # of the run before


@pytest.mark.usefixtures("quick")
def test_truth_of_mileages_with_holes_and_of_one_that_stands(tmp_path: Path) -> None:
    one = journey()
    one.write(tmp_path)
    truth = tmp_path / "mileages.csv"
    rows = [f"{t},{along}" for t, along in enumerate(one.truth) if t not in (4, 29)]
    write_rows(truth, "t_s,along_m", [*rows[:10], "9.5,", *rows[10:]])
    numbers = found(raim(tmp_path, "--truth", truth, "--json"), 0)
    assert numbers["errors"]["compared"] == EPOCHS - 1
    assert numbers["errors"]["truth_off_track_m"] is None
    place = one.track.position(500.0)
    write_rows(truth, "x_m,y_m,z_m", [",".join(map(repr, place.tolist()))])
    numbers = found(raim(tmp_path, "--truth", truth, "--json"), 0)
    assert numbers["errors"]["max_m"] == pytest.approx(300.0, abs=10)
    assert numbers["errors"]["stanford"]["hazardous"] > 20


@pytest.mark.usefixtures("quick")
def test_no_satellite_at_all(tmp_path: Path) -> None:
    journey().blocked(0, slice(None)).write(tmp_path)
    numbers = found(raim(tmp_path, "--truth", tmp_path / "truth.csv", "--json"), 0)
    assert numbers["counts"]["not available"] == EPOCHS
    assert numbers["protection_m"] == {"epochs": 0, "median": None, "p95": None, "none": 0}
    assert numbers["alarms"]["snapshot_rate"] is None
    assert numbers["errors"] == {"compared": 0}
    assert "no epoch could be tested" in raim(tmp_path).stdout
    refused(raim(tmp_path, "--availability"), 1, "--availability", "got none")


@pytest.mark.usefixtures("quick")
def test_warnings(tmp_path: Path) -> None:
    one = journey()
    one.write(tmp_path)
    assert found(raim(tmp_path, "--json"), 0)["warnings"] == []
    small = ("--length", "60", "--sigma", "0.3")
    (warning,) = found(raim(tmp_path, "--json", claim=small), 3)["warnings"]
    assert "σ is too small" in warning
    there = one.points.tolist()
    rows = [",".join(map(repr, point)) for point in (*there, *there[-2::-1])]
    write_rows(tmp_path / "track.csv", "x_m,y_m,z_m", rows)
    done = raim(tmp_path)
    refused(done, done.exit_code, "warning: the track comes back", "--max-speed")
    assert (
        found(raim(tmp_path, "--max-speed", "40", "--near", "200", "--json"), 0)["warnings"] == []
    )


@pytest.mark.parametrize(
    ("options", "parts"),
    [
        ((), ["--length", "[monitor]"]),
        (("--length", "60"), ["--sigma", "[pseudoranges]"]),
        (("--length", "0", "--sigma", "1"), ["--length", "> 0"]),
        (("--length", "60", "--sigma", "-1"), ["--sigma", "> 0", "-1"]),
        ((*CLAIM, "--mask", "91"), ["--mask", "-90 to 90", "91"]),
        ((*CLAIM, "--risk", "2"), ["--risk", "probability"]),
        ((*CLAIM, "--false-alarm", "0"), ["--false-alarm", "probability"]),
        ((*CLAIM, "--max-excluded", "9"), ["--max-excluded", "whole number"]),
        ((*CLAIM, "--tolerance", "-1"), ["--tolerance", ">= 0"]),
        ((*CLAIM, "--step", "0"), ["--step", "> 0"]),
    ],
)
def test_wrong_options(tmp_path: Path, options: tuple[str, ...], parts: list[str]) -> None:
    journey().write(tmp_path)
    refused(raim(tmp_path, claim=options), 2, *parts)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("name", "text", "parts"),
    [
        ("track.csv", "x_m,y_m,z_m\n1,2,3\n", ["track.csv", "2 to", "got 1"]),
        ("track.csv", "a,b\n1,2\n", ["track.csv", "line 1", "x_m"]),
        ("pseudoranges.csv", "t_s,sat\n0,G01\n", ["pseudoranges.csv", "line 1", "sat_x_m"]),
        ("truth.csv", "t_s,x\n0,1\n", ["truth.csv", "line 1", "along_m", "[truth]"]),
        ("truth.csv", "along_m\n0\n1\n", ["truth.csv", "'t_s'", "more than one row"]),
        ("truth.csv", "t_s,along_m\n1,0\n0,1\n", ["truth.csv", "'t_s'", "in order"]),
        ("truth.csv", "t_s,along_m\n0,inf\n", ["truth.csv", "'along_m'", "finite", "inf"]),
        ("truth.csv", "t_s,along_m\n0,\n", ["truth.csv", "at least one row"]),
    ],
)
def test_wrong_files(tmp_path: Path, name: str, text: str, parts: list[str]) -> None:
    journey().write(tmp_path)
    (tmp_path / name).write_text(text, encoding="utf-8")
    done = raim(tmp_path, "--truth", tmp_path / "truth.csv")
    refused(done, 1, *parts)
    assert done.stderr.startswith("error: ")
    assert done.stderr.count("\n") == 1


def test_inputs_are_not_overwritten(tmp_path: Path) -> None:
    journey().write(tmp_path)
    out = tmp_path / "out"
    out.mkdir()
    (tmp_path / "truth.csv").rename(out / "epochs.csv")
    refused(raim(tmp_path, "--truth", out / "epochs.csv"), 1, "--out", "would be overwritten")
    refused(raim(tmp_path, "--out", tmp_path / "track.csv"), 1, "--out", "a folder")
