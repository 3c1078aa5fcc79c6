"""What the monitor cannot answer, it says; what it is wrongly given, it refuses by name."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import surefix as sf
from oracle.raim_monitor import Demand
from oracle.raim_solution import Epoch
from oracle.step import Array
from raim.scenes import Scene, monitor, scene, straight_points
from switching.refused import ANY, SHAPE, VALUE, Refused, refuses

wrongly: Any = sf
DEMAND = Demand(80.0)
SCENE = scene(41, 3, systems=(1, 1), satellites=(8, 8))
ONE = SCENE.epochs[0]


def run(e: Epoch, s: Scene = SCENE) -> sf.raim.RaimResult:
    return monitor(s.track, DEMAND).run(replace(s, epochs=(e,)).pseudoranges)


def is_silent(result: sf.raim.RaimResult, status: str) -> None:
    """No number, no claim, no alarm."""
    assert result.status.tolist() == [status]
    assert result.declared.tolist() == ["not available"]
    for name in ("along", "sigma", "statistic", "p_value", "p_star", "bound", "e1", "e2",
                 "protection", "protection_chi2"):  # fmt: skip
        assert np.isnan(getattr(result, name)).all(), name
    for name in ("alarm", "separation_alarm", "available", "available_with_e1", "excluded"):
        assert not getattr(result, name).any(), name


@pytest.mark.parametrize("n", [1, 2])
def test_fewer_satellites_than_unknowns_and_a_test(n: int) -> None:
    result = run(ONE.without(range(n, 8)))
    is_silent(result, "too few satellites")
    assert result.used.tolist() == [n]


def test_as_many_systems_as_satellites() -> None:
    is_silent(run(replace(ONE.without([6, 7]), system=tuple("GERCJS"))), "too few satellites")


def test_coincident_satellites() -> None:
    """All at one place: the clock and the mileage are one. Two at one place among others: fine."""
    is_silent(run(replace(ONE, satellite=np.tile(ONE.satellite[:1], (8, 1)))), "geometry")
    two = ONE.satellite.copy()
    two[1] = two[0]
    pseudorange = ONE.pseudorange.copy()
    pseudorange[1] = pseudorange[0]
    result = run(replace(ONE, satellite=two, pseudorange=pseudorange))
    assert result.status.tolist() == ["ok"]
    assert np.isfinite(result.sigma).all()


def test_satellites_across_the_track() -> None:
    """None of them sees along it: all directions perpendicular to it."""
    s = scene(42, 1, straight_points(), systems=(1, 1), satellites=(8, 8))
    x, t = s.spline.position(800.0), s.spline.tangent(800.0)
    u = np.random.RandomState(1).normal(size=(8, 3))
    u -= np.outer(u @ t, t) / (t @ t)
    satellite = x + 2e7 * u / np.linalg.norm(u, axis=1)[:, None]
    result = run(replace(s.epochs[0], satellite=satellite, pseudorange=np.full(8, 2e7)), s)
    assert result.declared.tolist() != ["ok"] or result.sigma[0] > 1e4
    assert not result.available.any()


def test_every_pseudorange_missing() -> None:
    is_silent(run(replace(ONE, pseudorange=np.full(8, np.nan))), "too few satellites")


def test_one_epoch_that_fails_leaves_the_others() -> None:
    bad = replace(ONE, pseudorange=np.full(8, np.nan))
    healthy = monitor(SCENE.track, DEMAND).run(SCENE.pseudoranges)
    mixed = replace(SCENE, epochs=(SCENE.epochs[0], bad, SCENE.epochs[2]))
    found = monitor(SCENE.track, DEMAND).run(mixed.pseudoranges)
    assert found.status.tolist() == ["ok", "too few satellites", "ok"]
    np.testing.assert_allclose(found.along[[0, 2]], healthy.along[[0, 2]], atol=1e-6)
    np.testing.assert_allclose(found.statistic[[0, 2]], healthy.statistic[[0, 2]], rtol=1e-6)


def test_a_train_that_is_elsewhere() -> None:
    """Its pseudoranges are of a place ten kilometres before the track, or of none."""
    rng = np.random.RandomState(3)
    away = SCENE.spline.position(-10_000.0)
    before = replace(ONE, pseudorange=ONE.ranges(away) + ONE.sigma * rng.normal(size=8))
    result = run(before)
    assert result.status[0] in ("off track", "diverged", "geometry")
    assert not result.available.any()
    assert np.isnan(result.protection).all()
    nowhere = replace(ONE, pseudorange=ONE.pseudorange + 1e6 * rng.normal(size=8))
    result = run(nowhere)
    assert result.declared[0] in ("alarm", "not available")


def test_absurd_numbers_are_not_used() -> None:
    """A pseudorange whose square overflows takes nothing with it; nor does a sigma of nothing."""
    healthy = monitor(SCENE.track, DEMAND).run(rows())
    for column, value in (("pseudorange", 1e300), ("pseudorange", -1e11), ("sigma", 1e-300)):
        columns = {"pseudorange": R, "sigma": S}
        columns[column] = with_value(columns[column], 3, value)
        found = monitor(SCENE.track, DEMAND).run(rows(**columns))
        assert found.declared[0] == "ok"
        assert found.used[0] == healthy.used[0] - 1


def test_no_epochs() -> None:
    empty = np.zeros(0)
    none = sf.raim.Pseudoranges(empty, [], np.zeros((0, 3)), empty, empty)
    with pytest.raises(sf.ConfigError, match=r"pseudoranges: .*none"):
        monitor(SCENE.track, DEMAND).run(none)


T, N, X, R, S = np.zeros(8), [f"G{i}" for i in range(8)], ONE.satellite, ONE.pseudorange, ONE.sigma


def rows(**changed: Any) -> Any:
    given: dict[str, Any] = {
        "time": T, "satellite": N, "position": X, "pseudorange": R, "sigma": S, **changed,
    }  # fmt: skip
    return wrongly.raim.Pseudoranges(**given)


def with_value(array: Array, place: Any, value: float) -> Array:
    out = np.array(array)
    out[place] = value
    return out


ROWS: dict[str, Refused] = {
    "time length": (lambda: rows(time=T[:7]), SHAPE, r"time: .*\(7,\)|.*\(8,\)"),
    "time NaN": (lambda: rows(time=with_value(T, 2, np.nan)), VALUE, "time: .*nan"),
    "time infinite": (lambda: rows(time=with_value(T, 2, np.inf)), VALUE, "time: .*inf"),
    "satellite count": (lambda: rows(satellite=N[:7]), ANY, "satellite: .*7"),
    "position columns": (lambda: rows(position=X[:, :2]), SHAPE, r"position: .*\(8, 2\)"),
    "position rows": (lambda: rows(position=X[:7]), SHAPE, r"position: .*\(7, 3\)"),
    "pseudorange length": (lambda: rows(pseudorange=R[:7]), SHAPE, r"pseudorange: .*\(7,\)"),
    "sigma length": (lambda: rows(sigma=S[:7]), SHAPE, r"sigma: .*\(7,\)"),
    "system count": (lambda: rows(system=["G"] * 7), ANY, "system: .*7"),
    "where length": (lambda: rows().where(np.ones(7, bool)), ANY, r"keep: .*\(7,\)"),
    "sky": (lambda: rows().sky(np.zeros(2)), SHAPE, r"position: .*\(2,\)"),
}  # fmt: skip


@refuses(ROWS)
def test_refused_rows(make: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        make()


UNUSED: dict[str, tuple[str, float]] = {
    "pseudorange NaN": ("pseudorange", np.nan), "pseudorange infinite": ("pseudorange", np.inf),
    "position NaN": ("position", np.nan), "position infinite": ("position", -np.inf),
    "sigma NaN": ("sigma", np.nan), "sigma infinite": ("sigma", np.inf),
    "sigma zero": ("sigma", 0.0), "sigma negative": ("sigma", -2.0),
}  # fmt: skip


@pytest.mark.parametrize(("name", "value"), UNUSED.values(), ids=UNUSED.keys())
def test_a_row_that_cannot_be_used_is_as_good_as_none(name: str, value: float) -> None:
    """It stays where it is, with no numbers of its own, and the count is one less."""
    given = {"position": X, "pseudorange": R, "sigma": S}
    run = monitor(SCENE.track, DEMAND).run
    found = run(rows(**{name: with_value(given[name], 3, value)}))
    kept = [i for i in range(8) if i != 3]
    without = run(sf.raim.Pseudoranges(T[kept], [N[i] for i in kept], X[kept], R[kept], S[kept]))
    assert (found.used[0], found.degrees[0]) == (7, without.degrees[0])
    for of_epoch in ("along", "sigma", "statistic", "p_star", "bound", "protection"):
        np.testing.assert_array_equal(getattr(found, of_epoch), getattr(without, of_epoch))
    for of_row in ("residual", "critical_bias", "missed_at_critical"):
        assert np.isnan(getattr(found, of_row)[3])
        np.testing.assert_array_equal(getattr(found, of_row)[kept], getattr(without, of_row))
    assert not found.excluded[3]


def build(**changed: Any) -> Any:
    given: dict[str, Any] = {"track": SCENE.track, "length": 50.0, **changed}
    return wrongly.raim.TrackRaim(given.pop("track"), **given)


SETTINGS: dict[str, tuple[dict[str, Any], str]] = {
    "track": ({"track": "track"}, "track: .*'track'"),
    **{f"length {v}": ({"length": v}, f"length: .*{v}") for v in (0.0, -1.0, np.nan, np.inf)},
    **{
        f"{name} {v}": ({name: v}, f"{name}: .*{v}")
        for name in ("false_alarm", "missed", "risk", "fault_probability")
        for v in (0.0, 1.0, -0.1, np.nan)
    },
    **{f"max_faults {v}": ({"max_faults": v}, f"max_faults: .*{v}") for v in (-1, 3, 1.5)},
    **{f"max_excluded {v}": ({"max_excluded": v}, f"max_excluded: .*{v}") for v in (-1, 9)},
    **{f"interval {v}": ({"interval": v}, f"interval: .*{v}") for v in (0.0, -1.0, np.nan)},
}


@pytest.mark.parametrize(("changed", "message"), SETTINGS.values(), ids=SETTINGS.keys())
def test_refused_settings(changed: dict[str, Any], message: str) -> None:
    with pytest.raises(sf.ConfigError, match=message):
        build(**changed)


def test_refused_data() -> None:
    for wrong in ("log.csv", np.zeros((3, 3)), None):
        with pytest.raises(sf.SurefixError, match="pseudoranges: "):
            wrongly.raim.TrackRaim(SCENE.track, length=50.0).run(wrong)
    with pytest.raises(sf.ConfigError, match=r"near: .*inf"):
        monitor(SCENE.track, DEMAND).run(SCENE.pseudoranges, near=np.inf)
    with pytest.raises(sf.ConfigError, match="points: "):
        wrongly.raim.Track(SCENE.points[:1])
