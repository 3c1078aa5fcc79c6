"""Measurements in the form that the engine takes, and its answers as results."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any, Protocol, TypeVar

import numpy as np
import numpy.typing as npt

from surefix.core import checks
from surefix.core.checks import FloatArray
from surefix.core.linear_system import LinearSystem
from surefix.errors import ConfigError, NumericalError, ShapeError
from surefix.switching.mode_chain import ModeChain
from surefix.switching.result import SwitchingResult

T = TypeVar("T")

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


def one_length(systems: Sequence[LinearSystem], chain: ModeChain | None) -> int | None:
    """The number of steps that they are for, None: any. ShapeError if they differ."""
    one = len(systems) == 1
    lengths = {"system" if one else f"systems[{i}]": s.steps for i, s in enumerate(systems)}
    lengths["chain"] = None if chain is None else chain.steps
    return checks.one_length("system, chain", lengths)


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
    chain: ModeChain | None = None,
    likelihood: bool = True,
    states: tuple[str, ...] | None = None,
    trouble: str = (
        "system, z: at {where} the estimate overflows, or no mode has a density, or z is so far "
        "from all modes that doubles tell neither them nor the estimate; z is {z}"
    ),
) -> SwitchingResult:
    """One call of the engine for all series; ``chain``: whose modes ``modes`` are; ``trouble``:
    what to say where there is no estimate."""
    values, alone = _measurements(z, missing, measured, steps)
    runs, T = values.shape[:2]
    known = None if modes is None else _modes(modes, alone, (runs, T), chain)
    workers = (
        max(1, min(os.cpu_count() or 1, runs * T // PER_THREAD))
        if threads is None
        else checks.whole("threads", threads, 1, 1024)
    )
    x, P, mode, log_likelihood, status, run, step = engine.run(values, known, n, M, workers)
    if status != "ok":
        where = (step,) if alone else (run, step)
        if status == "not_finite":
            found = "-infinity" if -np.inf in values[run, step] else "infinity"
            raise ConfigError(
                f"z: expected finite numbers, or NaN for missing ones, got {found} at {where}"
            )
        raise NumericalError(trouble.format(where=where, z=values[run, step]))
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
    expected = f"({'steps' if steps is None else steps}, {measured})"
    values = checks.floats("z", z, f"numbers of shape {expected}")
    shape = values.shape
    if len(shape) not in (2, 3) or shape[-1] != measured or 0 in shape:
        raise ShapeError(f"z: expected shape {expected}, with runs in front or not, got {shape}")
    if steps is not None and shape[-2] != steps:
        raise ShapeError(f"z: expected {steps} steps as system and chain have, got shape {shape}")
    if missing is not None:
        values = np.where(_of_kind("missing", missing, "b", "booleans", shape), np.nan, values)
    return (values[None], True) if len(shape) == 2 else (values, False)


def _modes(
    modes: npt.ArrayLike, alone: bool, shape: tuple[int, int], chain: ModeChain | None
) -> npt.NDArray[np.int32]:
    """(runs, T)."""
    if chain is None:
        raise ConfigError("modes: expected none from a genie without a chain")
    shapes = [shape[1:]] if alone else [shape[1:], shape]
    given = _of_kind("modes", modes, "iu", "whole numbers", *shapes)
    if not (given.min() >= 0 and given.max() < chain.size):
        raise ConfigError(
            f"modes: expected numbers from 0 to {chain.size - 1}, "
            f"got {given.min()} to {given.max()}"
        )
    lumped = [j for j, branches in enumerate(chain.branches) if len(branches) > 1]
    if np.isin(given, lumped).any():
        raise ConfigError(f"modes: expected modes with one delta, {lumped} are lumped")
    return np.ascontiguousarray(np.broadcast_to(given, shape), dtype=np.int32)


def _of_kind(
    name: str, value: npt.ArrayLike, kinds: str, what: str, *shapes: tuple[int, ...]
) -> npt.NDArray[Any]:
    """An array of one of some shapes, its dtype of one of ``kinds``, in words ``what``."""
    expected = f"{what} of shape {' or '.join(map(str, shapes))}"
    try:
        given = np.asarray(value)
    except ValueError:
        raise ShapeError(f"{name}: expected {expected}, got {value!r}") from None
    if given.dtype.kind not in kinds or given.shape not in shapes:
        raise ShapeError(f"{name}: expected {expected}, got {given.dtype} of {given.shape}")
    return given


def made(engine: T | str, what: str) -> T:
    """The engine, or an error with what it refused."""
    if isinstance(engine, str):
        raise ConfigError(f"{what}: refused by the engine: {engine}")
    return engine
