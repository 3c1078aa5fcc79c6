"""Fault-tolerant state estimation with integrity.

Sensors that report at different times, fused into one estimate with an interval that holds the
truth with a stated risk. Arrays are float64, units SI, times in seconds.
"""

from surefix import raim
from surefix._core import __version__
from surefix.core.distributions import chi_squared_p_value, two_sided_quantile
from surefix.core.linear_system import LinearSystem
from surefix.core.models import (
    ConstantAcceleration,
    ConstantVelocity,
    DiscreteModel,
    LinearModel,
    Model,
)
from surefix.core.sensor import Sensor
from surefix.desync.composite_step import CompositeStep
from surefix.desync.estimate import Estimate
from surefix.desync.filter import DesyncFilter, Status
from surefix.desync.result import Result
from surefix.desync.step_update import StepUpdate
from surefix.drift.diagnosis import Diagnosis, diagnose
from surefix.drift.fault import Fault
from surefix.drift.forward_record import ForwardRecord
from surefix.drift.gradient import likelihood_gradient
from surefix.drift.onset import OnsetDetector
from surefix.drift.onset_result import OnsetResult
from surefix.drift.profile import Profile
from surefix.drift.sliding import SlidingDetector, SlidingEstimate, SlidingFinding
from surefix.drift.spectrum import SpectrumDetector
from surefix.drift.spectrum_result import SpectrumResult
from surefix.errors import ConfigError, NumericalError, ShapeError, SurefixError
from surefix.injection.fault import InjectedFault
from surefix.log import Log
from surefix.reading.log import read_log
from surefix.robust.filter import RobustFilter
from surefix.robust.limits import alert_limits, risk_per_estimate
from surefix.robust.modes import Drifting, Frozen, Interrupted, Noisy, Outage
from surefix.robust.prior import CommonFault
from surefix.robust.result import RobustEstimate, RobustResult
from surefix.switching.filters import GenieFilter, IMMFilter, OneStepFilter
from surefix.switching.linear_optimal import LinearCondition, LinearOptimalFilter
from surefix.switching.mode_chain import ModeChain
from surefix.switching.result import SwitchingResult

__all__ = [
    "CommonFault",
    "CompositeStep",
    "ConfigError",
    "ConstantAcceleration",
    "ConstantVelocity",
    "DesyncFilter",
    "Diagnosis",
    "DiscreteModel",
    "Drifting",
    "Estimate",
    "Fault",
    "ForwardRecord",
    "Frozen",
    "GenieFilter",
    "IMMFilter",
    "InjectedFault",
    "Interrupted",
    "LinearCondition",
    "LinearModel",
    "LinearOptimalFilter",
    "LinearSystem",
    "Log",
    "ModeChain",
    "Model",
    "Noisy",
    "NumericalError",
    "OneStepFilter",
    "OnsetDetector",
    "OnsetResult",
    "Outage",
    "Profile",
    "Result",
    "RobustEstimate",
    "RobustFilter",
    "RobustResult",
    "Sensor",
    "ShapeError",
    "SlidingDetector",
    "SlidingEstimate",
    "SlidingFinding",
    "SpectrumDetector",
    "SpectrumResult",
    "Status",
    "StepUpdate",
    "SurefixError",
    "SwitchingResult",
    "__version__",
    "alert_limits",
    "chi_squared_p_value",
    "diagnose",
    "likelihood_gradient",
    "raim",
    "read_log",
    "risk_per_estimate",
    "two_sided_quantile",
]
