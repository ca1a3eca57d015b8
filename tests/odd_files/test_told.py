"""What a file says of units, factors, marks and headers is used, or what is assumed is told.

Each file is invented, after the way a maker writes them, and holds the record of the others.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import mpi_hyst as mh
import numpy as np
import pandas as pd
import pytest
from mpi_hyst._cli.identify_records import Files, _assumed
from mpi_hyst._cli.inputs import assumed_of
from mpi_hyst._cli.options import Sampled
from mpi_hyst._cli.terminal import CommandError

from odd_files.mutations import judged
from odd_files.test_instruments import DOUBTFUL, RIGHT, N, T, U, Y, rows

NM = 1e3 * Y
BODY = rows(T, U, NM)
COUNTS = np.arange(N)


def each(*columns: list[str], separator: str = ";") -> str:
    return "".join(separator.join(row) + "\n" for row in zip(*columns, strict=True))


def thousands(column: Any, mark: str) -> list[str]:
    return [f"{round(value):,}".replace(",", mark) for value in column.tolist()]


def counted(mark: str, names: str = "t_ms;u_mV;y_nm") -> str:
    columns = (thousands(one, mark) for one in (COUNTS, 1e3 * U, NM))
    return f"{names}\n{each(*columns)}"


def two_blocks() -> str:
    """Two channels beside each other, each with its settings, as one maker writes them."""
    keys = {0: ("Source", "CH1", "CH2"), 1: ("Vertical Units", "V", "nm")}
    keys[2] = ("Horizontal Units", "s", "s")
    lines = []
    for k in range(N):
        key, one, two = keys.get(k, ("", "", ""))
        time = f"{T[k]:.4f}"
        lines.append(f"{key},{one},,{time},{U[k]:.5f},,{key},{two},,{time},{NM[k]:.5f},\n")
    return "".join(lines)


def stamped(first: str, second: str) -> str:
    stamps = [
        f"{first} 23:59:{50 + k / 10:06.3f}" if k < 100 else f"{second} 00:00:{k / 10 - 10:06.3f}"
        for k in range(N)
    ]
    lines = [line.split(",", 1)[1] for line in BODY.splitlines()]
    return "time,drive_v,gauge_nm\n" + each(stamps, lines, separator=",")


BESIDE = "".join(f",{line}\n" for line in rows(U, NM).splitlines())
NAMES = "time_s,drive_v,gauge\n"
REMARKS = "".join(f"# remark {k} of the day\n" for k in range(7))
RIGOL = "X,CH1,CH2,Start,Increment,,,\nSequence,Volt,Volt,-0.5,1.0e-02,,,\n"
# The text, what comes of it, the unit of the position, and words of what is doubtful.
TEXTS: dict[str, tuple[str, str, str, str]] = {
    # Units in words above the table.
    "a comment": (f"# Gauge in nm\n{NAMES}{BODY}", RIGHT, "nm", ""),
    "a key": (f"Gauge unit: nm\n{NAMES}{BODY}", RIGHT, "nm", ""),
    "an axis": (f"Y axis unit;nm\n{NAMES}{BODY}", DOUBTFUL, "", "holds 'nm'"),
    "prose": (f"It reads nanometers.\n{NAMES}{BODY}", DOUBTFUL, "", "holds 'nm'"),
    "a list": (f"# - {{name: y, unit: nm}}\n{NAMES}{BODY}", DOUBTFUL, "", "holds 'nm'"),
    "units of all": ("Unit;V;nm\ndrive;gauge\n" + rows(U, NM, separator=";"), RIGHT, "nm", ""),
    "a column of units": (
        "time_s,drive_v,gauge,unit\n" + "".join(f"{one},nm\n" for one in BODY.splitlines()),
        DOUBTFUL, "", "column unit holds 'nm'",
    ),
    "another unit": (
        f"# gauge in um\ntime_s,drive_v,gauge_nm\n{BODY}", DOUBTFUL, "nm", "beside its name is nm"
    ),
    "a range": (f"# Travel 100 um\ntime_s,drive_v,gauge_nm\n{BODY}", RIGHT, "nm", ""),
    "a conversion": (f"# 30 um = 10 V\n{NAMES}{BODY}", DOUBTFUL, "", "'30 um = 10 V'"),
    "units above settings": (
        f"s|V|V\n0.01|100\ntime|drive|gauge\n{BODY}".replace(",", "|"), DOUBTFUL, "", "holds 'V'"
    ),
    # Units of each channel in one row.
    "channels in a cell": (f"Vertical Units,CH1:V CH2:nm\nTime,CH1,CH2\n{BODY}", RIGHT, "nm", ""),
    "channels in cells": (
        f"Vertical Units,CH2:nm,CH1:V,CH3:A\nTime,CH1,CH2\n{BODY}", RIGHT, "nm", ""
    ),
    "channels of other names": (
        f"Vertical Units,CH1:V CH2:nm\nTime,a,b\n{BODY}", RIGHT, "nm", ""
    ),
    "channels that no column has": (
        f"Vertical Units,CH1:V CH2:mV CH3:mV CH4:nm\nTime,a,b\n{BODY}", DOUBTFUL, "", "called so"
    ),
    "channels and a row of units": (
        f"Vertical Units,CH1:V CH2:mV\nSource,CH1,CH2\nSecond,Volt,Volt\n{BODY}",
        DOUBTFUL, "V", "CH2 is in mV, and beside its name is Volt",
    ),
    # Names in comments.
    "names above remarks": (
        f"# time_s  drive_v  gauge_nm\n{REMARKS}" + rows(T, U, NM, separator=" "), RIGHT, "nm", ""
    ),
    "names behind a word": (
        "# columns: time_s drive_v gauge_nm\n" + rows(T, U, NM, separator=" "), RIGHT, "nm", ""
    ),
    "names and units": (
        "# time drive gauge\n# s V nm\n" + rows(T, U, NM, separator=" "), RIGHT, "nm", ""
    ),
    # Factors.
    "in parentheses": (f"time_s,drive_v,Gauge (x10 nm)\n{BODY}", RIGHT, "x10 nm", ""),
    "behind brackets": (f"time_s,drive_v,Gauge [nm] x20\n{BODY}", RIGHT, "nm x20", ""),
    "a part": (f"time_s,drive_v,Gauge [nm]/10\n{BODY}", RIGHT, "nm/10", ""),
    "behind a unit": (f"time_s,drive_v,Gauge (um*10)\n{BODY}", RIGHT, "um*10", ""),
    "without brackets": (f"time_s,drive_v,Gauge um x10\n{BODY}", DOUBTFUL, "", "factor 'x10'"),
    "an axis that is none": (f"time_s,drive_v,x1 (nm)\n{BODY}", RIGHT, "nm", ""),
    "a line of its own": (
        f"Scale factor: 10\ntime_s,drive_v,gauge_nm\n{BODY}", DOUBTFUL, "nm", "is not applied"
    ),
    "a factor of one": (f"Scale factor: 1\ntime_s,drive_v,gauge_nm\n{BODY}", RIGHT, "nm", ""),
    # Settings above the rows, which have no key.
    "an offset": (
        "Channel,Drive,Gauge\nUnit,V,nm\nOffset,5,0.5\n" + BESIDE, DOUBTFUL, "nm", "not applied"
    ),
    "an offset of zero": (
        "Channel,Drive,Gauge\nUnit,V,nm\nOffset,0,0\n" + BESIDE, RIGHT, "nm", ""
    ),
    "a gain": (
        "Channel,Drive,Gauge\nUnit,V,nm\nGain,1,10\n" + BESIDE, DOUBTFUL, "nm", "Gain 1, 10"
    ),
    "where a time begins": (
        '"TraceName","Drive","Gauge"\n"VUnit","V","nm"\n"HOffset",0,0\n' + BESIDE,
        RIGHT, "nm", "",
    ),
    # Headers.
    "a number, whole": (
        ",0.0,1.0,2.0\n" + each(list(map(str, COUNTS)), BODY.splitlines(), separator=","),
        DOUBTFUL, "", "no unit in '",
    ),
    "numbers that do not follow each other": (
        f"2,3,5\n{BODY}", DOUBTFUL, "", "line 1, 2, 3, 5: taken for a row"
    ),
    "a sheet": (RIGOL + rows(COUNTS, U, NM, end=",,,,,\n"), RIGHT, "V", ""),
    "settings of each channel": (two_blocks(), DOUBTFUL, "nm", "look like times"),
    "settings like rows": (
        "".join(f"Setting {k};value;{k}\n" for k in range(700))
        + "time_s;drive_v;gauge_nm\n" + rows(T, U, NM, separator=";"), RIGHT, "nm", ""
    ),
    "a row that is left out": (
        f"time_s,drive_v,gauge_nm\n#{BODY}", DOUBTFUL, "nm", "line 2 is a row behind the mark"
    ),
    "two headers": (f"time,drive,gauge\nsec.,Volt,Mikrom.\n{BODY}", DOUBTFUL, "", "lines 1 and 2"),
    "names of other names": (
        f"Channel 0,Channel 1,Channel 2\ntime_s,drive_v,gauge_nm\n{BODY}", RIGHT, "nm", ""
    ),
    "a mark in a name": (f'time_s\tdrive_v\tgauge-n"m\n{BODY}'.replace(",", "\t"),
                         DOUBTFUL, "", "a quotation mark in the name"),
    "no header": (BODY, DOUBTFUL, "", "no unit in '"),
    # Dates.
    "a month that may be a day": (
        stamped("03/04/2026", "04/04/2026"), DOUBTFUL, "nm", "dates as 03/04/2026"
    ),
    "a day that tells": (stamped("12/04/2026", "13/04/2026"), RIGHT, "nm", ""),
    "days with points": (stamped("03.04.2026", "04.04.2026"), RIGHT, "nm", ""),
    # Names that come again, and newton metres.
    "a unit again": (f"s,V,nm.1\n{BODY}", RIGHT, "nm", ""),
    "a moment": (f"time_s,drive_v,Gauge Nm\n{BODY}", RIGHT, "Nm", ""),
    # Channels in rows.
    "units behind names": (
        "".join(
            f"{name},{','.join(f'{one:.6g}' for one in column)}\n"
            for name, column in (("time,s", T), ("drive,V", U), ("gauge,nm", NM))
        ),
        RIGHT, "nm", "",
    ),
}  # fmt: skip


def told(record: mh.io.Columns, path: Path) -> list[str]:
    """Return what is doubtful of a record when it is identified by its last two columns."""
    own = [one for one in record.values if one != record.time_column][-2:]
    found = _assumed(record, Files((path,), own[0], own[1]), {})
    return [one.text for one in found if one.level == "doubtful"]


@pytest.mark.parametrize("kind", TEXTS)
def test_what_is_written_is_used_or_told(kind: str, tmp_path: Path) -> None:
    content, outcome, unit, words = TEXTS[kind]
    path = tmp_path / "record.csv"
    path.write_text(content, encoding="utf-8")
    record = mh.io.read(path)
    said = told(record, path)
    assert bool(said) == (outcome == DOUBTFUL), said
    assert not words or any(words in one for one in said), said
    name = [one for one in record.values if one != record.time_column][-1]
    assert record.quantity(name).suffix == unit
    kept = record[name][-100:]
    np.testing.assert_allclose(kept, NM[-100:], rtol=1e-4, atol=1e-2)


def test_a_header_of_numbers_is_told_when_units_are_given(tmp_path: Path) -> None:
    path = tmp_path / "record.csv"
    for header, columns in ((",3,5", (COUNTS, U, Y)), ("0,2", (0.01 * U, Y)), ("2,1", (Y, U))):
        path.write_text(f"{header}\n{rows(*columns)}", encoding="utf-8")
        record = mh.io.read(path, ["0", "1"] if len(columns) == 2 else ["1", "2"])
        drive, position = list(record.values)[:2]
        files = Files((path,), drive, position, input_unit="V", output_unit="um")
        said = [one.text for one in _assumed(record, files, {}) if one.level == "doubtful"]
        assert len(said) == 1 and "line 1, " in said[0] and "--skip-lines 1" in said[0]
    path.write_text("2\n" + rows(Y + 9.0), encoding="utf-8")
    with pytest.raises(CommandError, match=r"line 1, 2: taken for a row.*--skip-lines 1"):
        assumed_of(mh.io.read(path), "0", "um", None)


def test_settings_are_no_rows(tmp_path: Path) -> None:
    path = tmp_path / "record.csv"
    path.write_text(f"Channel,Drive,Gauge\nUnit,V,nm\nOffset,5,0.5\n{BESIDE}", "utf-8")
    assert mh.io.read(path).samples == N
    path.write_text(f"Time,drive_v,gauge_nm\nOffset,5,0.5\n{BODY}", "utf-8")
    said = told(mh.io.read(path, ["drive_v", "gauge_nm"], time=False), path)
    assert any("line 2: 'Offset' stands where the rows below have numbers" in one for one in said)


def test_a_first_row_that_goes_on_is_a_row(tmp_path: Path) -> None:
    path = tmp_path / "record.csv"
    path.write_text("".join(f"{0.25 * k:g},{3 + 0.5 * k:g}\n" for k in range(99)), "utf-8")
    record = mh.io.read(path)
    assert record.samples == 99
    assert not any("may be names" in one.text for one in record.assumed)


@pytest.mark.parametrize("mark", [".", ",", "'"])
def test_thousands_are_refused_until_somebody_says(mark: str, tmp_path: Path) -> None:
    path = tmp_path / "record.csv"
    path.write_text(counted(mark), encoding="utf-8")
    with pytest.raises(mh.io.ReadError, match=r"no separators of thousands; --thousands says"):
        mh.io.read(path, ["u_mV", "y_nm"])
    record = mh.io.read(path, thousands=mark)
    np.testing.assert_allclose(record["y_nm"], NM, atol=0.51)
    if mark == ".":
        assert mh.io.read(path, thousands="")["y_nm"].max() < 1000.0


def test_a_late_number_above_a_thousand_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "record.csv"
    early = "".join(f"{k};{k % 100};{k % 900}\n" for k in range(600))
    late = "".join(f"{600 + k};{k % 100};1.{k:03}\n" for k in range(100))
    path.write_text(f"t_ms;u_mV;y_nm\n{early}{late}", encoding="utf-8")
    with pytest.raises(mh.io.ReadError, match=r"line 602, column y_nm: .*--thousands"):
        mh.io.read(path)


def test_decimals_that_look_like_thousands_are_numbers(tmp_path: Path) -> None:
    path = tmp_path / "target.csv"
    path.write_text("target_um\n" + "".join(f"{9 + 0.06 * k:.3f}\n" for k in range(100)), "utf-8")
    assert mh.io.read(path)["target_um"].max() == pytest.approx(14.94)
    path.write_text("time_s;target_um\n0;1.250\n0.5;2\n1;3.125\n", encoding="utf-8")
    assert mh.io.read(path)["target_um"].tolist() == [1.25, 2.0, 3.125]


def test_both_marks_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "record.csv"
    path.write_text("u;y\n1,277;2.500\n1,300;2.600\n", encoding="utf-8")
    with pytest.raises(mh.io.ReadError, match=r"line 2: .* one of both marks parts thousands"):
        mh.io.read(path)


def test_lines_are_skipped(tmp_path: Path) -> None:
    path = tmp_path / "record.csv"
    table = "a;b;c\n" + "".join(f"{k};{k * k};{k % 7}\n" for k in range(30))
    path.write_text(f"{table}time_s;drive_v;gauge_nm\n" + rows(T, U, NM, separator=";"), "utf-8")
    with pytest.raises(mh.io.ReadError, match=r"another table may begin here: --skip-lines 31"):
        mh.io.read(path)
    record = mh.io.read(path, skip_lines=31)
    assert record.samples == N and record.units["gauge_nm"] == "nm"
    with pytest.raises(mh.io.ReadError, match=r"skip_lines: expected at least 0"):
        mh.io.read(path, skip_lines=-1)
    np.save(tmp_path / "a.npy", U)
    with pytest.raises(mh.io.ReadError, match=r"are said of texts, got NumPy array"):
        mh.io.read(tmp_path / "a.npy", skip_lines=1)


MUTATED = sorted((Path(__file__).parent / "files" / "mutated").iterdir())


@pytest.mark.parametrize("path", MUTATED, ids=lambda path: path.stem)
def test_files_that_were_read_wrongly(path: Path) -> None:
    assert not judged(path).startswith("wrong")


# Units that are known, and those that are not.


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("Gauge (in)", "inch"), ("Gauge [inch]", "inch"), ("Weg in Zoll", "inch"),
        ("gauge_inch", "inch"), ("Gauge (mils)", "mil"), ("Gauge, thou", "mil"), ("pos mil", "mil"),
        ("Gauge (мкм)", "um"), ("Gauge (нм)", "nm"),
    ],
)  # fmt: skip
def test_inches_and_others_are_units_of_their_own(name: str, unit: str, tmp_path: Path) -> None:
    path = tmp_path / "record.csv"
    path.write_text(f"time_s;drive_v;{name}\n" + rows(T, U, NM, separator=";"), encoding="utf-8")
    record = mh.io.read(path)
    assert record.quantity(name).suffix == unit and not told(record, path)


@pytest.mark.parametrize(
    "unit", ["Vpp", "n m", "nanom", "nmeter", "furlong", "дюйм", "mkm", "micromet."]
)
def test_a_unit_that_is_not_known_is_told(unit: str, tmp_path: Path) -> None:
    path = tmp_path / "record.csv"
    path.write_text(f"time_s,drive_v,Gauge ({unit})\n{BODY}", encoding="utf-8")
    record = mh.io.read(path)
    assert any(f"holds {unit!r}: um is assumed; --output-unit" in one for one in told(record, path))
    with pytest.raises(CommandError, match=r"no unit taken from .*: um is assumed; --unit"):
        assumed_of(record, f"Gauge ({unit})", "um", Sampled())


@pytest.mark.parametrize("remark", ["raw", "filtered", "CH1", "x", "monitor 2", "lowpass"])
def test_a_remark_in_parentheses_is_no_unit(remark: str, tmp_path: Path) -> None:
    path = tmp_path / "record.csv"
    path.write_text(f"time_s,drive_v,Gauge ({remark})\n{BODY}", encoding="utf-8")
    assert not told(mh.io.read(path), path)


# Files that are joined, and clocks.


@pytest.mark.parametrize(
    ("first", "second", "apart"),
    [
        ("Start: 2026-11-22 10:00:00.030\n", "Start: 2026-11-22 10:00:00.000\n", "30.00 ms"),
        (
            "Segment,TrigTime,Since\n#1,22-Nov-2026 10:00:00,0\n",
            "Segment,TrigTime,Since\n#1,22-Nov-2026 10:00:07,0\n", "7000 ms",
        ),
        ("Start: 2026-11-22 10:00:00.030\n", "Start: 2026-11-22 10:00:00.030\n", ""),
    ],
)  # fmt: skip
def test_joined_files_that_start_apart(first: str, second: str, apart: str, tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(f"{first}time_s,drive_v\n{rows(T, U)}", encoding="utf-8")
    (tmp_path / "b.csv").write_text(f"{second}time_s,gauge_um\n{rows(T, Y)}", encoding="utf-8")
    said = told(mh.io.read(tmp_path), tmp_path)
    assert len(said) == bool(apart)
    assert not apart or ("b.csv tells" in said[0] and f"{apart} apart" in said[0])


def test_clocks_that_are_apart_are_told_though_one_is_taken(tmp_path: Path) -> None:
    path = tmp_path / "record.csv"
    for shift, count in ((0.03, 1), (0.0, 0)):
        text = rows(T + shift, U, T, Y, form="{:.9g}")
        path.write_text(f"t_drive (s),drive_v,t_gauge (s),gauge_um\n{text}", encoding="utf-8")
        record = mh.io.read(path, ["drive_v", "gauge_um"], time="t_drive (s)")
        assert len(said := told(record, path)) == count
        assert not count or "are 30.00 ms apart" in said[0]
    path = tmp_path / "record.h5"
    with h5py.File(path, "w") as file:
        file["a/time_s"], file["a/drive_v"] = T + 0.03, U
        file["b/time_s"], file["b/gauge_um"] = T, Y
        file["c/time_s"] = 7.0 * T
    record = mh.io.read(path, ["a/drive_v", "b/gauge_um"], time="a/time_s")
    assert [one for one in told(record, path) if "b/time_s and a/time_s" in one]


# Arrays.


def test_units_of_arrays_are_used_or_told(tmp_path: Path) -> None:
    matrix, units = np.column_stack([T, U, NM]), np.array(["s", "V", "nm"])
    np.savez(tmp_path / "a.npz", rec=matrix, units=units)
    assert mh.io.read(tmp_path / "a.npz").units == {"rec:0": "s", "rec:1": "V", "rec:2": "nm"}
    np.savez(tmp_path / "a.npz", t=T, u=U, y=NM, y_unit="nm")
    assert mh.io.read(tmp_path / "a.npz").units["y"] == "nm"
    np.savez(tmp_path / "a.npz", t=T, u=U, y=NM, units=units)
    record = mh.io.read(tmp_path / "a.npz")
    assert "units holds 's', 'V', 'nm', and no unit is taken" in told(record, tmp_path)[0]
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        file.create_dataset("rec", data=matrix).attrs["units"] = ["s", "V", "nm"]
    assert mh.io.read(path).units == {"rec:0": "s", "rec:1": "V", "rec:2": "nm"}
    with h5py.File(path, "w") as file:
        file["t"], file["u"], file["y"], file["y_unit"] = T, U, NM, "nm"
        file.attrs["units"] = ["s", "V", "nm"]
    record = mh.io.read(path)
    assert record.units["y"] == "nm"
    assert "attribute of group / holds 's', 'V', 'nm'" in told(record, path)[0]


def test_masked_elements_of_a_list_are_refused() -> None:
    with pytest.raises(mh.io.ReadError, match=r"sample 1, column u: .*masked"):
        mh.io.read({"u": [0.0, np.ma.masked, 2.0]})


def test_a_real_index_that_grows_is_told() -> None:
    record = mh.io.read(pd.DataFrame({"u": U, "y": Y}, index=T), ["u", "y"])
    assert any("column index grows as a time does" in one.text for one in record.assumed)
