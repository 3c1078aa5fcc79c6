"""Pseudoranges from CSV files: columns, systems, what is missing, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import surefix as sf
from raim.scenes import scene

GIVEN = scene(61, 4, systems=(2, 3)).pseudoranges
USUAL = ("t_s", "sat", "sat_x_m", "sat_y_m", "sat_z_m", "pr_corr_m")


def written(path: Path, header: tuple[str, ...] = USUAL, more: dict[str, list[str]] | None = None,
            names: list[str] | None = None) -> Path:  # fmt: skip
    extra = more or {}
    lines = [",".join([*header, *extra])]
    for i in range(len(GIVEN.time)):
        numbers = [*GIVEN.position[i].tolist(), float(GIVEN.pseudorange[i])]
        name = str(GIVEN.satellite[i]) if names is None else names[i]
        cells = [repr(float(GIVEN.time[i])), name, *map(repr, numbers)]
        lines.append(",".join([*cells, *(column[i] for column in extra.values())]))
    path.write_text("\n".join(lines) + "\n")
    return path


def test_all_digits_and_systems_by_letter(tmp_path: Path) -> None:
    """In order of time, to the last bit."""
    found = sf.raim.read_pseudoranges(written(tmp_path / "p.csv"), sigma=2.5)
    for name in ("time", "position", "pseudorange"):
        np.testing.assert_array_equal(getattr(found, name), getattr(GIVEN, name))
    assert found.satellite.tolist() == GIVEN.satellite.tolist()
    assert found.system.tolist() == GIVEN.system.tolist()
    assert (found.sigma == 2.5).all()
    assert found.epochs == 4


def test_other_columns(tmp_path: Path) -> None:
    header = ("when", "who", "x", "y", "z", "range")
    sigma = [repr(s) for s in GIVEN.sigma.tolist()]
    system = [str(i % 2) for i in range(len(sigma))]
    path = written(tmp_path / "p.csv", header, {"s": sigma, "clock": system})
    found = sf.raim.read_pseudoranges(
        path, time="when", satellite="who", position=("x", "y", "z"), pseudorange="range",
        sigma="s", system="clock",
    )  # fmt: skip
    np.testing.assert_array_equal(found.sigma, GIVEN.sigma)
    np.testing.assert_array_equal(found.pseudorange, GIVEN.pseudorange)
    assert found.system.tolist() == system


def test_one_system_where_names_say_nothing(tmp_path: Path) -> None:
    names = [f"sat-{i}" for i in range(len(GIVEN.time))]
    found = sf.raim.read_pseudoranges(written(tmp_path / "p.csv", names=names))
    assert len(set(found.system.tolist())) == 1


def test_empty_cells_are_not_numbers(tmp_path: Path) -> None:
    path = written(tmp_path / "p.csv")
    lines = path.read_text().splitlines()
    lines[3] = ",".join([*lines[3].split(",")[:-1], ""])
    path.write_text("\n".join(lines) + "\n")
    found = sf.raim.read_pseudoranges(path)
    assert np.isnan(found.pseudorange).nonzero()[0].tolist() == [2]


def test_refused(tmp_path: Path) -> None:
    path = written(tmp_path / "p.csv")
    with pytest.raises(sf.ConfigError, match=r"p\.csv.*pseudo"):
        sf.raim.read_pseudoranges(path, pseudorange="pseudo")
    with pytest.raises(sf.ConfigError, match="position: "):
        sf.raim.read_pseudoranges(path, position=("sat_x_m", "sat_y_m"))
    with pytest.raises(sf.ConfigError, match=r"sigma: .*-1"):
        sf.raim.read_pseudoranges(path, sigma=-1.0)
    with pytest.raises(sf.ConfigError, match="nowhere"):
        sf.raim.read_pseudoranges(tmp_path / "nowhere.csv")
    text = path.read_text()
    path.write_text(text.replace("\n0.0,", "\nnoon,", 1))
    with pytest.raises(sf.ConfigError, match=r"p\.csv.*t_s.*noon"):
        sf.raim.read_pseudoranges(path)
