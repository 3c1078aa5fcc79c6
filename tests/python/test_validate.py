"""``surefix validate``: the estimator where the answer is known, weights, files, bad arguments."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import surefix as sf
from surefix.intervals import share_interval
from surefix.validation import importance, validate
from surefix.validation.condition import Condition, tail
from surefix.validation.importance import Proposal
from surefix.validation.measure import measure
from surefix.validation.scenario import Scenario, raised, stationary, transition
from surefix.validation.simulate import Runs, joined, simulate
from surefix.validation.violations import ASSUMED, SETTINGS, SHARED, SHORT


@pytest.fixture(scope="module")
def known() -> dict[str, Any]:
    return validate(60, 3, risks=[1e-2, 1e-6], settings=["linear"])


def test_linear_case_is_the_claimed_risk(
    known: dict[str, Any], record_property: Callable[[str, object], None]
) -> None:
    """Without faults the conditional probability is the risk itself, in every single run."""
    for row in known["settings"]["linear"]["risks"]:
        ratio = row["measured"] / row["claimed"]
        record_property("figure", f"measured / claimed at {row['claimed']:.0e}: {ratio:.6f}")
        assert row["measured"] == pytest.approx(row["claimed"], rel=1e-6)
        assert row["verdict"] == "agrees"


def test_mixture_with_known_answer() -> None:
    """A filter that keeps every history has exactly the claimed risk where no mode is told."""
    setting = dataclasses.replace(SETTINGS["exact"], window=3)
    for row in measure(setting, 30, 3, [1e-2, 1e-6], lambda done, total: None)["risks"]:
        assert row["measured"] == pytest.approx(row["claimed"], rel=1e-4)


def test_reproducible_by_seed() -> None:
    first, again = (validate(30, 3, risks=[1e-2], settings=["own"]) for _ in range(2))
    assert first == again
    other = validate(30, 4, risks=[1e-2], settings=["own"])
    assert other["settings"] != first["settings"]


@pytest.mark.parametrize("scenario", [SHORT, dataclasses.replace(ASSUMED, shared=SHARED)])
def test_likelihood_ratios_average_to_one(scenario: Scenario) -> None:
    """Also of runs of a proposal other than the one that is the scenario."""
    proposals = (Proposal(0.3), Proposal(0.3, 2, 10.0), Proposal(0.4, 8, 4.0, shared=5.0))
    counts = importance.counts(proposals, 4000)
    assert sum(counts) == 4000
    random = np.random.RandomState(7)
    runs = joined(
        [simulate(scenario, p, n, random) for p, n in zip(proposals, counts, strict=True)]
    )
    found = Condition(scenario, proposals, counts, runs)
    found.to_the_end(0)
    weight = found.weighed(np.ones(4000))
    assert abs(weight.mean() - 1) < 4 * importance.error(weight, counts)
    assert importance.error(weight, counts) < 0.05
    assert weight.max() <= 1 / 0.3 + 1e-9
    if scenario.shared is None:
        faulty = (runs.modes[:, :, -1] > 0).mean(axis=0)
        usual = [1 - stationary(G)[0] for G in scenario.chains()]
        assert (faulty > 1.2 * np.array(usual)).all()
        weighed = (weight[:, None] * (runs.modes[:, :, -1] > 0)).mean(axis=0)
        np.testing.assert_allclose(weighed, usual, rtol=0.25)


def test_condition_is_that_of_the_truth() -> None:
    """Told all modes, errors are normal with the deviation it says; told fewer, the probability
    below a limit is still the share of truths below it."""
    random = np.random.RandomState(11)
    proposals = (Proposal(1.0),)
    runs = simulate(SHORT, proposals[0], 3000, random)
    told = Condition(SHORT, proposals, [3000], runs)
    told.to_the_end(0)
    z = (runs.truth - told.mean) / told.sigma
    assert abs(z.mean()) < 4 / np.sqrt(3000)
    assert abs(z.var() - 1) < 4 * np.sqrt(2 / 3000)
    some = Runs(runs.value[:1000], runs.truth[:1000], runs.modes[:1000])
    open_ = Condition(SHORT, proposals, [1000], some)
    open_.to_the_end(1)
    limit = told.mean[:1000] + 0.3
    each = len(open_.vectors)
    mass = open_.weighed(tail((np.repeat(limit, each) - open_.mean) / open_.sigma))
    above = some.truth > limit
    assert abs(mass.mean() - above.mean()) < 4 * np.sqrt(0.25 / 1000)
    np.testing.assert_allclose(open_.weighed(np.ones(1000 * each)), 1.0, rtol=1e-12)


def test_agrees_with_plain_simulation() -> None:
    """The share of truths outside, by counting, is within the interval of the weighted estimate."""
    found = validate(400, 2, risks=[0.1], settings=["sigma"])["settings"]["sigma"]["risks"][0]
    assert found["plain_low"] < found["measured"] < found["plain_high"]
    assert found["verdict"] == "above"


def test_too_few_runs_give_no_number() -> None:
    found = importance.estimate(np.r_[1.0, np.full(99, 1e-9)], np.ones(100), [100])
    assert found["measured"] is None
    assert found["effective"] == pytest.approx(1.0, abs=1e-3)


def test_chain() -> None:
    """e^{GΔt} of a fault that comes at a and ends at b, and its raised form."""
    a, b, dt = 0.3, 0.7, 1.3
    G = np.array([[-a, a], [b, -b]])
    fault = a / (a + b)
    expected = fault * (1 - np.exp(-(a + b) * dt))
    assert transition(G, dt)[0, 1] == pytest.approx(expected, rel=1e-12)
    assert stationary(G)[1] == pytest.approx(fault, rel=1e-12)
    np.testing.assert_allclose(raised(G, 2.0), [[-2 * a, 2 * a], [b, -b]])


def test_share_interval() -> None:
    assert share_interval(0, 100)[1] == pytest.approx(1 - 0.025 ** (1 / 100), rel=1e-6)
    low, high = share_interval(5, 50)
    assert (low, high) == pytest.approx((0.03327509, 0.21813537), rel=1e-5)  # Clopper and Pearson


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"runs": 3}, "runs"),
        ({"seed": -1}, "seed"),
        ({"risks": [0.0]}, "risks"),
        ({"risks": []}, "risks"),
        ({"settings": ["nothing"]}, "common-mode"),
        ({"settings": []}, "settings"),
    ],
)
def test_bad_arguments(options: dict[str, Any], message: str) -> None:
    with pytest.raises(sf.ConfigError, match=message):
        validate(**options)


def test_scenario_refuses_what_it_cannot_simulate() -> None:
    frozen = sf.Frozen(resolution=0.1, span=50.0, rate=1e-3, duration=5.0)
    for sensor in (sf.Sensor("a", 1.0, faults=(frozen,)), sf.Sensor("a", 1.0, bias_sigma=1.0)):
        with pytest.raises(sf.ConfigError, match="'a'"):
            dataclasses.replace(ASSUMED, sensors=(sensor,), hz=(1.0,))
    with pytest.raises(sf.ConfigError, match="hz"):
        dataclasses.replace(ASSUMED, hz=(1.0,))


def test_command(tmp_path: Path) -> None:
    pytest.importorskip("typer")
    pytest.importorskip("matplotlib")
    from typer.testing import CliRunner

    from surefix.cli.app import app

    names = ["linear", "sigma"]
    options = ["validate", "--runs", "40", "--seed", "5", "--out", str(tmp_path / "out"), "--json"]
    options += [part for name in names for part in ("--setting", name)]
    done = CliRunner().invoke(app, options)
    assert done.exit_code == 0, done.output
    numbers = json.loads(done.stdout)
    assert set(numbers["settings"]) == set(names)
    assert numbers == json.loads((tmp_path / "out" / "validate.json").read_text(encoding="utf-8"))
    assert (tmp_path / "out" / "figure.png").stat().st_size > 10_000
    wrong = CliRunner().invoke(app, ["validate", "--setting", "x", "--out", str(tmp_path / "no")])
    assert wrong.exit_code == 1
    assert not (tmp_path / "no").exists()
