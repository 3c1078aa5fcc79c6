"""A box cut in pieces until linearisation costs no more than its budget."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest

import surefix as sf
from oracle import raim_affine as oracle
from oracle.raim_linear import Linear
from oracle.step import Array
from raim import sine

ALPHA, MISSED, AMPLITUDE = 1e-3, 60.0, 20.0
BUDGET: dict[str, Any] = {"false_alarm": ALPHA, "noncentrality": MISSED, "e1": 1e-3, "e2": 1e-3}
CLOCK = np.ones((8, 1))
COMMON: dict[str, Any] = {"noise": sine.SIGMA, "linear": CLOCK, "points": 51}


def one(low: float, high: float, amplitude: float = AMPLITUDE, **more: Any) -> Any:
    h = sine.distances(amplitude)
    return sf.raim.affine_bound(h, low, high, **COMMON, bend=sine.bend(amplitude), **more)


def cut(amplitude: float = AMPLITUDE, **more: Any) -> sf.raim.SplitModel:
    given = {**COMMON, **BUDGET, "bend": sine.bend(amplitude), **more}
    return sf.raim.split(sine.distances(amplitude), 0.0, 1.0, **given)


def within(piece: Any) -> bool:
    """By the oracle, from the piece's certified bound."""
    b, k = piece.tight_bound, piece.test.degrees
    loss = oracle.losses(b, k, ALPHA, BUDGET["noncentrality"], False)
    gain = oracle.losses(b, k, ALPHA, 0.0, True)
    return bool(loss <= BUDGET["e1"] and gain <= BUDGET["e2"])


def ends(piece: Any) -> tuple[float, float]:
    return float(np.squeeze(piece.low)), float(np.squeeze(piece.high))


def test_pieces_are_the_whole_box() -> None:
    found = cut()
    places = sorted(ends(piece) for piece in found.pieces)
    assert len(places) == found.cost > 4
    assert places[0][0] == 0.0
    assert places[-1][1] == 1.0
    for (_, high), (low, _) in pairwise(places):
        assert high == low


def test_every_piece_keeps_the_budget_and_no_cut_was_needless() -> None:
    """Each piece is half of one that was too large."""
    for piece in cut().pieces:
        assert within(piece)
        low, high = ends(piece)
        same = one(low, high)
        np.testing.assert_allclose(piece.A, same.A, rtol=1e-9)
        assert piece.tight_bound == pytest.approx(same.tight_bound, rel=1e-9)
        length = high - low
        assert length in 0.5 ** np.arange(1, 12)
        parent = np.floor(low / (2 * length)) * 2 * length
        assert not within(one(parent, parent + 2 * length))


def test_a_straight_track_is_one_piece() -> None:
    """But for the distance's own bend, |c'|^2 / d."""
    found = cut(0.0)
    assert found.cost == len(found.pieces) == 1
    assert ends(found.pieces[0]) == (0.0, 1.0)


def test_cost_grows_with_the_track_and_falls_with_the_budget() -> None:
    costs = [cut(amplitude).cost for amplitude in (2.0, 10.0, 40.0)]
    assert costs[0] < costs[1] < costs[2]
    assert cut(e1=1e-2, e2=1e-2).cost <= cut().cost <= cut(e1=1e-5, e2=1e-5).cost


def test_alarm_is_every_pieces() -> None:
    rng, found = np.random.RandomState(4), cut()
    X = rng.uniform(size=(400, 1))
    Y = sine.distances(AMPLITUDE)(X) + 1e4 * rng.normal(size=(400, 1))
    Y += sine.SIGMA * rng.normal(size=(400, 8))
    Y[::2, 3] += 60.0
    each: list[Array] = []
    for piece in found.pieces:
        H = np.column_stack([piece.A, CLOCK])
        each.append(Linear(H, None, sine.SIGMA).statistic(Y - piece.B))
    least, run = np.min(each, axis=0), found.run(Y)
    np.testing.assert_allclose(run.statistic, least, rtol=1e-9)
    clear = np.abs(least / found.pieces[0].test.threshold - 1.0) > 1e-8
    alarm = least > found.pieces[0].test.threshold
    np.testing.assert_array_equal(run.alarm[clear], alarm[clear])
    assert 0 < alarm.sum() < 400


def test_false_alarms_and_missed_faults_are_in_budget() -> None:
    """One piece is the true one: it alone alarms in alpha + e2, so all do at most so often."""
    rng, found, epochs = np.random.RandomState(5), cut(), 20_000
    X = rng.uniform(size=(epochs, 1))
    Y = sine.distances(AMPLITUDE)(X) + sine.SIGMA * rng.normal(size=(epochs, 8))
    rate, most = float(np.mean(found.run(Y).alarm)), ALPHA + BUDGET["e2"]
    assert rate <= most + 5.0 * np.sqrt(most / epochs)


def test_two_dimensions() -> None:
    """No gap, no overlap, and no cut in the direction that nothing is bent in."""

    def h(X: Array) -> Array:
        x, y = X.T
        return np.stack([np.cos(x), np.sin(x + 0.1 * y), y, x - y, 0.2 * x**2], axis=1)

    bend = np.array([[1.0, 0.0], [1.0, 0.01], [0.0, 0.0], [0.0, 0.0], [0.4, 0.0]])
    low, high = np.array([0.0, 10.0]), np.array([3.0, 20.0])
    found = sf.raim.split(h, low, high, **BUDGET, noise=0.3, points=15, bend=bend)
    sides = np.array([(p.high - p.low) / (high - low) for p in found.pieces])
    assert np.sum(np.prod(sides, axis=1)) == pytest.approx(1.0, rel=1e-12)
    assert np.all(sides[:, 0] < 1.0)
    places = low + (high - low) * np.random.RandomState(6).uniform(size=(1000, 2))
    inside = [np.all((places >= p.low) & (places < p.high), axis=1) for p in found.pieces]
    assert np.all(np.sum(inside, axis=0) == 1)
    assert all(within(piece) for piece in found.pieces)


def test_too_many_pieces() -> None:
    with pytest.raises(sf.SurefixError, match="most"):
        cut(most=3)
    assert cut(most=1024).cost > 3


@pytest.mark.parametrize("name", ["e1", "e2", "false_alarm", "noncentrality", "most"])
def test_refused(name: str) -> None:
    with pytest.raises(sf.ConfigError, match=f"{name}: .*-1"):
        cut(**{name: -1})
