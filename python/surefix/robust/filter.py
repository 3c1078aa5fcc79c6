"""The robust filter: which sensor is wrong, and limits that hold while it is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from surefix import _core
from surefix.core import checks
from surefix.core.checks import NANOSECONDS, FloatArray, to_nanoseconds
from surefix.core.models import Model
from surefix.core.sensor import Sensor, make_system, sensor_tuple
from surefix.desync.filter import MAX_CAPACITY, Status
from surefix.desync.saved import settings
from surefix.desync.stream import (
    Stream,
    check_ended,
    check_estimated,
    factor_of,
    float_or_nan,
    log_factors,
)
from surefix.errors import ConfigError
from surefix.log import NO_TIME, Log
from surefix.robust import arguments
from surefix.robust.limits import side
from surefix.robust.prior import CommonFault, common_tuple, joint_rates
from surefix.robust.result import RobustEstimate, RobustResult
from surefix.robust.saved import checked

CARRIES = {"one": 0, "merge": 1, "cut": 2}


class RobustFilter(Stream):
    """Fault hypotheses, their posterior mixture and its alert limits (Bilenne 2004, sections 3, 4,
    with faults that last).

    Every sensor's modes are 'healthy' and its ``faults``. ``prior``: 'chains', each sensor a Markov
    chain in continuous time from its modes' rates and durations, or 'constant', drawn anew in every
    step from their probabilities; by default chains where all modes have rates and durations.
    ``common``: faults that several sensors share. ``max_faults``: how many sensors (or, below,
    measurements of a step) may be faulty at once; the probability of more is taken from the risk.

    ``hypotheses``: 'sensor', a mode for every sensor and step; or 'measurement', each measurement
    healthy or an outlier on its own (2^N in a step of N ≤ 64), from each sensor's Outage with its
    probability. ``beam``: how many of these at a time, a multiple of 4; a bound on the mass of the
    lightest, for which there is no room, is taken from the risk.

    ``carry``: what lives from step to step. 'merge': Gaussians with their modes and biases, those
    in the same modes merged; 'cut': the heaviest ones; 'one': one Gaussian with the mixture's
    moments (the paper). ``components``: how many at most; by default four for every hypothesis, up
    to 256 or one for each. ``cut``: mass that a step may leave out, by default a thousandth of the
    risk; what was left out stays in the risk over ``memory`` [s], by default the longest mean
    duration of a fault.

    ``risk``: probability, per estimate, that the truth is outside the limits, from 1e-15;
    ``sides``: 'both', or all of the risk on 'lower' or 'upper'; ``direction`` (n,): limits on aᵀx,
    by default the model's output. The other arguments are those of ``DesyncFilter``.
    """

    _engine: _core.RobustEngine

    def __init__(
        self,
        model: Model,
        sensors: Sequence[Sensor],
        x0: npt.ArrayLike,
        P0: npt.ArrayLike,
        *,
        start: float | None = None,
        risk: float = 1e-11,
        sides: str = "both",
        direction: npt.ArrayLike | None = None,
        prior: str | None = None,
        common: Sequence[CommonFault] = (),
        max_faults: int | None = None,
        hypotheses: str = "sensor",
        beam: int = 4096,
        carry: str = "merge",
        components: int | None = None,
        cut: float | None = None,
        memory: float | None = None,
        capacity: int = 4096,
    ) -> None:
        self.model = model
        self.sensors = sensor_tuple(sensors)
        system = make_system(model, self.sensors)
        self.x0 = checks.array("x0", x0, (model.size,))
        self.P0 = checks.covariance("P0", P0, model.size)
        self.start = None if start is None else checks.number("start", start)
        self.risk = checks.probability("risk", risk)
        self.sides = sides
        self.direction = self._direction(direction)
        self.hypotheses = checks.one_of("hypotheses", hypotheses, ("sensor", "measurement"))
        tree = self.hypotheses == "measurement"
        most = _core.MAX_MEASUREMENTS if tree else len(self.sensors)
        self.max_faults = checks.whole(
            "max_faults", most if max_faults is None else max_faults, 0, most
        )
        if tree:
            count, self.prior = 1, arguments.outages(self.sensors, prior)
        else:
            count = arguments.hypotheses(self.sensors, self.max_faults)
            self.prior = arguments.prior(self.sensors, prior)
        self.common = common_tuple(common)
        self.carry = checks.one_of("carry", carry, tuple(CARRIES))
        self.components = checks.whole(
            "components",
            min(max(count, min(4 * count, 256)), 4096) if components is None else components,
            1,
            4096,
        )
        self.cut = checks.not_negative("cut", self.risk / 1000 if cut is None else cut)
        if self.cut >= self.risk:
            raise ConfigError(f"cut: expected less than the risk {self.risk:g}, got {self.cut:g}")
        self.memory = arguments.memory(self.sensors, memory)
        self.capacity = checks.whole("capacity", capacity, 1, MAX_CAPACITY)
        rates: list[float] = []
        kind = arguments.PRIORS[self.prior]
        if self.common:
            if self.prior != "chains" or self.max_faults < len(self.sensors):
                raise ConfigError("common: expected prior 'chains' and no max_faults with it")
            rates, kind = joint_rates(self.sensors, self.common), 2
        self.beam = arguments.beam(beam, self.components if tree else 1)
        sides_code = side("sides", sides)
        started = None if start is None else checks.nanoseconds("start", start)
        modes = [[fault.engine() for fault in sensor.faults] for sensor in self.sensors]
        try:
            self._engine = _core.RobustEngine(
                system, self.x0, self.P0, modes, self.max_faults, kind, rates, CARRIES[carry],
                self.components, self.cut, self.memory, self.direction.tolist(), self.risk,
                sides_code, self.beam if tree else 0, started, self.capacity,
            )  # fmt: skip
        except ValueError as error:  # 1 / duration overflows, for example
            raise ConfigError(f"sensors: fault modes refused: {error}") from None
        self._pushes = 0

    @property
    def mode_names(self) -> tuple[tuple[str, ...], ...]:
        """Names of every sensor's modes, 'healthy' first."""
        return tuple(("healthy", *(f.label for f in s.faults)) for s in self.sensors)

    def run(
        self,
        log: Log,
        *,
        rate: float | None = None,
        times: npt.ArrayLike | None = None,
        noise: str | None = "step",
        delay: float | None = None,
    ) -> RobustResult:
        """Filters a whole log, from the filter's initial state; the arguments are those of
        ``DesyncFilter.run``. All measurements between two estimates are judged together: a lower
        rate gives the hypotheses more evidence, and each estimate comes later. ``noise``: 'step'
        or None; there is none for hypotheses per measurement.
        """
        code, wanted, late = self._request(log, rate, times, delay)
        if noise is not None:
            checks.one_of("noise", noise, ("step",))
        single = self.hypotheses == "measurement"
        wants_noise = noise is not None and not single
        factor = log_factors(log, self.sensors)
        out = self._engine.run(
            log.stamp, code, log.value, factor, wanted, late, single, wants_noise
        )
        ended, made = out.pop("ended"), out.pop("estimates")
        check_ended(ended, wanted, made)
        most = max(len(names) for names in self.mode_names)
        for name in ("time", "x", "P", "lower", "upper", "mode_probability", "hypothesis",
                     "discarded_mass", "sse", "degrees_of_freedom"):  # fmt: skip
            out[name] = out[name][:made]
        out["mode_probability"] = out["mode_probability"][:, :, :most]
        if single:
            used, code = out["step"] >= 0, log.codes_for([s.name for s in self.sensors])
            _blame(out, out["step"][used], code[used], out["outlier_probability"][used])
        return RobustResult(
            **out, risk=self.risk, output=self.model.output, state_names=self.state_names,
            sensor_names=tuple(s.name for s in self.sensors), mode_names=self.mode_names, log=log,
        )  # fmt: skip

    def push(self, time: float, sensor: str, value: float, sigma: float | None = None) -> Status:
        """Takes one measurement, as ``DesyncFilter.push`` does."""
        index = next((i for i, s in enumerate(self.sensors) if s.name == sensor), -1)
        number = isinstance(time, (int, float, np.number)) and not isinstance(time, bool)
        inside = number and abs(time) <= _core.MAX_SECONDS
        stamp = to_nanoseconds(float(time)) if inside else NO_TIME
        factor = factor_of(sigma, self.sensors, index)
        status = Status(self._engine.push(stamp, index, float_or_nan(value), self._pushes, factor))
        self._pushes += 1
        return status

    def estimate(self, time: float) -> RobustEstimate:
        """Ends the step at ``time`` [s] and returns the estimate there.

        Raises ConfigError if ``time`` is before the last estimate or between the periods of a
        discrete model, NumericalError if no hypothesis is left; the filter is then unchanged.
        """
        stamp = checks.nanoseconds("time", time)
        out = self._engine.estimate(stamp)
        status = out.pop("status")
        check_estimated(status, time)
        most = max(len(names) for names in self.mode_names)
        out["mode_probability"] = out["mode_probability"][None, :, :most]
        code = out.pop("sensor")
        if self.hypotheses == "measurement":
            _blame(out, np.zeros(len(code), np.int64), code, out["outlier_probability"])
        modes = tuple(
            names[m] for names, m in zip(self.mode_names, out.pop("hypothesis")[0], strict=True)
        )
        probability = out.pop("mode_probability")[0]
        return RobustEstimate(
            time=stamp / NANOSECONDS, mode_probability=probability, hypothesis=modes, **out
        )

    def mixture(self) -> dict[str, Any]:
        """All hypotheses of the last step while streaming: ``log_weight`` (C,), ``modes`` (C, S),
        ``x`` (C, m) and ``P`` (C, m, m) over all m states, biases of drifting sensors last."""
        out = self._engine.hypotheses()
        out.pop("hypothesis")
        return out

    def save(self) -> dict[str, Any]:
        """The state while streaming, as plain values and arrays."""
        return {**self._engine.save(), "pushes": self._pushes, "settings": self._settings()}

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Continues from what ``save`` returned, in a filter made from the same.

        Raises ShapeError or ConfigError, with the filter unchanged, for anything else.
        """
        fits = checked(saved, self._settings(), self.sensors, self.capacity)
        pushes = fits.pop("pushes")
        try:
            status = self._engine.restore(fits)
        except (ValueError, TypeError, RuntimeError) as error:
            raise ConfigError(f"saved: refused: {error}") from None
        if status != "ok":
            raise ConfigError(f"saved: refused: {status}")
        self._pushes = pushes

    def __getstate__(self) -> dict[str, Any]:
        names = (
            "model", "sensors", "x0", "P0", "start", "risk", "sides", "direction", "prior",
            "common", "max_faults", "hypotheses", "beam", "carry", "components", "cut", "memory",
            "capacity",
        )  # fmt: skip
        return {"arguments": {name: getattr(self, name) for name in names}, "saved": self.save()}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__init__(**state["arguments"])  # type: ignore[misc]
        self.restore(state["saved"])

    def _settings(self) -> dict[str, Any]:
        """What a saved state belongs to, as plain values."""
        return {
            **settings(self.model, self.sensors), "carry": self.carry, "prior": self.prior,
            "common": [fault.settings() for fault in self.common], "components": self.components,
            "max_faults": self.max_faults, "cut": self.cut, "memory": self.memory,
            "hypotheses": self.hypotheses,
        }  # fmt: skip

    def _direction(self, direction: npt.ArrayLike | None) -> FloatArray:
        n = len(self.state_names)
        if direction is not None:
            return checks.array("direction", direction, (n,))
        row: FloatArray = np.zeros(n)
        row[self.model.output] = 1.0
        return row


def _blame(
    out: dict[str, Any],
    step: npt.NDArray[np.int64],
    code: npt.NDArray[np.int32],
    outlier: FloatArray,
) -> None:
    """Hypotheses per measurement: a sensor is as doubtful as its most doubtful row."""
    doubt = np.zeros(out["hypothesis"].shape)
    np.maximum.at(doubt, (step, code), outlier)
    out["hypothesis"] = (doubt > 0.5).astype(np.int8)
    if out["mode_probability"].shape[2] > 1:
        out["mode_probability"][:, :, 1] = doubt
        out["mode_probability"][:, :, 0] = 1 - doubt
