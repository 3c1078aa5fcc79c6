"""Results: intervals that cover, p-values that are uniform, flags that come as rarely as stated.

The truth is simulated from the model along the oracle's transitions. A count of misses among R
independent runs is binomial; it is held to what a right filter leaves with probability 2e-6.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import pytest
from scipy import stats

import surefix as sf
from oracle import models
from oracle.step import Array

RUNS, ROWS = 2000, 24
TIMES = np.arange(1.0, 4.0)  # s
SENSORS = (
    sf.Sensor("wheel", 0.5, latency=0.05),
    sf.Sensor("radar", 0.2, bias_sigma=0.4, bias_time=3.0),
)
X0, P0 = np.array([20.0, 0.0]), np.array([[4.0, 0.3], [0.3, 1.0]])


@dataclass(frozen=True)
class Simulated:
    truth: Array  # (RUNS, T, 3) speed, acceleration, bias of the radar
    results: list[sf.Result]
    journeys: list[sf.Result]  # with the noise of the whole journey


@lru_cache(maxsize=1)
def simulated() -> Simulated:
    """RUNS runs of the same sensor times, each with a truth and noise of its own."""
    rng = np.random.default_rng(20040101)
    ticks = np.sort(rng.choice(np.arange(1, 2990), ROWS, replace=False)) / 1000
    which = rng.integers(0, 2, ROWS)
    motion = models.constant_acceleration(0.3, position=False)
    x = np.column_stack(
        [rng.multivariate_normal(X0, P0, RUNS), 0.4 * rng.normal(size=RUNS)]
    )  # (RUNS, 3)
    events = sorted([(float(t), i) for i, t in enumerate(ticks)] + [(float(t), -1) for t in TIMES])
    truth, values, now = [], np.zeros((RUNS, ROWS)), 0.0
    for time, row in events:
        F, Q = np.eye(3), np.zeros((3, 3))
        F[:2, :2], Q[:2, :2] = models.van_loan(motion, time - now)[:2]
        F[2, 2], Q[2, 2] = models.gauss_markov_transition(0.4, 3.0, time - now)
        x, now = x @ F.T + rng.normal(size=(RUNS, 3)) @ np.linalg.cholesky(Q).T, time
        if row < 0:
            truth.append(x)
        else:
            clean = x[:, 0] + (x[:, 2] if which[row] else 0.0)
            values[:, row] = clean + SENSORS[which[row]].sigma * rng.normal(size=RUNS)
    stamps = ticks + np.array([s.latency for s in SENSORS])[which]
    names = [SENSORS[i].name for i in which]
    filter = sf.DesyncFilter(sf.ConstantAcceleration(0.3), SENSORS, X0, P0, start=0.0, risk=0.01)
    logs = [sf.Log(stamps, names, z) for z in values]
    return Simulated(
        np.stack(truth, axis=1),
        [filter.run(log, times=TIMES) for log in logs],
        [filter.run(log, times=TIMES, noise="journey") for log in logs],
    )


def assert_binomial(count: int, trials: int, probability: float) -> None:
    low = stats.binom.ppf(1e-6, trials, probability)
    high = stats.binom.ppf(1.0 - 1e-6, trials, probability)
    assert low <= count <= high, f"{count} of {trials} at {probability}: not in {low}..{high}"


def assert_coverage(risk: float, direction: Array | None, truth: Array) -> None:
    intervals = [result.interval(risk, direction) for result in simulated().results]
    for k in range(len(TIMES)):
        below = sum(truth[r, k] < lower[k] for r, (lower, _) in enumerate(intervals))
        above = sum(truth[r, k] > upper[k] for r, (_, upper) in enumerate(intervals))
        assert_binomial(below + above, RUNS, risk)
        assert_binomial(below, RUNS, risk / 2)


@pytest.mark.parametrize("risk", [0.1, 0.01])
def test_interval_misses_as_often_as_it_says(risk: float) -> None:
    assert_coverage(risk, None, simulated().truth[:, :, 0])


@pytest.mark.parametrize("risk", [0.1, 0.01])
@pytest.mark.parametrize("direction", [[0.0, 1.0, 0.0], [1.0, 0.0, 1.0], [1.0, -2.0, 0.5]])
def test_interval_along_a_direction_misses_as_often_as_it_says(
    risk: float, direction: list[float]
) -> None:
    a = np.array(direction)
    assert_coverage(risk, a, simulated().truth @ a)


def test_default_interval_is_at_the_filters_risk() -> None:
    result = simulated().results[0]
    lower, upper = result.interval(0.01)
    assert result.risk == 0.01
    assert np.array_equal(result.lower, lower)
    assert np.array_equal(result.upper, upper)
    along = result.interval(0.01, [1.0, 0.0, 0.0])
    np.testing.assert_allclose(along, (lower, upper), rtol=1e-14)
    width = sf.two_sided_quantile(1e-11) * result.sigma
    np.testing.assert_allclose(
        result.interval(1e-11), (result.estimate - width, result.estimate + width)
    )


def test_interval_refuses_what_does_not_fit() -> None:
    result = simulated().results[0]
    with pytest.raises(sf.ShapeError, match=r"direction: expected shape \(3,\), got \(2,\)"):
        result.interval(0.1, [1.0, 0.0])
    with pytest.raises(sf.ConfigError, match=r"risk: .*got 2\.0"):
        result.interval(2.0)


def test_p_values_are_uniform() -> None:
    """Of every step, and of all steps together: they are independent."""
    p = np.array([result.p_value for result in simulated().results])
    for column in (*p.T, p.ravel()):
        assert stats.kstest(column, "uniform").pvalue > 1e-5
    for k in (0, 1):
        assert abs(stats.spearmanr(p[:, k], p[:, k + 1]).statistic) < 5 / np.sqrt(RUNS)


def test_sse_has_the_mean_of_its_degrees() -> None:
    sse = np.array([result.sse for result in simulated().results])
    degrees = simulated().results[0].degrees_of_freedom
    assert degrees.sum() == ROWS
    bound = 5 * np.sqrt(2 * degrees / RUNS)
    assert (np.abs(sse.mean(axis=0) - degrees) <= bound).all()


@pytest.mark.parametrize("scope", ["results", "journeys"])
def test_normalised_noise_is_standard_normal(scope: str) -> None:
    noise = np.array([result.normalised_noise for result in getattr(simulated(), scope)])
    for column in noise.T:
        assert stats.kstest(column, "norm").pvalue > 1e-5


@pytest.mark.parametrize("scope", ["results", "journeys"])
@pytest.mark.parametrize("false_alarm", [0.2, 0.02])
def test_a_healthy_run_is_flagged_as_rarely_as_stated(
    scope: str, false_alarm: float, record_property: Callable[[str, object], None]
) -> None:
    """At most ``false_alarm`` of the runs; and, as Bonferroni's bound is tight, not far fewer."""
    results = getattr(simulated(), scope)
    alarms = sum(bool(result.flagged(false_alarm).any()) for result in results)
    share = f"{alarms / RUNS:.2%} for at most {false_alarm:.0%}"
    record_property("figure", f"false alarms of noise estimates ({scope}): {share}")
    assert alarms <= stats.binom.ppf(1.0 - 1e-6, RUNS, false_alarm)
    assert alarms >= stats.binom.ppf(1e-6, RUNS, 0.7 * false_alarm)


def one_run(rows: list[tuple[float, str, float]], noise: str | None = "step") -> sf.Result:
    filter = sf.DesyncFilter(
        sf.ConstantAcceleration(0.3), [sf.Sensor("w", 0.5)], X0, P0, start=0.0, risk=0.01
    )
    time, sensor, value = zip(*rows, strict=True)
    return filter.run(sf.Log(time, sensor, value), times=[1.0, 2.0, 3.0], noise=noise)


HEALTHY = [(0.1 * i, "w", 20.0 + 0.3 * (-1) ** i) for i in range(20)]


def test_gross_error_is_flagged_above_all_others() -> None:
    """A linear filter spreads it over the readings beside it, but none looks as wrong as it."""
    assert not one_run(HEALTHY).flagged().any()
    rows = [*HEALTHY]
    rows[7] = (rows[7][0], "w", 40.0)
    result = one_run(rows)
    assert result.flagged()[7]
    assert np.argmax(np.abs(result.normalised_noise)) == 7
    assert not result.flagged()[-5:].any()
    assert result.p_value[0] < 1e-100
    rows[7] = (rows[7][0], "w", 23.0)
    assert np.flatnonzero(one_run(rows).flagged()).tolist() == [7]


def test_rows_not_used_are_never_flagged() -> None:
    rows = [*HEALTHY, (0.55, "nobody", 1e6), (0.65, "w", np.inf), (9.0, "w", 1e6)]
    result = one_run(rows)
    assert not result.flagged().any()
    assert np.isnan(result.normalised_noise[-3:]).all()
    assert result.counts == {"ok": 20, "not_finite": 1, "unknown_sensor": 1, "waiting": 1}
    assert sum(result.counts.values()) == len(rows)


@pytest.mark.parametrize("false_alarm", [0.5, 1e-3, 1e-15])
def test_flagged_beyond_is_the_threshold(false_alarm: float) -> None:
    """The two-sided quantile at ``false_alarm`` over the rows that were used."""
    rows = [*HEALTHY, (0.55, "nobody", 1e6)]
    rows[7] = (rows[7][0], "w", 24.5)
    result = one_run(rows)
    beyond = result.flagged_beyond(false_alarm)
    assert beyond == pytest.approx(stats.norm.isf(false_alarm / 20 / 2), rel=1e-12)
    expected = np.abs(np.nan_to_num(result.normalised_noise)) > beyond
    assert np.array_equal(result.flagged(false_alarm), expected)


def test_flags_need_the_noise() -> None:
    with pytest.raises(sf.SurefixError, match="flagged: run with noise="):
        one_run(HEALTHY, noise=None).flagged()
    with pytest.raises(sf.ConfigError, match=r"false_alarm: .*got 0\.0"):
        one_run(HEALTHY).flagged(0.0)


def test_status_indexes_the_statuses() -> None:
    result = one_run([*HEALTHY, (0.5, "nobody", 20.0)])
    assert [list(sf.Status)[code].name for code in result.status[-2:]] == ["ok", "unknown_sensor"]
    assert result.counts == {"ok": 20, "unknown_sensor": 1}


def test_step_without_measurements_has_no_p_value() -> None:
    result = one_run(HEALTHY)  # the last row is at 1.9 s
    assert result.degrees_of_freedom.tolist() == [11, 9, 0]
    assert np.isnan(result.p_value).tolist() == [False, False, True]


def test_columns_are_named_and_complete() -> None:
    result = simulated().results[0]
    table = result.columns()
    assert list(table) == [
        *("time_s", "speed", "acceleration", "radar.bias"),
        *("speed_sigma", "acceleration_sigma", "radar.bias_sigma"),
        *("lower", "upper", "sse", "degrees_of_freedom", "p_value"),
    ]
    assert all(len(column) == len(TIMES) for column in table.values())
    assert np.array_equal(table["radar.bias"], result.x[:, 2])
    np.testing.assert_array_equal(table["acceleration_sigma"], np.sqrt(result.P[:, 1, 1]))
    assert np.array_equal(table["lower"], result.lower)


def test_to_pandas_holds_the_columns() -> None:
    pd = pytest.importorskip("pandas")
    result = simulated().results[0]
    frame = result.to_pandas()
    assert isinstance(frame, pd.DataFrame)
    assert list(frame.columns) == list(result.columns())
    for name, column in result.columns().items():
        np.testing.assert_array_equal(frame[name].to_numpy(), column)


def test_results_that_live_do_not_share_memory() -> None:
    """The memory of a result that died serves the next one, never that of a result in use."""

    def run(speed: float) -> sf.Result:
        time = np.arange(1.0, 50.0)
        log = sf.Log(time, np.full(len(time), "wheel"), np.full(len(time), speed))
        return sf.DesyncFilter(sf.ConstantAcceleration(0.1), SENSORS[:1], X0, P0).run(log)

    first = run(10.0)
    kept = first.x.copy()
    view = run(20.0).x[3:5]  # all that is left of its result
    ending = view.copy()
    others = [run(30.0 + i) for i in range(5)]
    np.testing.assert_array_equal(first.x, kept)
    np.testing.assert_array_equal(view, ending)
    assert not any(np.shares_memory(other.x, first.x) for other in others)
