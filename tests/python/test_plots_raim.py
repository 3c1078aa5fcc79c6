"""The figures of a monitor: what is drawn where."""

from __future__ import annotations

import io
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import surefix as sf
from oracle.step import Array
from raim.journey import EPOCHS, NAMES, Journey, journey
from surefix.plots import raim_map, raim_panels
from surefix.plots.raim import draw_availability, draw_raim, draw_stanford
from surefix.stanford import regions

pytest.importorskip("matplotlib")

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import imread
from matplotlib.lines import Line2D

FAULTY, BLOCKED, LOST = slice(5, 9), slice(20, 23), slice(26, 28)


@cache
def scene() -> Journey:
    """An exclusion, an outage, and four satellites at fault at once, which no exclusion ends."""
    one = journey().biased("E02", FAULTY, 60.0).blocked(2, BLOCKED)
    for k, name in enumerate(NAMES[:4]):
        one = one.biased(name, LOST, 80.0 * (-1) ** k)
    return one


@cache
def result() -> sf.raim.RaimResult:
    return sf.raim.TrackRaim(scene().track, length=60.0).run(scene().data)


@cache
def mapped(low: float = 400.0, high: float = 800.0) -> sf.raim.AvailabilityMap:
    one = scene()
    return sf.raim.availability(
        one.track, one.satellites, length=45.0, sigma=1.5, step=50.0,
        masks=[sf.raim.Tunnel(low, high)],
    )  # fmt: skip


def line(axes: Axes, label: str) -> Line2D:
    (only,) = [one for one in axes.get_lines() if str(one.get_label()) == label]
    return only


def y(one: Line2D) -> Array:
    return np.asarray(one.get_ydata(), dtype=np.float64)


def pixels(figure: Figure) -> Array:
    file = io.BytesIO()
    figure.savefig(file, format="png", dpi=40)
    file.seek(0)
    return np.asarray(imread(file), dtype=np.float64)


def labels(axes: Axes) -> set[str]:
    return {name for name in axes.get_legend_handles_labels()[1] if not name.startswith("_")}


def texts(figure: Figure) -> str:
    return "\n".join(text.get_text() for axes in figure.axes for text in axes.texts)


def test_scene_has_every_declaration() -> None:
    declared = result().declared
    assert set(declared) == {"ok", "excluded", "not available", "alarm"}
    assert (declared[LOST] == "alarm").all()


def test_over_time_without_truth() -> None:
    figure = draw_raim(result(), title="a $ log")
    along, levels, statistic, satellites = figure.axes
    usable = result().usable
    drawn = y(line(along, "position along the track"))
    np.testing.assert_array_equal(drawn, np.where(usable, result().along, np.nan))
    np.testing.assert_array_equal(
        y(line(along, "position with an alarm")), result().along[result().declared == "alarm"]
    )
    assert {"satellites excluded", "alarm", "not available"} <= labels(along)
    level = y(line(levels, "protection level"))
    np.testing.assert_array_equal(level, np.where(usable, result().protection, np.nan))
    assert y(line(levels, "half the interval, L / 2")).tolist() == [30.0, 30.0]
    assert levels.get_ylim()[0] == 0.0
    assert "error" not in labels(levels)
    assert statistic.get_yscale() == "log"
    assert satellites.get_xlabel() == "time (s)"
    image = pixels(figure)  # with a truth the panels are the same
    assert 0.05 < (image[..., :3].min(axis=2) < 0.9).mean() < 0.9


def test_over_time_with_truth() -> None:
    truth = scene().truth.copy()
    truth[12] += 45.0  # as if the position were wrong, and its level not
    figure = draw_raim(result(), truth)
    along, levels = figure.axes[:2]
    np.testing.assert_array_equal(y(line(along, "truth")), truth)
    error = np.where(result().usable, result().along - truth, np.nan)
    np.testing.assert_array_equal(y(line(levels, "error")), error)
    beyond = line(levels, "error beyond the level")
    assert np.asarray(beyond.get_xdata()).tolist() == [12.0]
    assert levels.get_ylim()[0] == -levels.get_ylim()[1]
    truth[12] -= 1e4
    figure = draw_raim(result(), truth)
    beyond = line(figure.axes[1], "error beyond the level")
    assert abs(y(beyond)[0]) < figure.axes[1].get_ylim()[1]  # at the edge, not left out


def test_truth_of_another_length_is_refused() -> None:
    with pytest.raises(sf.ShapeError, match=r"truth: expected shape \(30,\).*\(3,\)"):
        draw_raim(result(), [1.0, 2.0, 3.0])


@pytest.mark.parametrize("kept", [0, 1])
def test_nothing_available_and_a_single_epoch(kept: int) -> None:
    one = scene()
    part = replace(
        one, truth=one.truth[: kept or EPOCHS], pseudorange=one.pseudorange[: kept or EPOCHS]
    )
    part = part if kept else part.blocked(0, slice(None))
    shown = sf.raim.TrackRaim(part.track, length=60.0).run(part.data)
    assert shown.usable.sum() == kept
    figure = draw_raim(shown, part.truth)
    if kept:
        pixels(figure)


def test_spans_join_neighbours_and_stop_at_gaps() -> None:
    data = scene().data
    kept = data.where(~np.isin(data.time, (10.0, 11.0, 12.0, 13.0, 14.0)))
    view = raim_panels.RaimView(sf.raim.TrackRaim(scene().track, length=60.0).run(kept), None)
    start, end = view.edges
    epoch = view.result.time.tolist().index(9.0)
    assert end[epoch] < start[epoch + 1]
    every = raim_panels._spans(np.ones(len(start), dtype=np.bool_), start, end)
    assert [at for at, _ in every] == [start[0], start[epoch + 1]]
    time, values = view.line(view.result.along)
    assert len(time) == len(start) + 1
    assert np.isnan(values[epoch + 1])


def test_stanford_regions() -> None:
    error = [1.0, -4.0, 30.0, 5.0, 70.0, np.nan, 3.0, 40.0]
    level = [10.0, 3.0, 10.0, 60.0, 60.0, 5.0, np.nan, np.inf]
    parts = regions(error, level, 20.0)
    assert parts.counts == {
        "available": 1, "misleading": 1, "hazardous": 1, "unavailable": 2,
        "unavailable_misleading": 1,
    }  # fmt: skip
    figure = draw_stanford(error, level, 20.0, title="a $ log")
    for text in ("available\n1", "hazardously misleading\n1", "not available\n2"):
        assert text in texts(figure)
    axes = figure.axes[0]
    assert axes.get_xlim() == axes.get_ylim() == (0.0, 40.0)
    assert "1 beyond 40 are drawn there" in axes.get_xlabel()
    assert "3 beyond 40" in axes.get_ylabel()
    assert "6 epochs" in axes.get_title(loc="left")
    (density,) = [one for one in axes.collections if one.get_array() is not None]
    assert np.nansum(np.asarray(density.get_array())) == 6
    pixels(figure)


def test_stanford_on_the_borders_and_of_nothing() -> None:
    assert regions([20.0, 20.0], [20.0, 10.0], 20.0).counts["available"] == 1
    assert regions([20.0, 20.0], [20.0, 10.0], 20.0).counts["misleading"] == 1
    figure = draw_stanford([], [], 20.0)
    assert "0 epochs" in figure.axes[0].get_title(loc="left")
    with pytest.raises(sf.ShapeError, match="protection"):
        draw_stanford([1.0], [1.0, 2.0], 20.0)
    with pytest.raises(sf.ConfigError, match="limit"):
        draw_stanford([1.0], [1.0], 0.0)
    with pytest.raises(sf.ConfigError, match=r"protection.*>= 0"):
        draw_stanford([1.0], [-1.0], 1.0)


def test_map() -> None:
    shown = mapped()
    figure = draw_availability(shown, missed=1e-3, title="a $ line")
    left, _, above, below = figure.axes[:4]
    state = raim_map.states(shown)
    hidden = (shown.along >= 400) & (shown.along <= 800)
    assert (state[hidden] == 2).all()
    (pieces,) = left.collections
    red = np.array([0xD5, 0x5E, 0x00]) / 255
    drawn = np.asarray(pieces.get_colors())[:, :3]  # type: ignore[attr-defined]
    touches = hidden[1:] | hidden[:-1]
    assert (np.abs(drawn[touches] - red).max(axis=1) < 1e-9).all()
    assert len(drawn) == len(shown.along) - 1
    both = y(line(above, "$p^* + e_1$"))
    known = ~hidden
    expected = np.maximum((shown.p_star + shown.e1)[known], raim_map.SMALLEST)
    np.testing.assert_array_equal(both[known], expected)
    assert np.isnan(both[hidden]).all()
    assert y(line(above, "$\\gamma$")).tolist() == [1e-3, 1e-3]
    assert above.get_yscale() == "log"
    assert y(below.get_lines()[0])[hidden].max() == 0
    (legend,) = figure.legends
    shares = [text.get_text() for text in legend.get_texts()]
    assert f"not available: {(state == 2).mean():.1%}" in shares
    pixels(figure)


def test_map_is_in_metres() -> None:
    shown = mapped()
    place = raim_map.local_metres(shown)
    apart = np.linalg.norm(np.diff(place, axis=0), axis=1)
    np.testing.assert_allclose(apart, 50.0, rtol=2e-3)


def test_map_of_a_tunnel_has_no_levels() -> None:
    figure = draw_availability(mapped(-1.0, 2000.0))
    assert figure.axes[1].get_title(loc="left") == "no protection level anywhere"


def test_results_plot_themselves() -> None:
    assert isinstance(result().plot(scene().truth), Figure)
    assert isinstance(mapped().plot(), Figure)


def test_map_of_a_single_place() -> None:
    one = scene()
    shown = sf.raim.availability(one.track, one.satellites, length=60.0, along=[300.0])
    pixels(draw_availability(shown))
