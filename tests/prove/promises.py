"""One line for each promise of docs/promises.md: its tests that passed, and its figures.

``python tests/prove/promises.py FOLDER REVISION``: reads ctest.xml and pytest.xml (JUnit) and the
figures of the proofs (NAME.figure) there. A test that is named and did not run and pass fails; so
does a proof that failed, or was of another revision (NAME.revision). Figures that a test measures
are its properties `figure` (`record_property`). With ``--write``, the figures are also put into the
page, after "last: " in each row.
"""

from __future__ import annotations

import argparse
import re
import xml.etree.ElementTree as ET
from fnmatch import fnmatchcase
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "promises.md"
REFERENCE = re.compile(r"`(ctest|pytest|prove) ([^`]+)`")


class Results:
    """What ran: name of a test as the page writes it, whether it passed, what it measured."""

    def __init__(self, folder: Path, revision: str) -> None:
        self.folder, self.revision = folder, revision
        self.passed: dict[str, dict[str, bool]] = {"ctest": {}, "pytest": {}}
        self.figures: dict[str, list[str]] = {}
        for case in ET.parse(folder / "ctest.xml").iter("testcase"):
            name = re.sub(r"/\d+|^\w+/(?=[A-Za-z]\w*\.)|<.*", "", case.attrib["name"]).split()[0]
            self._add("ctest", name, case)
        for case in ET.parse(folder / "pytest.xml").iter("testcase"):
            module = case.attrib["classname"].removeprefix("tests.python.").replace(".", "/")
            self._add("pytest", f"{module}.py::{case.attrib['name'].split('[')[0]}", case)

    def _add(self, kind: str, name: str, case: ET.Element) -> None:
        good = all(case.find(kind) is None for kind in ("failure", "error", "skipped"))
        self.passed[kind][name] = good and self.passed[kind].get(name, True)
        for found in case.iter("property"):
            if found.attrib["name"] == "figure":
                self.figures.setdefault(name, []).append(found.attrib["value"])

    def of(self, kind: str, pattern: str) -> list[str]:
        """Tests of this name, or pattern, or file."""
        if kind == "pytest" and "::" not in pattern:
            pattern += "::*"
        return [name for name in self.passed[kind] if fnmatchcase(name, pattern)]

    def of_proof(self, name: str) -> str | None:
        """Its figure; None if it failed or was of another revision."""
        figure, revision = (self.folder / f"{name}.{kind}" for kind in ("figure", "revision"))
        if not figure.is_file() or revision.read_text().strip() != self.revision:
            return None
        return figure.read_text().strip()

    def of_test(self, name: str) -> list[str]:
        """What a test measured."""
        return self.figures.get(name, [])


Reference = tuple[str, str]  # kind and name


def figures_of(references: list[Reference], results: Results) -> list[str]:
    """What the tests and proofs named have measured."""
    found: list[str] = []
    for kind, pattern in references:
        if kind != "prove":
            found += [each for name in results.of(kind, pattern) for each in results.of_test(name)]
        elif (figure := results.of_proof(pattern)) is not None:
            found.append(f"{pattern}: {figure}")
    return found


def report(promise: str, references: list[Reference], results: Results) -> tuple[str, bool]:
    """Its line, and whether it is kept."""
    tests: dict[str, bool] = {}
    failed: list[str] = []
    for kind, pattern in references:
        if kind == "prove":
            if results.of_proof(pattern) is None:
                failed.append(f"prove {pattern}")
            continue
        names = results.of(kind, pattern)
        failed += [] if names else [f"{kind} {pattern} (not run)"]
        tests.update((name, results.passed[kind][name]) for name in names)
    failed += [name for name, good in tests.items() if not good]
    figures = figures_of(references, results)
    line = f"{promise} {sum(tests.values())} tests" + "".join(f"; {figure}" for figure in figures)
    return line + (f"; FAILED: {', '.join(failed)}" if failed else ""), not failed


def with_figures(row: str, results: Results) -> str:
    """A row of the table, its last cell ending in what was measured; what stands before stays."""
    start, proofs, cell = row.rstrip(" |").rsplit(" | ", 2)
    figures = figures_of(REFERENCE.findall(proofs), results)
    if not figures:
        return row
    hand = cell.split("last: ")[0].strip(" –;")
    return f"{start} | {proofs} | {hand}{'; ' if hand else ''}last: {'; '.join(figures)} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("revision")
    parser.add_argument("--write", action="store_true")
    given = parser.parse_args()
    results = Results(given.folder, given.revision)
    before, rest = PAGE.read_text(encoding="utf-8").split("## Promises\n", 1)
    section, after = rest.split("\n## ", 1)
    references: dict[int, list[Reference]] = {}
    for row in re.findall(r"^\| (\d+)\. (.*)$", section, re.MULTILINE):
        found = references.setdefault(int(row[0]), [])
        found += [each for each in REFERENCE.findall(row[1]) if each not in found]
    kept = True
    for promise, of_promise in sorted(references.items()):
        line, good = report(f"{promise}.", of_promise, results)
        print(line)
        kept = kept and good
    if not kept:
        raise SystemExit(1)
    if given.write:
        section = re.sub(r"^\| \d+\. .*$", lambda row: with_figures(row[0], results), section,
                         flags=re.MULTILINE)  # fmt: skip
        PAGE.write_text(f"{before}## Promises\n{section}\n## {after}", encoding="utf-8")


if __name__ == "__main__":
    main()
