"""W1: 100,000 asynchronous speed measurements, two states, log-likelihood, every x and P kept.

A contender takes the same log and returns (x (N, 2), P (N, 2, 2), log-likelihood).
"""

from __future__ import annotations

import ctypes
import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

import surefix as sf

Floats = npt.NDArray[np.float64]
Answer = tuple[Floats, Floats, float]
Contender = Callable[[], Answer]

JERK = 0.08
SIGMA = {"wheel": 1.0, "radar": 2.0, "gps": 0.5}


@dataclass(frozen=True)
class Problem:
    """``time`` (N,) [s], whole nanoseconds; ``sensor`` (N,) index into SIGMA; ``value`` (N,)."""

    time: Floats
    sensor: npt.NDArray[np.int32]
    value: Floats

    @property
    def variance(self) -> Floats:
        """Of the three sensors (3,)."""
        return np.array(list(SIGMA.values())) ** 2


def make_problem(count: int) -> Problem:
    """Steps of 1 to 60 ms, a sensor at random, a speed that wanders around 30 m/s."""
    random = np.random.RandomState(1)
    time: Floats = np.round(np.cumsum(random.uniform(1e-3, 60e-3, count)), 9).astype(np.float64)
    sensor = random.randint(0, 3, count).astype(np.int32)
    speed = 30 + 10 * np.sin(time / 100)
    noise = np.array(list(SIGMA.values()))[sensor] * random.normal(size=count)
    return Problem(time, sensor, speed + noise)


def engine(problem: Problem, noise: str | None) -> Contender:
    """surefix, called as a user would."""
    sensors = [sf.Sensor(name, sigma) for name, sigma in SIGMA.items()]
    model = sf.ConstantAcceleration(jerk=JERK)
    filter = sf.DesyncFilter(model, sensors, [0.0, 0.0], np.eye(2))
    log = sf.Log(problem.time, np.array(list(SIGMA))[problem.sensor], problem.value)

    def run() -> Answer:
        result = filter.run(log, noise=noise)
        return result.x, result.P, result.log_likelihood

    return run


def engine_general(problem: Problem) -> Contender:
    """surefix's code for sizes known at run time, on the same two states."""
    # A row that is not exactly the unit row is enough to leave the fixed-size path.
    sensors = [sf.Sensor(n, s, observes=(1.0, 1e-300)) for n, s in SIGMA.items()]
    filter = sf.DesyncFilter(sf.ConstantAcceleration(jerk=JERK), sensors, [0.0, 0.0], np.eye(2))
    log = sf.Log(problem.time, np.array(list(SIGMA))[problem.sensor], problem.value)

    def run() -> Answer:
        result = filter.run(log, noise=None)
        return result.x, result.P, result.log_likelihood

    return run


def reference(problem: Problem, build: Path) -> Contender:
    """The hand-unrolled C++ loop, called from Python with fresh output arrays."""
    build.mkdir(parents=True, exist_ok=True)
    source, library = Path(__file__).with_name("reference.cpp"), build / "w1_reference.so"
    flags = ["-std=c++17", "-O3", "-ffp-contract=off", "-shared", "-fPIC"]
    subprocess.run(["g++", *flags, str(source), "-o", str(library)], check=True)
    function = ctypes.CDLL(str(library)).w1_reference
    function.restype = ctypes.c_double
    pointer = ctypes.c_void_p
    function.argtypes = [
        *[pointer] * 3,
        ctypes.c_size_t,
        pointer,
        ctypes.c_double,
        pointer,
        pointer,
    ]
    count = len(problem.time)
    variance = problem.variance

    def run() -> Answer:
        x, P = np.empty((count, 2)), np.empty((count, 2, 2))
        inputs = (problem.time.ctypes.data, problem.sensor.ctypes.data, problem.value.ctypes.data)
        outputs = (x.ctypes.data, P.ctypes.data)
        return x, P, function(*inputs, count, variance.ctypes.data, JERK**2, *outputs)

    return run
