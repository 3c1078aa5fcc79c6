"""What ``import surefix`` brings with it."""

from __future__ import annotations

import re
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import surefix as sf

ROOT = Path(__file__).parents[2]

MODULES = """
import sys
before = set(sys.modules)
import surefix
print(*sorted({name.partition(".")[0] for name in set(sys.modules) - before}))
"""


def test_import_needs_numpy_and_the_standard_library_alone() -> None:
    """No pandas, pyarrow, matplotlib, SciPy, typer or rich: they are extras."""
    run = subprocess.run(
        [sys.executable, "-W", "error", "-c", MODULES], capture_output=True, text=True, check=True
    )
    foreign = set(run.stdout.split()) - sys.stdlib_module_names
    assert foreign == {"surefix", "numpy"}
    assert run.stderr == ""


def test_version_is_that_of_the_distribution() -> None:
    assert sf.__version__ == version("surefix")


def test_version_is_that_of_the_sources() -> None:
    text = (ROOT / "CMakeLists.txt").read_text()
    found = re.search(r"project\(surefix VERSION ([0-9.]+)", text)
    assert found is not None
    assert sf.__version__ == found[1]


def test_public_names_exist() -> None:
    assert len(set(sf.__all__)) == len(sf.__all__)
    for name in sf.__all__:
        assert hasattr(sf, name), name


def test_every_error_is_a_surefix_error() -> None:
    for error, base in (
        (sf.ShapeError, ValueError),
        (sf.ConfigError, ValueError),
        (sf.NumericalError, ArithmeticError),
    ):
        assert issubclass(error, sf.SurefixError)
        assert issubclass(error, base)


def test_types_are_shipped() -> None:
    assert sf.__file__ is not None
    folder = Path(sf.__file__).parent
    assert (folder / "py.typed").exists()
    assert (folder / "_core.pyi").exists()
