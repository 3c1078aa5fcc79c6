"""Ramps put into the speeds of car-comma2k19, found by their likelihood ratio.

``python examples/car-comma2k19/find_drift_comma2k19.py [../shared/data/car-comma2k19] --out DIR``
puts ramps of 0.005 to 0.1 m/s² into a wheel or the GNSS receiver, looks for steps and ramps in
every sensor, and does the same with the log as it is; with the models of config.toml and of
config-robust.toml without its faults. It prints a table and writes figure.png into DIR. What it
shows: docs/recordings.md.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import surefix as sf
from surefix import tables
from surefix.config import load_config
from surefix.plots import style

DATA = Path(__file__).resolve().parents[3] / "shared" / "data" / "car-comma2k19"
MODELS = {"config": "config.toml", "robust": "config-robust.toml"}
SENSORS = ("wheel_rl", "wheel_fr", "gnss_ublox")
SLOPES = (0.005, 0.01, 0.02, 0.05, 0.1)  # m/s²
ONSETS = (15.0, 30.0, 45.0)  # s
PROFILES = {"step": sf.Profile.step(), "ramp": sf.Profile.ramp()}
FALSE_ALARM = 1e-3 / (len(SENSORS) * len(PROFILES))  # 1e-3 for all searches together


def make_filter(model: str) -> sf.DesyncFilter:
    """All sensors healthy."""
    filter = load_config(Path(__file__).with_name(MODELS[model])).without_faults().make_filter()
    assert isinstance(filter, sf.DesyncFilter)
    return filter


def read(folder: Path) -> sf.Log:
    log = load_config(Path(__file__).with_name("config.toml")).read_log(folder / "speed_events.csv")
    kept = np.isin(log.sensor, SENSORS)
    return sf.Log(log.time[kept], log.sensor[kept], log.value[kept])


def with_ramp(log: sf.Log, sensor: str, slope: float, onset: float) -> sf.Log:
    """The ramp begins at ``onset`` and lasts."""
    end = float(log.time.max()) + 1
    return sf.InjectedFault(sensor=sensor, kind="ramp", size=slope, start=onset, end=end).apply(log)


def search(filter: sf.DesyncFilter, log: sf.Log) -> list[dict[str, Any]]:
    """A row for each sensor and profile. So many measurements have the bound for a threshold."""
    record = sf.ForwardRecord(filter, log)
    rows = []
    for sensor in SENSORS:
        own = record.nis[log.sensor == sensor]
        for kind, profile in PROFILES.items():
            found = sf.OnsetDetector(profile, sensor, FALSE_ALARM, samples=0).run(record)
            rows.append({
                "sensor": sensor, "profile": kind, "nis": float(np.nanmean(own)),
                "nis_median": float(np.nanmedian(own)), "onset": found.onset,
                "amplitude": found.amplitude, "se": found.amplitude_se, "drop": found.drop,
                "threshold": found.threshold, "p": found.p_value, "detected": found.detected,
                "detectability": float(np.nanmax(found.detectability)),
            })  # fmt: skip
    return rows


def injected(filter: sf.DesyncFilter, log: sf.Log) -> Iterator[dict[str, Any]]:
    """A row for each ramp: what is found in the sensor that has it, and which search sees most."""
    for sensor in ("wheel_rl", "gnss_ublox"):
        for onset in ONSETS:
            for slope in SLOPES:
                rows = search(filter, with_ramp(log, sensor, slope, onset))
                own = next(r for r in rows if r["sensor"] == sensor and r["profile"] == "ramp")
                most = max(rows, key=lambda row: float(row["drop"] - row["threshold"]))
                yield {"injected": sensor, "true_onset": onset, "slope": slope, **own,
                       "most": f"{most['sensor']} {most['profile']}"}  # fmt: skip


def analyse(folder: Path) -> dict[str, Any]:
    """All figures."""
    log = read(folder)
    return {
        model: {
            "healthy": search(make_filter(model), log),
            "injected": list(injected(make_filter(model), log)),
        }
        for model in MODELS
    }


def draw(folder: Path, path: Path) -> None:
    """Ratios of a ramp in the rear wheel, as recorded and with ramps, for both models."""
    log = read(folder)
    figure = style.new_figure(12.0, 4.5)
    for axes, model in zip(figure.subplots(1, 2, sharey=True), MODELS, strict=True):
        for colour, slope in zip(("black", *style.PALETTE), (0.0, 0.02, 0.05, 0.1), strict=False):
            data = with_ramp(log, "wheel_rl", slope, 30.0) if slope else log
            record = sf.ForwardRecord(make_filter(model), data)
            detector = sf.OnsetDetector(PROFILES["ramp"], "wheel_rl", FALSE_ALARM, samples=0)
            found = detector.run(record)
            text = f"{slope:g} m/s²" if slope else "as recorded"
            axes.plot(found.time, found.ratio, lw=1, color=colour, label=text)
        axes.axhline(found.threshold or 0, color="black", ls="--", lw=1)
        axes.axvline(30.0, color="black", ls=":")
        axes.set(yscale="log", ylim=(0.1, 1e6), xlabel="onset [s]", ylabel="drop")
        axes.set_title(f"{MODELS[model]}: a ramp of wheel_rl since 30 s", fontsize=10)
        axes.legend(fontsize=8)
        style.clean(axes)
    figure.savefig(path, dpi=100)


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table and write the figure."""
    parser = argparse.ArgumentParser(description="Ramps in the speeds of car-comma2k19.")
    parser.add_argument("data", type=Path, nargs="?", default=DATA, help="folder of the recording")
    parser.add_argument("--out", type=Path, default=Path("/tmp/car-comma2k19"), help="to write to")
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")
    given = parser.parse_args(arguments)
    figures = analyse(given.data)
    given.out.mkdir(parents=True, exist_ok=True)
    draw(given.data, given.out / "figure.png")
    if given.json:
        print(tables.as_json(figures, 2))
        return
    for model, part in figures.items():
        for r in part["healthy"] + part["injected"]:
            put = (
                f"{r['slope']:5.3f} since {r['true_onset']:.0f}" if "slope" in r else "as recorded"
            )
            print(f"{model:7} {put:14} {r['sensor']:10} {r['profile']} NIS {r['nis']:5.2f} "
                  f"({r['nis_median']:.2f}) since {r['onset']:5.2f} s {r['amplitude']:8.4f} ± "
                  f"{r['se']:<7.2g} drop {r['drop']:8.1f} ({r['threshold']:.1f}) p {r['p']:8.2g} "
                  f"detectability {r['detectability']:.2g} {r.get('most', '')}")  # fmt: skip


if __name__ == "__main__":
    main()
