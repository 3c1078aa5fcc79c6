"""``surefix drift``: what is found in logs with a known fault, exit codes, files, errors."""

from __future__ import annotations

import csv
import functools
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import surefix as sf
from surefix import tables
from surefix.core.checks import FloatArray

pytest.importorskip("typer")
pytest.importorskip("rich")
pytest.importorskip("matplotlib")

from typer.testing import CliRunner

from surefix.cli.app import app

CONFIG = """
[model]
kind = "constant-acceleration"
jerk = 0.02
[initial]
state = [20.0, 0.1]
sigma = [1.0, 0.1]
[[sensor]]
name = "wheel"
sigma = 0.2
[[sensor]]
name = "axle"
sigma = 0.2
[[sensor]]
name = "radar"
sigma = 0.4
"""
SENSORS = ("wheel", "axle", "radar")
STEPS = 200  # of 0.15 s


def invoke(*arguments: str | Path) -> Any:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def write(
    folder: Path,
    fault: Callable[[FloatArray], FloatArray] | None = None,
    config: str = "",
    sizes: tuple[float, float, float] = (0.2, 0.2, 0.4),
) -> FloatArray:
    """log.csv and config.toml; 30 s, the fault is in the wheel. Returns its values."""
    random = np.random.RandomState(5)
    time = np.round(0.15 * np.repeat(np.arange(STEPS), 3), 3)
    sensor = np.tile(np.array(SENSORS), STEPS)
    value = 20 + 0.1 * time + np.tile(np.array(sizes), STEPS) * random.normal(size=3 * STEPS)
    added = np.zeros(len(value)) if fault is None else np.where(sensor == "wheel", fault(time), 0.0)
    columns = {"time_s": time, "sensor": sensor, "value": value + added}
    tables.write_csv(folder / "log.csv", columns)
    (folder / "config.toml").write_text(CONFIG + config, encoding="utf-8")
    return added


def ramp(time: FloatArray) -> FloatArray:
    return 0.1 * np.maximum(time - 15.0, 0.0)


def drift(folder: Path, *options: str) -> Any:
    config, out = folder / "config.toml", folder / "out"
    return invoke("drift", folder / "log.csv", "--config", config, "--out", out, *options)


def found(done: Any, code: int) -> Any:
    assert done.exit_code == code, done.output
    return json.loads(done.stdout)


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """No figure, and p-values from fewer draws."""
    monkeypatch.setattr("surefix.cli.drift.outputs.can_plot", lambda: False)
    diagnose = functools.partial(sf.diagnose, samples=64)
    monkeypatch.setattr("surefix.cli.drift_search.diagnose", diagnose)


def test_ramp(tmp_path: Path) -> None:
    added = write(tmp_path, ramp)
    done = drift(tmp_path)
    assert done.exit_code == 3, done.output
    assert done.stderr == ""
    out = tmp_path / "out"
    assert {path.name for path in out.iterdir()} == {"drift.json", "drift.png", "repaired.csv"}
    assert (out / "drift.png").read_bytes().startswith(b"\x89PNG")
    stored = json.loads((out / "drift.json").read_text(encoding="utf-8"))
    (fault,) = stored["faults"]
    assert (fault["sensor"], fault["kind"], fault["unit"]) == ("wheel", "ramp", "m/s²")
    assert fault["since_s"] == pytest.approx(15.0, abs=1.5)
    assert fault["amplitude"] == pytest.approx(0.1, abs=5 * fault["amplitude_se"])
    assert fault["p_value"] < 1e-20
    assert fault["as_likely"] == []
    assert stored["warnings"] == []
    assert stored["before"]["nis"] > stored["after"]["nis"] == pytest.approx(1.0, abs=0.15)
    assert stored["after"]["inconsistency"] < stored["before"]["inconsistency"] - 100
    for text in ("wheel", "ramp", "since 1", "± 0.0", "m/s²", "next best is", "NIS after"):
        assert text in done.stdout
    with (out / "repaired.csv").open(encoding="utf-8", newline="") as file:
        repaired = list(csv.DictReader(file))
    original = sf.read_log(tmp_path / "log.csv")
    assert [row["sensor"] for row in repaired] == original.sensor.tolist()
    assert [float(row["time_s"]) for row in repaired] == original.time.tolist()
    left = np.array([float(row["value"]) for row in repaired]) - (original.value - added)
    assert np.abs(left[original.sensor == "wheel"]).max() < 0.2
    assert (left[original.sensor != "wheel"] == 0).all()


@pytest.mark.usefixtures("quick")
def test_repaired_log_is_healthy(tmp_path: Path) -> None:
    write(tmp_path, ramp)
    assert drift(tmp_path, "--no-spectrum").exit_code == 3
    again = tmp_path / "out" / "repaired.csv"
    options = ("--config", tmp_path / "config.toml", "--no-spectrum", "--json")
    numbers = found(invoke("drift", again, *options, "--out", tmp_path / "again"), 0)
    assert (numbers["faults"], numbers["repaired"]) == ([], None)
    refused = invoke("drift", again, *options, "--out", tmp_path / "out")
    assert (refused.exit_code, refused.stderr.count("\n")) == (1, 1)
    assert "repaired.csv is an input" in refused.stderr
    assert again.exists()


@pytest.mark.usefixtures("quick")
def test_oscillation(tmp_path: Path) -> None:
    write(tmp_path, lambda t: 0.2 * np.sin(2 * np.pi * 1.3 * t + 0.7))
    numbers = found(drift(tmp_path, "--json"), 3)
    (fault,) = numbers["faults"]
    assert (fault["sensor"], fault["kind"], fault["unit"]) == ("wheel", "sinusoid", "m/s")
    assert fault["frequency_hz"] == pytest.approx(1.3, abs=0.01)
    assert fault["amplitude"] == pytest.approx(0.2, abs=5 * fault["amplitude_se"])
    assert fault["phase_rad"] == pytest.approx(0.7, abs=0.5)
    assert (fault["since_s"], fault["until_s"], fault["phase_at_s"]) == (None, None, 0.0)
    assert "1.3" in drift(tmp_path).stdout
    assert found(drift(tmp_path, "--json", "--no-spectrum"), 0)["faults"] == []
    config = "[drift]\nprofiles = []\nfrequencies = [2.0, 4.0]\n"
    (tmp_path / "config.toml").write_text(CONFIG + config, encoding="utf-8")
    numbers = found(drift(tmp_path, "--json"), 0)
    assert {one["kind"] for one in numbers["searched"]} == {"sinusoid"}
    assert all(2.0 <= one["frequency_hz"] <= 4.0 for one in numbers["searched"])


@pytest.mark.usefixtures("quick")
def test_healthy(tmp_path: Path) -> None:
    write(tmp_path)
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "repaired.csv").write_text("of another run", encoding="utf-8")
    done = drift(tmp_path)
    assert done.exit_code == 0, done.output
    assert "Nothing found that a healthy log would not show (false alarm 0.001)." in done.stdout
    assert "warning" not in done.stdout
    text = (tmp_path / "out" / "drift.json").read_text(encoding="utf-8")
    assert "NaN" not in text
    stored = json.loads(text)
    assert (stored["detected"], stored["faults"], stored["repaired"]) == (False, [], None)
    assert len(stored["searched"]) == 9
    assert {one["status"] for one in stored["searched"]} == {"not detected"}
    assert stored["before"] == stored["after"]
    assert not (tmp_path / "out" / "repaired.csv").exists()


@pytest.mark.usefixtures("quick")
def test_undetectable(tmp_path: Path) -> None:
    write(tmp_path, sizes=(0.0, 0.2, 0.4))
    text = (tmp_path / "log.csv").read_text(encoding="utf-8").splitlines()
    still = [",".join([*row.split(",")[:2], "20.0"]) if "wheel" in row else row for row in text]
    (tmp_path / "log.csv").write_text("\n".join(still), encoding="utf-8")
    done = drift(tmp_path, "--no-spectrum", "--sensor", "wheel")
    assert done.exit_code == 0, done.output
    assert "Nothing can be said" in done.stdout
    assert "undetectable: wheel step, wheel ramp: constant data" in done.stdout
    numbers = found(drift(tmp_path, "--no-spectrum", "--sensor", "wheel", "--json"), 0)
    for one in numbers["searched"]:
        assert (one["status"], one["drop"], one["p_value"]) == ("undetectable", None, None)
        assert "constant data" in one["reason"]


@pytest.mark.usefixtures("quick")
def test_two_sensors_cannot_be_told_apart(tmp_path: Path) -> None:
    write(tmp_path, ramp)
    text = (tmp_path / "log.csv").read_text(encoding="utf-8")
    (tmp_path / "log.csv").write_text(
        "\n".join(row for row in text.splitlines() if "radar" not in row), encoding="utf-8"
    )
    done = drift(tmp_path, "--no-spectrum")
    assert done.exit_code == 3
    assert "hardly to be told from" in done.stdout
    (fault,) = json.loads((tmp_path / "out" / "drift.json").read_text(encoding="utf-8"))["faults"]
    other = {"wheel": "axle", "axle": "wheel"}[fault["sensor"]]
    assert (other, "ramp") in [(one["sensor"], one["kind"]) for one in fault["as_likely"]]


@pytest.mark.usefixtures("quick")
def test_wrong_models_are_warned_of(tmp_path: Path) -> None:
    write(tmp_path, sizes=(0.6, 0.6, 1.2))
    numbers = found(drift(tmp_path, "--no-spectrum", "--false-alarm", "1e-12", "--json"), 0)
    assert numbers["after"]["nis"] == pytest.approx(9.0, abs=1.0)
    (first, *_) = numbers["warnings"]
    assert first.startswith("all sensors: NIS per measurement")
    assert "too little noise" in first
    assert "false alarms" in first
    write(tmp_path, sizes=(0.1, 0.1, 0.2))
    done = drift(tmp_path, "--no-spectrum")
    assert "warning: wheel: NIS per measurement 0.2" in done.stdout
    assert "faults may be missed" in done.stdout
    write(tmp_path, lambda t: 0.4 * np.sin(0.7 * t))
    done = drift(tmp_path, "--no-spectrum", "--false-alarm", "1e-12", "--sensor", "radar")
    assert "warning: wheel: innovations are correlated" in done.stdout


@pytest.mark.usefixtures("quick")
def test_options_and_table(tmp_path: Path) -> None:
    table = '[drift]\nsensors = ["radar"]\nfalse_alarm = 0.01\nmax_faults = 1\n'
    write(tmp_path, ramp, table + 'profiles = ["exponential"]\nexponential_time = 5.0\n')
    numbers = found(drift(tmp_path, "--no-spectrum", "--json"), 3)
    assert {one["sensor"] for one in numbers["searched"]} == {"radar"}
    assert {one["kind"] for one in numbers["searched"]} == {"exponential"}
    assert numbers["settings"]["false_alarm"] == 0.01
    assert any("max_faults" in text for text in numbers["warnings"])
    options = ("--sensor", "wheel", "--sensor", "axle", "--false-alarm", "1e-4")
    numbers = found(drift(tmp_path, "--no-spectrum", "--json", *options), 3)
    assert {one["sensor"] for one in numbers["searched"]} == {"wheel", "axle"}
    assert numbers["settings"]["false_alarm"] == 1e-4


@pytest.mark.usefixtures("quick")
def test_fault_that_ends(tmp_path: Path) -> None:
    write(tmp_path, lambda t: np.where((t >= 8) & (t < 20), 0.8, 0.0), "[drift]\nends = true\n")
    done = drift(tmp_path, "--no-spectrum", "--sensor", "wheel")
    assert done.exit_code == 3
    numbers = json.loads((tmp_path / "out" / "drift.json").read_text(encoding="utf-8"))
    (fault,) = numbers["faults"]
    assert fault["kind"] == "step (ends)"
    assert (fault["since_s"], fault["until_s"]) == pytest.approx((8.0, 20.0), abs=0.3)
    assert f"{fault['since_s']:.2f} to {fault['until_s']:.2f} s" in done.stdout


@pytest.mark.parametrize(
    ("options", "parts"),
    [
        (("--sensor", "whel"), ["unknown sensor 'whel'", "'wheel'"]),
        (("--false-alarm", "2"), ["false_alarm", "probability"]),
    ],
)
def test_wrong_usage(tmp_path: Path, options: tuple[str, ...], parts: list[str]) -> None:
    write(tmp_path)
    done = drift(tmp_path, *options)
    assert (done.exit_code, done.stdout) == (2, "")
    assert all(part in " ".join(done.stderr.split()) for part in parts), done.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("table", "parts"),
    [
        ("end = true", ["[drift]", "'end'", "did you mean 'ends'?"]),
        ("frequencies = [0.1, 500.0]", ["[drift] frequencies", "20000", "end at", "Hz"]),
    ],
)
def test_errors_name_file_and_key(tmp_path: Path, table: str, parts: list[str]) -> None:
    write(tmp_path, config=f"[drift]\n{table}\n")
    done = drift(tmp_path)
    assert (done.exit_code, done.stdout, done.stderr.count("\n")) == (1, "", 1)
    for part in (str(tmp_path / "config.toml"), *parts):
        assert part in done.stderr
    assert not (tmp_path / "out").exists()


def test_no_row_can_be_used(tmp_path: Path) -> None:
    write(tmp_path)
    (tmp_path / "log.csv").write_text("time_s,sensor,value\n1,x,1\n2,wheel,nan\n", encoding="utf-8")
    done = drift(tmp_path)
    assert (done.exit_code, done.stdout) == (1, "")
    assert "no row could be used: 1 not_finite, 1 unknown_sensor" in done.stderr


def test_ends_of_a_long_log_say_so_at_once(tmp_path: Path) -> None:
    write(tmp_path, config="[drift]\nends = true\n")
    rows = "".join(f"{0.1 * k:.1f},wheel,20\n" for k in range(2001))
    (tmp_path / "log.csv").write_text("time_s,sensor,value\n" + rows, encoding="utf-8")
    done = drift(tmp_path)
    assert (done.exit_code, done.stderr.count("\n")) == (1, 1)
    assert "config.toml: [drift] ends: sensor 'wheel' has 2001 measurements" in done.stderr
