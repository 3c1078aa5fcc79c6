"""Where along a railway the track monitor is available (train-infrabel).

``python examples/train-infrabel/availability_map.py [../shared/data/train-infrabel] --satellites
../shared/data/car-smartloc --out DIR`` takes the satellites that a receiver in Berlin had at once,
as they stood above the track near Brussels at that moment, an elevation mask, a cutting that is
given and the tunnel that the train's log shows; it prints a table and writes figures.json and
figure.png into DIR. What it shows: docs/recordings-raim.md.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from surefix import raim, tables
from surefix.plots.raim_map import draw_availability
from surefix.raim.masks import Mask

Array = npt.NDArray[np.float64]

SHARED = Path(__file__).resolve().parents[3] / "shared" / "data"
RUNS = (28573, 28554, 28876)
DRAWN = 28573
HEIGHT, TOLERANCE, STEP = 50.0, 0.5, 5.0  # m: ellipsoidal; of the map; between places
# σ [m] at the zenith, σ/sin(el) elsewhere: code on one frequency, smoothed, in the open
ZENITH, ELEVATION, MISSED = 2.0, 10.0, 1e-3
LENGTHS = (30.0, 40.0)  # m, L
NEAR, FAR = None, 100.0  # m, half-width of K: L/2; and where nothing better is known
CUTTING = raim.Cutting(500.0, 1500.0, left_deg=60.0, right_deg=40.0)  # by hand, for 28573
# s, without satellites, for a tunnel; m, gaps that are closed: positions are as wrong in there
LASTING, APART = 5.0, 300.0


def satellites(folder: Path) -> tuple[Array, npt.NDArray[np.str_]]:
    """(n, 3) [m] and systems of the first of the epochs with most satellites."""
    data = raim.read_pseudoranges(folder / "pseudoranges.csv")
    most = int(np.argmax(np.diff(data.begin)))
    rows = slice(int(data.begin[most]), int(data.begin[most + 1]))
    return data.position[rows], data.system[rows]


def tunnels(folder: Path, run: int) -> list[raim.Tunnel]:
    """Where the receiver extrapolated for ``LASTING`` and longer, gaps closed."""
    log = np.genfromtxt(
        folder / f"log_{run}.csv", delimiter=",", names=True, dtype=None, encoding="utf-8"
    )
    without = (log["position_type"] == "PROPAGATED").astype(int)
    edges = np.flatnonzero(np.diff(without, prepend=0, append=0))
    found: list[raim.Tunnel] = []
    for a, b in zip(edges[::2], edges[1::2] - 1, strict=True):
        if log["t_s"][b] - log["t_s"][a] < LASTING:
            continue
        low, high = sorted((float(log["along_m"][a]), float(log["along_m"][b])))
        if found and low - found[-1].high < APART:
            low, high = found[-1].low, max(high, found.pop().high)
        found.append(raim.Tunnel(low, high))
    return found


def scenes(
    run: int, tunnel: list[raim.Tunnel]
) -> Iterator[tuple[str, tuple[Mask, ...], float | None]]:
    """Name, masks and half-width of K."""
    yield "open", (), NEAR
    yield f"open, K ±{FAR:.0f} m", (), FAR
    if run == DRAWN:
        yield "cutting", (CUTTING,), NEAR
    if tunnel:
        yield "tunnel", tuple(tunnel), NEAR
    if run == DRAWN:
        yield f"all, K ±{FAR:.0f} m", (CUTTING, *tunnel), FAR


def analyse(folder: Path, sky: Path) -> tuple[list[dict[str, Any]], raim.AvailabilityMap]:
    """A row for each run, scene and length, and the map that is drawn."""
    position, system = satellites(sky)
    rows: list[dict[str, Any]] = []
    drawn: raim.AvailabilityMap | None = None
    for run in RUNS:
        path = folder / f"track_{run}.csv"
        track = raim.read_track(
            path, columns=("lat_deg", "lon_deg"), height=HEIGHT, tolerance=TOLERANCE
        )
        tunnel = tunnels(folder, run)
        hidden = sum(mask.high - mask.low for mask in tunnel) / track.length
        for name, masks, interval in scenes(run, tunnel):
            for length in LENGTHS:
                found = raim.availability(
                    track, position, system=system.tolist(), sigma=ZENITH, step=STEP, masks=masks,
                    elevation_mask=ELEVATION, length=length, missed=MISSED, interval=interval,
                )  # fmt: skip
                rows.append({
                    "run": run, "scene": name, "length": length, "track": track.length,
                    "tunnel": hidden, "radius": 1 / float(np.max(track.curvature(found.along))),
                    **figures(found),
                })  # fmt: skip
                if run == DRAWN:
                    drawn = found if length == max(LENGTHS) else drawn
    assert drawn is not None
    return rows, drawn


def figures(found: raim.AvailabilityMap) -> dict[str, Any]:
    """Shares, satellites and protection levels; the quantiles over all places, infinite where there
    is no position."""
    level = np.where(np.isnan(found.protection), np.inf, found.protection)
    bound = np.where(np.isnan(found.protection_chi2), np.inf, found.protection_chi2)
    quantiles = (0.1, 0.5, 0.9)
    return {
        "share": found.share, "share_with_e1": found.share_with_e1,
        "satellites": [int(found.satellites.min()), int(found.satellites.max())],
        "largest_e1": float(np.nanmax(found.e1)),
        "protection": [float(np.quantile(level, q, method="lower")) for q in quantiles],
        "protection_chi2": [float(np.quantile(bound, q, method="lower")) for q in quantiles],
    }  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table and write the figure."""
    parser = argparse.ArgumentParser(description="Availability along train-infrabel.")
    folder = SHARED / "train-infrabel"
    parser.add_argument("data", type=Path, nargs="?", default=folder, help="folder of the tracks")
    parser.add_argument("--satellites", type=Path, default=SHARED / "car-smartloc",
                        help="folder of the satellites")  # fmt: skip
    parser.add_argument("--out", type=Path, default=Path("/tmp/train-infrabel"), help="to write to")
    given = parser.parse_args(arguments)
    rows, drawn = analyse(given.data, given.satellites)
    given.out.mkdir(parents=True, exist_ok=True)
    (given.out / "figures.json").write_text(tables.as_json(rows, 2) + "\n", encoding="utf-8")
    title = f"run {DRAWN}: cutting and tunnel, L = {drawn.length:.0f} m, K ±{FAR:.0f} m"
    draw_availability(drawn, missed=MISSED, title=title).savefig(given.out / "figure.png", dpi=100)
    print(f"{'run':>6s} {'scene':18s}{'L':>4s}{'track':>7s}{'tunnel':>7s}{'radius':>7s}{'sats':>7s}"
          f"{'share':>7s}{'e1':>7s}{'worst e1':>10s}  PL 10/50/90 %       L/2 needed")  # fmt: skip
    for r in rows:
        few, many = r["satellites"]
        levels, needed = (" ".join(f"{v:6.1f}" for v in r[key])
                          for key in ("protection", "protection_chi2"))  # fmt: skip
        print(f"{r['run']:6d} {r['scene']:18s}{r['length']:4.0f}{r['track']:7.0f}{r['tunnel']:7.2f}"
              f"{r['radius']:7.0f}{few:4d}-{many:<2d}{r['share']:7.3f}{r['share_with_e1']:7.3f}"
              f"{r['largest_e1']:10.2g}  {levels}  {needed}")  # fmt: skip


if __name__ == "__main__":
    main()
