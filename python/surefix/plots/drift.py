"""The figure of a diagnosis: the faulty sensors' innovations, and the searches."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy.typing as npt

from surefix.drift.diagnosis import Diagnosis
from surefix.drift.forward_record import ForwardRecord
from surefix.drift.profile import Profile
from surefix.plots import style
from surefix.plots.drift_curves import onset_curves, residuals, shown_sensors, spectrum_curves
from surefix.plots.drift_panels import draw_curves, draw_residual

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_RESIDUALS = 3  # panels
HEIGHTS = 2.6, 2.0, 2.0  # of a residual, the onsets, the spectrum


def draw_drift(
    record: ForwardRecord,
    repaired: ForwardRecord,
    diagnosis: Diagnosis,
    profiles: Sequence[Profile],
    *,
    frequencies: npt.ArrayLike | None = None,
    units: Mapping[str, str] | None = None,
    title: str | None = None,
) -> Figure:
    """Innovations with the faults' effect over them; drop of 𝓛 over onset and over frequency, with
    what a healthy log would exceed at the false alarm of the diagnosis.

    ``record``, ``repaired``: of a filter and the log, before and after the repair. ``profiles`` and
    ``frequencies`` as of ``diagnose``. ``units``: of the sensors' measurements.
    """
    left = residuals(record, repaired, diagnosis, MOST_RESIDUALS)
    onsets = onset_curves(record, diagnosis, profiles)
    spectra = spectrum_curves(record, diagnosis, frequencies)
    heights = [HEIGHTS[0]] * len(left) + [HEIGHTS[1]] * bool(onsets) + [HEIGHTS[2]] * bool(spectra)
    figure = style.new_figure(10.0, 1.0 + sum(heights))
    grid = figure.subplots(len(heights), 1, height_ratios=heights, squeeze=False)
    axes: list[Axes] = [row[0] for row in grid]
    few = len(record.channels) <= len(style.PALETTE)
    names = record.channels if few else shown_sensors(diagnosis, len(style.PALETTE))
    colours = style.sensor_colours(tuple(names))
    for where, residual in zip(axes, left, strict=False):
        draw_residual(where, residual, colours[residual.sensor], (units or {}).get(residual.sensor))
    over_time = axes[: len(left) + bool(onsets)]
    if onsets:
        draw_curves(over_time[-1], onsets, colours, "onset")
    for where in over_time[1:]:
        where.sharex(over_time[0])
    over_time[0].margins(x=0.01)
    for where in over_time[:-1]:
        where.tick_params(labelbottom=False)
    _mark(over_time, diagnosis)
    over_time[-1].set_xlabel("time (s)")
    if spectra:
        draw_curves(axes[-1], spectra, colours, "frequency")
        axes[-1].set_xlabel("frequency (Hz)")
        if min(one.at[0] for one in spectra) < 0.05 * max(one.at[-1] for one in spectra):
            axes[-1].set_xscale("log")
    for where in axes:
        style.clean(where)
        _legend(where)
    figure.suptitle(
        "" if title is None else style.literal(title), x=0.01, ha="left", fontsize=11,
        fontweight="bold",
    )  # fmt: skip
    figure.align_ylabels(axes)
    return figure


def _mark(axes: Sequence[Axes], diagnosis: Diagnosis) -> None:
    """Onsets and ends as vertical lines."""
    for fault in diagnosis.faults:
        for time in (fault.onset, fault.end):
            if time is not None:
                for where in axes:
                    where.axvline(time, color=style.ALARM, linewidth=0.8, linestyle=":")


def _legend(axes: Axes) -> None:
    axes.legend(
        loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=8, frameon=False, fontsize=9,
        borderaxespad=0.1, handlelength=1.6, handletextpad=0.5, columnspacing=1.4, markerscale=3.0,
    )  # fmt: skip
