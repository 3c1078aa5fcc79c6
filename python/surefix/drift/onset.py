"""Is there a fault of a known course, since when, and how large?"""

from __future__ import annotations

import numpy as np

from surefix.core import checks
from surefix.drift.direction import Direction
from surefix.drift.ending_search import EndingSearch
from surefix.drift.false_alarm import FalseAlarm
from surefix.drift.forward_record import ForwardRecord
from surefix.drift.onset_result import OnsetResult
from surefix.drift.onset_search import OnsetSearch
from surefix.drift.outcome import CONSTANT
from surefix.drift.profile import Profile
from surefix.errors import ConfigError


class OnsetDetector:
    """The exact likelihood ratio of a fault with the course ``profile``, for every onset.

    ``channel``: the name of the one that carries it, or {name: weight} for a direction over
    several; None: the only one there is. ``false_alarm``: probability that a healthy record, as
    long as it is, is called faulty. ``ends``: the fault ends growing at an unknown time, by the
    difference of two profiles (a ramp becomes a truncated ramp, a step a pulse). ``samples`` and
    ``seed`` of the simulation that the false alarms are calibrated by.

    Raises ConfigError for what does not fit.
    """

    def __init__(
        self,
        profile: Profile,
        channel: Direction = None,
        false_alarm: float = 1e-3,
        ends: bool = False,
        samples: int = 1024,
        seed: int = 0,
    ) -> None:
        self.profile = checks.instance("profile", profile, Profile)
        self.channel = channel
        self.false_alarm = checks.probability("false_alarm", false_alarm)
        self.ends = bool(ends)
        if self.ends and profile.onset.ndim > 1:
            raise ConfigError(f"ends: expected a profile of one amplitude, got {profile.name!r}")
        self.samples = checks.whole("samples", samples, 0, 1_000_000)
        self.seed = checks.whole("seed", seed, 0, 2**32 - 1)

    def run(self, record: ForwardRecord) -> OnsetResult:
        """What is found in a record; one call for all of its runs."""
        checks.instance("record", record, ForwardRecord)
        constant = record.layout.constant(record.direction(self.channel))
        search, reason = (None, CONSTANT) if constant.all() else self._search(record)
        if search is None or reason:
            return OnsetResult(
                self.profile, search, None, record.layout.alone, self.false_alarm, None, reason
            )
        num = search.numerators(record.innovations, None)
        num[constant] = np.nan
        alarm = FalseAlarm(search, self.samples, self.seed)
        return OnsetResult(self.profile, search, num, record.layout.alone, self.false_alarm, alarm)

    def threshold(self, record: ForwardRecord) -> float | None:
        """The drop of 𝓛 that a healthy record exceeds with probability ``false_alarm``. It depends
        on the schedule of measurements only. None: undetectable."""
        checks.instance("record", record, ForwardRecord)
        search, reason = self._search(record)
        if reason:
            return None
        return FalseAlarm(search, self.samples, self.seed).threshold(self.false_alarm)

    def _search(self, record: ForwardRecord) -> tuple[OnsetSearch | EndingSearch, str]:
        """The search, and why nothing can be found if that is so."""
        onsets = OnsetSearch(record, self.profile, record.direction(self.channel))
        search = EndingSearch(onsets) if self.ends else onsets
        return search, "" if len(search.usable) else search.reason()
