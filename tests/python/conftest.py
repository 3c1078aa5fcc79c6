"""What all tests share: one thread, Hypothesis profiles, and where the recordings are.

Profiles: ``dev`` (default), ``ci`` (the same examples every time; chosen where the environment
variable CI is set), ``thorough`` (``pytest --hypothesis-profile=thorough``), ``long``
(`./dev prove fuzz`).
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

# Before the first import of NumPy: small matrices gain nothing from threads, and tests on shared
# machines lose much.
for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

ROOT = Path(__file__).parents[2]

_unhurried = {
    "deadline": None,
    "suppress_health_check": [HealthCheck.too_slow, HealthCheck.data_too_large],
    "print_blob": True,
}
settings.register_profile("dev", max_examples=20, **_unhurried)  # type: ignore[arg-type]
settings.register_profile("ci", settings.get_profile("dev"), derandomize=True)
settings.register_profile("thorough", settings.get_profile("dev"), max_examples=1000)
settings.register_profile("long", settings.get_profile("dev"), max_examples=20_000)
settings.load_profile("ci" if os.environ.get("CI") else "dev")


@pytest.fixture(scope="session")
def recording() -> Callable[[str], Path]:
    """A file among the real recordings, as ``recording("car-kingston/speed.csv")``.

    They stand beside the repository in ``shared/data``, or where SUREFIX_DATA says; they are not
    part of it, and a test that asks for one that is absent is skipped.
    """
    folder = Path(os.environ.get("SUREFIX_DATA", ROOT.parent / "shared" / "data"))

    def find(name: str) -> Path:
        path = folder / name
        if not path.exists():
            pytest.skip(f"recording {name!r} is not in {folder}; set SUREFIX_DATA")
        return path

    return find
