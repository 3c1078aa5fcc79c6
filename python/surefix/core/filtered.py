"""What the results of all filters have in common."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from surefix import _core
from surefix.core.checks import FloatArray
from surefix.errors import SurefixError

if TYPE_CHECKING:
    import pandas as pd


class Filtered:
    """T estimates of n states, from a log of N rows; see ``Result`` and ``RobustResult``."""

    time: FloatArray
    x: FloatArray
    P: FloatArray
    status: npt.NDArray[np.uint8]
    noise: FloatArray
    noise_variance: FloatArray
    output: int
    state_names: tuple[str, ...]

    @property
    def estimate(self) -> FloatArray:
        """The model's output, usually the speed (T,)."""
        return self.x[:, self.output]

    @property
    def sigma(self) -> FloatArray:
        """Standard deviation of ``estimate`` (T,)."""
        return np.sqrt(self.P[:, self.output, self.output])

    @property
    def normalised_noise(self) -> FloatArray:
        """v̂ / √variance (N,): N(0, 1) if the model is right, NaN where there is none."""
        return self.noise / np.sqrt(self.noise_variance)

    @property
    def counts(self) -> dict[str, int]:
        """How many rows had each status; those that did not occur are left out."""
        found = np.bincount(self.status, minlength=len(_core.STATUS_NAMES))
        return {_core.STATUS_NAMES[i]: int(found[i]) for i in np.flatnonzero(found)}

    def columns(self) -> dict[str, npt.NDArray[Any]]:
        """Time, states and their standard deviations as named arrays (T,)."""
        deviation = np.sqrt(np.diagonal(self.P, axis1=1, axis2=2))
        table: dict[str, npt.NDArray[Any]] = {"time_s": self.time}
        table.update({name: self.x[:, i] for i, name in enumerate(self.state_names)})
        table.update({f"{n}_sigma": deviation[:, i] for i, n in enumerate(self.state_names)})
        return table

    def to_pandas(self) -> pd.DataFrame:
        """One row per estimate: the columns of ``columns``."""
        try:
            import pandas as pd
        except ImportError:
            raise SurefixError("to_pandas needs pandas: pip install surefix[io]") from None
        return pd.DataFrame(self.columns())
