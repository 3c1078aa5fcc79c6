"""The drift of a train's position in a tunnel, against the known track (train-infrabel).

``python examples/train-infrabel/find_drift_train.py [../shared/data/train-infrabel] --out DIR``
takes the distance of the receiver's position across the track, which would be a small constant if
both were right, identifies how it wanders on one clean run, and looks for steps and ramps in all
runs; it prints a table and writes figure.png into DIR. ``--fit`` looks for the parameters again.
What it shows: docs/recordings.md.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

import surefix as sf
from surefix import tables
from surefix.plots import style

Array = npt.NDArray[np.float64]

DATA = Path(__file__).resolve().parents[3] / "shared" / "data" / "train-infrabel"
FITTED, CLEAN = 28876, (28876, 29304)
# Run: until when it is looked at [s], before the position jumps back to where it belongs. Of 28586
# the track is probably wrong later on.
RUNS = {28876: 452.0, 29304: 361.0, 28554: 242.0, 28573: 190.0, 28586: 175.0, 29083: 353.0,
        30908: 380.0}  # fmt: skip
EVERY = 5  # of the samples at 2.5 Hz: the receiver smooths them
FIRST = 2.0  # s, before which the nearest point is often the end of the track
OFFSET = (2.5, 300.0)  # m, s: antenna beside the axis of the track, and the map
# The likeliest on the clean run FITTED (--fit), with white noise as given: speed of the wander
# [m/s] and how long it lasts [s]. Without white noise of its own the likelihood gives WHITE[0].
WANDER = {0.013: (0.019, 4.0), 0.1: (0.014, 130.0)}
PROFILES = {"step": sf.Profile.step(), "ramp": sf.Profile.ramp()}
TUNNEL, LOOKS = (28554, 28573, 28586), (120.0, 135.0, 150.0)  # s, as they enter it
AT_ONCE = 5.0  # s of a run between two looks at what has come


@dataclass(frozen=True)
class Run:
    number: int
    time: Array  # (N,) [s]
    cross: Array  # (N,) [m], left of the track is positive
    fixed: npt.NDArray[np.bool_]  # (N,) whether the receiver claims a centimetre fix

    def until(self, end: float) -> Run:
        kept = self.time < end
        return Run(self.number, self.time[kept], self.cross[kept], self.fixed[kept])


def read(folder: Path, number: int) -> Run:
    table = np.genfromtxt(
        folder / f"log_{number}.csv", delimiter=",", names=True, dtype=None, encoding="utf-8"
    )
    table = table[table["t_s"] >= FIRST][::EVERY]
    fixed = table["position_type"] == "NARROW_INT3"
    return Run(number, table["t_s"].astype(float), table["cross_m"].astype(float), fixed)


def make_record(run: Run, white: float, wander: tuple[float, float]) -> sf.ForwardRecord:
    """An offset that forgets itself, moved by a speed that does, and white noise [m]."""
    sigma, lasting = wander
    model = sf.LinearModel(
        np.array([[-1 / OFFSET[1], 1.0], [0.0, -1 / lasting]]),
        np.array([[0.0], [1.0]]),
        np.array([[2 * sigma**2 / lasting]]),
        ("offset", "wander"),
    )
    P0 = np.diag([OFFSET[0] ** 2, sigma**2])
    system = sf.LinearSystem.from_model(model, run.time, [[1.0, 0.0]], [[white**2]], [0.0, 0.0], P0)
    return sf.ForwardRecord(system, run.cross[:, None], run.time)


def fit(run: Run, white: float, start: tuple[float, float]) -> tuple[float, float]:
    """A maximum of the likelihood of the two parameters of the wander."""
    best, factor = start, 1.6
    highest = make_record(run, white, best).log_likelihood
    while factor > 1.02:
        before = highest
        for i in range(2):
            for f in (factor, 1 / factor):
                tried = (best[0] * f, best[1]) if i == 0 else (best[0], best[1] * f)
                if (value := make_record(run, white, tried).log_likelihood) > highest:
                    best, highest = tried, value
        factor = factor if highest > before + 0.05 else factor**0.5
    return best


def search(run: Run, white: float) -> list[dict[str, Any]]:
    """A row for each profile."""
    record = make_record(run, white, WANDER[white])
    rows = []
    for kind, profile in PROFILES.items():
        found = sf.OnsetDetector(profile).run(record)
        rows.append({
            "run": run.number, "white": white, "nis": float(record.nis[3:].mean()),
            "profile": kind, "onset": found.onset, "amplitude": found.amplitude,
            "se": found.amplitude_se, "drop": found.drop, "threshold": found.threshold,
            "p": found.p_value, "detected": found.detected,
        })  # fmt: skip
    return rows


def first_alarm(run: Run, white: float, begin: float = 10.0) -> dict[str, Any] | None:
    """What is found when first something is, with no more than what has come."""
    for end in np.arange(begin, run.time[-1] + AT_ONCE, AT_ONCE):
        rows = [row for row in search(run.until(end), white) if row["detected"]]
        if rows:
            return {"at": float(end), **max(rows, key=lambda row: float(row["drop"]))}
    return None


def analyse(folder: Path) -> dict[str, Any]:
    """All figures."""
    runs = [read(folder, number).until(end) for number, end in RUNS.items()]
    return {
        "rows": [row for white in WANDER for run in runs for row in search(run, white)],
        "tunnel": [
            {"at": end, **search(run.until(end), max(WANDER))[1]}
            for run in runs
            if run.number in TUNNEL
            for end in LOOKS
        ],
        "first": {run.number: first_alarm(run, max(WANDER)) for run in runs},
    }


def draw(folder: Path, path: Path) -> None:
    """Distances across the track, and what is found; below, the ratios of a ramp."""
    figure = style.new_figure(12.0, 6.5)
    numbers = (29304, 28554, 28573)
    grid = figure.subplots(2, len(numbers), sharex="col")
    for column, number in zip(grid.T, numbers, strict=True):
        run, colour = read(folder, number).until(RUNS[number]), style.PALETTE[0]
        top, below = column
        top.plot(run.time, run.cross, lw=1, color=colour)
        top.plot(run.time[~run.fixed], run.cross[~run.fixed], ".", ms=4, color=style.PALETTE[1],
                 label="no fix claimed")  # fmt: skip
        for i, white in enumerate(WANDER):
            found = sf.OnsetDetector(PROFILES["ramp"]).run(make_record(run, white, WANDER[white]))
            text = f"white noise {white:g} m"
            below.plot(found.time, found.ratio, lw=1, color=style.PALETTE[i], label=text)
            below.axhline(found.threshold or 0, lw=1, ls="--", color=style.PALETTE[i])
        if found.detected and found.onset is not None and found.amplitude is not None:
            since = np.maximum(run.time - found.onset, 0)
            text = f"ramp since {found.onset:.0f} s, {found.amplitude:.2f} m/s"
            start = np.interp(float(found.onset), run.time, run.cross)
            course = (start + found.amplitude * since)[since > 0]
            top.plot(run.time[since > 0], course, "--", color=style.ALARM, label=text)
        top.set(title=f"run {number}", ylabel="across the track [m]")
        below.set(yscale="log", ylim=(0.1, 1e5), xlabel="onset [s]", ylabel="drop, a ramp")
        for axes in column:
            style.clean(axes)
            axes.legend(fontsize=8, loc="upper left")
    figure.savefig(path, dpi=100)


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table and write the figure."""
    parser = argparse.ArgumentParser(description="Position drift of train-infrabel.")
    parser.add_argument("data", type=Path, nargs="?", default=DATA, help="folder of the recording")
    parser.add_argument("--out", type=Path, default=Path("/tmp/train-infrabel"), help="to write to")
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")
    parser.add_argument("--fit", action="store_true", help="look for the parameters, then stop")
    given = parser.parse_args(arguments)
    if given.fit:
        run = read(given.data, FITTED)
        for white, start in WANDER.items():
            print(white, fit(run, white, start))
        return
    figures = analyse(given.data)
    given.out.mkdir(parents=True, exist_ok=True)
    draw(given.data, given.out / "figure.png")
    if given.json:
        print(tables.as_json(figures, 2))
        return
    for r in figures["rows"]:
        print(f"{r['run']} white {r['white']:5.3f} m NIS {r['nis']:9.2f} {r['profile']} since "
              f"{r['onset']:5.0f} s {r['amplitude']:8.3g} ± {r['se']:<8.2g} drop {r['drop']:10.1f} "
              f"({r['threshold']:.1f}) p {r['p']:.2g}")  # fmt: skip
    for r in figures["tunnel"]:
        print(f"{r['run']} up to {r['at']:.0f} s: ramp since {r['onset']:.0f} s "
              f"{r['amplitude']:.3f} ± {r['se']:.3f} m/s, drop {r['drop']:.0f}")  # fmt: skip
    for number, row in figures["first"].items():
        if row is None:
            print(f"{number}: no alarm")
            continue
        print(f"{number}: first alarm at {row['at']:.0f} s, {row['profile']} since "
              f"{row['onset']:.0f} s {row['amplitude']:.3g} ± {row['se']:.2g}, "
              f"p {row['p']:.2g}")  # fmt: skip


if __name__ == "__main__":
    main()
