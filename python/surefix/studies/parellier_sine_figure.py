"""The figure of the study ``parellier-sine``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from surefix.core.checks import FloatArray
from surefix.plots import style
from surefix.studies import parellier_particle as particle
from surefix.studies.parellier_cycles import CYCLES, LOCATORS, PRIORS, spectra
from surefix.studies.parellier_particle import COUNT, PAPER_AMPLITUDE, PAPER_CYCLES, Flights
from surefix.studies.parellier_ramp_figure import COLOURS, draw_shares

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LINES = {
    "imaginary": (style.PALETTE[1], "o-"),
    "imaginary_scaled": (style.ALARM, "o--"),
    "power": (style.PALETTE[2], "s-"),
    "exact": (style.PALETTE[0], "s--"),
    "innovations": (style.PALETTE[3], "D-"),
    "normalised": (style.PALETTE[4], "D--"),
}
SEED = 11  # of the run that starts far off
SHOWN = 0.75  # amplitude, of the shares found


def make_figure(numbers: dict[str, Any], flights: Flights, tests: Mapping[str, str]) -> Figure:
    """Figures 6 and 7 of the paper, from the first run; shares found."""
    figure = style.new_figure(12.0, 11.0)
    axes = figure.subplots(3, 2)
    _measured(axes[0, 0], flights)
    _spectra(axes[0, 1], flights.z[:1] + particle.sine(PAPER_AMPLITUDE))
    for panel, phase, title in (
        (axes[1, 0], "paper", "8 cycles found, the paper's phase"),
        (axes[1, 1], "drawn", "8 cycles found, unknown phase"),
    ):
        rows = [row for row in numbers["found_8"] if row["phase"] == phase]
        _found(panel, [row["amplitude"] for row in rows], rows)
        panel.set_xlabel("amplitude (standard deviation of a measurement: 1.22)")
        panel.set_title(title, fontsize=10)
    axes[1, 0].legend(frameon=False, fontsize=8, loc="lower right")
    _found(axes[2, 0], list(PRIORS), numbers["found_8_by_prior"])
    axes[2, 0].set_xscale("log")
    axes[2, 0].set_xlabel("variance of x₀")
    axes[2, 0].set_title(f"8 cycles found, amplitude {PAPER_AMPLITUDE}", fontsize=10)
    rows = [
        row for row in numbers["detection"] if row["amplitude"] == SHOWN and row["phase"] == "drawn"
    ]
    draw_shares(axes[2, 1], rows, tests)
    axes[2, 1].set_title(
        f"Found, amplitude {SHOWN}, unknown phase, {numbers['runs']:,} runs", fontsize=10
    )
    for panel in axes.flat:
        style.clean(panel)
    return figure


def _measured(axes: Axes, flights: Flights) -> None:
    truth = flights.state[0, :, 0]
    z = flights.z[0] + particle.sine(PAPER_AMPLITUDE)
    axes.plot(COUNT, truth, color=style.REFERENCE, lw=2.0, label="truth")
    axes.plot(COUNT, z, ".", color=style.PALETTE[0], markersize=5, label="measured")
    axes.set_title("Figure 6: position, with 2.5 sin(k/2)", fontsize=10)
    axes.set_xlabel("sample")
    axes.set_ylabel("position")
    axes.legend(frameon=False, fontsize=8)


def _spectra(axes: Axes, z: FloatArray) -> None:
    found = spectra(particle.record(z))
    far = particle.fly(1, SEED, PRIORS[-1]).z + particle.sine(PAPER_AMPLITUDE)
    vague = spectra(particle.record(far, PRIORS[-1]))
    for curve, colour, line, label in (
        (found["imaginary"], COLOURS["first_order"], "-", "imaginary part, the paper"),
        (found["exact"], COLOURS["exact"], "-", "exact ratio"),
        (found["innovations"], style.PALETTE[3], "-", "innovations"),
        (vague["innovations"], "#555555", "--", f"innovations, variance of x₀ {PRIORS[-1]:g}"),
    ):
        axes.plot(CYCLES, curve[0] / curve[0].max(), line, color=colour, lw=1.6, label=label)
    axes.axvline(PAPER_CYCLES, color="#555555", lw=1, ls=":", label="truth")
    axes.set_title("Figure 7: spectra over their maxima", fontsize=10)
    axes.set_xlabel("cycles in the record")
    axes.legend(frameon=False, fontsize=8)


def _found(axes: Axes, at: list[float], rows: list[dict[str, Any]]) -> None:
    for name, (colour, line) in LINES.items():
        values = np.array([row[name] for row in rows])
        width = 3.0 if name == "power" else 1.4  # the exact ratio practically coincides
        axes.plot(at, values, line, color=colour, label=LOCATORS[name], markersize=5, lw=width)
    axes.set_ylim(-0.03, 1.03)
    axes.set_ylabel("share of runs")
