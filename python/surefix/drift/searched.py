"""Single searches of a diagnosis, and which of their answers is the fault."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from surefix.drift.fault import Fault
from surefix.drift.forward_record import ForwardRecord
from surefix.drift.onset import OnsetDetector
from surefix.drift.profile import Profile
from surefix.drift.spectrum import SpectrumDetector
from surefix.errors import ConfigError

Detector = OnsetDetector | SpectrumDetector

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


def all_detectors(
    channels: Sequence[str],
    profiles: Sequence[Profile],
    *,
    ends: bool,
    spectrum: bool,
    frequencies: npt.ArrayLike | None,
    false_alarm: float,
    samples: int,
) -> list[tuple[str, Detector]]:
    """Every profile, with and without an end if ``ends``, and a spectrum in every channel, which
    share the false alarms equally."""
    courses = [
        (channel, profile, ended)
        for channel in channels
        for profile in profiles
        for ended in ((False, True) if ends and profile.onset.ndim == 1 else (False,))
    ]
    waves = list(channels) if spectrum else []
    if not courses and not waves:
        raise ConfigError("profiles, spectrum: expected something to search for")
    share = false_alarm / (len(courses) + len(waves))
    detectors: list[tuple[str, Detector]] = [
        (channel, OnsetDetector(profile, channel, share, ended, samples))
        for channel, profile, ended in courses
    ]
    return detectors + [
        (channel, SpectrumDetector(channel, frequencies, false_alarm=share, samples=samples))
        for channel in waves
    ]


def search_one(
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


def best_of(found: Sequence[tuple[Searched, Fault | None]]) -> Fault | None:
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
