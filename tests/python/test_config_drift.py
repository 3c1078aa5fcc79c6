"""The table ``[drift]``: what it asks for, and how it complains."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

import surefix as sf
from surefix import config_drift as module
from surefix.config import Config, load_config
from surefix.config_drift import Drift

BASE = """
[model]
kind = "constant-acceleration"
jerk = 0.08
[initial]
state = [0.0, 0.0]
sigma = [1.0, 0.1]
[[sensor]]
name = "wheel"
sigma = 1.0
faults = [{ mode = "outage", span = 60.0, probability = 0.01 }]
[[sensor]]
name = "radar"
sigma = 2.0
"""


def load(folder: Path, text: str) -> Config:
    path = folder / "config.toml"
    path.write_text(BASE + text, encoding="utf-8")
    return load_config(path)


def test_defaults(tmp_path: Path) -> None:
    drift = load(tmp_path, "").drift
    assert drift == Drift(("step", "ramp"), None, False, True, None, None, 1e-3, 3)
    assert [course.name for course in drift.courses()] == ["step", "ramp"]


def test_every_key(tmp_path: Path) -> None:
    drift = load(
        tmp_path,
        """
        [drift]
        profiles = ["exponential", "step"]
        exponential_time = -4
        ends = true
        spectrum = true
        frequencies = [0.5, 2]
        sensors = ["radar"]
        false_alarm = 0.01
        max_faults = 1
        """,
    ).drift
    assert drift == Drift(
        ("exponential", "step"), -4.0, True, True, (0.5, 2.0), ("radar",), 0.01, 1
    )
    value = drift.courses()[0].value([2.0])
    np.testing.assert_allclose(value, [[1 - np.exp(0.5)]], rtol=1e-12)


def test_keys_are_the_fields() -> None:
    assert set(module._DRIFT) == {field.name for field in dataclasses.fields(Drift)}


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("profile = []", ["'profile'", "did you mean 'profiles'?"]),
        ('profiles = ["rmap"]', ["profiles", "step, ramp, exponential", "'rmap'"]),
        ('profiles = ["step", "step"]', ["profiles", "different", "step, step"]),
        ('profiles = "step"', ["profiles", "a list of texts"]),
        ("profiles = []\nspectrum = false", ["profiles, spectrum"]),
        ('profiles = ["exponential"]', ["exponential_time"]),
        ('profiles = ["exponential"]\nexponential_time = 0', ["exponential_time", "not 0"]),
        ('profiles = ["exponential"]\nexponential_time = inf', ["exponential_time", "inf"]),
        ("exponential_time = 3", ["exponential_time", "'exponential' only"]),
        ("ends = 1", ["ends", "true or false"]),
        ("frequencies = [1]", ["frequencies", "[lowest, highest]", "[1.0]"]),
        ("frequencies = [2, 1]", ["frequencies", "lowest < highest", "[2.0, 1.0]"]),
        ("frequencies = [0, 1]", ["frequencies", "0 < lowest"]),
        ("frequencies = [1, inf]", ["frequencies", "[1.0, inf]"]),
        ("frequencies = [1, 2]\nspectrum = false", ["frequencies", "spectrum = true"]),
        ('sensors = ["whel"]', ["sensors", "'whel'", "did you mean 'wheel'?"]),
        ("sensors = []", ["sensors", "one at least"]),
        ('sensors = ["radar", "radar"]', ["sensors", "different", "radar, radar"]),
        ("false_alarm = 0", ["false_alarm", "probability", "0"]),
        ("false_alarm = 1", ["false_alarm", "probability", "1"]),
        ("max_faults = 0", ["max_faults", "from 1 to 100", "0"]),
        ("max_faults = 1.5", ["max_faults", "a whole number"]),
    ],
)
def test_complaints_name_file_table_and_key(tmp_path: Path, text: str, parts: list[str]) -> None:
    with pytest.raises(sf.ConfigError) as caught:
        load(tmp_path, "[drift]\n" + text)
    for part in (f"{tmp_path / 'config.toml'}: [drift] ", *parts):
        assert part in str(caught.value)
    assert "\n" not in str(caught.value)


def test_grid_is_half_a_cycle_apart() -> None:
    grid = Drift(frequencies=(0.2, 1.0)).grid(duration=50.0, interval=0.1)
    assert grid is not None
    np.testing.assert_allclose(grid, np.linspace(0.2, 1.0, 81), rtol=1e-12)
    narrow = Drift(frequencies=(0.2, 0.2001)).grid(50.0, 0.1)
    assert narrow is not None
    assert narrow.tolist() == [0.2]


def test_grid_with_too_many_says_where_to_end() -> None:
    drift = Drift(frequencies=(0.1, 3.0))
    with pytest.raises(sf.ConfigError, match=r"29001 frequencies.* 20000: end at") as caught:
        drift.grid(duration=5000.0, interval=0.1)
    end = float(str(caught.value).split("end at ")[1].split(" Hz")[0])
    grid = dataclasses.replace(drift, frequencies=(0.1, end)).grid(5000.0, 0.1)
    assert grid is not None
    assert 19_990 <= len(grid) <= 20_000


def test_default_grid_is_each_sensors_own_unless_too_long() -> None:
    assert Drift().grid(duration=1999.0, interval=0.1) is None
    assert Drift().grid(duration=0.0, interval=0.0) is None
    grid = Drift().grid(duration=10_000.0, interval=0.1)
    assert grid is not None
    assert len(grid) == 19_999
    assert (grid[0], grid[-1]) == (pytest.approx(1e-4), pytest.approx(1.0))


def test_linear_filter_knows_no_faults(tmp_path: Path) -> None:
    config = load(tmp_path, "")
    assert isinstance(config.make_filter(), sf.RobustFilter)
    linear = config.make_linear_filter()
    assert isinstance(linear, sf.DesyncFilter)
    assert [sensor.faults for sensor in linear.sensors] == [(), ()]
    assert linear.sensors == config.without_faults().make_linear_filter().sensors
