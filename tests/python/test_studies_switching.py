"""The studies of Sigalov & Oshman's examples: what is drawn, the filters, numbers and files."""

from __future__ import annotations

import csv
import json
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from oracle import switching, switching_chain
from oracle.step import Array
from surefix.studies import (
    STUDIES,
    sigalov_comparison,
    sigalov_example_1,
    sigalov_example_2,
    sigalov_examples,
)
from surefix.studies.sigalov_examples import Example

pytest.importorskip("matplotlib")

RUNS = 1000
P11 = (0.3 + 0.7 * 0.9**2) / 0.93  # example 2: Pr(both healthy) / Pr(healthy)
MODES = ((1.0, 1.0), (1.0, 10.0), (0.0, 1.0), (0.0, 10.0))
PLANT = switching.Plant(
    np.array([[-0.8]]), np.eye(1), np.eye(1), np.eye(1), np.zeros(1), np.zeros((1, 1))
)
# Of shared/prototypes/switching.py, 10,000 runs; its standard error is 0.003 to 0.005.
PROTOTYPE = (
    {"linear": 1.59, "one_step": 1.39, "imm4": 1.37},
    {"linear": 1.46, "one_step": 1.29, "imm4": 1.29},
)
PROTOTYPE_ERROR = 4 * 0.005 + 0.005  # and rounding


def examples() -> tuple[Example, Example]:
    return sigalov_example_1.make_example(), sigalov_example_2.make_example()


def oracle_chain(gamma: Array) -> switching_chain.Chain:
    """gamma follows this matrix, healthy first; delta is drawn anew."""
    return switching_chain.independent(gamma, np.tile([0.8, 0.2], (2, 1)), (1.0, 10.0))


@pytest.fixture(scope="module", params=[sigalov_example_1, sigalov_example_2])
def study(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[int, dict[str, Any], Path]:
    module: ModuleType = request.param
    folder = tmp_path_factory.mktemp("study")
    calls: list[tuple[int, int]] = []
    numbers = module.run(folder, lambda done, total: calls.append((done, total)), runs=RUNS)
    assert calls == [(i, 4) for i in range(1, 5)]
    return int(module.__name__[-1]), numbers, folder


def test_registered() -> None:
    assert STUDIES["sigalov-example-1"].module == sigalov_example_1.__name__
    assert STUDIES["sigalov-example-2"].module == sigalov_example_2.__name__


def test_what_is_drawn() -> None:
    for example, healthy, after_healthy, after_faulty in zip(
        examples(), (0.5, 0.93), (0.1, P11), (0.9, 0.9), strict=True
    ):
        made = sigalov_examples.simulate(example, 5000)
        again = sigalov_examples.simulate(example, 5000)
        np.testing.assert_array_equal(made.z, again.z)
        gamma = made.gamma.astype(float)
        assert made.x.shape == made.z.shape == gamma.shape == made.noisy.shape == (5000, 100)
        # Runs are independent: 5 standard errors of the averages over runs.
        for drawn, expected in (
            (gamma, np.full(100, healthy)),
            (made.noisy.astype(float), np.full(100, 0.2)),
            (gamma[:, 1:] * gamma[:, :-1], np.full(99, healthy * after_healthy)),
            (gamma[:, 1:] * (1 - gamma[:, :-1]), np.full(99, (1 - healthy) * after_faulty)),
            (made.x[:, 1:] ** 2, (1 - 0.64 ** np.arange(1, 100)) / 0.36),
            (made.x[:, 1:] * made.x[:, :-1], -0.8 * (1 - 0.64 ** np.arange(99)) / 0.36),
            ((made.z - gamma * made.x) ** 2, np.full(100, 2.8)),
        ):
            per_run = (drawn - expected).mean(axis=1)
            assert abs(per_run.mean()) < 5 * per_run.std() / np.sqrt(5000)
        np.testing.assert_array_equal(made.x[:, 0], 0.0)
        np.testing.assert_array_equal(
            np.array(MODES)[made.modes], np.stack([gamma, np.where(made.noisy, 10.0, 1.0)], axis=2)
        )


def test_channel_is_drawn_once_a_run() -> None:
    made = sigalov_examples.simulate(examples()[1], 5000)
    direct = made.gamma.all(axis=1).mean()
    assert direct == pytest.approx(0.3, abs=5 * np.sqrt(0.21 / 5000))


def test_filters_are_those_of_the_oracle() -> None:
    first, second = examples()
    for example, gamma in (
        (first, np.array([[0.1, 0.9], [0.9, 0.1]])),
        (second, np.array([[P11, 1 - P11], [0.9, 0.1]])),
    ):
        made = sigalov_examples.simulate(example, 5, steps=25)
        found = sigalov_examples.errors(example, made)
        chain = oracle_chain(gamma)
        assert chain.modes == MODES
        filters = {
            "one_step": partial(switching.one_step, PLANT, chain),
            "imm4": partial(switching.imm, PLANT, chain),
        }
        if example is second:
            filters["augmented"] = partial(switching.one_step, PLANT, augmented())
            filters["augmented_imm"] = partial(switching.imm, PLANT, augmented())
        for i in range(5):
            z, x = made.z[i, :, None], made.x[i]
            known = switching.genie(PLANT, [MODES[m] for m in made.modes[i]], z)
            np.testing.assert_allclose(found["genie"][i], (known.x[:, 0] - x) ** 2, atol=1e-11)
            for name, run in filters.items():
                expected = (run(z).x[:, 0] - x) ** 2
                np.testing.assert_allclose(found[name][i], expected, atol=1e-11)
        np.testing.assert_allclose(found["imm3"], found["imm4"], atol=1e-11)


def augmented() -> switching_chain.Chain:
    """(alpha, beta) and delta, every combination a mode."""
    states = [(a, b, d) for a in (0, 1) for b in (0, 1) for d in (0, 1)]
    beta, delta, alpha = (0.1, 0.9), (0.8, 0.2), (0.3, 0.7)
    drawn = np.array([beta[b] * delta[d] for _, b, d in states])
    same = np.array([[float(one[0] == other[0]) for other in states] for one in states])
    initial = drawn * np.array([alpha[a] for a, _, _ in states])
    modes = tuple((float(1 - a + a * b), (1.0, 10.0)[d]) for a, b, d in states)
    return switching_chain.Chain(modes, same * drawn, initial)


def test_linear_filter_is_the_projection() -> None:
    """Example 2: its error is that of the normal equations over all measurements."""
    runs, steps = 4000, 40
    example = examples()[1]
    lag = np.abs(np.subtract.outer(np.arange(steps), np.arange(steps)))
    earlier = np.minimum.outer(np.arange(steps), np.arange(steps))
    state = (-0.8) ** lag * (1 - 0.64**earlier) / 0.36
    both = np.where(lag == 0, 0.93, 0.93 * P11)  # E γ_k γ_i
    covariance = both * state + 2.8 * np.eye(steps)
    errors = sigalov_examples.errors(example, sigalov_examples.simulate(example, runs, steps))
    for k in (1, 2, 5, 39):
        seen = slice(0, k + 1)
        cross = 0.93 * state[k, seen]
        expected = state[k, k] - cross @ np.linalg.solve(covariance[seen, seen], cross)
        found = errors["linear"][:, k]
        assert abs(found.mean() - expected) < 4 * found.std() / np.sqrt(runs)


def test_as_printed_step_by_step() -> None:
    example = examples()[1]
    made = sigalov_examples.simulate(example, 3, steps=30)
    found = sigalov_examples.as_printed(example.switching, made.z)
    chain = oracle_chain(np.array([[P11, 1 - P11], [0.9, 0.1]]))
    for run in range(3):
        x, P, mu = 0.0, 0.0, chain.initial
        for k, z in enumerate(made.z[run]):
            predicted, M = (-0.8 * x, 0.64 * P + 1.0) if k else (0.0, 0.0)
            prior = mu @ chain.transition if k else mu
            P = M * 1.0 / (M + 1.0)
            local, weight = [], []
            for (gamma, delta), share in zip(MODES, prior, strict=True):
                estimate = predicted + (M / (M + delta) * (z - predicted) if gamma else 0.0)
                mean, S = (estimate, P + delta) if gamma else (0.0, delta)
                local.append(estimate)
                weight.append(share * np.exp(-((z - mean) ** 2) / (2 * S)) / np.sqrt(2 * np.pi * S))
            mu = np.array(weight) / sum(weight)
            x = float(mu @ np.array(local))
            assert found[run, k] == pytest.approx(x, abs=1e-12)


def test_interval_of_a_ratio_covers_it() -> None:
    random = np.random.RandomState(1)
    under = random.gamma(3.0, size=(400, 1000))
    over = 0.5 * under + random.gamma(2.0, size=(400, 1000))
    value, half = sigalov_comparison.ratio(over, under)
    covered = (np.abs(value - (1.5 + 2.0) / 3.0) < half).mean()
    assert covered == pytest.approx(0.95, abs=5 * np.sqrt(0.95 * 0.05 / 1000))


def test_numbers(study: tuple[int, dict[str, Any], Path]) -> None:
    which, numbers, _ = study
    ratio, interval = numbers["mse_ratio"], numbers["mse_ratio_interval"]
    for name, expected in PROTOTYPE[which - 1].items():
        low, high = interval[name]
        assert low < ratio[name] < high
        assert abs(ratio[name] - expected) < high - low + PROTOTYPE_ERROR
        assert abs(numbers["mse_ratio_all_steps"][name] - ratio[name]) < high - low
    p11 = numbers["p11"]
    low, high = p11["interval"]
    assert p11["paper"] == pytest.approx((0.1, P11)[which - 1], rel=1e-14)
    assert abs(p11["measured"] - p11["paper"]) < high - low
    lemma = numbers["linear_condition"]
    assert lemma["holds"] is (which == 2)
    # Lags of one and of two: staying twice, or leaving and coming back.
    highest = (0.1 * 0.1 + 0.9 * 0.9, p11["paper"])[which - 1]
    assert lemma["lowest"] == pytest.approx(p11["paper"], rel=1e-12)
    assert lemma["highest"] == pytest.approx(highest, rel=1e-12)


def test_which_filter_is_ahead(study: tuple[int, dict[str, Any], Path]) -> None:
    which, numbers, _ = study
    interval, ratio = numbers["difference_interval"], numbers["mse_ratio"]
    assert interval["one_step - linear"][1] < 0
    if which == 1:
        assert interval["as_printed - linear"][1] < 0
        assert interval["imm4 - one_step"][1] < 0
        assert "augmented" not in ratio
    else:
        assert interval["as_printed - linear"][0] > 0
        assert interval["augmented - one_step"][0] <= 0
        assert interval["augmented_imm - imm4"][0] <= 0
    for pair, difference in numbers["difference"].items():
        one, other = pair.split(" - ")
        assert difference == pytest.approx(ratio[one] - ratio[other], abs=1e-12)
        assert interval[pair][0] < difference < interval[pair][1]


def test_files(study: tuple[int, dict[str, Any], Path]) -> None:
    _, numbers, folder = study
    stored = json.loads((folder / "study.json").read_text(encoding="utf-8"))
    assert stored["mse_ratio"] == numbers["mse_ratio"]
    with (folder / "table.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    table = {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}
    np.testing.assert_array_equal(table["step"], np.arange(1, 100))
    counted = (table["step"] >= 10) & (table["step"] <= 60)
    genie = table["genie_mse"][counted]
    assert genie.mean() == pytest.approx(numbers["genie_mse"], rel=1e-12)
    for name, value in numbers["mse_ratio"].items():
        assert (table[f"{name}_low"] < table[name]).all()
        assert (table[name] < table[f"{name}_high"]).all()
        assert genie @ table[name][counted] / genie.sum() == pytest.approx(value, rel=1e-12)
    assert (folder / "figure.png").stat().st_size > 10_000
    assert any(line.startswith("Lemma 2") for line in numbers["report"])
