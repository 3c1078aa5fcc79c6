"""Estimates at a rate: how many, and which rates are refused before anything is allocated."""

from __future__ import annotations

import pytest

import surefix as sf

TOO_MANY = "rate: {} are {} estimates, expected at most 20000000"
BEYOND = r"rate: .*the last estimate would be at .* s, expected at most 3e\+09 s"


def run(rate: float, last: float) -> sf.Result:
    filter = sf.DesyncFilter(
        sf.ConstantVelocity(1.0), [sf.Sensor("w", 1.0)], [0.0], [[1.0]], start=0.0
    )
    return filter.run(sf.Log([0.0, last], ["w", "w"], [1.0, 1.0]), rate=rate)


@pytest.mark.parametrize(
    ("rate", "last", "message"),
    [
        (5.0, 3.15e7, TOO_MANY.format(r"5 a second from 0 s to 3\.15e\+07 s", 157500000)),
        (20_000_001.0, 1.0, TOO_MANY.format(".*", 20000001)),
        (1e300, 3e9, TOO_MANY.format(".*", "inf")),
        (1e-12, 1.0, BEYOND),
        (1e-320, 1.0, BEYOND),
        (1 / 7000, 3e9 - 0.5, BEYOND),
    ],
)
def test_rates_that_cannot_be(rate: float, last: float, message: str) -> None:
    with pytest.raises(sf.ConfigError, match=message):
        run(rate, last)


@pytest.mark.parametrize(
    ("rate", "last", "times"),
    [
        (1e-9, 1.0, [1e9]),
        (4.0, 0.5, [0.25, 0.5]),
        (4.0, 0.500000001, [0.25, 0.5, 0.75]),
        (3.0, 1.0, [0.333333333, 0.666666667, 1.0]),
        (0.7, 10.0, [round(k / 0.7, 9) for k in range(1, 8)]),
    ],
)
def test_estimates_until_the_log_is_used_up(rate: float, last: float, times: list[float]) -> None:
    result = run(rate, last)
    assert result.time.tolist() == times
    assert result.counts == {"ok": 2}
