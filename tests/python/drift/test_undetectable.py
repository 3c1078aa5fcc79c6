"""What cannot be known is said: a status and a reason, never a number."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import surefix as sf
from drift.scenes import PROFILES, Scene, irregular, particle

ONSET = ("onset", "amplitude", "amplitude_se", "drop", "p_value", "p_value_se")
SPECTRUM = (
    *("best_frequency", "refined_frequency", "cycles", "amplitude", "amplitude_se", "phase"),
    *("p_value", "p_value_se"),
)


def assert_undetectable(found: sf.OnsetResult | sf.SpectrumResult) -> None:
    assert found.status == "undetectable"
    assert found.detected is False
    assert isinstance(found.reason, str)
    assert len(found.reason) > 10
    for name in SPECTRUM if isinstance(found, sf.SpectrumResult) else ONSET:
        assert getattr(found, name) is None, name


def system_of(*matrices: Any) -> sf.LinearSystem:
    return sf.LinearSystem(*matrices)


def window(steps: int) -> sf.ForwardRecord:
    scene = particle()
    z = scene.simulated(1, 1)[0][:steps]
    return sf.ForwardRecord(scene.system, z)


def constant(P0: float, steps: int = 10, Q: float = 0.0) -> sf.ForwardRecord:
    """A level that stays, or wanders; z about it."""
    one = np.eye(1)
    system = system_of(one, one, Q * one, one, [0.0], P0 * one)
    return sf.ForwardRecord(system, np.random.default_rng(1).normal(size=(steps, 1)))


def ends(profile: sf.Profile) -> sf.OnsetDetector:
    return sf.OnsetDetector(profile, ends=True)


SHORT: dict[str, tuple[Callable[[], Any], int]] = {
    "a ramp is zero at its onset": (lambda: sf.OnsetDetector(sf.Profile.ramp()), 1),
    "so is an exponential": (lambda: sf.OnsetDetector(sf.Profile.exponential(3.0)), 1),
    "and one that grows": (lambda: sf.OnsetDetector(sf.Profile.exponential(-3.0)), 1),
    "a sine has two amplitudes": (lambda: sf.OnsetDetector(sf.Profile.sine(0.1)), 1),
    "and where it is over the whole window": (lambda: sf.SpectrumDetector(), 1),
    "at a given frequency": (lambda: sf.SpectrumDetector(frequencies=[0.1]), 1),
    "ramp that ends": (lambda: ends(sf.Profile.ramp()), 1),
    "a parabola with a step": (lambda: sf.OnsetDetector(PROFILES["step and parabola"][0]()), 1),
}


@pytest.mark.parametrize(("make", "steps"), SHORT.values(), ids=SHORT.keys())
def test_windows_too_short(make: Callable[[], Any], steps: int) -> None:
    assert_undetectable(make().run(window(steps)))
    healthy = make().run(window(30))
    assert healthy.status in ("detected", "not detected")
    assert healthy.p_value is not None


EVERY: dict[str, Callable[[], Any]] = {
    "step": lambda: sf.OnsetDetector(sf.Profile.step(), "a"),
    "ramp": lambda: sf.OnsetDetector(sf.Profile.ramp(), "a"),
    "sine": lambda: sf.OnsetDetector(sf.Profile.sine(0.1), "a"),
    "step that ends": lambda: sf.OnsetDetector(sf.Profile.step(), "a", ends=True),
    "spectrum": lambda: sf.SpectrumDetector("a"),
    "frequencies": lambda: sf.SpectrumDetector("a", frequencies=[0.1, 0.2]),
}
every = pytest.mark.parametrize("make", EVERY.values(), ids=EVERY.keys())


def gone(scene: Scene, *channels: int) -> sf.ForwardRecord:
    z = scene.simulated(1, 2)[0]
    z[:, list(channels)] = np.nan
    return scene.record(z)


@every
@pytest.mark.parametrize("channels", [(0,), (0, 1)], ids=["the channel", "all"])
def test_no_measurement_of_the_channel(make: Callable[[], Any], channels: tuple[int, ...]) -> None:
    scene = irregular(30)
    assert_undetectable(make().run(gone(scene, *channels)))
    assert make().run(gone(scene, 1)).status != "undetectable"


@every
def test_a_channel_that_does_not_move(make: Callable[[], Any]) -> None:
    """The same number at every step is no noise of any size: the sensor is frozen, and there is
    no onset in it. Beside it the other channel is what it was."""
    scene = irregular(30)
    z = scene.simulated(1, 2)[0]
    z[:, 0] = np.where(np.isnan(z[:, 0]), np.nan, 0.5)
    assert_undetectable(make().run(scene.record(z)))
    other = sf.OnsetDetector(sf.Profile.step(), "b").run(scene.record(z))
    assert other.status != "undetectable"


def test_a_step_at_the_start_beside_a_level_that_nobody_knows() -> None:
    """That onset alone has no ratio; with every digit of the level known it has one."""
    found: Any = sf.OnsetDetector(sf.Profile.step()).run(constant(1e18))
    assert np.isnan(found.ratio).tolist() == [True] + [False] * 9
    assert np.isnan(found.amplitudes).tolist() == [True] + [False] * 9
    assert found.detectability[0] < 1e-12
    assert found.status in ("detected", "not detected")
    assert found.onset != 0.0
    known = sf.OnsetDetector(sf.Profile.step()).run(constant(0.0))
    np.testing.assert_allclose(known.detectability, 1.0)
    assert np.isfinite(known.ratio).all()


def test_faults_that_the_model_makes_itself() -> None:
    """A level that wanders by 1e10 noises a step hides every step in it; a speed and position that
    nobody knows hide the only ramp that two measurements could show."""
    hidden = sf.OnsetDetector(sf.Profile.step()).run(constant(1e20, Q=1e20))
    assert_undetectable(hidden)
    assert np.isnan(hidden.ratio).all()
    scene = particle(2)
    system = system_of(
        scene.plant.A, scene.plant.H, 0 * np.eye(2), scene.plant.R, [0.0, 0.0], 1e18 * np.eye(2)
    )
    assert_undetectable(
        sf.OnsetDetector(sf.Profile.ramp()).run(sf.ForwardRecord(system, [[1.0], [2.5]]))
    )


def test_a_sine_that_the_model_makes_itself() -> None:
    """An oscillator of unknown amplitude and phase, without noise: at its own frequency nothing can
    be said, beside it everything."""
    angle = 2 * np.pi * 0.1
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    system = system_of(turn, [[1.0, 0.0]], 0 * np.eye(2), [[1.0]], [0, 0], 1e12 * np.eye(2))
    z = np.random.default_rng(2).normal(size=(50, 1))
    record = sf.ForwardRecord(system, z)
    found: Any = sf.SpectrumDetector(frequencies=[0.1, 0.3]).run(record)
    assert np.isnan(found.ratio).tolist() == [True, False]
    assert found.best_frequency == 0.3
    assert_undetectable(sf.SpectrumDetector(frequencies=[0.1]).run(record))


def test_states_that_are_not_observed_do_not_matter() -> None:
    """A second state that no measurement ever depends on, as unknown as it may be."""
    one = np.eye(1)
    z = np.random.default_rng(3).normal(size=(30, 1))
    alone = system_of(one, one, 0.1 * one, one, [0.0], one)
    beside = system_of(
        np.eye(2), [[1.0, 0.0]], np.diag([0.1, 7.0]), one, [0.0, 0.0], np.diag([1.0, 1e12])
    )
    detector = sf.OnsetDetector(sf.Profile.ramp())
    known = detector.run(sf.ForwardRecord(alone, z))
    found: Any = detector.run(sf.ForwardRecord(beside, z))
    np.testing.assert_allclose(found.ratio[:-1], known.ratio[:-1], rtol=1e-9, atol=1e-11)
    assert np.isnan(found.ratio[-1])
    assert found.onset == known.onset


def test_what_is_not_observed_at_all_hides_nothing_and_shows_nothing() -> None:
    """H = 0: the channel is nothing but its noise, and a fault in it is all information."""
    system = system_of(np.eye(1), [[0.0]], np.eye(1), np.eye(1), [0.0], np.eye(1))
    z = np.random.default_rng(3).normal(size=(30, 1))
    found: Any = sf.OnsetDetector(sf.Profile.step()).run(sf.ForwardRecord(system, z))
    np.testing.assert_allclose(found.detectability, 1.0)
    tail = np.array([z[m:].sum() ** 2 / (30 - m) for m in range(30)])
    np.testing.assert_allclose(found.ratio, tail, rtol=1e-10)


def test_many_runs_of_an_undetectable_fault() -> None:
    """Scalars are None for all of them, as for one: the schedule decides."""
    scene = particle(1)
    record = sf.ForwardRecord(scene.system, [[[1.0]], [[2.0]], [[3.0]]])
    found: Any = sf.OnsetDetector(sf.Profile.ramp()).run(record)
    assert found.onset is None
    assert found.p_value is None
    assert not np.any(found.detected)
    assert np.all(np.asarray(found.status) == "undetectable")


def test_no_threshold_where_nothing_can_be_found() -> None:
    assert sf.OnsetDetector(sf.Profile.ramp()).threshold(window(1)) is None
    assert sf.SpectrumDetector().threshold(window(1)) is None
