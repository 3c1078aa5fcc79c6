"""A station that stands still, recorded without faults, through the track monitor: false alarms,
biases put on its satellites, and protection levels against the true error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from surefix.core.checks import FloatArray
from surefix.plots import style
from surefix.raim.monitor import TrackRaim
from surefix.raim.pseudoranges import Pseudoranges, elevation_sigma
from surefix.studies.recorded_alarms import alarm_shares, circle, whiteness
from surefix.studies.recorded_biases import Injected, Shows, inject, shows, summary

Zeniths = dict[str, float]
"""σ [m] at the zenith of each system: σ = that / sin(elevation)."""


SHARES = ("predicted", "expected", "as_expected", "right", "usable", "unnoticed")
METRES = ("error_before", "worst_before", "error", "worst", "protection")


@dataclass(frozen=True)
class Station:
    """``name``; ``data`` without faults; ``position`` (3,) [m]; ``mask`` [degrees] of elevation;
    ``zenith`` [m] that was stated; ``length`` [m] L; ``every``: of the epochs that get a bias."""

    name: str
    data: Pseudoranges
    position: FloatArray
    mask: float
    zenith: float
    length: float
    every: int = 1

    @property
    def stated(self) -> Zeniths:
        return {str(name): self.zenith for name in self.data.system_names}

    def weighed(self, zeniths: Zeniths) -> Pseudoranges:
        """With these σ, infinite below the mask."""
        elevation, _ = self.data.sky(self.position)
        each = np.array([zeniths[str(name)] for name in self.data.system])
        sigma = each * elevation_sigma(elevation, 1.0)
        return self.data.with_sigma(np.where(elevation >= self.mask, sigma, np.inf))

    def monitor(self, heading: float, most: int = 0) -> TrackRaim:
        return TrackRaim(circle(self.position, heading), length=self.length, max_excluded=most)


def fitted(station: Station, heading: float) -> Zeniths:
    """With which the residuals of each system's satellites are as large as σ says, over the first
    half of the recording."""
    found = station.stated
    for _ in range(10):
        data = station.weighed(found)
        result, known = shows(station.monitor(heading), data)
        first = (data.epoch < data.epochs // 2) & np.isfinite(known.root)
        freedom = (known.root[first] / known.one_by_sigma[first]) ** 2
        for name in found:
            its = data.system[first] == name
            ratio = np.square(result.residual[first][its]).sum() / freedom[its].sum()
            found[name] *= float(np.sqrt(ratio))
    return found


def clean(station: Station, heading: float, zeniths: Zeniths) -> dict[str, Any]:
    """Of the recording as it is: alarms by α over the first half, the second and all of it, how far
    the residuals are from white, error and protection."""
    data, half = station.weighed(zeniths), station.data.epochs // 2
    result = station.monitor(heading).run(data)
    parts = {"first": data.where(data.epoch < half), "second": data.where(data.epoch >= half),
             "all": data}  # fmt: skip
    return {
        "heading": heading, "zeniths": zeniths, "epochs": data.epochs,
        "degrees": [int(result.degrees.min()), int(result.degrees.max())],
        "ratio": float(result.statistic.sum() / result.degrees.sum()),
        "alarms": {name: alarm_shares(station.monitor(heading).run(part))
                   for name, part in parts.items()},
        "whiteness": whiteness(data, result),
        "mean_error": float(result.along.mean()), "deviation": float(result.along.std()),
        "sigma": float(np.median(result.sigma)), "protection": float(np.median(result.protection)),
        "misleading": float(np.mean(np.abs(result.along) > result.protection)),
    }  # fmt: skip


def biased(
    station: Station,
    heading: float,
    zeniths: Zeniths,
    sizes: Sequence[float],
    most: int = 2,
    missed: float = 1e-3,
) -> tuple[list[dict[str, Any]], list[Injected]]:
    """Figures of biases of ± ``sizes`` [m], of each row's detectable bias times 1, 1.25 and 1.5 and
    of its critical bias v*, on every satellite in turn."""
    data = station.weighed(zeniths)
    data = data.where(data.epoch % station.every == 0)
    result, known = shows(station.monitor(heading), data)
    least = known.detectable(missed)
    kinds: list[tuple[str, FloatArray]] = [
        (f"{size:g} m", np.full(len(least), size)) for size in sizes
    ]
    kinds += [(f"{times:g} detectable", times * least) for times in (1.0, 1.25, 1.5)]
    kinds += [("critical v*", result.critical_bias)]
    rows, every = [], []
    for name, bias in kinds:
        pair = [_injected(station, heading, most, data, known, sign * bias) for sign in (1, -1)]
        both = Injected(**{
            key: np.concatenate([getattr(part, key) for part in pair])
            for key in Injected.__dataclass_fields__
        })  # fmt: skip
        rows.append({"heading": heading, "bias": name, **summary(both)})
        every.append(both)
    return rows, every


def _injected(
    station: Station, heading: float, most: int, data: Pseudoranges, known: Shows, bias: FloatArray
) -> Injected:
    return inject(station.monitor(heading, most), data, known, bias, truth=0.0)


def report(figures: dict[str, Any]) -> list[str]:
    """Lines of text of ``clean`` and ``biased`` figures."""
    lines = []
    for c in figures["clean"]:
        w, z = c["whiteness"], ", ".join(f"{k} {v:.3f}" for k, v in c["zeniths"].items())
        lines += [
            f"heading {c['heading']:.0f}, {c['noise']} noise: zenith {z} m; Λ / degrees "
            f"{c['ratio']:.2f}; {c['degrees'][0]} to {c['degrees'][1]} degrees, {c['epochs']} "
            f"epochs",
            f"  error {c['mean_error']:.2f} ± {c['deviation']:.2f} m, σ {c['sigma']:.2f} m, "
            f"protection {c['protection']:.2f} m, misleading {c['misleading']:.3f}",
            f"  constant share of Λ {w['constant']:.2f}, lag-1 correlation {w['lag_1']:.3f}, less "
            f"means {w['lag_1_less_mean']:.3f}; worth {w['independent']:.1f} epochs; largest means "
            + ", ".join(f"{k} {v:+.1f}" for k, v in sorted(
                w["means"].items(), key=lambda item: -abs(item[1]))[:4]),
        ]  # fmt: skip
        for name, shares in c["alarms"].items():
            each = ", ".join(f"{alpha:.0e}: {share:.3f}" for alpha, share in shares.items())
            lines.append(f"  alarms, {name:6s}  {each}")
    names = ("predicted", "expected", "as exp.", "right", "usable", "unseen", "before", "worst",
             "after", "worst", "PL", "misl.")  # fmt: skip
    lines.append(f"{'head.':6s}{'bias':>16s}{'rows':>6s}{'detected':>10s}"
                 + "".join(f"{name:>10s}" for name in names))  # fmt: skip
    lines += [
        f"{r['heading']:<6.0f}{r['bias']:>16s}{r['injected']:6d}{r['detected']:10.4f}"
        + "".join(f"{r[key]:10.4f}" for key in SHARES)
        + "".join(f"{r[key]:10.2f}" for key in METRES)
        + f"{r['misleading']:10d}"
        for r in figures["biased"]
    ]
    return lines


def draw(rows: Sequence[dict[str, Any]], title: str, path: Path) -> None:
    """Power and errors by the size of the bias."""
    figure = style.new_figure(10.0, 4.2)
    left, right = figure.subplots(1, 2)
    headings = sorted({row["heading"] for row in rows})
    for heading, colour in zip(headings, style.PALETTE, strict=False):
        mine = [r for r in rows if r["heading"] == heading and r["bias"].endswith(" m")]
        size = [float(r["bias"].split()[0]) for r in mine]
        where = f"heading {heading:.0f}°"
        left.plot(size, [r["predicted"] for r in mine], "-", color=colour,
                  label=f"{where}, predicted")  # fmt: skip
        left.plot(
            size, [r["detected"] for r in mine], "o", color=colour, label=f"{where}, detected"
        )
        right.plot(size, [r["worst_before"] for r in mine], "--", color=colour,
                   label=f"{where}, worst before")  # fmt: skip
        right.plot(size, [r["worst"] for r in mine], "o-", color=colour,
                   label=f"{where}, worst after")  # fmt: skip
        right.plot(size, [r["protection"] for r in mine], ":", color=colour,
                   label=f"{where}, median protection level")  # fmt: skip
    left.set(xscale="log", xlabel="bias on one satellite [m]", ylabel="share detected")
    right.set(xscale="log", yscale="log", xlabel="bias on one satellite [m]",
              ylabel="along-track error [m]")  # fmt: skip
    for axes in (left, right):
        style.clean(axes)
        axes.legend(fontsize=8)
    left.set_title(title, loc="left", fontsize=10)
    figure.savefig(path, dpi=100)
