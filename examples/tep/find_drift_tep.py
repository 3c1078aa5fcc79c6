"""A slow drift and a sticking valve in the Tennessee Eastman process (tep).

``python examples/tep/find_drift_tep.py [../shared/data/tep] --out DIR`` identifies a vector
autoregression of four measured variables on the first half of the normal data, checks it on the
second half, and looks for steps, ramps and oscillations in that half followed by a faulty
recording; it prints a table and writes figure.png into DIR. What it shows: docs/recordings.md.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

import surefix as sf
from surefix import tables
from surefix.plots import style

Array = npt.NDArray[np.float64]

DATA = Path(__file__).resolve().parents[3] / "shared" / "data" / "tep"
# Reactor pressure, reactor temperature, separator temperature, cooling water outlet temperature.
VARIABLES = ("xmeas_7", "xmeas_9", "xmeas_11", "xmeas_21")
FITTED = 250  # samples of d00 that the model is identified on: all there is before SEAM
ORDERS = range(1, 7)
Δt = 0.05  # h
SEAM = (500 - FITTED) * Δt  # h, when the faulty recording begins in those that are put together
PROFILES = {"step": sf.Profile.step(), "ramp": sf.Profile.ramp()}
FALSE_ALARM = 1e-3 / (len(VARIABLES) * len(PROFILES))  # 1e-3 for all searches together


@dataclass(frozen=True)
class Model:
    """z_k = mean + spread ∘ (C₁ y_{k-1} + … + C_p y_{k-p} + e), y the scaled variables."""

    mean: Array
    spread: Array
    A: Array
    Q: Array
    stationary: Array
    order: int
    bic: dict[int, float]


def read(path: Path) -> Array:
    """(steps, variables)."""
    table = np.genfromtxt(path, delimiter=",", names=True)
    return np.column_stack([table[name] for name in VARIABLES])


def regress(y: Array, order: int, first: int) -> tuple[Array, Array]:
    """Coefficients (m, m · order) and covariance of what is left, from sample ``first`` on."""
    past = np.hstack([y[first - lag : len(y) - lag] for lag in range(1, order + 1)])
    C = np.asarray(np.linalg.lstsq(past, y[first:], rcond=None)[0], dtype=float)
    left = y[first:] - past @ C
    S: Array = left.T @ left / (len(left) - past.shape[1])
    return C.T, S


def identify(normal: Array) -> Model:
    """Of the order with the lowest Bayesian information criterion."""
    mean, spread = normal.mean(0), normal.std(0)
    y, m = (normal - mean) / spread, normal.shape[1]
    n = len(y) - max(ORDERS)
    bic = {}
    for order in ORDERS:
        S = regress(y, order, max(ORDERS))[1]
        bic[order] = float(n * np.linalg.slogdet(S)[1] + order * m * m * np.log(n))
    order = min(bic, key=lambda p: bic[p])
    C, S = regress(y, order, order)
    A, Q = np.eye(m * order, k=-m), np.zeros((m * order, m * order))
    A[:m], Q[:m, :m] = C, S
    P, power = Q, A
    for _ in range(40):  # P = A P Aᵀ + Q, by doubling
        P, power = P + power @ P @ power.T, power @ power
    return Model(mean, spread, A, Q, P, order, bic)


def make_record(model: Model, *recordings: Array) -> sf.ForwardRecord:
    """Of recordings put one after another: each begins anew, as a stationary process."""
    m, n = len(VARIABLES), len(model.A)
    z = (np.concatenate(recordings) - model.mean) / model.spread
    A, Q = np.tile(model.A, (len(z) - 1, 1, 1)), np.tile(model.Q, (len(z) - 1, 1, 1))
    for seam in np.cumsum([len(z) for z in recordings])[:-1] - 1:
        A[seam], Q[seam] = 0.0, model.stationary
    system = sf.LinearSystem(A, np.eye(m, n), Q, 1e-6 * np.eye(m), np.zeros(n), model.stationary)
    return sf.ForwardRecord(system, z, Δt * np.arange(len(z)), channels=VARIABLES)


def search(record: sf.ForwardRecord, profiles: Sequence[str] = ("step", "ramp")) -> dict[str, Any]:
    """Rows by channel and profile."""
    rows = {}
    for channel in VARIABLES:
        for kind in profiles:
            found = sf.OnsetDetector(PROFILES[kind], channel, FALSE_ALARM, samples=128).run(record)
            rows[f"{channel} {kind}"] = {
                "onset": found.onset, "amplitude": found.amplitude, "se": found.amplitude_se,
                "drop": found.drop, "threshold": found.threshold, "p": found.p_value,
                "detected": found.detected,
            }  # fmt: skip
    return rows


def oscillation(record: sf.ForwardRecord) -> dict[str, Any]:
    """Rows by channel [1/h]."""
    rows = {}
    for channel in VARIABLES:
        detector = sf.SpectrumDetector(channel, false_alarm=1e-3 / len(VARIABLES), samples=128)
        found = detector.run(record)
        rows[channel] = {
            "frequency": found.refined_frequency, "amplitude": found.amplitude,
            "se": found.amplitude_se, "drop": found.drop, "threshold": found.threshold,
            "p": found.p_value, "detected": found.detected,
        }  # fmt: skip
    return rows


def best(rows: dict[str, Any]) -> tuple[str, dict[str, Any]]:
    """The search whose drop is farthest beyond its threshold."""
    name = max(rows, key=lambda key: float(rows[key]["drop"] - rows[key]["threshold"]))
    return name, rows[name]


def as_it_comes(
    model: Model, before: Array, data: Array, every: int = 2
) -> Iterator[dict[str, Any]]:
    """What is found with so much of ``data``, after ``before``, up to the first alarm."""
    for samples in range(every, len(data) + 1, every):
        name, row = best(search(make_record(model, before, data[:samples])))
        yield {"after": samples * Δt, "search": name, **row}
        if row["detected"]:
            return


def analyse(folder: Path) -> dict[str, Any]:
    """All figures."""
    normal = read(folder / "d00.csv")
    model = identify(normal[:FITTED])
    kept = normal[FITTED:]
    out: dict[str, Any] = {"order": model.order, "bic": model.bic}
    for name, data in {
        "d00, fitted": [normal[:FITTED]], "d00, kept back": [kept],
        "d00, kept back, then d13": [kept, read(folder / "d13.csv")],
        "d00, kept back, then d14": [kept, read(folder / "d14.csv")],
    }.items():  # fmt: skip
        record = make_record(model, *data)
        alone = make_record(model, data[-1])  # an oscillation is looked for in the last one
        white = record.nis[5:] / len(VARIABLES)
        out[name] = {"nis": float(white.mean()), "onsets": search(record),
                     "oscillations": oscillation(alone)}  # fmt: skip
        if len(data) > 1:
            out[name]["as it comes"] = list(as_it_comes(model, kept, data[1]))
    healthy = list(as_it_comes(model, normal[:FITTED], kept, every=10))
    out["d00, kept back"]["as it comes"] = healthy
    return out


def draw(folder: Path, path: Path) -> None:
    """The variables where the faults are seen best, and the ratios."""
    normal = read(folder / "d00.csv")
    model, kept = identify(normal[:FITTED]), normal[FITTED:]
    figure = style.new_figure(12.0, 6.5)
    grid = figure.subplots(2, 3)
    for row, name in zip(grid, ("d13", "d14"), strict=True):
        faulty = read(folder / f"{name}.csv")
        data = np.concatenate([kept, faulty])
        time = Δt * np.arange(len(data))
        row[0].plot(time, data[:, 3], lw=0.6, color=style.PALETTE[0])
        row[0].axvline(SEAM, color="black", ls=":")
        row[0].set(title=f"d00, then {name}: xmeas_21", xlabel="time [h]", ylabel="[°C]")
        kind, upto = ("ramp", 40) if name == "d13" else ("step", len(faulty))
        record = make_record(model, kept, faulty[:upto])
        for i, channel in enumerate(VARIABLES):
            detector = sf.OnsetDetector(PROFILES[kind], channel, FALSE_ALARM, samples=128)
            found = detector.run(record)
            row[1].plot(found.time, found.ratio, lw=1, color=style.PALETTE[i], label=channel)
        row[1].axhline(found.threshold or 0, color="black", ls="--", lw=1)
        row[1].axvline(SEAM, color="black", ls=":")
        row[1].set(yscale="log", ylim=(0.1, 1e4), xlabel="onset [h]", ylabel="drop")
        row[1].set_title(f"a {kind}, with {upto * Δt:g} h of {name}", fontsize=10)
        for data, colour, text in ((faulty, style.ALARM, name), (kept, "black", "d00, kept back")):
            spectrum = sf.SpectrumDetector("xmeas_9", samples=128).run(make_record(model, data))
            row[2].plot(spectrum.frequency, spectrum.ratio, lw=0.8, color=colour, label=text)
        row[2].axhline(spectrum.threshold or 0, color="black", ls="--", lw=1)
        row[2].set(yscale="log", ylim=(0.1, 1e5), xlabel="frequency [1/h]", ylabel="drop")
        row[2].set_title("an oscillation of xmeas_9", fontsize=10)
        for axes in row:
            style.clean(axes)
        row[1].legend(fontsize=8, loc="upper left")
        row[2].legend(fontsize=8)
    figure.savefig(path, dpi=100)


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table and write the figure."""
    parser = argparse.ArgumentParser(description="Slow drift and sticking valve of tep.")
    parser.add_argument("data", type=Path, nargs="?", default=DATA, help="folder of the recording")
    parser.add_argument("--out", type=Path, default=Path("/tmp/tep"), help="to write to")
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")
    given = parser.parse_args(arguments)
    figures = analyse(given.data)
    given.out.mkdir(parents=True, exist_ok=True)
    draw(given.data, given.out / "figure.png")
    if given.json:
        print(tables.as_json(figures, 2))
        return
    print(f"order {figures['order']}")
    for name, part in figures.items():
        if not isinstance(part, dict) or "nis" not in part:
            continue
        print(f"{name}: NIS for each variable {part['nis']:.2f}")
        for key, row in part["onsets"].items():
            print(f"  {key:14} since {row['onset']:6.2f} h {row['amplitude']:8.3g} ± "
                  f"{row['se']:<8.2g} drop {row['drop']:8.1f} ({row['threshold']:.1f}) "
                  f"p {row['p']:.2g}")  # fmt: skip
        for key, row in part["oscillations"].items():
            print(f"  {key:8} {row['frequency']:6.3f} /h {row['amplitude']:8.3g} ± "
                  f"{row['se']:<8.2g} drop {row['drop']:8.1f} ({row['threshold']:.1f}) "
                  f"p {row['p']:.2g}")  # fmt: skip
        looks = part.get("as it comes", [])
        if looks and not looks[-1]["detected"]:
            print(f"  no alarm as it comes, in {len(looks)} looks; "
                  f"smallest p {min(row['p'] for row in looks):.2g}")  # fmt: skip
        for row in looks[-1:] if looks and looks[-1]["detected"] else []:
            print(f"  first alarm {row['after']:.2f} h after the fault began: {row['search']} "
                  f"since {row['onset']:.2f} h, p {row['p']:.2g}")  # fmt: skip


if __name__ == "__main__":
    main()
