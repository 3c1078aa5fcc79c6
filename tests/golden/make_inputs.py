"""Writes the inputs of the golden replays beside this file, log.csv, measurements.csv, track.csv
and epochs.csv, and the same as samples for examples/onboard. They are committed; a run,
``python tests/golden/make_inputs.py``, changes no byte."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
SAMPLES = HERE.parents[1] / "examples" / "onboard" / "samples"
MS = 1_000_000  # ns


def journey() -> list[tuple[int, int, int, float]]:
    """A minute of a train's speed: wheel at 10 Hz, radar at 5 Hz and 30 ms late, receiver at 2 Hz
    and 150 ms late, in the order of arrival; a slide of 4 s, a radar that drifts for 10 s; readings
    out of order, repeated, NaN, infinite, of nobody, from before the start."""
    random = np.random.RandomState(2004)
    rows = []
    sensors = [(0, 100 * MS, 1.0, 0), (1, 200 * MS, 0.5, 30 * MS), (2, 500 * MS, 0.2, 150 * MS)]
    for sensor, period, sigma, latency in sensors:
        for stamp in range(period + 7 * MS * sensor, 60_000 * MS, period):
            t = (stamp - latency) / 1e9
            value = 20.0 + 5.0 * np.sin(0.1 * t) + sigma * random.standard_normal()
            if sensor == 0 and 20 <= t < 24:
                value -= 9.0
            if sensor == 1 and 35 <= t < 45:
                value += 0.8 * (t - 35)
            delay = int(random.randint(0, 150)) * MS  # on the bus: they overtake each other
            rows.append((stamp + delay, stamp, sensor, round(float(value), 6)))
    rows += [(t * MS + 3, t * MS, 1, float("nan")) for t in (3100, 17300, 50900)]
    rows += [(t * MS + 3, t * MS, 0, float("inf")) for t in (5100, 31300)]
    rows += [(t * MS + 5, t * MS, 7, 20.0) for t in (8100, 41300)]
    rows += [(100 * MS, -900 * MS, 0, 20.0), (29_000 * MS, -10 * MS, 2, 20.0)]
    rows += [(t + MS, stamp, s, v) for t, stamp, s, v in rows[100:104]]  # once more
    return sorted(rows)


def interrupted(gross: float) -> list[tuple[int, float]]:
    """200 measurements of a wave, interrupted, with gross errors and gaps."""
    random = np.random.RandomState(2011)
    rows = []
    for k in range(200):
        z = 2.0 * np.sin(0.3 * k) + 0.7 * random.standard_normal()
        if random.rand() < 0.2:
            z = 3.0 * random.standard_normal()  # interrupted: noise alone
        if k % 53 == 31:
            z = gross
        rows.append((k, float("nan") if k % 29 == 17 else round(float(z), 6)))
    return rows


def line() -> list[tuple[float, float, float]]:
    """An S of two arcs of 300 m radius, 1.2 km long, in the plane."""
    heading, x, y, rows = 0.0, 0.0, 0.0, []
    for k in range(121):
        rows.append((round(float(x), 4), round(float(y), 4), 0.0))
        heading += 10.0 / 300.0 * (1 if k < 60 else -1)
        x += 10.0 * np.cos(heading)
        y += 10.0 * np.sin(heading)
    return rows


def epochs() -> list[tuple[float, ...]]:
    """A minute along the first arc with ten satellites of two systems: healthy, one that is 80 m
    long, two, hardly any, an absurd one."""
    random = np.random.RandomState(2005)
    azimuth = np.arange(10) * 0.628 + 0.1 * random.standard_normal(10)
    elevation = random.uniform(0.2, 1.4, 10)
    sigma = np.round(2.0 / np.sin(elevation), 3)
    north, east = np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth)
    sky = np.round(2.2e7 * np.column_stack([north, east, np.sin(elevation)]), 1)
    points = np.array(line())
    rows: list[tuple[float, ...]] = []
    for epoch in range(60):
        first = points[5 + epoch // 2]
        here = first + (points[6 + epoch // 2] - first) * (0.5 * (epoch % 2))
        for k in range(10):
            r = float(np.linalg.norm(sky[k] - here)) + 1000.0 * (k % 2)
            r += sigma[k] * random.standard_normal()
            r += 80.0 * (20 <= epoch < 26 and k == 3) - 120.0 * (30 <= epoch < 34 and k in (2, 7))
            if epoch == 40 and k > 1:
                r = float("nan")
            if epoch == 45 and k == 5:
                r = 1e300
            rows.append((epoch, k, *sky[k].tolist(), round(r, 4), float(sigma[k]), k % 2))
    return rows


def bus() -> list[str]:
    """The journey as lines for the speed monitor: messages as they arrive, an estimate every 0.5 s,
    0.2 s later."""
    rows, lines = journey(), []
    for tick in range(500 * MS, 60_001 * MS, 500 * MS):
        while rows and rows[0][0] <= tick + 200 * MS:
            _, stamp, sensor, value = rows.pop(0)
            lines.append(f"M,{stamp},{sensor},{value}")
        lines.append(f"E,{tick}")
    return lines


def drifting() -> list[str]:
    """20 s of a wheel, a radar and a receiver at 10 Hz; from 12 s on the radar drifts by 0.4 m/s a
    second."""
    random = np.random.RandomState(2023)
    lines = []
    for k in range(1, 201):
        t = 0.1 * k
        for sensor, sigma in enumerate((0.1, 0.3, 0.2)):
            value = (
                20.0 + sigma * random.standard_normal() + 0.4 * max(t - 12.0, 0.0) * (sensor == 1)
            )
            lines.append(f"M,{100 * MS * k},{sensor},{value:.4f}")
        if k % 5 == 0:
            lines.append(f"E,{100 * MS * k}")
    return lines


def satellites() -> list[str]:
    """Track and epochs as lines for the track monitor."""
    lines = [f"T,{x},{y},{z}" for x, y, z in line()]
    rows = epochs()
    for first in range(0, len(rows), 10):
        lines += [",".join(["S", *map(str, row[2:])]) for row in rows[first : first + 10]]
        lines.append(f"E,{rows[first][0]}")
    return lines


def write(name: str, header: str, rows: Iterable[Sequence[object]]) -> None:
    with (HERE / name).open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header.split(","))
        writer.writerows(rows)


def write_sample(program: str, lines: Iterable[str]) -> None:
    (SAMPLES / f"{program}.in").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    write("log.csv", "arrival,stamp,sensor,value", journey())
    write("measurements.csv", "k,z", interrupted(1e4))
    write("track.csv", "x,y,z", line())
    write("epochs.csv", "epoch,satellite,x,y,z,pseudorange,sigma,system", epochs())
    SAMPLES.mkdir(exist_ok=True)
    write_sample("speed_monitor", bus())
    write_sample("switching_filter", [f"Z,{z}" for _, z in interrupted(8.0)])
    write_sample("drift_detector", drifting())
    write_sample("track_monitor", satellites())
