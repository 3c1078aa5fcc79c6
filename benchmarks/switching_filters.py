"""W2: scalar Kalman filters in a batch. W3: an IMM of three modes, one series and a batch."""

from __future__ import annotations

import ctypes
import subprocess
from pathlib import Path
from typing import Any

import numpy as np

import surefix as sf
from timing import Floats, timed

A, Q, R, C, P0 = -0.8, 1.0, 1.0, 10.0, 1.0
MODES = ((1, 1.0), (1, C), (0, 1.0))
TRANSITION = np.array([[0.9, 0.05, 0.05], [0.2, 0.7, 0.1], [0.3, 0.1, 0.6]])
SYSTEM = sf.LinearSystem(
    A=np.array([[A]]), H=np.eye(1), Q=np.array([[Q]]), R=np.array([[R]]), x0=np.zeros(1),
    P0=np.array([[P0]]),
)  # fmt: skip
RUNS, STEPS, LONG = 10_000, 100, 100_000


def measure(build: Path, repeats: int) -> dict[str, Any]:
    """Median ns per series-step and ratios to the loops by hand, all timed in turn."""
    hand = _compiled(build)
    z = np.random.RandomState(2).normal(size=(RUNS, STEPS, 1)) * 2.0
    long = np.random.RandomState(3).normal(size=(LONG, 1)) * 2.0
    chain = sf.ModeChain(MODES, TRANSITION)
    genie, imm = sf.GenieFilter(SYSTEM), sf.IMMFilter(SYSTEM, chain)
    w2 = timed(
        {
            "by hand, blocked": (lambda: _w2(hand, z), z.size),
            "surefix": (lambda: _both(genie.run(z, threads=1)), z.size),
            "surefix, all cores": (lambda: _both(genie.run(z)), z.size),
        },
        repeats,
    )
    w3 = timed(
        {
            "by hand, one series": (lambda: _w3(hand, long, chain.initial), long.size),
            "surefix, one series": (lambda: _both(imm.run(long)), long.size),
        },
        repeats,
    )
    base = w3["by hand, one series"]["ns"]
    batch = timed({"surefix, batch": (lambda: _both(imm.run(z, threads=1)), z.size)}, repeats)
    batch["surefix, batch"]["ratio"] = batch["surefix, batch"]["ns"] / base
    return {"w2": w2, "w3": {**w3, **batch}}


def show(figures: dict[str, Any]) -> None:
    for key, title in (
        ("w2", f"W2: {RUNS} scalar Kalman filters of {STEPS} steps, x and P kept"),
        ("w3", "W3: IMM of three modes, scalar state; x, P, mode probabilities kept"),
    ):
        print(f"{title}\n{'':36}{'median ns':>10}{'fastest':>9}{'ratio':>8}")
        for name, row in figures[key].items():
            print(f"{name:36}{row['ns']:10.1f}{row['fastest_ns']:9.1f}{row['ratio']:8.2f}")


def _both(result: sf.SwitchingResult) -> tuple[Floats, Floats]:
    return result.x[..., 0], result.P[..., 0, 0]


def _compiled(build: Path) -> ctypes.CDLL:
    build.mkdir(parents=True, exist_ok=True)
    source = Path(__file__).with_suffix(".cpp")
    library = build / "switching_filters.so"
    flags = ["-std=c++17", "-O3", "-ffp-contract=off", "-shared", "-fPIC"]
    subprocess.run(["g++", *flags, str(source), "-o", str(library)], check=True)
    functions = ctypes.CDLL(str(library))
    pointer, number, size = ctypes.c_void_p, ctypes.c_double, ctypes.c_size_t
    functions.w2_blocked.argtypes = [pointer, size, size, *[number] * 4, pointer, pointer]
    functions.w3_loop.argtypes = [pointer, size, pointer, pointer, *[number] * 5, *[pointer] * 3]
    functions.w3_loop.restype = number
    return functions


def _w2(hand: ctypes.CDLL, z: Floats) -> tuple[Floats, Floats]:
    x, P = np.empty(z.shape[:2]), np.empty(z.shape[:2])
    hand.w2_blocked(z.ctypes.data, *z.shape[:2], A, Q, R, P0, x.ctypes.data, P.ctypes.data)
    return x, P


def _w3(hand: ctypes.CDLL, z: Floats, initial: Floats) -> tuple[Floats, Floats]:
    T = len(z)
    x, P, mode = np.empty(T), np.empty(T), np.empty((T, 3))
    arrays = (z, TRANSITION, initial)
    inputs = [array.ctypes.data for array in arrays]
    hand.w3_loop(
        inputs[0], T, *inputs[1:], A, Q, R, C, P0, x.ctypes.data, P.ctypes.data, mode.ctypes.data
    )
    return x, P
