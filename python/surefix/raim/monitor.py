"""Integrity of satellite positions on a known track."""

from __future__ import annotations

import math
from collections.abc import Callable

from surefix import _core
from surefix.core import checks
from surefix.errors import ConfigError
from surefix.raim.pseudoranges import Pseudoranges
from surefix.raim.result import RaimResult
from surefix.raim.track import Track


class TrackRaim:
    """Position along a track and receiver clocks from pseudoranges, tested epoch by epoch
    (Lacresse, Grall & Nikiforov 2005, section 5), with protection and exclusion.

    ``length`` [m]: L of the along-track protection interval. Per epoch: ``false_alarm`` α, of the
    snapshot test (13) and again of the solution separations; ``missed`` γ, how often a critical
    fault may be missed; ``risk`` p_r; ``fault_probability`` p_f of a satellite. ``max_faults``:
    satellites faulty at once that the protection level covers, 1 or 2, the probability of more is
    taken from the risk; 0: the snapshot test alone, as in the paper. ``max_excluded``: how many
    satellites may be taken out, 0 to 4; half of the risk is divided among the sets that could be.
    ``interval`` [m]: half-width of K around the estimate, over which the linearisation error is
    bounded; by default length / 2. ``max_speed`` [m/s]: the position is looked for where the
    vehicle can be, in an interval that grows at that speed and shrinks to the protection level
    (``length`` if that is longer) of every position that may be used: on a track that comes near
    to itself only that tells the branches apart. ``earth_rotation``: the satellites' positions are
    in the frame at transmission; the Sagnac term is added.
    """

    def __init__(
        self,
        track: Track,
        *,
        length: float,
        false_alarm: float = 1e-5,
        missed: float = 1e-3,
        risk: float = 1e-7,
        fault_probability: float = 1e-4,
        max_faults: int = 2,
        max_excluded: int = 2,
        interval: float | None = None,
        max_speed: float = math.inf,
        earth_rotation: bool = False,
    ) -> None:
        self.track = checks.instance("track", track, Track)
        self.length = checks.positive("length", length)
        self.false_alarm = checks.probability("false_alarm", false_alarm)
        self.missed = checks.probability("missed", missed)
        self.risk = checks.probability("risk", risk)
        self.fault_probability = checks.probability("fault_probability", fault_probability)
        self.max_faults = checks.whole("max_faults", max_faults, 0, 2)
        self.max_excluded = checks.whole("max_excluded", max_excluded, 0, _core.MAX_EXCLUDED)
        half = self.length / 2 if interval is None else interval
        self.interval = checks.positive("interval", half)
        self.max_speed = (
            math.inf if max_speed == math.inf else checks.positive("max_speed", max_speed)
        )
        self.earth_rotation = checks.instance("earth_rotation", earth_rotation, bool)
        self._engine = _core.TrackRaimEngine(
            self.track.engine, self.length, self.false_alarm, self.missed, self.risk,
            self.fault_probability, self.max_faults, self.max_excluded, self.interval,
            _core.EARTH_ROTATION if self.earth_rotation else 0.0,
        )  # fmt: skip

    def run(
        self,
        pseudoranges: Pseudoranges,
        *,
        near: float | None = None,
        progress: Callable[[int, int], None] | None = None,
    ) -> RaimResult:
        """Judges all epochs, in order of time. ``near``: mileage [m] at the beginning, right to
        within ``length``; by default the whole track is searched. ``progress`` is called with
        (done, total).
        """
        data = checks.instance("pseudoranges", pseudoranges, Pseudoranges)
        if data.epochs == 0:
            raise ConfigError("pseudoranges: expected at least one epoch, got none")
        place = float("nan") if near is None else checks.number("near", near)
        columns = self._engine.judge(
            data.epoch_time, data.begin, data.position, data.pseudorange, data.sigma,
            data.system_code, self.max_speed, place, progress or _ignore,
        )  # fmt: skip
        return RaimResult(columns, data, self.length, self.risk)


def _ignore(done: int, total: int) -> None:
    """Nobody looks at the progress."""
