"""Alert limits: exact on the mixture, whatever the risk; and none where none can be claimed."""

from __future__ import annotations

from decimal import Decimal, localcontext
from math import inf
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

import surefix as sf
from oracle import mixture_tail
from oracle.step import Array
from robust.scenes import MODELS, FaultScene, random_scene

RISKS = st.floats(1.0, 15.0).map(lambda digits: float(10.0**-digits))
SEEDS = st.integers(0, 2**32 - 1)


def random_mixture(seed: int) -> tuple[list[float], list[float], list[float]]:
    """Weights from 1 down to 1e-20, some sigmas of zero."""
    rng = np.random.default_rng(seed)
    K = int(rng.integers(1, 7))
    weights = 10.0 ** rng.uniform(-20.0, 0.0, K)
    sigmas = 10.0 ** rng.uniform(-2.0, 2.0, K) * (rng.random(K) > 0.1)
    means = rng.normal(size=K) * 10.0 ** rng.uniform(-1.0, 3.0)
    return (weights / weights.sum()).tolist(), means.tolist(), sigmas.tolist()


def assert_limit(
    limit: float, share: Decimal, mixture: tuple[list[float], ...], side: int = 1
) -> None:
    """To 1e-9: a little further in, more than ``share`` is outside; a little further out, less."""
    weights, means, sigmas = mixture
    turned = [side * m for m in means]
    little = Decimal(1e-9 * abs(limit) + 1e-11 * max(sigmas) + 1e-300)
    at = Decimal(side * limit)
    assert mixture_tail.upper_tail(at - little, weights, turned, sigmas) >= share
    assert mixture_tail.upper_tail(at + little, weights, turned, sigmas) <= share


def half(risk: float) -> Decimal:
    with localcontext() as context:
        context.prec = 60
        return Decimal(risk) / 2


@given(seed=SEEDS, risk=RISKS)
def test_limits_equal_the_tails_of_fifty_digits(seed: int, risk: float) -> None:
    mixture = random_mixture(seed)
    lower, upper = sf.alert_limits(*mixture, risk)
    assert_limit(upper, half(risk), mixture)
    assert_limit(lower, half(risk), mixture, -1)


@pytest.mark.parametrize("risk", [0.9, 1e-5, 1e-15])
@pytest.mark.parametrize("seed", range(2))
def test_limits_equal_the_oracle(seed: int, risk: float) -> None:
    mixture = random_mixture(seed)
    expected = mixture_tail.alert_limits(*mixture, risk)
    assert sf.alert_limits(*mixture, risk) == pytest.approx(expected, rel=1e-9, abs=1e-11)


@given(seed=SEEDS, one=RISKS, other=RISKS)
@example(seed=147689, one=1e-05, other=1e-06)
def test_limits_are_monotone_in_the_risk(seed: int, one: float, other: float) -> None:
    """But for the few units in the last place by which a limit may be on the safe side: at a point
    mass both risks have the same limit."""
    mixture = random_mixture(seed)
    narrow, wide = (sf.alert_limits(*mixture, r) for r in sorted((one, other), reverse=True))
    assert wide[0] <= narrow[0] + 4 * np.spacing(abs(narrow[0]))
    assert narrow[1] <= wide[1] + 4 * np.spacing(abs(narrow[1]))


@given(seed=SEEDS, risk=RISKS)
def test_one_side_takes_all_of_the_risk(seed: int, risk: float) -> None:
    mixture = random_mixture(seed)
    lower, none = sf.alert_limits(*mixture, risk, sides="lower")
    below, upper = sf.alert_limits(*mixture, risk, sides="upper")
    assert (below, none) == (-inf, inf)
    assert_limit(upper, Decimal(risk), mixture)
    assert_limit(lower, Decimal(risk), mixture, -1)


def test_known_answer() -> None:
    """The mission's: one in a million is elsewhere, and moves the limit from 6.7 to 14.4."""
    mixture = ([1.0 - 1e-6, 1e-6], [0.0, 8.0], [1.0, 1.5])
    _, upper = sf.alert_limits(*mixture, 1e-11, sides="upper")
    assert upper == pytest.approx(14.40, abs=0.005)
    assert sf.alert_limits(*mixture, 2e-11)[1] == pytest.approx(upper, rel=1e-12)
    assert_limit(upper, Decimal("1e-11"), mixture)
    assert sf.alert_limits([1.0], [0.0], [1.0], 1e-11)[1] == pytest.approx(6.806502, rel=1e-6)


def limits_of(filter: sf.RobustFilter, direction: Array, lost: float) -> tuple[Any, Decimal]:
    """The mixture along aᵀx, and the probability that may lie outside."""
    found, n = filter.mixture(), len(direction)
    weights = np.exp(found["log_weight"])
    means = found["x"][:, :n] @ direction
    variances = np.einsum("i,kij,j->k", direction, found["P"][:, :n, :n], direction)
    with localcontext() as context:
        context.prec = 60
        left = Decimal(filter.risk) - Decimal(lost)
    return (weights.tolist(), means.tolist(), np.sqrt(variances).tolist()), left


def assert_limits_of_the_mixture(scene: FaultScene, direction: Any, **options: Any) -> None:
    """After each of three steps."""
    filter, now = scene.filter(direction=direction, **options), -1.0
    n = len(filter.state_names)
    row = np.eye(n)[scene.model.output] if direction is None else np.array(direction)
    for end in (0.3, 0.7, 1.0):
        scene.push(filter, end, now)
        estimate, now = filter.estimate(end), end
        mixture, left = limits_of(filter, row, estimate.discarded_mass)
        if left <= 0:
            assert (estimate.lower, estimate.upper) == (-inf, inf)
            continue
        share = left / 2 if filter.sides == "both" else left
        if filter.sides == "upper":
            assert estimate.lower == -inf
        else:
            assert_limit(estimate.lower, share, mixture, -1)
        if filter.sides == "lower":
            assert estimate.upper == inf
        else:
            assert_limit(estimate.upper, share, mixture)


@given(
    seed=SEEDS,
    name=st.sampled_from([*MODELS]),
    risk=st.sampled_from([1e-1, 1e-3, 1e-7, 1e-11, 1e-15]),
    sides=st.sampled_from(["both", "lower", "upper"]),
    carry=st.sampled_from(["one", "merge", "cut"]),
    components=st.sampled_from([2, 4, 128]),
    turned=st.booleans(),
)
def test_limits_of_the_filter_are_those_of_its_mixture(
    seed: int, name: str, risk: float, sides: str, carry: str, components: int, turned: bool
) -> None:
    """On any linear function of the state, at the risk that what was cut off leaves."""
    scene = random_scene(seed, name, (("outage", "drifting"), ("outage",)))
    direction = np.random.default_rng(seed).normal(size=scene.model.size) if turned else None
    assert_limits_of_the_mixture(
        scene, direction, risk=risk, sides=sides, carry=carry, components=components, cut=risk / 20
    )


def jumping(risk: float, **options: Any) -> tuple[sf.RobustFilter, list[sf.RobustEstimate]]:
    """Two sensors, and one of them or the other is wrong: both hypotheses are as probable."""
    fault = sf.Outage(span=50.0, rate=1e-3, duration=10.0)
    sensors = [sf.Sensor(name, 0.5, faults=(fault,)) for name in "ab"]
    arguments = {"start": 0.0, "risk": risk, **options}
    filter = sf.RobustFilter(sf.ConstantVelocity(0.5), sensors, [10.0], [[4.0]], **arguments)
    estimates = []
    for k in range(1, 6):
        filter.push(k - 0.5, "a", 10.0)
        filter.push(k - 0.4, "b", 10.0 if k < 3 else 14.0)
        estimates.append(filter.estimate(float(k)))
    return filter, estimates


@pytest.mark.parametrize("sides", ["both", "lower", "upper"])
@pytest.mark.parametrize("options", [
    {"carry": "cut", "components": 1}, {"max_faults": 0}, {"max_faults": 0, "carry": "one"},
])  # fmt: skip
def test_no_limit_is_claimed_where_too_much_was_cut(sides: str, options: dict[str, Any]) -> None:
    _, estimates = jumping(1e-7, sides=sides, **options)
    lost = [e for e in estimates if e.discarded_mass >= 1e-7]
    assert len(lost) >= 3
    for estimate in lost:
        assert (estimate.lower, estimate.upper) == (-inf, inf)
        assert np.isfinite(estimate.x).all()


def test_run_says_where_no_limit_is_available() -> None:
    fault = sf.Outage(span=50.0, probability=1e-3)
    sensor = sf.Sensor("a", 0.5, faults=(fault,))
    log = sf.Log([0.5, 1.5], ["a", "a"], [10.0, 10.1])
    arguments: dict[str, Any] = {"start": 0.0, "risk": 1e-6, "memory": 100.0}
    for most, available in ((0, False), (1, True)):
        filter = sf.RobustFilter(
            sf.ConstantVelocity(0.5), [sensor], [10.0], [[4.0]], max_faults=most, **arguments
        )
        result = filter.run(log, rate=1.0)
        assert result.available.tolist() == [available, available]


@pytest.mark.parametrize("most", [0, 1])
def test_mass_of_the_hypotheses_that_are_not_run(most: int) -> None:
    """Their prior; it is forgotten over the memory."""
    p, memory = np.array([0.01, 0.02, 0.005]), 7.0
    sensors = [
        sf.Sensor(f"s{i}", 1.0, faults=(sf.Outage(span=9.0, probability=float(q)),))
        for i, q in enumerate(p)
    ]
    filter = sf.RobustFilter(
        sf.ConstantVelocity(0.5), sensors, [0.0], [[1.0]],
        start=0.0, carry="one", max_faults=most, memory=memory, cut=0.0,
    )  # fmt: skip
    healthy = np.prod(1.0 - p)
    new = 1.0 - healthy * (1.0 + (p / (1.0 - p)).sum() * most)
    expected = 0.0
    for k in range(1, 5):
        expected = expected * np.exp(-1.0 / memory) + new
        found = filter.estimate(float(k))
        assert found.discarded_mass == pytest.approx(expected, rel=1e-11)
        assert (found.lower, found.upper) == (-inf, inf)


def test_all_hypotheses_of_some_sensors_discard_nothing() -> None:
    """Only two of four sensors can fail: two faults at once are all that there are, and not even
    a rounding may come off the risk."""
    fault = sf.Outage(span=50.0, rate=1e-4, duration=3600.0)
    sensors = [sf.Sensor(f"s{i}", 0.5, faults=(fault,) if i < 2 else ()) for i in range(4)]
    names, noise = [f"s{i % 4}" for i in range(2000)], np.random.default_rng(0).normal(size=2000)
    log = sf.Log(0.05 * np.arange(1, 2001), names, 10.0 + 0.5 * noise)
    runs = [
        sf.RobustFilter(
            sf.ConstantVelocity(0.5), sensors, [10.0], [[4.0]],
            start=0.0, risk=1e-13, cut=0.0, carry="one", max_faults=most,
        ).run(log, rate=5.0)
        for most in (2, 4)
    ]  # fmt: skip
    for run in runs:
        assert run.discarded_mass.max() == 0.0
    np.testing.assert_allclose(runs[0].upper, runs[1].upper, rtol=1e-12)


@pytest.mark.parametrize(("risk", "exposures"), [
    (1e-9, 36000.0), (1e-11, 1.0), (0.5, 3.0), (1e-15, 1e6), (1e-3, 0.5),
])  # fmt: skip
def test_risk_of_one_estimate(risk: float, exposures: float) -> None:
    """1 − (1 − ρ)^(1/N), with fifty digits."""
    with localcontext() as context:
        context.prec = 60
        expected = float(1 - (1 - Decimal(risk)) ** (1 / Decimal(exposures)))
    assert sf.risk_per_estimate(risk, exposures) == pytest.approx(expected, rel=1e-13)


def test_what_max_faults_leaves_out_is_summed() -> None:
    """Eight sensors, each faulty with p: the mass of two or more at once is Σ, 2.8e-17, and not the
    rounding of one less the rest."""
    p = 1e-9
    faults = (sf.Outage(span=50.0, probability=p),)
    sensors = [sf.Sensor(f"s{i}", 1.0, faults=faults) for i in range(8)]
    filter = sf.RobustFilter(
        sf.ConstantVelocity(0.1), sensors, [0.0], [[1.0]], start=0.0, max_faults=1, cut=0.0,
        memory=1e-3,
    )  # fmt: skip
    for time in (1.0, 2.0, 3.0):
        expected = 28 * p**2 * (1 - p) ** 6
        assert filter.estimate(time).discarded_mass == pytest.approx(expected, rel=1e-6)
