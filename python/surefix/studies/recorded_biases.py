"""Biases put on the satellites of a recording, one at a time: what the track monitor detects and
excludes, against what it predicts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from surefix.core.checks import FloatArray
from surefix.raim.chi_squared import noncentrality, power
from surefix.raim.monitor import TrackRaim
from surefix.raim.pseudoranges import Pseudoranges
from surefix.raim.result import RaimResult


@dataclass(frozen=True)
class Shows:
    """How a bias on a row would show, (N,) each, NaN where the row is not used. ``root`` [1/m]: √λ
    of a bias of 1 m; ``one_by_sigma`` [1/m]. ``residual``: whitened, of the recording as it is;
    ``statistic``, ``degrees``, ``threshold`` of its epoch."""

    root: FloatArray
    one_by_sigma: FloatArray
    residual: FloatArray
    statistic: FloatArray
    degrees: FloatArray
    threshold: FloatArray
    false_alarm: float

    def predicted(self, bias: FloatArray) -> FloatArray:
        """Power against ``bias`` (N,) [m], noise white and without a mean."""
        return np.asarray(power((bias * self.root) ** 2, self.degrees, self.false_alarm))

    def expected(self, bias: FloatArray) -> FloatArray:
        """Λ of ``bias`` (N,) [m] on top of the residuals that the epoch has."""
        shown = bias * self.root
        across = bias * self.residual * self.one_by_sigma
        return np.asarray(self.statistic + 2 * across + shown**2)

    def detectable(self, missed: float) -> FloatArray:
        """The bias [m] of each row that is missed with that probability, by the same model."""
        wanted = noncentrality(missed, self.degrees, self.false_alarm)
        return np.asarray(np.sqrt(wanted) / self.root)


def shows(monitor: TrackRaim, data: Pseudoranges) -> tuple[RaimResult, Shows]:
    """Of a recording without faults; ``monitor`` excludes nothing."""
    result = monitor.run(data)
    epoch = data.epoch
    used = np.isfinite(data.sigma) & np.isfinite(data.pseudorange) & (result.status == "ok")[epoch]
    with np.errstate(invalid="ignore"):
        one_by_sigma = np.where(used, 1 / data.sigma, 0.0)
    along = np.where(used, result.along[epoch], 0.0)
    to = data.position - monitor.track.position(along)
    slope = -(to * monitor.track.tangent(along)).sum(axis=1) / np.linalg.norm(to, axis=1)
    group = epoch * len(data.system_names) + data.system_code
    weight = np.bincount(group, one_by_sigma**2)[group]
    mean = np.bincount(group, one_by_sigma**2 * slope)[group] / np.where(used, weight, 1.0)
    g = (slope - mean) * one_by_sigma
    total = np.bincount(epoch, g**2)[epoch]
    with np.errstate(invalid="ignore", divide="ignore"):
        hat = g**2 / total + one_by_sigma**2 / weight
    root = np.where(used, one_by_sigma * np.sqrt(np.clip(1 - hat, 0, None)), np.nan)
    return result, Shows(
        root, one_by_sigma, result.residual, result.statistic[epoch],
        result.degrees[epoch].astype(float), result.threshold[epoch], monitor.false_alarm,
    )  # fmt: skip


@dataclass(frozen=True)
class Injected:
    """Of every row that was biased, one after the other, (M,) each: ``bias`` [m], ``predicted``
    power, ``expected`` (Λ of the epoch's own residuals exceeds the threshold), ``alarm``;
    ``error_before``: of l̂ with all satellites, ``error``: after exclusions, NaN unless the position
    may be used, with its ``protection``; ``excluded`` how many, ``right``: that satellite alone."""

    bias: FloatArray
    predicted: FloatArray
    expected: npt.NDArray[np.bool_]
    alarm: npt.NDArray[np.bool_]
    error_before: FloatArray
    error: FloatArray
    protection: FloatArray
    excluded: npt.NDArray[np.int64]
    right: npt.NDArray[np.bool_]


def inject(
    monitor: TrackRaim, data: Pseudoranges, known: Shows, bias: npt.ArrayLike, truth: float
) -> Injected:
    """``bias`` (N,) or one number [m] on all rows of one satellite after the other; ``truth`` [m]:
    the mileage. Rows whose bias is not finite are left alone and out."""
    sizes = np.broadcast_to(np.asarray(bias, dtype=np.float64), data.time.shape)
    plain = TrackRaim(
        monitor.track, length=monitor.length, false_alarm=monitor.false_alarm, max_excluded=0,
        earth_rotation=monitor.earth_rotation,
    )  # fmt: skip
    predicted, expected = known.predicted(sizes), known.expected(sizes) >= known.threshold
    parts: list[dict[str, Any]] = []
    for name in np.unique(data.satellite):
        on = (data.satellite == name) & np.isfinite(known.root) & np.isfinite(sizes)
        if not on.any():
            continue
        rows, epochs = np.flatnonzero(on), data.epoch[on]
        biased = data.with_bias(np.where(on, sizes, 0.0))
        before, after = plain.run(biased), monitor.run(biased)
        out = np.bincount(data.epoch, after.excluded, data.epochs).astype(int)[epochs]
        parts.append({
            "bias": sizes[rows], "predicted": predicted[rows], "expected": expected[rows],
            "alarm": after.alarm[epochs], "error_before": before.along[epochs] - truth,
            "error": np.where(after.usable, after.along, np.nan)[epochs] - truth,
            "protection": after.protection[epochs], "excluded": out,
            "right": (out == 1) & after.excluded[rows],
        })  # fmt: skip
    return Injected(**{key: np.concatenate([part[key] for part in parts]) for key in parts[0]})


def summary(found: Injected) -> dict[str, float | int]:
    """Shares and errors of what ``inject`` gave."""
    error, before = np.abs(found.error), np.abs(found.error_before)
    usable, alarmed = np.isfinite(error), found.alarm
    return {
        "injected": len(found.bias), "detected": float(alarmed.mean()),
        "predicted": float(found.predicted.mean()), "expected": float(found.expected.mean()),
        "as_expected": float(np.mean(alarmed == found.expected)),
        "right": float(found.right[alarmed].mean()) if alarmed.any() else float("nan"),
        "usable": float(usable.mean()), "unnoticed": float(np.mean(usable & ~alarmed)),
        "error_before": float(np.nanmedian(before)),
        "worst_before": float(np.nanmax(before)), "error": float(np.median(error[usable])),
        "worst": float(error[usable].max()),
        "protection": float(np.median(found.protection[usable])),
        "misleading": int(np.sum(error[usable] > found.protection[usable])),
    }  # fmt: skip
