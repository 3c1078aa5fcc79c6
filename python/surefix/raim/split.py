"""A compact set in pieces, each with an affine model that is good enough."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from surefix.core import checks
from surefix.core.checks import FloatArray
from surefix.core.distributions import noncentral_chi_squared_cdf
from surefix.errors import ConfigError
from surefix.raim.affine import AffineModel, Function, affine_bound
from surefix.raim.linear_test import LinearTestResult, result


class SplitModel:
    """Affine models of the ``pieces`` of K; together they test whether there is a fault wherever in
    K the nuisance is: alarm when every piece alarms, for the nuisance may be in any of them.

    That costs ``cost`` tests an epoch, and power: a fault may look like no fault in another piece.
    False alarms: at most α + the largest e₂ of the pieces. ``most_missed`` bounds the rest.
    """

    def __init__(self, pieces: tuple[AffineModel, ...]) -> None:
        self.pieces = pieces

    @property
    def cost(self) -> int:
        """Tests an epoch."""
        return len(self.pieces)

    def run(self, Y: npt.ArrayLike) -> LinearTestResult:
        """Tests Y (n,) or (epochs, n). Statistic, parity and threshold are those of the piece whose
        p-value is the largest."""
        rows = np.atleast_2d(checks.floats("Y", Y))
        found = [piece.run(rows) for piece in self.pieces]
        p = np.array([np.where(f.available, f.p_value, 1.0) for f in found])
        best = np.argmax(np.where(np.isnan(p), -1.0, p), axis=0)
        most = max(f.parity.shape[1] for f in found)
        parity = np.full((len(rows), most), np.nan)
        for k, piece in enumerate(best):
            own = found[piece].parity[k]
            parity[k, : len(own)] = own
        take = np.arange(len(rows))

        def of(name: str) -> Any:
            return np.array([getattr(f, name) for f in found])[best, take]

        return result(
            parity, of("statistic"), found[0].valid, of("degrees"),
            self.pieces[0].test.false_alarm, np.ndim(Y) == 1,
        )  # fmt: skip

    def most_missed(self, X: npt.ArrayLike, h: Function, bias: npt.ArrayLike) -> FloatArray:
        """Bound (k,) on the probability that a ``bias`` (n,) is missed at X (k, m): the sum over
        the pieces of what each misses of it, by the noncentrality that it has there."""
        at = np.atleast_2d(checks.array("X", X, (None,), (None, None)))
        values = checks.array("h", h(at), (len(at), None))
        shifted = values + checks.array("bias", bias, (values.shape[1],))
        total = np.zeros(len(at))
        for piece in self.pieces:
            noncentrality = np.asarray(piece.test.noncentrality(shifted - piece.B))
            total += np.asarray(
                noncentral_chi_squared_cdf(
                    piece.test.threshold, float(piece.degrees), noncentrality
                )
            )
        return np.minimum(total, 1.0)


def split(
    h: Function,
    low: npt.ArrayLike,
    high: npt.ArrayLike,
    *,
    e1: float,
    e2: float,
    noncentrality: float | None = None,
    bound: str = "tight",
    most: int = 1024,
    **model: Any,
) -> SplitModel:
    """Halves the box K until every piece's e₁ (at ``noncentrality``, or at any) and e₂ (at 0) are
    within the budgets. Each cut is the one, of all dimensions, that leaves the smaller bound b.

    ``h`` must be a function; ``model``: the other arguments of ``affine_bound``. Raises ConfigError
    when ``most`` pieces are not enough.
    """
    if not callable(h):
        raise ConfigError("h: expected a function, which can be looked at more closely")
    budgets = checks.positive("e1", e1), checks.positive("e2", e2)
    if noncentrality is not None:
        checks.not_negative("noncentrality", noncentrality)
    limit = checks.whole("most", most, 1, 1_000_000)

    def fits(piece: AffineModel) -> bool:
        lost = piece.e1(noncentrality=noncentrality, bound=bound)
        return bool(lost <= budgets[0] and piece.e2(bound=bound) <= budgets[1])

    waiting = [affine_bound(h, low, high, **model)]
    done: list[AffineModel] = []
    while waiting:
        piece = waiting.pop()
        if fits(piece):
            done.append(piece)
            continue
        if len(done) + len(waiting) + 2 > limit:
            raise ConfigError(
                f"most: expected pieces enough for e1 <= {e1:g} and e2 <= {e2:g}, got {limit}"
            )
        cuts = [_halves(h, piece, axis, model) for axis in range(len(piece.low))]
        waiting += min(cuts, key=lambda cut: max(half.bound(bound) for half in cut))[::-1]
    return SplitModel(tuple(done))


def _halves(
    h: Function, piece: AffineModel, axis: int, model: dict[str, Any]
) -> tuple[AffineModel, AffineModel]:
    middle = (piece.low[axis] + piece.high[axis]) / 2
    below, above = piece.high.copy(), piece.low.copy()
    below[axis] = above[axis] = middle
    return (
        affine_bound(h, piece.low, below, **model),
        affine_bound(h, above, piece.high, **model),
    )
