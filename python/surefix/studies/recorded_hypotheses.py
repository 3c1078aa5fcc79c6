"""One epoch of pseudoranges on a track under the robust filter's hypotheses: each satellite is
healthy or an outlier on its own."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from surefix.core.checks import FloatArray
from surefix.core.models import LinearModel
from surefix.core.sensor import Sensor
from surefix.raim.availability import sagnac
from surefix.raim.pseudoranges import Pseudoranges
from surefix.raim.track import Track
from surefix.robust.filter import RobustFilter
from surefix.robust.limits import alert_limits
from surefix.robust.modes import Outage

CLOCK = 1000.0
"""Prior deviation of the clocks about the median of their satellites [m]: none to speak of."""


@dataclass(frozen=True)
class Mixture:
    """Of the mileage [m], (C,) each: ``weight``, ``mean``, ``sigma``; ``discarded``: mass that is
    left out. ``along`` and ``deviation``: of the mixture; ``outlier`` (n,): probability of each of
    the satellites ``rows`` of the epoch."""

    weight: FloatArray
    mean: FloatArray
    sigma: FloatArray
    discarded: float
    along: float
    deviation: float
    outlier: FloatArray
    rows: npt.NDArray[np.int64]

    def limits(self, risk: float) -> tuple[float, float]:
        """That the mileage is outside of with that probability; infinite where none can be
        claimed."""
        left = risk - self.discarded
        if left <= 0:
            return -np.inf, np.inf
        return alert_limits(self.weight, self.mean, self.sigma, left)


@dataclass(frozen=True)
class Hypotheses:
    """``outage``: of every satellite, drawn anew in every epoch; ``satellites``: at most, those of
    least σ; ``beam``: of hypotheses; ``risk``: the least of any limits; ``earth_rotation`` as of
    TrackRaim."""

    outage: Outage
    satellites: int = 10
    beam: int = 1024
    risk: float = 1e-9
    earth_rotation: bool = True

    def run(
        self, track: Track, epoch: Pseudoranges, at: float, prior: tuple[float, float],
        first: int = 256,
    ) -> Mixture:  # fmt: skip
        """Linearised at mileage ``at``, then with ``first`` hypotheses at what that gives, and
        with all at what that gives. ``prior``: mean and deviation of the mileage."""
        for beam in (first, first, self.beam):
            found = self._linear(track, epoch, at, prior, beam)
            at = found.along
        return found

    def _linear(
        self, track: Track, epoch: Pseudoranges, at: float, prior: tuple[float, float], beam: int
    ) -> Mixture:
        rows = np.sort(np.argsort(epoch.sigma, kind="stable")[: self.satellites])
        rows = rows[np.isfinite(epoch.sigma[rows]) & np.isfinite(epoch.pseudorange[rows])]
        place, satellite = track.position(at), epoch.position[rows]
        distance = np.linalg.norm(satellite - place, axis=1)
        slope = -((satellite - place) @ track.tangent(at)) / distance
        if self.earth_rotation:
            distance = distance + sagnac(np.tile(place, (len(rows), 1)), satellite)
        off = epoch.pseudorange[rows] - distance
        systems = len(epoch.system_names)
        of = epoch.system_code[rows][:, None] == np.arange(systems)
        for column in of.T:
            if column.any():
                off[column] -= np.median(off[column])
        sensors = [
            Sensor(f"{k}", epoch.sigma[row], observes=(slope[k], *of[k].astype(float)),
                   faults=(self.outage,))
            for k, row in enumerate(rows)
        ]  # fmt: skip
        size = 1 + systems
        still = LinearModel(np.zeros((size, size)), np.zeros((size, 1)), [[0.0]])
        filtered = RobustFilter(
            still, sensors, [prior[0] - at] + systems * [0.0],
            np.diag([prior[1] ** 2] + systems * [CLOCK**2]),
            start=0.0, risk=self.risk, hypotheses="measurement", beam=beam,
        )  # fmt: skip
        for k, value in enumerate(off):
            filtered.push(0.0, f"{k}", value)
        estimate = filtered.estimate(0.0)
        parts = filtered.mixture()
        weight = np.exp(parts["log_weight"] - parts["log_weight"].max())
        return Mixture(
            weight / weight.sum(), at + parts["x"][:, 0], np.sqrt(parts["P"][:, 0, 0]),
            estimate.discarded_mass, at + float(estimate.x[0]), float(np.sqrt(estimate.P[0, 0])),
            estimate.outlier_probability, rows,
        )  # fmt: skip
