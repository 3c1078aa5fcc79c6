"""Contenders timed in turn, so that neighbours of the machine disturb all of them alike."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Work = Callable[[], tuple[Floats, ...]]


def timed(contenders: dict[str, tuple[Work, int]], repeats: int) -> dict[str, dict[str, float]]:
    """(work, size) of each: ns for each of its ``size``, and ratios to the first, whose answers the
    others must have to 1e-9, relative to the largest number in each."""
    (base, (reference, base_size)), *_ = contenders.items()
    truth = reference()
    for name, (work, _) in contenders.items():
        error = max(
            float(np.abs(own - known).max() / max(1.0, np.abs(known).max()))
            for own, known in zip(work(), truth, strict=True)
        )
        if not error < 1e-9:
            raise SystemExit(f"{name}: differs from {base} by {error:.1e}")
    ns: dict[str, list[float]] = {name: [] for name in contenders}
    ratio: dict[str, list[float]] = {name: [] for name in contenders}
    for _ in range(repeats):
        for name, (work, size) in contenders.items():
            first = seconds(reference) / base_size
            own = seconds(work) / size
            ns[name].append(own * 1e9)
            ratio[name].append(own / first)
    return {
        name: {
            "ns": float(np.median(ns[name])),
            "fastest_ns": min(ns[name]),
            "ratio": float(np.median(ratio[name])),
        }
        for name in contenders
    }


def seconds(work: Callable[[], object]) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start
