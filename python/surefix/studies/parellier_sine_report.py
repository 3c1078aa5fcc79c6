"""The result of the study ``parellier-sine`` as lines of text."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from surefix.studies import parellier_peers as peers
from surefix.studies.parellier_cycles import EXPECTED_SPAN, LOCATORS, PRIORS
from surefix.studies.parellier_particle import PAPER_CYCLES


def report(numbers: dict[str, Any], tests: Mapping[str, str]) -> list[str]:
    """The numbers of the study."""
    lines = []
    for phase in ("paper", "drawn"):
        rows = [row for row in numbers["found_8"] if row["phase"] == phase]
        what = "the paper's" if phase == "paper" else "drawn"
        head = f"share of {numbers['runs']:,} runs with 8 cycles; amplitude"
        lines += [f"{head:<52}" + "".join(f"{row['amplitude']:>9g}" for row in rows) + f"   {what}"]
        for name, label in LOCATORS.items():
            lines.append(f"{label:<52}" + "".join(f"{row[name]:>9.1%}" for row in rows))
    lines += [
        "the paper: at 2.5 the innovations' spectrum reveals nothing. That depends on x_0's "
        "variance:",
        f"{'':<52}" + "".join(f"{f'{p:g}':>9}" for p in PRIORS),
    ]
    for name, label in LOCATORS.items():
        shares = "".join(f"{row[name]:>9.1%}" for row in numbers["found_8_by_prior"])
        lines.append(f"{label:<52}{shares}")
    lines += ["", f"between whole cycles, medians; true cycles {PAPER_CYCLES:.4f}"]
    for row in numbers["estimates"]:
        of = row["of_these"]
        lines.append(
            f"amplitude {row['true_amplitude']:<5g} phase {row['phase']}: "
            f"{row['amplitude']:.3f} ± {row['amplitude_se']:.3f}, cycles {row['cycles']:.3f}; "
            f"{row['within_half_a_cycle']:.1%} within half a cycle, of these deviation "
            f"{of['amplitude_deviation']:.3f} and {of['cycles_deviation']:.4f} cycles, "
            f"{of['within_2_se']:.1%} within 2 standard errors"
        )
    lines += [
        "",
        "variance of the gradient's spectrum, largest over smallest of 1 to N/2 - 1 cycles",
    ]
    for row in numbers["variance_span"]:
        lines.append(
            f"N = {row['N']:<6} {row['power']:>8.1f} : 1; of the imaginary part "
            f"{row['imaginary']:.1f} : 1; with 0 cycles {row['with_0']:.1f} : 1"
        )
    lines.append(
        f"{EXPECTED_SPAN} : 1 was expected: "
        + (
            "as at N = 100"
            if numbers["variance_span"][0]["agrees"]
            else "NOT reproduced at N = 100"
        )
    )
    for phase in ("paper", "drawn"):
        rows = [row for row in numbers["detection"] if row["phase"] in ("none", phase)]
        what = "the paper's phase" if phase == "paper" else "phase drawn"
        levels = peers.LEVELS if phase == "drawn" else (1e-2,)
        lines += ["", f"share of runs found, {what}"]
        lines += peers.lines(rows, "amplitude", tests, levels)
    return [*lines, "", numbers["note"]]
