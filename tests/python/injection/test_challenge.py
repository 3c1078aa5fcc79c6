"""``challenge`` and ``surefix inject``: tolerances, delays and counts where they are known by hand;
a small run from files; bad arguments."""

from __future__ import annotations

import dataclasses
import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import surefix as sf
from surefix.cli.app import app
from surefix.config import Config, load_config
from surefix.injection import judge
from surefix.injection.challenge import challenge

FALLIBLE = """[[sensor]]
name = "NAME"
sigma = 0.2
faults = [
    { mode = "outage", span = 60.0, rate = 1e-3, duration = 5.0 },
    { mode = "drifting", sigma = 10.0, walk = 0.3, rate = 1e-3, duration = 10.0 },
    { mode = "frozen", resolution = 1e-6, span = 60.0, rate = 1e-3, duration = 10.0 },
]
"""
CONFIG = """
[model]
kind = "constant-acceleration"
jerk = 0.3
[initial]
state = [10.0, 0.0]
sigma = [2.0, 0.5]
time = 0.0
"""
CONFIG += FALLIBLE.replace("NAME", "a") + FALLIBLE.replace("NAME", "b")
CONFIG += """\
[[sensor]]
name = "c"
sigma = 0.2
[output]
rate = 2.0
risk = 1e-7
[reference]
file = "truth.csv"
[inject]
duration = 10.0
ramp = [0.3, 1.0]
jump = [3.0, 8.0]
scale = [0.2, 0.5]
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A made-up journey of 40 s, three sensors at 5 Hz, with its truth."""
    path = tmp_path_factory.mktemp("journey")
    random = np.random.RandomState(4)
    time = np.arange(0.2, 40.1, 0.2)
    speed = 12 + 2 * np.sin(time / 5)
    rows = [
        f"{t:.3f},{name},{v + 0.2 * random.standard_normal():.9f}"
        for t, v in zip(time, speed, strict=True)
        for name in ("a", "b", "c")
    ]
    (path / "log.csv").write_text("time_s,sensor,value\n" + "\n".join(rows) + "\n")
    truth = [f"{t:.3f},{v:.9f}" for t, v in zip(time, speed, strict=True)]
    (path / "truth.csv").write_text("time_s,value\n" + "\n".join(truth) + "\n")
    (path / "config.toml").write_text(CONFIG)
    return path


@pytest.fixture(scope="module")
def config(folder: Path) -> Config:
    return load_config(folder / "config.toml")


def test_odometry_tolerance() -> None:
    """2 km/h below 30 km/h, 12 km/h at 500 km/h, linear between them."""
    speed = np.array([0.0, 30.0, 265.0, 500.0, -265.0]) / 3.6
    np.testing.assert_allclose(3.6 * judge.odometry_tolerance(speed), [2, 2, 7, 12, 7])


def test_limits_and_detection_by_hand(config: Config, folder: Path) -> None:
    """A jump of 5 m/s in one of three sensors."""
    log = config.read_log(folder / "log.csv")
    fault = sf.InjectedFault(sensor="b", kind="jump", start=20.1, end=30.1, size=5.0)
    result = config.run(fault.apply(log))
    assert isinstance(result, sf.RobustResult)

    def truth(time: Any) -> Any:
        return 12 + 2 * np.sin(time / 5)

    found = judge.detection(result, config.sensors, truth, (0.0, 40.0), fault)
    assert found["delay"] == pytest.approx(20.5 - 20.1)  # the first estimate after it
    assert found["recovery"] == pytest.approx(30.5 - 30.1, abs=0.51)
    assert found["good"] + found["bad"] == 600 - 50
    errors = np.abs(log.value - truth(log.time))
    spared = np.ones(600, dtype=bool)
    spared[fault.rows(log)] = False
    assert found["bad"] == (spared & (errors > judge.GOOD)).sum()
    assert found["good_rejected"] <= 0.03 * found["good"]
    shown = judge.limits(result, truth, (5.0, 40.0))
    assert len(shown["limit"]) == len(shown["outside"]) == 70
    assert not shown["outside"].any()
    assert (shown["error_of_estimate"] <= shown["limit"]).all()
    tight = np.maximum(result.upper - result.estimate, result.estimate - result.lower)[10:]
    np.testing.assert_array_equal(shown["within_2kmh"], tight <= 2 / 3.6)
    assert (shown["within_etcs"] >= shown["within_2kmh"]).all()


def test_fault_that_is_never_found(config: Config, folder: Path) -> None:
    """A jump far below the noise."""
    log = config.read_log(folder / "log.csv")
    fault = sf.InjectedFault(sensor="b", kind="jump", start=20.1, end=30.1, size=1e-3)
    result = config.run(fault.apply(log))
    assert isinstance(result, sf.RobustResult)
    found = judge.detection(result, config.sensors, np.zeros_like, (0.0, 40.0), fault)
    assert found["delay"] == math.inf
    assert found["bad_kept"] == found["bad"] - (result.rejected.sum() - found["good_rejected"])


def test_what_is_reported(config: Config, folder: Path) -> None:
    log = config.read_log(folder / "log.csv")
    calls: list[tuple[int, int]] = []
    found = challenge(
        config, log, folder, seeds=2, risks=(1e-5, 1e-2), kinds=("jump", "freeze"),
        progress=lambda done, total: calls.append((done, total)),
    )  # fmt: skip
    assert calls[-1] == (13, 13)
    assert found["risks"] == [1e-2, 1e-5]
    assert set(found["injected"]) == {f"{s} {k}" for s in "abc" for k in ("jump", "freeze")}
    for name in ("a jump", "b jump", "a freeze"):
        row = found["injected"][name]
        assert row["found"] == 1.0
        assert row["delay"] <= row["longest_delay"] < 5.0
        assert row["risks"][1]["misleading_fraction"] == 0.0
        assert row["risks"][1]["seeds"] == 2
        assert row["risks"][1]["mean_width"] > row["risks"][0]["mean_width"]
    assert found["injected"]["c jump"]["found"] == 0.0  # it has no fault modes
    assert "found" not in found["recorded"]
    error, limit = found["points"]["jump"]
    assert len(error) == len(limit) == 6 * 70
    again = challenge(config, log, folder, seeds=1, risks=(1e-2,), kinds=("jump",))
    drawn = {(f["sensor"], f["start"]) for f in found["faults"] if f["kind"] == "jump"}
    assert {(f["sensor"], f["start"]) for f in again["faults"]} <= drawn


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"seeds": 0}, "seeds"),
        ({"seed": -1}, "seed"),
        ({"risks": (0.0,)}, "risks"),
        ({"risks": ()}, "risks: expected at least one"),
        ({"kinds": ("melt",)}, "kinds: expected one of freeze, .*'melt'"),
    ],
)
def test_bad_arguments(
    config: Config, folder: Path, arguments: dict[str, Any], message: str
) -> None:
    log = config.read_log(folder / "log.csv")
    with pytest.raises(sf.ConfigError, match=message):
        challenge(config, log, folder, **arguments)


def test_what_a_configuration_lacks(config: Config, folder: Path) -> None:
    log = config.read_log(folder / "log.csv")
    for changed, message in (
        (dataclasses.replace(config, reference=None), r"expected a table \[reference\]"),
        (config.without_faults(), "expected a sensor with faults"),
        (
            dataclasses.replace(config, output=dataclasses.replace(config.output, rate=None)),
            r"\[output\]: expected a rate",
        ),
    ):
        with pytest.raises(sf.ConfigError, match=message):
            challenge(changed, log, folder)


def test_table_inject_is_checked(folder: Path, tmp_path: Path) -> None:
    path = tmp_path / "config.toml"
    path.write_text(CONFIG.replace("jump = [3.0, 8.0]", "jump = [8.0, 3.0]"))
    with pytest.raises(sf.ConfigError, match=r"\[inject\].*jump: expected 0 < smallest"):
        load_config(path)
    path.write_text(CONFIG.replace("jump = [3.0, 8.0]", "jumps = [3.0, 8.0]"))
    with pytest.raises(sf.ConfigError, match=r"\[inject\].*jumps"):
        load_config(path)


def test_command(folder: Path, tmp_path: Path) -> None:
    arguments = ["inject", str(folder / "log.csv"), "--config", str(folder / "config.toml")]
    arguments += ["--seeds", "1", "--risk", "1e-3", "--kind", "jump", "--out", str(tmp_path)]
    text = CliRunner().invoke(app, arguments)
    assert text.exit_code == 0, text.output
    assert "as recorded" in text.output
    assert "b jump" in text.output
    shown = CliRunner().invoke(app, [*arguments, "--json"])
    numbers = json.loads(shown.stdout)
    assert numbers == json.loads((tmp_path / "inject.json").read_text())
    assert "points" not in numbers
    assert numbers["injected"]["c jump"]["longest_delay"] is None  # never


def test_figure(folder: Path, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    arguments = ["inject", str(folder / "log.csv"), "--config", str(folder / "config.toml")]
    arguments += ["--seeds", "1", "--risk", "1e-3", "--kind", "freeze", "--out", str(tmp_path)]
    assert CliRunner().invoke(app, arguments).exit_code == 0
    assert (tmp_path / "figure.png").stat().st_size > 10_000


def test_command_reports_errors(folder: Path, tmp_path: Path) -> None:
    arguments = ["inject", str(folder / "log.csv"), "--config", str(folder / "config.toml")]
    found = CliRunner().invoke(app, [*arguments, "--kind", "melt", "--out", str(tmp_path)])
    assert found.exit_code == 1
    assert "kinds: expected one of" in found.stderr
    (tmp_path / "file").write_text("")
    found = CliRunner().invoke(app, [*arguments, "--out", str(tmp_path / "file" / "out")])
    assert found.exit_code == 1
    assert "--out: expected a folder that can be written" in found.stderr


def test_nothing_to_judge(config: Config, folder: Path) -> None:
    """Estimates further apart than what log and reference have in common."""
    log = config.read_log(folder / "log.csv")
    rare = dataclasses.replace(config, output=dataclasses.replace(config.output, rate=0.02))
    with pytest.raises(sf.ConfigError, match="more in common than the time between two estimates"):
        challenge(rare, log, folder)


def test_hypotheses_per_measurement(folder: Path, tmp_path: Path) -> None:
    """A sensor is as doubtful as its most doubtful row: its faults are found."""
    text = re.sub(
        r"faults = \[.*?\n\]", 'faults = [{ mode = "outage", span = 60.0, probability = 1e-3 }]',
        CONFIG, flags=re.DOTALL,
    )  # fmt: skip
    path = tmp_path / "config.toml"
    path.write_text(text + '[robust]\nhypotheses = "measurement"\n')
    config = load_config(path)
    log = config.read_log(folder / "log.csv")
    found = challenge(config, log, folder, seeds=1, risks=(1e-5,), kinds=("jump",))
    for sensor in ("a", "b"):
        row = found["injected"][f"{sensor} jump"]
        assert row["found"] == 1.0
        assert row["delay"] < 1.0
