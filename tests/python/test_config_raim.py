"""The configuration of ``surefix raim``: what it holds, and how it complains."""

from __future__ import annotations

import dataclasses
import inspect
from pathlib import Path

import pytest

import surefix as sf
from surefix import config_raim as module
from surefix.config_raim import RaimConfig, load_raim_config
from surefix.config_raim_tables import MonitorTable, PseudorangeTable, TrackTable, TruthTable


def load(folder: Path, text: str) -> RaimConfig:
    path = folder / "config.toml"
    path.write_text(text, encoding="utf-8")
    return load_raim_config(path)


def test_nothing_is_required(tmp_path: Path) -> None:
    config = load(tmp_path, "")
    assert config == RaimConfig()
    assert config.pseudoranges.columns() == {}
    assert config.monitor.arguments() == {}
    assert config.masks == ()


def test_every_key(tmp_path: Path) -> None:
    config = load(
        tmp_path,
        """
        [pseudoranges]
        time = "t"
        satellite = "sv"
        position = ["x", "y", "z"]
        pseudorange = "rho"
        system = "constellation"
        sigma = "sd"
        elevation_mask = 10
        earth_rotation = true
        [track]
        columns = ["lat", "lon"]
        tolerance = 0.5
        height = 90
        start = 1200
        [monitor]
        length = 50
        false_alarm = 1e-4
        missed = 0.01
        risk = 1e-8
        fault_probability = 1e-5
        max_faults = 1
        max_excluded = 3
        interval = 20
        max_speed = 40
        near = 1300
        [truth]
        time = "when"
        along = "mileage"
        [[mask]]
        kind = "cutting"
        low = 100
        high = 200
        left_deg = 40
        right_deg = 20
        [[mask]]
        kind = "tunnel"
        low = 300
        high = 400
        """,
    )
    assert config.pseudoranges == PseudorangeTable(
        "t", "sv", ("x", "y", "z"), "rho", "constellation", "sd", None, 10.0, True
    )
    assert config.track == TrackTable(("lat", "lon"), 0.5, 90.0, 1200.0)
    assert config.monitor == MonitorTable(50.0, 1e-4, 0.01, 1e-8, 1e-5, 1, 3, 20.0, 40.0, 1300.0)
    assert config.truth == TruthTable("when", "mileage", None)
    assert set(config.monitor.arguments()) == {*module._MONITOR} - {"near"}
    cutting, tunnel = config.masks
    assert cutting == sf.raim.Cutting(100.0, 200.0, 40.0, 20.0)
    assert tunnel == sf.raim.Tunnel(300.0, 400.0)
    assert config.pseudoranges.columns() == {
        "time": "t", "satellite": "sv", "position": ("x", "y", "z"), "pseudorange": "rho",
        "system": "constellation", "sigma": "sd",
    }  # fmt: skip


def test_sigma_is_a_column_or_a_number_or_of_the_zenith(tmp_path: Path) -> None:
    assert load(tmp_path, "[pseudoranges]\nsigma = 2").pseudoranges.columns() == {"sigma": 2.0}
    given = load(tmp_path, "[pseudoranges]\nsigma_zenith = 2").pseudoranges
    assert (given.sigma, given.sigma_zenith, given.columns()) == (None, 2.0, {})


def test_keys_are_the_fields() -> None:
    for keys, table in (
        (module._PSEUDORANGES, PseudorangeTable),
        (module._TRACK, TrackTable),
        (module._MONITOR, MonitorTable),
        (module._TRUTH, TruthTable),
    ):
        assert set(keys) == {field.name for field in dataclasses.fields(table)}
    for what, keys in module._MASKS.values():
        assert set(keys) == set(inspect.signature(what).parameters)


def test_monitor_takes_what_the_library_takes() -> None:
    known = {*inspect.signature(sf.raim.TrackRaim).parameters} - {"track", "earth_rotation"}
    assert {field.name for field in dataclasses.fields(MonitorTable)} == {*known, "near"}


@pytest.mark.parametrize(
    ("table", "text", "parts"),
    [
        ("", "[monitr]", ["'monitr'", "did you mean 'monitor'?"]),
        ("", "mask = 5", ["mask", "each headed [[mask]]"]),
        ("[pseudoranges]", "sigma_zenit = 1", ["'sigma_zenit'", "did you mean 'sigma_zenith'?"]),
        ("[pseudoranges]", "sigma = true", ["sigma", "name of a column, or a number"]),
        ("[pseudoranges]", 'sigma = ""', ["sigma", "name of a column, or a number"]),
        ("[pseudoranges]", "sigma = 0", ["sigma", "> 0"]),
        ("[pseudoranges]", "sigma_zenith = -1", ["sigma_zenith", "> 0"]),
        ("[pseudoranges]", "sigma = 1\nsigma_zenith = 1", ["sigma, sigma_zenith", "got both"]),
        ("[pseudoranges]", 'position = ["x", "y"]', ["position", "three names"]),
        ("[pseudoranges]", "elevation_mask = 91", ["elevation_mask", "-90 to 90", "91"]),
        ("[pseudoranges]", "earth_rotation = 1", ["earth_rotation", "true or false"]),
        ("[track]", 'columns = ["x"]', ["columns", "two or three"]),
        ("[track]", "tolerance = -1", ["tolerance", ">= 0"]),
        ("[track]", "start = inf", ["start", "finite"]),
        ("[monitor]", "length = 0", ["length", "> 0"]),
        ("[monitor]", "risk = 1", ["risk", "probability"]),
        ("[monitor]", "max_faults = 3", ["max_faults", "from 0 to 2", "3"]),
        ("[monitor]", "max_excluded = 1.5", ["max_excluded", "a whole number"]),
        ("[monitor]", "interval = -2", ["interval", "> 0"]),
        ("[monitor]", "max_speed = 0", ["max_speed", "> 0"]),
        ("[monitor]", "near = nan", ["near", "finite"]),
        ("[truth]", 'along = "s"\nposition = ["x", "y", "z"]', ["along, position", "got both"]),
        ("[truth]", 'position = ["x"]', ["position", "three names"]),
        ("[[mask]]", "low = 1", ["missing key 'kind'"]),
        ("[[mask]]", 'kind = "tunel"', ["kind", "cutting, tunnel", "did you mean 'tunnel'?"]),
        ("[[mask]]", 'kind = "tunnel"\nlow = 1', ["missing key 'high'"]),
        ("[[mask]]", 'kind = "tunnel"\nlow = 2\nhigh = 1', ["tunnel high", ">= low = 2"]),
        ("[[mask]]", 'kind = "tunnel"\nlow = 1\nhigh = 2\nleft_deg = 3', ["'left_deg'"]),
        (
            "[[mask]]",
            'kind = "cutting"\nlow = 1\nhigh = 2\nleft_deg = 95\nright_deg = 0',
            ["cutting left_deg", "0 to 90", "95"],
        ),
    ],
)
def test_complaints_name_file_table_and_key(
    tmp_path: Path, table: str, text: str, parts: list[str]
) -> None:
    with pytest.raises(sf.ConfigError) as caught:
        load(tmp_path, f"{table}\n{text}")
    for part in (f"{tmp_path / 'config.toml'}:", table, *parts):
        assert part in str(caught.value)
    assert "\n" not in str(caught.value)
