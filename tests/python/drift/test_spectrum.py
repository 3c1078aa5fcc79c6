"""Sinusoids: every frequency's ratio against dense algebra, and the paper's indicator."""

from __future__ import annotations

from dataclasses import replace
from math import pi
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

import surefix as sf
from drift.scenes import CLEAR, Channel, Scene, faulty, irregular, logged, particle
from oracle import drift_profiles as profiles
from oracle.drift import Dense
from oracle.step import Array

TOLERANCE = 1e-8  # in the unit of the ratio, a chi-square
FEW = 8  # samples, where p-values do not matter


def sine(scene: Scene, amplitude: float, frequency: float, phase: float = 0.0) -> Array:
    """(T,), the phase at the first time."""
    t = scene.times - scene.times[0]
    return np.asarray(amplitude * np.sin(2.0 * pi * frequency * t + phase))


def ratios(d: Dense, frequencies: Array, weights: Array) -> profiles.Fits:
    return profiles.fits(d, profiles.sine_faults(d, frequencies, weights))


def assert_ratios(found: sf.SpectrumResult, d: Dense, weights: Array) -> None:
    """Where sine and cosine can be told apart: at half the rate they cannot."""
    faults = profiles.sine_faults(d, found.frequency, weights)
    known = profiles.fits(d, faults)
    apart = np.linalg.svd(faults, compute_uv=False)[:, -1] > 1e-6 * np.sqrt(len(d.time))
    clear = (known.detectability > CLEAR) & apart
    assert clear.sum() > 0.9 * len(clear)
    wrong = np.abs(found.ratio - known.ratio)[clear]
    assert np.max(wrong / (1.0 + known.ratio[clear])) <= TOLERANCE


PLACES: dict[str, tuple[Scene, Channel]] = {
    "particle": (particle(), None),
    "slow": (particle(64, 0.25), None),
    "irregular, one": (irregular(), "b"),
    "irregular, both": (irregular(), {"a": 1.0, "b": -0.4}),
}


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("default", [True, False], ids=["grid", "given"])
def test_every_frequency_against_dense_algebra(place: str, default: bool) -> None:
    scene, channel = PLACES[place]
    z = scene.simulated(1, 1)[0]
    rate = (len(scene.times) - 1) / (scene.times[-1] - scene.times[0])
    given = None if default else rate * np.array([1e-3, 0.013, 0.2, 0.31, 0.49])
    found: Any = sf.SpectrumDetector(channel, given, samples=FEW).run(scene.record(z))
    if given is not None:
        np.testing.assert_array_equal(found.frequency, given)
    assert_ratios(found, scene.dense(z), scene.weights(channel))


@pytest.mark.parametrize("channel", ["wheel", "gps", {"wheel": 1.0, "radar": 0.5}])
def test_every_frequency_of_a_log(channel: Channel) -> None:
    scene = logged()
    given = np.array([0.05, 0.3, 1.0, 3.7, 11.0])
    found: Any = sf.SpectrumDetector(channel, given, samples=FEW).run(scene.record)
    assert_ratios(found, scene.dense, scene.weights(channel))
    grid = sf.SpectrumDetector(channel, oversampling=1, samples=FEW).run(scene.record)
    assert_ratios(grid, scene.dense, scene.weights(channel))


@pytest.mark.parametrize("interval", [1.0, 0.25])
def test_imaginary_part_is_that_of_a_transform_that_counts_from_one(interval: float) -> None:
    """Eq. (16): -Im F(g)_l with F(g)_l = sum over k = 1..N of g_k exp(-2 pi i k l / N)."""
    scene = particle(100, interval)
    z = scene.simulated(1, 2)[0]
    record, d, N = scene.record(z), scene.dense(z), 100
    cycles, k = np.arange(1, N // 2), np.arange(1, N + 1)
    found: Any = sf.SpectrumDetector(frequencies=cycles / (N * interval), samples=FEW).run(record)
    turn = np.exp(-2j * pi * np.outer(cycles, k) / N)
    transform = turn @ d.gradient[:, 0]
    scale = np.abs(d.gradient).sum()  # what cancels in a sum
    np.testing.assert_allclose(found.imaginary, -transform.imag, rtol=0, atol=1e-11 * scale)
    np.testing.assert_allclose(found.power, np.abs(transform), rtol=0, atol=1e-11 * scale)
    # with no fault g is N(0, 4 Gamma^-1)
    white = d.whiten(-turn.imag.T).astype(float)
    sigma = 2.0 * np.sqrt(np.sum(white**2, axis=0))
    np.testing.assert_allclose(found.imaginary_scaled, found.imaginary / sigma, rtol=1e-8)


def test_power_where_times_are_irregular() -> None:
    """|sum of g exp(-2 pi i f t)|, wherever t is counted from."""
    scene = irregular()
    z = scene.simulated(1, 3)[0]
    given, g = np.array([0.05, 0.2, 0.6]), scene.dense(z).gradient[:, 1]
    found: Any = sf.SpectrumDetector("b", given).run(scene.record(z))
    turn = np.exp(-2j * pi * np.outer(given, scene.times))
    known = np.abs(turn @ np.nan_to_num(g))
    np.testing.assert_allclose(found.power, known, atol=1e-10 * np.nansum(np.abs(g)))


@pytest.mark.parametrize("oversampling", [1, 2, 5])
@pytest.mark.parametrize("interval", [1.0, 0.25])
def test_grid_of_frequencies(oversampling: int, interval: float) -> None:
    """As many between whole numbers of cycles as asked for, none above half the rate."""
    N = 64
    scene = particle(N, interval)
    record = scene.record(scene.simulated(1, 1)[0])
    f = sf.SpectrumDetector(oversampling=oversampling, samples=FEW).run(record).frequency
    cycles = f * N * interval
    np.testing.assert_allclose(np.diff(cycles), 1.0 / oversampling, rtol=1e-9)
    whole = np.arange(1, N // 2)
    assert np.abs(cycles[None] - whole[:, None]).min(axis=1).max() < 1e-9
    assert cycles[0] > 0.0
    assert cycles[-1] <= N / 2 + 1e-9


@pytest.mark.parametrize("place", PLACES)
def test_best_frequency_and_what_is_between_the_bins(place: str) -> None:
    """A sine of large amplitude at no bin: the top of the ratio as a function of the frequency."""
    scene, channel = PLACES[place]
    span = scene.times[-1] - scene.times[0]
    f = 10.37 / span
    z = scene.simulated(1, 4)[0]
    for name, weight in zip(scene.channels, scene.weights(channel), strict=True):
        z = faulty(z, sine(scene, 5.0 * weight, f, 0.7), scene.channels.index(name))
    d, weights = scene.dense(z), scene.weights(channel)
    found: Any = sf.SpectrumDetector(channel).run(scene.record(z))
    best = int(np.nanargmax(found.ratio))
    assert found.best_frequency == found.frequency[best]

    def minus(frequency: float) -> float:
        return -float(ratios(d, np.array([frequency]), weights).ratio[0])

    spacing = found.frequency[1] - found.frequency[0]
    around = (found.best_frequency - spacing, found.best_frequency + spacing)
    top = minimize_scalar(minus, bounds=around, method="bounded", options={"xatol": 1e-6 / span})
    # A thousandth of a cycle: at the top the ratio is flat, it falls by less than that squared.
    assert found.refined_frequency == pytest.approx(top.x, abs=1e-3 / span)
    assert -minus(found.refined_frequency) >= found.ratio[best] - TOLERANCE * found.ratio[best]
    assert found.detected


@pytest.mark.parametrize("place", PLACES)
def test_amplitude_and_phase_are_those_at_the_refined_frequency(place: str) -> None:
    scene, channel = PLACES[place]
    span = scene.times[-1] - scene.times[0]
    z = scene.simulated(1, 4)[0]
    for name, weight in zip(scene.channels, scene.weights(channel), strict=True):
        at = scene.channels.index(name)
        z = faulty(z, sine(scene, 5.0 * weight, 9.37 / span, 0.7), at)
    d, weights = scene.dense(z), scene.weights(channel)
    found: Any = sf.SpectrumDetector(channel).run(scene.record(z))
    assert found.refined_frequency is not None
    t = d.time - scene.times[0]
    shape = profiles.sine(found.refined_frequency)(t) * weights[d.channel, None]
    fit = profiles.fits(d, shape[None])
    a_sin, a_cos = fit.amplitude[0]
    assert found.amplitude == pytest.approx(np.hypot(a_sin, a_cos), rel=1e-7)
    away = found.phase - np.arctan2(a_cos, a_sin)
    assert np.exp(1j * away) == pytest.approx(1.0, abs=1e-7)
    # the standard error along the amplitude's own direction, the phase as it was found
    white = d.whiten(shape).astype(float)
    along = np.array([a_sin, a_cos]) / np.hypot(a_sin, a_cos)
    variance = along @ np.linalg.solve(white.T @ white, along)
    assert found.amplitude_se == pytest.approx(np.sqrt(variance), rel=1e-6)


@pytest.mark.parametrize("interval", [1.0, 0.25])
def test_cycles_are_counted_over_all_samples(interval: float) -> None:
    scene = particle(100, interval)
    z = faulty(scene.simulated(1, 5)[0], sine(scene, 3.0, 8.0 / (100 * interval)))
    found: Any = sf.SpectrumDetector().run(scene.record(z))
    assert found.cycles == pytest.approx(found.refined_frequency * 100 * interval, rel=1e-12)
    assert found.cycles == pytest.approx(8.0, abs=0.3)


def test_the_papers_sine() -> None:
    """2.5 sin(t / 2), t = 1..100: 7.96 cycles. Eight are found in every one of 200 runs, with the
    phase unknown and by the imaginary part alone, and the transform of innovations would not."""
    scene = particle()
    z = faulty(scene.simulated(200, 1), 2.5 * np.sin((scene.times + 1.0) / 2.0))
    record = scene.record(z)
    found: Any = sf.SpectrumDetector().run(record)
    assert found.cycles.shape == found.best_frequency.shape == (200,)
    assert np.mean(np.rint(found.cycles) == 8) >= 0.99
    assert np.mean(found.detected) >= 0.99
    bins: Any = sf.SpectrumDetector(oversampling=1, samples=FEW).run(record)
    cycles = np.rint(bins.frequency * 100)
    assert np.mean(cycles[np.nanargmax(np.abs(bins.imaginary), axis=1)] == 8) >= 0.95
    assert np.mean(np.rint(100 * bins.best_frequency) == 8) >= 0.99
    assert np.median(found.amplitude) == pytest.approx(2.5, abs=0.1)


def test_many_runs_are_one_by_one() -> None:
    """Bit for bit."""
    scene = irregular(40)
    z = scene.simulated(5, 6)
    detector = sf.SpectrumDetector("a", samples=FEW)
    many = detector.run(scene.record(z))
    names = [
        *("ratio", "imaginary", "imaginary_scaled", "power", "best_frequency"),
        *("refined_frequency", "cycles", "amplitude", "amplitude_se", "phase"),
    ]
    for i in range(len(z)):
        one = detector.run(scene.record(z[i]))
        np.testing.assert_array_equal(many.frequency, one.frequency)
        for name in names:
            known, mine = np.asarray(getattr(many, name)), np.asarray(getattr(one, name))
            known = known[i] if known.ndim > mine.ndim else known
            np.testing.assert_array_equal(known, mine, name)


def test_half_the_rate_has_one_amplitude() -> None:
    """There the sine is zero at every sample but for rounding, which must not become a number: the
    ratio is that of the alternating sign alone, or there is none."""
    scene = particle(64)
    z = scene.simulated(1, 8)[0]
    d, sign = scene.dense(z), np.where(np.arange(64) % 2 == 0, 1.0, -1.0)
    known = profiles.fits(d, sign[None, :, None])
    found: Any = sf.SpectrumDetector(frequencies=[0.25, 0.5]).run(scene.record(z))
    if not np.isnan(found.ratio[1]):
        assert found.ratio[1] == pytest.approx(known.ratio[0], rel=1e-6)
    strong: Any = sf.SpectrumDetector().run(scene.record(faulty(z, 5.0 * sign)))
    assert strong.amplitude is None or strong.amplitude < 50.0


def test_missing_samples_do_not_change_the_frequency() -> None:
    """A third of the samples missing: the time of each counts, not its rank."""
    scene = particle(150)
    gone = np.random.default_rng(3).random((150, 1)) < 0.33
    holes = replace(scene, seen=~gone)
    z = faulty(holes.simulated(1, 7)[0], sine(holes, 4.0, 0.17))
    found: Any = sf.SpectrumDetector().run(holes.record(z))
    assert found.refined_frequency == pytest.approx(0.17, abs=0.1 / 150)
    assert_ratios(found, holes.dense(z), np.ones(1))
