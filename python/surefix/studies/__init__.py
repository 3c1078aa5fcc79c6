"""Studies: each repeats a headline result of a paper and says where it differs from it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from surefix.errors import ConfigError

Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Study:
    """``title``: what is repeated; ``module`` has ``run(out, progress) -> dict``."""

    title: str
    module: str


STUDIES = {
    "bilenne-table-2": Study(
        "Bilenne 2004, table 2: the estimates do not depend on the rate of estimation",
        "surefix.studies.bilenne_table_2",
    ),
    "bilenne-fig-1": Study(
        "Bilenne 2004, figure 1: a GPS that freezes in a tunnel, and an outlier",
        "surefix.studies.bilenne_fig_1",
    ),
    "bilenne-fig-2": Study(
        "Bilenne 2004, figure 2: three radars that fail at once",
        "surefix.studies.bilenne_fig_2",
    ),
    "sigalov-example-1": Study(
        "Sigalov & Oshman, example 1: interruptions that are a Markov chain",
        "surefix.studies.sigalov_example_1",
    ),
    "sigalov-example-2": Study(
        "Sigalov & Oshman, example 2: interruptions that are not Markov",
        "surefix.studies.sigalov_example_2",
    ),
    "parellier-ramp": Study(
        "Parellier 2023, figures 3 to 5: a ramp that begins at an unknown time",
        "surefix.studies.parellier_ramp",
    ),
    "parellier-sine": Study(
        "Parellier 2023, figures 6 and 7: a sinusoid of unknown frequency",
        "surefix.studies.parellier_sine",
    ),
    "lacresse-fig-2": Study(
        "Lacresse 2005, figure 2: a track taken for straight, under real satellites",
        "surefix.studies.lacresse_fig_2",
    ),
}


def run_study(name: str, out: str | Path, progress: Progress | None = None) -> dict[str, Any]:
    """Runs a study, writes its files into ``out`` and returns its numbers.

    ``report`` in them is the result as lines of text. ``progress`` is called with (done, total).
    """
    if name not in STUDIES:
        raise ConfigError(f"study: expected one of {', '.join(STUDIES)}, got {name!r}")
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    run: Callable[[Path, Progress], dict[str, Any]] = import_module(STUDIES[name].module).run
    return run(folder, progress or (lambda done, total: None))
