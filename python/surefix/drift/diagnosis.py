"""Which sensor, which fault: all searches over all channels, and the data repaired."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from surefix.core import checks
from surefix.core.checks import FloatArray
from surefix.core.linear_system import LinearSystem
from surefix.desync.filter import DesyncFilter
from surefix.desync.result import Result
from surefix.drift.data import measurements
from surefix.drift.fault import Fault
from surefix.drift.forward_record import ForwardRecord
from surefix.drift.profile import Profile
from surefix.drift.repair import StateEstimates, repaired_estimates, subtracted
from surefix.drift.searched import Searched, all_detectors, best_of, search_one
from surefix.errors import ConfigError, ShapeError
from surefix.log import Log

Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Fit:
    """How well the model explains the data: 𝓛, and νᵀS⁻¹ν per measurement, 1 in the mean."""

    inconsistency: float
    nis: float
    measurements: int


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """Faults in the order in which they were found, each in what the ones before left; every
    search in the data as they were; the data without the faults, and how well they fit."""

    faults: tuple[Fault, ...]
    searched: tuple[Searched, ...]
    repaired: FloatArray | Log
    before: Fit
    after: Fit
    false_alarm: float
    source: LinearSystem | DesyncFilter
    original: FloatArray | Log
    settings: dict[str, Any]

    @property
    def detected(self) -> bool:
        return bool(self.faults)

    def estimates(
        self, rate: float | None = None, times: npt.ArrayLike | None = None
    ) -> tuple[Result | StateEstimates, Result | StateEstimates]:
        """The filter's estimates from the data as they were, and from the repaired data with the
        faults' uncertainty added to P. Of a log as ``DesyncFilter.run`` gives them."""
        return repaired_estimates(
            self.source, self.original, self.repaired, self.faults, self.settings, rate, times
        )


def diagnose(
    source: LinearSystem | DesyncFilter,
    data: npt.ArrayLike | Log,
    profiles: Sequence[Profile] | None = None,
    channels: Sequence[str] | None = None,
    *,
    spectrum: bool = True,
    frequencies: npt.ArrayLike | None = None,
    ends: bool = False,
    false_alarm: float = 1e-3,
    max_faults: int = 3,
    times: npt.ArrayLike | None = None,
    inputs: npt.ArrayLike | None = None,
    names: Sequence[str] | None = None,
    samples: int = 1024,
    progress: Progress | None = None,
) -> Diagnosis:
    """Searches every channel for every course of fault; subtracts the best; searches again.

    ``source``, ``data``, ``times``, ``inputs`` as of ``ForwardRecord``, one run; ``names`` of the
    channels of a linear system. ``profiles``: by default step and ramp; ``ends``: faults that end,
    too; ``spectrum``: sinusoids, of ``frequencies`` if given. ``channels``: those that may be at
    fault, by default all. ``false_alarm``: of the whole diagnosis, shared out equally. Of what is
    beyond its share, the one with the best score (see ``Fault``) is the fault, ``max_faults`` times
    at most. Faults are found one after the other: where two overlap, the first takes up some of the
    second, and neither's amplitude is to be believed. Raises as ``ForwardRecord`` does.
    """
    alarm = checks.probability("false_alarm", false_alarm)
    most = checks.whole("max_faults", max_faults, 1, 100)
    courses = (Profile.step(), Profile.ramp()) if profiles is None else profiles
    courses = checks.tuple_of("profiles", courses, Profile, "Profiles")
    original, settings = _one_run(source, data, times, inputs, names)
    given = original
    record = ForwardRecord(source, given, **settings)
    suspects = record.channels if channels is None else _names(channels, record.channels)
    detectors = all_detectors(
        suspects, courses, ends=ends, spectrum=spectrum, frequencies=frequencies,
        false_alarm=alarm, samples=samples,
    )  # fmt: skip
    before = _fit(record)
    faults: list[Fault] = []
    first: tuple[Searched, ...] = ()
    for round_ in range(most):
        found = []
        for k, (channel, detector) in enumerate(detectors):
            found.append(search_one(record, channel, detector, len(detectors)))
            if progress is not None:
                progress(round_ * len(detectors) + k + 1, most * len(detectors))
        first = first or tuple(searched for searched, _ in found)
        best = best_of(found)
        if best is None:
            break
        faults.append(best)
        values = best.value(record.time)
        given = subtracted(given, record.channels, best.channel, values)
        record = ForwardRecord(source, given, **settings)
    if progress is not None:
        progress(most * len(detectors), most * len(detectors))
    return Diagnosis(
        tuple(faults), first, given, before, _fit(record), alarm, source, original, settings
    )


def _one_run(
    source: LinearSystem | DesyncFilter,
    data: npt.ArrayLike | Log,
    times: npt.ArrayLike | None,
    inputs: npt.ArrayLike | None,
    names: Sequence[str] | None,
) -> tuple[FloatArray | Log, dict[str, Any]]:
    """The data, (steps, m) of a linear system, and what else a record of them takes."""
    if not isinstance(source, LinearSystem):
        checks.instance("source", source, DesyncFilter)
        for name, value in {"times": times, "inputs": inputs, "names": names}.items():
            if value is not None:
                raise ConfigError(f"{name}: expected none with a filter and a log, got {value!r}")
        return checks.instance("data", data, Log), {}
    if isinstance(data, Log):
        raise ConfigError("data: expected measurements (steps, m) of a LinearSystem, got a Log")
    z, _, _, alone = measurements(source, data, times, inputs)
    if not alone:
        raise ShapeError(f"data: expected one run (steps, m), got shape {z.shape}")
    return z[0], {"times": times, "inputs": inputs, "channels": names}


def _names(channels: Sequence[str], known: Sequence[str]) -> tuple[str, ...]:
    given = checks.tuple_of("channels", channels, str, "names")
    unknown = [name for name in given if name not in known]
    if isinstance(channels, str) or unknown or not given or len(set(given)) < len(given):
        raise ConfigError(
            f"channels: expected some of {', '.join(known)}, each once, got {channels!r}"
        )
    return given


def _fit(record: ForwardRecord) -> Fit:
    count = record.engine.size
    squares = float(np.nansum(record.nis))
    return Fit(float(np.sum(record.inconsistency)), squares / count if count else math.nan, count)
