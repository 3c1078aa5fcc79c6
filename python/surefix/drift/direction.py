"""Which channels a fault is in, and how much of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from surefix.core import checks
from surefix.core.checks import FloatArray
from surefix.errors import ConfigError

Direction = str | int | Mapping[str, float] | None


def weights(channel: Direction, names: Sequence[str]) -> FloatArray:
    """A weight for every channel: of one of them, of several by name, of the only one (None)."""
    if channel is None:
        if len(names) > 1:
            raise ConfigError(f"channel: expected one of {', '.join(names)}, got none")
        return np.ones(1)
    if isinstance(channel, (str, int, np.integer)) and not isinstance(channel, bool):
        channel = {str(channel): 1.0}
    if not isinstance(channel, Mapping) or not channel or set(channel) - set(names):
        raise ConfigError(
            f"channel: expected one of {', '.join(names)}, or a weight for some of them, "
            f"got {channel!r}"
        )
    given = {c: checks.number(f"channel {c!r}", w) for c, w in channel.items()}
    if not any(given.values()):
        raise ConfigError(f"channel: expected a weight other than 0, got {channel!r}")
    return np.array([given.get(name, 0.0) for name in names])
