"""The result of the study ``parellier-ramp`` as lines of text."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from surefix.studies import parellier_peers as peers
from surefix.studies.parellier_onsets import INDICATORS
from surefix.studies.parellier_particle import PAPER_ONSET, PAPER_SLOPE


def report(numbers: dict[str, Any], tests: Mapping[str, str]) -> list[str]:
    """The numbers of the study."""
    lines = [
        f"the paper's ramp: slope {PAPER_SLOPE}, first sample {PAPER_ONSET}; "
        f"{numbers['runs']:,} runs",
        f"{'':<44}{'median':>8}{'of 95 %':>13}{'within 5':>10}{'within 10':>11}",
    ]
    for name, of in numbers["onsets"].items():
        low, high = of["median_interval"]
        lines.append(
            f"{INDICATORS[name]:<44}{of['median']:>8g}{f'{low:g} to {high:g}':>13}"
            f"{of['within_5']:>10.1%}{of['within_10']:>11.1%}"
        )
    truth, near = numbers["amplitude_at_true_onset"], numbers["within_2_se"]
    lines += [
        "the paper, one run: the maximum is at 39. As the index m of (17) the medians are one less",
        f"slope: median {numbers['amplitude']:.3f} ± {numbers['amplitude_se']:.3f} at the best "
        f"onset, {near['at_best_onset']:.1%} within 2 standard errors, which do not know that the "
        "onset was chosen;",
        f"at the true onset mean {truth['mean']:.4f}, deviation {truth['deviation']:.4f}, "
        f"standard error {truth['amplitude_se']:.4f}, {near['at_true_onset']:.1%} within 2",
        "",
        "mean absolute onset error, index of (17), against figures of another implementation, "
        "200 runs",
        f"{'slope, first sample, indicator':<54}{'here':>15}{'there':>7}",
    ]
    for row in numbers["reproduced"]:
        what = f"{row['slope']:g}, {row['onset']}, {INDICATORS[row['indicator']]}"
        here = f"{row['error']:.2f} ± {row['error_se']:.2f}"
        verdict = "" if row["agrees"] else "   NOT reproduced"
        lines.append(f"{what:<54}{here:>15}{row['expected']:>7}{verdict}")
    for onset in sorted({row["onset"] for row in numbers["detection"]} - {0}):
        rows = [row for row in numbers["detection"] if row["onset"] in (0, onset)]
        lines += ["", f"share of runs found, ramp from sample {onset}"]
        levels = peers.LEVELS if onset == PAPER_ONSET else (1e-2,)
        lines += peers.lines(rows, "slope", tests, levels)
    return [*lines, "", numbers["note"]]
