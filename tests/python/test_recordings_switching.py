"""A real recording through the switching filters: the figures of docs/recordings.md.

The recording is not part of the repository; where it is absent these tests are skipped.
"""

from __future__ import annotations

import dataclasses
import re
import runpy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import surefix as sf

ROOT = Path(__file__).parents[2]
PLAIN, ONE_STEP, IMM = "Kalman", "one-step, one chain", "IMM, one chain"
EACH = "a chain for each sensor"

Rows = dict[str, dict[str, Any]]


@pytest.fixture(scope="module")
def example() -> dict[str, Any]:
    """What examples/car-nagoya/compare_switching.py defines."""
    return runpy.run_path(str(ROOT / "examples" / "car-nagoya" / "compare_switching.py"))


@pytest.fixture(scope="module")
def folder(recording: Callable[[str], Path]) -> Path:
    return recording("car-nagoya/speed_events.csv").parent


@pytest.fixture(scope="module")
def rows(example: dict[str, Any], folder: Path) -> Rows:
    found: Rows = example["compare"](example["read"](folder))
    return found


def documented() -> dict[str, list[float]]:
    """The table of docs/recordings.md, its shares as numbers."""
    text = (ROOT / "docs" / "recordings.md").read_text(encoding="utf-8")
    section = text.split("\n## With switching modes\n", 1)[1].split("\n## ", 1)[0]
    table = {}
    for name, cells in re.findall(r"^\| ([A-Za-z][^|]*) \| (−?\d.*) \|$", section, re.MULTILINE):
        values = [cell.strip().replace("−", "-").replace(" ", "") for cell in cells.split("|")]
        table[name.replace("`", "")] = [
            float(v[:-1]) / 100 if v.endswith("%") else float(v) for v in values
        ]
    return table


def test_documented_figures(rows: Rows) -> None:
    """As printed: half a unit of the last digit, and two epochs, is rounding and platform."""
    table = documented()
    assert set(rows) < set(table)
    for name, row in rows.items():
        found = [float(value) for value in row.values() if np.ndim(value) == 0]
        np.testing.assert_allclose(found, table[name], rtol=0.01, atol=6e-4, err_msg=name)


def test_the_plain_one_is_the_desynchronized_filter(
    example: dict[str, Any], folder: Path, rows: Rows
) -> None:
    """The steps that the example makes are the model of config-robust.toml, without its faults."""
    config = example["configuration"]("config-robust.toml")
    sensors = tuple(dataclasses.replace(sensor, faults=()) for sensor in config.sensors)
    config = dataclasses.replace(config, sensors=sensors)
    result = config.run(config.read_log(folder / "speed_events.csv"))
    assert isinstance(result, sf.Result)
    np.testing.assert_allclose(rows[PLAIN]["x"], result.estimate, rtol=1e-7, atol=1e-7)
    np.testing.assert_allclose(rows[PLAIN]["sigma"], result.sigma, rtol=1e-7)
    assert rows[PLAIN]["log_likelihood"] == pytest.approx(result.log_likelihood, rel=1e-9)


def test_gross_errors_are_survived(rows: Rows) -> None:
    switching = [name for name in rows if name.startswith(("one-step", "IMM"))]
    assert len(switching) == 4
    for name in switching:
        assert rows[name]["rms"] < 0.05 * rows[PLAIN]["rms"]
        assert rows[name]["worst"] < 0.05 * rows[PLAIN]["worst"]
        assert rows[name]["rms_not_fitted"] < 0.05 * rows[PLAIN]["rms_not_fitted"]
        assert rows[name]["log_likelihood"] > 500 > rows[PLAIN]["log_likelihood"]


def test_imm_is_ahead_of_one_step(rows: Rows) -> None:
    """With the same chain: it does not merge what the modes say before the next measurement."""
    for kind in ("one chain", EACH):
        imm, one_step = rows[f"IMM, {kind}"], rows[f"one-step, {kind}"]
        assert imm["rms"] < 0.75 * one_step["rms"]
        assert imm["log_likelihood"] > one_step["log_likelihood"] + 100


def test_sigma_is_no_alert_limit(rows: Rows) -> None:
    """A Gaussian would be beyond three sigma for 0.27 % of the time."""
    for name, row in rows.items():
        if name.startswith(("one-step", "IMM")):
            assert 0.02 < row["beyond_3_sigma"] < 0.06
    assert rows["Kalman, told what is wrong"]["beyond_3_sigma"] < 0.0027


def test_a_system_for_each_mode_says_the_same(example: dict[str, Any], folder: Path) -> None:
    """Instead of the speaking sensor in the chain: noise and rows of each mode in its system."""
    recording = example["read"](folder, 180.0)  # with the error of 171 m/s
    chain = example["shared_chain"](recording)
    s, systems = recording.system, []
    for doppler in chain.modes:
        for rtk in chain.modes:
            gamma, delta = np.array([doppler, rtk])[recording.sensor].T[:, :, None, None]
            systems.append(sf.LinearSystem(s.A, gamma * s.H, s.Q, delta * s.R, s.x0, s.P0))
    pairs = chain.size**2
    both = np.einsum("kac,kbd->kabcd", chain.p, chain.p).reshape(-1, pairs, pairs)
    pair = sf.ModeChain([(1, 1)] * pairs, both, np.kron(chain.initial, chain.initial))
    found = sf.IMMFilter(systems, pair).run(recording.z)
    expected = sf.IMMFilter(s, example["chain_of_each"](recording)).run(recording.z)
    np.testing.assert_allclose(found.x, expected.x, rtol=1e-7, atol=1e-7)
    assert found.log_likelihood == pytest.approx(expected.log_likelihood, abs=1e-5)


def test_parameters_are_a_maximum(example: dict[str, Any], folder: Path) -> None:
    """None of them changed by a half explains the fitted part better."""
    recording = example["read"](folder, example["FITTED"])

    def likelihood(parameters: dict[str, float]) -> float:
        chain = example["shared_chain"](recording, parameters)
        found = sf.IMMFilter(recording.system, chain).run(recording.z).log_likelihood
        assert isinstance(found, float)
        return found

    chosen = example["PARAMETERS"]
    most = likelihood(chosen)
    for name in chosen:
        for factor in (1.5, 1 / 1.5):
            assert likelihood(chosen | {name: factor * chosen[name]}) < most + 0.5, (name, factor)
