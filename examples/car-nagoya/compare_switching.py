"""The switching filters (Sigalov & Oshman) on car-nagoya: two speeds with gaps and gross errors.

``python examples/car-nagoya/compare_switching.py ../shared/data/car-nagoya --out DIR`` runs the
Kalman filter, the one-step filter and the IMM with the model and the noises of config-robust.toml,
and the filters of config-plain.toml and config-robust.toml beside them; it compares them with the
reference at its own times (5 Hz), and writes table.csv, comparison.json and figure.png into DIR.
``--fit`` looks for the modes again (half a minute). What it shows: docs/recordings.md.
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
from surefix.config import Config, load_config
from surefix.plots import style

Array = npt.NDArray[np.float64]

SENSORS = ("gnss_spp_doppler", "gnss_rtk_diff")
FITTED = 410.0  # s, a third of the recording: all that the parameters were chosen on
WARM_UP = 5.0  # s, left out of all figures
# The most likely for the IMM with one chain on the part before FITTED, to two digits: healthy,
# poor (noise times POOR), and gross, which says nothing of the speed (GROSS). The reference was not
# used. Rates [1/s]: from healthy to each, and back.
PARAMETERS = {"POOR": 180.0, "GROSS": 1.3e5, "to_poor": 0.05, "to_gross": 0.013,
              "from_poor": 1.0, "from_gross": 1.0}  # fmt: skip


@dataclass(frozen=True)
class Recording:
    """A step for each measurement, and one without (NaN) for each time of the reference alone."""

    time: Array  # (T,) [s]
    z: Array  # (T, 1) [m/s]
    sensor: npt.NDArray[np.int64]  # (T,) index into SENSORS; 0 where nothing was measured
    system: sf.LinearSystem
    reference_time: Array  # (N,) [s]
    reference: Array  # (N,) the true speed [m/s]
    at: npt.NDArray[np.int64]  # (N,) the step whose estimate belongs to each


def configuration(name: str) -> Config:
    return load_config(Path(__file__).with_name(name))


def read(folder: Path, end: float = np.inf) -> Recording:
    """The recording before ``end`` [s]."""
    config = configuration("config-robust.toml")
    log = config.read_log(folder / "speed_events.csv")
    assert config.reference is not None
    reference_time, reference = (c[1:] for c in config.reference.read(folder))  # the first: start
    alone = reference_time[~np.isin(reference_time, log.time)]
    time, z = np.append(log.time, alone), np.append(log.value, np.full(len(alone), np.nan))
    sensor = np.array([*map(SENSORS.index, log.sensor), *[0] * len(alone)])
    order = np.argsort(time, kind="stable")[: np.count_nonzero(time < end)]
    time, z, sensor = time[order], z[order, None], sensor[order]
    reference_time = reference_time[reference_time < end]
    at = np.searchsorted(time, reference_time, side="right") - 1
    system, reference = make_system(config, time, sensor), reference[: len(at)]
    return Recording(time, z, sensor, system, reference_time, reference, at)


def make_system(config: Config, time: Array, sensor: npt.NDArray[np.int64]) -> sf.LinearSystem:
    """The configuration's speed and acceleration, and the Gauss–Markov error of the RTK speed."""
    doppler, rtk = (next(s for s in config.sensors if s.name == name) for name in SENSORS)
    assert isinstance(config.model, sf.LinearModel)
    A = np.diag([0.0, 0.0, -1 / rtk.bias_time])
    A[:2, :2] = config.model.A
    Qc = np.diag([*np.diag(config.model.Qc), 2 * rtk.bias_sigma**2 / rtk.bias_time])
    model = sf.LinearModel(A, np.eye(3)[:, 1:], Qc, ("speed", "acceleration", "rtk_error"))
    rows, sigma = np.array([[[1.0, 0, 0]], [[1.0, 0, 1]]]), np.array([doppler.sigma, rtk.sigma])
    P0 = np.diag([*np.diag(config.covariance), rtk.bias_sigma**2])
    return sf.LinearSystem.from_model(
        model, time, rows[sensor], sigma[sensor, None, None] ** 2, [*config.state, 0.0], P0
    )


def shared_chain(recording: Recording, p: dict[str, float] = PARAMETERS) -> sf.ModeChain:
    """One chain of modes, whichever sensor speaks."""
    modes = [(1, 1), (1, p["POOR"]), (0, p["GROSS"])]
    rates = [[0, p["to_poor"], p["to_gross"]], [p["from_poor"], 0, 0], [p["from_gross"], 0, 0]]
    return sf.ModeChain.from_rates(modes, rates, np.diff(recording.time).round(9))


def chain_of_each(recording: Recording) -> sf.ModeChain:
    """Such a chain for each sensor: the states are (who speaks, the mode of each), and the mode of
    a step is that of the sensor that speaks."""
    one = shared_chain(recording)
    pairs = one.size**2
    both = np.einsum("kac,kbd->kabcd", one.p, one.p).reshape(-1, pairs, pairs)
    speaks = np.eye(2)[recording.sensor]
    moved = np.einsum("ks,kij->kisj", speaks[1:], both).reshape(-1, pairs, 2 * pairs)
    modes = [a for a in one.modes for _ in one.modes] + [b for _ in one.modes for b in one.modes]
    initial = np.outer(speaks[0], np.outer(one.initial, one.initial)).ravel()
    return sf.ModeChain(modes, np.tile(moved, (1, 2, 1)), initial)


def filters(recording: Recording) -> Iterator[tuple[str, sf.SwitchingResult]]:
    """Name and result of each; the last is told by the reference what not to use."""
    system, z = recording.system, recording.z
    one, each = shared_chain(recording), chain_of_each(recording)
    yield "Kalman", sf.GenieFilter(system).run(z)
    yield "one-step, one chain", sf.OneStepFilter(system, one).run(z)
    yield "one-step, a chain for each sensor", sf.OneStepFilter(system, each).run(z)
    yield "IMM, one chain", sf.IMMFilter(system, one).run(z)
    yield "IMM, a chain for each sensor", sf.IMMFilter(system, each).run(z)
    truth = np.interp(recording.time, recording.reference_time, recording.reference)
    missing = np.isnan(z) | (np.abs(z - truth[:, None]) > 0.5)
    yield "Kalman, told what is wrong", sf.GenieFilter(system).run(z, missing=missing)


def compared(recording: Recording, x: Array, sigma: Array, log_likelihood: Any) -> dict[str, Any]:
    """The figures of a filter with these speeds at the reference's times, and those speeds."""
    error, time = x - recording.reference, recording.reference_time
    kept = time >= WARM_UP
    size = np.abs(error)[kept]
    return {
        "mean": error[kept].mean(),
        "rms": np.sqrt((size**2).mean()),
        "rms_not_fitted": np.sqrt((error[time >= FITTED] ** 2).mean()),
        "median": np.median(size),
        "percentile_99": np.quantile(size, 0.99),
        "worst": size.max(),
        "beyond_3_sigma": np.mean(size > 3 * sigma[kept]),
        "mean_sigma": sigma[kept].mean(),
        "log_likelihood": log_likelihood,
        "x": x,
        "sigma": sigma,
    }


def compare(recording: Recording) -> dict[str, dict[str, Any]]:
    """The rows of the switching filters."""
    return {
        name: compared(recording, r.x[recording.at, 0], r.sigma[recording.at, 0], r.log_likelihood)
        for name, r in filters(recording)
    }


def existing(recording: Recording, folder: Path) -> dict[str, dict[str, Any]]:
    """The rows of the filters of the configurations."""
    rows = {}
    for file in ("config-plain.toml", "config-robust.toml"):
        config = configuration(file)
        r = config.run(config.read_log(folder / "speed_events.csv"))
        assert np.allclose(r.time, recording.reference_time, rtol=0, atol=1e-6)
        kind = "RobustFilter" if isinstance(r, sf.RobustResult) else "DesyncFilter"
        rows[f"{kind}, {file}"] = compared(recording, r.estimate, r.sigma, r.log_likelihood)
    return rows


def fit(recording: Recording) -> dict[str, float]:
    """A maximum of the likelihood of the IMM with one chain, from PARAMETERS on."""

    def likelihood(p: dict[str, float]) -> Any:
        imm = sf.IMMFilter(recording.system, shared_chain(recording, p))
        return imm.run(recording.z).log_likelihood

    best, factor, highest = PARAMETERS, 2.0, likelihood(PARAMETERS)
    while factor > 1.05:
        before = highest
        for name in PARAMETERS:
            for f in (factor, 1 / factor):
                tried = best | {name: best[name] * f}
                if (value := likelihood(tried)) > highest:
                    best, highest = tried, value
        factor = factor if highest > before + 0.1 else factor**0.5
    return best


EXCERPTS = ((128.0, 176.0), (978.0, 1038.0))
SHOWN = {  # colour, width
    "Kalman": (style.ALARM, 1.2),
    "one-step, one chain": (style.PALETTE[1], 1.5),
    "IMM, a chain for each sensor": (style.PALETTE[0], 1.5),
    "RobustFilter, config-robust.toml": (style.PALETTE[2], 1.2),
}


def draw(recording: Recording, rows: dict[str, dict[str, Any]], path: Path) -> None:
    """Left: excerpts with bands of 3 sigma. Right: how often errors are larger than that."""
    figure = style.new_figure(12.0, 6.5)
    grid = figure.add_gridspec(2, 2, width_ratios=(1.6, 1.0))
    low, high = -6.0, 32.0
    time = recording.reference_time
    for i, excerpt in enumerate(EXCERPTS):
        axes = figure.add_subplot(grid[i, 0])
        for sensor, name in enumerate(SENSORS):
            own = (recording.sensor == sensor) & ~np.isnan(recording.z[:, 0])
            z = np.clip(recording.z[own, 0], low, high - 0.5)
            mark, colour = (("^", "#444444"), (".", "#AAAAAA"))[sensor]
            axes.plot(recording.time[own], z, mark, ms=4, color=colour, label=name)
        axes.plot(time, recording.reference, "--", color="black", lw=1.5, label="reference")
        for name, (colour, width) in SHOWN.items():
            x, sigma = rows[name]["x"], rows[name]["sigma"]
            axes.plot(time, x, color=colour, lw=width, label=name)
            if name.startswith("IMM"):
                axes.fill_between(time, x - 3 * sigma, x + 3 * sigma, color=colour, alpha=0.15)
        axes.set(xlim=excerpt, ylim=(low, high), ylabel="speed [m/s]")
        axes.set_xlabel("time [s]; what is above stands at the upper edge" if i else "")
        style.clean(axes)
    tail = figure.add_subplot(grid[:, 1])
    for name, (colour, width) in SHOWN.items():
        size = np.sort(np.abs(rows[name]["x"] - recording.reference)[time >= WARM_UP])
        tail.loglog(size, 1 - np.arange(len(size)) / len(size), color=colour, lw=width)
    tail.set(xlim=(0.02, 1000), ylim=(1e-4, 1), xlabel="|error| [m/s]")
    tail.set_title(f"Share of {len(size):,} estimates with a larger error", fontsize=10)
    style.clean(tail)
    style.legend_above(figure, figure.axes[0], "car-nagoya: two GNSS speeds with gross errors")
    figure.savefig(path, dpi=100)


def main(arguments: Sequence[str] | None = None) -> None:
    """Write the files."""
    parser = argparse.ArgumentParser(description="Switching filters on car-nagoya.")
    parser.add_argument("data", type=Path, help="folder of the recording")
    parser.add_argument("--out", type=Path, default=Path("/tmp/car-nagoya"), help="to write to")
    parser.add_argument("--fit", action="store_true", help="look for the modes, then stop")
    given = parser.parse_args(arguments)
    if given.fit:
        print(fit(read(given.data, FITTED)))
        return
    recording = read(given.data)
    rows = compare(recording) | existing(recording, given.data)
    given.out.mkdir(parents=True, exist_ok=True)
    draw(recording, rows, given.out / "figure.png")
    figures = {
        name: {key: float(value) for key, value in row.items() if np.ndim(value) == 0}
        for name, row in rows.items()
    }
    names = np.array(list(figures))
    columns = {key: np.array([row[key] for row in figures.values()]) for key in figures[names[0]]}
    tables.write_csv(given.out / "table.csv", {"filter": names, **columns})
    tables.plain(given.out / "comparison.json", {"parameters": PARAMETERS, "filters": figures})
    for name, row in figures.items():
        print(f"{name:36}", *(f"{value:10.3f}" for value in row.values()))


if __name__ == "__main__":
    main()
