"""Clocks and units of channels, files that belong together, workbooks: what is assumed is told."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import mpi_hyst as mh
import numpy as np
import openpyxl
import pytest
from commands import run
from nptdms import ChannelObject, TdmsWriter

from odd_files.test_instruments import N, T, U, Y, rows

BEGAN = np.datetime64("2026-01-01T10:00:00.000000")
Channel = tuple[str, Any, Mapping[str, Any]]


def clock(late: float | None = 0.0, step: float = 0.01, unit: str = "V") -> dict[str, Any]:
    told = {"wf_increment": step, "unit_string": unit}
    start = {} if late is None else {"wf_start_time": BEGAN + np.timedelta64(int(1e3 * late), "ms")}
    return {**told, **start}


def written(place: Path, *channels: Channel) -> Path:
    path = place / "record.tdms"
    with TdmsWriter(str(path)) as file:
        file.write_segment(
            [ChannelObject(*name.split("/"), column, told) for name, column, told in channels]
        )
    return path


def doubts(record: mh.io.Columns) -> list[str]:
    return [one.text for one in record.assumed if one.level == "doubtful"]


def test_a_channel_without_a_start_is_told(tmp_path: Path) -> None:
    path = written(tmp_path, ("R/Amp", U, clock(None)), ("R/Gauge", Y, clock(unit="um")))
    assert "R/Amp: no start time in the file, unlike R/Gauge" in doubts(mh.io.read(path))[0]


def test_rows_that_are_left_out_behind_are_told(tmp_path: Path) -> None:
    path = written(tmp_path, ("R/Amp", U, clock(0.02)), ("R/Gauge", Y, clock(unit="um")))
    record = mh.io.read(path)
    assert record.samples == N - 2
    said = "the first 2 rows of R/Gauge are left out, and the last 2 of R/Amp"
    assert any(said in one.text for one in record.assumed)
    assert said in run("look", str(path)).stdout.partition("assumed\n")[2]


def test_why_a_channel_is_not_read_is_told(tmp_path: Path) -> None:
    slow = ("R/Temp", Y[::2], clock(step=0.02, unit="degC"))
    path = written(tmp_path, ("R/Amp", U, clock()), ("R/Gauge", Y, clock(unit="um")), slow)
    shown = run("look", str(path)).stdout
    assert "R/Temp (68 rows, every 0.02000 s; the others: every 0.01000 s)" in shown


def test_clocks_of_two_groups_are_told(tmp_path: Path) -> None:
    one = [("run1/time_s", T, {}), ("run1/u", U, {"unit_string": "V"})]
    two = [("run2/time_s", T, {}), ("run2/y", Y, {"unit_string": "um"})]
    record = mh.io.read(written(tmp_path, *one, *two), ["run1/u", "run2/y"])
    assert record.time_column is None
    assert "run1/time_s, run2/time_s look like times, and none is used" in doubts(record)[0]


HEADER = (
    "LabVIEW Measurement\t\nWriter_Version\t2\nReader_Version\t2\nSeparator\tTab\n"
    "Decimal_Separator\t.\nMulti_Headings\tYes\nX_Columns\tOne\nTime_Pref\tAbsolute\n"
    "Operator\tx\nDate\t2026/01/01\nTime\t10:00:00\n***End_of_Header***\t\n\t\n"
)


def segment(part: slice, unit: str, factor: float = 1.0) -> str:
    count = T[part].size
    head = (
        f"Channels\t2\t\t\nSamples\t{count}\t{count}\t\nDate\t2026/01/01\t2026/01/01\t\n"
        f"Time\t10:00:00\t10:00:00\t\nY_Unit_Label\tVolts\t{unit}\t\nX_Dimension\tTime\tTime\t\n"
        "X0\t0\t0\t\nDelta_X\t0.01\t0.01\t\n***End_of_Header***\t\t\t\n"
        "X_Value\tAmp\tGauge\tComment\n"
    )
    body = rows(T[part], U[part], factor * Y[part], separator="\t", end="\t\n")
    return f"{head}{body}\n"


def test_units_of_segments_are_compared(tmp_path: Path) -> None:
    path, first, second = tmp_path / "record.lvm", slice(0, 60), slice(60, None)
    path.write_text(HEADER + segment(first, "um") + segment(second, "nm", 1e3), encoding="utf-8")
    with pytest.raises(mh.io.ReadError, match=r"segment 1, channel Gauge: expected um .* got nm"):
        mh.io.read(path)
    path.write_text(HEADER + segment(first, "um") + segment(second, ""), encoding="utf-8")
    assert "Gauge has no unit in segment 1" in doubts(mh.io.read(path))[0]


def table(path: Path, gauge: str, factor: float = 1.0) -> str:
    path.write_text(f"time_s,drive_v,{gauge}\n" + rows(T, U, factor * Y), encoding="utf-8")
    return str(path)


def test_a_unit_that_one_of_two_files_states_is_told(tmp_path: Path) -> None:
    columns = ("--input", "drive_v", "--output", "2", "--operators", "4", "--dynamics", "none")
    fit, other = table(tmp_path / "a.csv", "gauge [um]"), table(tmp_path / "b.csv", "gauge", 1.001)
    for words in ((fit, "--validate", other), (other, "--validate", fit), (fit, other)):
        result = run("identify", *words, *columns)
        assert result.exit_code == 0, result.output
        assert result.stdout.startswith("verdict: amber (assumed"), result.output
        assert "taken to be the same; --output-unit" in result.stdout
    assert (
        "taken to be the same"
        not in run("identify", fit, "--validate", other, *columns, "--output-unit", "um").output
    )
    nm = table(tmp_path / "c.csv", "gauge [nm]", 1e3)
    result = run("identify", fit, "--validate", nm, *columns, "--output-unit", "um")
    assert result.exit_code == 2 and "expected um as before, got nm" in result.output


def test_a_note_in_a_directory_is_left_out(tmp_path: Path) -> None:
    place = tmp_path / "scope"
    place.mkdir()
    for name, column in (("drive_v", U), ("gauge_um", Y)):
        (place / f"{name}.txt").write_text(f"{name}\n" + rows(column), encoding="utf-8")
    (place / "note.txt").write_text("Measured by AB\non the new rig.\n", encoding="utf-8")
    record = mh.io.read(place)
    assert record.names == ("drive_v", "gauge_um")
    assert any("note.txt: left out" in one.text for one in record.assumed)


def test_files_of_one_record_are_told_how_to_join(tmp_path: Path) -> None:
    paths = []
    for name, column in (("drive_v", U), ("gauge_um", Y)):
        paths.append(str(tmp_path / f"{name}.txt"))
        Path(paths[-1]).write_text(f"{name}\n" + rows(column), encoding="utf-8")
    joined = "+".join(paths)
    result = run("look", *paths)
    assert result.exit_code == 2 and f"files of one record: {joined}" in result.output
    result = run("identify", *paths, "--input", "drive_v", "--output", "gauge_um")
    assert result.exit_code == 2 and joined in result.output
    assert run("look", joined).exit_code == 0


def test_formulas_without_values_are_told(tmp_path: Path) -> None:
    book = openpyxl.Workbook()
    sheet = book.active
    assert sheet is not None
    sheet.append(["time_s", "drive_v", "gauge_um"])
    for k in range(N):
        sheet.append([float(T[k]), float(U[k]), f"=B{k + 2}*0.1"])
    path = tmp_path / "record.xlsx"
    book.save(path)
    said = "136 cells hold formulas and not their values: open the workbook"
    assert said in doubts(mh.io.read(path))[0]


def test_numbers_of_equal_names_have_their_name_in_look() -> None:
    shown = run("look", str(Path(__file__).parent / "files" / "dup.lvm")).stdout
    assert shown.count("  Voltage") == 2


def test_what_is_said_of_a_text_is_said_again(tmp_path: Path) -> None:
    path = tmp_path / "record.csv"
    body = "".join(f"{10 * k};{500 + 37 * k:,};{k % 40}\n" for k in range(60)).replace(",", ".")
    path.write_text(f"a rig\nt_ms;u_mV;y_nm\n{body}", encoding="utf-8")
    shown = run("look", str(path), "--thousands", ".", "--skip-lines", "1").stdout
    assert "--input u_mV --output y_nm --skip-lines 1 --thousands . -o" in shown


def test_what_is_assumed_of_arrays_is_listed(tmp_path: Path) -> None:
    np.savez(tmp_path / "record.npz", t=T, u=U, y=Y)
    shown = run("look", str(tmp_path / "record.npz")).stdout
    assert "time column t has no unit: seconds are assumed" in shown.partition("assumed\n")[2]
    assert "no unit in 'y': um is assumed; --output-unit" in shown
