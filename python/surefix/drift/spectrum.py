"""Is there an oscillation, of which frequency, and how large?"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from surefix.core import checks
from surefix.core.checks import FloatArray
from surefix.drift.direction import Direction
from surefix.drift.false_alarm import FalseAlarm
from surefix.drift.forward_record import ForwardRecord
from surefix.drift.outcome import CONSTANT
from surefix.drift.spectrum_result import SpectrumResult
from surefix.drift.spectrum_search import SpectrumSearch
from surefix.errors import ConfigError

MAX_FREQUENCIES = 1_000_000


class SpectrumDetector:
    """The exact likelihood ratio of a sinusoid of unknown amplitude and phase, for every frequency.

    The paper takes the imaginary part of the gradient's Fourier transform (16), which is the drop
    to first order of a sine of known phase; here the phase is unknown, every frequency is scaled by
    what it varies by with no fault, and times may be irregular.

    ``channel``, ``false_alarm`` (of the whole spectrum), ``samples``, ``seed`` as of
    ``OnsetDetector``. ``frequencies`` (any,) [1/time], ascending, > 0; by default from one cycle
    in the record to half its median sampling rate, ``oversampling`` of them for each cycle.

    Raises ShapeError or ConfigError for what does not fit.
    """

    def __init__(
        self,
        channel: Direction = None,
        frequencies: npt.ArrayLike | None = None,
        oversampling: int = 2,
        false_alarm: float = 1e-3,
        samples: int = 1024,
        seed: int = 0,
    ) -> None:
        self.channel = channel
        self.frequencies = None if frequencies is None else _ascending(frequencies)
        self.oversampling = checks.whole("oversampling", oversampling, 1, 64)
        self.false_alarm = checks.probability("false_alarm", false_alarm)
        self.samples = checks.whole("samples", samples, 0, 1_000_000)
        self.seed = checks.whole("seed", seed, 0, 2**32 - 1)

    def run(self, record: ForwardRecord) -> SpectrumResult:
        """What is found in a record; one call for all of its runs."""
        checks.instance("record", record, ForwardRecord)
        constant = record.layout.constant(record.direction(self.channel))
        search, times, reason = (
            (None, np.zeros(0), CONSTANT) if constant.all() else self._search(record)
        )
        if search is not None:
            search.found[constant] = np.nan
        alarm = None if search is None or reason else FalseAlarm(search, self.samples, self.seed)
        interval, duration = _extent(times) if search else (1.0, 1.0)
        origin = float(record.layout.times(slice(1)).sum())  # of the first measurement
        return SpectrumResult(
            search, interval, duration, origin, record.layout.alone, self.false_alarm, alarm, reason
        )

    def threshold(self, record: ForwardRecord) -> float | None:
        """As of ``OnsetDetector``."""
        checks.instance("record", record, ForwardRecord)
        search, _, reason = self._search(record)
        if search is None or reason:
            return None
        return FalseAlarm(search, self.samples, self.seed).threshold(self.false_alarm)

    def _search(self, record: ForwardRecord) -> tuple[SpectrumSearch | None, FloatArray, str]:
        """The search, the times of the channel, and why nothing can be found if that is so."""
        direction = record.direction(self.channel)
        times = record.layout.times_of(direction)
        if len(times) < 3:
            return None, times, f"{len(times)} measurements of the channel: too few for a sinusoid"
        interval, duration = _extent(times)
        grid = self.frequencies if self.frequencies is not None else self._grid(duration, interval)
        if len(grid) == 0:
            wanted = f"from one cycle in {duration:g} to half the median rate 1 / {interval:g}"
            return None, times, f"more than {MAX_FREQUENCIES} frequencies {wanted}: give them"
        search = SpectrumSearch(record, direction, grid, 4 / duration)
        return search, times, "" if len(search.usable) else search.reason()

    def _grid(self, duration: float, interval: float) -> FloatArray:
        count = round(self.oversampling * duration / (2 * interval))
        if count > MAX_FREQUENCIES:
            return np.zeros(0)
        first = min(self.oversampling, count)
        return np.arange(first, count + 1) / (self.oversampling * duration)


def _extent(times: FloatArray) -> tuple[float, float]:
    """The median interval, and the duration of so many of them as there are times, if regular."""
    interval = float(np.median(np.diff(times)))
    return interval, float(times[-1] - times[0]) + interval


def _ascending(frequencies: npt.ArrayLike) -> FloatArray:
    given = checks.array("frequencies", frequencies, (None,))
    if len(given) == 0 or not (given > 0).all() or not (np.diff(given) > 0).all():
        raise ConfigError(f"frequencies: expected ascending numbers > 0, got {frequencies!r}")
    return given
