"""Pseudoranges of many epochs: one row for every satellite and epoch."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from surefix import _core
from surefix.core import checks
from surefix.core.checks import FloatArray
from surefix.errors import ConfigError, ShapeError
from surefix.raim.geodesy import sky


class Pseudoranges:
    """``time`` (N,) [s], ``satellite`` (N,) names, ``position`` (N, 3) [m], ``pseudorange`` (N,)
    [m], corrected for the atmosphere and the satellite's clock, ``sigma``: its standard deviation
    [m], (N,) or one number, ``system`` (N,) names of those whose clocks differ (None: one).

    Rows of equal time are an epoch: they are sorted by time, otherwise left in order. A satellite
    may be there once an epoch. Rows with a pseudorange, position or sigma that is not finite or
    beyond 1e10 m, or a sigma below 1e-6 m, stay and are not used. All arrays are read-only copies.
    ``epoch_time`` (T,), ``begin`` (T + 1,): epoch t holds the rows begin[t] to begin[t + 1] - 1.
    Raises ShapeError, ConfigError.
    """

    def __init__(
        self,
        time: npt.ArrayLike,
        satellite: Sequence[str] | npt.NDArray[Any],
        position: npt.ArrayLike,
        pseudorange: npt.ArrayLike,
        sigma: npt.ArrayLike,
        system: Sequence[str] | npt.NDArray[Any] | None = None,
    ) -> None:
        stamps = checks.array("time", time, (None,))
        n = len(stamps)
        systems = np.full(n, "") if system is None else _names("system", system, n)
        self._set(
            np.argsort(stamps, kind="stable"),
            time=stamps,
            satellite=_names("satellite", satellite, n),
            position=_numbers("position", position, (n, 3)),
            pseudorange=_numbers("pseudorange", pseudorange, (n,)),
            sigma=np.broadcast_to(_numbers("sigma", sigma, (), (n,)), (n,)),
            system=systems,
        )
        if len(self.system_names) > _core.MAX_SATELLITE_SYSTEMS:
            raise ConfigError(
                f"system: expected at most {_core.MAX_SATELLITE_SYSTEMS} systems, "
                f"got {len(self.system_names)}"
            )
        self._refuse_twice()

    def _set(self, rows: Any, **columns: npt.NDArray[Any]) -> None:
        """The rows wanted of columns in order of time, and the epochs that they make."""
        self.time, self.satellite, self.position, self.pseudorange, self.sigma, self.system = (
            checks.read_only(columns[name][rows].copy())
            for name in ("time", "satellite", "position", "pseudorange", "sigma", "system")
        )
        self.system_names, code = np.unique(self.system, return_inverse=True)
        self.system_code = checks.read_only(code.astype(np.int64).reshape(-1))
        self.epoch_time, first = np.unique(self.time, return_index=True)
        self.begin = checks.read_only(np.append(first, len(self.time)).astype(np.int64))

    def _refuse_twice(self) -> None:
        """A satellite that counts twice in an epoch would make the position look better than it
        is."""
        _, which = np.unique(self.satellite, return_inverse=True)
        key = (self.epoch * (which.max(initial=0) + 1) + which.reshape(-1)) * len(
            self.system_names
        ) + self.system_code
        order = np.argsort(key, kind="stable")
        for k in order[1:][np.diff(key[order]) == 0][:1]:
            raise ConfigError(
                f"satellite: expected each once an epoch, got {str(self.satellite[k])!r} twice "
                f"at {self.time[k]:g} s"
            )

    @property
    def epochs(self) -> int:
        """T."""
        return len(self.epoch_time)

    @property
    def epoch(self) -> npt.NDArray[np.int64]:
        """(N,): of every row, the epoch that it belongs to."""
        return np.repeat(np.arange(self.epochs), np.diff(self.begin))

    def sky(self, position: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Elevation and azimuth [degrees], each (N,), from a position (3,) or (N, 3)."""
        return sky(position, self.position)

    def where(self, keep: npt.ArrayLike) -> Pseudoranges:
        """Only the rows where ``keep`` (N,) is True. Epochs without any disappear; with a sigma of
        infinity instead they stay."""
        mask = np.asarray(keep)
        if mask.dtype != np.bool_ or mask.shape != self.time.shape:
            raise ShapeError(f"keep: expected {len(self.time)} booleans, got {mask.shape}")
        return self._with(mask)

    def with_sigma(self, sigma: npt.ArrayLike) -> Pseudoranges:
        """With other standard deviations (N,); infinity for what is not to be used."""
        return self._with(slice(None), sigma=np.broadcast_to(
            _numbers("sigma", sigma, (), self.time.shape), self.time.shape
        ))  # fmt: skip

    def with_bias(self, bias: npt.ArrayLike) -> Pseudoranges:
        """With ``bias`` (N,) [m] added to the pseudoranges."""
        return self._with(
            slice(None), pseudorange=self.pseudorange + _numbers("bias", bias, (), self.time.shape)
        )

    def _with(self, rows: Any, **changed: FloatArray) -> Pseudoranges:
        columns = {
            "time": self.time, "satellite": self.satellite, "position": self.position,
            "pseudorange": self.pseudorange, "sigma": self.sigma, "system": self.system, **changed,
        }  # fmt: skip
        other = Pseudoranges.__new__(Pseudoranges)
        other._set(rows, **columns)
        return other


def elevation_sigma(elevation_deg: npt.ArrayLike, zenith: float) -> FloatArray:
    """σ = ``zenith`` / sin(elevation) [m]; infinity at the horizon and below: not to be used."""
    a = checks.positive("zenith", zenith)
    sine = np.sin(np.radians(checks.floats("elevation_deg", elevation_deg)))
    with np.errstate(divide="ignore"):
        return np.where(sine > 0, a / np.where(sine > 0, sine, 1.0), np.inf)


def _numbers(name: str, values: npt.ArrayLike, *shapes: tuple[int, ...]) -> FloatArray:
    """Of one of these shapes; NaN and infinity stay."""
    given = checks.floats(name, values)
    if given.shape not in shapes:
        expected = " or ".join(str(shape) for shape in shapes)
        raise ShapeError(f"{name}: expected shape {expected}, got {given.shape}")
    return np.array(given, dtype=np.float64)


def _names(name: str, values: Any, n: int) -> npt.NDArray[Any]:
    given = np.asarray(values)
    if given.shape != (n,):
        raise ShapeError(f"{name}: expected shape ({n},), got {given.shape}")
    return given.astype(np.str_)
