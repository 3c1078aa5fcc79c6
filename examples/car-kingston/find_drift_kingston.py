"""Ramps put into the wheel speed of car-kingston, found by their likelihood ratio.

``python examples/car-kingston/find_drift_kingston.py [../shared/data/car-kingston] --out DIR`` puts
ramps of 0.005 to 0.1 m/s² into the wheel speed and looks for steps and ramps in it: with the model
of config.toml, in which it is the only sensor, and with the reference unit beside it as a second
one. It does the same with the log as it is, prints a table and writes figure.png into DIR. What it
shows: docs/recordings.md.
"""

from __future__ import annotations

import argparse
import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

import surefix as sf
from surefix import tables
from surefix.config import Config, load_config
from surefix.plots import style

DATA = Path(__file__).resolve().parents[3] / "shared" / "data" / "car-kingston"
SLOPES = (0.005, 0.01, 0.02, 0.05, 0.1)  # m/s²
ONSETS = (340.0, 940.0, 1440.0)  # s, followed by a minute without a stop or nearly so
LASTS = 60.0  # s after which the log is cut: the question is what a minute of it shows
BEFORE = 300.0  # s that are used before the onset
# The reference unit as a sensor: noise of an INS/GNSS unit [m/s].
UNIT = sf.Sensor("unit", sigma=0.05, observes=(1.0, 0.0, 0.0))
SCALE = 0.01  # of a wheel: tyres (config.toml), here a state, since the unit shows it
PROFILES = {"step": sf.Profile.step(), "ramp": sf.Profile.ramp()}
FALSE_ALARM = 1e-3 / len(PROFILES)  # 1e-3 for both searches together


def configuration() -> Config:
    return load_config(Path(__file__).with_name("config.toml"))


def make_filters() -> dict[str, sf.DesyncFilter]:
    """With the wheel speed alone, and with the unit beside it."""
    config = configuration()
    (obd,) = config.sensors
    scaled = dataclasses.replace(obd, scale_sigma=SCALE)
    # Where a part of the log begins, the speed is any.
    P0 = np.diag([10.0**2, 2.0**2, 0.1**2])
    return {
        "alone": sf.DesyncFilter(config.model, (obd,), np.zeros(3), P0),
        "with the unit": sf.DesyncFilter(config.model, (scaled, UNIT), np.zeros(3), P0),
    }


def read(folder: Path) -> sf.Log:
    """Wheel and unit, one after the other at every epoch."""
    table = np.genfromtxt(folder / "speed.csv", delimiter=",", names=True)
    time = np.repeat(table["t_s"], 2)
    value = np.column_stack([table["obd_mps"], table["reference_mps"]]).ravel()
    return sf.Log(time, np.tile(["obd", "unit"], len(table)), value)


def part(log: sf.Log, begin: float, end: float) -> sf.Log:
    kept = (log.time >= begin) & (log.time < end)
    return sf.Log(log.time[kept], log.sensor[kept], log.value[kept])


def search(filter: sf.DesyncFilter, log: sf.Log) -> list[dict[str, Any]]:
    """A row for each profile."""
    own = np.isin(log.sensor, [sensor.name for sensor in filter.sensors])
    log = sf.Log(log.time[own], log.sensor[own], log.value[own])
    record = sf.ForwardRecord(filter, log)
    rows = []
    for kind, profile in PROFILES.items():
        found = sf.OnsetDetector(profile, "obd", FALSE_ALARM, samples=128).run(record)
        rows.append({
            "profile": kind, "nis": float(np.nanmean(record.nis[log.sensor == "obd"])),
            "onset": found.onset, "amplitude": found.amplitude, "se": found.amplitude_se,
            "drop": found.drop, "threshold": found.threshold, "p": found.p_value,
            "detected": found.detected, "detectability": float(np.nanmax(found.detectability)),
        })  # fmt: skip
    return rows


def analyse(folder: Path) -> dict[str, Any]:
    """Rows by sensors: of all parts as recorded, and of every ramp."""
    log = read(folder)
    parts = np.arange(0.0, 2503.0 - BEFORE - LASTS, BEFORE + LASTS)
    out: dict[str, Any] = {}
    for name, filter in make_filters().items():
        healthy, injected = [], []
        for begin in parts:
            for row in search(filter, part(log, begin, begin + BEFORE + LASTS)):
                healthy.append({"begin": float(begin), **row})
        for onset in ONSETS:
            own = part(log, onset - BEFORE, onset + LASTS)
            for slope in (0.0, *SLOPES):
                fault = sf.InjectedFault(
                    sensor="obd", kind="ramp", size=slope, start=onset, end=onset + LASTS
                )
                for row in search(filter, fault.apply(own)):
                    injected.append({"true_onset": onset, "slope": slope, **row})
        out[name] = {"healthy": healthy, "injected": injected}
    return out


def draw(folder: Path, path: Path) -> None:
    """Ratios of a ramp, with one sensor and with two."""
    log, onset = read(folder), ONSETS[1]
    own = part(log, onset - BEFORE, onset + LASTS)
    figure = style.new_figure(12.0, 4.5)
    for axes, (name, filter) in zip(
        figure.subplots(1, 2, sharey=True), make_filters().items(), strict=True
    ):
        for colour, slope in zip(("black", *style.PALETTE), (0.0, 0.01, 0.02, 0.1), strict=False):
            fault = sf.InjectedFault(
                sensor="obd", kind="ramp", size=slope, start=onset, end=onset + LASTS
            )
            data = fault.apply(own)
            if name == "alone":
                kept = data.sensor == "obd"
                data = sf.Log(data.time[kept], data.sensor[kept], data.value[kept])
            detector = sf.OnsetDetector(PROFILES["ramp"], "obd", FALSE_ALARM, samples=128)
            found = detector.run(sf.ForwardRecord(filter, data))
            text = f"{slope:g} m/s²" if slope else "as recorded"
            axes.plot(found.time, found.ratio, lw=1, color=colour, label=text)
        axes.axhline(found.threshold or 0, color="black", ls="--", lw=1)
        axes.axvline(onset, color="black", ls=":")
        axes.set(yscale="log", ylim=(0.1, 1e4), xlabel="onset [s]", ylabel="drop")
        axes.set_title(f"wheel speed {name}: a ramp since {onset:g} s", fontsize=10)
        axes.legend(fontsize=8, loc="upper left")
        style.clean(axes)
    figure.savefig(path, dpi=100)


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table and write the figure."""
    parser = argparse.ArgumentParser(description="Ramps in the wheel speed of car-kingston.")
    parser.add_argument("data", type=Path, nargs="?", default=DATA, help="folder of the recording")
    parser.add_argument("--out", type=Path, default=Path("/tmp/car-kingston"), help="to write to")
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")
    given = parser.parse_args(arguments)
    figures = analyse(given.data)
    given.out.mkdir(parents=True, exist_ok=True)
    draw(given.data, given.out / "figure.png")
    if given.json:
        print(tables.as_json(figures, 2))
        return
    for name, sets in figures.items():
        for r in sets["healthy"] + sets["injected"]:
            slope = f"{r['slope']:5.3f} since {r['true_onset']:.0f} s" if "slope" in r else ""
            put = slope or f"as recorded from {r['begin']:.0f} s"
            print(f"{name:13} {put:25} {r['profile']} NIS {r['nis']:5.2f} since "
                  f"{r['onset']:7.1f} s {r['amplitude']:8.4f} ± {r['se']:<7.2g} "
                  f"drop {r['drop']:7.1f} ({r['threshold']:.1f}) p {r['p']:.2g} "
                  f"detectability {r['detectability']:.1g}")  # fmt: skip


if __name__ == "__main__":
    main()
