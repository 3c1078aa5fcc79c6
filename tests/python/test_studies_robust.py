"""The studies of Bilenne's figures: scenes, the count of misses, and small runs of both."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import surefix as sf
from surefix import misleading
from surefix.parallel import in_parallel
from surefix.studies import STUDIES, bilenne_fig_1, bilenne_fig_2, scenarios

pytest.importorskip("matplotlib")


def constant(speed: float) -> scenarios.Truth:
    return lambda time: np.full(len(time), speed)


class Limits:
    """A result with given limits around an estimate of 1."""

    def __init__(self, lower: list[float], upper: list[float]) -> None:
        self.time = np.arange(1.0, len(lower) + 1)
        self.estimate = np.ones(len(lower))
        self.lower, self.upper = np.array(lower), np.array(upper)


def test_radars_collapse_and_drift() -> None:
    scene = scenarios.collapse(3, 0.5)
    log, again = scene.log, scenarios.collapse(3, 0.5).log
    np.testing.assert_array_equal(log.value, again.value)
    np.testing.assert_array_equal(scene.truth(np.array([0.0, 13.0, 24.0])), 30.0)
    failed = (log.time >= 12) & (log.time < 16)
    for name, sigma in scenarios.RADARS.items():
        own = log.sensor == name
        assert own.sum() == pytest.approx(240, abs=1)
        since = log.time - 12 if name == "radar 2" else 4.0
        stuck = (log.value - (30 - 0.5 * since))[own & failed]
        assert np.abs(stuck).max() < 5 * scenarios.STUCK_NOISE
        assert (log.value[own & ~failed] - 30).std() == pytest.approx(sigma, rel=0.2)


def test_brakes() -> None:
    for ramp, lost in ((0.0, 6.0), (1.0, 5.5), (2.0, 5.0)):
        scene = scenarios.braking(1, 1.3, ramp)
        time = np.linspace(0.0, 24.0, 24001)
        speed = scene.truth(time)
        assert speed[0] == 30
        assert speed[-1] == pytest.approx(30 - 1.3 * lost)
        slope = np.diff(speed) / np.diff(time)
        assert slope.min() == pytest.approx(-1.3)
        if ramp:
            assert np.diff(slope).min() / 1e-3 == pytest.approx(-1.3 / ramp, rel=1e-3)
        assert np.abs(scene.log.value - scene.truth(scene.log.time)).max() < 10


def test_radars_that_drift_alike_look_like_brakes() -> None:
    alike, brakes = scenarios.common_drift(5, 0.7).log, scenarios.braking(5, 0.7, 0.0).log
    same = alike.time < 16
    np.testing.assert_array_equal(alike.time, brakes.time)
    np.testing.assert_allclose(alike.value[same], brakes.value[same], atol=1e-12)


def test_tunnel() -> None:
    scene = scenarios.tunnel(2, 5.0)
    log = scene.log
    gps = log.sensor == "gps"
    inside = gps & (log.time >= 1597) & (log.time < 1622)
    assert len(np.unique(log.value[inside])) == 1
    last = log.value[gps & (log.time < 1597)][-1]
    assert log.value[inside][0] == last
    assert inside.sum() == pytest.approx(125, abs=1)
    wrong = np.flatnonzero(log.value == 103 / 3.6)
    assert [*log.sensor[wrong]] == ["radar"]
    assert log.time[wrong[0]] == pytest.approx(1600, abs=0.051)
    np.testing.assert_allclose(scene.truth(np.array([1590.0, 1626.0, 1640.0])), [15.0, 30.0, 30.0])
    assert np.diff(scene.truth(np.arange(1575.0, 1640.0, 0.01))).max() < 0.01 * 0.7


def test_misses_are_counted() -> None:
    inf, nan = np.inf, np.nan
    limits = Limits([0.0, 1.5, -inf, nan, 0.0, 0.0], [2.0, 2.0, inf, nan, 1.0, 0.5])
    np.testing.assert_array_equal(
        misleading.outside(limits, constant(1.0)), [False, True, False, True, False, True]
    )
    run = misleading.judge(limits, constant(1.0), (1.0, 5.0))
    good = misleading.judge(Limits([0.0] * 6, [3.0] * 6), constant(1.0), (1.0, 5.0))
    numbers = misleading.summary([run, good])
    assert numbers["misleading_fraction"] == 2 / 8
    assert numbers["misleading_runs"] == 0.5
    assert numbers["available_fraction"] == 6 / 8
    assert numbers["mean_width"] == pytest.approx((0.5 + 1.0 + 4 * 3.0) / 6)
    assert numbers["max_error"] == 0
    never = misleading.summary([misleading.judge(Limits([-inf], [inf]), constant(1.0), (0, 5))])
    assert never["available_fraction"] == 0
    assert np.isnan(never["mean_width"])


def test_confidence_of_a_share() -> None:
    assert misleading.upper_confidence(0, 100) == pytest.approx(1 - 0.05**0.01, rel=1e-6)
    assert misleading.upper_confidence(7, 7) == 1.0
    # scipy.stats.beta.ppf(0.95, found + 1, runs - found)
    for found, runs, expected in (
        (1, 10, 0.39416330243650466),
        (3, 25, 0.28172250797771403),
        (24, 25, 0.9979503715873792),
    ):
        assert misleading.upper_confidence(found, runs) == pytest.approx(expected, rel=1e-6)


def test_work_in_parallel_keeps_its_order_and_its_errors() -> None:
    calls: list[tuple[int, int]] = []

    def report(done: int, total: int) -> None:
        calls.append((done, total))

    work = [lambda i=i: i * i for i in range(20)]
    assert in_parallel(work, report) == [i * i for i in range(20)]
    assert calls == [(i, 20) for i in range(1, 21)]

    def fails() -> int:
        raise sf.ConfigError("refused")

    with pytest.raises(sf.ConfigError, match="refused"):
        in_parallel([fails, *work], report)


@pytest.fixture(scope="module")
def collapse(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], Path]:
    folder = tmp_path_factory.mktemp("fig2")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(bilenne_fig_2, "RATES", (10.0, 1.25))
        patch.setattr(bilenne_fig_2, "DRIFTS", (0.5, 1.0))
        patch.setattr(bilenne_fig_2, "BRAKES", ((1.0, 1.0),))
        patch.setattr(bilenne_fig_2, "COMPONENTS", 27)
        patch.setattr(bilenne_fig_2, "COUNTS", (("merge", 27, 1.25), ("cut", 24, 1.25)))
        patch.setattr(bilenne_fig_2, "COUNTS_SEEDS", 1)
        patch.setattr(bilenne_fig_2, "COUNTS_DRIFTS", (1.0,))
        numbers = bilenne_fig_2.run(folder, lambda done, total: None, seeds=2, fewer=1)
    return numbers, folder


def test_collapse(collapse: tuple[dict[str, Any], Path]) -> None:
    numbers, folder = collapse
    stored = json.loads((folder / "study.json").read_text(encoding="utf-8"))
    assert (folder / "figure.png").stat().st_size > 10_000
    for key in ("1.25Hz carried 0.5", "1.25Hz carried 1", "1.25Hz carried brakes 1 ramp 1"):
        assert stored[key] == numbers[key]
        assert numbers[key]["seeds"] == 2
        assert numbers[key]["misleading_fraction"] == 0
        assert numbers[key]["available_fraction"] == 1
        assert 1.5 < numbers[key]["mean_width"] < 6
    assert numbers["10Hz outage 1"]["misleading_fraction"] > 0.1
    assert numbers["10Hz outage brakes 1 ramp 1"]["misleading_fraction"] == 0
    assert numbers["1.25Hz carried alike 1"]["misleading_fraction"] > 0
    merge, cut = stored["components"]
    assert (merge["carry"], merge["components"], merge["misleading_fraction"]) == ("merge", 27, 0)
    assert merge["max_discarded_mass"] < 1e-11 < cut["max_discarded_mass"]
    assert (cut["available_fraction"], cut["mean_width"]) == (0, None)
    assert any("1.25Hz carried" in line for line in numbers["report"])
    assert any("no filter can know" in line for line in numbers["report"])


def test_tunnel_study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bilenne_fig_1, "GPS_RATES", (5.0,))
    monkeypatch.setattr(scenarios, "TUNNEL_TIME", (1585.0, 1631.0))
    numbers = bilenne_fig_1.run(tmp_path, lambda done, total: None, seeds=1)
    stored = json.loads((tmp_path / "study.json").read_text(encoding="utf-8"))
    assert (tmp_path / "figure.png").stat().st_size > 10_000
    assert stored["linear gps 5Hz"]["misleading_fraction"] > 0.3
    assert stored["linear gps 5Hz"]["max_error"] > 5
    frozen = numbers["frozen gps 5Hz"]
    assert frozen["misleading_fraction"] == 0
    assert frozen["available_fraction"] == 1
    assert frozen["outlier_rejected"] == 1
    assert 0 < frozen["detection_delay"] <= 1.0
    assert frozen["frozen_rejected"] > 0.95
    assert frozen["healthy_rejected"] < 0.01
    assert frozen["max_error"] < 1.5


def test_registered() -> None:
    assert {"bilenne-fig-1", "bilenne-fig-2"} <= set(STUDIES)
