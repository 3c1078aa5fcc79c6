"""How often limits miss the truth, over many runs."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from surefix.core.checks import FloatArray
from surefix.intervals import CONFIDENCE, share_interval


class Limited(Protocol):
    """A result with limits."""

    @property
    def time(self) -> FloatArray: ...
    @property
    def estimate(self) -> FloatArray: ...
    @property
    def lower(self) -> FloatArray: ...
    @property
    def upper(self) -> FloatArray: ...


def outside(result: Limited, truth: Callable[[FloatArray], FloatArray]) -> npt.NDArray[np.bool_]:
    """Where the truth is outside the limits (T,)."""
    speed = truth(result.time)
    return ~((result.lower <= speed) & (speed <= result.upper))


def within(result: Limited, window: tuple[float, float]) -> npt.NDArray[np.bool_]:
    """Estimates after ``window[0]`` and up to ``window[1]`` [s] (T,)."""
    return (result.time > window[0] + 1e-9) & (result.time <= window[1] + 1e-9)


def judge(
    result: Limited, truth: Callable[[FloatArray], FloatArray], window: tuple[float, float]
) -> dict[str, Any]:
    """One run, by its estimates ``within`` a window."""
    shown = within(result, window)
    width = (result.upper - result.lower)[shown]
    return {
        "outside": outside(result, truth)[shown],
        "width": width[np.isfinite(width)],
        "error": float(np.abs(result.estimate - truth(result.time))[shown].max()),
        "discarded": float(getattr(result, "discarded_mass", np.zeros(1)).max()),
    }


def summary(runs: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """All runs of one configuration.

    ``misleading_fraction``: share of the estimates whose limits miss the truth;
    ``misleading_runs``: share of runs with any, below ``misleading_runs_at_most`` with 95 %
    confidence (estimates of one run are not independent, runs are); ``available_fraction``: share
    with two limits, over which ``mean_width`` and ``max_width`` go (null if none).
    """
    missed = np.concatenate([run["outside"] for run in runs])
    width = np.concatenate([run["width"] for run in runs])
    bad = sum(bool(run["outside"].any()) for run in runs)
    return {
        "seeds": len(runs),
        "misleading_fraction": float(missed.mean()),
        "misleading_runs": bad / len(runs),
        "misleading_runs_at_most": upper_confidence(bad, len(runs)),
        "mean_width": float(width.mean()) if len(width) else math.nan,
        "max_width": float(width.max()) if len(width) else math.nan,
        "available_fraction": len(width) / len(missed),
        "max_error": max(run["error"] for run in runs),
        "max_discarded_mass": max(run["discarded"] for run in runs),
    }


def upper_confidence(found: int, runs: int, confidence: float = CONFIDENCE) -> float:
    """The largest share p for which ``found`` or fewer of ``runs`` still have the probability
    1 − ``confidence``: the upper end of an interval that leaves as much on either side."""
    return share_interval(found, runs, 2 * confidence - 1)[1]
