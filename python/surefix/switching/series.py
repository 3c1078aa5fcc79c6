"""Measurements in the form that the engine takes, and its answers as results."""

from __future__ import annotations

import os
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from surefix import _core
from surefix.core import checks
from surefix.core.checks import FloatArray
from surefix.errors import ConfigError, NumericalError, ShapeError
from surefix.switching.linear_system import LinearSystem
from surefix.switching.mode_chain import ModeChain
from surefix.switching.result import SwitchingResult

PER_THREAD = 50_000  # steps of series that are worth a thread


class Engine(Protocol):
    def run(
        self,
        z: FloatArray,
        modes: npt.NDArray[np.int32] | None,
        n: int,
        M: int,
        threads: int,
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, str, int, int]: ...


def one_length(systems: list[LinearSystem], chain: ModeChain | None) -> int | None:
    """The number of steps that matrices and transitions are for; ShapeError if they differ."""
    lengths = {f"system {i}": s.steps for i, s in enumerate(systems) if s.steps is not None}
    if chain is not None and chain.steps is not None:
        lengths["chain"] = chain.steps
    if len(set(lengths.values())) > 1:
        text = ", ".join(f"{name} for {steps}" for name, steps in lengths.items())
        raise ShapeError(f"system, chain: expected one number of steps, got {text}")
    return next(iter(lengths.values()), None)


def run(
    engine: Engine,
    z: npt.ArrayLike,
    missing: npt.ArrayLike | None,
    threads: int | None,
    *,
    measured: int,
    steps: int | None,
    n: int,
    M: int,
    modes: npt.ArrayLike | None = None,
    count: int = 0,
    likelihood: bool = True,
    states: tuple[str, ...] | None = None,
) -> SwitchingResult:
    """One call of the engine for all series; ``count``: modes that ``modes`` may name."""
    values, alone = _measurements(z, missing, measured, steps)
    runs, T = values.shape[:2]
    known = None if modes is None else _modes(modes, alone, (runs, T), count)
    workers = (
        max(1, min(os.cpu_count() or 1, runs * T // PER_THREAD))
        if threads is None
        else checks.whole("threads", threads, 1, 1024)
    )
    x, P, mode, log_likelihood, status, run, step = engine.run(values, known, n, M, workers)
    if status != "ok":
        where = (step,) if alone else (run, step)
        if status == "not_finite":
            raise ConfigError(
                f"z: expected finite numbers, or NaN for missing ones, got infinity at {where}"
            )
        raise NumericalError(
            f"z: at {where} the estimate overflows, or no mode has a density at {values[run, step]}"
        )
    if alone:
        x, P, mode = x[0], P[0], mode[0]
    total: float | FloatArray = float(log_likelihood[0]) if alone else log_likelihood
    return SwitchingResult(
        x, P, mode if M else None, total if likelihood else None, states
    )  # fmt: skip


def _measurements(
    z: npt.ArrayLike, missing: npt.ArrayLike | None, measured: int, steps: int | None
) -> tuple[FloatArray, bool]:
    """(runs, T, m), and whether it was one series without the axis of runs."""
    try:
        values = np.ascontiguousarray(z, dtype=np.float64)
    except (TypeError, ValueError):
        raise ShapeError(f"z: expected numbers (steps, {measured}), got {z!r}") from None
    shape = values.shape
    expected = f"({'steps' if steps is None else steps}, {measured})"
    if len(shape) not in (2, 3) or shape[-1] != measured or 0 in shape:
        raise ShapeError(
            f"z: expected shape {expected}, with runs in front or not, got {np.shape(z)}"
        )
    if steps is not None and shape[-2] != steps:
        raise ShapeError(f"z: expected {steps} steps as system and chain have, got shape {shape}")
    if missing is not None:
        mask = np.asarray(missing)
        if mask.dtype != np.bool_ or mask.shape != shape:
            raise ShapeError(
                f"missing: expected booleans of shape {shape}, got {mask.dtype} of {mask.shape}"
            )
        values = np.where(mask, np.nan, values)
    return (values[None], True) if len(shape) == 2 else (values, False)


def _modes(
    modes: npt.ArrayLike, alone: bool, shape: tuple[int, int], count: int
) -> npt.NDArray[np.int32]:
    wanted: Any = shape[1:] if alone else shape
    given = np.asarray(modes)
    if given.dtype.kind not in "iu" or given.shape != wanted:
        raise ShapeError(
            f"modes: expected whole numbers of shape {wanted}, got {given.dtype} of {given.shape}"
        )
    if given.size and not (given.min() >= 0 and given.max() < count):
        raise ConfigError(
            f"modes: expected numbers from 0 to {count - 1}, got {given.min()} to {given.max()}"
        )
    return np.ascontiguousarray(given.reshape(shape), dtype=np.int32)


def made(engine: Any, what: str) -> _core.SwitchingEngine:
    """The engine, or an error with what it refused."""
    if isinstance(engine, str):
        raise ConfigError(f"{what}: refused by the engine: {engine}")
    return engine  # type: ignore[no-any-return]
