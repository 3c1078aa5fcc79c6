"""The gradient of the likelihood with respect to every measurement."""

from __future__ import annotations

import weakref

import numpy.typing as npt

from surefix import _core
from surefix.core.checks import FloatArray
from surefix.core.linear_system import LinearSystem
from surefix.desync.filter import DesyncFilter
from surefix.drift.forward_record import ForwardRecord
from surefix.log import Log

_engines: weakref.WeakKeyDictionary[LinearSystem, _core.GradientEngine] = (
    weakref.WeakKeyDictionary()
)


def likelihood_gradient(
    source: LinearSystem | DesyncFilter,
    data: npt.ArrayLike | Log,
    inputs: npt.ArrayLike | None = None,
) -> FloatArray:
    """∂𝓛/∂z, 𝓛 = Σ log det S + νᵀS⁻¹ν (Parellier, Barrau & Bonnabel 2023, (7), (20)-(22)).

    In the shape of the data, NaN where there was no measurement or none was used; arguments and
    errors as of ``ForwardRecord``, which keeps what else there is to know. Two passes, O(N).
    """
    if isinstance(source, LinearSystem):
        engine = _engines.get(source)
        if engine is None:
            engine = _engines[source] = _core.GradientEngine(source.engine)
        gradient = engine.run(data, inputs)
        if gradient is not None:
            return gradient
    return ForwardRecord(source, data, inputs=inputs).gradient
