"""Configuration files: what they build, and how they complain."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

import surefix as sf
from surefix import config as module
from surefix import config_faults as faults
from surefix.config import Config, load_config
from surefix.reading.reference import Reference

DEMO = Path(sf.__file__).parent / "data" / "demo"

GOOD = """
[model]
kind = "constant-acceleration"
jerk = 0.08

[initial]
state = [0.0, 0.0]
sigma = [1.0, 0.1]

[[sensor]]
name = "wheel"
sigma = 1.0
"""


def load(folder: Path, text: str) -> Config:
    path = folder / "config.toml"
    path.write_text(text, encoding="utf-8")
    return load_config(path)


def complaint(folder: Path, text: str) -> str:
    with pytest.raises(sf.ConfigError) as caught:
        load(folder, text)
    assert str(folder / "config.toml") in str(caught.value)
    return str(caught.value)


def test_demo() -> None:
    config = load_config(DEMO / "config.toml")
    assert isinstance(config.model, sf.ConstantAcceleration)
    assert config.model.jerk == 0.12
    assert [sensor.name for sensor in config.sensors] == ["wheel", "radar", "gps"]
    assert config.sensors[2].latency == 0.15
    np.testing.assert_array_equal(config.covariance, np.diag([1.0, 0.1**2]))
    assert config.output == module.Output(rate=5.0, risk=1e-11, false_alarm=0.01)
    assert config.reference == Reference("truth.csv", "time_s", "speed_mps")
    engine = config.make_filter()
    assert engine.risk == 1e-11
    assert engine.start is None


def test_defaults(tmp_path: Path) -> None:
    config = load(tmp_path, GOOD)
    assert config.output == module.Output(None, 1e-11, 0.01, "step", None)
    assert config.log == module.LogColumns("time_s", "sensor", "value", None)
    assert config.reference is None
    assert config.sensors == (sf.Sensor("wheel", 1.0),)


def test_every_table(tmp_path: Path) -> None:
    config = load(
        tmp_path,
        """
        [model]
        kind = "constant-velocity"
        acceleration = 1
        position = true
        [initial]
        state = [0, 0]
        covariance = [[4, 1], [1, 2]]
        time = 3
        [[sensor]]
        name = "radar"
        sigma = 2
        scale_sigma = 0.01
        scale_time = inf
        bias_sigma = 0.1
        bias_time = 60
        latency = -0.1
        observes = [0, 1]
        [log]
        time = "t"
        columns = { radar = "doppler" }
        [output]
        rate = 4
        risk = 1e-3
        false_alarm = 0.05
        noise = "journey"
        delay = 0.5
        [reference]
        file = "truth.csv"
        """,
    )
    assert config.sensors[0] == sf.Sensor(
        "radar", 2, 0.01, math.inf, 0.1, 60, latency=-0.1, observes=(0, 1)
    )
    assert config.model.state_names == ("position", "speed")
    assert config.start == 3
    assert config.covariance[0, 1] == 1
    assert config.log.columns == {"radar": "doppler"}
    assert config.output == module.Output(4, 1e-3, 0.05, "journey", 0.5)
    log = tmp_path / "log.csv"
    log.write_text("t,doppler\n1,2\n2,\n3,4\n", encoding="utf-8")
    assert list(config.read_log(log).value) == [2, 4]


@pytest.mark.parametrize(
    ("model", "kind"),
    [
        ('kind = "linear"\nA = [[0, 1], [0, 0]]\nL = [[0], [1]]\nQc = [[0.1]]', sf.LinearModel),
        (
            'kind = "discrete"\nF = [[1, 1], [0, 1]]\nQ = [[0, 0], [0, 1]]\nperiod = 0.5\n'
            'names = ["a", "b"]\nreads = 1',
            sf.DiscreteModel,
        ),
    ],
)
def test_general_models(tmp_path: Path, model: str, kind: type) -> None:
    text = GOOD.replace('kind = "constant-acceleration"\njerk = 0.08', model)
    built = load(tmp_path, text).model
    assert isinstance(built, kind)
    assert built.size == 2


def test_sensor_keys_are_the_fields_of_sensor() -> None:
    known = {**faults._SENSOR, **faults._SENSOR_OPTIONS}
    assert set(known) == {field.name for field in dataclasses.fields(sf.Sensor)}


@pytest.mark.parametrize(
    ("old", "new", "parts"),
    [
        ("jerk =", "jerkk =", ["[model]", "'jerkk'", "did you mean 'jerk'?"]),
        ("jerk = 0.08", "", ["[model]", "missing key 'jerk'"]),
        ("jerk = 0.08", 'jerk = "0.08"', ["[model] jerk", "a number", "'0.08'"]),
        ("jerk = 0.08", "jerk = true", ["[model] jerk", "a number", "True"]),
        ("jerk = 0.08", "jerk = -1", ["[model] jerk", ">= 0", "-1"]),
        ("constant-acc", "constant-ac", ["[model] kind", "did you mean 'constant-acceleration'?"]),
        ('kind = "constant-acceleration"', "", ["[model]", "missing key 'kind'"]),
        ("[model]", "[modle]", ["unknown key 'modle'", "did you mean 'model'?"]),
        ("[[sensor]]", "[sensor]", ["sensor", "[[sensor]]"]),
        ("name =", "nmae =", ["[[sensor]] 1", "'nmae'", "did you mean 'name'?"]),
        ("sigma = 1.0", "sigma = 0", ["[[sensor]] 1", "'wheel'", "sigma", "> 0"]),
        ("sigma = [1.0, 0.1]", "", ["[initial]", "'sigma' or 'covariance'"]),
        ("sigma = [1.0, 0.1]", "sigma = [1.0]", ["[initial]", "sigma", "(2,)"]),
        ("sigma = [1.0, 0.1]", "sigma = [1.0, -0.1]", ["[initial]", "sigma", ">= 0"]),
        ("sigma = [1.0, 0.1]", 'sigma = [1.0, "x"]', ["[initial] sigma", "a list of numbers"]),
        ("state = [0.0, 0.0]", "", ["[initial]", "missing key 'state'"]),
        ("[[sensor]]", "[output]\nrate = 0\n[[sensor]]", ["[output]", "rate", "> 0"]),
        ("[[sensor]]", "[output]\nrsk = 0.1\n[[sensor]]", ["[output]", "'rsk'", "'risk'"]),
        ("[[sensor]]", "[output]\ndelay = 1\n[[sensor]]", ["[output]", "delay", "rate"]),
        ("[[sensor]]", '[output]\nnoise = "no"\n[[sensor]]', ["[output]", "noise", "'no'"]),
        ("[[sensor]]", "[reference]\n[[sensor]]", ["[reference]", "missing key 'file'"]),
        ("[[sensor]]", "[log]\ncolumns = {}\n[[sensor]]", ["[log] columns"]),
        ("[[sensor]]", '[[sensor]]\nname = "wheel"\nsigma = 1\n[[sensor]]', ["different names"]),
    ],
)
def test_complaints_name_file_and_key(tmp_path: Path, old: str, new: str, parts: list[str]) -> None:
    assert old in GOOD
    text = complaint(tmp_path, GOOD.replace(old, new, 1))
    for part in parts:
        assert part in text
    assert "\n" not in text


@pytest.mark.parametrize(
    ("text", "line"), [("[model]\nkind = \n", 2), ("[model]\nkind = 1\n\nx y\n", 4), ("a = [", 1)]
)
def test_syntax_errors_name_the_line(tmp_path: Path, text: str, line: int) -> None:
    assert f"config.toml, line {line}: " in complaint(tmp_path, text)


def test_missing_and_unreadable_files(tmp_path: Path) -> None:
    with pytest.raises(sf.ConfigError, match=r"nowhere\.toml: No such file"):
        load_config(tmp_path / "nowhere.toml")
    (tmp_path / "bad.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(sf.ConfigError, match=r"bad\.toml: not a UTF-8 text"):
        load_config(tmp_path / "bad.toml")


REFERENCES = {
    "NaN": ("1,2\n2,nan\n", r"row 2, column 'value': expected a finite number, got nan"),
    "infinite": ("1,2\n2,3\n3,-inf\n", r"row 3, column 'value': expected a finite .*got -inf"),
    "no time": ("nan,2\n2,3\n", r"row 1, column 'time_s': expected a finite number, got nan"),
    "empty time": ("1,2\n,3\n", r"row 2, column 'time_s': expected a finite number, got nan"),
    "unsorted": ("1,2\n3,3\n2,4\n", r"row 3, column 'time_s': expected times in order, got 2\.0"),
    "empty cells": ("1,\n2,\n", "column 'value': expected numbers, got empty cells"),
    "no rows": ("", "column 'value': expected numbers, got empty cells"),
}


@pytest.mark.parametrize(("rows", "message"), REFERENCES.values(), ids=REFERENCES.keys())
def test_references_that_are_no_truth(tmp_path: Path, rows: str, message: str) -> None:
    (tmp_path / "truth.csv").write_text("time_s,value\n" + rows, encoding="utf-8")
    with pytest.raises(sf.ConfigError, match=rf"truth\.csv, {message}"):
        Reference("truth.csv").read(tmp_path)


def test_reference_leaves_out_empty_cells(tmp_path: Path) -> None:
    text = "time_s,value,other\n1,2,x\n2,,y\n2,3,\n2,4,\n"
    (tmp_path / "truth.csv").write_text(text, encoding="utf-8")
    time, value = Reference("truth.csv").read(tmp_path)
    assert (time.tolist(), value.tolist()) == ([1, 2, 2], [2, 3, 4])
