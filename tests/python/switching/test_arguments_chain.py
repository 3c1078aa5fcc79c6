"""What a chain of modes refuses, and how it says so."""

from __future__ import annotations

from collections.abc import Callable
from math import inf, nan
from typing import Any

import numpy as np
import pytest

import surefix as sf
from switching.refused import ANY, HALF, I1, SHAPE, TWO, VALUE, Refused, chain, refuses


def moved(transition: Any, initial: Any = None) -> sf.ModeChain:
    return sf.ModeChain(TWO, transition, initial)


def rated(rates: Any, dt: Any) -> sf.ModeChain:
    return sf.ModeChain.from_rates(TWO, rates, dt)


wrongly: Any = sf  # called with what a type checker refuses
half: Any = 1.5
texts: Any = ["0", "1"]
CHAINS: dict[str, Refused] = {
    "no modes": (lambda: chain([], np.zeros((0, 0))), VALUE, "modes: expected"),
    "modes a number": (lambda: chain(3), VALUE, "modes: expected"),
    "not pairs": (lambda: chain([(1, 1), (0, 1, 2)]), VALUE, "modes.*: expected .*pair"),
    "gamma NaN": (lambda: chain([(1, 1), (nan, 1)]), VALUE, "modes.*gamma.*nan"),
    "gamma inf": (lambda: chain([(inf, 1), (0, 1)]), VALUE, "modes.*gamma.*inf"),
    "delta 0": (lambda: chain([(1, 0), (0, 1)]), VALUE, r"modes.*delta.*> 0.*got 0"),
    "delta < 0": (lambda: chain([(1, 1), (0, -2)]), VALUE, r"modes.*delta.*> 0.*got -2"),
    "delta NaN": (lambda: chain([(1, 1), (0, nan)]), VALUE, "modes.*delta.*nan"),
    "delta inf": (lambda: chain([(1, 1), (0, inf)]), VALUE, "modes.*delta.*inf"),
    "delta a text": (lambda: chain([(1, "1"), (0, 1)]), VALUE, "modes.*delta.*'1'"),
    "gamma a text": (lambda: chain([("1", 1), (0, 1)]), VALUE, "modes.*gamma.*'1'"),
    "a stack of no step": (
        lambda: moved(np.zeros((0, 2, 2)), [1, 0]),
        SHAPE,
        r"transition: .*got \(0, 2, 2\)",
    ),
    "a stack of one step without a law": (lambda: moved([HALF]), VALUE, "initial: expected a law"),
    "a stack of one step stays?": (
        lambda: moved([HALF], [1, 0]).stationary(),
        VALUE,
        "stationary: ",
    ),
    "a stack of texts": (lambda: moved([[["1", "0"], ["0", "1"]]], [1, 0]), SHAPE, "transition: "),
    "a stack of ragged ones": (lambda: moved([[[1.0], [0.5, 0.5]]]), SHAPE, "transition: "),
    "initial ragged": (lambda: chain(initial=[[1.0], [0.5, 0.5]]), SHAPE, "initial: "),
    "drawn texts": (
        lambda: wrongly.ModeChain.independent_draws(gamma={"1": 1.0}, delta={1: 1.0}),
        VALUE,
        "gamma: .*'1'",
    ),
    "drawn with texts": (
        lambda: wrongly.ModeChain.independent_draws(gamma={1: "1"}, delta={1: 1.0}),
        VALUE,
        "gamma probability: .*'1'",
    ),
    "joint negative": (
        lambda: sf.ModeChain.joint_draws({(1, 1): 1.5, (0, 1): -0.5}),
        VALUE,
        r"^probability: .*-0\.5",
    ),
    "levels of texts": (
        lambda: wrongly.ModeChain.independent_chains(["1"], I1, (1,), I1),
        SHAPE,
        "gamma_levels: ",
    ),
    "gamma's chain stays": (
        lambda: sf.ModeChain.independent_chains((1, 0), np.eye(2), (1,), I1),
        VALUE,
        "gamma_transition: .*stationary",
    ),
    "too many pairs": (
        lambda: sf.ModeChain.independent_chains(
            range(9), np.full((9, 9), 1 / 9), range(1, 10), np.full((9, 9), 1 / 9)
        ),
        VALUE,
        "modes: expected 1 to 64, got 81",
    ),
    "gamma's chain per step": (
        lambda: sf.ModeChain.independent_chains((1, 0), [HALF], (1,), I1),
        SHAPE,
        r"gamma_transition: .*\(2, 2\), got \(1, 2, 2\)",
    ),
    "dt of no step": (lambda: rated(HALF, []), SHAPE, "dt: "),
    "dt ragged": (lambda: rated(HALF, [0.1, [0.1]]), SHAPE, "dt: "),
    "dt of texts": (lambda: rated(HALF, ["0.1"]), SHAPE, "dt: "),
    "rates of texts": (lambda: rated([["0", "1"], ["1", "0"]], 0.1), SHAPE, "rates: "),
    "lumps pieces": (
        lambda: wrongly.ModeChain.lumped(chain(), [[0.5], [1]]),
        VALUE,
        r"groups: .*0\.5",
    ),
    "a stack of one step": (lambda: moved([HALF], [1, 0]).law(5), VALUE, "steps: .*2.*got 5"),
    "rows": (
        lambda: moved([[0.5, 0.5]]),
        SHAPE,
        r"transition: .*\(2, 2\).*got \(1, 2\)",
    ),
    "columns": (
        lambda: moved(np.full((2, 3), 1 / 3)),
        SHAPE,
        r"transition: .*got \(2, 3\)",
    ),
    "one row": (lambda: moved([0.5, 0.5]), SHAPE, r"transition: .*got \(2,\)"),
    "larger": (lambda: moved(np.eye(3)), SHAPE, r"transition: .*\(2, 2\).*got \(3, 3\)"),
    "four axes": (lambda: moved([[HALF]]), SHAPE, r"transition: .*got \(1, 1, 2, 2\)"),
    "sum": (lambda: moved([[0.5, 0.5], [0.5, 0.4]]), VALUE, r"transition: .*sum.*0\.9"),
    "sum a little": (
        lambda: moved([[0.5, 0.5], [0.5, 0.500001]]),
        VALUE,
        "transition: .*sum",
    ),
    "columns sum to one": (
        lambda: moved([[0.9, 0.5], [0.1, 0.5]]),
        VALUE,
        "transition: .*sum",
    ),
    "sum of a step": (
        lambda: moved([HALF, [[0.5, 0.4], [0.5, 0.5]]], initial=[1, 0]),
        VALUE,
        r"transition\[1\]: .*sum",
    ),
    "negative": (
        lambda: moved([[1.5, -0.5], [0.5, 0.5]]),
        VALUE,
        r"transition: .*-0\.5",
    ),
    "NaN": (lambda: moved([[0.5, nan], [0.5, 0.5]]), VALUE, "transition: .*nan"),
    "text": (lambda: moved("ab"), ANY, "transition: "),
    "ragged": (lambda: moved([[1.0], [0.5, 0.5]]), ANY, "transition: "),
    "initial size": (lambda: chain(initial=[1.0]), SHAPE, r"initial: .*\(2,\), got \(1,\)"),
    "initial sum": (lambda: chain(initial=[0.5, 0.4]), VALUE, r"initial: .*sum.*0\.9"),
    "initial negative": (lambda: chain(initial=[1.5, -0.5]), VALUE, r"initial: .*-0\.5"),
    "initial NaN": (lambda: chain(initial=[nan, 1]), VALUE, "initial: .*nan"),
    "not unique": (lambda: moved(np.eye(2)), ANY, "initial: expected a law"),
    "steps of no law": (lambda: moved([HALF, HALF]), ANY, "initial: "),
    "gamma's sum": (
        lambda: sf.ModeChain.independent_draws(gamma={1: 0.9, 0: 0.2}, delta={1: 1.0}),
        VALUE,
        r"gamma: .*sum",
    ),
    "delta's sum": (
        lambda: sf.ModeChain.independent_draws(gamma={1: 1.0}, delta={1: 0.9, 2: 0.2}),
        VALUE,
        r"delta: .*sum",
    ),
    "drawn negative": (
        lambda: sf.ModeChain.independent_draws(gamma={1: 1.5, 0: -0.5}, delta={1: 1.0}),
        VALUE,
        r"gamma probability: .*-0\.5",
    ),
    "drawn delta": (
        lambda: sf.ModeChain.independent_draws(gamma={1: 1.0}, delta={0: 1.0}),
        VALUE,
        "delta.*> 0.*got 0",
    ),
    "joint sum": (
        lambda: sf.ModeChain.joint_draws({(1, 1): 0.5}),
        VALUE,
        r"probability: .*sum.*0\.5",
    ),
    "joint of none": (lambda: sf.ModeChain.joint_draws({}), VALUE, "expected"),
    "gamma's chain": (
        lambda: sf.ModeChain.independent_chains((1, 0), I1, (1,), I1),
        SHAPE,
        r"gamma_transition: .*\(2, 2\).*got \(1, 1\)",
    ),
    "delta's chain": (
        lambda: sf.ModeChain.independent_chains((1, 0), HALF, (1,), HALF),
        SHAPE,
        r"delta_transition: .*\(1, 1\).*got \(2, 2\)",
    ),
    "delta's rows": (
        lambda: sf.ModeChain.independent_chains((1,), I1, (1, 2), [[0.5, 0.5], [0.5, 0.6]]),
        VALUE,
        "delta_transition: .*sum",
    ),
    "rates' size": (
        lambda: rated(I1, 0.1),
        SHAPE,
        r"rates: .*\(2, 2\).*got \(1, 1\)",
    ),
    "rate < 0": (
        lambda: rated([[0, -1], [1, 0]], 0.1),
        VALUE,
        "rates: .*-1",
    ),
    "rate NaN": (
        lambda: rated([[0, nan], [1, 0]], 0.1),
        VALUE,
        "rates: .*nan",
    ),
    "rate inf": (
        lambda: rated([[0, inf], [1, 0]], 0.1),
        VALUE,
        "rates: .*inf",
    ),
    "rates whose sum overflows": (
        lambda: sf.ModeChain.from_rates([*TWO, (0, 2)], np.full((3, 3), 1e308), 0.1),
        VALUE,
        "^rates: .*infinity in row 0",
    ),
    "rates too fast": (
        lambda: rated([[0, 1e308], [1e308, 0]], 0.1),
        VALUE,
        r"^rates, dt: .*1e\+308",
    ),
    "rates over too long": (
        lambda: rated([[0, 1e200], [1, 0]], [0.1, 1e300]),
        VALUE,
        r"^rates, dt: .*over 1e\+300",
    ),
    "dt < 0": (lambda: rated(HALF, -0.1), VALUE, r"dt: .*-0\.1"),
    "dt NaN": (lambda: rated(HALF, [0.1, nan]), VALUE, "dt: .*nan"),
    "dt inf": (lambda: rated(HALF, inf), VALUE, "dt: .*inf"),
    "dt a matrix": (lambda: rated(HALF, HALF), SHAPE, r"dt: .*got \(2, 2\)"),
    "rates that stay": (
        lambda: rated(np.zeros((2, 2)), 0.1),
        ANY,
        "initial: expected a law",
    ),
    "law of no steps": (lambda: chain().law(0), VALUE, "steps: .*got 0"),
    "law of half a step": (lambda: chain().law(half), VALUE, r"steps: .*got 1\.5"),
    "lumps what is seen": (
        lambda: chain([(1, 1), (1, 2)]).lumped([[0, 1]]),
        VALUE,
        "groups: .*gamma",
    ),
    "lumps what is there not": (lambda: chain().lumped([[0], [2]]), VALUE, "groups: .*2"),
    "lumps from the end": (lambda: chain().lumped([[0], [-1]]), VALUE, "groups: .*-1"),
    "lumps halves": (lambda: chain().lumped([[half], [1]]), VALUE, r"groups: .*1\.5"),
    "lumps texts": (lambda: chain().lumped(texts), VALUE, "groups: "),
    "lumps twice": (lambda: chain().lumped([[0], [1, 1]]), VALUE, "groups: "),
    "lumps in two": (lambda: chain().lumped([[0], [1], [1]]), VALUE, "groups: "),
    "lumps not all": (lambda: chain().lumped([[0]]), VALUE, "groups: "),
    "lumps nothing": (lambda: chain().lumped([[0], [1], []]), VALUE, "groups: "),
}


@refuses(CHAINS)
def test_chain_that_is_none(make: Callable[[], Any], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        make()


def test_rows_that_sum_to_one_up_to_rounding_are_taken() -> None:
    modes = [(1, 1 + i) for i in range(10)]
    assert sum([0.1] * 10) != 1.0
    sf.ModeChain(modes, np.full((10, 10), 0.1), [0.1] * 10)
    sf.ModeChain(modes[:3], [[1 / 3, 1 / 3, 1 / 3], [0.7, 0.2, 0.1], [0.1, 0.2, 0.7]])
    sf.ModeChain.joint_draws({(1, 1): 0.7, (0, 1): 0.2, (0, 2): 0.1})
