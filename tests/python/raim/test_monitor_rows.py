"""Rows of pseudoranges: which belong together, which are used, and that nothing else matters."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

import surefix as sf
from oracle.raim_geodesy import elevation_azimuth
from oracle.raim_monitor import Demand
from oracle.raim_solution import solve
from raim.scenes import Scene, monitor, scene

DEMAND = Demand(80.0, fault_probability=1e-5)
SCENE = scene(5, 12, satellites=(8, 14))
EPOCHS = ("along", "sigma", "statistic", "p_star", "bound", "e1", "e2", "protection",
          "protection_chi2", "alarm", "declared", "used", "degrees")  # fmt: skip
ROWS = ("critical_bias", "missed_at_critical", "residual", "excluded")


@cache
def result() -> sf.raim.RaimResult:
    return monitor(SCENE.track, DEMAND).run(SCENE.pseudoranges)


def table(s: Scene) -> dict[str, Any]:
    p = s.pseudoranges
    return {
        "time": np.asarray(p.time), "satellite": list(p.satellite), "position": p.position,
        "pseudorange": p.pseudorange, "sigma": p.sigma, "system": [x for e in s.epochs
                                                                   for x in e.system],
    }  # fmt: skip


def run(rows: dict[str, Any]) -> sf.raim.RaimResult:
    given = sf.raim.Pseudoranges(**rows)
    return monitor(SCENE.track, DEMAND).run(given)


def test_rows_in_any_order() -> None:
    """Sorted by time: as long as each epoch keeps its order, bit for bit."""
    rows = table(SCENE)
    time = np.asarray(rows["time"])
    rng, order = np.random.RandomState(1), np.arange(len(time))
    key = rng.uniform(size=len(time))
    for t in np.unique(time):
        key[time == t] = np.sort(key[time == t])
    order = np.argsort(key)
    mixed = {n: [v[i] for i in order] if isinstance(v, list) else v[order] for n, v in rows.items()}
    other = run(mixed)
    for name in (*EPOCHS, *ROWS):
        np.testing.assert_array_equal(getattr(other, name), getattr(result(), name))


def test_an_epoch_does_not_know_of_the_others() -> None:
    alone = monitor(SCENE.track, DEMAND)
    for t in (0, 5, 11):
        one = alone.run(replace(SCENE, epochs=SCENE.epochs[t : t + 1]).pseudoranges)
        assert one.along[0] == pytest.approx(result().along[t], abs=1e-6)
        assert one.statistic[0] == pytest.approx(result().statistic[t], rel=1e-6)
        assert one.protection[0] == pytest.approx(result().protection[t], rel=1e-8)


def test_where_the_search_begins_does_not_matter() -> None:
    """Within what the beginning has to be right to; later epochs are looked for anywhere."""
    for off in (-DEMAND.length, 0.0, DEMAND.length):
        near = float(SCENE.truth[0]) + off
        other = monitor(SCENE.track, DEMAND).run(SCENE.pseudoranges, near=near)
        np.testing.assert_allclose(other.along, result().along, atol=1e-6)
        assert other.declared.tolist() == result().declared.tolist()


def test_a_pseudorange_that_is_no_number_is_not_there() -> None:
    rows = table(SCENE)
    gone = [SCENE.first[t] + 2 for t in range(12)]
    pseudorange = np.array(rows["pseudorange"])
    pseudorange[gone] = np.nan
    found = run({**rows, "pseudorange": pseudorange})
    for t, e in enumerate(SCENE.epochs):
        s = solve(e.without([2]), SCENE.spline, float(SCENE.truth[t]))
        if found.status[t] != "ok":
            continue
        assert found.statistic[t] == pytest.approx(s.statistic, rel=1e-6)
        assert found.degrees[t] == s.degrees
        if found.declared[t] == "ok":
            assert found.used[t] == e.n - 1
            assert found.along[t] == pytest.approx(s.along, abs=1e-6)
        assert np.isnan(found.residual[gone[t]])
        assert np.isnan(found.critical_bias[gone[t]])
        assert not found.excluded[gone[t]]


def test_a_system_seen_once_says_nothing() -> None:
    """Its clock takes it all: no effect, no critical bias, and the rest as without it."""
    e = scene(6, 1, systems=(1, 1), satellites=(9, 9))
    one = e.epochs[0]
    lonely = replace(one, system=(*one.system[:-1], "R"))
    a = monitor(e.track, DEMAND).run(replace(e, epochs=(lonely,)).pseudoranges)
    b = monitor(e.track, DEMAND).run(replace(e, epochs=(one.without([8]),)).pseudoranges)
    for name in ("along", "sigma", "statistic", "p_star", "degrees"):
        np.testing.assert_allclose(getattr(a, name), getattr(b, name), rtol=1e-7)
    assert a.critical_bias[8] == np.inf
    assert a.missed_at_critical[8] == 0.0
    assert a.residual[8] == pytest.approx(0.0, abs=1e-7)


def test_a_clock_of_ones_own_is_the_linear_test() -> None:
    """The same statistic from ``parity_test``, of the Jacobian at the solution."""
    for t, e in enumerate(SCENE.epochs):
        s = solve(e, SCENE.spline, float(SCENE.truth[t]))
        y = s.r + s.J @ np.arange(1.0, s.J.shape[1] + 1.0)
        assert sf.raim.parity_test(y, s.J, noise=1.0, false_alarm=1e-5).statistic == (
            pytest.approx(result().statistic[t], rel=1e-6)
        )


def test_pseudoranges() -> None:
    p = SCENE.pseudoranges
    assert p.epochs == 12
    np.testing.assert_array_equal(p.epoch_time, np.arange(12.0))
    x = SCENE.spline.position(800.0)
    elevation, azimuth = elevation_azimuth(np.asarray(p.position), x)
    seen = p.sky(x)
    np.testing.assert_allclose(seen[0], elevation, atol=1e-9)
    np.testing.assert_allclose(seen[1], azimuth, atol=1e-9)
    high = p.where(elevation > 30.0)
    np.testing.assert_array_equal(high.pseudorange, p.pseudorange[elevation > 30.0])
    np.testing.assert_array_equal(p.with_sigma(3.0).sigma, np.full(len(elevation), 3.0))
    rows = [3, 17]
    bias = np.zeros(len(elevation))
    bias[rows] = 50.0
    moved = p.with_bias(bias).pseudorange - p.pseudorange
    np.testing.assert_allclose(moved[rows], 50.0, atol=1e-8)
    assert np.count_nonzero(moved) == 2
    sigma = sf.raim.elevation_sigma(np.array([90.0, 30.0]), 2.0)
    np.testing.assert_allclose(sigma, [2.0, 4.0], rtol=1e-14)
