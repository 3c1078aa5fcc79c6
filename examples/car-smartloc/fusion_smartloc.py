"""Satellites on a known track fused with a wheel sensor (car-smartloc): position and speed, with
alert limits.

``python examples/car-smartloc/fusion_smartloc.py [../shared/data/car-smartloc] --out DIR``. The
monitor judges every epoch (5 Hz); the position of an epoch that it declares usable, and that has no
rival, enters the asynchronous filter as one measurement with its own standard deviation, with or
without a protection level: the filter has fault modes of its own. It adds what a snapshot cannot
know: errors of reflections last for seconds (a Gauss–Markov bias), and may be tens of metres (a
drifting mode). Compared: both sensors, satellites
alone, the wheel alone from a known start; over the second half of the drive, to which no noise was
fitted. It prints a table and writes fusion.json and fusion.png into DIR. What it shows:
docs/recordings-raim.md.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np
import raim_smartloc as smartloc

import surefix as sf
from surefix import raim, tables
from surefix.plots import style

Array = smartloc.Array
RISKS = (1e-3, 1e-5, 1e-7)  # per estimate
RATE = 5.0  # Hz
USEFUL = 25.0, 1.0  # m, m/s: limits wider than this on each side are no use
SENSORS = ("gnss", "wheel")
KINDS = {"both": SENSORS, "satellites": ("gnss",), "wheel": ("wheel",)}
STATES = {"position": 0, "speed": 1}
FOUND = ("misleading", "at_steps", "half_width", "available", "error_95")
STEP = 0.25  # m, by which the reference moves from an epoch to the next beyond what the wheel says


def monitored(drive: smartloc.Drive, sigma: Array) -> raim.RaimResult:
    """Every epoch, looked for where the car may have come since the last."""
    judge = raim.TrackRaim(
        drive.whole, length=smartloc.LENGTH, false_alarm=smartloc.FALSE_ALARM, max_excluded=2,
        earth_rotation=True, max_speed=smartloc.FASTEST,
    )  # fmt: skip
    return judge.run(drive.data.with_sigma(sigma), near=0.0)


def fused_log(drive: smartloc.Drive, result: raim.RaimResult) -> sf.Log:
    """The usable positions, each with its own sigma, and the wheel's readings."""
    gnss, time, n = result.to_log("gnss", protected=False), drive.data.epoch_time, len(drive.speed)
    assert gnss.sigma is not None
    return sf.Log(
        np.append(gnss.time, time), np.append(gnss.sensor, np.full(n, "wheel")),
        np.append(gnss.value, drive.speed), np.append(gnss.sigma, np.full(n, np.nan)),
    )  # fmt: skip


def make_filter(drive: smartloc.Drive, kind: str, state: str, risk: float) -> sf.RobustFilter:
    """Limits on the position or the speed, from the sensors of ``kind``."""
    sensors = {
        "gnss": sf.Sensor(
            "gnss", 10.0, observes=(1.0, 0.0), bias_sigma=10.0, bias_time=10.0,
            faults=(sf.Drifting(sigma=60.0, walk=5.0, rate=0.01, duration=10.0),),
        ),
        "wheel": sf.Sensor(
            "wheel", 0.1, observes=(0.0, 1.0), scale_sigma=0.005,
            faults=(sf.Outage(span=50.0, rate=1e-4, duration=5.0),),
        ),
    }  # fmt: skip
    direction = np.zeros(2 + len(KINDS[kind]))  # each sensor has one state of its own
    direction[STATES[state]] = 1.0
    return sf.RobustFilter(
        sf.ConstantVelocity(1.5, position=True), [sensors[name] for name in KINDS[kind]],
        [0.0, float(drive.speed[0])], np.diag([15.0**2, 1.0]),
        start=float(drive.data.epoch_time[0]), risk=risk, direction=direction,
    )  # fmt: skip


def truth(drive: smartloc.Drive, folder: Path) -> dict[str, Array]:
    """Mileage on the track [m] and speed [m/s] (T,): the recorded path length, of which the smooth
    track is a little shorter, and what it gains in two seconds, since it steps now and then where
    the wheel turns evenly."""
    path = np.genfromtxt(folder / "truth.csv", delimiter=",", names=True)["s_m"]
    along, time = path * (drive.whole.length / path[-1]), drive.data.epoch_time
    ends = [np.clip(time + move, time[0], time[-1]) for move in (-1.0, 1.0)]
    before, after = (np.interp(end, time, along) for end in ends)
    return {"position": along, "speed": (after - before) / (ends[1] - ends[0])}


def judge(
    result: sf.RobustResult, true: Array, state: str, time: Array, steps: Array
) -> dict[str, float]:
    """Over the second half of the drive. 'at_steps': the share of what is misleading that lies
    within a second of a step of the reference."""
    known = np.interp(result.time, time, true)
    near = np.asarray((np.abs(result.time[:, None] - steps) <= 1.0).any(axis=1))
    rows = result.time > time[len(time) // 2]
    outside = (known < result.lower) | (known > result.upper)
    half = (result.upper - result.lower) / 2
    error = np.abs(result.x[:, STATES[state]] - known)
    wrong = rows & outside
    return {
        "misleading": float(outside[rows].mean()),
        "at_steps": float(near[wrong].mean()) if wrong.any() else 0.0,
        "half_width": float(np.median(half[rows])),
        "available": float((half[rows] < USEFUL[STATES[state]]).mean()),
        "error_95": float(np.quantile(error[rows], 0.95)),
    }


def compare(drive: smartloc.Drive, true: dict[str, Array], log: sf.Log) -> list[dict[str, Any]]:
    rows, time = [], drive.data.epoch_time
    moved = np.diff(true["position"]) - (drive.speed[1:] + drive.speed[:-1]) / 2 * np.diff(time)
    steps = time[1:][np.abs(moved) > STEP]
    for state in STATES:
        for kind in KINDS:
            for risk in RISKS:
                result = make_filter(drive, kind, state, risk).run(log, rate=RATE)
                found = judge(result, true[state], state, time, steps)
                rows.append({"limits": state, "sensors": kind, "risk": risk, **found})
    return rows


def draw(drive: smartloc.Drive, true: dict[str, Array], log: sf.Log, out: Path) -> None:
    """Errors and limits of the position at the middle risk."""
    figure = style.new_figure(9, 7)
    panels = figure.subplots(3, 1, sharex=True)
    for axes, kind in zip(panels, KINDS, strict=True):
        result = make_filter(drive, kind, "position", RISKS[1]).run(log, rate=RATE)
        known = np.interp(result.time, drive.data.epoch_time, true["position"])
        axes.fill_between(
            result.time, result.lower - known, result.upper - known, alpha=0.25, lw=0,
            label=f"limits at {RISKS[1]:g}",
        )  # fmt: skip
        axes.plot(result.time, result.x[:, 0] - known, lw=1, label="error")
        axes.axhline(0, color="0.3", lw=0.6)
        axes.set(ylabel=f"{kind} [m]", ylim=(-120, 120))
        style.clean(axes)
    style.legend_above(figure, panels[0], "Error of the position along the track, and its limits")
    panels[-1].set_xlabel("time [s]")
    figure.savefig(out, dpi=120)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("data", type=Path, nargs="?", default=smartloc.DATA)
    parser.add_argument("--out", type=Path, default=Path("fusion-smartloc"))
    arguments = parser.parse_args()
    drive = smartloc.read(arguments.data)
    true = truth(drive, arguments.data)
    found: dict[str, dict[str, Any]] = {}
    arguments.out.mkdir(parents=True, exist_ok=True)
    for name, sigma in smartloc.noise_models(drive).items():
        if name == "stated":
            continue  # wrong by far: see raim_smartloc.py
        result = monitored(drive, sigma)
        log = fused_log(drive, result)
        found[name] = {"monitor": result.counts, "limits": compare(drive, true, log)}
        print(f"noise model {name!r}: {result.counts}")
        print(f"{'':12}{'sensors':12}{'risk':>8}" + "".join(f"{key:>14}" for key in FOUND))
        for row in found[name]["limits"]:
            print(
                f"{row['limits']:12}{row['sensors']:12}{row['risk']:8.0e}"
                + "".join(f"{row[key]:14.3f}" for key in FOUND)
            )
        if name == "fitted":
            draw(drive, true, log, arguments.out / "fusion.png")
    tables.plain(arguments.out / "fusion.json", found)


if __name__ == "__main__":
    main()
