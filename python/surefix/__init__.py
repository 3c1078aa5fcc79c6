"""Fault-tolerant state estimation with integrity.

Sensors that report at different times, fused into one estimate with an interval that holds the
truth with a stated risk. Arrays are float64, units SI, times in seconds.
"""

from surefix._core import __version__
from surefix.core.distributions import chi_squared_p_value, two_sided_quantile
from surefix.core.models import (
    ConstantAcceleration,
    ConstantVelocity,
    DiscreteModel,
    LinearModel,
    Model,
)
from surefix.core.sensor import Sensor
from surefix.desync.composite_step import CompositeStep, StepUpdate
from surefix.desync.filter import DesyncFilter, Estimate, Status
from surefix.desync.result import Result
from surefix.errors import ConfigError, NumericalError, ShapeError, SurefixError
from surefix.log import Log, read_log

__all__ = [
    "CompositeStep",
    "ConfigError",
    "ConstantAcceleration",
    "ConstantVelocity",
    "DesyncFilter",
    "DiscreteModel",
    "Estimate",
    "LinearModel",
    "Log",
    "Model",
    "NumericalError",
    "Result",
    "Sensor",
    "ShapeError",
    "Status",
    "StepUpdate",
    "SurefixError",
    "__version__",
    "chi_squared_p_value",
    "read_log",
    "two_sided_quantile",
]
