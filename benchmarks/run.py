"""Benchmarks: ratios against a hand-written reference and named peers, in one interleaved run.

./dev bench [--count N] [--repeats R] [--json FILE]
"""

from __future__ import annotations

import argparse
import json
import platform
import subprocess
import sys
import time
import warnings
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

import gradient
import hypotheses
import monitor
import onboard
import surefix as sf
import switching_filters
import w1
import w1_peers

ROOT = Path(__file__).resolve().parent.parent


def check(name: str, answer: w1.Answer, truth: w1.Answer) -> float:
    """Largest error against the reference: of x in σ, of P and log-likelihood relative."""
    (x, P, value), (x_true, P_true, value_true) = answer, truth
    deviation = np.sqrt(np.diagonal(P_true, axis1=1, axis2=2))
    errors = [
        np.abs((x - x_true) / deviation).max(),
        np.abs((P - P_true) / (deviation[:, :, None] * deviation[:, None, :])).max(),
        abs(value / value_true - 1),
    ]
    worst = float(max(errors))
    if not worst < 1e-9:
        raise SystemExit(f"{name}: differs from the reference by {worst:.1e}")
    return worst


def seconds(contender: w1.Contender) -> float:
    start = time.perf_counter()
    contender()
    return time.perf_counter() - start


def measure(contenders: dict[str, w1.Contender], repeats: int) -> dict[str, dict[str, float]]:
    """Times all in turn, ``repeats`` times (a slow one less often); the first is the base."""
    base, *_ = contenders
    truth = contenders[base]()
    count = len(truth[0])
    error = {name: check(name, run(), truth) for name, run in contenders.items()}
    once = {name: seconds(run) for name, run in contenders.items()}
    ns: dict[str, list[float]] = {name: [] for name in contenders}
    ratio: dict[str, list[float]] = {name: [] for name in contenders}
    for turn in range(repeats):
        for name, run in contenders.items():
            if once[name] > 1 and turn >= 2:
                continue
            reference = seconds(contenders[base])
            own = seconds(run)
            ns[name].append(own / count * 1e9)
            ratio[name].append(own / reference)
    return {
        name: {
            "ns": float(np.median(ns[name])),
            "fastest_ns": min(ns[name]),
            "ratio": float(np.median(ratio[name])),
            "max_error": error[name],
        }
        for name in contenders
    }


def import_times() -> dict[str, float]:
    """Milliseconds that ``import surefix`` adds to ``import numpy``: median of 11 processes."""
    code = "import time; t = time.perf_counter(); import {}; print(time.perf_counter() - t)"

    def once(module: str) -> float:
        command = [sys.executable, "-c", code.format(module)]
        return float(subprocess.run(command, capture_output=True, text=True, check=True).stdout)

    pairs = [(once("numpy"), once("numpy, surefix")) for _ in range(11)]
    return {
        "numpy_ms": 1e3 * float(np.median([numpy for numpy, _ in pairs])),
        "surefix_adds_ms": 1e3 * float(np.median([both - numpy for numpy, both in pairs])),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--count", type=int, default=100_000, help="measurements")
    parser.add_argument("--repeats", type=int, default=25)
    parser.add_argument("--json", type=Path, default=ROOT / "build" / "bench" / "w1.json")
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")  # the peers' deprecations

    problem = w1.make_problem(arguments.count)
    contenders = {
        "reference, unrolled by hand": w1.reference(problem, ROOT / "build" / "bench"),
        "surefix": w1.engine(problem, None),
        "surefix with noise of the journey": w1.engine(problem, "journey"),
        "surefix with noise of each step": w1.engine(problem, "step"),
        "surefix, sizes at run time": w1.engine_general(problem),
    }
    for name, make in w1_peers.installed().items():
        contenders[name] = make(problem)  # type: ignore[operator]
    missing = [name for name in w1_peers.PEERS if name not in contenders]

    table = measure(contenders, arguments.repeats)
    print(f"W1: {arguments.count} measurements, surefix {sf.__version__}, {platform.machine()}")
    print(f"{'':36}{'median ns':>10}{'fastest':>9}{'ratio':>8}{'error':>9}")
    for name, row in table.items():
        print(
            f"{name:36}{row['ns']:10.1f}{row['fastest_ns']:9.1f}"
            f"{row['ratio']:8.2f}{row['max_error']:9.0e}"
        )
    noise = table["surefix with noise of the journey"]["ratio"] / table["surefix"]["ratio"]
    print(f"noise estimates of the whole journey: {noise:.2f} x surefix without")
    imports = import_times()
    print(
        "import: numpy {numpy_ms:.0f} ms, surefix adds {surefix_adds_ms:.0f} ms".format(**imports)
    )
    if missing:
        print(f"not installed: {', '.join(missing)}")
    robust = hypotheses.measure(ROOT / "build" / "bench")
    hypotheses.show(robust)
    switching = switching_filters.measure(ROOT / "build" / "bench", arguments.repeats)
    switching_filters.show(switching)
    gradients = gradient.measure(ROOT / "build" / "bench", arguments.repeats)
    gradient.show(gradients)
    raim = monitor.measure(ROOT / "build" / "bench", arguments.repeats)
    monitor.show(raim)
    needs = onboard.measure()
    onboard.show(needs)
    report: dict[str, Any] = {
        "count": arguments.count, "w1": table, "import": imports, "hypotheses": robust,
        "switching": switching, "gradient": gradients, "raim": raim,
        "onboard": [asdict(need) for need in needs],
    }  # fmt: skip
    arguments.json.parent.mkdir(parents=True, exist_ok=True)
    arguments.json.write_text(json.dumps(report, indent=2) + "\n")
    print(f"written: {arguments.json}")


if __name__ == "__main__":
    main()
