"""The Markov chain of the modes (gamma, delta) of a measurement."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any, cast

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
    ``transition``: (M, M), or for 2 or more steps (steps - 1, M, M) where entry k leads from
    measurement k to k + 1; **rows are the mode before, columns the mode after**. ``initial`` (M,):
    the law of the mode at the first measurement, by default the stationary one; needed where there
    is no single one, and where there is a transition for every step.

    Raises ConfigError or ShapeError that names row and column of what is no law.
    """

    def __init__(
        self,
        modes: Sequence[tuple[float, float]],
        transition: npt.ArrayLike,
        initial: npt.ArrayLike | None = None,
    ) -> None:
        pairs = _pairs(modes)
        P = _transitions("transition", transition, len(pairs))
        if initial is None and P.ndim == 3:
            raise ConfigError("initial: expected a law, because each step has its own transition")
        law = None if initial is None else checks.array("initial", initial, (len(pairs),))
        first = checks.per_step(P)[0]
        self._set(_made(_core.ModeChainEngine.make(pairs, first, law), pairs), P)

    def _set(self, engine: _core.ModeChainEngine, transition: FloatArray) -> None:
        self.engine = engine
        self.transition = checks.read_only(transition)
        """(M, M), or (steps - 1, M, M) of a transition for every step; rows before, columns
        after."""
        self.p = checks.per_step(self.transition)
        """The same with the axis of steps in any case."""
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
        g = _law("gamma", gamma, "gamma probability")
        d = _law("delta", delta, "delta probability")
        return cls(list(product(gamma, delta)), np.tile(np.kron(g, d), (len(g) * len(d), 1)))

    @classmethod
    def joint_draws(cls, probability: Mapping[tuple[float, float], float]) -> ModeChain:
        """Problem 2: pairs (gamma, delta) drawn anew in each step, with their probabilities."""
        law = _law("probability", probability, "probability")
        return cls(list(probability), np.tile(law, (len(law), 1)))

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
        pairs = _pairs(product(g, d))
        first = _settling("gamma_transition", gamma_transition, len(g))
        second = _settling("delta_transition", delta_transition, len(d))
        made = _core.ModeChainEngine.independent(g.tolist(), first, d.tolist(), second)
        chain = cls.__new__(cls)
        engine = _made(made, pairs)
        chain._set(engine, engine.transition)
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
        durations = checks.array("dt", dt, (), (None,))
        if durations.size == 0:
            raise ShapeError("dt: expected a number, or one for each of 1 or more steps, got none")
        if durations.min() < 0:
            raise ConfigError(f"dt: expected numbers >= 0, got {durations.min()}")
        different, which = np.unique(durations, return_inverse=True)
        off = G - np.diag(np.diag(G))
        with np.errstate(over="ignore"):
            leaving = off.sum(axis=1)
        if not np.isfinite(leaving).all():
            row = int(np.argmax(leaving))
            raise ConfigError(
                f"rates: expected a finite sum in each row, got infinity in row {row}"
            )
        known = np.array([_over(G, float(d), leaving.max()) for d in different])
        P = known[which.reshape(durations.shape)]
        if initial is None:
            scale = leaving.max() or 1.0
            U = np.eye(len(G)) + (off / scale - np.diag(leaving / scale)) / 2
            initial = _core.stationary(U)
            if initial is None:
                raise ConfigError(
                    "initial: expected a law, because the rates have several that stay"
                )
        return cls(modes, P, initial)

    @property
    def size(self) -> int:
        """Number of modes M."""
        return len(self.modes)

    @property
    def steps(self) -> int | None:
        """The number of measurements that it is for; None: any."""
        return len(self.transition) + 1 if self.transition.ndim == 3 else None

    def stationary(self) -> FloatArray:
        """The law that the transitions leave as it is (M,). ConfigError if there is more than one,
        or if each step has its own transition."""
        if self.steps is not None:
            raise ConfigError("stationary: each step has its own transition")
        law = _core.stationary(self.transition)
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
        the shares that they have in the stationary law; in ``initial`` where there is none; in the
        mean law over its steps where each step has its own transition (equal shares of a group that
        is never there). Exact where the members' shares are the same whatever the mode before was,
        and in ``initial``.
        """
        try:
            sets = [
                [checks.whole("groups", i, 0, self.size - 1) for i in group] for group in groups
            ]
        except TypeError:
            raise ConfigError(f"groups: expected lists of modes, got {groups!r}") from None
        steps = self.steps
        law = _core.stationary(self.transition) if steps is None else self.law(steps).mean(axis=0)
        law = self.initial if law is None else law
        parts = [self._engine_of(P).lumped(sets, law) for P in self.p]
        lumped = [part for part in parts if isinstance(part, _core.ModeChainEngine)]
        if not lumped:  # it is the groups that are wrong, so all of them are
            _, mode, _, gamma = cast(tuple[str, int, int, float], parts[0])
            what = f"mode {mode} of gamma {gamma:g}" if gamma else f"mode {mode}, or an empty group"
            raise ConfigError(
                f"groups: expected each of {self.size} modes in one group, several in one only if "
                f"their gamma is 0; got {what} in {sets}"
            )
        P = np.array([part.transition for part in lumped])
        chain = ModeChain.__new__(ModeChain)
        chain._set(lumped[0], P[0] if steps is None else P)
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
            "gamma": self.engine.gamma, "branches": self.branches, "transition": self.transition,
            "initial": self.initial,
        }  # fmt: skip

    def __setstate__(self, state: dict[str, Any]) -> None:
        P = state["transition"]
        engine = _core.ModeChainEngine.restore(
            state["gamma"], state["branches"], checks.per_step(P)[0], state["initial"]
        )
        self._set(engine, P)

    def _engine_of(self, P: FloatArray) -> _core.ModeChainEngine:
        """The engine's chain with these transitions of one step."""
        return _core.ModeChainEngine.restore(self.engine.gamma, self.branches, P, self.initial)


def _pairs(modes: Any) -> list[tuple[float, float]]:
    """Checked pairs (gamma, delta)."""
    try:
        given = [(gamma, delta) for gamma, delta in modes]
    except (TypeError, ValueError):
        raise ConfigError(f"modes: expected pairs (gamma, delta), got {modes!r}") from None
    if not 1 <= len(given) <= MAX_MODES:
        raise ConfigError(f"modes: expected 1 to {MAX_MODES}, got {len(given)}")
    return [
        (checks.number(f"modes[{j}] gamma", gamma), checks.positive(f"modes[{j}] delta", delta))
        for j, (gamma, delta) in enumerate(given)
    ]


def _law(name: str, law: Any, entry: str) -> list[float]:
    """Checked probabilities of a law; ``entry``: what one of them is called."""
    if not isinstance(law, Mapping) or not law:
        raise ConfigError(f"{name}: expected {{value: probability}}, got {law!r}")
    checked = [checks.not_negative(entry, p) for p in law.values()]
    if abs(sum(checked) - 1) > 1e-9:
        raise ConfigError(
            f"{name}: expected probabilities that sum to 1, got a sum of {sum(checked):.12g}"
        )
    return checked


def _over(rates: FloatArray, dt: float, fastest: float) -> FloatArray:
    """Transitions over dt, or an error where they overflow."""
    P = _core.transition_over(rates, dt)
    if isinstance(P, str) or not np.isfinite(P).all():
        raise ConfigError(
            f"rates, dt: expected transitions that are finite, got rates up to {fastest:g} "
            f"over {dt:g}"
        )
    return P


def _transitions(name: str, value: Any, size: int) -> FloatArray:
    """(M, M) or (k, M, M), k >= 1, whose rows are laws, or an error that says which is not."""
    given = checks.array(name, value, (size, size), (None, size, size))
    if given.ndim == 2:
        return _checked(name, given)
    if len(given) == 0:
        raise ShapeError(f"{name}: expected one or more steps, got {given.shape}")
    return np.array([_checked(f"{name}[{k}]", P) for k, P in enumerate(given)])


def _checked(name: str, P: FloatArray) -> FloatArray:
    """A square matrix whose rows are laws, each scaled to sum to one exactly."""
    answer = _core.check_transition(P)
    if not isinstance(answer, tuple):
        return answer
    what, row, column, number = answer
    if what == "negative":
        raise ConfigError(f"{name}: expected probabilities >= 0, got {number:g} at {(row, column)}")
    raise ConfigError(
        f"{name}: expected rows (the mode before) that sum to 1, got {number:.12g} in row {row}"
    )


def _settling(name: str, value: Any, size: int) -> FloatArray:
    """(M, M) of a chain that has one stationary law."""
    P = _checked(name, checks.array(name, value, (size, size)))
    if _core.stationary(P) is None:
        raise ConfigError(f"{name}: expected one stationary law, got several of {P.tolist()}")
    return P


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
