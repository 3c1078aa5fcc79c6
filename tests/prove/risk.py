"""What alert limits claim against what is measured, as docs/robust.md says it.

``python tests/prove/risk.py``: 1000 weighed runs (`surefix validate`) of the filter's own model for
each of three seeds, where no 95 % interval may lie above the claim; and of each violation of that
model, where every one has to. Minutes. The last line is the figure.
"""

from __future__ import annotations

from typing import Any

from surefix.validation import validate

SEEDS = (1, 101, 102)
RUNS, SMALL, UNMODELLED = 1000, 1e-9, (1e-3, 1e-5)
VIOLATIONS = ("drift-rate", "latency", "sigma", "common-mode")


def rows(setting: str, seed: int) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = validate(RUNS, seed, settings=[setting])["settings"][setting][
        "risks"
    ]
    for row in found:
        ratio = "not measured" if row["measured"] is None else f"{factor(row):.3g}"
        print(f"{setting}, seed {seed}, {row['claimed']:.0e}: {ratio}, {row['verdict']}")
    return found


def factor(row: dict[str, Any]) -> float:
    return float(row["measured"] / row["claimed"])


def at(risk: float, found: list[dict[str, Any]]) -> dict[str, Any]:
    return next(row for row in found if row["claimed"] == risk)


def main() -> None:
    wrong: list[str] = []
    own = {seed: rows("own", seed) for seed in SEEDS}
    for seed, found in own.items():
        wrong += [
            f"own model, seed {seed}, {row['claimed']:.0e}: {row['verdict']}"
            for row in found
            if row["verdict"] not in ("agrees", "below")
        ]
    factors: dict[float, list[str]] = {risk: [] for risk in UNMODELLED}
    for name in VIOLATIONS:
        found = rows(name, SEEDS[0])
        measured = [row for row in found if row["measured"] is not None]
        wrong += [f"{name}, {row['claimed']:.0e}: {row['verdict']}" for row in measured
                  if row["verdict"] != "above"]  # fmt: skip
        wrong += [] if measured else [f"{name}: not measured"]
        for row in measured:
            if row["claimed"] in factors:
                factors[row["claimed"]].append(f"{name} {factor(row):.0f}")
    if wrong:
        raise SystemExit("\n".join(wrong))
    ratios = ", ".join(f"{factor(at(SMALL, found)):.2f}" for found in own.values())
    print(
        f"measured / claimed at {SMALL:g} under its own model {ratios} (seeds "
        f"{', '.join(map(str, SEEDS))})"
        + "".join(f"; at {risk:g} with {', '.join(names)}" for risk, names in factors.items())
    )


if __name__ == "__main__":
    main()
