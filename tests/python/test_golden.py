"""The committed replays of tests/golden, which the C++ tests make by streaming, from Python: by
streaming and in batches, the same bits."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import surefix as sf
from oracle.step import Array

GOLDEN = Path(__file__).parents[1] / "golden"
TICKS = 0.5 * np.arange(1, 121)


def rows(name: str, **wanted: str) -> dict[str, list[str]]:
    """Columns of a file as texts, of the rows that have these values and all columns."""
    with (GOLDEN / f"{name}.csv").open(encoding="utf-8") as file:
        found = [row for row in csv.DictReader(file) if None not in row.values()]
    found = [row for row in found if all(row[key] == value for key, value in wanted.items())]
    assert len(found) > 50
    return {key: [row[key] for row in found] for key in found[0]}


def numbers(columns: dict[str, list[str]], *names: str) -> Array:
    return np.array([[float(text) for text in columns[name]] for name in names]).T


def messages() -> list[tuple[int, int, str, float]]:
    """(arrival, stamp, sensor, value) in the order of arrival."""
    log, names = rows("log"), {0: "wheel", 1: "radar", 2: "receiver"}
    return [
        (int(a), int(t), names.get(int(s), "nobody"), float(v))
        for a, t, s, v in zip(
            log["arrival"], log["stamp"], log["sensor"], log["value"], strict=True
        )
    ]


def sensors(**faults: Any) -> list[sf.Sensor]:
    return [
        sf.Sensor("wheel", 1.0, **faults),
        sf.Sensor("radar", 0.5, latency=0.03, **faults),
        sf.Sensor("receiver", 0.2, latency=0.15, **faults),
    ]


def linear() -> sf.DesyncFilter:
    model = sf.ConstantAcceleration(jerk=0.08)
    return sf.DesyncFilter(model, sensors(), [20.0, 20.0], 100.0 * np.eye(2), start=0.0)


def robust(carry: str) -> sf.RobustFilter:
    rate = {"rate": 0.005}
    faults = (
        sf.Outage(span=100.0, duration=1.0, **rate),
        sf.Drifting(sigma=20.0, walk=1.0, duration=5.0, **rate),
    )
    return sf.RobustFilter(
        sf.ConstantAcceleration(jerk=0.08), sensors(faults=faults), [20.0, 20.0], 100.0 * np.eye(2),
        start=0.0, risk=1e-11, carry=carry, components=27, cut=1e-14, memory=5.0,
    )  # fmt: skip


def streamed(filter: Any) -> list[Any]:
    """An estimate at every tick, 0.2 s after it."""
    waiting, estimates = messages(), []
    for tick in TICKS:
        while waiting and waiting[0][0] <= 1e9 * tick + 2e8:
            _, stamp, sensor, value = waiting.pop(0)
            filter.push(stamp / 1e9, sensor, value)
        estimates.append(filter.estimate(tick))
    return estimates


def log() -> sf.Log:
    _, stamp, sensor, value = zip(*messages(), strict=True)
    return sf.Log(np.array(stamp) / 1e9, np.array(sensor), np.array(value))


def moments(source: Any) -> Array:
    return np.column_stack([source.x, source.P[:, 0, 0], source.P[:, 0, 1], source.P[:, 1, 1]])


def stacked(estimates: list[Any]) -> Array:
    return np.array([[*e.x, e.P[0, 0], e.P[0, 1], e.P[1, 1]] for e in estimates])


MOMENTS = ("x0", "x1", "P00", "P01", "P11")


def test_speed_monitor() -> None:
    golden = rows("speed")
    np.testing.assert_array_equal(stacked(streamed(linear())), numbers(golden, *MOMENTS))
    batch = linear().run(log(), times=TICKS)
    np.testing.assert_array_equal(moments(batch), numbers(golden, *MOMENTS))
    np.testing.assert_array_equal(batch.sse, numbers(golden, "sse")[:, 0])


@pytest.mark.parametrize(("carry", "name"), [("merge", "merge"), ("one", "one")])
def test_fault_hypotheses(carry: str, name: str) -> None:
    golden = rows("robust", carry=name)
    columns = (*MOMENTS, "lower", "upper")
    batch = robust(carry).run(log(), times=TICKS)
    found = np.column_stack([moments(batch), batch.lower, batch.upper])
    np.testing.assert_array_equal(found, numbers(golden, *columns))
    stream = streamed(robust(carry))
    limits = np.array([[e.lower, e.upper] for e in stream])
    found = np.column_stack([stacked(stream), limits])
    np.testing.assert_array_equal(found, numbers(golden, *columns))


@pytest.mark.parametrize("threads", [1, 3])
@pytest.mark.parametrize(
    ("method", "filter"), [("imm", sf.IMMFilter), ("one-step", sf.OneStepFilter)]
)
def test_switching_filters(method: str, filter: Any, threads: int) -> None:
    """Alone and many times in one batch, with any number of threads."""
    golden = rows("switching", method=method)
    system = sf.LinearSystem(
        A=np.array([[1.0, 0.5], [-0.2, 0.7]]), H=np.array([[1.0, 0.3]]), Q=np.diag([0.3, 0.1]),
        R=np.array([[0.5]]), x0=np.array([1.0, -1.0]), P0=np.diag([2.0, 1.0]),
    )  # fmt: skip
    chain = sf.ModeChain.independent_chains(
        [1.0, 0.0], [[0.9, 0.1], [0.6, 0.4]], [1.0, 10.0], [[0.8, 0.2], [0.5, 0.5]]
    )
    z = numbers(rows("measurements"), "z")
    runs = filter(system, chain).run(np.tile(z, (7, 1, 1)), threads=threads)
    for r in range(7):
        found = np.column_stack(
            [
                runs.x[r], runs.P[r][:, 0, 0], runs.P[r][:, 0, 1], runs.P[r][:, 1, 1],
                runs.mode_probability[r],
            ]
        )  # fmt: skip
        modes = tuple(f"mode{j}" for j in range(4))
        np.testing.assert_array_equal(found, numbers(golden, *MOMENTS, *modes))


def test_track_monitor() -> None:
    golden, sky = rows("raim"), rows("epochs")
    vertices = numbers(rows("track"), "x", "y", "z")
    data = sf.raim.Pseudoranges(
        numbers(sky, "epoch")[:, 0], [f"S{k}" for k in sky["satellite"]], numbers(sky, *"xyz"),
        numbers(sky, "pseudorange")[:, 0], numbers(sky, "sigma")[:, 0], sky["system"],
    )  # fmt: skip
    monitor = sf.raim.TrackRaim(sf.raim.Track(vertices), length=50.0, max_speed=30.0)
    found = monitor.run(data, near=50.0)
    same = {
        "along": "along", "sigma": "sigma", "statistic": "statistic", "rival": "rival",
        "p_star": "p_star", "bound": "bound", "e1": "e1", "e2": "e2", "protection": "protection",
        "protection_chi2": "snapshot_protection",
    }  # fmt: skip
    for ours, column in same.items():
        np.testing.assert_array_equal(getattr(found, ours), numbers(golden, column)[:, 0], ours)
    assert found.declared.tolist() == golden["declared"]


def test_sliding_detector() -> None:
    """Where a ramp is undetectable, no number is returned."""
    golden = rows("drift")
    detectors = [
        sf.OnsetDetector(sf.Profile.ramp(), channel=name, false_alarm=1e-3)
        for name in ("wheel", "radar")
    ]
    stream = streamed(sf.SlidingDetector(linear(), 60, detectors))
    findings = [found for estimate in stream for found in estimate.findings]
    same = {"drop": "drop", "p_bound": "p_bound", "amplitude": "amplitude",
            "amplitude_se": "deviation", "onsets": "onsets"}  # fmt: skip
    known = [found.status != "undetectable" for found in findings]
    assert sum(known) > 100
    for ours, column in same.items():
        found = [getattr(each, ours) for each in findings]
        np.testing.assert_array_equal(
            [value for value, is_known in zip(found, known, strict=True) if is_known],
            numbers(golden, column)[known, 0], ours,
        )  # fmt: skip
    onset = [1e9 * each.onset for each in findings if each.onset is not None]
    np.testing.assert_allclose(onset, numbers(golden, "onset")[known, 0], rtol=0, atol=0.5)  # [ns]
    alarms = [each.status == "detected" for each in findings]
    assert alarms == [text == "2" for text in golden["finding"]]
