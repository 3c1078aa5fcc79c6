"""Tests of the innovations that the detectors of slow faults are compared with.

With no fault the normalised innovations are independent and standard normal, so each statistic
has a threshold in closed form: N of their squares are χ²_N, w of them χ²_w, and twice their
periodogram at a whole number of cycles between 0 and N/2 is χ²_2 and independent of the others;
the largest of m independent ones is below u with the m-th power of one's probability.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

import surefix as sf
from surefix import _core
from surefix.core.checks import FloatArray

LEVELS = (1e-1, 1e-2, 1e-3)  # probabilities of false alarm
WINDOW = 10  # samples

Rows = list[dict[str, Any]]
Statistics = Mapping[str, FloatArray]

PEERS = {
    "nis_total": "NIS over all samples",
    "nis_window": f"NIS, largest of the windows of {WINDOW}",
    "innovation_spectrum": "spectrum of the innovations, largest",
}


def normalised(record: sf.ForwardRecord) -> FloatArray:
    """Innovations over their standard deviations (runs, N), of one component."""
    result: FloatArray = np.copysign(np.sqrt(record.nis), record.innovations)
    return result


def statistics(record: sf.ForwardRecord) -> dict[str, FloatArray]:
    """(runs,) of each of ``PEERS``."""
    nis = record.nis
    runs, N = nis.shape
    windows = nis.reshape(runs, N // WINDOW, WINDOW).sum(axis=2)
    power = np.abs(np.fft.rfft(normalised(record), axis=1)[:, 1 : (N + 1) // 2]) ** 2
    return {
        "nis_total": nis.sum(axis=1),
        "nis_window": windows.max(axis=1),
        "innovation_spectrum": 2 / N * power.max(axis=1),
    }


def threshold(name: str, false_alarm: float, N: int) -> float:
    """What the statistic exceeds with this probability where there is no fault."""
    degrees, count = {
        "nis_total": (N, 1),
        "nis_window": (WINDOW, N // WINDOW),
        "innovation_spectrum": (2, (N + 1) // 2 - 1),
    }[name]
    alone = -np.expm1(np.log1p(-false_alarm) / count)
    return float(_core.chi_squared_threshold(alone, float(degrees)))


def thresholds(
    exact: Callable[[float], float | None], drawn: Statistics, N: int
) -> dict[str, list[float]]:
    """By test, at ``LEVELS``: ``exact`` gives that of the exact ratio; quantiles of ``drawn``, in
    healthy runs (runs,), those of tests that have none; then ``PEERS``."""
    found = {"exact": [float(exact(p) or np.inf) for p in LEVELS]}
    for name, healthy in drawn.items():
        found[name] = [float(np.quantile(healthy, 1 - p, method="higher")) for p in LEVELS]
    return found | {peer: [threshold(peer, p, N) for p in LEVELS] for peer in PEERS}


def shares(by_test: Statistics, limits: Mapping[str, list[float]], **what: float | str) -> Rows:
    """A row for each of ``LEVELS``: the share of runs that each test finds."""
    return [
        {**what, "false_alarm": p, "runs": len(by_test["exact"])}
        | {name: float((by_test[name] > limit[i]).mean()) for name, limit in limits.items()}
        for i, p in enumerate(LEVELS)
    ]


def columns(rows: Rows) -> dict[str, FloatArray]:
    """Rows as a table."""
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


def lines(
    rows: Rows, of: str, names: Mapping[str, str], levels: Sequence[float] = LEVELS
) -> list[str]:
    """The rows of ``shares`` as text: a block for each level, with a column for each value of
    ``of``."""
    text = []
    for p in levels:
        block = [row for row in rows if row["false_alarm"] == p]
        heads = [f"{row[of]:g}" if row[of] else "healthy" for row in block]
        text.append(f"{f'false alarms {p:g}; {of}':<44}" + "".join(f"{h:>9}" for h in heads))
        for name, label in names.items():
            text.append(f"{label:<44}" + "".join(f"{row[name]:>9.2%}" for row in block))
    return text
