"""A recorded station, whole: read, analysed with the stated and the fitted noise on several
headings, written and printed."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from surefix import raim, tables
from surefix.plots.stanford import draw_stanford
from surefix.studies.recorded_biases import Injected
from surefix.studies.recorded_station import Station, biased, clean, draw, fitted, report

HEADINGS = (90.0, 0.0)
"""Of the track through the station [degrees from north]."""
SIZES = (5.0, 10.0, 15.0, 20.0, 30.0, 50.0, 100.0, 200.0)
"""Of the biases [m]."""


@dataclass(frozen=True)
class Recording:
    """``mask``: elevation [degrees]; ``stated``: σ at the zenith [m]; ``length``: L [m]; ``every``:
    of the epochs, for biases; ``limit``: alert limit of the Stanford diagram [m]; ``data``: the
    folder where it usually lies."""

    name: str
    mask: float
    stated: float
    length: float
    every: int
    limit: float
    data: Path

    def read(self, folder: Path) -> Station:
        truth = np.genfromtxt(folder / "truth.csv", delimiter=",", names=True, usecols=range(6))
        position = np.array([float(truth[f"{axis}_m"]) for axis in "xyz"])
        data = raim.read_pseudoranges(folder / "pseudoranges.csv")
        return Station(self.name, data, position, self.mask, self.stated, self.length, self.every)

    def run(self, arguments: Sequence[str] | None = None) -> None:
        """Prints the tables and writes the figures, as the arguments of a command line say."""
        parser = argparse.ArgumentParser(description=f"Track monitor on {self.name}.")
        parser.add_argument(
            "data", type=Path, nargs="?", default=self.data, help="folder of the recording"
        )
        parser.add_argument(
            "--out", type=Path, default=Path("/tmp") / self.name, help="to write to"
        )
        given = parser.parse_args(arguments)
        figures, every = analyse(self.read(given.data))
        given.out.mkdir(parents=True, exist_ok=True)
        (given.out / "figures.json").write_text(tables.as_json(figures, 2) + "\n", encoding="utf-8")
        draw(figures["biased"], self.name, given.out / "figure.png")
        error, level = (
            np.concatenate([getattr(found, name) for found in every])
            for name in ("error", "protection")
        )
        title = f"{self.name}, biased satellites"
        stanford = draw_stanford(error, level, self.limit, title=title)
        stanford.savefig(given.out / "stanford.png", dpi=100)
        print("\n".join(report(figures)))


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
