"""The tables that ``surefix raim`` writes: of epochs, of satellites, of places along the track."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from surefix.cli.raim_monitored import Monitored
from surefix.core.checks import FloatArray
from surefix.raim.availability import AvailabilityMap
from surefix.raim.geodesy import ecef_to_geodetic
from surefix.raim.result import BoolArray
from surefix.tables import Columns

METRES = ("along", "sigma", "rival", "protection", "protection_chi2")
NUMBERS = ("statistic", "threshold", "p_value", "p_star", "bound", "e1", "e2")
FLAGS = ("alarm", "separation_alarm", "available", "available_with_e1")


def epoch_table(monitored: Monitored) -> Columns:
    """One row an epoch; cells are empty where there is no answer, ``inf`` where no protection level
    is large enough."""
    result, truth = monitored.result, monitored.inputs.truth
    answered = np.isfinite(result.along)
    columns: dict[str, npt.NDArray[Any]] = {
        "time_s": result.time, "declared": result.declared, "status": result.status,
        "satellites": result.used, "excluded": _names_excluded(monitored),
    }  # fmt: skip
    columns |= {f"{name}_m": blank(getattr(result, name)) for name in METRES}
    lat, lon = (np.full(len(answered), np.nan) for _ in range(2))
    place = monitored.inputs.track.position(result.along[answered])
    lat[answered], lon[answered], _ = ecef_to_geodetic(place)
    columns |= {"lat_deg": blank(lat), "lon_deg": blank(lon)}
    for c, system in enumerate(result.data.system_names):
        columns[f"clock_{system}_m" if system else "clock_m"] = blank(result.clock[:, c])
    columns["degrees"] = np.where(answered, result.degrees.astype(np.str_), "")
    columns |= {name: blank(getattr(result, name)) for name in NUMBERS}
    columns |= {name: _flags(getattr(result, name), answered) for name in FLAGS}
    if truth is not None:
        columns["truth_m"] = blank(truth.along)
        columns["error_m"] = blank(result.along - truth.along)
    return columns


def satellite_table(monitored: Monitored) -> Columns:
    """One row for every satellite and epoch, in order of time."""
    result = monitored.result
    data = result.data
    return {
        "time_s": data.time,
        "satellite": data.satellite,
        "system": data.system,
        "elevation_deg": blank(monitored.elevation),
        "sigma_m": blank(np.where(monitored.seen, data.sigma, np.nan)),
        "seen": monitored.seen,
        "excluded": result.excluded,
        "residual": blank(result.residual),
        "critical_bias_m": blank(result.critical_bias),
        "missed_at_critical": blank(result.missed_at_critical),
    }


def availability_table(availability: AvailabilityMap) -> Columns:
    """One row for every place."""
    answered = availability.status == "ok"
    return {
        "along_m": availability.along,
        "lat_deg": availability.latitude,
        "lon_deg": availability.longitude,
        "satellites": availability.satellites,
        "status": availability.status,
        **{f"{name}_m": blank(getattr(availability, name)) for name in METRES[1:]},
        **{name: blank(getattr(availability, name)) for name in ("p_star", "e1", "e2")},
        **{name: _flags(getattr(availability, name), answered) for name in FLAGS[2:]},
    }


def blank(values: FloatArray) -> npt.NDArray[np.str_]:
    """Numbers as texts with the fewest digits that read back the same; empty for NaN."""
    return np.array(["" if v != v else repr(v) for v in values.tolist()], dtype=np.str_)


def _flags(values: BoolArray, answered: BoolArray) -> npt.NDArray[np.str_]:
    return np.where(answered, values.astype(np.str_), "")


def _names_excluded(monitored: Monitored) -> npt.NDArray[np.str_]:
    """The satellites that were taken out of each epoch, apart by spaces."""
    result = monitored.result
    names: list[list[str]] = [[] for _ in range(len(result.time))]
    for row in np.flatnonzero(result.excluded):
        names[int(result.data.epoch[row])].append(str(result.data.satellite[row]))
    return np.array([" ".join(some) for some in names], dtype=np.str_)
