"""Checks of arguments: the value in the form that the engine takes, or an error that names it."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from surefix import _core
from surefix.errors import ConfigError, ShapeError

FloatArray = npt.NDArray[np.float64]
AnyArray = TypeVar("AnyArray", bound=npt.NDArray[Any])
T = TypeVar("T")

NANOSECONDS = 1e9


def number(name: str, value: Any) -> float:
    """A finite float; a text that reads like one is none."""
    try:
        if isinstance(value, (str, bytes)):
            raise TypeError
        result = float(value)
    except (TypeError, ValueError, OverflowError):
        raise ConfigError(f"{name}: expected a number, got {value!r}") from None
    if not math.isfinite(result):
        raise ConfigError(f"{name}: expected a finite number, got {result}")
    return result


def not_negative(name: str, value: Any) -> float:
    """A finite float ≥ 0."""
    result = number(name, value)
    if result < 0:
        raise ConfigError(f"{name}: expected a number >= 0, got {result}")
    return result


def positive(name: str, value: Any) -> float:
    """A finite float > 0."""
    result = number(name, value)
    if result <= 0:
        raise ConfigError(f"{name}: expected a number > 0, got {result}")
    return result


def deviation(name: str, value: Any) -> float:
    """A float > 0 whose square, a variance, keeps all its digits."""
    result = positive(name, value)
    if not sys.float_info.min <= result * result < math.inf:
        raise ConfigError(f"{name}: expected a number from 1.5e-154 to 1.3e154, got {result}")
    return result


def whole(name: str, value: Any, smallest: int, largest: int) -> int:
    """An integer from `smallest` to `largest`."""
    if (
        isinstance(value, (bool, np.bool_))
        or not isinstance(value, (int, np.integer))
        or not smallest <= value <= largest
    ):
        raise ConfigError(
            f"{name}: expected a whole number from {smallest} to {largest}, got {value!r}"
        )
    return int(value)


def one_of(name: str, value: Any, known: Sequence[str]) -> str:
    """One of some words."""
    if not isinstance(value, str) or value not in known:
        raise ConfigError(f"{name}: expected one of {', '.join(known)}, got {value!r}")
    return value


def instance(name: str, value: Any, kind: type[T]) -> T:
    """An object of one kind."""
    if not isinstance(value, kind):
        raise ConfigError(f"{name}: expected a {kind.__name__}, got {value!r}")
    return value


def tuple_of(
    name: str, values: Any, kind: type[T] | tuple[type[T], ...], what: str
) -> tuple[T, ...]:
    """A tuple of objects of one kind, or of one of several; ``what`` are they called?"""
    try:
        given = tuple(values)
    except TypeError:
        raise ConfigError(f"{name}: expected a sequence of {what}, got {values!r}") from None
    for value in given:
        if not isinstance(value, kind):
            raise ConfigError(f"{name}: expected {what}, got {value!r}")
    return given


def time_constant(name: str, value: Any) -> float:
    """A float > 0, infinity allowed."""
    return math.inf if value == math.inf else positive(name, value)


def probability(name: str, value: Any, smallest: float = 1e-15) -> float:
    """A float between `smallest` and 1, 1 excluded."""
    result = number(name, value)
    if not smallest <= result < 1:
        raise ConfigError(f"{name}: expected a probability in [{smallest:g}, 1), got {result}")
    return result


def nanoseconds(name: str, value: Any, largest: float = _core.MAX_SECONDS) -> int:
    """Seconds as the engine's integer nanoseconds."""
    result = number(name, value)
    if abs(result) > largest:
        raise ConfigError(f"{name}: expected at most {largest:g} s in magnitude, got {result}")
    return to_nanoseconds(result)


def to_nanoseconds(value: float) -> int:
    """Nearest nanosecond to a time in range, as the engine rounds: the fraction apart, because the
    product of a Unix time with 1e9 loses 128 ns."""
    whole = math.trunc(value)
    return whole * 10**9 + round((value - whole) * NANOSECONDS)


def nanoseconds_array(name: str, value: Any) -> npt.NDArray[np.int64]:
    """Many times (any,) [s] as the engine's integer nanoseconds."""
    result = array(name, value, (None,))
    beyond = np.flatnonzero(np.abs(result) > _core.MAX_SECONDS)
    if len(beyond):
        raise ConfigError(
            f"{name}: expected at most {_core.MAX_SECONDS:g} s in magnitude, "
            f"got {result[beyond[0]]} at {beyond[0]}"
        )
    return to_nanoseconds_array(result)


def to_nanoseconds_array(values: FloatArray) -> npt.NDArray[np.int64]:
    """As `to_nanoseconds`, for many."""
    whole = np.trunc(values)
    fraction: npt.NDArray[np.int64] = np.rint((values - whole) * NANOSECONDS).astype(np.int64)
    return whole.astype(np.int64) * 10**9 + fraction


def floats(name: str, value: Any, expected: str = "numbers") -> FloatArray:
    """A float64 array of any shape, not always a copy; NaN where a numpy mask hides a number. Texts
    that read like numbers are none, and neither are rows of different lengths."""
    try:
        given = value if isinstance(value, np.ma.MaskedArray) else np.asarray(value)
        kind = given.dtype.kind
        if kind not in "biufO" or (
            kind == "O" and any(isinstance(v, (str, bytes)) for v in given.flat)
        ):
            raise TypeError
        if isinstance(given, np.ma.MaskedArray):
            given = np.ma.filled(given.astype(np.float64), np.nan)
        return np.asarray(given, dtype=np.float64, order="C")
    except (TypeError, ValueError, OverflowError):
        raise ShapeError(f"{name}: expected {expected}, got {value!r}") from None


def array(name: str, value: Any, *shapes: tuple[int | None, ...]) -> FloatArray:
    """A finite float64 array of one of `shapes`, where None stands for any length; a read-only
    copy, so that nothing that is done to the argument later changes what was checked."""
    expected = " or ".join(_text(shape) for shape in shapes)
    result = np.array(floats(name, value, f"numbers of shape {expected}"), order="C")
    if not any(_fits(result.shape, shape) for shape in shapes):
        raise ShapeError(f"{name}: expected shape {expected}, got {result.shape}")
    if not np.isfinite(result).all():
        where = tuple(int(i) for i in np.argwhere(~np.isfinite(result))[0])
        raise ConfigError(f"{name}: expected finite numbers, got {result[where]} at {where}")
    return read_only(result)


def per_step(matrices: FloatArray) -> FloatArray:
    """(k, rows, columns) of a stack, k = 1 of one matrix for all steps."""
    return matrices if matrices.ndim == 3 else matrices[None]


def one_length(what: str, lengths: Mapping[str, int | None]) -> int | None:
    """The number of steps that all those are for which are not for any number, None."""
    known = {name: steps for name, steps in lengths.items() if steps is not None}
    if len(set(known.values())) > 1:
        text = ", ".join(f"{name} for {steps}" for name, steps in known.items())
        raise ShapeError(f"{what}: expected one number of steps, got {text}")
    return next(iter(known.values()), None)


def read_only(array: AnyArray) -> AnyArray:
    """`array`, which from now on cannot be written to."""
    array.flags.writeable = False
    return array


def covariance(name: str, value: Any, size: int | None, *, definite: bool = False) -> FloatArray:
    """A symmetric positive semidefinite (or definite) matrix, exactly symmetric on return."""
    result = array(name, value, (size, size))
    if result.shape[0] != result.shape[1]:
        raise ShapeError(f"{name}: expected a square matrix, got {result.shape}")
    scale = np.sqrt(np.outer(np.abs(np.diag(result)), np.abs(np.diag(result))))
    if (np.abs(result - result.T) > 1e-9 * scale + np.finfo(float).tiny).any():
        raise ConfigError(f"{name}: expected a symmetric matrix, got {result.tolist()}")
    result = read_only((result + result.T) / 2)
    if (np.diag(result) < 0).any() or not _is_semidefinite(result, definite):
        kind = "definite" if definite else "semidefinite"
        raise ConfigError(f"{name}: expected a positive {kind} matrix, got {result.tolist()}")
    return result


def covariances(name: str, value: Any, size: int, *, definite: bool = False) -> FloatArray:
    """As `covariance`, of one matrix (size, size) or of a stack (any, size, size)."""
    result = array(name, value, (size, size), (None, size, size))
    if result.ndim == 2:
        return covariance(name, result, size, definite=definite)
    deviation = np.sqrt(np.abs(np.diagonal(result, axis1=1, axis2=2)))
    scale = deviation[:, :, None] * deviation[:, None, :]
    other = result.transpose(0, 2, 1)
    bad = (np.abs(result - other) > 1e-9 * scale + np.finfo(float).tiny).any(axis=(1, 2))
    with np.errstate(invalid="ignore", divide="ignore"):
        correlation = np.where(scale > 0, (result + other) / 2 / scale, 0.0)
    smallest = np.linalg.eigvalsh(correlation)[:, 0] if len(result) else np.zeros(0)
    bad |= smallest < 1e-12 * size  # close to the edge: looked at one by one
    for k in np.flatnonzero(bad):
        covariance(f"{name}[{k}]", result[k], size, definite=definite)
    return read_only((result + other) / 2)


def _is_semidefinite(matrix: FloatArray, definite: bool) -> bool:
    """By the eigenvalues of the matrix scaled to a unit diagonal, so that units do not matter."""
    deviation = np.sqrt(np.diag(matrix))
    if definite and not (deviation > 0).all():
        return False
    if (np.abs(matrix[deviation == 0]) > 0).any():
        return False
    scale = np.where(deviation > 0, deviation, 1.0)
    smallest = np.linalg.eigvalsh(matrix / np.outer(scale, scale)).min(initial=1.0)
    return bool(smallest > 0 if definite else smallest >= -1e-12 * len(matrix))


def _fits(shape: tuple[int, ...], wanted: tuple[int | None, ...]) -> bool:
    return len(shape) == len(wanted) and all(
        want is None or want == got for want, got in zip(wanted, shape, strict=True)
    )


def _text(shape: tuple[int | None, ...]) -> str:
    lengths = ", ".join("any" if length is None else str(length) for length in shape)
    return f"({lengths},)" if len(shape) == 1 else f"({lengths})"
