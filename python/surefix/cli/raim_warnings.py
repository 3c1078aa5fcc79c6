"""Where what ``surefix raim`` claims rests on something that does not hold."""

from __future__ import annotations

import math

import numpy as np

from surefix.cli.raim_monitored import Monitored
from surefix.raim.track import Track

MOST_ALARMS = 0.05  # of the epochs tested, above which faults are not the rare events of the claim
MOST_SAMPLES = 2000  # of the track
TURN = 4.0  # limits along the track that a bend may take to turn back


def warnings(monitored: Monitored) -> list[str]:
    """Sentences; none if nothing is wrong."""
    found = []
    result, monitor = monitored.result, monitored.monitor
    tested = int((result.degrees > 0).sum())
    rate = float(result.alarm.sum() / tested) if tested else 0.0
    if rate > MOST_ALARMS:
        found.append(
            f"{rate:.0%} of the epochs tested raise an alarm, of healthy ones "
            f"{monitor.false_alarm:g} would: either σ is too small or faults are so frequent that "
            "no level claimed here can be relied on"
        )
    twice = comes_back(monitored.inputs.track, monitor.length / 2)
    if twice is not None and monitor.max_speed == math.inf:
        found.append(
            f"the track comes back: at {twice[0]:.0f} m it is within {monitor.length / 2:g} m of "
            f"where it is at {twice[1]:.0f} m; which of the two, no single epoch can tell, and the "
            "protection levels have to cover both: give --max-speed, and --near for the beginning"
        )
    return found


def comes_back(track: Track, near: float) -> tuple[float, float] | None:
    """Two mileages [m], far apart along the track, whose places are closer than ``near`` [m], as
    far as samples show; None if there are none."""
    count = int(min(MOST_SAMPLES, np.ceil(2 * track.length / near))) + 1
    along = np.linspace(track.low, track.high, count)
    place = track.position(along)
    place = place - place.mean(axis=0)
    square = (place**2).sum(axis=1)
    apart = square[:, None] + square[None, :] - 2 * place @ place.T
    far = along[None, :] - along[:, None] > TURN * near + (along[1] - along[0])
    both = np.argwhere(far & (apart < near**2))
    return None if len(both) == 0 else (float(along[both[0, 0]]), float(along[both[0, 1]]))
