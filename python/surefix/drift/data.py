"""Measurements and inputs of a linear system in the form that the engine takes."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from surefix.core import checks
from surefix.core.checks import FloatArray
from surefix.core.linear_system import LinearSystem
from surefix.errors import ConfigError, ShapeError


def measurements(
    system: LinearSystem,
    z: npt.ArrayLike,
    times: npt.ArrayLike | None,
    inputs: npt.ArrayLike | None,
) -> tuple[FloatArray, FloatArray | None, FloatArray, bool]:
    """(runs, steps, m), inputs, times, and whether z was of one run without the axis of runs."""
    m, steps = system.measured, system.steps
    expected = f"({'steps' if steps is None else steps}, {m})"
    values = checks.floats("z", z, f"numbers of shape {expected}")
    if values.ndim == 1 and m == 1:
        values = values[:, None]
    shape = values.shape
    if len(shape) not in (2, 3) or shape[-1] != m or 0 in shape:
        raise ShapeError(f"z: expected shape {expected}, with runs in front or not, got {shape}")
    T = shape[-2]
    if steps is not None and steps != T:
        raise ShapeError(f"z: expected {steps} steps as the system has, got shape {shape}")
    alone = len(shape) == 2
    values = values[None] if alone else values
    if np.isinf(values).any():
        where = tuple(int(i) for i in np.argwhere(np.isinf(values))[0][alone:])
        raise ConfigError(
            f"z: expected finite numbers, or NaN for missing ones, got inf at {where}"
        )
    missing = np.isnan(values)
    if (missing != missing[:1]).any():
        run, *at = (int(i) for i in np.argwhere(missing != missing[:1])[0])
        raise ConfigError(f"z: expected one pattern of NaN in all runs, run {run} differs at {at}")
    return values, _inputs(inputs, T, system.size), _times(times, T), alone


def _inputs(inputs: npt.ArrayLike | None, T: int, n: int) -> FloatArray | None:
    return None if inputs is None else checks.array("inputs", inputs, (T - 1, n))


def _times(times: npt.ArrayLike | None, T: int) -> FloatArray:
    if times is None:
        return np.arange(T, dtype=np.float64)
    known = checks.array("times", times, (T,))
    backwards = np.flatnonzero(~(np.diff(known) > 0))
    if len(backwards):
        k = int(backwards[0])
        raise ConfigError(f"times: expected ascending ones, got {known[k + 1]} after {known[k]}")
    return known
