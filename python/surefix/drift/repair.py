"""Data without the faults that were found in them, and the estimates from them."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from surefix.core.checks import FloatArray
from surefix.core.linear_system import LinearSystem
from surefix.desync.filter import DesyncFilter
from surefix.desync.result import Result
from surefix.drift.fault import Fault
from surefix.drift.forward_record import ForwardRecord
from surefix.errors import ConfigError
from surefix.log import Log


@dataclass(frozen=True, eq=False)
class StateEstimates:
    """x (steps, n) and P (steps, n, n) after the measurements of each step."""

    time: FloatArray
    x: FloatArray
    P: FloatArray


def subtracted(
    data: FloatArray | Log, channels: Sequence[str], channel: str, values: FloatArray
) -> FloatArray | Log:
    """The data less ``values`` (steps,) or (rows,) in one channel."""
    if isinstance(data, Log):
        here = (data.sensor == channel) & np.isfinite(values)
        return data.with_value(np.where(here, data.value - values, data.value))
    repaired = data.copy()
    repaired[..., list(channels).index(channel)] -= values
    return repaired


def repaired_estimates(
    source: LinearSystem | DesyncFilter,
    original: FloatArray | Log,
    repaired: FloatArray | Log,
    faults: Sequence[Fault],
    settings: Mapping[str, Any],
    rate: float | None,
    times: npt.ArrayLike | None,
) -> tuple[Result | StateEstimates, Result | StateEstimates]:
    """Estimates before and after. What a unit amplitude does to x is b = x(data) - x(data - d),
    since x is linear in the data; amplitudes of covariance C add b C bᵀ to P (given onset and
    course, whose own uncertainty is not in it)."""
    if isinstance(source, LinearSystem) and (rate is not None or times is not None):
        raise ConfigError("rate, times: expected none with a linear system, which has its steps")

    def run(data: FloatArray | Log) -> Result | StateEstimates:
        if isinstance(source, DesyncFilter):
            assert isinstance(data, Log)
            return source.run(data, rate=rate, times=times, noise=None)
        assert isinstance(data, np.ndarray)
        kept = ForwardRecord(source, data, **settings, estimates=True)
        return StateEstimates(kept.time, kept.x, kept.P)

    record = ForwardRecord(source, original, **settings)
    after = run(repaired)
    P = after.P.copy()
    for fault in faults:
        unit = fault.basis(record.time)
        moved = [
            after.x - run(subtracted(repaired, record.channels, fault.channel, one)).x
            for one in unit.T
        ]
        b = np.stack(moved, axis=-1)  # (steps, n, q)
        P += np.einsum("tia,ab,tjb->tij", b, fault.covariance, b)
    return run(original), dataclasses.replace(after, P=P)
