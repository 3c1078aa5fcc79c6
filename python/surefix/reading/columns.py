"""What is read of a file, column by column."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

Progress = Callable[[int, int], None]
"""Called now and then with (done, total)."""


class TableColumn(NamedTuple):
    """``values`` (rows,): numbers, names or times; ``empty`` (rows,): cells that hold nothing, NaN
    in ``values``."""

    values: npt.NDArray[Any]
    empty: npt.NDArray[np.bool_]
