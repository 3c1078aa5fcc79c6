"""What the figure of a diagnosis shows: for some sensors the best search, over onset or frequency,
and what is left of their measurements."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from surefix.core.checks import FloatArray
from surefix.drift.diagnosis import Diagnosis
from surefix.drift.fault import Fault
from surefix.drift.forward_record import ForwardRecord
from surefix.drift.onset import OnsetDetector
from surefix.drift.onset_result import OnsetResult
from surefix.drift.profile import Profile
from surefix.drift.searched import Searched
from surefix.drift.spectrum import SpectrumDetector
from surefix.errors import ConfigError
from surefix.log import Log
from surefix.plots.style import PALETTE

SINUSOID = "sinusoid"
ENDS = " (ends)"
SAMPLES = 64
"""For the threshold: enough for 0.3 of a drop of 20 to 30."""
MOST_SIMULATED = 100_000
"""Measurements beyond which a diagnosis takes the bound, too."""


@dataclass(frozen=True, eq=False)
class Curve:
    """Drop of 𝓛 over onset [s] or frequency [Hz] of one search; ``threshold`` None if there is
    none."""

    sensor: str
    kind: str
    at: FloatArray
    drop: FloatArray
    threshold: float | None


@dataclass(frozen=True, eq=False)
class Residual:
    """Measurements of one sensor minus what the filter predicted from all before them, in the log
    as it was; ``effect``: what the faults that were found, in whichever sensor, add to that."""

    sensor: str
    time: FloatArray
    value: FloatArray
    effect: FloatArray
    faults: tuple[Fault, ...]


def shown_sensors(diagnosis: Diagnosis, most: int) -> list[str]:
    """Those at fault, as they were found; then the others, the largest drop first."""
    drops = {one.channel: 0.0 for one in diagnosis.searched}
    for one in diagnosis.searched:
        drops[one.channel] = max(drops[one.channel], one.drop or 0.0)
    faulty = dict.fromkeys(fault.channel for fault in diagnosis.faults)
    return list(dict.fromkeys([*faulty, *sorted(drops, key=lambda name: -drops[name])]))[:most]


def residuals(
    record: ForwardRecord, repaired: ForwardRecord, diagnosis: Diagnosis, most: int
) -> list[Residual]:
    """Of the sensors at fault; of the one with the largest drop if none is. The filter is linear:
    what a fault does is the difference of the passes before and after the repair."""
    if not isinstance(diagnosis.repaired, Log):
        raise ConfigError("diagnosis: expected one of a log")
    before, after = _innovations(record), _innovations(repaired)
    code = diagnosis.repaired.codes_for(record.channels)
    count = len({fault.channel for fault in diagnosis.faults}) or 1
    found = []
    for name in shown_sensors(diagnosis, min(count, most)):
        rows = np.flatnonzero((code == record.channels.index(name)) & np.isfinite(before))
        rows = rows[np.argsort(record.time[rows], kind="stable")]
        own = tuple(fault for fault in diagnosis.faults if fault.channel == name)
        effect = before[rows] - after[rows]
        found.append(Residual(name, record.time[rows], before[rows], effect, own))
    return found


def _innovations(record: ForwardRecord) -> FloatArray:
    """Of every row of the log; NaN: not used."""
    rows = np.full(len(record.time), np.nan)
    rows[record.engine.ids] = record.innovations[0]
    return rows


def onset_curves(
    record: ForwardRecord, diagnosis: Diagnosis, profiles: Sequence[Profile]
) -> list[Curve]:
    """The best search over onsets of every sensor that is shown."""
    known = {profile.name: profile for profile in profiles}
    curves = []
    for best in _best(diagnosis, False):
        profile, ends = known[best.kind.removesuffix(ENDS)], best.kind.endswith(ENDS)
        share = diagnosis.false_alarm / len(diagnosis.searched)
        detector = OnsetDetector(profile, best.channel, share, ends, _samples(record))
        found = detector.run(record)
        at, drop = _over_onsets(found)
        curves.append(Curve(best.channel, best.kind, at, drop, found.threshold))
    return curves


def spectrum_curves(
    record: ForwardRecord, diagnosis: Diagnosis, frequencies: npt.ArrayLike | None
) -> list[Curve]:
    """Of every sensor that is shown, if oscillations were looked for."""
    curves = []
    for best in _best(diagnosis, True):
        share = diagnosis.false_alarm / len(diagnosis.searched)
        detector = SpectrumDetector(
            best.channel, frequencies, false_alarm=share, samples=_samples(record)
        )
        found = detector.run(record)
        curves.append(Curve(best.channel, SINUSOID, found.frequency, found.ratio, found.threshold))
    return curves


def _best(diagnosis: Diagnosis, spectrum: bool) -> list[Searched]:
    """Of every sensor that is shown the search with the best score, if it can be seen at all."""
    best = []
    for name in shown_sensors(diagnosis, len(PALETTE)):
        own = [
            one for one in diagnosis.searched
            if one.channel == name and (one.kind == SINUSOID) == spectrum and one.score is not None
        ]  # fmt: skip
        best += [max(own, key=lambda one: one.score or 0.0)] if own else []
    return best


def _over_onsets(found: OnsetResult) -> tuple[FloatArray, FloatArray]:
    """Each onset once, with the best of its ends."""
    drop = np.where(np.isfinite(found.ratio), found.ratio, -np.inf)
    at, which = np.unique(found.time, return_inverse=True)
    largest = np.full(len(at), -np.inf)
    np.maximum.at(largest, which, drop)
    return at, np.where(np.isfinite(largest), largest, np.nan)


def _samples(record: ForwardRecord) -> int:
    return SAMPLES if record.engine.size <= MOST_SIMULATED else 0
