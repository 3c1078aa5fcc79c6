"""What the tests of refused arguments share."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import surefix as sf

HALF = [[0.5, 0.5], [0.5, 0.5]]
TWO = [(1, 1), (0, 1)]
I2, I1 = np.eye(2), np.eye(1)
SHAPE, VALUE, ANY = sf.ShapeError, sf.ConfigError, sf.SurefixError
Refused = tuple[Callable[[], Any], type[Exception], str]


def refuses(cases: dict[str, Refused]) -> pytest.MarkDecorator:
    return pytest.mark.parametrize(("make", "error", "message"), cases.values(), ids=cases.keys())


def chain(modes: Any = TWO, transition: Any = HALF, initial: Any = None) -> sf.ModeChain:
    return sf.ModeChain(modes, transition, initial)
