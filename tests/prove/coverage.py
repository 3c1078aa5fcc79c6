"""Line and branch coverage of cpp/ from what clang's source-based coverage exports.

``python tests/prove/coverage.py LCOV JSON``: of templates, a branch counts as taken where any
instantiation took it; `if constexpr` is none. Every line with a branch that is never taken stands
in uncovered.txt with the reason; one that does not, or one there that is taken or gone, fails, and
so do less than 97 % of lines and 90 % of branches.
"""

from __future__ import annotations

import argparse
import json
from collections import Counter, defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
LIST = Path(__file__).with_name("uncovered.txt")
LEAST_LINES, LEAST_BRANCHES = 0.97, 0.90

Lines = dict[str, dict[int, int]]  # file: line: count
Place = tuple[str, int, int]  # file, line, column


def read_lines(lcov: str) -> Lines:
    lines: Lines = {}
    file = ""
    for row in lcov.splitlines():
        if row.startswith("SF:"):
            file = row[3:]
            lines[file] = {}
        elif row.startswith("DA:"):
            line, count = row[3:].split(",")[:2]
            lines[file][int(line)] = int(count)
    return lines


def read_branches(exported: str) -> dict[Place, tuple[int, int]]:
    """How often each condition was true, and false, in all instantiations together."""
    counts: dict[Place, list[int]] = defaultdict(lambda: [0, 0])
    for unit in json.loads(exported)["data"]:
        for file in unit["files"]:
            for line, column, _, _, true, false, *_ in file["branches"]:
                counts[file["filename"], line, column][0] += true
                counts[file["filename"], line, column][1] += false
    return {
        place: (true, false)
        for place, (true, false) in counts.items()
        if true + false > 0 or "if constexpr" not in text_of(place[0], place[1])
    }


def read_reasons() -> Counter[tuple[str, str]]:
    """File and text of lines with a branch that is never taken, and how many have a reason."""
    reasons: Counter[tuple[str, str]] = Counter()
    for row in LIST.read_text(encoding="utf-8").splitlines():
        if row and not row.startswith("#"):
            file, text, _ = (part.strip() for part in row.split(" | ", 2))
            reasons[file, text] += 1
    return reasons


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("lcov", type=Path)
    parser.add_argument("json", type=Path)
    given = parser.parse_args()
    lines = read_lines(given.lcov.read_text())
    branches = read_branches(given.json.read_text())
    reasons, missing = read_reasons(), []
    without = dict(reasons)  # reasons that no line has asked for yet
    asked: set[tuple[str, int]] = set()
    for (file, line, column), taken in sorted(branches.items()):
        if all(taken):
            continue
        key = (str(Path(file).relative_to(ROOT)), text_of(file, line))
        if (file, line) not in asked and without.get(key, 0) > 0:
            without[key] -= 1
            asked.add((file, line))
        if (file, line) not in asked:
            never = " and ".join(side for side, n in zip(("true", "false"), taken, strict=True)
                                 if n == 0)  # fmt: skip
            missing.append(f"{key[0]}:{line}:{column}: never {never} | {key[1]}")
    print("\n".join(missing))
    stale = sorted(key for key, rest in without.items() if rest > 0)
    for key in stale:
        print(f"listed, and taken or gone: {' | '.join(key)}")
    count = [n for of_file in lines.values() for n in of_file.values()]
    sides = [n for taken in branches.values() for n in taken]
    of_lines, of_branches = share(count), share(sides)
    print(f"lines {of_lines:.2%} of {len(count)}, branches {of_branches:.2%} of {len(sides)}, "
          f"{len(missing)} without a reason")  # fmt: skip
    if missing or stale or of_lines < LEAST_LINES or of_branches < LEAST_BRANCHES:
        raise SystemExit(1)


def share(counts: list[int]) -> float:
    return sum(n > 0 for n in counts) / len(counts)


def text_of(file: str, line: int) -> str:
    return Path(file).read_text(encoding="utf-8").splitlines()[line - 1].strip()


if __name__ == "__main__":
    main()
