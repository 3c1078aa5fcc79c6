"""W4: ∂𝓛/∂z of N measurements of two states, and how time and memory grow to N = 1e7."""

from __future__ import annotations

import ctypes
import resource
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import gradient_peers
import surefix as sf
from timing import Floats, Work, seconds, timed

F, Q, R = np.array([[1.0, 1.0], [0.0, 1.0]]), np.diag([1e-2, 1e-3]), 1.5
X0, P0 = np.array([0.5, -0.2]), np.array([[2.0, 0.3], [0.3, 1.0]])
SIZES = (100, 10_000)
GROWTH = (10_000, 100_000, 1_000_000, 10_000_000)


def system() -> sf.LinearSystem:
    return sf.LinearSystem(A=F, H=np.array([[1.0, 0.0]]), Q=Q, R=np.array([[R]]), x0=X0, P0=P0)


def measure(build: Path, repeats: int) -> dict[str, Any]:
    """Of each size the contenders; and the growth."""
    hand = _compiled(build)
    return {
        "w4": {str(N): _contest(hand, N, repeats) for N in SIZES},
        "growth": _growth(),
    }


def show(figures: dict[str, Any]) -> None:
    for N, table in figures["w4"].items():
        print(f"W4: gradient of {N} measurements, two states")
        print(f"{'':36}{'median us':>10}{'fastest':>9}{'ratio':>8}")
        for name, row in table.items():
            us, fastest = row["ns"] * 1e-3, row["fastest_ns"] * 1e-3
            print(f"{name:36}{us:10.2f}{fastest:9.2f}{row['ratio']:8.2f}")
    print(f"{'':20}{'gradient':>12}{'onset test':>12}{'memory':>10}   per measurement")
    for row in figures["growth"]:
        print(
            f"N = {row['N']:<16,}{row['gradient_ns']:9.1f} ns{row['onset_ns']:9.1f} ns"
            + (f"{row['bytes']:8.0f} B" if row is figures["growth"][-1] else "")
        )


def _contest(hand: ctypes.CDLL, N: int, repeats: int) -> dict[str, dict[str, float]]:
    y = np.random.RandomState(4).normal(size=N)
    calls = max(1, 200_000 // N)

    def repeated(call: Callable[[], Floats]) -> tuple[Work, int]:
        def work() -> tuple[Floats, ...]:
            for _ in range(calls):
                out = call()
            return (out,)

        return work, calls

    def by_hand() -> tuple[Floats, ...]:
        out = np.empty(N)
        pointers = [array.ctypes.data for array in (F, Q)]
        hand.w4_eigen(
            y.ctypes.data, N, *pointers, R, X0.ctypes.data, P0.ctypes.data, out.ctypes.data, calls
        )
        return (out,)

    source, z = system(), y[:, None].copy()
    contenders: dict[str, tuple[Work, int]] = {
        "Eigen by hand, timed in C++": (by_hand, calls),
        "surefix": repeated(lambda: sf.likelihood_gradient(source, z)[:, 0]),
    }
    for name, make in gradient_peers.installed().items():
        contenders[name] = repeated(make(y, F, Q, R, X0, P0))
    return timed(contenders, repeats)


def _growth() -> list[dict[str, float]]:
    """Each size in a process of its own, whose peak of memory is its own, too."""
    rows = []
    for N in GROWTH:
        command = [sys.executable, __file__, str(N)]
        out = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
        gradient, onset, memory = map(float, out)
        rows.append({"N": N, "gradient_ns": gradient, "onset_ns": onset, "bytes": memory})
    return rows


def _one_size(N: int) -> None:
    """ns per measurement of the gradient and of the onset test, and what the latter's peak of
    memory is beyond its input, in bytes per measurement."""
    z = np.random.RandomState(5).normal(size=(N, 1))
    source = system()
    detector = sf.OnsetDetector(sf.Profile.ramp(), samples=0)

    def test() -> None:
        detector.run(sf.ForwardRecord(source, z))

    detector.run(sf.ForwardRecord(source, z[:100]))
    turns = max(3, 1_000_000 // N)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    onset = min(seconds(test) for _ in range(turns))
    memory = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) * 1024
    gradient = min(seconds(lambda: sf.likelihood_gradient(source, z)) for _ in range(turns))
    print(gradient / N * 1e9, onset / N * 1e9, memory / N)


def _compiled(build: Path) -> ctypes.CDLL:
    build.mkdir(parents=True, exist_ok=True)
    source, library = Path(__file__).with_suffix(".cpp"), build / "gradient.so"
    flags = ["-std=c++17", "-O3", "-DNDEBUG", "-ffp-contract=off", "-shared", "-fPIC"]
    includes = ["-isystem", "/usr/include/eigen3"]
    subprocess.run(["g++", *flags, *includes, str(source), "-o", str(library)], check=True)
    functions = ctypes.CDLL(str(library))
    pointer, size = ctypes.c_void_p, ctypes.c_size_t
    functions.w4_eigen.argtypes = [
        pointer, size, pointer, pointer, ctypes.c_double, pointer, pointer, pointer, size,
    ]  # fmt: skip
    functions.w4_eigen.restype = None
    return functions


if __name__ == "__main__":
    _one_size(int(sys.argv[1]))
