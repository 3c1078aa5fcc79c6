"""The figure of a diagnosis: what is drawn of which sensor."""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence

import numpy as np
import pytest

import surefix as sf
from surefix.core.checks import FloatArray
from surefix.plots import draw_drift
from surefix.plots import drift_curves as curves

pytest.importorskip("matplotlib")

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import imread
from matplotlib.lines import Line2D

SENSORS = [sf.Sensor("wheel", 0.2), sf.Sensor("axle", 0.2), sf.Sensor("radar", 0.4)]
FILTER = sf.DesyncFilter(sf.ConstantAcceleration(jerk=0.02), SENSORS, [20, 0], np.diag([1, 0.01]))
PROFILES = (sf.Profile.step(), sf.Profile.ramp())
RECORDS = tuple[sf.ForwardRecord, sf.ForwardRecord, sf.Diagnosis]


def diagnosed(
    fault: Callable[[FloatArray], FloatArray] | None = None,
    profiles: Sequence[sf.Profile] = PROFILES,
    spectrum: bool = True,
    ends: bool = False,
    still: bool = False,
) -> RECORDS:
    """20 s of 3 sensors, the fault is in the wheel; ``still``: all readings the same."""
    random = np.random.RandomState(2)
    time = np.repeat(0.2 * np.arange(100), 3)
    sensor = np.tile(np.array([s.name for s in SENSORS]), 100)
    value = 20 + np.tile(np.array([s.sigma for s in SENSORS]), 100) * random.normal(size=300)
    value = np.full(300, 20.0) if still else value
    if fault is not None:
        value = np.where(sensor == "wheel", value + fault(time), value)
    log = sf.Log(time, sensor, value)
    found = sf.diagnose(FILTER, log, profiles, spectrum=spectrum, ends=ends, samples=32)
    assert isinstance(found.repaired, sf.Log)
    return sf.ForwardRecord(FILTER, log), sf.ForwardRecord(FILTER, found.repaired), found


def ramp(time: FloatArray) -> FloatArray:
    return 0.2 * np.maximum(time - 8.0, 0.0)


def line(axes: Axes, label: str) -> Line2D:
    (only,) = [one for one in axes.get_lines() if str(one.get_label()).startswith(label)]
    return only


def y(one: Line2D) -> FloatArray:
    return np.asarray(one.get_ydata(), dtype=np.float64)


def pixels(figure: Figure) -> FloatArray:
    file = io.BytesIO()
    figure.savefig(file, format="png", dpi=50)
    file.seek(0)
    return np.asarray(imread(file), dtype=np.float64)


def test_ramp() -> None:
    before, after, found = diagnosed(ramp)
    (fault,) = found.faults
    units = {"wheel": "m/s"}
    figure = draw_drift(before, after, found, PROFILES, units=units, title="a $ log")
    residual, onset, spectrum = figure.axes
    wheel = np.arange(0, 300, 3)
    np.testing.assert_array_equal(y(line(residual, "wheel")), before.innovations[0][wheel])
    effect = before.innovations[0] - after.innovations[0]
    np.testing.assert_allclose(y(line(residual, "effect of ramp since")), effect[wheel])
    course = line(residual, "fault itself")
    np.testing.assert_allclose(y(course), fault.value(np.asarray(course.get_xdata(), float)))
    assert residual.get_ylabel() == "residual (m/s)"
    ratio = sf.OnsetDetector(sf.Profile.ramp(), "wheel").run(before).ratio
    np.testing.assert_allclose(y(line(onset, "wheel: ramp")), ratio)
    ratio = sf.SpectrumDetector("wheel").run(before).ratio
    np.testing.assert_allclose(y(line(spectrum, "wheel: sinusoid")), ratio)
    assert (onset.get_xlabel(), spectrum.get_xlabel()) == ("time (s)", "frequency (Hz)")
    image = pixels(figure)
    assert 0.02 < (image[..., :3].min(axis=2) < 0.9).mean() < 0.9


def test_thresholds_are_those_of_the_diagnosis() -> None:
    before, _, found = diagnosed(ramp, spectrum=False)
    drawn = curves.onset_curves(before, found, PROFILES)
    assert drawn[0].sensor == "wheel"
    share = found.false_alarm / len(found.searched)
    for one in drawn:
        profile = next(profile for profile in PROFILES if profile.name == one.kind)
        exact = sf.OnsetDetector(profile, one.sensor, share, samples=4096).threshold(before)
        assert one.threshold == pytest.approx(exact, abs=1.0)
        best = max(s.drop or 0.0 for s in found.searched if s.channel == one.sensor)
        assert np.nanmax(one.drop) <= best


def test_two_faulty_sensors_have_a_panel_each() -> None:
    time = np.repeat(0.2 * np.arange(100), 3)
    sensor = np.tile(np.array([s.name for s in SENSORS]), 100)
    noise = np.tile(np.array([s.sigma for s in SENSORS]), 100)
    value = 20.0 + noise * np.random.RandomState(4).normal(size=300)
    value += np.where(sensor == "wheel", ramp(time), 0)
    value += np.where((sensor == "radar") & (time >= 5), 4.0, 0)
    both = sf.Log(time, sensor, value)
    found = sf.diagnose(FILTER, both, spectrum=False, samples=32)
    assert {fault.channel for fault in found.faults} >= {"wheel", "radar"}
    assert isinstance(found.repaired, sf.Log)
    after = sf.ForwardRecord(FILTER, found.repaired)
    figure = draw_drift(sf.ForwardRecord(FILTER, both), after, found, PROFILES)
    panels = len({fault.channel for fault in found.faults})
    assert len(figure.axes) == panels + 1
    assert figure.axes[0].get_ylabel() == "residual"
    pixels(figure)


def test_sinusoid_alone() -> None:
    before, after, found = diagnosed(lambda t: 0.5 * np.sin(2 * np.pi * 1.1 * t), profiles=())
    figure = draw_drift(before, after, found, ())
    residual, spectrum = figure.axes
    assert line(residual, "effect of sinusoid of 1.1").get_linewidth() < 2
    assert "wheel: sinusoid" in [str(one.get_label()) for one in spectrum.get_lines()]
    assert residual.get_xlabel() == "time (s)"
    pixels(figure)


def test_ends_draw_the_best_end_of_every_onset() -> None:
    before, after, found = diagnosed(
        lambda t: np.where((t >= 5) & (t < 12), 1.0, 0.0), (sf.Profile.step(),), False, True
    )
    assert found.faults[0].kind == "step (ends)"
    figure = draw_drift(before, after, found, (sf.Profile.step(),))
    drawn = line(figure.axes[1], "wheel: step (ends)")
    time = np.asarray(drawn.get_xdata(), float)
    assert (np.diff(time) > 0).all()
    assert time[np.nanargmax(y(drawn))] == found.faults[0].onset
    assert np.nanmax(y(drawn)) == pytest.approx(found.faults[0].drop)


def test_nothing_found_shows_the_largest_drop() -> None:
    before, after, found = diagnosed()
    assert not found.detected
    figure = draw_drift(before, after, found, PROFILES)
    best = max(found.searched, key=lambda one: one.drop or 0.0)
    residual = figure.axes[0]
    labels = [str(one.get_label()) for one in residual.get_lines()]
    assert labels[0].startswith(best.channel)
    assert not any("effect" in label or "fault" in label for label in labels)


def test_undetectable_has_no_curves() -> None:
    before, after, found = diagnosed(still=True)
    assert {one.status for one in found.searched} == {"undetectable"}
    figure = draw_drift(before, after, found, PROFILES)
    assert len(figure.axes) == 1
    pixels(figure)


def test_outline_keeps_the_peaks() -> None:
    from surefix.plots.drift_panels import _outline

    at, drop = np.arange(100_000.0), np.zeros(100_000)
    drop[54_321], drop[99_999], drop[:7] = 9.0, 8.0, np.nan
    shown_at, shown = _outline(at, drop)
    assert len(shown_at) <= 20_000
    assert {54_321.0: 9.0, 99_999.0: 8.0}.items() <= dict(zip(shown_at, shown, strict=True)).items()
