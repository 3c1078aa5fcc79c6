"""Figures: what is drawn, and that it can be drawn without a display."""

from __future__ import annotations

import io
import sys
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import surefix as sf
from surefix.plots import Event, plot_result
from surefix.plots import panels as drawn

pytest.importorskip("matplotlib")

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import imread
from matplotlib.lines import Line2D

SENSORS = [sf.Sensor("wheel", 1.0), sf.Sensor("radar", 2.0)]
OUTLIER = 60  # a row of the wheel


def make_result(rows: int = 400, noise: str | None = "step") -> sf.Result:
    random = np.random.RandomState(1)
    time = 0.05 * np.arange(rows)
    sensor = np.where(np.arange(rows) % 2, "radar", "wheel")
    value = 20 + np.where(sensor == "radar", 2.0, 1.0) * random.normal(size=rows)
    value[OUTLIER] += 200.0
    model = sf.ConstantAcceleration(jerk=0.08)
    engine = sf.DesyncFilter(model, SENSORS, [20, 0], np.diag([1.0, 0.01]))
    return engine.run(sf.Log(time, sensor, value), rate=5.0, noise=noise)


def lines(axes: Axes, label: str) -> list[Line2D]:
    return [line for line in axes.get_lines() if str(line.get_label()).startswith(label)]


def pixels(figure: Figure) -> npt.NDArray[np.float64]:
    file = io.BytesIO()
    figure.savefig(file, format="png", dpi=60)
    file.seek(0)
    return np.asarray(imread(file), dtype=np.float64)


def test_artists() -> None:
    result = make_result()
    truth = np.array([0.0, 20.0]), np.array([20.0, 20.0])
    events = [Event(5.0, 8.0, "gps frozen"), (3.0, 3.0, "wheel outlier")]
    figure = plot_result(result, reference=truth, events=events, title="A title")
    main, error, noise, p_value = figure.axes
    (estimate,) = lines(main, "estimate")
    np.testing.assert_array_equal(estimate.get_ydata(), result.estimate)
    dotted = [line for line in main.get_lines() if line.get_linestyle() == ":"]
    for line, bound in zip(dotted, (result.lower, result.upper), strict=True):
        np.testing.assert_array_equal(line.get_ydata(), bound)
    (crosses,) = lines(main, "flagged")
    np.testing.assert_array_equal(
        np.asarray(crosses.get_xdata()), result.log.time[result.flagged()]
    )
    assert result.flagged()[OUTLIER]
    for name in ("wheel", "radar"):
        (dots,) = lines(main, name)
        shown = (result.log.sensor == name) & ~result.flagged()
        np.testing.assert_array_equal(np.asarray(dots.get_ydata()), result.log.value[shown])
    assert len(lines(main, "truth")) == 1
    assert [text.get_text() for text in main.texts] == ["gps frozen"]
    assert [len(panel.patches) for panel in figure.axes] == [1, 1, 1, 1]
    assert main.get_ylabel() == "speed (m/s)"
    assert error.get_ylabel() == "error (m/s)"
    assert noise.get_ylabel() == "noise / σ"
    assert p_value.get_xlabel() == "time (s)"
    assert p_value.get_yscale() == "log"
    (legend,) = figure.legends
    assert legend.get_title().get_text() == "A title"
    assert len({line.get_color() for name in ("wheel", "radar") for line in lines(main, name)}) == 2


def test_far_outlier_is_a_triangle_at_the_edge() -> None:
    main = plot_result(make_result()).axes[0]
    (marks,) = [
        m for m in main.get_lines() if m.get_marker() == "^" and len(np.asarray(m.get_xdata()))
    ]
    assert main.get_ylim()[1] < 100
    np.testing.assert_allclose(np.asarray(marks.get_xdata(), float), 0.05 * OUTLIER)
    np.testing.assert_allclose(np.asarray(marks.get_ydata(), float), main.get_ylim()[1])


def test_names_are_no_formulas() -> None:
    """Of sensors, files and events: "$^$" would be one that does not parse."""
    log = sf.Log([0.0, 0.1], ["$^$", "$^$"], [1.0, 1.1])
    model = sf.LinearModel([[0.0]], [[1.0]], [[1.0]], names=("$^$",))
    result = sf.DesyncFilter(model, [sf.Sensor("$^$", 1.0)], [1.0], [[1.0]]).run(log)
    pixels(plot_result(result, title="$^$", events=[Event(0.0, 0.1, "$^$")]))


def test_legend_covers_no_data() -> None:
    figure = plot_result(make_result(), title="A title")
    pixels(figure)
    box = figure.legends[0].get_window_extent()
    assert all(box.y0 >= axes.get_window_extent().y1 - 1 for axes in figure.axes)


def test_not_blank() -> None:
    image = pixels(plot_result(make_result()))
    assert image.shape[0] > 200
    assert 0.02 < (image[..., :3].min(axis=2) < 0.9).mean() < 0.9


def test_no_pyplot() -> None:
    before = "matplotlib.pyplot" in sys.modules
    plot_result(make_result())
    assert ("matplotlib.pyplot" in sys.modules) == before


def test_long_logs_are_thinned_out_and_say_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(drawn, "MOST_DOTS", 50)
    monkeypatch.setattr(drawn, "MOST_POINTS", 50)
    figure = plot_result(make_result())
    main = figure.axes[0]
    (wheel,) = lines(main, "wheel")
    assert wheel.get_label() == "wheel (every 4th shown)"
    assert 40 <= len(np.asarray(wheel.get_xdata())) <= 50
    assert lines(main, "estimate")[0].get_label() == "estimate (every 2nd shown)"
    assert len(lines(main, "flagged")) == 1


def test_window() -> None:
    main = plot_result(make_result(), window=(4.0, 6.0)).axes[0]
    assert main.get_xlim() == (4.0, 6.0)
    times = np.concatenate([np.asarray(line.get_xdata(), float) for line in main.get_lines()])
    assert times.min() >= 4.0
    assert times.max() <= 6.0
    with pytest.raises(sf.ConfigError, match="window"):
        plot_result(make_result(), window=(6.0, 4.0))


def test_without_noise_estimates() -> None:
    figure = plot_result(make_result(noise=None))
    assert len(figure.axes) == 2
    assert lines(figure.axes[0], "flagged") == []


def test_rows_that_cannot_be_drawn() -> None:
    log = sf.Log([0.0, 0.1, np.nan, 0.3], ["wheel", "wheel", "wheel", "other"], [1, np.nan, 2, 3])
    model = sf.ConstantVelocity(acceleration=1.0)
    result = sf.DesyncFilter(model, SENSORS, [1.0], [[1.0]]).run(log)
    pixels(plot_result(result))


def test_result_plot_and_saving(tmp_path: Path) -> None:
    figure = make_result().plot(ylabel="v (km/h)")
    assert figure.axes[0].get_ylabel() == "v (km/h)"
    figure.savefig(tmp_path / "plot.pdf")
    assert (tmp_path / "plot.pdf").stat().st_size > 1000


@pytest.mark.parametrize(
    "reference",
    [([0, 1], [1]), ([0, 1], [1, np.nan]), ([[0, 1]], [[0, 1]]), ([], []), ([1, 0], [1, 2]), 5],
    ids=["lengths", "NaN", "matrix", "empty", "unsorted", "number"],
)
def test_reference_that_does_not_fit(reference: Any) -> None:
    with pytest.raises((sf.ShapeError, sf.ConfigError), match="reference"):
        make_result().plot(reference=reference)


def test_line_beyond_which_noise_is_flagged() -> None:
    """As ``flagged`` decides, also where the rate per row is below 1e-15."""
    result = make_result()
    noise = plot_result(result, false_alarm=1e-15).axes[1]
    levels = [line.get_ydata() for line in lines(noise, "_") if line.get_linestyle() == "--"]
    beyond = result.flagged_beyond(1e-15)
    assert [float(np.asarray(level)[0]) for level in levels] == [-beyond, beyond]


@pytest.mark.parametrize("n", [1, 2, 3, 4, 11, 12, 13, 21, 112])
def test_ordinals(n: int) -> None:
    endings = {1: "1st", 2: "2nd", 3: "3rd", 4: "4th", 11: "11th", 12: "12th", 13: "13th"}
    assert drawn._ordinal(n) == {**endings, 21: "21st", 112: "112th"}[n]
