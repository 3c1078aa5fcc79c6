"""Reflections in a street canyon through the track monitor and the robust filter (car-smartloc).

``python examples/car-smartloc/raim_smartloc.py [../shared/data/car-smartloc] --out DIR`` takes the
car's true path for a known track, fits a noise model to the first half of the drive, and judges
limits claimed at risks of 1e-2 to 1e-9: without a monitor, with detection, with exclusion, and with
an outlier hypothesis for every satellite (RobustFilter). It prints a table (``--first`` for the
half that was fitted), and writes figures.json and figure.png into DIR. What it shows:
docs/recordings-raim.md.
"""

from __future__ import annotations

import argparse
import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

import surefix as sf
from surefix import raim, tables
from surefix.core.distributions import two_sided_quantile
from surefix.plots import style
from surefix.raim.availability import sagnac
from surefix.studies.recorded_hypotheses import Hypotheses

Array = npt.NDArray[np.float64]

DATA = Path(__file__).resolve().parents[3] / "shared" / "data" / "car-smartloc"
RISKS = (1e-2, 1e-3, 1e-5, 1e-7, 1e-9)
APART, TOLERANCE = 2.0, 1.0  # m, between points of the track; from them to the track
# The car comes back through the street it went out by: the halves of the drive are two tracks, or
# a snapshot could not tell which way it goes. Mileage [m] where they meet, and how far they overlap
MEET, OVERLAP = 780.0, 100.0
LENGTH, ALERT = 100.0, 50.0  # m, L, and the half-width that would still be of use
FALSE_ALARM, FAULTY = 1e-3, 1e-4
OTHER = 5.0  # m, between two minima of the residual along the track
BINS = np.array([20.0, 25.0, 30.0, 33.0, 36.0, 39.0, 42.0, 45.0, 48.0, 54.0])  # dBHz
QUANTILES = {"fitted": (0.68,), "bounding": (0.68, 0.95, 0.99)}
NOISES = ("stated", *QUANTILES)
OUTLIER, SPAN = 3.0, 400.0  # sigmas; m, over which an outlier may be anywhere
KINDS = (("detection", 0, FAULTY), ("exclusion of 1", 1, FAULTY), ("exclusion of 2", 2, FAULTY),
         ("exclusion of 4", 4, FAULTY))  # fmt: skip
MEASURED, KNOWN = "exclusion of 2, p_f measured", "exclusion of 2, begun at truth"
SEQUENCE, FASTEST = "exclusion of 2, in sequence", 15.0  # m/s
SATELLITES, BEAM = 10, 1024  # of the robust filter: the best ones, so that no hypothesis is cut off
EVERY = 5  # of the epochs, so about 1 Hz
WIDE = 300.0  # m, prior deviation of the position
WHEEL = 0.1  # m/s


@dataclass(frozen=True)
class Drive:
    data: raim.Pseudoranges
    along: Array  # (T,) true mileage [m]
    whole: raim.Track
    legs: tuple[raim.Track, raim.Track]
    back: npt.NDArray[np.bool_]  # (T,) on the second leg
    cn0: Array  # (N,) [dBHz]
    stated: Array  # (N,) [m]
    residual: Array  # (N,) [m] of the true position, clocks removed
    speed: Array  # (T,) [m/s]
    every: int  # of the epochs one is looked at


def read(folder: Path, every: int = EVERY) -> Drive:
    truth = np.genfromtxt(folder / "truth.csv", delimiter=",", names=True)
    rows = np.genfromtxt(folder / "pseudoranges.csv", delimiter=",", names=True)
    wheels = np.genfromtxt(folder / "odometry.csv", delimiter=",", names=True)
    data = raim.read_pseudoranges(folder / "pseudoranges.csv").with_sigma(
        np.sqrt(rows["pr_var_m2"])
    )
    place = np.column_stack([truth[f"ecef_{axis}_m"] for axis in "xyz"])
    kept = [0]
    for k, mileage in enumerate(truth["s_m"]):
        if mileage - truth["s_m"][kept[-1]] >= APART:
            kept.append(k)
    along = truth["s_m"]
    points, at = place[kept], along[kept]
    chord = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    again = int(np.searchsorted(at, MEET - OVERLAP))
    whole = raim.Track(points, tolerance=TOLERANCE)
    first = raim.Track(points[at < MEET + OVERLAP], tolerance=TOLERANCE)
    second = raim.Track(points[again:], tolerance=TOLERANCE, start=float(chord[again]))
    back = along >= MEET
    mileage = np.where(back, second.project(place).along, first.project(place).along)
    off = ranges(data, place[data.epoch])
    residual = without_clocks(data, data.pseudorange - off, rows["cn0_dbhz"])
    return Drive(
        data, mileage, whole, (first, second), back, rows["cn0_dbhz"], data.sigma, residual,
        wheels["speed_mps"], every,
    )  # fmt: skip


def ranges(data: raim.Pseudoranges, place: Array) -> Array:
    """(N,) [m] from places (N, 3), with the Earth's rotation."""
    return np.asarray(np.linalg.norm(data.position - place, axis=1) + sagnac(place, data.position))


def without_clocks(data: raim.Pseudoranges, off: Array, cn0: Array) -> Array:
    """Less the median of each epoch and system, weighted by the signal's power."""
    out, power = off.copy(), 10 ** (cn0 / 10)
    for begin, end in zip(data.begin[:-1], data.begin[1:], strict=True):
        for code in range(len(data.system_names)):
            k = begin + np.flatnonzero(data.system_code[begin:end] == code)
            if len(k):
                order = k[np.argsort(off[k])]
                total = np.cumsum(power[order])
                out[k] -= off[order[np.searchsorted(total, total[-1] / 2)]]
    return out


def noise_models(drive: Drive) -> dict[str, Array]:
    """σ (N,) [m] by name: as stated; or, at least that, by C/N0: log σ linear in it, fitted to what
    covers the quantiles of the residuals in each bin of the first half, 'bounding' nowhere less."""
    fitted = ~drive.back[drive.data.epoch]
    size, cn0 = np.abs(drive.residual), drive.cn0
    out = {"stated": drive.stated}
    for name, quantiles in QUANTILES.items():
        middle, spread = [], []
        for low, high in itertools.pairwise(BINS):
            inside = size[fitted & (low <= cn0) & (cn0 < high)]
            middle.append((low + high) / 2)
            spread.append(
                max(np.quantile(inside, q) / two_sided_quantile(1 - q) for q in quantiles)
            )
        slope, level = np.polyfit(middle, np.log(spread), 1)
        if name == "bounding":
            level = np.max(np.log(spread) - slope * np.array(middle))
        out[name] = np.maximum(np.exp(level + slope * cn0), drive.stated)
    return out


def outliers(drive: Drive, sigma: Array) -> float:
    """Share of the residuals of the first half beyond ``OUTLIER`` σ, at least ``FAULTY``."""
    fitted = ~drive.back[drive.data.epoch]
    share = float(np.mean(np.abs(drive.residual[fitted]) > OUTLIER * sigma[fitted]))
    return max(share, FAULTY)


Epochs = list[tuple[int, raim.Pseudoranges]]


def alone(drive: Drive, sigma: Array) -> Epochs:
    """One epoch in ``every``, each by itself, so that each is searched for along the whole leg."""
    data, out = drive.data, []
    for epoch in range(0, data.epochs, drive.every):
        rows = slice(int(data.begin[epoch]), int(data.begin[epoch + 1]))
        out.append((epoch, raim.Pseudoranges(
            data.time[rows], data.satellite[rows], data.position[rows], data.pseudorange[rows],
            sigma[rows], data.system[rows],
        )))  # fmt: skip
    return out


def correlation(drive: Drive, sigma: Array) -> float:
    """Of the residuals of a satellite, ``every`` epochs apart, over the first half; in σ, cut at
    ``OUTLIER``."""
    data = drive.data
    size = np.clip(drive.residual / sigma, -OUTLIER, OUTLIER)
    product = square = 0.0
    for name in np.unique(data.satellite):
        of, its = np.full(data.epochs, np.nan), data.satellite == name
        of[data.epoch[its]] = size[its]
        of = of[~drive.back]
        pairs = of[drive.every :] * of[: -drive.every]
        product += float(np.nansum(pairs))
        both = (of[drive.every :] ** 2 + of[: -drive.every] ** 2) / 2
        square += float(np.nansum(both))
    return product / square


def monitor(drive: Drive, epochs: Epochs, known: bool = False, **options: Any) -> dict[str, Array]:
    """Columns (T,) of the results, NaN but at ``epochs``; 'half': the protection level where the
    position may be used. ``known``: begins at the true position, or else with a search."""
    judges = [
        raim.TrackRaim(leg, length=LENGTH, false_alarm=FALSE_ALARM, earth_rotation=True, **options)
        for leg in drive.legs
    ]
    out = {name: np.full(len(drive.along), np.nan) for name in ("along", "sigma", "half", "alarm")}
    for epoch, data in epochs:
        near = float(drive.along[epoch]) if known else None
        found = judges[int(drive.back[epoch])].run(data, near=near)
        out["along"][epoch], out["sigma"][epoch] = found.along[0], found.sigma[0]
        out["alarm"][epoch] = found.alarm[0]
        if found.usable[0]:
            out["half"][epoch] = found.protection[0]
    return out


Limits = tuple[Array, Array]
"""Lower and upper (T,), NaN or infinite where none is claimed."""


def monitored(
    drive: Drive, sigma: Array, risks: Sequence[float] = RISKS
) -> Iterator[tuple[str, float, Limits]]:
    """Limits by the monitor's kind and the risk."""
    epochs, often = alone(drive, sigma), outliers(drive, sigma)
    plain = monitor(drive, epochs, max_excluded=0)
    for risk in risks:
        half = two_sided_quantile(risk) * plain["sigma"]
        yield "no monitor", risk, (plain["along"] - half, plain["along"] + half)
        for kind, most, faulty in (*KINDS, (MEASURED, 2, often), (KNOWN, 2, FAULTY)):
            found = monitor(
                drive, epochs, kind == KNOWN, risk=risk, fault_probability=faulty,
                max_excluded=most,
            )  # fmt: skip
            yield kind, risk, (found["along"] - found["half"], found["along"] + found["half"])
        yield SEQUENCE, risk, in_sequence(drive, sigma, risk)


def in_sequence(drive: Drive, sigma: Array, risk: float) -> Limits:
    """Of all epochs, each looked for where the car may have come since the last one, on the whole
    track; where the first is, is known."""
    judge = raim.TrackRaim(
        drive.whole, length=LENGTH, false_alarm=FALSE_ALARM, earth_rotation=True, risk=risk,
        fault_probability=FAULTY, max_excluded=2, max_speed=FASTEST,
    )  # fmt: skip
    found = judge.run(drive.data.with_sigma(sigma), near=float(drive.along[0]))
    half = np.where(found.usable, found.protection, np.nan)
    return found.along - half, found.along + half


def robust(drive: Drive, sigma: Array, guess: Array, carried: bool) -> dict[float, Limits]:
    """Limits by risk, NaN but at one epoch in ``every``. ``guess`` (T,): where to begin to
    linearise. ``carried``: the prior is the last epoch's mixture, taken for a Gaussian and moved by
    the wheel; else none to speak of."""
    outage = sf.Outage(probability=outliers(drive, sigma), span=SPAN)
    judge = Hypotheses(outage, SATELLITES, BEAM, min(RISKS))
    out = {risk: (np.full(len(guess), np.nan), np.full(len(guess), np.nan)) for risk in RISKS}
    time = drive.data.epoch_time
    mean, deviation = float(drive.along[0]), WIDE
    for epoch, data in alone(drive, sigma):
        if epoch:
            since = slice(epoch - drive.every, epoch + 1)
            gone, speed = np.diff(time[since]), drive.speed[since]
            mean += float(gone @ (speed[1:] + speed[:-1]) / 2)
            deviation = float(np.hypot(deviation, WHEEL * gone.sum()))
        if not carried:
            mean = float(guess[epoch]) if np.isfinite(guess[epoch]) else mean
            deviation = WIDE
        leg = drive.legs[int(drive.back[epoch])]
        found = judge.run(leg, data, mean, (mean, deviation))
        for risk, (lower, upper) in out.items():
            lower[epoch], upper[epoch] = found.limits(risk)
        mean, deviation = found.along, found.deviation
    return out


def judged(drive: Drive, limits: Limits, half: npt.NDArray[np.bool_]) -> dict[str, Any]:
    """Of one epoch in ``every`` of a half (T,): the share with limits, with limits that are of use,
    and, of those with limits, the median half-width [m], the share that is misleading, and in how
    many stretches without a break."""
    chosen = np.flatnonzero(half & (np.arange(len(half)) % drive.every == 0))
    low, high, true = limits[0][chosen], limits[1][chosen], drive.along[chosen]
    there = np.isfinite(low) & np.isfinite(high)
    wrong = there & ((true < low) | (true > high))
    wide = (high - low)[there] / 2
    return {
        "epochs": len(chosen), "limits": float(there.mean()),
        "useful": float(np.sum(wide <= ALERT) / len(chosen)),
        "half_width": float(np.median(wide)) if len(wide) else None,
        "misleading": float(wrong.sum() / there.sum()) if len(wide) else None,
        "stretches": int(np.sum(np.diff(wrong.astype(int), prepend=0) > 0)),
    }  # fmt: skip


def claims(drive: Drive, sigma: Array) -> Iterator[tuple[str, float, Limits]]:
    """Of all kinds of limits and all risks."""
    yield from monitored(drive, sigma)
    guess = monitor(drive, alone(drive, sigma), max_excluded=4)["along"]
    rho = correlation(drive, sigma)
    # As many samples of a first-order process are worth (1 - ρ)/(1 + ρ) as many independent ones.
    wide = sigma * np.sqrt((1 + rho) / (1 - rho))
    for kind, used, carried in (
        ("hypotheses, snapshot", sigma, False), ("hypotheses, carried", sigma, True),
        ("hypotheses, carried, wide", wide, True),
    ):  # fmt: skip
        for risk, limits in robust(drive, used, guess, carried).items():
            yield kind, risk, limits


def analyse(drive: Drive) -> tuple[dict[str, Any], dict[tuple[str, str, float], Limits]]:
    """All figures, and all limits by noise, kind and risk."""
    models, every = noise_models(drive), {}
    figures: dict[str, Any] = {"track_error": max(leg.error for leg in drive.legs), "noise": [],
                               "claims": []}  # fmt: skip
    for noise, sigma in models.items():
        errors = monitor(drive, alone(drive, sigma), max_excluded=4)
        kept = np.isfinite(errors["along"])
        known = monitor(drive, alone(drive, sigma), True, max_excluded=0)["along"]
        plain = monitor(drive, alone(drive, sigma), max_excluded=0)["along"]
        figures["noise"].append({
            "noise": noise, "outliers": outliers(drive, sigma),
            "correlation": correlation(drive, sigma),
            **{f"sigma_at_{power}": float(np.median(sigma[drive.cn0.round() == power]))
               for power in (30, 40, 50)},
            "alarms": float(np.mean(errors["alarm"][kept])),
            "diverged": 1 - float(np.mean(kept[::drive.every])),
            "other_minimum": float(np.mean(np.abs(known - plain)[kept] > OTHER)),
        })  # fmt: skip
        for kind, risk, limits in claims(drive, sigma):
            every[noise, kind, risk] = limits
            for name, half in (("first", ~drive.back), ("second", drive.back)):
                row = judged(drive, limits, half)
                figures["claims"].append(
                    {"noise": noise, "kind": kind, "risk": risk, "half": name, **row}
                )
    return figures, every


def draw(drive: Drive, every: dict[tuple[str, str, float], Limits], path: Path) -> None:
    """Limits around the true position, at a risk of 1e-5."""
    kinds = ("no monitor", "exclusion of 2", "hypotheses, snapshot")
    figure = style.new_figure(12.0, 7.5)
    grid = figure.subplots(len(kinds), len(NOISES), sharex=True, sharey=True)
    chosen = np.arange(0, len(drive.along), drive.every)
    time, true = drive.data.epoch_time[chosen], drive.along[chosen]
    for axes, kind in zip(grid, kinds, strict=True):
        for where, noise in zip(axes, NOISES, strict=True):
            low, high = (bound[chosen] - true for bound in every[noise, kind, 1e-5])
            wrong = (low > 0) | (high < 0)
            where.vlines(time, low, high, color=style.PALETTE[0], lw=1.2, alpha=0.5)
            where.vlines(time[wrong], low[wrong], high[wrong], color=style.ALARM, lw=1.6)
            where.axhline(0, color=style.ESTIMATE, lw=0.8)
            where.axvline(
                float(drive.data.epoch_time[drive.back][0]), color=style.REFERENCE, lw=0.8
            )
            where.set(ylim=(-150, 150))
            where.set_title(f"{kind}, {noise} noise", fontsize=10)
            style.clean(where)
    for where in grid[:, 0]:
        where.set_ylabel("limits less truth [m]")
    for where in grid[-1]:
        where.set_xlabel("time [s]")
    figure.savefig(path, dpi=100)


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the tables and write the figures."""
    parser = argparse.ArgumentParser(description="Track monitor on car-smartloc.")
    parser.add_argument("data", type=Path, nargs="?", default=DATA, help="folder of the recording")
    parser.add_argument("--out", type=Path, default=Path("/tmp/car-smartloc"), help="to write to")
    parser.add_argument("--first", action="store_true", help="print the fitted half")
    parser.add_argument("--every", type=int, default=EVERY, help="of the epochs to look at")
    given = parser.parse_args(arguments)
    drive = read(given.data, given.every)
    figures, every = analyse(drive)
    given.out.mkdir(parents=True, exist_ok=True)
    (given.out / "figures.json").write_text(tables.as_json(figures, 2) + "\n", encoding="utf-8")
    draw(drive, every, given.out / "figure.png")
    for row in figures["noise"]:
        print(", ".join(f"{k} {v:.3g}" if isinstance(v, float) else f"{k} {v}"
                        for k, v in row.items()))  # fmt: skip
    half = "first" if given.first else "second"
    print(f"{half} half:\n{'noise':9s}{'kind':30s}{'risk':>7s}{'limits':>8s}{'useful':>8s}"
          f"{'half-width':>12s}{'misleading':>12s}{'stretches':>11s}")  # fmt: skip
    for r in (row for row in figures["claims"] if row["half"] == half):
        width, wrong = (
            (f"{r['half_width']:.1f}", f"{r['misleading']:.4f}") if r["limits"] else 2 * ("-",)
        )
        print(f"{r['noise']:9s}{r['kind']:30s}{r['risk']:7.0e}{r['limits']:8.3f}{r['useful']:8.3f}"
              f"{width:>12s}{wrong:>12s}{r['stretches']:11d}")  # fmt: skip


if __name__ == "__main__":
    main()
