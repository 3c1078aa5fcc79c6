"""One line for each promise of docs/promises.md: its tests that passed, and its figures.

``python tests/prove/promises.py FOLDER``: reads ctest.xml and pytest.xml (JUnit) and the figures of
the proofs (NAME.figure) there. A test that is named and did not run and pass fails; so does a proof
that failed. Figures that a test measures are its properties `figure` (`record_property`).
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

    def __init__(self, folder: Path) -> None:
        self.folder = folder
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


def report(promise: str, references: list[tuple[str, str]], results: Results) -> tuple[str, bool]:
    """Its line, and whether it is kept."""
    tests: dict[str, bool] = {}
    figures: list[str] = []
    failed: list[str] = []
    for kind, pattern in references:
        if kind == "prove":
            file = results.folder / f"{pattern}.figure"
            if file.is_file():
                figures.append(f"{pattern}: {file.read_text().strip()}")
            else:
                failed.append(f"prove {pattern}")
            continue
        names = results.of(kind, pattern)
        failed += [] if names else [f"{kind} {pattern} (not run)"]
        for name in names:
            tests[name] = results.passed[kind][name]
            figures += results.figures.get(name, [])
    failed += [name for name, good in tests.items() if not good]
    line = f"{promise} {sum(tests.values())} tests" + "".join(f"; {figure}" for figure in figures)
    return line + (f"; FAILED: {', '.join(failed)}" if failed else ""), not failed


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    results = Results(parser.parse_args().folder)
    section = PAGE.read_text(encoding="utf-8").split("## Promises", 1)[1].split("\n## ", 1)[0]
    references: dict[int, list[tuple[str, str]]] = {}
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


if __name__ == "__main__":
    main()
