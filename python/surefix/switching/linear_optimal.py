"""The best filter that is linear in the measurements."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy.typing as npt

from surefix import _core
from surefix.core import checks
from surefix.core.linear_system import LinearSystem
from surefix.switching import series
from surefix.switching.mode_chain import ModeChain
from surefix.switching.result import SwitchingResult


@dataclass(frozen=True)
class LinearCondition:
    """Lemma 2: the filter is the linear optimum if Pr(gamma_k = 1 | gamma_i = 1) is the same for
    all i < k.

    ``p11``: of neighbours, i = k - 1, at the last step; ``lowest``, ``highest``: over all k and i;
    ``spread``: the largest difference between two i of one k, which must be zero; ``lags``: so many
    earlier i at most were looked at for a k, the last ones with E[gamma_i] != 0. ``holds``: spread
    <= 1e-9.
    """

    holds: bool
    p11: float
    lowest: float
    highest: float
    spread: float
    lags: int

    def __str__(self) -> str:
        if self.holds:
            return f"Lemma 2 holds: Pr(gamma_k = 1 | gamma_i = 1) = {self.p11:.6g} for all i < k"
        return (
            f"Lemma 2 does not hold: Pr(gamma_k = 1 | gamma_i = 1) goes from {self.lowest:.6g} to "
            f"{self.highest:.6g} over the {self.lags} i before k with E[gamma_i] != 0; the filter "
            f"takes that of neighbours, {self.p11:.6g}, and is not the linear optimum"
        )


class LinearOptimalFilter:
    """The linear optimal filter (Sigalov & Oshman, section V, (23a-e)); Nahi's where gamma is drawn
    anew and delta is 1, Hadidi's and Schwartz' where delta is 1.

    Its gains do not depend on the measurements. It is the optimum among linear filters if
    ``condition(steps)`` holds. The ``P`` of its results is its exact mean-square error for this
    chain in either case. gamma may have any levels: E[gamma_k gamma_i] / E[gamma_i] stands for
    Pr(gamma_k = 1 | gamma_i = 1), and E[gamma^2] for the E[gamma] that multiplies H C H'.

    An interrupted measurement is noise around zero, so that the estimate depends on where the
    origin of the state lies: far from it an interruption is a large error, and a linear filter has
    no means to see it. ``nominal`` (steps, n) moves the origin along: with it the filter estimates
    the deviation from it, which begins as N(0, P0) and moves as the system does, from
    z - E[gamma] H nominal; (gamma - E[gamma]) H nominal is then part of the noise. That is the best
    affine filter where gamma is drawn anew in each step. ``x0`` of the system is then not used, and
    the path need not follow A.
    """

    def __init__(
        self, system: LinearSystem, chain: ModeChain, nominal: npt.ArrayLike | None = None
    ) -> None:
        self.system = checks.instance("system", system, LinearSystem)
        self.chain = checks.instance("chain", chain, ModeChain)
        steps = series.one_length([system], chain)
        self.nominal = (
            None if nominal is None else checks.array("nominal", nominal, (steps, system.size))
        )
        self._steps = steps if self.nominal is None else len(self.nominal)
        self._engine = series.made(
            _core.LinearFilterEngine.make(system.engine, chain.engine, chain.p, self.nominal),
            "system",
        )

    def condition(self, steps: int) -> LinearCondition:
        """Whether the chain lets the filter be optimal over ``steps`` measurements (Lemma 2)."""
        count = checks.whole("steps", steps, 2, self.chain.steps or (1 << 31) - 1)
        return LinearCondition(*_core.check_linear(self.chain.engine, self.chain.p, count))

    def run(
        self,
        z: npt.ArrayLike,
        missing: npt.ArrayLike | None = None,
        threads: int | None = None,
    ) -> SwitchingResult:
        """As ``OneStepFilter.run``. A series that lacks measurements has gains of its own, which
        takes some microseconds a step."""
        return series.run(
            self._engine, z, missing, threads, measured=self.system.measured, steps=self._steps,
            n=self.system.size, M=0, likelihood=False, states=self.system.states,
            trouble="system, chain: at {where} the matrix of the gain overflows or is not definite",
        )  # fmt: skip

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.system, self.chain, self.nominal)
