"""Any file: it is read, or refused by an error of surefix that names it. ``--hypothesis-profile
thorough``, or ``./dev prove fuzz``, looks longer."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import surefix as sf
from surefix.config import load_config
from surefix.config_raim import load_raim_config

ANY = settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)

NUMBERS = st.one_of(
    st.floats().map(repr),
    st.integers(-(10**30), 10**30).map(str),
    st.sampled_from(["", "nan", "inf", "-inf", "1e400", "0x10", "1_0", "１", " 1 ", '"1"', "1,5"]),
    st.text(max_size=5),
)


def lines(header: str, width: int) -> st.SearchStrategy[str]:
    """Tables of some rows under this header, now and then of the wrong width or another header."""
    rows = st.lists(st.lists(NUMBERS, min_size=width - 1, max_size=width + 1).map(",".join))
    usual = rows.map(lambda body: "\n".join([header, *body]))
    return st.one_of(usual, usual.map(lambda text: text.replace(",", ";", 3)), st.text())


def check(path: Path, content: str | bytes, read: Callable[[Path], object]) -> None:
    path.write_bytes(content if isinstance(content, bytes) else content.encode("utf-8", "replace"))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            read(path)
        except sf.SurefixError as error:
            message = str(error)
        else:
            return
    assert path.name in message


@ANY
@given(lines("time_s,sensor,value", 3))
def test_logs(tmp_path: Path, text: str) -> None:
    check(tmp_path / "log.csv", text, sf.read_log)


@ANY
@given(lines("time_s,wheel,radar", 3))
def test_wide_logs(tmp_path: Path, text: str) -> None:
    wide = {"wheel": "wheel", "radar": "radar"}
    check(tmp_path / "log.csv", text, lambda path: sf.read_log(path, columns=wide))


@ANY
@given(lines("time_s,sat,x_m,y_m,z_m,pseudorange_m,sigma_m", 7))
def test_pseudoranges(tmp_path: Path, text: str) -> None:
    check(tmp_path / "pseudoranges.csv", text, sf.raim.read_pseudoranges)


@ANY
@given(lines("latitude_deg,longitude_deg,height_m", 3))
def test_tracks(tmp_path: Path, text: str) -> None:
    check(tmp_path / "track.csv", text, sf.raim.read_track)


JSON = st.recursive(
    st.none() | st.booleans() | st.floats() | st.text(max_size=5) | st.integers(),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(st.sampled_from(["type", "geometry", "coordinates", "features"]), inner)
    ),
    max_leaves=12,
)


@ANY
@given(JSON)
def test_geojson_tracks(tmp_path: Path, value: object) -> None:
    text = repr(value).replace("'", '"').replace("None", "null").replace("True", "true")
    check(tmp_path / "track.geojson", text, sf.raim.read_track)


@ANY
@given(st.sampled_from(["log.csv", "log.csv.gz", "log.parquet"]), st.binary(max_size=200))
def test_bytes(tmp_path: Path, name: str, content: bytes) -> None:
    check(tmp_path / name, content, sf.read_log)


CONFIGS = [
    path.read_text(encoding="utf-8")
    for path in sorted((Path(__file__).parents[2] / "examples").glob("*/*.toml"))
]


@st.composite
def damaged(draw: st.DrawFn) -> str:
    """A configuration of an example with a line out, or one of its values changed."""
    rows = draw(st.sampled_from(CONFIGS)).splitlines()
    for _ in range(draw(st.integers(0, 3))):
        k = draw(st.integers(0, len(rows) - 1))
        key, equals, _ = rows[k].partition("=")
        value = draw(st.one_of(NUMBERS, st.sampled_from(["[]", "{}", "true", '""', "[1, 'a']"])))
        rows[k] = f"{key}={value}" if equals and draw(st.booleans()) else draw(NUMBERS)
    return "\n".join(rows)


@pytest.mark.parametrize("read", [load_config, load_raim_config])
@ANY
@given(text=st.one_of(damaged(), st.text()))
def test_configurations(tmp_path: Path, read: Callable[[Path], object], text: str) -> None:
    check(tmp_path / "config.toml", text, read)
