"""A GPS receiver that stands still, for an hour, through the track monitor (gnss-geonet-0759).

``python examples/gnss-geonet-0759/raim_geonet.py [../shared/data/gnss-geonet-0759] --out DIR``
lets a track of 1000 m radius pass through the station, to the east and to the north, counts false
alarms on the recording as it is, puts biases on its satellites, and compares what is detected with
what was predicted; it prints tables and writes figures.json, figure.png and stanford.png into DIR.
What it shows: docs/recordings-raim.md.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from surefix import raim, tables
from surefix.plots.stanford import draw_stanford
from surefix.studies.recorded_biases import Injected
from surefix.studies.recorded_station import Station, biased, clean, draw, fitted, report

NAME = "gnss-geonet-0759"
DATA = Path(__file__).resolve().parents[3] / "shared" / "data" / NAME
# As the recording's description has them: elevation mask [degrees], σ [m] at the zenith of a
# solution in three dimensions.
MASK, STATED = 10.0, 0.45
LENGTH, EVERY = 50.0, 1  # m, L; of the epochs, for biases
HEADINGS = (90.0, 0.0)  # degrees from north
SIZES = (5.0, 10.0, 15.0, 20.0, 30.0, 50.0, 100.0, 200.0)  # m
LIMIT = 10.0  # m, alert limit of the Stanford diagram


def read(folder: Path) -> Station:
    truth = np.genfromtxt(folder / "truth.csv", delimiter=",", names=True, usecols=range(6))
    position = np.array([float(truth[f"{axis}_m"]) for axis in "xyz"])
    data = raim.read_pseudoranges(folder / "pseudoranges.csv")
    return Station(NAME, data, position, MASK, STATED, LENGTH, EVERY)


def analyse(station: Station) -> tuple[dict[str, Any], list[Injected]]:
    """All figures, and what the biases did, by heading and size."""
    figures: dict[str, Any] = {"clean": [], "biased": []}
    every: list[Injected] = []
    for heading in HEADINGS:
        zeniths = fitted(station, heading)
        for noise, used in (("stated", station.stated), ("fitted", zeniths)):
            figures["clean"].append({"noise": noise, **clean(station, heading, used)})
        rows, found = biased(station, heading, zeniths, SIZES)
        figures["biased"] += rows
        every += found
    return figures, every


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the tables and write the figures."""
    parser = argparse.ArgumentParser(description=f"Track monitor on {NAME}.")
    parser.add_argument("data", type=Path, nargs="?", default=DATA, help="folder of the recording")
    parser.add_argument("--out", type=Path, default=Path("/tmp") / NAME, help="to write to")
    given = parser.parse_args(arguments)
    figures, every = analyse(read(given.data))
    given.out.mkdir(parents=True, exist_ok=True)
    (given.out / "figures.json").write_text(tables.as_json(figures, 2) + "\n", encoding="utf-8")
    draw(figures["biased"], NAME, given.out / "figure.png")
    error, level = (
        np.concatenate([getattr(found, name) for found in every])
        for name in ("error", "protection")
    )
    stanford = draw_stanford(error, level, LIMIT, title=f"{NAME}, biased satellites")
    stanford.savefig(given.out / "stanford.png", dpi=100)
    print("\n".join(report(figures)))


if __name__ == "__main__":
    main()
