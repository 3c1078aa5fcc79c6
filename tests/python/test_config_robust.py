"""Configuration files with faults: what they build, and how they complain."""

from __future__ import annotations

from pathlib import Path

import pytest

import surefix as sf
from surefix.config import Config, load_config

HEAD = """
[model]
kind = "constant-acceleration"
jerk = 0.08
[initial]
state = [0.0, 0.0]
sigma = [1.0, 0.1]
"""
WHEEL = '[[sensor]]\nname = "wheel"\nsigma = 1.0\n'
GPS = '[[sensor]]\nname = "gps"\nsigma = 0.5\n'
OUTAGE = '{ mode = "outage", span = 100.0, rate = 0.001, duration = 1.0 }'
DRIFTING = '{ mode = "drifting", sigma = 20, walk = 1.0, rate = 0.01, duration = 5.0 }'
FAULTY = WHEEL + f"faults = [{OUTAGE}]\n"


def load(folder: Path, text: str) -> Config:
    path = folder / "config.toml"
    path.write_text(HEAD + text, encoding="utf-8")
    return load_config(path)


def robust(folder: Path, text: str) -> sf.RobustFilter:
    engine = load(folder, text).make_filter()
    assert isinstance(engine, sf.RobustFilter)
    return engine


def complaint(folder: Path, text: str) -> str:
    with pytest.raises(sf.ConfigError) as caught:
        load(folder, text)
    where, _, rest = str(caught.value).partition("config.toml:")
    assert where == f"{folder}/"
    return rest


def test_every_mode(tmp_path: Path) -> None:
    given = f"""{WHEEL}faults = [
        {OUTAGE}, {DRIFTING},
        {{ mode = "frozen", resolution = 0.01, span = 80, change = 0.01, probability = 0.1 }},
        {{ mode = "frozen", resolution = 0.01, span = 80, rate = 0.1, duration = 30 }},
    ]
    {GPS}faults = [
        {{ mode = "noisy", factor = 100, probability = 0.1 }},
        {{ mode = "interrupted", factor = 2, probability = 0.1 }},
        {{ mode = "interrupted", probability = 0.1 }},
    ]
    """
    given = given.replace("rate = 0.", "probability = 0.01, rate = 0.")
    wheel, gps = load(tmp_path, given).sensors
    both = {"probability": 0.01}
    assert wheel.faults == (
        sf.Outage(span=100.0, rate=0.001, duration=1.0, **both),
        sf.Drifting(sigma=20.0, walk=1.0, rate=0.01, duration=5.0, **both),
        sf.Frozen(resolution=0.01, span=80.0, change=0.01, probability=0.1),
        sf.Frozen(resolution=0.01, span=80.0, rate=0.1, duration=30.0, **both),
    )
    assert gps.faults == (
        sf.Noisy(factor=100.0, probability=0.1),
        sf.Interrupted(factor=2.0, probability=0.1),
        sf.Interrupted(probability=0.1),
    )


def test_any_fault_makes_the_filter_robust(tmp_path: Path) -> None:
    config = load(tmp_path, FAULTY + GPS + "[output]\nrisk = 1e-7\n")
    engine = config.make_filter()
    assert isinstance(engine, sf.RobustFilter)
    assert (engine.risk, engine.prior, engine.carry) == (1e-7, "chains", "merge")
    plain = config.without_faults()
    assert isinstance(plain.make_filter(), sf.DesyncFilter)
    assert [sensor.faults for sensor in plain.sensors] == [(), ()]
    assert isinstance(load(tmp_path, WHEEL + "faults = []\n").make_filter(), sf.DesyncFilter)


def test_robust_table(tmp_path: Path) -> None:
    engine = robust(
        tmp_path,
        FAULTY
        + """
        [robust]
        prior = "chains"
        carry = "cut"
        components = 5
        cut = 1e-13
        memory = 60
        max_faults = 1
        sides = "lower"
        """,
    )
    found = (engine.prior, engine.carry, engine.components, engine.cut, engine.memory)
    assert found == ("chains", "cut", 5, 1e-13, 60.0)
    assert (engine.max_faults, engine.sides) == (1, "lower")


def test_common_faults(tmp_path: Path) -> None:
    common = '[[common]]\nmodes = { wheel = "outage", gps = "drifting" }\nrate = 0.01\n'
    engine = robust(tmp_path, f"{FAULTY}{GPS}faults = [{DRIFTING}]\n{common}")
    assert engine.common == (sf.CommonFault({"wheel": "outage", "gps": "drifting"}, 0.01),)


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        (FAULTY.replace("span", "spam"), ["[[sensor]] 1 faults 1", "'spam'", "'span'"]),
        (FAULTY.replace("outage", "outrage"), ["faults 1 mode: expected one of", "'outage'?"]),
        (FAULTY.replace('mode = "outage", ', ""), ["faults 1 missing key 'mode'"]),
        (FAULTY.replace('"outage"', "3"), ["faults 1 mode", "got 3"]),
        (FAULTY.replace("span = 100.0, ", ""), ["faults 1 missing key 'span'"]),
        (FAULTY.replace("100.0", '"wide"'), ["faults 1 span: expected a number, got 'wide'"]),
        (FAULTY.replace("100.0", "-1"), ["faults 1", "outage span", "-1"]),
        (FAULTY.replace(", rate = 0.001", ""), ["faults 1", "a probability, or a rate"]),
        (FAULTY.replace("faults", "fault"), ["[[sensor]] 1 unknown key 'fault'", "'faults'"]),
        (WHEEL + "faults = 3", ["[[sensor]] 1 faults: expected tables", "got 3"]),
        (WHEEL + 'faults = ["outage"]', ["[[sensor]] 1 faults: expected tables"]),
        (WHEEL + f"faults = [{DRIFTING}, {DRIFTING}]", ["[[sensor]] 1", "at most one"]),
        (FAULTY + "[robust]\nmax_fault = 1", ["[robust] unknown key 'max_fault'"]),
        (FAULTY + "[robust]\ncarry = 1", ["[robust] carry: expected a text"]),
        (FAULTY + "[robust]\ncomponents = 1.5", ["[robust] components: expected a whole"]),
        (FAULTY + '[robust]\ncarry = "all"', ["carry: expected one of", "'all'"]),
        (FAULTY + '[robust]\nsides = "left"', ["sides", "'left'"]),
        (FAULTY + '[robust]\nprior = "constant"', ["'wheel'", "probability"]),
        (FAULTY + "[robust]\ncut = 1e-3", ["cut: expected less than the risk"]),
        (FAULTY + "[common]\nrate = 1", ["common: expected tables, each headed [[common]]"]),
        (FAULTY + "[[common]]\nmodes = 3\nrate = 1", ["[[common]] 1 modes: expected a table"]),
        (FAULTY + "[[common]]\nrate = 1", ["[[common]] 1 missing key 'modes'"]),
        (FAULTY + "[[common]]\nmodes = {}\nrate = 1", ["[[common]] 1", "modes"]),
        (
            FAULTY + '[[common]]\nmodes = { whel = "outage" }\nrate = 1',
            ["[[common]] 1 modes: unknown sensor 'whel'", "'wheel'"],
        ),
        (
            FAULTY + '[[common]]\nmodes = { wheel = "frozen" }\nrate = 1',
            ["[[common]] 1 modes: sensor 'wheel' has no mode 'frozen'", "outage"],
        ),
        (
            FAULTY + '[[common]]\nmodes = { wheel = "outage" }\nrate = -1',
            ["[[common]] 1", "rate", "-1"],
        ),
        (WHEEL + "[robust]\ncut = 0", ["robust: expected a sensor with faults"]),
        (WHEEL + "[[common]]\nmodes = {}\nrate = 1", ["common: expected a sensor with faults"]),
    ],
)
def test_complaints(tmp_path: Path, text: str, parts: list[str]) -> None:
    found = complaint(tmp_path, text)
    for part in parts:
        assert part in found
