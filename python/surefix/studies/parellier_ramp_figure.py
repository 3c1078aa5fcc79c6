"""The figure of the study ``parellier-ramp``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

import surefix as sf
from surefix.plots import style
from surefix.studies import parellier_onsets, parellier_peers
from surefix.studies import parellier_particle as particle
from surefix.studies.parellier_particle import COUNT, PAPER_ONSET, PAPER_SLOPE, Flights

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = {
    "exact": style.PALETTE[0],
    "first_order": style.PALETTE[1],
    "first_order_magnitude": style.ALARM,
    "imaginary": style.PALETTE[1],
    "nis_total": style.PALETTE[2],
    "nis_window": style.PALETTE[3],
    "innovation_spectrum": style.PALETTE[4],
}
SHOWN = 0.2  # slope, of the shares found


def make_figure(numbers: dict[str, Any], flights: Flights, tests: Mapping[str, str]) -> Figure:
    """Figures 3, 4 and 5 of the paper, from the first run; shares found; onset errors."""
    figure = style.new_figure(12.0, 11.0)
    axes = figure.subplots(3, 2)
    one = Flights(flights.state[:1], flights.known, flights.z[:1])
    _trajectory(axes[0, 0], axes[0, 1], one)
    z = one.z + particle.ramp(PAPER_SLOPE, PAPER_ONSET)
    _measured(axes[1, 0], one, z, f"Figure 4: ramp of slope {PAPER_SLOPE} from {PAPER_ONSET}")
    _indicators(axes[1, 1], particle.record(z))
    low, high = numbers["onsets"]["first_order"]["quartiles"]
    axes[1, 1].axvspan(
        low, high, color=style.PALETTE[1], alpha=0.12, lw=0, label="half of all runs, first order"
    )
    axes[1, 1].legend(frameon=False, fontsize=8)
    rows = [
        row for row in numbers["detection"] if row["slope"] == SHOWN and row["onset"] == PAPER_ONSET
    ]
    draw_shares(axes[2, 0], rows, tests)
    axes[2, 0].set_title(
        f"Found, slope {SHOWN} from {PAPER_ONSET}, {numbers['runs']:,} runs", fontsize=10
    )
    _errors(axes[2, 1], numbers)
    for panel in axes.flat:
        style.clean(panel)
    return figure


def draw_shares(axes: Axes, rows: parellier_peers.Rows, tests: Mapping[str, str]) -> None:
    """Shares of runs found against the probability of false alarms, with a legend above them."""
    levels = [row["false_alarm"] for row in rows]
    for name, label in tests.items():
        line = "s--" if name == "nis_window" else "o-"
        axes.plot(
            levels, [row[name] for row in rows], line, color=COLOURS[name], label=label,
            markersize=4, zorder=3 if line == "s--" else 2,
        )  # fmt: skip
    axes.plot(levels, levels, ":", color="#555555", lw=1, label="as often as a false alarm")
    axes.set_xscale("log")
    axes.set_ylim(-0.03, 1.42)
    axes.set_yticks(np.linspace(0, 1, 6))
    axes.set_xlabel("probability of a false alarm")
    axes.set_ylabel("share of runs found")
    axes.legend(frameon=False, fontsize=7.5, loc="upper left", ncols=2)


def _trajectory(position: Axes, velocity: Axes, one: Flights) -> None:
    estimate = particle.estimates(one)[0]
    for i, (axes, name) in enumerate(((position, "position"), (velocity, "velocity"))):
        axes.plot(COUNT, one.state[0, :, i], color=style.REFERENCE, lw=3.0, label="truth")
        axes.plot(COUNT, estimate[:, i], "--", color=style.ESTIMATE, lw=1.2, label="estimate")
        axes.set_title(f"Figure 3: {name}, no fault", fontsize=10)
        axes.set_ylabel(name)
        axes.set_xlabel("sample")
        axes.legend(frameon=False, fontsize=8, loc="upper left" if i == 0 else "lower right")


def _measured(axes: Axes, one: Flights, z: np.ndarray[Any, Any], title: str) -> None:
    axes.plot(COUNT, one.state[0, :, 0], color=style.REFERENCE, lw=2.0, label="truth")
    axes.plot(COUNT, z[0], ".", color=style.PALETTE[0], markersize=5, label="measured")
    axes.axvline(PAPER_ONSET, color="#555555", lw=1, ls=":")
    axes.set_title(title, fontsize=10)
    axes.set_xlabel("sample")
    axes.set_ylabel("position")
    axes.legend(frameon=False, fontsize=8)


def _indicators(axes: Axes, record: sf.ForwardRecord) -> None:
    found = sf.OnsetDetector(sf.Profile.ramp()).run(record)
    nis = record.nis[0]
    axes.plot(COUNT, nis / nis.max(), color=style.SHADE, lw=1.2, label="NIS of the sample")
    for name, curve in (("first_order", found.first_order[0]), ("exact", found.ratio[0])):
        label = {"first_order": "first order (18)", "exact": "exact ratio"}[name]
        axes.plot(COUNT + 1, curve / np.nanmax(curve), color=COLOURS[name], lw=1.8, label=label)
    axes.axvline(PAPER_ONSET, color="#555555", lw=1, ls=":", label="truth")
    axes.set_title("Figure 5: indicators of its onset, over their maxima", fontsize=10)
    axes.set_xlabel("first sample that carries something")


def _errors(axes: Axes, numbers: dict[str, Any]) -> None:
    rows = numbers["onset_error"]
    for onset, colour in zip(parellier_onsets.ONSETS, style.PALETTE, strict=False):
        of = [row for row in rows if row["onset"] == onset]
        slopes = [row["slope"] for row in of]
        for name, line in (("first_order", "o--"), ("exact", "s-")):
            label = f"{onset}" if name == "exact" else "_"
            axes.plot(slopes, [row[name] for row in of], line, color=colour, label=label,
                      markersize=5, lw=1.4)  # fmt: skip
    axes.plot([], [], "o--", color="#555555", markersize=5, label="first order (the paper)")
    axes.plot([], [], "s-", color="#555555", markersize=5, label="exact ratio")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xticks(slopes, [f"{slope:g}" for slope in slopes], minor=False)
    axes.set_xticks([], minor=True)
    axes.set_xlabel("slope per sample")
    axes.set_ylabel("mean absolute error (samples)")
    axes.set_title("Onset errors, by first sample of the ramp", fontsize=10)
    axes.legend(frameon=False, fontsize=8)
