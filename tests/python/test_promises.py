"""docs/promises.md: what it names exists, nothing is left out, and no row is without a proof."""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PROMISES, FAILURES = 8, 16
PAPERS = {
    "Bilenne 2004": 54,
    "Sigalov & Oshman": 29,
    "Parellier, Barrau & Bonnabel 2023": 25,
    "Lacresse, Grall & Nikiforov 2005": 13,
}
"""Each paper's section, and its last numbered equation."""
STATEMENTS = {
    "Bilenne 2004": ("table 1", "table 2", "figure 1", "figure 2"),
    "Sigalov & Oshman": (
        *("Problem 1", "Problem 2", "Problem 3", "Problem 4"),
        *("Lemma 1", "Lemma 2", "Corollary 1", "figure 1(a)", "figure 1(b)"),
    ),
    "Parellier, Barrau & Bonnabel 2023": ("Proposition 1", "Proposition 2", "Proposition 3"),
    "Lacresse, Grall & Nikiforov 2005": ("section 4.3", "section 5.2", "section 5.3", "figure 2"),
}
WITHOUT_TEST = re.compile(r"definition$|not implemented[\w ]*: \S")
MACRO = re.compile(r"^(?:TYPED_)?TEST(?:_F|_P)?\(\s*(\w+)\s*,\s*(\w+)\s*\)", re.MULTILINE)
PROOF = re.compile(r"^(?:function\s+)?prove_(\w+)\s*\(\)", re.MULTILINE)
SPAN = re.compile(r"`([^`]*)`")
PATH = re.compile(r"[\w.-]+/[\w./-]*")
LINK = re.compile(r"\]\(([^)#]+)")
EQUATION = re.compile(r"\((\d+)[a-z]?\)(?:-\((\d+)[a-z]?\))?")


@cache
def collected_from(file: Path) -> set[str]:
    """Of a Python file; none if pytest does not collect it."""
    if not (file.is_file() and file.name.startswith("test_") and file.suffix == ".py"):
        return set()
    tree = ast.parse(file.read_text("utf-8"))
    names = {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
    return {name for name in names if name.startswith("test_")}


class Project:
    """The tests and files of a working tree."""

    def __init__(self, root: Path) -> None:
        self.root = root

    @cached_property
    def ctests(self) -> set[str]:
        """``Suite.Name``, and ``Suite.*`` of each suite."""
        sources = (self.root / "tests").rglob("*_test.cpp")
        found = [test for path in sources for test in MACRO.findall(path.read_text("utf-8"))]
        return {f"{suite}.{name}" for suite, test in found for name in (test, "*")}

    @cached_property
    def proofs(self) -> set[str]:
        script = self.root / "tests" / "prove" / "run.sh"
        return set(PROOF.findall(script.read_text("utf-8"))) if script.is_file() else set()

    def has_test(self, reference: str) -> bool:
        kind, _, name = reference.partition(" ")
        if kind == "pytest":
            path, colons, function = name.partition("::")
            tests = collected_from(self.root / "tests" / "python" / path)
            return function in tests if colons else bool(tests)
        return name in {"ctest": self.ctests, "prove": self.proofs}.get(kind, set())

    def has_file(self, path: str) -> bool:
        places = (self.root, self.root / "cpp" / "include" / "surefix")
        return any((place / path).exists() for place in places)


@dataclass(frozen=True)
class Row:
    section: str
    line: int
    cells: dict[str, str]
    """By the heading of their column."""

    @property
    def title(self) -> str:
        return next(iter(self.cells.values()))

    @property
    def proof(self) -> str:
        return self.cells.get("proof", "")

    @property
    def references(self) -> list[str]:
        return SPAN.findall(self.proof)

    def __str__(self) -> str:
        return f"line {self.line} ({self.title[:40]})"


def cells_of(line: str) -> list[str]:
    return [cell.strip() for cell in re.split(r"(?<!\\)\|", line.strip())[1:-1]]


def rows_of(text: str) -> Iterator[Row]:
    """Every row of every table; the line after a table's headings is its rule."""
    section, columns = "", list[str]()
    for number, line in enumerate(text.splitlines(), start=1):
        if line.startswith("## "):
            section = line[3:]
        if not line.startswith("|"):
            columns = []
        elif not columns:
            columns = cells_of(line)
        elif not set(line) <= set("|-: "):
            cells = cells_of(line)
            if len(cells) != len(columns):
                raise ValueError(f"line {number}: expected {len(columns)} cells, got {len(cells)}")
            yield Row(section, number, dict(zip(columns, cells, strict=True)))


class Page:
    def __init__(self, text: str, project: Project) -> None:
        self.text, self.project = text, project
        self.rows = list(rows_of(text))

    def of(self, section: str) -> list[Row]:
        return [row for row in self.rows if row.section == section]


# Checks: each yields what is wrong.

Check = Callable[[Page], Iterator[str]]


def unknown_tests(page: Page, kind: str) -> Iterator[str]:
    for row in page.rows:
        for reference in row.references:
            if reference.startswith(f"{kind} ") and not page.project.has_test(reference):
                yield f"{row}: there is no `{reference}`"


def unknown_ctest(page: Page) -> Iterator[str]:
    return unknown_tests(page, "ctest")


def unknown_pytest(page: Page) -> Iterator[str]:
    return unknown_tests(page, "pytest")


def unknown_prove(page: Page) -> Iterator[str]:
    return unknown_tests(page, "prove")


def malformed_references(page: Page) -> Iterator[str]:
    for row in page.rows:
        for reference in row.references:
            if not re.fullmatch(r"(ctest|pytest|prove) \S+", reference):
                yield f"{row}: expected ctest, pytest or prove and a name, got `{reference}`"


def rows_without_proof(page: Page) -> Iterator[str]:
    """An equation may be a definition, or not implemented, with a reason."""
    for row in page.rows:
        excused = row.section in PAPERS and WITHOUT_TEST.match(row.proof)
        if not row.references and not excused:
            yield f"{row}: no proof, got {row.proof!r}"


def rows_without_code(page: Page) -> Iterator[str]:
    """Of the papers' tables: what is implemented is somewhere, and only files are named."""
    for row in page.rows:
        if row.section not in PAPERS:
            continue
        code = row.cells.get("code", "")
        if not SPAN.findall(code) and not row.proof.startswith("not implemented"):
            yield f"{row}: no code, got {code!r}"
        for path in SPAN.findall(code):
            if not PATH.fullmatch(path):
                yield f"{row}: expected a path, got `{path}`"


def missing_files(page: Page) -> Iterator[str]:
    """Whatever looks like a path, in tables and beside them, and the links to other pages."""
    for number, line in enumerate(page.text.splitlines(), start=1):
        paths = [span for span in SPAN.findall(line) if PATH.fullmatch(span)]
        links = [f"docs/{link}" for link in LINK.findall(line)]
        for path in (*paths, *links):
            if not page.project.has_file(path):
                yield f"line {number}: there is no `{path}`"


def left_to_do(page: Page) -> Iterator[str]:
    for number, line in enumerate(page.text.splitlines(), start=1):
        if "TODO" in line:
            yield f"line {number}: TODO"


def missing_promises(page: Page) -> Iterator[str]:
    found = [re.match(r"(\d+)\. ", row.title) for row in page.of("Promises")]
    numbers = {int(match[1]) for match in found if match}
    if None in found:
        yield "Promises: a row has no number"
    if numbers != set(range(1, PROMISES + 1)):
        yield f"Promises: expected 1 to {PROMISES}, got {sorted(numbers)}"


def missing_failures(page: Page) -> Iterator[str]:
    count = len(page.of("Failures of others"))
    if count != FAILURES:
        yield f"Failures of others: expected {FAILURES} rows, got {count}"


def equations(rows: list[Row]) -> set[int]:
    found = [match for row in rows for match in EQUATION.findall(row.title)]
    return {n for first, last in found for n in range(int(first), int(last or first) + 1)}


def missing_equations(page: Page) -> Iterator[str]:
    for paper, last in PAPERS.items():
        wrong = equations(page.of(paper)) ^ set(range(1, last + 1))
        if wrong:
            yield f"{paper}: missing, or not in the paper: {sorted(wrong)}"


def missing_statements(page: Page) -> Iterator[str]:
    for paper, statements in STATEMENTS.items():
        titles = [row.title for row in page.of(paper)]
        for statement in statements:
            if not any(statement in title for title in titles):
                yield f"{paper}: there is no row for {statement}"


CHECKS: tuple[Check, ...] = (
    unknown_ctest, unknown_pytest, unknown_prove, malformed_references, rows_without_proof,
    rows_without_code, missing_files, left_to_do, missing_promises, missing_failures,
    missing_equations, missing_statements,
)  # fmt: skip


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
def test_the_page(check: Check) -> None:
    page = Page((ROOT / "docs" / "promises.md").read_text("utf-8"), Project(ROOT))
    assert list(check(page)) == []


# A small project and a small page of it, and what each check finds when something is wrong.

FILES = {
    "tests/cpp/a_test.cpp": "TEST(A, Holds) {}\nTYPED_TEST(Every,\n  Type) {}\n// TEST(A, Gone)\n",
    "tests/cpp/deep/b_test.cpp": "TEST_F(B, Fits) {}\nTEST_P(B, Fits2) {}\n",
    "tests/python/test_a.py": "def test_holds() -> None: ...\ndef helper() -> None: ...\n",
    "tests/python/helpers.py": "def test_not_collected() -> None: ...\n",
    "tests/prove/run.sh": "prove_soak() {\n  :\n}\n",
    "cpp/include/surefix/core/a.hpp": "",
    "docs/other.md": "",
}
FAILURE = "| that | there | `pytest test_a.py::test_holds` |"
EVERY_STATEMENT = {paper: ", ".join(names) for paper, names in STATEMENTS.items()}


def small_page() -> str:
    """All that is asked for, in as few rows as that takes."""
    promises = [f"| {n}. that | `ctest A.Holds` | – |" for n in range(1, PROMISES + 1)]
    failures = [FAILURE] * FAILURES
    lines = ["See [other](other.md#there).", "## Promises", "| promise | proof | figure |",
             "| --- | --- | --- |", *promises, "## Failures of others",
             "| failure | where | proof |", "| --- | --- | --- |", *failures]  # fmt: skip
    for paper, last in PAPERS.items():
        lines += [f"## {paper}", "| equation | says | code | proof |", "| --- | --- | --- | --- |"]
        lines += [f"| (1)-({last}), {EVERY_STATEMENT[paper]} | a \\| b | `core/a.hpp` | "
                  "`ctest Every.Type`, `ctest B.*`, `pytest test_a.py`, `prove soak` |",
                  "| (2a)-(3b) | x | `core/a.hpp` | definition |",
                  "| (4) | x | – | not implemented: nobody needs it |"]  # fmt: skip
    return "\n".join(lines) + "\n"


@pytest.fixture
def project(tmp_path: Path) -> Project:
    for name, text in FILES.items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, "utf-8")
    return Project(tmp_path)


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
def test_a_right_page_passes(check: Check, project: Project) -> None:
    assert list(check(Page(small_page(), project))) == []


WRONG: list[tuple[Check, str, str, str]] = [
    (unknown_ctest, "ctest Every.Type", "ctest Every.Other", "`ctest Every.Other`"),
    (unknown_ctest, "ctest Every.Type", "ctest A.Gone", "`ctest A.Gone`"),
    (unknown_ctest, "ctest B.*", "ctest C.*", "`ctest C.*`"),
    (unknown_pytest, "::test_holds", "::test_broke", "`pytest test_a.py::test_broke`"),
    (unknown_pytest, "::test_holds", "::helper", "`pytest test_a.py::helper`"),
    (unknown_pytest, "`pytest test_a.py`", "`pytest test_b.py`", "`pytest test_b.py`"),
    (unknown_pytest, "test_a.py::test_holds", "helpers.py::test_not_collected", "`pytest helpers"),
    (unknown_prove, "prove soak", "prove nothing", "`prove nothing`"),
    (malformed_references, "prove soak", "proof soak", "`proof soak`"),
    (malformed_references, "ctest B.*", "B.Fits", "`B.Fits`"),
    (rows_without_proof, "| `ctest A.Holds` |", "|  |", "line 5 (1. that): no proof"),
    (rows_without_proof, "| `ctest A.Holds` |", "| definition |", "no proof, got 'definition'"),
    (rows_without_proof, "not implemented: nobody needs it", "not implemented", "(4)): no proof"),
    (rows_without_code, "| `core/a.hpp` | definition", "| – | definition", "no code, got '–'"),
    (rows_without_code, "`core/a.hpp` | definition", "`a` | definition", "expected a path"),
    (missing_files, "`core/a.hpp` | def", "`core/b.hpp` | def", "there is no `core/b.hpp`"),
    (missing_files, "other.md", "another.md", "line 1: there is no `docs/another.md`"),
    (missing_files, "See", "See `tests/nowhere/`,", "line 1: there is no `tests/nowhere/`"),
    (left_to_do, "nobody needs it", "TODO", "TODO"),
    (missing_promises, "| 3. that", "| 4. that", "[1, 2, 4, 5, 6, 7, 8]"),
    (missing_promises, "| 3. that", "| that", "a row has no number"),
    (missing_failures, f"{FAILURE}\n", "", "16 rows, got 15"),
    (missing_equations, "(1)-(54)", "(1)-(53)", "Bilenne 2004: missing, or not in the paper: [54]"),
    (missing_equations, "(1)-(25)", "(1)-(26)", "paper: [26]"),
    (missing_statements, "Lemma 2", "Lemma 3", "Sigalov & Oshman: there is no row for Lemma 2"),
]


@pytest.mark.parametrize(("check", "right", "wrong", "message"), WRONG)
def test_what_is_wrong_is_reported(
    check: Check, right: str, wrong: str, message: str, project: Project
) -> None:
    page = small_page()
    assert right in page
    found = list(check(Page(page.replace(right, wrong, 1), project)))
    assert any(message in line for line in found), found


def test_without_the_script_there_is_no_proof(project: Project) -> None:
    (project.root / "tests" / "prove" / "run.sh").unlink()
    found = list(unknown_prove(Page(small_page(), project)))
    assert len(found) == len(PAPERS)


def test_a_row_of_another_length_is_refused(project: Project) -> None:
    with pytest.raises(ValueError, match="line 5: expected 3 cells, got 2"):
        Page(small_page().replace("| – |", "|", 1), project)
