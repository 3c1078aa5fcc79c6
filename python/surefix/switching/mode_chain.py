"""The Markov chain of the modes (gamma, delta) of a measurement."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from surefix import _core
from surefix.core import checks
from surefix.core.checks import FloatArray
from surefix.errors import ConfigError, ShapeError

MAX_MODES = 64


class ModeChain:
    """M modes and how they follow each other (Sigalov & Oshman, Problem 4, which holds 1 to 3).

    ``modes``: pairs (gamma, delta); gamma multiplies what is measured of the state (1 healthy, 0
    interrupted, or any other number), delta > 0 the covariance of the noise. Pairs may repeat.
    ``transition``: (M, M), or (steps - 1, M, M) where entry k leads from measurement k to k + 1;
    **rows are the mode before, columns the mode after**. ``initial`` (M,): the law of the mode at
    the first measurement, by default the stationary one; needed where there is no single one, and
    where the transitions differ from step to step.

    Raises ConfigError or ShapeError that names row and column of what is no law.
    """

    def __init__(
        self,
        modes: Sequence[tuple[float, float]],
        transition: npt.ArrayLike,
        initial: npt.ArrayLike | None = None,
    ) -> None:
        pairs = _pairs(modes)
        self.p = _transitions("transition", transition, len(pairs))
        """Transitions (1 or steps - 1, M, M), every row summing to one."""
        if initial is None and len(self.p) > 1:
            raise ConfigError(
                "initial: expected a law, because the transitions differ from step to step"
            )
        law = None if initial is None else checks.array("initial", initial, (len(pairs),))
        self._set(_made(_core.ModeChainEngine.make(pairs, self.p[0], law), pairs))

    def _set(self, engine: _core.ModeChainEngine) -> None:
        self.engine = engine
        self.initial = checks.read_only(engine.initial)
        """Law of the first mode (M,)."""
        self.branches = tuple(tuple(mode) for mode in engine.branches)
        """Of every mode its (delta, share); more than one where modes were lumped."""
        self.modes = tuple(
            (gamma, sum(delta * share for delta, share in branches))
            for gamma, branches in zip(engine.gamma, self.branches, strict=True)
        )
        """(gamma, delta) of every mode; of lumped ones the mean delta."""

    @classmethod
    def independent_draws(
        cls, gamma: Mapping[float, float], delta: Mapping[float, float]
    ) -> ModeChain:
        """Problem 1: gamma and delta drawn anew in each step, independent of each other; values
        with their probabilities, delta runs fastest."""
        g, d = _law("gamma", gamma), _law("delta", delta)
        return cls(
            [(a, b) for a in g for b in d],
            np.tile([p * q for p in g.values() for q in d.values()], (len(g) * len(d), 1)),
        )

    @classmethod
    def joint_draws(cls, probability: Mapping[tuple[float, float], float]) -> ModeChain:
        """Problem 2: pairs (gamma, delta) drawn anew in each step, with their probabilities."""
        if not isinstance(probability, Mapping):
            raise ConfigError(
                f"probability: expected {{(gamma, delta): probability}}, got {probability!r}"
            )
        rows = np.tile(
            [checks.number("probability", p) for p in probability.values()], (len(probability), 1)
        )
        return cls(list(probability), rows)

    @classmethod
    def independent_chains(
        cls,
        gamma_levels: Sequence[float],
        gamma_transition: npt.ArrayLike,
        delta_levels: Sequence[float],
        delta_transition: npt.ArrayLike,
    ) -> ModeChain:
        """Problem 3: a chain of gamma beside an independent one of delta; delta runs fastest."""
        g = checks.array("gamma_levels", gamma_levels, (None,))
        d = checks.array("delta_levels", delta_levels, (None,))
        first = _transitions("gamma_transition", gamma_transition, len(g))
        second = _transitions("delta_transition", delta_transition, len(d))
        for name, P in (("gamma_transition", first), ("delta_transition", second)):
            if len(P) > 1:
                raise ShapeError(f"{name}: expected one matrix, got {len(P)}")
        made = _core.ModeChainEngine.independent(g.tolist(), first[0], d.tolist(), second[0])
        chain = cls.__new__(cls)
        chain._set(_made(made, [(a, b) for a in g for b in d]))
        chain.p = checks.read_only(chain.engine.transition[None])
        return chain

    @classmethod
    def from_rates(
        cls,
        modes: Sequence[tuple[float, float]],
        rates: npt.ArrayLike,
        dt: npt.ArrayLike,
        initial: npt.ArrayLike | None = None,
    ) -> ModeChain:
        """A chain in continuous time: transitions e^(G dt) with rates G (M, M) [1/s] from row to
        column (the diagonal is not read), over ``dt`` [s], a number or (steps - 1,)."""
        G = checks.array("rates", rates, (len(_pairs(modes)),) * 2)
        for i, j in np.argwhere(G < 0):
            if i != j:
                raise ConfigError(
                    f"rates: expected numbers >= 0, got {G[i, j]} at {(int(i), int(j))}"
                )
        durations = np.atleast_1d(checks.array("dt", dt, (None,) if np.ndim(dt) else ()))
        if (durations < 0).any():
            raise ConfigError(f"dt: expected numbers >= 0, got {durations.min()}")
        known = {d: _core.transition_over(G, float(d)) for d in np.unique(durations)}
        P = np.array([known[d] for d in durations])
        if initial is None:
            off = G - np.diag(np.diag(G))
            fastest = off.sum(axis=1).max()
            U = np.eye(len(G)) + (off - np.diag(off.sum(axis=1))) / (2 * fastest or 1.0)
            initial = _core.stationary(U)
            if initial is None:
                raise ConfigError(
                    "initial: expected a law, because the rates have several that stay"
                )
        return cls(modes, P if len(P) > 1 else P[0], initial)

    @property
    def size(self) -> int:
        """Number of modes M."""
        return len(self.modes)

    @property
    def transition(self) -> FloatArray:
        """(M, M), or (steps - 1, M, M) where they differ; rows before, columns after."""
        return self.p if len(self.p) > 1 else checks.read_only(self.p[0])

    @property
    def steps(self) -> int | None:
        """The number of measurements that it is for; None: any."""
        return len(self.p) + 1 if len(self.p) > 1 else None

    def stationary(self) -> FloatArray:
        """The law that the transitions leave as it is (M,). ConfigError if there is more than one,
        or if the transitions differ from step to step."""
        if len(self.p) > 1:
            raise ConfigError("stationary: the transitions differ from step to step")
        law = _core.stationary(self.p[0])
        if law is None:
            raise ConfigError("stationary: there is more than one law that stays")
        return checks.read_only(law)

    def law(self, steps: int) -> FloatArray:
        """Law of the mode at each of the first ``steps`` measurements (steps, M)."""
        count = checks.whole("steps", steps, 1, self.steps or 1 << 31)
        laws = [self.initial]
        for k in range(count - 1):
            laws.append(laws[-1] @ self.p[k if len(self.p) > 1 else 0])
        return np.array(laws)

    def lumped(self, groups: Sequence[Sequence[int]]) -> ModeChain:
        """The chain whose modes are groups of this one's, each mode in one of them.

        A group of several may only hold modes of gamma = 0, whose estimate does not depend on
        delta. Its measurement has the mixed density of its members, its transitions are theirs, by
        the shares that they have in the stationary law (in ``initial`` where there is none): exact
        where those shares do not depend on the mode before.
        """
        try:
            sets = [[int(i) for i in group] for group in groups]
        except TypeError:
            raise ConfigError(f"groups: expected lists of modes, got {groups!r}") from None
        same = len(self.p) == 1
        law = _core.stationary(self.p[0]) if same else None
        law = self.initial if law is None else law
        made = self.engine.lumped(sets, law)
        if isinstance(made, tuple):
            _, mode, _, gamma = made
            what = f"mode {mode} of gamma {gamma:g}" if gamma else f"mode {mode}, or an empty group"
            raise ConfigError(
                f"groups: expected each of {self.size} modes in one group, several in one only if "
                f"their gamma is 0; got {what} in {sets}"
            )
        chain = ModeChain.__new__(ModeChain)
        chain._set(made)
        if same:
            chain.p = checks.read_only(made.transition[None])
            return chain
        member = np.array([[i in group for i in range(self.size)] for group in sets], dtype=float)
        share = member * law
        total = share.sum(axis=1, keepdims=True)
        share = np.where(total > 0, share / np.where(total > 0, total, 1.0),
                         member / member.sum(axis=1, keepdims=True))  # fmt: skip
        chain.p = _transitions("transition", share @ self.p @ member.T, len(sets))
        return chain

    def lumped_interruptions(self) -> ModeChain:
        """All modes of gamma = 0 in one, the last: the paper's three modes (section IV)."""
        healthy = [[i] for i, (gamma, _) in enumerate(self.modes) if gamma != 0]
        cut = [i for i, (gamma, _) in enumerate(self.modes) if gamma == 0]
        if not cut:
            raise ConfigError(f"modes: expected one with gamma = 0, got {self.modes}")
        return self.lumped([*healthy, cut])

    def __repr__(self) -> str:
        return f"ModeChain(modes={self.modes}, initial={self.initial.tolist()})"

    def __getstate__(self) -> dict[str, Any]:
        return {
            "gamma": self.engine.gamma, "branches": self.branches, "p": self.p,
            "initial": self.initial,
        }  # fmt: skip

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.p = checks.read_only(state["p"])
        self._set(
            _core.ModeChainEngine.restore(
                state["gamma"], state["branches"], self.p[0], state["initial"]
            )
        )


def _pairs(modes: Any) -> list[tuple[float, float]]:
    """Checked pairs (gamma, delta)."""
    try:
        given = [tuple(mode) for mode in modes]
        pairs = [(float(gamma), float(delta)) for gamma, delta in given]
    except (TypeError, ValueError):
        raise ConfigError(f"modes: expected pairs (gamma, delta), got {modes!r}") from None
    if not 1 <= len(pairs) <= MAX_MODES:
        raise ConfigError(f"modes: expected 1 to {MAX_MODES}, got {len(pairs)}")
    for j, (gamma, delta) in enumerate(pairs):
        if not np.isfinite(gamma):
            raise ConfigError(f"modes: expected a finite gamma, got {gamma} in mode {j}")
        if not (np.isfinite(delta) and delta > 0):
            raise ConfigError(f"modes: expected a finite delta > 0, got {delta} in mode {j}")
    return pairs


def _law(name: str, law: Any) -> dict[float, float]:
    if not isinstance(law, Mapping) or not law:
        raise ConfigError(f"{name}: expected {{value: probability}}, got {law!r}")
    checked = {
        checks.number(name, value): checks.not_negative(f"{name} probability", p)
        for value, p in law.items()
    }
    total = sum(checked.values())
    if abs(total - 1) > 1e-9:
        raise ConfigError(f"{name}: expected probabilities that sum to 1, got {total:.12g}")
    return checked


def _transitions(name: str, value: Any, size: int) -> FloatArray:
    """(k, M, M) whose rows are laws, or an error that says which is not."""
    stack = checks.array(name, value, (None, size, size) if np.ndim(value) == 3 else (size, size))
    stack = stack if stack.ndim == 3 else stack[None]
    if size == 0 or len(stack) == 0:
        raise ShapeError(f"{name}: expected one or more modes and steps, got {stack.shape}")
    checked = np.empty_like(stack)
    for k, P in enumerate(stack):
        answer = _core.check_transition(P)
        if isinstance(answer, tuple):
            what, row, column, number = answer
            where = f"{name}[{k}]" if len(stack) > 1 else name
            if what == "negative":
                raise ConfigError(
                    f"{where}: expected probabilities >= 0, got {number:g} at {(row, column)}"
                )
            raise ConfigError(
                f"{where}: expected rows (the mode before) that sum to 1, "
                f"got {number:.12g} in row {row}"
            )
        checked[k] = answer
    return checks.read_only(checked)


def _made(made: Any, pairs: Sequence[tuple[float, float]]) -> _core.ModeChainEngine:
    """The engine's chain, or the error that it found."""
    if isinstance(made, _core.ModeChainEngine):
        return made
    what, row, column, number = made
    if what == "reducible":
        raise ConfigError(
            "initial: expected a law, because the transitions have more than one that stays"
        )
    if what == "initial":
        detail = f"{number:g} for mode {column}" if column >= 0 else f"a sum of {number:.12g}"
        raise ConfigError(f"initial: expected probabilities >= 0 that sum to 1, got {detail}")
    raise ConfigError(f"modes: {what} in mode {row}: {number} of {pairs}")
