"""What the programs of examples/onboard need: bytes of their objects, stack, instructions a step.

``python benchmarks/onboard.py``: the size of each system's object as the linker has it, the deepest
chain of calls below its step by GCC's ``-fcallgraph-info=su`` (frames of surefix and Eigen; the C
library's are not in it), and the instructions of its step by callgrind, which counts the same in
every run. Needs g++, cmake, ninja and valgrind; some minutes.
"""

from __future__ import annotations

import argparse
import re
import subprocess
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parent.parent
BUILD = ROOT / "build" / "stack"
MOST_STACK = 64 * 1024
SAMPLES = ROOT / "examples" / "onboard" / "samples"
NODE = re.compile(r'node: \{ title: "([^"]+)" label: "[^"]*?(\d+) bytes \(([^)]*)\)')
SORT, LARGEST_SORT = "__introsort_loop", 1 << 14  # hypotheses
# Where Eigen takes room for two copies of a matrix or less, which is at most 4 by 4 here.
COPIES, THEIR_BYTES = ("selfadjoint_product_impl", "triangular_solve_matrix"), 2 * (16 * 8 + 32)
EDGE = re.compile(r'edge: \{ sourcename: "([^"]+)" targetname: "([^"]+)"')


def full_step() -> str:
    """24 measurements of three sensors in every step of half a second, one of them drifting."""
    lines = []
    for k in range(1, 481):
        stamp, sensor = 20_833_333 * k, k % 3
        value = 20.0 + 0.3 * ((k * 7919) % 11 - 5) / 5 + (0.02 * (k - 240) if sensor == 1 else 0.0)
        lines.append(f"M,{stamp + (0, 30_000_000, 150_000_000)[sensor]},{sensor},{value:.3f}")
        if k % 24 == 0:
            lines.append(f"E,{stamp}")
    return "\n".join(lines) + "\n"


OWN_STEP = "(anonymous namespace)::step(*"


class Program(NamedTuple):
    """One of examples/onboard."""

    name: str
    step: str  # what it does in one
    function: str  # its step, as callgrind prints it
    objects: tuple[str, ...]  # in main
    given: Callable[[], str]  # its input
    letter: str  # of a line that makes a step


def sample(name: str) -> Callable[[], str]:
    return (SAMPLES / f"{name}.in").read_text


PROGRAMS = (
    Program("speed_monitor", "3 sensors x 3 modes, 24 measurements", "*Filter*::estimate(*",
            ("filter",), full_step, "E"),
    Program("switching_filter", "2 states, 4 modes, 1 measurement", OWN_STEP, ("filter",),
            sample("switching_filter"), "Z"),
    Program("drift_detector", "15 measurements, 3 looks into the last 300", OWN_STEP,
            ("filter", "detector"), sample("drift_detector"), "E"),
    Program("track_monitor", "10 satellites, hypotheses of 1 and 2", "*TrackRaim::judge(*",
            ("monitor",), sample("track_monitor"), "E"),
)  # fmt: skip


@dataclass(frozen=True)
class Need:
    """What a program needs."""

    program: str
    step: str
    object_bytes: int
    stack_bytes: int
    instructions: int  # of a step, the mean over its input


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--brief", action="store_true", help="one line, of the speed monitor")
    if not parser.parse_args().brief:
        show(measure())
        return
    (need,) = measure(PROGRAMS[:1])
    print(f"speed monitor ({need.step}): object {need.object_bytes} bytes, "
          f"stack {need.stack_bytes}, {need.instructions} instructions")  # fmt: skip
    if need.stack_bytes > MOST_STACK:
        raise SystemExit("its step needs more than 64 KiB of stack")
    stated = stated_instructions(need.program)
    if not 0.95 * stated < need.instructions < 1.05 * stated:
        raise SystemExit(f"its instructions are not the {stated} that docs/onboard.md states")


def stated_instructions(program: str) -> int:
    """In the table of docs/onboard.md."""
    page = (ROOT / "docs" / "onboard.md").read_text(encoding="utf-8")
    row = re.search(rf"^\| {program} \|.*\| ([\d,]+) \|$", page, re.MULTILINE)
    if row is None:
        raise SystemExit(f"docs/onboard.md has no row for {program}")
    return int(row[1].replace(",", ""))


def measure(programs: Sequence[Program] = PROGRAMS) -> list[Need]:
    build()
    needs = []
    for program in programs:
        given = program.given()
        steps = sum(line.startswith(program.letter) for line in given.splitlines())
        needs.append(
            Need(
                program.name,
                program.step,
                object_size(program),
                deepest(call_graph(program.name), step_pattern(program.function)),
                instructions(program, given) // steps,
            )
        )
    return needs


def show(needs: Sequence[Need]) -> None:
    """The table of docs/onboard.md."""
    print("| program | a step | object [bytes] | stack [bytes] | instructions |")
    print("| --- | --- | --- | --- | --- |")
    for need in needs:
        print(f"| {need.program} | {need.step} | {need.object_bytes:,} | {need.stack_bytes:,} "
              f"| {need.instructions:,} |")  # fmt: skip


def build() -> None:
    """Library and programs as they would be onboard, with GCC's call graphs beside the objects."""
    flags = "-fcallgraph-info=su -fno-exceptions -fno-rtti"
    prefix = BUILD / "installed"
    configured = ["-G", "Ninja", "-DCMAKE_CXX_COMPILER=g++", f"-DCMAKE_CXX_FLAGS={flags}"]
    quiet(["cmake", "-S", str(ROOT), "-B", str(BUILD / "library"), "-DSUREFIX_TESTS=OFF",
           *configured])  # fmt: skip
    quiet(["cmake", "--build", str(BUILD / "library")])
    quiet(["cmake", "--install", str(BUILD / "library"), "--prefix", str(prefix)])
    quiet(["cmake", "-S", str(ROOT / "examples" / "onboard"), "-B", str(BUILD / "programs"),
           f"-DCMAKE_PREFIX_PATH={prefix}", *configured])  # fmt: skip
    quiet(["cmake", "--build", str(BUILD / "programs")])


def quiet(command: list[str]) -> str:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(command)}:\n{done.stdout}{done.stderr}")
    return done.stdout


class Calls:
    """Frame [bytes] and callees of every function that was compiled."""

    def __init__(self) -> None:
        self.frame: dict[str, int] = {}
        self.unbounded: set[str] = set()
        self.callees: dict[str, set[str]] = {}


def call_graph(program: str) -> Calls:
    """Of the library and one program."""
    calls = Calls()
    for file in BUILD.rglob("*.ci"):
        if "programs" in file.relative_to(BUILD).parts and file.name != f"{program}.cpp.ci":
            continue
        text = file.read_text(encoding="utf-8")
        for name, size, kind in NODE.findall(text):
            calls.frame[plain(name)] = max(int(size), calls.frame.get(plain(name), 0))
            if kind not in ("static", "dynamic,bounded"):
                calls.unbounded.add(plain(name))
        for caller, callee in EDGE.findall(text):
            calls.callees.setdefault(plain(caller), set()).add(plain(callee))
    return calls


def plain(name: str) -> str:
    """Local symbols carry the name of their file before a colon."""
    return name.rsplit(":", 1)[-1]


def step_pattern(step: str) -> re.Pattern[str]:
    return re.compile(re.escape(step).replace(r"\*", ".*"))


def deepest(calls: Calls, step: re.Pattern[str]) -> int:
    """Bytes of the deepest chain of calls that begins at a function of this name."""
    names = list(calls.frame)
    readable = subprocess.run(
        ["c++filt"], input="\n".join(names), capture_output=True, text=True, check=True
    ).stdout.splitlines()
    starts = [name for name, text in zip(names, readable, strict=True) if step.match(text)]
    if not starts:
        raise SystemExit(f"no function {step.pattern} was compiled")
    known: dict[str, int] = {}

    def depth(name: str, above: frozenset[str]) -> int:
        if name in above:
            raise SystemExit(f"{name} calls itself: its stack has no bound")
        copies = any(each in name for each in COPIES)
        if name in calls.unbounded and not copies:
            raise SystemExit(f"{name} has a frame of unbounded size")
        if name == "__indirect_call":
            raise SystemExit("a call through a pointer: its stack is not known")
        if name not in known:
            below, times = calls.callees.get(name, set()), 1
            if SORT in name:  # calls itself 2 log2(n) times at most, then sorts otherwise
                below, times = below - {name}, 2 * LARGEST_SORT.bit_length()
            if "boost4math" in name:  # calls itself once, for an argument's mirror image
                below, times = below - {name}, 2
            own = calls.frame.get(name, 0) + (THEIR_BYTES if copies else 0)
            known[name] = times * own + max(
                (depth(callee, above | {name}) for callee in below), default=0
            )
        return known[name]

    return max(depth(start, frozenset()) for start in starts)


def object_size(program: Program) -> int:
    """Of the static objects in main that are the system."""
    table = quiet(["nm", "-S", "-C", str(BUILD / "programs" / program.name)]).splitlines()
    sizes = [
        int(row.split()[1], 16)
        for row in table
        if any(row.endswith(f" {kind} main::{name}") for name in program.objects for kind in "bBdD")
    ]
    if len(sizes) != len(program.objects):
        raise SystemExit(f"{program.name}: not all of {program.objects} are objects of main")
    return sum(sizes)


def instructions(program: Program, text: str) -> int:
    """Within all calls of the step."""
    out = BUILD / f"{program.name}.callgrind"
    command = ["valgrind", "--tool=callgrind", f"--toggle-collect={program.function}",
               f"--callgrind-out-file={out}", str(BUILD / "programs" / program.name)]  # fmt: skip
    subprocess.run(command, input=text, capture_output=True, text=True, check=True)
    totals = re.search(r"^(?:totals|summary): (\d+)", out.read_text(), re.MULTILINE)
    if totals is None or int(totals[1]) == 0:
        raise SystemExit(f"{program.name}: callgrind saw no call of {program.function}")
    return int(totals[1])


if __name__ == "__main__":
    main()
