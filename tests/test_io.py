"""Odd text files: each is read rightly, or refused with its place and what was expected."""

from __future__ import annotations

import bz2
import gzip
import lzma
import re
from collections.abc import Callable
from pathlib import Path

import mpi_hyst as mh
import numpy as np
import pytest

T, U, Y = [0.0, 0.5, 1.0], [0.0, 10.0, 20.5], [-0.25, 1.5, 3.0]
PLAIN = "time_s,drive_v,pos_um\n0,0,-0.25\n0.5,10,1.5\n1,20.5,3\n"
COMMA = "time_s;drive_v;pos_um\n0,0;0,0;-0,25\n0,5;10,0;1,5\n1,0;20,5;3,0\n"
BARE = "0 0 -0.25\n0.5 10 1.5\n1 20.5 3\n"

# Text, and the columns that hold time, drive and position.
NAMED = ("time_s", "drive_v", "pos_um")
READ: dict[str, tuple[bytes, tuple[str, str, str]]] = {
    "plain": (PLAIN.encode(), NAMED),
    "tabs": (PLAIN.replace(",", "\t").encode(), NAMED),
    "vertical bars": (PLAIN.replace(",", " | ").encode(), NAMED),
    "semicolons": (PLAIN.replace(",", ";").encode(), NAMED),
    "spaces of any width": (PLAIN.replace(",", "   ").encode(), NAMED),
    "indented, spaces and tabs": (
        b"  " + PLAIN.replace(",", " \t").replace("\n", "\n  ").encode(), NAMED
    ),
    "spaces after commas": (PLAIN.replace(",", ", ").encode(), NAMED),
    "old line ends": (PLAIN.replace("\n", "\r").encode(), NAMED),
    "no last line end": (PLAIN.rstrip().encode(), NAMED),
    "decimal comma, semicolons": (COMMA.encode(), NAMED),
    "three decimals behind a comma": (
        b"time_s;drive_v;pos_um\n0;0;-0,250\n0,500;10;1,500\n1;20,500;3\n", NAMED
    ),
    "decimal comma, tabs": (COMMA.replace(";", "\t").encode(), NAMED),
    "decimal comma, spaces": (COMMA.replace(";", "  ").encode(), NAMED),
    "double precision of Fortran": (re.sub(r"(?m)(\d)(,|$)", r"\1D+00\2", PLAIN).encode(), NAMED),
    "byte order mark": (PLAIN.encode("utf-8-sig"), NAMED),
    "UTF-16": (PLAIN.encode("utf-16"), NAMED),
    "UTF-16, big end first, no mark": (PLAIN.encode("utf-16-be"), NAMED),
    "UTF-16, no mark, a micro": (
        PLAIN.replace("pos_um", "pos [µm]").encode("utf-16-le"), ("time_s", "drive_v", "pos [µm]")
    ),
    "Latin-1": (PLAIN.replace("pos_um", "Länge").encode("latin-1"), ("time_s", "drive_v", "Länge")),
    "gzip": (gzip.compress(PLAIN.encode()), NAMED),
    "bzip2": (bz2.compress(COMMA.encode()), NAMED),
    "xz": (lzma.compress(PLAIN.encode()), NAMED),
    "no header": (BARE.encode(), ("0", "1", "2")),
    "no header, commas": (BARE.replace(" ", ",").encode(), ("0", "1", "2")),
    "hash comments": (f"# made by hand\n#\n{PLAIN}# the end\n".encode(), NAMED),
    "percent comments": (f"% made by hand\n{PLAIN}% the end\n".encode(), NAMED),
    "slash comments": (f"// made by hand\n{PLAIN}  // the end\n".encode(), NAMED),
    "semicolon comments": (f"; made, by, hand\n{PLAIN}; the end\n".encode(), NAMED),
    "header in a comment": (f"# rig 3\n# time_s drive_v pos_um\n{BARE}".encode(), NAMED),
    "commented header with a separator": (f"#{PLAIN}".encode(), NAMED),
    "preamble": (
        f"Scope,X200\nSerial,1234,7\n\nRate,2,Hz\nModel: a, b\n{PLAIN}".encode(), NAMED
    ),
    "preamble of two columns": (
        f"Operator;Meier\nRate;2\nGain;1,5\n\n{COMMA}".encode(), NAMED
    ),
    "preamble, no header": (
        f"a long story of\nonly two long lines\n\n{BARE}".encode(), ("0", "1", "2")
    ),
    "header with spaces in its names": (
        f"Time (s)   Drive (V)   Gauge (um)\n{BARE}".encode(),
        ("Time (s)", "Drive (V)", "Gauge (um)"),
    ),
    "empty columns at line ends": (PLAIN.replace("\n", ",,\n").encode(), NAMED),
    "separator at line ends of the data": (
        PLAIN.replace("\n", ",\n").replace("um,\n", "um\n").encode(), NAMED
    ),
    "quoted numbers and names": (
        b'"time_s","drive_v","pos_um"\n"0","0","-0.25"\n"0.5","10","1.5"\n"1","20.5","3"\n', NAMED
    ),
    "quoted decimal comma": (
        b'time_s;drive_v;pos_um\n"0";"0";"-0,25"\n"0,5";"10";"1,5"\n"1";"20,5";"3"\n', NAMED
    ),
    "text column in front": (
        b"when,time_s,drive_v,pos_um\n12:01,0,0,-0.25\n12:02,0.5,10,1.5\n12:03,1,20.5,3\n", NAMED
    ),
    "index column without a name": (
        b",time_s,drive_v,pos_um\n0,0,0,-0.25\n1,0.5,10,1.5\n2,1,20.5,3\n", NAMED
    ),
    "units row": (PLAIN.replace("\n0,0", "\ns,V,um\n0,0", 1).encode(), NAMED),
    "units row in brackets": (PLAIN.replace("\n0,0", "\n[s],[V],[µm]\n0,0", 1).encode(), NAMED),
    "units row and comments row": (
        PLAIN.replace("\n0,0", "\ns,V,um\nclock,dac,gauge\n0,0", 1).encode(), NAMED
    ),
    "blank lines": (PLAIN.replace("\n", "\n\n").encode(), NAMED),
    "exponents and signs": (
        b"time_s,drive_v,pos_um\n0e0,+0,-2.5E-1\n5e-1,1e1,+1.5\n1E+00,2.05e1,3.\n", NAMED
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", READ)
def test_odd_text_is_read(tmp_path: Path, kind: str) -> None:
    content, names = READ[kind]
    path = tmp_path / "record.csv"
    path.write_bytes(content)
    record = mh.io.read(path, names[1:], time=names[0])
    for name, expected in zip(names, (T, U, Y), strict=True):
        np.testing.assert_array_equal(record[name], expected)
    # Without a choice all columns of numbers are read, and the name of the file says nothing.
    other = path.rename(tmp_path / "record.mat")
    everything = mh.io.read(other)
    assert set(names) <= set(everything.values) and everything.format.startswith("text")


REFUSED: dict[str, tuple[bytes, str]] = {
    "empty": (b"", "empty file, expected a header"),
    "blank": (b"\n \n\t\n", "empty file, expected a header"),
    "header alone": (b"time_s,drive_v,pos_um\n", "no rows after the header"),
    "short row": (PLAIN.replace("0.5,10,1.5", "0.5,10").encode(),
                  "line 3: expected 3 cells as in the header, line 1, got 2"),
    "long row": (PLAIN.replace("0.5,10", "0.5,10,7").encode(), "line 3: expected 3 cells .* got 4"),
    "ragged first row without header": (b"0 0\n0.5 10 1.5\n1 20.5 3\n",
                                        "line 1: expected 3 cells as in the rows before|no column"),
    "missing value": (PLAIN.replace("0.5,10,", "0.5,,").encode(),
                      "line 3, column drive_v: empty cell"),
    "missing value in words": (PLAIN.replace("0.5,10", "0.5,NA").encode(),
                               "line 3, column drive_v: not a number: 'NA'"),
    "not a number": (PLAIN.replace("0.5,10", "0.5,nan").encode(), "line 3, .* not finite: nan"),
    "text in a column": (PLAIN.replace("0.5,10", "0.5,high").encode(),
                         "line 3, column drive_v: not a number: 'high'"),
    "text in the first row": (PLAIN.replace("0,0,", "0,start,", 1).encode(),
                              "line 2, column drive_v: not a number: 'start'"),
    "comma in a file of points": (PLAIN.replace(",10,", ',"1,5",').encode(),
                                  "line 3, column drive_v: .*'1,5' .expected a decimal point"),
    "point in a file of commas": (COMMA.replace(";10,0;", ";10.0;").encode(),
                                  "line 3, column drive_v: .*'10.0' .expected a decimal comma"),
    "thousands, commas": (PLAIN.replace(",10,", ',"1,234.5",').encode(),
                          "line 3, column drive_v: .*expected no separators of thousands"),
    "thousands, points": (COMMA.replace(";10,0;", ";1.234,5;").encode(),
                          "line 3, column drive_v: .*expected no separators of thousands"),
    "thousands in whole numbers": (b"time_s;drive_v;pos_um\n0;900;1\n1;1,000;2\n2;1,100;3\n",
                                   "line 3, column drive_v: .*no separators of thousands"),
    "thousands beside missing cells": (
        b"time_s;drive_v;pos_um\n0;900;1\n1;1,000;2\n2;1,100;3\n3;nan;4\n4;-;5\n5;off;6\n",
        "line 3, column drive_v: .*no separators of thousands",
    ),
    "thousands everywhere": (b"time_s;drive_v;pos_um\n0;1,000.5;1\n1;2,000.5;2\n2;3,000.5;3\n",
                             "line 2, column drive_v: .*expected no separators of thousands"),
    "thousands, spaces": (COMMA.replace(";10,0;", ";1 234,5;").encode(),
                          "line 3, column drive_v: .*expected no separators of thousands"),
    "two columns of one name": (PLAIN.replace("pos_um", "drive_v").encode(),
                                "2 columns are named 'drive_v'; take one by number: 1, 2"),
    "decimal comma between commas": (b"drive_v,pos_um\n0,5,1,5\n1,5,2,5\n",
                                     "expected 2 cells as in the header, line 1, got 4"),
    "one column with decimal comma": (b"drive_v\n0,5\n1,5\n",
                                      "expected 1 cells as in the header, line 1, got 2"),
    "time runs back": (PLAIN.replace("\n1,", "\n0.25,").encode(),
                       "line 4, column time_s: time does not increase: 0.25 after 0.5"),
    "prose": (b"Dear reader,\nthere is nothing here.\n", "no column 'drive_v'|no rows"),
    "cut gzip": (gzip.compress(PLAIN.encode() * 9)[:-20], "cannot be unpacked"),
    "wrong gzip": (b"\x1f\x8bnothing of that kind", "cannot be unpacked"),
    "NumPy in gzip": (gzip.compress(b"\x93NUMPY" + bytes(99)), "got NumPy array: unpack it first"),
    "bytes": (bytes(range(256)) * 4, "neither text nor a known format; the name says text"),
    "half a UTF-16": (PLAIN.encode("utf-16")[:-1], "not utf-16 text"),
}  # fmt: skip


@pytest.mark.parametrize("kind", REFUSED)
def test_wrong_text_is_refused_with_its_place(tmp_path: Path, kind: str) -> None:
    content, said = REFUSED[kind]
    path = tmp_path / "record.csv"
    path.write_bytes(content)
    with pytest.raises(mh.io.ReadError, match=said) as caught:
        mh.io.read(path, ["drive_v"], time=None if b"time_s" not in content else "time_s")
    assert str(caught.value).startswith(str(path))


def test_an_unread_column_may_hold_anything(tmp_path: Path) -> None:
    path = tmp_path / "record.csv"
    path.write_text("t_ms,note,u\n0,a,1\n1,,2\n2,3,nan\n", encoding="utf-8")
    np.testing.assert_array_equal(mh.io.read(path, ["t_ms"])["t_ms"], [0, 1, 2])
    with pytest.raises(mh.io.ReadError, match="line 4, column u: not finite"):
        mh.io.read(path)
    assert mh.io.read(path, rows=2).samples == 2
    with pytest.raises(mh.io.ReadError, match="rows: expected at least 1, got 0"):
        mh.io.read(path, rows=0)


@pytest.mark.parametrize(
    ("header", "unit_row", "unit", "dt"),
    [
        ("time_ms,u", "", "ms", 2e-3),
        ("t [ms],u", "", "ms", 2e-3),
        ("Time (us),u", "", "us", 2e-6),
        ("Time (µs),u", "", "us", 2e-6),
        ("t / ms,u", "", "ms", 2e-3),
        ("time_min,u", "", "min", 120.0),
        ("Time,u", "ms,V\n", "ms", 2e-3),
        ("Zeit,u", "Sekunden,V\n", "s", 2.0),
        ("time,u", "", "", 2.0),
        ("Timestamp,u", "(ns),(V)\n", "ns", 2e-9),
    ],
)
def test_the_time_is_in_seconds(
    tmp_path: Path, header: str, unit_row: str, unit: str, dt: float
) -> None:
    path = tmp_path / "record.csv"
    path.write_text(f"{header}\n{unit_row}0,1\n2,3\n4,4\n", encoding="utf-8")
    record = mh.io.read(path)
    assert record.time_column == header.partition(",")[0]
    assert record.units.get(record.time_column, "") == unit
    assert record.sample_time == pytest.approx(dt)


STAMPS = {
    "ISO": ["2026-03-01T23:59:59.5", "2026-03-02T00:00:00", "2026-03-02T00:00:00.5"],
    "ISO with zones": [
        "2026-03-01 23:59:59.5Z",
        "2026-03-02 01:00:00+01:00",
        "2026-03-02 00:00:00.5Z",
    ],
    "day first": ["01.03.2026 23:59:59.500", "02.03.2026 00:00:00.000", "02.03.2026 00:00:00.500"],
    "month first": ["3/1/2026 11:59:59.5 PM", "3/2/2026 12:00:00 AM", "3/2/2026 12:00:00.5 AM"],
    "days above twelve": ["27/3/2026 23:59:59.5", "28/3/2026 0:00:00", "28/3/2026 0:00:00.5"],
    "months in words": [
        "31-Dec-2026 23:59:59.5",
        "01-Jan-2027 00:00:00",
        "2027-Jan-01 00:00:00.5",
    ],
    "past midnight": ["23:59:59.5", "00:00:00.0", "00:00:00.5"],
    "minutes, past the hour": ["59:59.5", "00:00.0", "00:00.5"],
}


@pytest.mark.parametrize("form", STAMPS)
def test_dates_are_seconds_since_the_first_row(tmp_path: Path, form: str) -> None:
    path = tmp_path / "record.csv"
    rows = "".join(f"{stamp},{value}\n" for value, stamp in enumerate(STAMPS[form]))
    path.write_text(f"Timestamp,u\n{rows}", encoding="utf-8")
    record = mh.io.read(path)
    assert record.time_column == "Timestamp" and record.units["Timestamp"] == "s"
    np.testing.assert_allclose(record["Timestamp"], [0.0, 0.5, 1.0], rtol=0.0, atol=1e-9)
    assert mh.io.read(path, ["u"], time=False).time_column is None


def test_a_date_that_is_none_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "record.csv"
    stamps = [f"2026-03-01T00:00:{second:02d}" for second in range(40)]
    stamps[30] = "2026-02-30T00:00:30"
    path.write_text("time,u\n" + "".join(f"{one},1\n" for one in stamps), encoding="utf-8")
    with pytest.raises(mh.io.ReadError, match="line 32, column time: not a number") as caught:
        mh.io.read(path)
    assert caught.value.rows == 30
    assert mh.io.read(path, rows=30).samples == 30


def test_units_of_the_file_go_before_those_of_names(tmp_path: Path) -> None:
    path = tmp_path / "record.csv"
    path.write_text("drive,gauge_raw,x_um\nkV,counts,nm\n0,1,2\n1,2,3\n", encoding="utf-8")
    record = mh.io.read(path)
    assert record.units == {"drive": "kV", "gauge_raw": "counts", "x_um": "nm"}
    labels = ["drive (kV)", "gauge raw (counts)", "x (nm)"]
    assert [record.quantity(n).label for n in record.names] == labels
    # A minimum is no duration.
    path.write_text("position_min,gauge\n1,4\n2,3\n", encoding="utf-8")
    record = mh.io.read(path)
    assert record.units == {} and record.time_column is None


@pytest.mark.parametrize("wanted", ["1", 1, "drive_v"])
def test_columns_have_numbers_too(tmp_path: Path, wanted: str | int) -> None:
    path = tmp_path / "record.csv"
    path.write_text(PLAIN, encoding="utf-8")
    record = mh.io.read(path, wanted)
    np.testing.assert_array_equal(record[wanted], U)
    assert list(record.values) == ["drive_v", "time_s"]
    for missing in (3, -1, "3", "x"):
        with pytest.raises(mh.io.ReadError, match=r"no column .*time_s, drive_v, pos_um"):
            mh.io.read(path, [missing])


def test_a_column_of_a_double_name_is_read_by_number(tmp_path: Path) -> None:
    path = tmp_path / "record.csv"
    path.write_text(PLAIN.replace("pos_um", "drive_v"), encoding="utf-8")
    record = mh.io.read(path, [2])
    np.testing.assert_array_equal(record[2], Y)
    with pytest.raises(mh.io.ReadError, match="2 columns are named"):
        mh.io.read(path)


@pytest.mark.parametrize("pack", [gzip.compress, bytes])
def test_a_long_file_is_read_whole(tmp_path: Path, pack: Callable[[bytes], bytes]) -> None:
    rows = "".join(f"{k},{k * 0.5}\n" for k in range(5000))
    path = tmp_path / "long.csv"
    path.write_bytes(pack(f"time_s,u\n{rows}".encode()))
    np.testing.assert_array_equal(mh.io.read(path)["u"], 0.5 * np.arange(5000))
    path.write_bytes(pack(f"time_s,u\n{rows}x,1\n".encode()))
    with pytest.raises(mh.io.ReadError, match="line 5002, column time_s: not a number: 'x'"):
        mh.io.read(path)


def test_a_preamble_may_be_longer_than_the_table(tmp_path: Path) -> None:
    path = tmp_path / "record.csv"
    settings = "".join(f"Setting {k},{k}\n" for k in range(20))
    rows = "".join(f"{k},{k * 0.5},{k + 1}\n" for k in range(18))
    path.write_text(f"{settings}time_s,u,y\n{rows}", encoding="utf-8")
    record = mh.io.read(path)
    assert record.names == ("time_s", "u", "y")
    np.testing.assert_array_equal(record["u"], 0.5 * np.arange(18))
