"""The matrices of a composite step (Bilenne 2004, eqs. 35-47), each a read-only array."""

from __future__ import annotations

from functools import cached_property

from surefix import _core
from surefix.core.checks import FloatArray, read_only
from surefix.errors import NumericalError


class StepMatrices:
    """n states, N + 1 legs, M components of N observations, p known inputs.

    H, Theta, Xi and Jtilde need the inverses of the transitions and raise NumericalError where one
    is singular; HF and L do without.
    """

    _engine: _core.CompositeEngine

    @property
    def F(self) -> FloatArray:
        """F̄ (n, n): transition over the whole step (eq. 41)."""
        return self._forward["F"]

    @property
    def G(self) -> FloatArray:
        """Ḡ (n, (N + 1) p): effect of all inputs on the state at the end (eq. 42)."""
        return self._forward["G"]

    @property
    def W(self) -> FloatArray:
        """W̄ (n, (N + 1) n): effect of all process noise on the state at the end (eq. 43)."""
        return self._forward["W"]

    @property
    def Omega(self) -> FloatArray:
        """Ω ((N + 1) n, (N + 1) n): covariance of all process noise (eq. 39)."""
        return self._forward["Omega"]

    @property
    def Upsilon(self) -> FloatArray:
        """Υ (M, M): covariance of all measurement noise (eq. 37)."""
        return self._forward["Upsilon"]

    @property
    def J(self) -> FloatArray:
        """J̄ (M, (N + 1) p): effect of the inputs on the observations themselves (eq. 46)."""
        return self._forward["J"]

    @property
    def HF(self) -> FloatArray:
        """H̄F̄ (M, n): what the observations see of the state at the start."""
        return self._forward["HF"]

    @property
    def L(self) -> FloatArray:
        """H̄W̄ − Θ̄ (M, (N + 1) n): what they see of the process noise."""
        return self._forward["L"]

    @property
    def H(self) -> FloatArray:
        """H̄ (M, n): what the observations see of the state at the end (eq. 44, corrected)."""
        return self._inverted("H")

    @property
    def Theta(self) -> FloatArray:
        """Θ̄ (M, (N + 1) n): the process noise after each observation (eq. 45, corrected)."""
        return self._inverted("Theta")

    @property
    def Xi(self) -> FloatArray:
        """Ξ̄ (M, (N + 1) p): the inputs after each observation, as it sees them (eq. 47)."""
        return self._inverted("Xi")

    @property
    def Jtilde(self) -> FloatArray:
        """J̃ (M, (N + 1) p): J̄ − Ξ̄, effect of all inputs on the observations (eq. 46)."""
        return self._inverted("Jtilde")

    def _inverted(self, name: str) -> FloatArray:
        if self._backward is None:
            raise NumericalError(f"{name}: needs the inverse of a transition that is singular")
        return self._backward[name]

    @cached_property
    def _forward(self) -> dict[str, FloatArray]:
        return {name: read_only(matrix) for name, matrix in self._engine.matrices().items()}

    @cached_property
    def _backward(self) -> dict[str, FloatArray] | None:
        matrices = self._engine.backward()
        if matrices is None:
            return None
        return {name: read_only(matrix) for name, matrix in matrices.items()}
