"""W5 and the step of the robust filter, in C++: compiled here, run, checked."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent


def measure(build: Path) -> dict[str, Any]:
    """Figures of ``hypotheses.cpp`` ('tree') and ``robust_step.cpp`` ('step') [µs]; stops if the
    hypotheses differ from those by hand."""
    figures = {"tree": _run(build, "hypotheses"), "step": _run(build, "robust_step")}
    for row in figures["tree"]:
        if not row["max_error"] < 1e-9:
            raise SystemExit(f"W5: differs from the reference by {row['max_error']:.1e}")
    return figures


def _run(build: Path, name: str) -> list[dict[str, Any]]:
    build.mkdir(parents=True, exist_ok=True)
    program = build / name
    flags = ["-std=c++17", "-O3", "-ffp-contract=off", "-fno-tree-slp-vectorize"]
    sources = [ROOT / "benchmarks" / f"{name}.cpp", ROOT / "cpp/src/robust/alert_limits.cpp"]
    include = [f"-I{ROOT / 'cpp/include'}", "-isystem", "/usr/include/eigen3"]
    subprocess.run(["g++", *flags, *include, *map(str, sources), "-o", str(program)], check=True)
    answer = subprocess.run([str(program)], capture_output=True, text=True, check=True)
    rows: list[dict[str, Any]] = json.loads(answer.stdout)
    return rows


def show(figures: dict[str, Any]) -> None:
    print("W5: all hypotheses of M measurements, two states, in C++")
    print(f"{'M':>4}{'by hand us':>12}{'surefix us':>12}{'ratio':>8}{'ns each':>9}")
    for row in figures["tree"]:
        ratio, each = row["us"] / row["reference_us"], row["us"] * 1e3 / 2 ** row["M"]
        print(f"{row['M']:4}{row['reference_us']:12.2f}{row['us']:12.2f}{ratio:8.2f}{each:9.1f}")
    print("one step of the robust filter: 24 measurements, 3 sensors x 3 modes, carried drift")
    for row in figures["step"]:
        print(
            f"{row['name']:36}{row['us']:10.0f} us, fastest {row['fastest_us']:.0f}, "
            f"{row['hypotheses']:.0f} hypotheses"
        )
