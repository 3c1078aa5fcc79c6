"""Filters for switching faults: one-step near-optimal, IMM, and the genie that knows the modes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from surefix import _core
from surefix.core import checks
from surefix.core.linear_system import LinearSystem
from surefix.errors import ConfigError, ShapeError
from surefix.switching import series
from surefix.switching.mode_chain import ModeChain
from surefix.switching.result import SwitchingResult


class OneStepFilter:
    """The one-step near-optimal filter (Sigalov & Oshman, section III).

    In every step each mode starts from the one merged estimate, reads the measurement, and is
    weighed by how probable it was; the answers are merged into one Gaussian again.
    """

    def __init__(self, system: LinearSystem, chain: ModeChain) -> None:
        self.system = checks.instance("system", system, LinearSystem)
        self.chain = checks.instance("chain", chain, ModeChain)
        self._steps = series.one_length([system], chain)
        self._engine = series.made(
            _core.SwitchingEngine.one_step(system.engine, chain.engine, chain.p), "system"
        )

    def run(
        self,
        z: npt.ArrayLike,
        missing: npt.ArrayLike | None = None,
        threads: int | None = None,
    ) -> SwitchingResult:
        """Estimates from measurements ``z`` (steps, m), or (runs, steps, m) of independent runs.

        NaN, or True in ``missing`` (shape of z), is a component that was not measured: the others
        are used, and the posterior is that of what there is. ``threads``: for batches; the numbers
        do not depend on it. Raises ShapeError or ConfigError for what does not fit, NumericalError
        where an estimate overflows.
        """
        return series.run(
            self._engine, z, missing, threads, measured=self.system.measured, steps=self._steps,
            n=self.system.size, M=self.chain.size, states=self.system.states,
        )  # fmt: skip

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.system, self.chain)


class IMMFilter:
    """The interacting-multiple-model filter (Sigalov & Oshman, section IV; Blom & Bar-Shalom).

    Each mode starts from its own mixture of the modes before (17), (18). ``systems``: one for all
    modes, or one for each. Those may have different states, known by their names: a state that the
    mode before did not have begins as ``entering[name]`` = (mean, variance), independent of the
    rest; one that the mode after does not have is left out. The estimate is of all states, in the
    order of their first appearance.
    """

    def __init__(
        self,
        systems: LinearSystem | Sequence[LinearSystem],
        chain: ModeChain,
        entering: Mapping[str, tuple[float, float]] | None = None,
    ) -> None:
        self.chain = checks.instance("chain", chain, ModeChain)
        if isinstance(systems, LinearSystem):
            self.systems: tuple[LinearSystem, ...] = (systems,)
        else:
            self.systems = checks.tuple_of("systems", systems, LinearSystem, "LinearSystem")
            if len(self.systems) != chain.size:
                raise ShapeError(
                    f"systems: expected one, or {chain.size} as there are modes, "
                    f"got {len(self.systems)}"
                )
        measured = {system.measured for system in self.systems}
        if len(measured) > 1:
            raise ShapeError(
                f"systems: expected one number of measured components, got {sorted(measured)}"
            )
        self._steps = series.one_length(self.systems, chain)
        if not isinstance(entering, (Mapping, type(None))):
            raise ConfigError(
                f"entering: expected {{state name: (mean, variance)}}, got {entering!r}"
            )
        self.entering = dict(entering or {})
        self.states, state_map = _states(self.systems, self.entering)
        self._engine = series.made(
            _core.SwitchingEngine.imm(
                [system.engine for system in self.systems], chain.engine, chain.p, state_map
            ),
            "systems",
        )

    def run(
        self,
        z: npt.ArrayLike,
        missing: npt.ArrayLike | None = None,
        threads: int | None = None,
    ) -> SwitchingResult:
        """As ``OneStepFilter.run``."""
        size = self.systems[0].size if self.states is None else len(self.states)
        return series.run(
            self._engine, z, missing, threads, measured=self.systems[0].measured,
            steps=self._steps, n=size, M=self.chain.size, states=self.states,
        )  # fmt: skip

    def __reduce__(self) -> tuple[Any, ...]:
        systems = self.systems if len(self.systems) > 1 else self.systems[0]
        return type(self), (systems, self.chain, self.entering)


class GenieFilter:
    """The Kalman filter that knows the mode of every step (section VI): nothing does better.

    Without ``chain``, or without ``modes`` in ``run``, all is healthy: the Kalman filter.
    """

    def __init__(self, system: LinearSystem, chain: ModeChain | None = None) -> None:
        self.system = checks.instance("system", system, LinearSystem)
        self.chain = None if chain is None else checks.instance("chain", chain, ModeChain)
        self._steps = series.one_length([system], chain)
        modes = [] if chain is None else list(chain.modes)
        self._engine = series.made(_core.SwitchingEngine.genie(system.engine, modes), "system")

    def run(
        self,
        z: npt.ArrayLike,
        modes: npt.ArrayLike | None = None,
        missing: npt.ArrayLike | None = None,
        threads: int | None = None,
    ) -> SwitchingResult:
        """As ``OneStepFilter.run``, with ``modes`` (runs, steps), or (steps,) of all runs: indices
        into ``chain.modes``."""
        return series.run(
            self._engine, z, missing, threads, measured=self.system.measured, steps=self._steps,
            n=self.system.size, M=0, modes=modes, chain=self.chain, states=self.system.states,
            trouble="system, z: at {where} the estimate overflows, z is {z}",
        )  # fmt: skip

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.system, self.chain)


def _states(
    systems: Sequence[LinearSystem], entering: Mapping[str, tuple[float, float]]
) -> tuple[tuple[str, ...] | None, _core.StateMap | None]:
    """Names of all states, and the map between those of the systems; none where all are alike."""
    named = [system.states for system in systems]
    if len(set(named)) == 1 and len({system.size for system in systems}) == 1:
        if entering:
            raise ConfigError("entering: expected none, all modes have the same states")
        return named[0], None
    known = [names for names in named if names is not None]
    if len(known) < len(named):
        which = ", ".join(f"systems[{i}]" for i, names in enumerate(named) if names is None)
        raise ConfigError(
            f"systems: expected names of the states of all, or of none if all have one size, "
            f"got none of {which}"
        )
    union = tuple(dict.fromkeys(name for names in known for name in names))
    if len(union) > _core.MAX_LINEAR_SIZE:
        raise ShapeError(
            f"systems: expected at most {_core.MAX_LINEAR_SIZE} different states in all, "
            f"got {len(union)}: {', '.join(union)}"
        )
    partial = [name for name in union if any(name not in names for names in known)]
    if set(entering) != set(partial):
        raise ConfigError(
            f"entering: expected (mean, variance) of {', '.join(partial) or 'none'}, which not all "
            f"modes have, got {', '.join(map(str, entering)) or 'none'}"
        )
    mean, variance = np.zeros(len(union)), np.zeros(len(union))
    for name, pair in entering.items():
        first, second = checks.array(f"entering {name!r}", pair, (2,))
        mean[union.index(name)] = first
        variance[union.index(name)] = checks.not_negative(f"entering {name!r} variance", second)
    numbers = [[union.index(name) for name in names] for names in known]
    return union, _core.StateMap(numbers, mean.tolist(), variance.tolist())
