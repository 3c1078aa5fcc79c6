"""``surefix run`` and ``surefix demo`` with the robust filter: exit codes, and numbers in files."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import surefix as sf
from surefix import tables

pytest.importorskip("typer")
pytest.importorskip("rich")
pytest.importorskip("matplotlib")

from typer.testing import CliRunner

from surefix.cli.app import app
from surefix.config import load_config

CONFIG = """
[model]
kind = "constant-acceleration"
jerk = 0.08
[initial]
state = [20.0, 0.0]
sigma = [1.0, 0.1]
[output]
rate = 2.5
risk = 1e-9
[reference]
file = "truth.csv"
value = "speed"
"""
SIGMA = {"wheel": 1.0, "radar": 2.0, "gps": 0.5}
FAULTS = """
[[sensor]]
name = "{name}"
sigma = {sigma}
faults = [
  {{ mode = "outage", span = 100.0, rate = 0.001, duration = 1.0 }},
  {{ mode = "drifting", sigma = 10.0, walk = 1.0, rate = 0.001, duration = 5.0 }},
]
"""
SLIP = (15.0, 20.0)


def write_run(folder: Path, slip: float) -> Path:
    """A folder with log.csv, truth.csv and config.toml; the wheel slips."""
    random = np.random.RandomState(4)
    rows = 900
    time = np.round(40 / rows * np.arange(rows), 4)
    sensor = np.resize(list(SIGMA), rows)
    sigma = np.array([SIGMA[name] for name in sensor])
    value = 20 + 0.1 * time + sigma * random.normal(size=rows)
    value[(sensor == "wheel") & (time >= SLIP[0]) & (time < SLIP[1])] += slip
    tables.write_csv(folder / "log.csv", {"time_s": time, "sensor": sensor, "value": value})
    truth = np.arange(0.0, 41.0)
    tables.write_csv(folder / "truth.csv", {"time_s": truth, "speed": 20 + 0.1 * truth})
    sensors = "".join(FAULTS.format(name=name, sigma=s) for name, s in SIGMA.items())
    (folder / "config.toml").write_text(CONFIG + sensors, encoding="utf-8")
    return folder


@pytest.fixture
def slipping(tmp_path: Path) -> Path:
    return write_run(tmp_path, 8.0)


@pytest.fixture
def no_figure(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leaves out what takes most of the time."""
    monkeypatch.setattr("surefix.cli.outputs.save_figure", lambda figure, path: None)


def run(folder: Path, *options: str) -> Any:
    files = [folder / "log.csv", "--config", folder / "config.toml", "--out", folder / "out"]
    return CliRunner().invoke(app, ["run", *map(str, files), *options])


def read(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_rejected_rows_are_an_alert(slipping: Path) -> None:
    done = run(slipping)
    assert done.exit_code == 3, done.output
    for text in ("wheel", "drifting", "healthy", "outside the limits of 0 of 100 estimates"):
        assert text in done.stdout
    assert (slipping / "out" / "plot.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.usefixtures("no_figure")
def test_healthy_run(tmp_path: Path) -> None:
    done = run(write_run(tmp_path, 0.0))
    assert done.exit_code == 0, done.output
    assert read(tmp_path / "out" / "events.csv") == []


@pytest.mark.usefixtures("no_figure")
def test_summary_and_files(slipping: Path) -> None:
    summary = json.loads(run(slipping, "--json").stdout)
    config = load_config(slipping / "config.toml")
    result = config.run(config.read_log(slipping / "log.csv"))
    assert isinstance(result, sf.RobustResult)
    estimates = read(slipping / "out" / "estimates.csv")
    assert list(estimates[0]) == list(result.columns())
    for name in ("lower", "upper", "wheel_fault_probability", "discarded_mass"):
        found = np.array([float(row[name]) for row in estimates])
        np.testing.assert_array_equal(found, result.columns()[name])
    assert [row["wheel_mode"] for row in estimates] == result.columns()["wheel_mode"].tolist()

    assert summary["estimates"] == len(result.time) == 100
    assert summary["risk"] == 1e-9
    assert summary["rejected"] == result.rejected.sum() > 0
    assert summary["available_share"] == 1.0
    assert summary["largest_discarded_mass"] == result.discarded_mass.max()
    assert summary["mean_width"] == pytest.approx((result.upper - result.lower).mean())
    wheel, radar = summary["sensors"]["wheel"], summary["sensors"]["radar"]
    assert wheel["rows"] == wheel["used"] == 300
    assert wheel["held_faulty_s"] == sum(wheel["modes_s"].values())
    assert wheel["held_faulty_s"] == pytest.approx(SLIP[1] - SLIP[0], abs=0.8)
    assert (radar["rejected"], radar["held_faulty_s"]) == (0, 0)
    reference = summary["reference"]
    truth = 20 + 0.1 * result.time
    error = result.estimate - truth
    assert reference["rms_error"] == pytest.approx(np.sqrt(np.mean(error**2)))
    (claim,) = reference["claims"]
    assert (claim["risk"], claim["share_outside"]) == (1e-9, 0.0)
    assert claim["mean_width"] == pytest.approx(summary["mean_width"])


@pytest.mark.usefixtures("no_figure")
def test_events(slipping: Path) -> None:
    with (slipping / "log.csv").open("a", encoding="utf-8") as file:
        file.write("41,odometer,3\n41,gps,nan\n")
    done = run(slipping, "--json")
    assert json.loads(done.stdout)["sensors"]["odometer"]["rejected"] == 0
    events = read(slipping / "out" / "events.csv")
    *rejected, odometer, gps = events
    assert {(row["sensor"], row["event"]) for row in rejected} == {("wheel", "rejected")}
    assert {row["mode"] for row in rejected} == {"outage", "drifting"}  # at first it may be either
    assert all(float(row["fault_probability"]) > 0.5 for row in rejected)
    within = [SLIP[0] <= float(row["time_s"]) < SLIP[1] for row in rejected]
    assert np.mean(within) > 0.8
    assert (odometer["event"], odometer["mode"]) == ("unknown_sensor", "")
    assert (gps["event"], gps["fault_probability"]) == ("not_finite", "nan")


@pytest.mark.usefixtures("no_figure")
def test_misleading_estimates_are_counted(slipping: Path) -> None:
    """A reference that is wrong from 30 s on."""
    text = (slipping / "truth.csv").read_text(encoding="utf-8")
    (slipping / "truth.csv").write_text(text.replace("30.0,23.0", "30.0,43.0"), encoding="utf-8")
    done = run(slipping)
    reference = json.loads((slipping / "out" / "summary.json").read_text())["reference"]
    (claim,) = reference["claims"]
    outside = round(claim["share_outside"] * reference["compared"])
    assert 1 <= outside <= 5
    assert f"outside the limits of {outside} of 100 estimates" in done.stdout


@pytest.mark.usefixtures("no_figure")
def test_limits_that_cannot_be_claimed(slipping: Path) -> None:
    """More faults than max_faults are more probable than the risk."""
    text = (slipping / "config.toml").read_text(encoding="utf-8")
    text += "[robust]\nmax_faults = 0\n"
    (slipping / "config.toml").write_text(text, encoding="utf-8")
    done = run(slipping)
    summary = json.loads((slipping / "out" / "summary.json").read_text(encoding="utf-8"))
    assert summary["available_share"] == 0.0
    assert summary["mean_width"] is summary["largest_width"] is None
    assert summary["reference"]["claims"][0]["mean_width"] is None
    assert "for 0 % of the estimates" in done.stdout
    assert {row["lower"] for row in read(slipping / "out" / "estimates.csv")} == {"-inf"}


@pytest.mark.usefixtures("no_figure")
def test_linear(slipping: Path) -> None:
    summary = json.loads(run(slipping, "--linear", "--json").stdout)
    assert summary["flagged"] > 0
    assert "rejected" not in summary
    assert summary["reference"]["max_error"] > 1


def test_demo(tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["demo", "--out", str(tmp_path)])
    assert done.exit_code == 0, done.output
    for text in ("no fault", "gps frozen", "frozen 60", "outside the limits of 0 of 3599"):
        assert text in done.stdout
    assert max(map(len, done.stdout.splitlines()[:-2])) <= 80
    summary = json.loads((tmp_path / "summary.json").read_text(encoding="utf-8"))
    assert summary["available_share"] == 1.0
    assert summary["mean_width"] < 3.5
    assert summary["reference"]["rms_error"] < 0.2
    for part in summary["faults"].values():
        assert [claim["share_outside"] for claim in part["claims"]] == [0.0]
    injected = summary["injected"]
    assert injected["outliers"] == {"injected": 12, "found": 12}
    frozen, slip, dropout, slide = injected["periods"]
    assert frozen["found"] == frozen["rows"]
    assert slip["found"] > 0.8 * slip["rows"]
    assert (dropout["rows"], dropout["found"]) == (0, 0)
    assert slide["found"] > 0.8 * slide["rows"]
    assert injected["found_elsewhere"] < 0.005 * summary["rows"]
    for name in ("plot", "plot-tunnel", "plot-departure"):
        assert (tmp_path / f"{name}.png").stat().st_size > 50_000
    assert len(read(tmp_path / "events.csv")) == summary["rejected"]
