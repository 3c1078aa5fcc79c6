"""Loads and vibrations of a rotating shaft (rotor-rosa), found by their likelihood ratio.

``python examples/rotor-rosa/find_drift_rotor.py [../shared/data/rotor-rosa] --out DIR`` reads the
speed of the encoder with the control effort as known input, looks for loads as steps, ramps and
exponentials, and for vibrations in the lateral force; it prints a table and writes figure.png into
DIR. ``--fit`` looks for the parameters again. What it shows: docs/recordings.md.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

import surefix as sf
from surefix import tables
from surefix.plots import style

Array = npt.NDArray[np.float64]
Columns = dict[str, npt.NDArray[Any]]
Parameters = dict[str, float]

DATA = Path(__file__).resolve().parents[3] / "shared" / "data" / "rotor-rosa"
LOADS = ("healthy_101", "healthy_103", "damping_401", "damping_403", "lateral_200", "lateral_202",
         "vibration_301", "vibration_303")  # fmt: skip
FIXED = 3.6748  # Hz, an oscillation that is there at every speed, with two harmonics
TURN = 0.9844  # turns of the shaft for each turn that the encoder claims
# The likeliest on healthy_101 (--fit): response time of the speed [s] and gain of the control
# effort [rpm/%], of which only the ratio is well determined; noises of the speed and of the load
# [rpm/√s], white noise [rpm], wander of the fixed oscillation and of those of a turn [rpm/√s].
SPEED = {"response": 2.0, "gain": 5.0, "speed": 0.98, "load": 0.08, "white": 3.5,
         "fixed": 0.002, "turn": 0.087}  # fmt: skip
# The likeliest on 10.0 to 13.0 s of vibration_303, in contact without vibration, in N.
FORCE = {"response": 0.56, "gain": 0.0, "speed": 0.0, "load": 0.094, "white": 0.155,
         "fixed": 0.0, "turn": 0.054}  # fmt: skip
QUIET = (10.05, 13.0)  # s
# The exponential is as slow as the loads of damping_401 are seen to be.
PROFILES = {
    "step": sf.Profile.step(),
    "ramp": sf.Profile.ramp(),
    "exponential 0.3 s": sf.Profile.exponential(0.3),
}


def read(path: Path) -> Columns:
    """The columns of a file by name."""
    table = np.genfromtxt(path, delimiter=",", names=True, dtype=None, encoding="utf-8")
    return {name: table[name] for name in table.dtype.names or ()}


def make_record(
    data: Columns, z: Array, mean: float, deviation: float, p: Parameters, turns: int, fixed: int
) -> sf.ForwardRecord:
    """A slow quantity that follows the control effort and an unknown load, the harmonics of the
    fixed oscillation, and those of a turn, whose phase the encoder gives."""
    t, effort = data["t_s"], data["control_effort_pct"]
    Δt = np.diff(t)
    rate = TURN * data["speed_encoder_rpm"][:-1] / 60
    turned = [2 * np.pi * FIXED * h * Δt for h in range(1, fixed + 1)]
    turned += [2 * np.pi * rate * h * Δt for h in range(1, turns + 1)]
    n, N = 2 + 2 * len(turned), len(Δt)
    A, Q, inputs = np.zeros((N, n, n)), np.zeros((N, n, n)), np.zeros((N, n))
    kept = np.exp(-Δt / p["response"])
    A[:, 0, 0], A[:, 0, 1], A[:, 1, 1] = kept, 1 - kept, 1.0
    inputs[:, 0] = (1 - kept) * p["gain"] * (effort[:-1] - effort[:66].mean())
    Q[:, 0, 0] = p["speed"] ** 2 * p["response"] / 2 * (1 - kept**2)
    Q[:, 1, 1] = p["load"] ** 2 * Δt
    for i, angle in enumerate(turned):
        a, b = 2 + 2 * i, 3 + 2 * i
        A[:, a, a] = A[:, b, b] = np.cos(angle)
        A[:, a, b], A[:, b, a] = np.sin(angle), -np.sin(angle)
        Q[:, a, a] = Q[:, b, b] = (p["fixed"] if i < fixed else p["turn"]) ** 2 * Δt
    H = np.zeros((1, n))
    H[0, 0] = H[0, 2::2] = 1.0
    x0, P0 = np.zeros(n), np.diag([*[deviation**2] * 2, *[deviation**2 / 4] * (n - 2)])
    x0[:2] = mean  # with no load it stays as it is
    R = np.array([[p["white"] ** 2]])
    return sf.ForwardRecord(sf.LinearSystem(A, H, Q, R, x0, P0), z[:, None], t, inputs)


def speed_record(data: Columns, p: Parameters = SPEED) -> sf.ForwardRecord:
    """Of the encoder's speed."""
    z = data["speed_encoder_rpm"].astype(float)
    return make_record(data, z, float(data["speed_cmd_rpm"][0]), 20.0, p, turns=5, fixed=3)


def force_record(data: Columns, p: Parameters = FORCE) -> sf.ForwardRecord:
    """Of the lateral force."""
    z = data["lateral_force_n"].astype(float)
    return make_record(data, z, float(z[:30].mean()), 2.0, p, turns=5, fixed=0)


def part(data: Columns, begin: float, end: float) -> Columns:
    inside = (data["t_s"] >= begin) & (data["t_s"] < end)
    return {name: column[inside] for name, column in data.items()}


def labels(data: Columns) -> list[float]:
    """When the damper, or whether there is a fault, changes [s]."""
    healthy = data["mode"] == "H"
    change = (np.diff(data["damper_ohm"]) != 0) | (np.diff(healthy.astype(int)) != 0)
    found: list[float] = []
    for t in data["t_s"][1:][change].tolist():
        if not found or t - found[-1] > 0.5:  # the label flickers
            found.append(t)
    return found


def loads(folder: Path) -> Iterator[dict[str, Any]]:
    """A row for each recording and profile."""
    for name in LOADS:
        data = read(folder / f"{name}.csv")
        record = speed_record(data)
        for kind, profile in PROFILES.items():
            found = sf.OnsetDetector(profile, samples=256).run(record)
            yield {
                "recording": name, "labels": labels(data), "nis": float(record.nis[100:].mean()),
                "profile": kind, "onset": found.onset, "amplitude": found.amplitude,
                "se": found.amplitude_se, "drop": found.drop, "threshold": found.threshold,
                "p": found.p_value, "detected": found.detected,
            }  # fmt: skip


def sections(data: Columns) -> Iterator[tuple[float, float, float]]:
    """Begin, end [s] and frequency [Hz] of what is in contact at one frequency for 1.5 s."""
    t, vibration = data["t_s"], data["vibration_hz"]
    contact = t[data["mode"] != "H"]
    if len(contact) == 0:  # the whole of a healthy recording
        yield float(t[0]), float(t[-1]), 0.0
        return
    change = np.flatnonzero(np.diff(vibration) != 0) + 1
    for a, b in zip(change, [*change[1:], len(t)], strict=True):
        begin, end = float(t[a]) + 0.05, min(float(t[b - 1]), float(contact[-1]) - 0.3)
        if end - begin > 1.5:
            yield begin, end, float(vibration[a])


def vibrations(folder: Path) -> Iterator[dict[str, Any]]:
    """A row for each section and measured quantity."""
    for name in ("healthy_103", *LOADS[-2:]):
        data = read(folder / f"{name}.csv")
        for begin, end, labelled in sections(data):
            own = part(data, begin, end)
            for quantity, make in (("force", force_record), ("speed", speed_record)):
                record = make(own)
                found = sf.SpectrumDetector(samples=0).run(record)
                near = found.ratio[np.abs(found.frequency - labelled) < 1 / (end - begin)]
                yield {
                    "recording": name, "begin": begin, "end": end, "labelled": labelled,
                    "quantity": quantity, "nis": float(record.nis[20:].mean()),
                    "frequency": found.refined_frequency, "amplitude": found.amplitude,
                    "se": found.amplitude_se, "drop": found.drop, "threshold": found.threshold,
                    "p": found.p_value, "detected": found.detected, "reason": found.reason,
                    "drop_at_label": float(near.max()) if labelled else None,
                }  # fmt: skip


def fit(make: Callable[[Parameters], sf.ForwardRecord], start: Parameters) -> Parameters:
    """A maximum of the likelihood, one parameter at a time."""
    best, factor, highest = start, 1.6, make(start).log_likelihood
    while factor > 1.02:
        before = highest
        for name in [name for name, value in start.items() if value > 0]:
            for f in (factor, 1 / factor):
                tried = best | {name: best[name] * f}
                if (value := make(tried).log_likelihood) > highest:
                    best, highest = tried, value
        factor = factor if highest > before + 0.1 else factor**0.5
    return {name: float(f"{value:.3g}") for name, value in best.items()}


def draw(folder: Path, rows: list[dict[str, Any]], path: Path) -> None:
    """Above: speeds, with the onsets labelled and found. Below: ratios, and a spectrum."""
    figure = style.new_figure(12.0, 7.0)
    grid = figure.subplots(2, 3)
    for axes, name in zip(grid[0], ("healthy_103", "damping_401", "lateral_202"), strict=True):
        data = read(folder / f"{name}.csv")
        axes.plot(data["t_s"], data["speed_encoder_rpm"], lw=0.5, color=style.PALETTE[4])
        for at in labels(data):
            axes.axvline(at, color="black", ls=":")
        own = [row for row in rows if row["recording"] == name and row["profile"] != "ramp"]
        best = max(own, key=lambda row: float(row["drop"]))
        if best["detected"]:
            axes.axvline(best["onset"], color=style.ALARM, label=f"found ({best['profile']})")
            axes.legend(fontsize=8, loc="lower right")
        chance = f"p = {best['p']:.1g}" if best["p"] > 0 else "p < 1e-300"
        axes.set_title(f"{name}: {chance}; dotted: labelled", fontsize=10)
        axes.set(ylabel="speed [rpm]", xlabel="time [s]")
    for axes, name in zip(grid[1, :2], ("healthy_103", "damping_401"), strict=True):
        record = speed_record(read(folder / f"{name}.csv"))
        for i, (kind, profile) in enumerate(list(PROFILES.items())[:3]):
            found = sf.OnsetDetector(profile).run(record)
            axes.plot(found.time, found.ratio, lw=1, color=style.PALETTE[i], label=kind)
            axes.axhline(found.threshold or 0, lw=1, ls="--", color=style.PALETTE[i])
        axes.set(yscale="log", ylim=(0.1, 1e4), xlabel="onset [s]", ylabel="drop")
        axes.set_title("ratios; dashed: threshold at 1e-3", fontsize=10)
        axes.legend(fontsize=8, loc="upper right")
    for i, name in enumerate(("vibration_301", "vibration_303")):
        data = read(folder / f"{name}.csv")
        begin, end, labelled = next(s for s in sections(data) if s[2] == (3.0, 12.0)[i])
        spectrum = sf.SpectrumDetector(samples=0).run(force_record(part(data, begin, end)))
        text = f"{name}, labelled {labelled:g} Hz"
        grid[1, 2].plot(spectrum.frequency, spectrum.ratio, lw=1, color=style.PALETTE[i])
        grid[1, 2].lines[-1].set_label(text)
        grid[1, 2].axvline(labelled, lw=1, ls=":", color=style.PALETTE[i])
    grid[1, 2].axhline(spectrum.threshold or 0, lw=1, ls="--", color="black")
    grid[1, 2].set(yscale="log", ylim=(0.1, 3000), xlabel="frequency [Hz]", ylabel="drop")
    grid[1, 2].set_title("lateral force; dashed: threshold", fontsize=10)
    grid[1, 2].legend(fontsize=8)
    for axes in grid.ravel():
        style.clean(axes)
    figure.savefig(path, dpi=100)


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the tables and write the figure."""
    parser = argparse.ArgumentParser(description="Slow loads and vibrations of rotor-rosa.")
    parser.add_argument("data", type=Path, nargs="?", default=DATA, help="folder of the recording")
    parser.add_argument("--out", type=Path, default=Path("/tmp/rotor-rosa"), help="to write to")
    parser.add_argument("--json", action="store_true", help="print the rows as JSON")
    parser.add_argument("--fit", action="store_true", help="look for the parameters, then stop")
    given = parser.parse_args(arguments)
    if given.fit:
        healthy = read(given.data / "healthy_101.csv")
        quiet = part(read(given.data / "vibration_303.csv"), *QUIET)
        print("SPEED", fit(lambda p: speed_record(healthy, p), SPEED))
        print("FORCE", fit(lambda p: force_record(quiet, p), FORCE))
        return
    rows, spectra = list(loads(given.data)), list(vibrations(given.data))
    given.out.mkdir(parents=True, exist_ok=True)
    draw(given.data, rows, given.out / "figure.png")
    if given.json:
        print(tables.as_json({"loads": rows, "vibrations": spectra}, 2))
        return
    for r in rows:
        print(f"{r['recording']:14} NIS {r['nis']:6.2f} {r['profile']:18} {r['onset']:6.2f} s "
              f"{r['amplitude']:8.3g} ± {r['se']:<8.2g} drop {r['drop']:8.1f} "
              f"({r['threshold']:.1f}) p {r['p']:8.2g} labels {r['labels']}")  # fmt: skip
    for r in spectra:
        if r["frequency"] is None:
            print(f"{r['recording']:14} {r['quantity']} {r['reason']}")
            continue
        print(f"{r['recording']:14} {r['begin']:5.1f} to {r['end']:5.1f} s {r['quantity']} NIS "
              f"{r['nis']:5.2f} labelled {r['labelled']:4.0f} Hz, found {r['frequency']:6.2f} Hz "
              f"{r['amplitude']:6.2f} ± {r['se']:.2f} drop {r['drop']:7.1f} ({r['threshold']:.1f}) "
              f"p {r['p']:8.2g} at the label {r['drop_at_label']}")  # fmt: skip


if __name__ == "__main__":
    main()
