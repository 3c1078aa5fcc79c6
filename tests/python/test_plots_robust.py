"""The figure of a robust result: what is drawn, and where it is."""

from __future__ import annotations

import dataclasses
import io
from typing import Any

import numpy as np
import pytest

import surefix as sf
from surefix.plots import plot_robust

pytest.importorskip("matplotlib")

from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

OUTLIER = 60  # a row of the wheel


def make_result(rows: int = 400, **options: Any) -> sf.RobustResult:
    random = np.random.RandomState(1)
    time = 0.05 * np.arange(rows)
    sensor = np.where(np.arange(rows) % 2, "radar", "wheel")
    value = 20 + np.where(sensor == "radar", 2.0, 1.0) * random.normal(size=rows)
    value[OUTLIER] += 30.0
    outage = sf.Outage(span=100.0, rate=0.001, duration=1.0)
    drifting = sf.Drifting(sigma=10.0, walk=1.0, rate=0.001, duration=5.0)
    sensors = [
        sf.Sensor("wheel", 1.0, faults=(outage, drifting)),
        sf.Sensor("radar", 2.0, faults=(outage,)),
    ]
    model = sf.ConstantAcceleration(jerk=0.08)
    engine = sf.RobustFilter(model, sensors, [20, 0], np.diag([1.0, 0.01]), **options)
    return engine.run(sf.Log(time, sensor, value), rate=5.0)


def save(figure: Figure) -> None:
    figure.savefig(io.BytesIO(), format="png", dpi=60)


def lines(figure: Figure, label: str) -> list[Any]:
    found = figure.axes[0].get_lines()
    return [line for line in found if str(line.get_label()).startswith(label)]


def polygons(figure: Figure) -> list[np.ndarray[Any, np.dtype[np.float64]]]:
    """Corners (n, 4, 2) of the rectangles in the lowest panel, a colour each."""
    found = [c for c in figure.axes[-1].collections if isinstance(c, PolyCollection)]
    return [
        np.array([np.asarray(path.vertices, float)[:4] for path in c.get_paths()]) for c in found
    ]


def test_artists() -> None:
    result = make_result()
    truth = np.array([0.0, 20.0]), np.array([20.0, 20.0])
    figure = result.plot(reference=truth, events=[(5.0, 8.0, "$^$")], title="$^$")
    main, error, modes = figure.axes
    np.testing.assert_array_equal(lines(figure, "estimate")[0].get_ydata(), result.estimate)
    (lower,) = lines(figure, "alert limits, risk 1e-11")
    np.testing.assert_array_equal(lower.get_ydata(), result.lower)
    (crosses,) = lines(figure, "rejected")
    np.testing.assert_array_equal(crosses.get_xdata(), result.log.time[result.rejected])
    assert result.rejected[OUTLIER]
    assert len(lines(figure, "truth")) == 1
    assert (main.get_ylabel(), error.get_ylabel()) == ("speed (m/s)", "error (m/s)")
    assert [label.get_text() for label in modes.get_yticklabels()] == ["wheel", "radar"]
    assert modes.get_xlabel() == "time (s)"
    legend = modes.get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == ["outage", "drifting"]
    save(figure)


def test_strips_are_the_probabilities_of_the_modes() -> None:
    result = make_result()
    probability = np.zeros_like(result.mode_probability)
    probability[10, 0] = 0.1, 0.6, 0.3
    probability[20, 1, :2] = 0.5, 0.5
    result = dataclasses.replace(result, mode_probability=probability)
    outage, drifting = polygons(plot_robust(result))
    begin, end = result.time[[9, 19]], result.time[[10, 20]]
    height = 0.8  # of a strip; the wheel's begins at 1, the radar's at 0
    np.testing.assert_allclose(outage[:, :, 1].min(axis=1), [1.0, 0.0])
    np.testing.assert_allclose(outage[:, :, 1].max(axis=1), [1 + 0.6 * height, 0.5 * height])
    np.testing.assert_allclose(outage[:, :, 0].min(axis=1), begin)
    np.testing.assert_allclose(outage[:, :, 0].max(axis=1), end)
    np.testing.assert_allclose(drifting[0, :, 1].min(), 1 + 0.6 * height)
    np.testing.assert_allclose(drifting[0, :, 1].max(), 1 + 0.9 * height)


def test_single_steps_can_be_seen_in_long_runs() -> None:
    figure = plot_robust(make_result(), window=(0.0, 2000.0))
    outage, _ = polygons(figure)
    assert (np.ptp(outage[:, :, 0], axis=1) >= 3.0).all()


def test_limits_that_cannot_be_claimed() -> None:
    result = make_result(max_faults=0)
    assert not result.available.any()
    figure = plot_robust(result, reference=([0, 20], [20, 20]))
    legend = figure.axes[-1].get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()][-1] == "no limits"
    assert np.isfinite(figure.axes[0].get_ylim()).all()
    save(figure)


def test_log_with_other_sensors_and_window() -> None:
    result = make_result()
    figure = plot_robust(result, window=(4.0, 6.0), ylabel="v")
    assert figure.axes[0].get_xlim() == (4.0, 6.0)
    assert figure.axes[0].get_ylabel() == "v"
    with pytest.raises(sf.ConfigError, match="window"):
        plot_robust(result, window=(6.0, 4.0))
    other = sf.Log([0.0, np.nan, 0.3], ["wheel", "wheel", "other"], [20.0, 2.0, np.inf])
    fault = sf.Outage(span=100.0, probability=0.1)
    sensors = [sf.Sensor("wheel", 1.0, faults=(fault,))]
    model = sf.ConstantVelocity(acceleration=1.0)
    save(plot_robust(sf.RobustFilter(model, sensors, [20.0], [[1.0]]).run(other)))
