"""The command line: exit codes, what is printed where, and the numbers in the files."""

from __future__ import annotations

import csv
import gzip
import io
import json
import subprocess
import sys
from pathlib import Path
from statistics import NormalDist
from typing import Any

import numpy as np
import pytest

import surefix as sf

pytest.importorskip("typer")
pytest.importorskip("rich")
pytest.importorskip("matplotlib")

from rich.console import Console
from typer.testing import CliRunner

from surefix import tables
from surefix.cli import main, report
from surefix.cli.app import app

CONFIG = """
[model]
kind = "constant-acceleration"
jerk = 0.08
[initial]
state = [20.0, 0.0]
sigma = [1.0, 0.1]
[[sensor]]
name = "wheel"
sigma = 1.0
[[sensor]]
name = "radar"
sigma = 2.0
[output]
rate = 5.0
risk = 1e-3
"""
REFERENCE = '[reference]\nfile = "truth.csv"\nvalue = "speed"\n'


def invoke(*arguments: str | Path) -> Any:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.fixture
def healthy(tmp_path: Path) -> Path:
    """A folder with log.csv, truth.csv and config.toml."""
    random = np.random.RandomState(3)
    time = np.round(0.05 * np.arange(800), 3)
    speed = 20 + 0.1 * time
    sensor = np.where(np.arange(800) % 2, "radar", "wheel")
    value = speed + np.where(sensor == "radar", 2.0, 1.0) * random.normal(size=800)
    columns = {"time_s": time, "sensor": sensor, "value": value}
    tables.write_csv(tmp_path / "log.csv", columns)
    tables.write_csv(tmp_path / "truth.csv", {"time_s": time[::20], "speed": speed[::20]})
    (tmp_path / "config.toml").write_text(CONFIG + REFERENCE, encoding="utf-8")
    return tmp_path


def run(folder: Path, *options: str, log: str = "log.csv") -> Any:
    config, out = folder / "config.toml", folder / "out"
    return invoke("run", folder / log, "--config", config, "--out", out, *options)


@pytest.fixture
def no_figure(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leaves out what takes most of the time."""
    monkeypatch.setattr("surefix.cli.outputs.save_figure", lambda figure, path: None)


def edit(folder: Path, old: str, new: str, name: str = "log.csv") -> None:
    path = folder / name
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")


def read(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def column(rows: list[dict[str, str]], name: str) -> Any:
    return np.array([float(row[name]) for row in rows])


def test_healthy_run(healthy: Path) -> None:
    done = run(healthy)
    assert done.exit_code == 0, done.output
    assert "wheel" in done.stdout
    assert done.stderr == ""
    names = {
        f"{stem}.{end}" for stem in ("estimates", "events", "summary") for end in ("csv", "json")
    }
    assert {path.name for path in (healthy / "out").iterdir()} == names | {"plot.png"}
    assert read(healthy / "out" / "events.csv") == []
    assert (healthy / "out" / "plot.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.usefixtures("no_figure")
def test_summary_from_the_files_alone(healthy: Path) -> None:
    done = run(healthy, "--json")
    assert done.exit_code == 0
    summary = json.loads(done.stdout)
    assert summary == json.loads((healthy / "out" / "summary.json").read_text(encoding="utf-8"))
    estimates, log = read(healthy / "out" / "estimates.csv"), read(healthy / "log.csv")
    truth = read(healthy / "truth.csv")
    time, speed, sigma = (column(estimates, n) for n in ("time_s", "speed", "speed_sigma"))
    inside = time <= column(truth, "time_s")[-1]
    true = np.interp(time, column(truth, "time_s"), column(truth, "speed"))
    error = (speed - true)[inside]
    found = summary["reference"]
    assert found["compared"] == inside.sum() < len(time)
    assert found["rms_error"] == pytest.approx(np.sqrt(np.mean(error**2)), rel=1e-12)
    assert found["mean_absolute_error"] == pytest.approx(np.abs(error).mean(), rel=1e-12)
    assert found["max_error"] == pytest.approx(np.abs(error).max(), rel=1e-12)
    assert [claim["risk"] for claim in found["claims"]] == [0.1, 0.01, 1e-3, 1e-7, 1e-11]
    for claim in found["claims"]:
        K = -NormalDist().inv_cdf(claim["risk"] / 2)
        assert claim["share_outside"] == (np.abs(error) > K * sigma[inside]).mean()
        assert claim["mean_width"] == pytest.approx(2 * K * sigma[inside].mean(), rel=1e-9)
    np.testing.assert_allclose(
        column(estimates, "upper") - speed, -NormalDist().inv_cdf(0.0005) * sigma, rtol=1e-9
    )
    assert summary["rows"] == len(log) == summary["counts"]["ok"]
    assert summary["estimates"] == len(estimates)
    assert summary["duration_s"] == pytest.approx(799 * 0.05)
    assert summary["sensors"]["radar"]["rate_hz"] == pytest.approx(400 / (799 * 0.05))
    assert summary["mean_sigma"] == pytest.approx(sigma.mean())
    assert summary["flagged"] == 0
    K = -NormalDist().inv_cdf(0.01 / 800 / 2)  # as ``Result.flagged``
    assert summary["flagged_beyond"] == pytest.approx(K, rel=1e-9)
    p_value = column(estimates, "p_value")
    assert summary["steps"] == {
        "p_value_below": 0.01 / len(estimates), "count": int((p_value < 0.01 / len(p_value)).sum()),
    }  # fmt: skip
    for sensor in summary["sensors"].values():
        assert sensor["rows"] == sensor["used"] == 400
        assert sensor["rms_normalised_noise"] == pytest.approx(1.0, abs=0.12)
    assert summary["versions"]["surefix"] == sf.__version__


@pytest.mark.usefixtures("no_figure")
def test_files_agree_and_are_exact(healthy: Path) -> None:
    run(healthy)
    out = healthy / "out"
    log = sf.read_log(healthy / "log.csv")
    sensors = [sf.Sensor("wheel", 1.0), sf.Sensor("radar", 2.0)]
    model = sf.ConstantAcceleration(jerk=0.08)
    engine = sf.DesyncFilter(model, sensors, [20, 0], np.diag([1.0, 0.1**2]), risk=1e-3)
    result = engine.run(log, rate=5.0)
    rows = read(out / "estimates.csv")
    stored = json.loads((out / "estimates.json").read_text(encoding="utf-8"))
    assert list(stored) == list(rows[0]) == list(result.columns())
    for name, values in result.columns().items():
        np.testing.assert_array_equal(column(rows, name), values)
        np.testing.assert_array_equal(np.array(stored[name]), values)
    flat = {row["key"]: row["value"] for row in read(out / "summary.csv")}
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert float(flat["log_likelihood"]) == summary["log_likelihood"] == result.log_likelihood
    assert float(flat["sensors.wheel.rate_hz"]) == summary["sensors"]["wheel"]["rate_hz"]


@pytest.mark.usefixtures("no_figure")
def test_alert(healthy: Path) -> None:
    rows = read(healthy / "log.csv")
    edit(healthy, f"{rows[100]['value']}", "70.0")
    edit(healthy, f"{rows[200]['value']}", "nan")
    edit(healthy, "15.0,wheel", "15.0,whee")
    done = run(healthy, "--json")
    assert done.exit_code == 3
    summary = json.loads(done.stdout)
    assert summary["counts"] == {"ok": 798, "not_finite": 1, "unknown_sensor": 1}
    assert summary["flagged"] == summary["sensors"]["wheel"]["flagged"] == 1
    assert summary["sensors"]["whee"]["rms_normalised_noise"] is None
    events = read(healthy / "out" / "events.csv")
    assert [(event["sensor"], event["event"]) for event in events] == [
        ("wheel", "flagged"), ("wheel", "not_finite"), ("whee", "unknown_sensor"),
    ]  # fmt: skip
    assert float(events[0]["value"]) == 70.0
    assert float(events[0]["normalised_noise"]) > 5
    assert events[1]["value"] == events[1]["normalised_noise"] == "nan"
    stored = json.loads((healthy / "out" / "events.json").read_text(encoding="utf-8"))
    assert stored["value"][1] is None


@pytest.mark.usefixtures("no_figure")
def test_overrides(healthy: Path) -> None:
    summary = json.loads(run(healthy, "--json", "--rate", "2", "--risk", "0.1").stdout)
    assert (summary["rate_hz"], summary["risk"]) == (2.0, 0.1)
    assert summary["estimates"] == 80
    bad = run(healthy, "--rate", "-2")
    assert bad.exit_code == 2
    assert "rate" in bad.stderr


@pytest.mark.usefixtures("no_figure")
def test_every_measurement_without_rate(healthy: Path) -> None:
    edit(healthy, "rate = 5.0", "", "config.toml")
    assert json.loads(run(healthy, "--json").stdout)["estimates"] == 800


@pytest.mark.usefixtures("no_figure")
@pytest.mark.parametrize("ending", ["csv.gz", "parquet"])
def test_other_formats(healthy: Path, ending: str) -> None:
    if ending == "parquet":
        parquet = pytest.importorskip("pyarrow.parquet")
        table = pytest.importorskip("pyarrow.csv").read_csv(healthy / "log.csv")
        parquet.write_table(table, healthy / "log.parquet")
    else:
        (healthy / "log.csv.gz").write_bytes(gzip.compress((healthy / "log.csv").read_bytes()))
    expected, found = (
        json.loads(run(healthy, "--json", log=f"log.{e}").stdout) for e in ("csv", ending)
    )
    assert found["log_likelihood"] == expected["log_likelihood"]


@pytest.mark.parametrize("options", [(), ("--rate", "5")], ids=["no rate", "rate"])
@pytest.mark.parametrize("rows", ["nan,wheel,1\n1,x,1\n", "-5,wheel,1\n-6,radar,1\n"])
def test_no_row_can_be_used(healthy: Path, options: tuple[str, ...], rows: str) -> None:
    edit(healthy, "rate = 5.0", "", "config.toml")
    edit(healthy, "sigma = [1.0, 0.1]", "sigma = [1.0, 0.1]\ntime = 0.0", "config.toml")
    (healthy / "log.csv").write_text("time_s,sensor,value\n" + rows, encoding="utf-8")
    done = run(healthy, *options)
    assert (done.exit_code, done.stdout, done.stderr.count("\n")) == (1, "", 1)
    assert "no row" in done.stderr
    assert not (healthy / "out").exists()


@pytest.mark.usefixtures("no_figure")
def test_configured_sensor_without_rows(healthy: Path) -> None:
    gps = '[[sensor]]\nname = "gps"\nsigma = 1.0\n[output]'
    edit(healthy, "[output]", gps, "config.toml")
    summary = json.loads(run(healthy, "--json").stdout)
    assert list(summary["sensors"]) == ["wheel", "radar", "gps"]
    assert summary["sensors"]["gps"] == {
        "rows": 0, "used": 0, "rate_hz": 0.0, "rms_normalised_noise": None, "flagged": 0,
    }  # fmt: skip
    screen = io.StringIO()
    console = Console(file=screen, force_terminal=True, color_system="standard")
    report.print_sensors(console, summary)
    assert "\x1b[33mgps" in screen.getvalue()
    assert "\x1b[33mwheel" not in screen.getvalue()


@pytest.mark.usefixtures("no_figure")
def test_names_and_paths_are_no_markup(healthy: Path) -> None:
    """[m/s] is no tag, and [/] closes none."""
    text = (healthy / "log.csv").read_text(encoding="utf-8")
    (healthy / "a[").mkdir()
    log = text.replace("wheel", "speed[m/s]").replace("radar", "[/]") + "9,speed[bold],1\n"
    (healthy / "a[/].csv").write_text(log, encoding="utf-8")
    edit(healthy, "wheel", "speed[m/s]", "config.toml")
    edit(healthy, "radar", "[/]", "config.toml")
    edit(healthy, "truth.csv", "../truth.csv", "config.toml")
    done = invoke(
        "run", healthy / "a[/].csv", "--config", healthy / "config.toml", "--out", healthy / "o[/]"
    )
    assert done.exit_code == 0, done.output
    assert "a[/].csv, 40 s, ConstantAcceleration\n" in done.stdout
    for name in ("speed[m/s] ", "[/] ", "speed[bold] "):
        assert f"\n{name}" in done.stdout
    assert done.stdout.endswith("o[/]\n")


def test_other_commands_print_paths_as_they_are(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("surefix.cli.info.facts", lambda: {"package": "/x[/]/[m/s]"})
    assert "/x[/]/[m/s]" in invoke("info").stdout
    monkeypatch.setattr("surefix.cli.study.run_study", lambda *_: {"report": ["a [m/s]"]})
    done = invoke("study", "bilenne-table-2", "--out", tmp_path / "s[/]")
    assert "a [m/s]" in done.stdout
    assert "s[/]" in done.stdout
    done = invoke("study", "[/]")
    assert (done.exit_code, "'[/]'" in done.stderr) == (2, True)


@pytest.mark.parametrize(
    ("name", "place"),
    [
        ("log.csv", "estimates.csv"),
        ("config.toml", "summary.json"),
        ("truth.csv", "events.csv"),
        ("log.csv", "plot.png"),
    ],
)
def test_inputs_are_not_overwritten(healthy: Path, name: str, place: str) -> None:
    """Whatever they are called, and also where the folder is a link to theirs."""
    (healthy / "out").mkdir()
    (healthy / "link").symlink_to(healthy / "out")
    moved = (healthy / name).rename(healthy / "out" / place)
    if name == "truth.csv":
        edit(healthy, name, f"out/{place}", "config.toml")
    content = moved.read_bytes()
    files = [moved if name == wanted else healthy / wanted for wanted in ("log.csv", "config.toml")]
    for out in ("out", "link"):
        done = invoke("run", files[0], "--config", files[1], "--out", healthy / out)
        assert (done.exit_code, done.stderr.count("\n")) == (1, 1)
        assert place in done.stderr
        assert [path.name for path in (healthy / "out").iterdir()] == [place]
        assert moved.read_bytes() == content


def test_out_of_memory(healthy: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def run_out(*_: Any, **__: Any) -> None:
        raise MemoryError

    monkeypatch.setattr("surefix.desync.filter.DesyncFilter.run", run_out)
    done = run(healthy)
    assert (done.exit_code, done.stderr) == (1, "error: out of memory\n")


@pytest.mark.usefixtures("no_figure")
def test_head_line_is_short(healthy: Path) -> None:
    model = 'kind = "linear"\nA = [[0, 1], [0, 0]]\nL = [[0], [1]]\nQc = [[0.01]]'
    edit(healthy, 'kind = "constant-acceleration"\njerk = 0.08', model, "config.toml")
    assert run(healthy).stdout.splitlines()[0].endswith("log.csv, 40 s, LinearModel")


def test_without_matplotlib(healthy: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("surefix.cli.outputs.importlib.util.find_spec", lambda name: None)
    done = run(healthy, "--json")
    assert done.exit_code == 0
    assert json.loads(done.stdout)["rows"] == 800
    assert "pip install surefix[plot]" in done.stderr
    assert not (healthy / "out" / "plot.png").exists()


@pytest.mark.parametrize(
    ("old", "new", "name", "parts"),
    [
        ("jerk", "jrek", "config.toml", ["config.toml", "[model]", "'jrek'", "'jerk'"]),
        ("rate = 5.0", "rate = ", "config.toml", ["config.toml, line 15"]),
        ("0.1,wheel,", "0.1,wheel,x", "log.csv", ["log.csv, line 4, column 'value'", "'x"]),
        ("0.15,radar,", "0.15,radar,,", "log.csv", ["log.csv, line 5", "3 fields, got 4"]),
        ("sensor", "sensr", "log.csv", ["log.csv, line 1", "'sensor'"]),
        ("truth.csv", "nowhere.csv", "config.toml", ["nowhere.csv: No such file"]),
        ("state = [20.0, 0.0]", "state = [20.0]", "config.toml", ["[initial] state", "(2,)"]),
    ],
)
def test_errors(healthy: Path, old: str, new: str, name: str, parts: list[str]) -> None:
    edit(healthy, old, new, name)
    done = run(healthy, "--json")
    assert done.exit_code == 1
    assert done.stdout == ""
    assert done.stderr.startswith("error: ")
    assert done.stderr.count("\n") == 1
    for part in parts:
        assert part in done.stderr


def test_missing_log_and_blocked_folder(healthy: Path) -> None:
    done = run(healthy, log="nowhere.csv")
    assert (done.exit_code, done.stderr.count("\n")) == (1, 1)
    assert "nowhere.csv: No such file" in done.stderr
    (healthy / "out").write_text("a file", encoding="utf-8")
    done = run(healthy)
    assert (done.exit_code, done.stderr.count("\n")) == (1, 1)


def test_truncated_gzip(healthy: Path) -> None:
    packed = gzip.compress((healthy / "log.csv").read_bytes())
    (healthy / "log.csv.gz").write_bytes(packed[: len(packed) // 2])
    done = run(healthy, log="log.csv.gz")
    assert (done.exit_code, done.stderr.count("\n")) == (1, 1)
    assert "log.csv.gz: not a readable CSV file" in done.stderr


def test_demo(tmp_path: Path) -> None:
    out = tmp_path / "demo[/]"  # is no markup
    done = invoke("demo", "--linear", "--out", out)
    assert done.exit_code == 0, done.output
    for text in ("wheel", "radar", "gps", "no fault", "gps frozen", "single outliers"):
        assert text in done.stdout
    assert max(map(len, done.stdout.splitlines()[:-2])) <= 80
    assert str(out) in done.stdout
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert summary["rows"] == summary["counts"]["ok"] == 25093
    assert summary["reference"]["rms_error"] < 1.3
    parts = {
        name: {claim["risk"]: claim["share_outside"] for claim in part["claims"]}
        for name, part in summary["faults"].items()
    }
    assert sum(part["compared"] for part in summary["faults"].values()) == 3599
    assert parts["no_fault"][1e-11] == 0
    assert 0.02 < parts["no_fault"][0.1] < 0.1
    assert parts["during_a_fault"][1e-11] > 0.5
    injected = summary["injected"]
    assert injected["outliers"] == {"injected": 12, "found": 12}
    assert injected["found_elsewhere"] == 0
    assert [fault["kind"] for fault in injected["periods"]] == [
        "frozen",
        "slip",
        "dropout",
        "slide",
    ]
    for name in ("plot", "plot-tunnel", "plot-departure"):
        assert (out / f"{name}.png").stat().st_size > 50_000
    events = read(out / "events.csv")
    assert len(events) == summary["flagged"]


@pytest.mark.usefixtures("no_figure")
def test_demo_as_json(tmp_path: Path) -> None:
    done = invoke("demo", "--linear", "--json", "--out", tmp_path)
    assert done.exit_code == 0
    summary = json.loads(done.stdout)
    assert summary == json.loads((tmp_path / "summary.json").read_text(encoding="utf-8"))
    assert summary["flagged"] > 0


def test_study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("surefix.studies.standard_error_fit.WHEEL_HZ", (20,))
    listed = invoke("study", "--list")
    assert listed.exit_code == 0
    assert "bilenne-table-2" in listed.stdout
    done = invoke("study", "bilenne-table-2", "--out", tmp_path / "study", "--json")
    assert done.exit_code == 0
    assert json.loads(done.stdout)["max_relative_difference"] <= 1e-12
    assert invoke("study", "nothing").exit_code == 2
    assert invoke("study").exit_code == 2


def test_info_and_version() -> None:
    found = json.loads(invoke("info", "--json").stdout)
    assert found["surefix"] == sf.__version__
    assert found["numpy"] == np.__version__
    assert found["limits"]["model_states"] == 8
    assert Path(found["package"]).is_dir()
    assert sf.__version__ in invoke("info").stdout
    assert invoke("--version").stdout == f"surefix {sf.__version__}\n"


def test_main(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    assert main(["--version"]) == 0
    assert main(["run"]) == 2
    assert main(["nothing"]) == 2
    assert main(["run", "nowhere.csv", "--config", "nowhere.toml", "--out", "."]) == 1
    capsys.readouterr()
    monkeypatch.setitem(sys.modules, "typer", None)
    assert main(["--version"]) == 1
    assert "pip install surefix[cli]" in capsys.readouterr().err


def test_nothing_heavy_is_imported_with_surefix() -> None:
    code = (
        "import sys, surefix, surefix.cli\n"
        "heavy = {'typer', 'rich', 'matplotlib', 'pandas', 'surefix.plots', 'surefix.studies'}\n"
        "print(sorted(heavy & set(sys.modules)))"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "[]"


def test_module_entry_point() -> None:
    command = [sys.executable, "-m", "surefix.cli", "run", "x.csv", "--config", "x.toml", "--out"]
    done = subprocess.run([*command, "."], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr == "error: x.toml: No such file or directory\n"


def test_tables_round_trip(tmp_path: Path) -> None:
    random = np.random.RandomState(0)
    bits = random.randint(0, 2**63 - 1, 50_000, dtype=np.int64)
    floats = np.concatenate([bits.view(np.float64), [0.1, -0.0, np.nan, np.inf, 5e-324]])
    names = np.array(["a", 'say "b"', "c,d"])[np.arange(len(floats)) % 3]
    calls: list[tuple[int, int]] = []
    columns = {"x,y": floats, "name": names, "i": np.arange(len(floats), dtype=np.int32)}
    tables.write_csv(tmp_path / "t.csv", columns, lambda *at: calls.append(at))
    rows = read(tmp_path / "t.csv")
    np.testing.assert_array_equal(column(rows, "x,y"), floats)
    assert [row["name"] for row in rows] == names.tolist()
    assert rows[-1]["i"] == str(len(floats) - 1)
    assert calls[-1] == (len(floats), len(floats))
    tables.write_csv(tmp_path / "empty.csv", {"a": np.zeros(0)})
    assert (tmp_path / "empty.csv").read_text(encoding="utf-8") == "a\n"
    assert tables.as_json({"a": [1.0, float("nan")]}, None) == '{"a":[1.0,null]}'
