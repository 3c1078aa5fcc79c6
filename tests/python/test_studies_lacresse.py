"""The study of Lacresse's figure 2: its sky, bounds that hold and are reached, critical biases,
what is drawn, numbers and files."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import linalg, optimize, stats

import surefix as sf
from oracle.step import Array
from surefix.studies import (
    STUDIES,
    lacresse_critical,
    lacresse_crossings,
    lacresse_fig_2,
    lacresse_measured,
    lacresse_sampling,
    lacresse_sky,
    lacresse_worst,
)
from surefix.studies.lacresse_sine import ALPHA, GAMMA, KD, SIGMA, SineTrack
from surefix.studies.lacresse_sky import Sky

pytest.importorskip("matplotlib")

AMPLITUDES = np.geomspace(0.1, 20.0, 6)
RUNS = 5_000
Study = tuple[dict[str, Any], Path]


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Study:
    folder = tmp_path_factory.mktemp("study")
    calls: list[tuple[int, int]] = []
    numbers = lacresse_fig_2.run(
        folder, lambda done, total: calls.append((done, total)), recordings=folder,
        amplitudes=AMPLITUDES, headings=np.array([0.0, 90.0]), drawn=(2.0,), runs=RUNS,
    )  # fmt: skip
    assert calls == [(1, 2), (2, 2)]
    assert STUDIES["lacresse-fig-2"].module == lacresse_fig_2.__name__
    return numbers, folder


@pytest.fixture(scope="module")
def sky() -> Sky:
    return lacresse_sky.held()


def power(root: float, degrees: int) -> float:
    """Of SciPy, at λ = root²."""
    h = stats.chi2.isf(ALPHA, degrees)
    return float(stats.ncx2.sf(h, degrees, root**2)) if root > 0 else ALPHA


def test_sky_is_that_of_the_recording(sky: Sky, recording: Callable[[str], Path]) -> None:
    data = sf.raim.read_pseudoranges(recording("gnss-geonet-0759/pseudoranges.csv"))
    station = sf.raim.geodetic_to_ecef(*lacresse_sky.STATION)
    epoch = np.abs(data.time - 3240.0) < 1
    elevation, azimuth = data.sky(station)
    seen = epoch & (elevation > lacresse_sky.MASK)
    assert data.satellite[seen].tolist() == list(lacresse_sky.SATELLITES)
    rounded = 1e3 * np.array(list(lacresse_sky.SATELLITES.values()))
    assert np.abs(data.position[seen] - rounded).max() <= 500
    np.testing.assert_allclose(sky.elevation, elevation[seen], atol=np.degrees(5e-5))
    east, north, _ = sky.satellites.T
    np.testing.assert_allclose(
        np.degrees(np.arctan2(east, north)) % 360, azimuth[seen], atol=np.degrees(1e-3)
    )


def test_skies_that_are_read(recording: Callable[[str], Path]) -> None:
    recording("car-smartloc/pseudoranges.csv")
    folder = recording("gnss-nagoya-rover/pseudoranges.csv").parents[1]
    found = lacresse_sky.skies(folder)
    assert [(len(s.satellites), s.clocks.shape[1]) for s in found] == [(8, 1), (30, 3), (16, 2)]
    for s in found:
        assert (s.elevation > lacresse_sky.MASK).all()
        assert (s.clocks.sum(axis=1) == 1).all()


@pytest.mark.parametrize("heading", [0.0, 90.0, 215.0])
def test_bend(sky: Sky, heading: float) -> None:
    """Of the distances as differences say, and the directions."""
    track = SineTrack(sky, 30.0, heading)
    turn = np.radians(heading)
    way = track.satellites @ [1.0, 0.0, 0.0]
    np.testing.assert_allclose(way, sky.satellites @ [np.sin(turn), np.cos(turn), 0.0])
    step = 2e-3
    l = np.linspace(step, 1 - step, 999)  # noqa: E741
    before, at, after = (track.distances((l + d)[:, None]) for d in (-step, 0.0, step))
    second = np.abs(after - 2 * at + before).max(axis=0) / step**2
    assert (second <= track.bend[:, 0]).all()
    assert (second > 0.9 * track.bend[:, 0])[np.abs(track.satellites[:, 1]) > 1e7].all()


def by_hand(track: SineTrack) -> tuple[Array, Array, int]:
    """W (whitened), E (k, n) of a least-squares fit in 401 points, degrees of freedom."""
    l = np.linspace(0.0, 1.0, 401)  # noqa: E741
    basis = np.column_stack([l, np.ones_like(l)])
    c = np.stack([KD * l, track.amplitude * np.sin(2 * np.pi * l), 0 * l], axis=1)
    d = np.linalg.norm(track.sky.satellites[None] - c[:, None], axis=2)
    d -= d[0]
    fit = np.linalg.lstsq(basis, d, rcond=None)[0]
    W = linalg.null_space(np.column_stack([fit[0], np.ones(len(fit[0]))]).T).T
    return W, (d - basis @ fit) / SIGMA, len(W)


def test_indicators_by_hand(study: Study, sky: Sky) -> None:
    numbers, _ = study
    first = numbers["skies"][0]
    for k, v in enumerate(AMPLITUDES):
        W, E, degrees = by_hand(SineTrack(sky, v))
        h = stats.chi2.isf(ALPHA, degrees)
        least = optimize.brentq(lambda x: stats.ncx2.cdf(h, degrees, x) - GAMMA, 1, 500)  # noqa: B023
        assert first["lambda_gamma"] == pytest.approx(least, rel=1e-9)
        sampled = {
            "": float(np.linalg.norm(np.abs(E).max(axis=0))),
            "_tight": float(np.linalg.norm(E @ W.T, axis=1).max()),
        }
        for suffix, b in sampled.items():
            certified = numbers[f"b{suffix}"][k]
            assert b * (1 - 1e-6) <= certified <= b * (1 + 1e-3)
            e1 = power(np.sqrt(least), degrees) - power(np.sqrt(least) - certified, degrees)
            assert numbers[f"e1{suffix}"][k] == pytest.approx(e1, rel=1e-7)
            assert numbers[f"e2{suffix}"][k] == pytest.approx(
                power(certified, degrees) - ALPHA, rel=1e-7, abs=1e-15
            )


def test_order_of_the_bounds(study: Study) -> None:
    numbers, _ = study
    of = {name: np.array(column) for name, column in numbers["skies"][0]["indicators"].items()}
    assert of["v"].tolist() == AMPLITUDES.tolist() == numbers["v"]
    for e in ("b", "e1", "e2"):
        for fit in ("", "_minimax"):
            assert (of[f"{e}{fit}_tight"] <= of[f"{e}{fit}"]).all()
            assert (np.diff(of[f"{e}{fit}_tight"]) > 0).all()
        assert (of[f"{e}_minimax"] < of[e]).all()
        assert (of[f"{e}_direct"] <= of[f"{e}_tight"]).all()
        assert (of[f"{e}_direct"] > 0.99 * of[f"{e}_tight"]).all()  # it is reached
    assert (of["e1_satellite"] < of["e1_direct"]).all()
    assert (of["e1_lambda_max"] <= of["e1"]).all()
    assert (of["e1"] <= of["e1_supremum"]).all()
    assert of["e1_supremum"] == pytest.approx(of["e2_supremum"], rel=1e-6)
    assert (of["lambda_max"] > numbers["skies"][0]["lambda_gamma"]).all()


def test_worst_place(sky: Sky) -> None:
    """By SciPy, and one of a satellite by trying."""
    track = SineTrack(sky, 6.0)
    length = lacresse_critical.shortest_interval(SineTrack(sky, 0.0))
    of, model = lacresse_worst.worst(track, length), track.model()

    def size(l: float) -> float:  # noqa: E741
        return float(np.linalg.norm(lacresse_worst.parity_error(track, model, np.array([l]))))

    found = [
        optimize.minimize_scalar(
            lambda l: -size(l),  # noqa: E741
            bounds=ends,
            method="bounded",
            options={"xatol": 1e-9},
        )
        for ends in ((0, 0.1), (0.1, 0.4), (0.4, 0.6), (0.6, 0.9), (0.9, 1))
    ]
    best = max([-f.fun for f in found] + [size(0.0), size(1.0)])
    assert of.b == pytest.approx(best, rel=1e-9)
    assert size(of.l) == of.b
    root = np.sqrt(lacresse_critical.critical(track, length))
    rng = np.random.RandomState(4)
    for _ in range(300):
        i, sign, l = rng.randint(len(root)), rng.choice([-1, 1]), rng.uniform()  # noqa: E741
        seen = sign * root[i] * model.W[:, i] / np.linalg.norm(model.W[:, i])
        seen = seen + lacresse_worst.parity_error(track, model, np.array([l]))[0]
        hidden = sf.raim.missed(seen @ seen, model.degrees, ALPHA)
        assert hidden <= of.missed_satellite * (1 + 1e-9)


def test_interval_is_that_of_the_monitor(sky: Sky) -> None:
    """On a straight track the monitor has p* = γ with L, and the same critical biases."""
    length = lacresse_critical.shortest_interval(SineTrack(sky, 0.0))
    monitor = sf.raim.TrackRaim(
        sf.raim.Track([[0.0, 0.0, 0.0], [KD, 0.0, 0.0]]), length=length, false_alarm=ALPHA,
        missed=GAMMA, risk=lacresse_critical.RISK, fault_probability=lacresse_critical.FAULT,
    )  # fmt: skip
    n = len(sky.satellites)
    ranges = np.linalg.norm(sky.satellites - [KD / 2, 0.0, 0.0], axis=1) + 30.0
    names = [f"G{k:02d}" for k in range(1, n + 1)]
    epoch = sf.raim.Pseudoranges(np.zeros(n), names, sky.satellites, ranges, SIGMA)
    found = monitor.run(epoch)
    assert found.along[0] == pytest.approx(KD / 2, abs=1e-6)
    assert found.p_star[0] == pytest.approx(GAMMA, rel=1e-5)
    track = SineTrack(sky, 0.0)
    own = np.square(found.critical_bias) * np.square(
        np.linalg.norm(track.model().W, axis=0) / SIGMA
    )
    np.testing.assert_allclose(lacresse_critical.critical(track, length), own, rtol=1e-5)
    assert lacresse_critical.critical(track, length).min() == pytest.approx(
        lacresse_critical.just_missed(n - 2), rel=1e-7
    )


def test_crossings(study: Study, sky: Sky) -> None:
    """e₁ is γ and e₂ is α there; about where another implementation has them."""
    numbers, _ = study
    found = numbers["crossings"]
    at = SineTrack(sky, found["e1"]).model()
    assert at.e1(noncentrality=numbers["skies"][0]["lambda_gamma"], bound="loose") == pytest.approx(
        GAMMA, rel=1e-6
    )
    at = SineTrack(sky, found["e2_minimax_tight"]).model("minimax")
    assert at.e2(bound="tight") == pytest.approx(ALPHA, rel=1e-6)
    for e in ("e1", "e2"):
        assert found[e] < found[f"{e}_tight"] < found[f"{e}_minimax_tight"]
        assert found[e] < found[f"{e}_minimax"]
    assert found["e1_supremum"] < found["e1"] < found["e1_satellite"] < found["e1_lambda_max"]
    north, east = numbers["headings"]
    assert east["e1_tight"] == found["e1_tight"]
    for e, expected in numbers["expected"].items():
        assert north[f"{e}_tight"] <= expected <= east[f"{e}_tight"]
    assert not any("NOT" in line for line in numbers["report"])
    short = numbers["skies"][0]["crossings_of_short_k"]
    assert short["e1"] > 50 * found["e1_tight"]
    assert short["radius_e1"] == pytest.approx(KD**2 / (4 * np.pi**2 * short["e1"]))


def test_crossings_that_are_not_there(sky: Sky) -> None:
    assert lacresse_crossings.first(sky, lambda track: 1.0, 0.5) == 0.0
    assert np.isnan(lacresse_crossings.first(sky, lambda track: 0.0, 0.5))
    assert np.isnan(lacresse_critical.bisect(lambda v: v + 1, 1.0, 2.0))
    at = lacresse_crossings.first(sky, lambda track: track.amplitude, 7.0)
    assert at == pytest.approx(7.0, rel=1e-8)


def test_what_is_drawn(study: Study) -> None:
    """Near what is predicted, and within the bounds but for the errors of drawing."""
    rows = study[0]["skies"][0]["measured"]
    assert [row["what"].split(",")[0] for row in rows] == ["false alarms", "missed", "missed"]
    for row in rows:
        assert abs(row["off"]) < 4
        assert row["error"] < 0.1 * row["exact"]
        assert row["low_loose"] <= row["low_tight"] <= row["exact"]
        assert row["exact"] <= row["high_tight"] <= row["high_loose"]
        for bound in ("tight", "loose"):
            assert lacresse_measured.inside(row, bound, 4)


def test_drawn_epochs_are_tested_as_any(sky: Sky) -> None:
    """Weighted or not, the same shares: where false alarms are common plain drawing can tell."""
    track, runs = SineTrack(sky, 25.0), 20_000
    model = track.model()
    share = lacresse_sampling.false_alarms(track, 0.0, runs, 1)
    noise = SIGMA * np.random.RandomState(2).standard_normal((runs, len(sky.satellites)))
    alarm = np.asarray(model.run(track.distances(np.zeros((1, 1))) + noise).alarm)
    assert share.value == pytest.approx(alarm.mean(), abs=5 * alarm.std() / np.sqrt(runs))
    rare = lacresse_sampling.false_alarms(SineTrack(sky, 1.0), 0.0, runs, 1)
    assert rare.error < 0.05 * np.sqrt(ALPHA / runs)  # where plain drawing cannot


def test_files(study: Study) -> None:
    numbers, folder = study
    stored = json.loads((folder / "study.json").read_text(encoding="utf-8"))
    assert stored == json.loads(json.dumps(numbers))
    for name, rows in (("indicators", len(AMPLITUDES)), ("measured", 3)):
        with (folder / f"{name}.csv").open(encoding="utf-8", newline="") as file:
            table = list(csv.DictReader(file))
        assert len(table) == rows
        assert {row["sky"] for row in table} == {"gnss-geonet-0759"}
    assert (folder / "figure.png").stat().st_size > 10_000
    assert numbers["note"] in numbers["report"]
