"""W6: the distributions of the monitor's thresholds and powers; and epochs per second of it all."""

from __future__ import annotations

import ctypes
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import scipy.special

import surefix as sf
from surefix.core import distributions
from timing import Floats, Work, seconds, timed

COUNT = 20_000
SATELLITES = (8, 10, 20, 30)


def measure(build: Path, repeats: int) -> dict[str, Any]:
    """W6 against Boost in plain loops and SciPy, and the monitor for numbers of satellites."""
    hand = _compiled(build)
    return {"w6": _distributions(hand, repeats), "monitor": [_monitor(n) for n in SATELLITES]}


def show(figures: dict[str, Any]) -> None:
    for work, table in figures["w6"].items():
        print(f"W6: {work}")
        print(f"{'':36}{'median ns':>10}{'fastest':>9}{'ratio':>8}")
        for name, row in table.items():
            print(f"{name:36}{row['ns']:10.0f}{row['fastest_ns']:9.0f}{row['ratio']:8.2f}")
    print(
        f"{'monitor, from Python':24}{'snapshot test':>16}{'and hypotheses':>17}"
        f"{'after an alarm':>17}{'1 h, 10 Hz':>12}"
    )
    for row in figures["monitor"]:
        print(
            f"{row['satellites']:<2} satellites{'':11}{row['snapshot_us']:13.1f} us"
            f"{row['us']:14.1f} us{row['alarm_us']:14.1f} us{row['hour_s']:10.2f} s"
        )


def _distributions(hand: ctypes.CDLL, repeats: int) -> dict[str, dict[str, dict[str, float]]]:
    random = np.random.RandomState(6)
    k = random.randint(1, 31, COUNT).astype(float)
    alpha = 10.0 ** random.uniform(-12, -1, COUNT)
    lam = random.uniform(0, 300, COUNT)
    h = np.asarray(sf.raim.threshold(alpha, k))
    gamma = 10.0 ** random.uniform(-9, -1, COUNT)

    def loop(function: Any, *columns: Floats) -> tuple[Work, int]:
        def work() -> tuple[Floats, ...]:
            out = np.empty(COUNT)
            function(*(c.ctypes.data for c in columns), COUNT, out.ctypes.data)
            return (out,)

        return work, COUNT

    def vectorised(function: Any, *columns: Floats) -> tuple[Work, int]:
        return lambda: (np.asarray(function(*columns)),), COUNT

    special = scipy.special
    return {
        "noncentral chi-squared cdf": timed(
            {
                "Boost in a loop by hand": loop(hand.w6_cdf, h, k, lam),
                "surefix": vectorised(distributions.noncentral_chi_squared_cdf, h, k, lam),
                "scipy.special.chndtr": vectorised(special.chndtr, h, k, lam),
            },
            repeats,
        ),
        "chi-squared threshold": timed(
            {
                "Boost in a loop by hand": loop(hand.w6_quantile, alpha, k),
                "surefix": vectorised(sf.raim.threshold, alpha, k),
                "scipy.special.chdtri": vectorised(lambda p, n: special.chdtri(n, p), alpha, k),
            },
            repeats,
        ),
        "noncentrality of (alpha, power)": timed(
            {
                "Boost in a loop by hand": loop(hand.w6_noncentrality, gamma, h, k),
                "surefix, with the threshold": vectorised(sf.raim.noncentrality, gamma, k, alpha),
            },
            repeats,
        ),
    }


def _monitor(n: int) -> dict[str, float]:
    """Fastest of several runs [µs an epoch] of the test, v*, p*, e1, e2 and level by χ²; with
    fault hypotheses; and with a satellite to be taken out."""
    random = np.random.RandomState(n)
    track = sf.raim.Track.from_local(
        np.linspace(0, 4000, 401), 300 * np.sin(np.linspace(0, 8, 401)), origin=(50.9, 4.5, 50.0)
    )
    T = 2000
    azimuth, elevation = random.uniform(0, 2 * np.pi, n), random.uniform(0.2, 1.5, n)
    direction = np.column_stack(
        [
            np.cos(elevation) * np.sin(azimuth),
            np.cos(elevation) * np.cos(azimuth),
            np.sin(elevation),
        ]
    )
    place = track.position(np.linspace(500, 3500, T))
    sky = 2.2e7 * direction @ sf.raim.local_axes(50.9, 4.5) + place[0]
    sigma = np.tile(3 / np.sin(elevation), T)
    ranges = np.linalg.norm(sky[None] - place[:, None], axis=2).reshape(-1)
    data = sf.raim.Pseudoranges(
        np.repeat(np.arange(T) / 10, n), np.tile([f"{i}" for i in range(n)], T),
        np.tile(sky, (T, 1)), ranges + sigma * random.standard_normal(T * n), sigma,
        np.tile(np.array(["G", "E"])[np.arange(n) % 2], T),
    )  # fmt: skip
    monitor = sf.raim.TrackRaim(track, length=50.0)
    snapshot = sf.raim.TrackRaim(track, length=50.0, max_faults=0)
    bias = np.where(np.arange(T * n) % n == 2, 500.0, 0.0)
    alone = min(seconds(lambda: snapshot.run(data, near=500.0)) for _ in range(7)) / T
    healthy = min(seconds(lambda: monitor.run(data, near=500.0)) for _ in range(7)) / T
    faulty = data.with_bias(bias)
    alarm = min(seconds(lambda: monitor.run(faulty, near=500.0)) for _ in range(7)) / T
    return {
        "satellites": n, "snapshot_us": alone * 1e6, "us": healthy * 1e6, "alarm_us": alarm * 1e6,
        "hour_s": healthy * 36_000,
    }  # fmt: skip


def _compiled(build: Path) -> ctypes.CDLL:
    build.mkdir(parents=True, exist_ok=True)
    source, library = Path(__file__).with_suffix(".cpp"), build / "raim.so"
    flags = ["-std=c++17", "-O3", "-DNDEBUG", "-ffp-contract=off", "-shared", "-fPIC"]
    subprocess.run(["g++", *flags, str(source), "-o", str(library)], check=True)
    functions = ctypes.CDLL(str(library))
    pointer, size = ctypes.c_void_p, ctypes.c_size_t
    functions.w6_cdf.argtypes = [pointer, pointer, pointer, size, pointer]
    functions.w6_quantile.argtypes = [pointer, pointer, size, pointer]
    functions.w6_noncentrality.argtypes = [pointer, pointer, pointer, size, pointer]
    for name in ("w6_cdf", "w6_quantile", "w6_noncentrality"):
        getattr(functions, name).restype = None
    return functions
