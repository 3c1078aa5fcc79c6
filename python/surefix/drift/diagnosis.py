"""Which sensor, which fault: all searches over all channels, and the data repaired."""

from __future__ import annotations

import dataclasses
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
from surefix.drift.onset import OnsetDetector
from surefix.drift.profile import Profile
from surefix.drift.repair import StateEstimates, repaired_estimates, subtracted
from surefix.drift.spectrum import SpectrumDetector
from surefix.errors import ConfigError, ShapeError
from surefix.log import Log

Progress = Callable[[int, int], None]

RIVAL = 2 * math.log(20)
"""Difference of two scores at odds of 20 to 1."""


@dataclass(frozen=True)
class Searched:
    """One search in the data as they are; numbers None where it is 'undetectable'."""

    channel: str
    kind: str
    status: str
    reason: str
    drop: float | None
    score: float | None
    p_value: float | None
    onset: float | None
    frequency: float | None


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
    settings: dict[str, Any] = {}
    given: FloatArray | Log
    if isinstance(source, LinearSystem):
        if isinstance(data, Log):
            raise ConfigError("data: expected measurements (steps, m) of a LinearSystem, got a Log")
        z, _, _, alone = measurements(source, data, times, inputs)
        if not alone:
            raise ShapeError(f"data: expected one run (steps, m), got shape {z.shape}")
        given = z[0]
        settings = {"times": times, "inputs": inputs, "channels": names}
    else:
        checks.instance("source", source, DesyncFilter)
        given = checks.instance("data", data, Log)
        for name, value in {"times": times, "inputs": inputs, "names": names}.items():
            if value is not None:
                raise ConfigError(f"{name}: expected none with a filter and a log, got {value!r}")
    original = given
    record = ForwardRecord(source, given, **settings)
    suspects = record.channels if channels is None else _names(channels, record.channels)
    makers: list[tuple[str, Any]] = [
        (channel, (profile, ended))
        for channel in suspects
        for profile in courses
        for ended in ((False, True) if ends and profile.onset.ndim == 1 else (False,))
    ]
    makers += [(channel, None) for channel in suspects if spectrum]
    if not makers:
        raise ConfigError("profiles, spectrum: expected something to search for")
    share = alarm / len(makers)
    detectors = [
        (channel, SpectrumDetector(channel, frequencies, false_alarm=share, samples=samples)
         if what is None else
         OnsetDetector(what[0], channel, share, what[1], samples))
        for channel, what in makers
    ]  # fmt: skip

    before = _fit(record)
    faults: list[Fault] = []
    first: tuple[Searched, ...] = ()
    for round_ in range(most):
        found = []
        for k, (channel, detector) in enumerate(detectors):
            found.append(_search(record, channel, detector, len(detectors)))
            if progress is not None:
                progress(round_ * len(detectors) + k + 1, most * len(detectors))
        first = first or tuple(searched for searched, _ in found)
        best = _best(found)
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


def _names(channels: Sequence[str], known: Sequence[str]) -> tuple[str, ...]:
    given = checks.tuple_of("channels", channels, str, "names")
    unknown = [name for name in given if name not in known]
    if isinstance(channels, str) or unknown or not given:
        raise ConfigError(f"channels: expected some of {', '.join(known)}, got {channels!r}")
    return given


def _fit(record: ForwardRecord) -> Fit:
    count = record.engine.size
    squares = float(np.nansum(record.nis))
    return Fit(float(np.sum(record.inconsistency)), squares / count if count else math.nan, count)


def _search(
    record: ForwardRecord, channel: str, detector: OnsetDetector | SpectrumDetector, searches: int
) -> tuple[Searched, Fault | None]:
    """What one search found, and the fault if it is one."""
    penalty = math.log(max(record.engine.size, 2))
    if isinstance(detector, SpectrumDetector):
        kind, parameters = "sinusoid", 3
    else:
        q = detector.profile.amplitudes
        kind = detector.profile.name + (" (ends)" if detector.ends else "")
        parameters = q + 1 + detector.ends
    out = detector.run(record)
    if out.drop is None:
        none = Searched(channel, kind, "undetectable", out.reason, *(None,) * 5)
        return none, None
    drop = float(np.asarray(out.drop))
    p = min(1.0, searches * float(np.asarray(out.p_at_most)))
    found: dict[str, Any] = out.found()
    drop = found.pop("drop", drop)  # between frequencies it is larger than on their grid
    score = drop - parameters * penalty
    common: dict[str, Any] = {
        "channel": channel, "kind": kind, "drop": drop, "score": score, "p_value": p,
    }  # fmt: skip
    searched = Searched(
        status=str(out.status), reason="", onset=found.get("onset"),
        frequency=found.get("frequency"), **common,
    )  # fmt: skip
    fault = Fault(parameters=parameters, **common, **found) if out.detected else None
    return searched, fault


def _best(found: Sequence[tuple[Searched, Fault | None]]) -> Fault | None:
    """The fault of the best score, with the next best of another channel or course."""
    faults = [fault for _, fault in found if fault is not None]
    if not faults:
        return None
    best = max(faults, key=lambda fault: fault.score)
    others = [
        (s.channel, s.kind, s.score) for s, fault in found
        if s.score is not None and fault is not best
    ]  # fmt: skip
    close = {channel for channel, _, score in others if score > best.score - RIVAL}
    return dataclasses.replace(
        best, runner_up=max(others, key=lambda o: o[2], default=None),
        rivals=tuple(sorted(close - {best.channel})),
    )  # fmt: skip
