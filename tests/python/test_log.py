"""Logs: from arrays, CSV and Parquet; what is wrong is named by file, line and column."""

from __future__ import annotations

import gzip
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import surefix as sf

ROWS = [(0.1, "wheel", 20.1), (0.25, "radar", 19.8), (0.1, "radar", 20.4), (0.4, "wheel", 20.0)]
TEXT = "time_s,sensor,value\n" + "".join(f"{t},{s},{z}\n" for t, s, z in ROWS)


def assert_rows(log: sf.Log, rows: list[tuple[float, str, float]]) -> None:
    assert log.time.tolist() == [row[0] for row in rows]
    assert log.sensor.tolist() == [row[1] for row in rows]
    np.testing.assert_array_equal(log.value, [row[2] for row in rows])


def write(folder: Path, content: str | bytes, name: str = "log.csv") -> Path:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def make_filter() -> sf.DesyncFilter:
    return sf.DesyncFilter(
        sf.ConstantAcceleration(0.3),
        [sf.Sensor("wheel", 0.5), sf.Sensor("radar", 0.2, latency=0.05)],
        [20.0, 0.0],
        np.eye(2),
        start=0.0,
    )


# From arrays.


def test_log_keeps_its_rows_in_order() -> None:
    log = sf.Log(*zip(*ROWS, strict=True))
    assert_rows(log, ROWS)
    assert len(log) == 4
    assert log.names == ("wheel", "radar")
    assert log.code.tolist() == [0, 1, 1, 0]
    assert log.codes_for(["radar", "gps"]).tolist() == [-1, 0, 0, -1]
    assert "4 measurements of wheel, radar" in repr(log)


def test_times_become_the_nearest_nanosecond() -> None:
    times = [0.1, 1.0000000004, -2.5, 1.7e9 + 0.123456, 3e9]
    log = sf.Log(times, ["w"] * 5, np.zeros(5))
    assert log.stamp.tolist() == [round(Fraction(t) * 10**9) for t in times]  # exact


@pytest.mark.parametrize("time", [np.nan, np.inf, -np.inf, 3.1e9, -1e300])
def test_time_that_is_no_time_is_kept_and_counted(time: float) -> None:
    log = sf.Log([0.1, time], ["wheel", "wheel"], [20.0, 99.0])
    assert len(log) == 2
    result = make_filter().run(log, times=[1.0])
    assert result.counts == {"ok": 1, "not_finite": 1}
    without = make_filter().run(sf.Log([0.1], ["wheel"], [20.0]), times=[1.0])
    assert np.array_equal(result.x, without.x)


def test_unsorted_log_gives_the_same_as_a_sorted_one() -> None:
    in_order = sorted(ROWS)
    one = make_filter().run(sf.Log(*zip(*ROWS, strict=True)), rate=5.0)
    other = make_filter().run(sf.Log(*zip(*in_order, strict=True)), rate=5.0)
    assert np.array_equal(one.x, other.x)
    assert np.array_equal(one.P, other.P)
    assert one.noise.tolist() == [other.noise[in_order.index(row)] for row in ROWS]


def test_unknown_sensors_are_counted() -> None:
    log = sf.Log([0.1, 0.2, 0.3], ["wheel", "gps", "odometer"], [20.0, 1.0, 2.0])
    assert make_filter().run(log, times=[1.0]).counts == {"ok": 1, "unknown_sensor": 2}


def test_log_of_unknown_sensors_only() -> None:
    log = sf.Log([0.1, 0.2], ["gps", "gps"], [1.0, 2.0])
    result = make_filter().run(log)
    assert result.counts == {"unknown_sensor": 2}
    assert result.x.shape == (0, 2)
    assert result.log_likelihood == 0.0
    with pytest.raises(sf.ConfigError, match="no row has a known sensor"):
        make_filter().run(log, rate=1.0)


BAD: dict[str, tuple[Callable[[], object], type[Exception], str]] = {
    "two lengths": (
        lambda: sf.Log([0.1, 0.2], ["a"], [1.0, 2.0]),
        sf.ShapeError,
        "one length, got 2, 1 and 2",
    ),
    "value too short": (
        lambda: sf.Log([0.1, 0.2], ["a", "a"], [1.0]),
        sf.ShapeError,
        "one length, got 2, 2 and 1",
    ),
    "empty": (lambda: sf.Log([], [], []), sf.ConfigError, "got an empty log"),
    "time a matrix": (
        lambda: sf.Log([[0.1]], ["a"], [1.0]),
        sf.ShapeError,
        r"log, time: expected shape \(any,\), got \(1, 1\)",
    ),
    "time of several lengths": (
        lambda: sf.Log([[0.1], [0.1, 0.2]], ["a"], [1.0]),
        sf.ConfigError,
        r"log, time: expected numbers, got \[\[0\.1\], \[0\.1, 0\.2\]\]",
    ),
    "timestamps a matrix": (
        lambda: sf.Log(np.array([["NaT"]], "M8[ns]"), ["a"], [1.0]),
        sf.ShapeError,
        r"log, time: expected shape \(any,\), got \(1, 1\)",
    ),
    "value of text": (
        lambda: sf.Log([0.1], ["a"], ["fast"]),
        sf.ConfigError,
        r"log, value: expected numbers, got \['fast'\]",
    ),
    "sensor one text": (lambda: sf.Log([0.1], "a", [1.0]), sf.ShapeError, "log.* sensor"),
    "sensor a matrix": (
        lambda: sf.Log([0.1, 0.2], [["a", "b"], ["c", "d"]], [1.0, 2.0]),  # type: ignore[list-item]
        sf.ShapeError,
        "log.* sensor",
    ),
    "sensor missing": (
        lambda: sf.Log([0.1, 0.2], np.array(["a", None], dtype=object), [1.0, 2.0]),
        sf.ConfigError,
        "log.* sensor",
    ),
}


@pytest.mark.parametrize(("make", "error", "message"), BAD.values(), ids=BAD.keys())
def test_bad_argument_is_named(
    make: Callable[[], object], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        make()


# From CSV.


@pytest.mark.parametrize(
    "content",
    [
        TEXT.encode(),
        TEXT.rstrip("\n").encode(),
        TEXT.replace("\n", "\r\n").encode(),
        b"\xef\xbb\xbf" + TEXT.encode(),
        b"\xef\xbb\xbf" + TEXT.replace("\n", "\r\n").encode(),
        TEXT.encode() + b"\n\n",
        TEXT.replace("time_s,sensor,value", " time_s , sensor,value ").encode(),
        TEXT.replace("wheel", '"wheel"').encode(),
        TEXT.replace("0.1,", " 1e-1 ,").encode(),
    ],
    ids=["plain", "no end", "CRLF", "BOM", "BOM CRLF", "blank", "spaces", "quoted", "numbers"],
)
def test_csv_of_every_hand(tmp_path: Path, content: bytes) -> None:
    assert_rows(sf.read_log(write(tmp_path, content)), ROWS)


def test_compressed_csv(tmp_path: Path) -> None:
    path = write(tmp_path, gzip.compress(TEXT.encode()), "log.csv.gz")
    assert_rows(sf.read_log(path), ROWS)
    assert_rows(sf.read_log(str(path)), ROWS)


def test_columns_in_any_order_under_any_name(tmp_path: Path) -> None:
    lines = "id,v,who,t\n" + "".join(f"{i},{z},{s},{t}\n" for i, (t, s, z) in enumerate(ROWS))
    path = write(tmp_path, lines)
    assert_rows(sf.read_log(path, time="t", sensor="who", value="v"), ROWS)


def test_empty_and_NaN_values_are_kept_and_counted(tmp_path: Path) -> None:
    path = write(tmp_path, TEXT + "0.5,wheel,\n0.5,radar,nan\n0.6,radar,inf\n,wheel,20.0\n")
    log = sf.read_log(path)
    assert len(log) == 8
    assert make_filter().run(log, times=[1.0]).counts == {"ok": 4, "not_finite": 4}


def test_wide_table_becomes_one_sensor_a_column(tmp_path: Path) -> None:
    text = "t,left,right,note\n0.1,20.1,,a\n0.2,20.2,19.9,b\n0.3,nan,19.8,c\n"
    log = sf.read_log(write(tmp_path, text), time="t", columns={"wheel": "left", "radar": "right"})
    expected = [
        (0.1, "wheel", 20.1),
        (0.2, "wheel", 20.2),
        (0.2, "radar", 19.9),
        (0.3, "wheel", np.nan),  # a reading, if one that cannot be used
        (0.3, "radar", 19.8),
    ]
    assert_rows(log, expected)


def test_wide_table_of_empty_cells_names_the_file(tmp_path: Path) -> None:
    path = write(tmp_path, "t,left\n0.1,\n0.2,\n")
    with pytest.raises(sf.ConfigError, match=r"log\.csv.*empty log"):
        sf.read_log(path, time="t", columns={"wheel": "left"})


MALFORMED = {
    "no number": (
        TEXT + "0.5,wheel,fast\n",
        r"log\.csv, line 6, column 'value': expected a number, got 'fast'",
    ),
    "no time": (
        TEXT + "noon,wheel,1\n",
        r"log\.csv, line 6, column 'time_s': expected a number, got 'noon'",
    ),
    "decimal comma": (TEXT + "0,5,wheel,1\n", r"log\.csv, line 6: expected 3 fields, got 4"),
    "cut line": (TEXT + "0.5,wh", r"log\.csv, line 6: expected 3 fields, got 2"),
    "after a blank line": (TEXT + "\n0.5,wheel,x\n", r"log\.csv, line 7, column 'value'"),
    "after a name of two lines": (
        TEXT + '0.5,"wh\neel",1.0\n0.6,wheel,x\n',
        r"log\.csv, line 8, column 'value'",
    ),
    "no column": ("time_s,sensor\n0.1,wheel\n", r"log\.csv, line 1: no column 'value'; it has"),
    "semicolons": (TEXT.replace(",", ";"), r"log\.csv, line 1: no column 'time_s'"),
    "underscores": (
        TEXT + "0.5,wheel,1_000\n",
        r"log\.csv, line 6, column 'value': expected a number, got '1_000'",
    ),
    "no sensor": (
        TEXT + "0.5, ,1.0\n",
        r"log\.csv, line 6, column 'sensor': expected a name, got ' '",
    ),
    "NUL in a name": (
        TEXT + "0.5,wh\0eel,1.0\n",
        r"log\.csv, line 6, column 'sensor': expected a name, got 'wh\\x00eel'",
    ),
    "NUL in a number": (
        TEXT + "0.5,wheel,1\0\n",
        r"log\.csv, line 6, column 'value': expected a number, got '1\\x00'",
    ),
    "no header": ("0.1,wheel,20.0\n", r"log\.csv, line 1: no column 'time_s'"),
    "header alone": ("time_s,sensor,value\n", r"log\.csv: .*got an empty log"),
    "nothing": ("", r"log\.csv: expected a header line, got an empty file"),
}


@pytest.mark.parametrize(("content", "message"), MALFORMED.values(), ids=MALFORMED.keys())
def test_malformed_csv_is_named_by_line_and_column(
    tmp_path: Path, content: str, message: str
) -> None:
    with pytest.raises(sf.ConfigError, match=message):
        sf.read_log(write(tmp_path, content))


COMPRESSED = gzip.compress((TEXT + "0.5,wheel,20.0\n" * 1000).encode())


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("log.csv", b"time_s,sensor,value\n0.1,wh\xe9\xe8l,1.0\n"),
        ("log.csv.gz", TEXT.encode()),
        ("log.csv.gz", COMPRESSED[:-20]),
        ("log.csv.gz", COMPRESSED[:30] + b"\xff\xff\xff\xff" + COMPRESSED[34:]),
        ("log.parquet", TEXT.encode()),
    ],
    ids=["not UTF-8", "not compressed", "cut", "broken", "no Parquet"],
)
def test_unreadable_file_is_named(tmp_path: Path, name: str, content: bytes) -> None:
    if name.endswith("parquet"):
        pytest.importorskip("pyarrow")
    path = write(tmp_path, content, name)
    with pytest.raises(sf.ConfigError, match=rf"{name}: not a readable"):
        sf.read_log(path)


@pytest.mark.parametrize("name", ["none.csv", "none.csv.gz", "none.parquet"])
def test_missing_file_is_named(tmp_path: Path, name: str) -> None:
    with pytest.raises(sf.ConfigError, match=name):
        sf.read_log(tmp_path / name)


def test_progress_reaches_the_end(tmp_path: Path) -> None:
    path = write(tmp_path, TEXT + "0.5,wheel,20.0\n" * 50_000)
    calls: list[tuple[int, int]] = []
    sf.read_log(path, progress=lambda done, total: calls.append((done, total)))
    size = path.stat().st_size
    assert len(calls) >= 3
    assert calls == sorted(calls)
    assert calls[-1] == (size, size)


# From Parquet.


def test_parquet_equals_csv(tmp_path: Path) -> None:
    pa = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    time, sensor, value = (list(column) for column in zip(*ROWS, strict=True))
    path = tmp_path / "log.parquet"
    for names in (pa.array(sensor), pa.array(sensor).dictionary_encode()):
        table = pa.table({"time_s": time, "sensor": names, "value": value, "note": sensor})
        parquet.write_table(table, path)
        assert_rows(sf.read_log(path), ROWS)
    with pytest.raises(sf.ConfigError, match=r"log\.parquet: no column 'speed'; it has"):
        sf.read_log(path, value="speed")


def test_missing_cells_of_parquet(tmp_path: Path) -> None:
    pa = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    path = tmp_path / "log.parquet"
    table = {"time_s": [0.1, 0.2], "sensor": ["wheel", "wheel"], "value": [20.0, None]}
    parquet.write_table(pa.table(table), path)
    assert make_filter().run(sf.read_log(path), times=[1.0]).counts == {"ok": 1, "not_finite": 1}
    wide = pa.table({"time_s": [0.1, 0.2], "left": [20.0, None]})
    parquet.write_table(wide, path)
    assert_rows(sf.read_log(path, columns={"wheel": "left"}), [(0.1, "wheel", 20.0)])


def parquet_of(folder: Path, **columns: object) -> Path:
    pa = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    path = folder / "log.parquet"
    parquet.write_table(pa.table(columns), path)
    return path


def test_wide_parquet_keeps_NaN_and_leaves_out_what_is_missing(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    path = parquet_of(tmp_path, time_s=[0.1, 0.2, 0.3], left=[20.0, None, np.nan], note=["a"] * 3)
    log = sf.read_log(path, columns={"wheel": "left"})
    assert_rows(log, [(0.1, "wheel", 20.0), (0.3, "wheel", np.nan)])


TIMES = ["2024-05-01T00:00:00.123456789", "2024-05-01T00:00:00.123456790", "NaT"]
STAMPS = [1714521600123456789, 1714521600123456790, np.iinfo(np.int64).min]


@pytest.mark.parametrize(("unit", "step"), [("ns", 1), ("us", 1000), ("s", 10**9)])
def test_timestamps_of_parquet_are_kept_to_the_nanosecond(
    tmp_path: Path, unit: str, step: int
) -> None:
    time = np.array(TIMES, dtype=f"M8[{unit}]")
    path = parquet_of(tmp_path, time_s=time, sensor=["wheel"] * 3, value=[20.0] * 3, left=[1.0] * 3)
    expected = [stamp // step * step for stamp in STAMPS[:2]]
    for log in (sf.read_log(path), sf.read_log(path, columns={"wheel": "left"})):
        assert log.stamp.tolist() == [*expected, STAMPS[2]]
        assert log.time[:2].tolist() == [stamp / 1e9 for stamp in expected]
        assert np.isnan(log.time[2])


def test_timestamps_of_arrays() -> None:
    log = sf.Log(np.array(TIMES, dtype="M8[ns]"), ["w"] * 3, [1.0] * 3)
    assert log.stamp.tolist() == STAMPS
    since = sf.Log(np.array([1500, -1, 2**62], dtype="m8[ms]"), ["w"] * 3, [1.0] * 3)
    assert since.stamp.tolist() == [1_500_000_000, -1_000_000, STAMPS[2]]
    assert since.time[:2].tolist() == [1.5, -0.001]


GOOD_COLUMNS: dict[str, list[object]] = {
    "time_s": [0.1, 0.2], "sensor": ["a", "b"], "value": [1.0, 2.0],
}  # fmt: skip


@pytest.mark.parametrize(
    ("changed", "columns", "message"),
    [
        ({"value": ["fast", "slow"]}, None, "column 'value': expected numbers, got string"),
        ({"value": ["fast", "slow"]}, {"w": "value"}, "column 'value': expected numbers, got str"),
        ({"value": [True, False]}, None, "column 'value': expected numbers, got bool"),
        ({"value": [[1.0], [2.0]]}, None, "column 'value': expected numbers, got list"),
        ({"value": np.array([1, 2], "M8[ns]")}, None, "column 'value': expected numbers, got time"),
        ({"time_s": ["now", "then"]}, None, "column 'time_s': expected seconds or timestamps, got"),
        ({"sensor": [1, 2]}, None, "column 'sensor': expected names, got int64"),
        ({"sensor": ["a", None]}, None, "row 2, column 'sensor': expected a name, got None"),
        ({"sensor": ["", "a"]}, None, "row 1, column 'sensor': expected a name, got ''"),
    ],
)
def test_columns_of_parquet_that_are_not_what_they_should(
    tmp_path: Path, changed: dict[str, object], columns: dict[str, str] | None, message: str
) -> None:
    path = parquet_of(tmp_path, **{**GOOD_COLUMNS, **changed})
    with pytest.raises(sf.ConfigError, match=rf"log\.parquet, {message}"):
        sf.read_log(path, columns=columns)


def test_whole_numbers_of_parquet(tmp_path: Path) -> None:
    path = parquet_of(tmp_path, **{**GOOD_COLUMNS, "value": [2**53 + 1, 3], "time_s": [1, 2]})
    assert_rows(sf.read_log(path), [(1.0, "a", 2.0**53), (2.0, "b", 3.0)])


def test_columns_of_a_log_are_copied_and_read_only() -> None:
    time, value = np.array([0.1, 0.2]), np.array([20.0, 21.0])
    log = sf.Log(time, ["wheel", "wheel"], value)
    time[:], value[:] = 99.0, 99.0
    assert_rows(log, [(0.1, "wheel", 20.0), (0.2, "wheel", 21.0)])
    for column in (log.time, log.value, log.stamp, log.code, log.codes_for(["wheel"])):
        with pytest.raises(ValueError, match="read-only"):
            column[0] = 0


# Recordings.


def test_long_recording_is_read(recording: Callable[[str], Path]) -> None:
    path = recording("car-comma2k19/speed_events.csv")
    log = sf.read_log(path, time="t_s", value="value_mps")
    assert {"wheel_fl", "wheel_fr", "wheel_rl", "wheel_rr"} <= set(log.names)
    assert len(log) == len(path.read_text().splitlines()) - 1
    assert np.isfinite(log.time).all()


def test_wide_recording_is_read(recording: Callable[[str], Path]) -> None:
    path = recording("car-kingston/speed.csv")
    log = sf.read_log(path, time="t_s", columns={"wheel": "obd_mps", "gnss": "reference_mps"})
    assert log.names == ("wheel", "gnss")
    assert len(log) == 2 * 12517
