"""Where the modes of a measurement meet the fault modes of a sensor: one sensor that measures in
step with the estimates, faults drawn anew. The robust filter that carries one Gaussian and the
one-step filter (which the IMM equals then) have one posterior."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

import surefix as sf

STEPS, PERIOD, SIGMA, C = 60, 0.5, 0.8, 25.0
NOISY, INTERRUPTED = 0.15, 0.1
FAULTS = (
    sf.Noisy(factor=C, probability=NOISY),
    sf.Interrupted(factor=1.0, probability=INTERRUPTED),
)
MODES = {(1.0, 1.0): 1 - NOISY - INTERRUPTED, (1.0, C): NOISY, (0.0, 1.0): INTERRUPTED}

SCALAR = sf.DiscreteModel([[-0.8]], [[1.0]], PERIOD), [0.3], [[0.5]]
SPEED = sf.ConstantAcceleration(jerk=0.4), [1.0, 0.1], np.diag([2.0, 0.3])


def measurements(seed: int) -> npt.NDArray[np.float64]:
    """Noise, gross outliers, and zeros: whatever it is, both must say the same."""
    rng = np.random.default_rng(seed)
    z = rng.normal(0.0, 2.0, STEPS)
    z[rng.random(STEPS) < 0.1] *= 30.0
    return z


@pytest.mark.parametrize("scene", [SCALAR, SPEED], ids=["scalar", "speed"])
@pytest.mark.parametrize("kind", [sf.OneStepFilter, sf.IMMFilter])
@pytest.mark.parametrize("seed", range(3))
def test_both_filters_have_one_posterior(
    scene: tuple[sf.Model, npt.ArrayLike, npt.ArrayLike],
    kind: type[sf.OneStepFilter] | type[sf.IMMFilter],
    seed: int,
) -> None:
    model, x0, P0 = scene
    times = PERIOD * np.arange(STEPS)
    z = measurements(seed)
    row = np.eye(1, model.size)
    system = sf.LinearSystem.from_model(model, times, row, [[SIGMA**2]], x0, P0)
    switching = kind(system, sf.ModeChain.joint_draws(MODES)).run(z[:, None])

    sensor = sf.Sensor("radar", SIGMA, observes=tuple(row[0]), faults=FAULTS)
    robust = sf.RobustFilter(
        model, [sensor], x0, P0, prior="constant", carry="one", cut=1e-15, risk=1e-9
    )
    result = robust.run(sf.Log(times, ["radar"] * STEPS, z), times=times)

    deviation = np.sqrt(np.diagonal(switching.P, axis1=1, axis2=2))
    assert switching.mode_probability is not None
    assert (np.abs(result.x - switching.x) <= 1e-10 * deviation).all()
    np.testing.assert_allclose(result.P, switching.P, rtol=1e-10, atol=1e-14)
    np.testing.assert_allclose(
        result.mode_probability[:, 0, :3], switching.mode_probability, atol=1e-11
    )
    assert result.log_likelihood == pytest.approx(switching.log_likelihood, rel=1e-11)
    assert 0.1 < result.fault_probability.mean() < 0.9
