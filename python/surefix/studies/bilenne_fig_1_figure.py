"""The figure of the study ``bilenne-fig-1``."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import surefix as sf
from surefix.plots import style
from surefix.studies import scenarios
from surefix.studies.journey_panel import draw_journey, shade

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ROWS = {
    "linear": "Linear filter",
    "outage": "The paper's estimator: outage alone",
    "frozen": "Faults that last: frozen, drift carried, outage",
}
WINDOW = (1590.0, 1630.0)  # s


def make_figure(
    make_filter: Callable[[str], sf.DesyncFilter | sf.RobustFilter],
    rate: float,
    gps_rates: Sequence[float],
    seed: int,
) -> Figure:
    """Linear above, robust below, as in the paper; a column for each rate [Hz] of the GPS."""
    figure = style.new_figure(12.0, 11.0)
    panels = figure.subplots(len(ROWS), len(gps_rates), sharex=True, sharey=True, squeeze=False)
    for column, gps in enumerate(gps_rates):
        scene = scenarios.tunnel(seed, gps)
        for row, (kind, name) in enumerate(ROWS.items()):
            axes = panels[row, column]
            result = make_filter(kind).run(scene.log, times=scene.times(rate))
            draw_journey(axes, result, scene.truth, WINDOW)
            axes.set_title(f"{name}; {rate:g} Hz, GPS {gps:g} Hz", fontsize=10)
            shade(axes, (scenarios.ENTRY, scenarios.EXIT), "tunnel: the GPS repeats one value")
            axes.annotate(
                "103 km/h", (scenarios.OUTLIER_AT, scenarios.OUTLIER), xytext=(8, 2),
                textcoords="offset points", fontsize=8, color="#444444",
            )  # fmt: skip
            axes.set_ylim(5.0, 38.0)
            axes.set_xticks([1590, 1600, 1610, 1620, 1630])
            axes.label_outer()
    style.legend_above(figure, panels[1, 0], None)
    return figure
