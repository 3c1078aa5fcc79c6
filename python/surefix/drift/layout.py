"""Where the scalar measurements of a record lie in the user's data."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from surefix.core.checks import FloatArray

Indices = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Layout:
    """``shape`` of one run's data, (steps, m) or (rows,), with ``time`` of each step or row;
    ``ids`` (N,): flat index in it of each measurement that was used, ``channel`` (N,) its channel;
    ``raw`` (runs, prod(shape)): the data; ``alone``: one run without an axis for it."""

    shape: tuple[int, ...]
    time: FloatArray
    ids: Indices
    channel: npt.NDArray[np.integer]
    raw: FloatArray
    alone: bool

    @property
    def step(self) -> Indices:
        """(N,) in which step or row each measurement lies."""
        return self.ids // self.shape[1] if len(self.shape) > 1 else self.ids

    def times(self, measurement: Indices | slice) -> FloatArray:
        """When measurements were valid."""
        result: FloatArray = self.time[self.step[measurement]]
        return result

    def times_of(self, direction: FloatArray) -> FloatArray:
        """When a channel of the direction was measured, each time once."""
        return np.unique(self.times(slice(None))[direction[self.channel] != 0])

    def arranged(self, values: FloatArray) -> FloatArray:
        """(runs, N) in the shape of the data, NaN where nothing was used."""
        out = np.full((len(values), int(np.prod(self.shape))), np.nan)
        out[:, self.ids] = values
        return self.one_or_all(out.reshape(len(values), *self.shape))

    def summed(self, values: FloatArray) -> FloatArray:
        """(runs, N) added up in each step, NaN where there is nothing."""
        out = np.full((len(values), self.shape[0]), np.nan)
        out[:, self.step] = 0.0
        for run, row in zip(out, values, strict=True):
            np.add.at(run, self.step, row)
        return self.one_or_all(out)

    def one_or_all(self, out: FloatArray) -> FloatArray:
        """Without the axis of runs if the data has none."""
        return out[0] if self.alone else out

    def constant(self, direction: FloatArray) -> npt.NDArray[np.bool_]:
        """(runs,) whether a channel of the direction has several values, all of them the same: no
        sensor with noise does that, so nothing can be said about its faults."""
        constant = np.zeros(len(self.raw), bool)
        for c in np.flatnonzero(direction):
            ids = self.ids[self.channel == c]
            first = self.raw[:, ids[:64]]
            if (first != first[:, :1]).any(axis=1).all():
                continue  # most do not need the rest
            own = self.raw[:, ids]
            if own.shape[1] > 1:
                constant |= (own == own[:, :1]).all(axis=1)
        return constant
