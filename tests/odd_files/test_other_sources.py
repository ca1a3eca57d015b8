"""Workbooks, joined files, and channels that do not begin together."""

from __future__ import annotations

import datetime
from pathlib import Path

import h5py
import mpi_hyst as mh
import numpy as np
import openpyxl
import pytest
from commands import run
from nptdms import ChannelObject, TdmsWriter

FIT = mh.io.read(Path(__file__).parent / "files" / "fit_um.csv")
T, U, Y = FIT["Time"], FIT["Drive"], FIT["Gauge"]


def doubts(record: mh.io.Columns) -> list[str]:
    return [one.text for one in record.assumed if one.level == "doubtful"]


def workbook(path: Path, sheets: dict[str, list[list[object]]]) -> Path:
    book = openpyxl.Workbook()
    book.remove(book.active)
    for name, rows in sheets.items():
        sheet = book.create_sheet(name)
        for row in rows:
            sheet.append(row)
    book.save(path)
    return path


ROWS: list[list[object]] = [
    [1e3 * t, u, 1e3 * y] for t, u, y in zip(T.tolist(), U.tolist(), Y.tolist(), strict=True)
]
HEAD: list[list[object]] = [["Rig", 3], [], ["Time (ms)", "Drive (V)", "Gauge (nm)"]]


def test_the_first_sheet_with_a_table_is_read(tmp_path: Path) -> None:
    sheets: dict[str, list[list[object]]] = {
        "Notes": [["by hand"]],
        "Data": [*HEAD, *ROWS],
        "Other": [["a", "b"], *ROWS],
    }
    record = mh.io.read(workbook(tmp_path / "a.xlsx", sheets))
    assert record.format == "workbook, sheet Data"
    assert record.units == {"Time (ms)": "ms", "Drive (V)": "V", "Gauge (nm)": "nm"}
    np.testing.assert_allclose(record["Gauge (nm)"], 1e3 * Y)
    assert record.sample_time == pytest.approx(0.01)
    assert any("sheet Data is read, Other not" in one.text for one in record.assumed)


def test_what_is_wrong_in_a_sheet_has_its_row(tmp_path: Path) -> None:
    rows = [list(row) for row in ROWS]
    rows[5][1] = "#N/A"
    path = workbook(tmp_path / "a.xlsx", {"Data": [*HEAD, *rows]})
    with pytest.raises(mh.io.ReadError, match=r"line 9, column Drive \(V\): (not|empty)"):
        mh.io.read(path)
    with pytest.raises(mh.io.ReadError, match="no sheet with columns of numbers: Notes"):
        mh.io.read(workbook(path, {"Notes": [["by hand"]]}))


def test_dates_in_a_sheet_are_times(tmp_path: Path) -> None:
    start = datetime.datetime(2026, 1, 1, 10)
    stamps = [start + datetime.timedelta(milliseconds=10 * k) for k in range(T.size)]
    rows: list[list[object]] = [[s, *row[1:]] for s, row in zip(stamps, ROWS, strict=True)]
    head: list[list[object]] = [["Timestamp", "u", "y"]]
    record = mh.io.read(workbook(tmp_path / "a.xlsx", {"Data": [*head, *rows]}))
    assert record.time_column == "Timestamp" and record.sample_time == pytest.approx(0.01)


def column(path: Path, values: np.ndarray, header: str = "") -> Path:
    lines = [*([header] if header else []), *(f"{value:.6g}" for value in values)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_files_of_one_column_are_joined(tmp_path: Path) -> None:
    column(tmp_path / "drive_v.txt", U)
    column(tmp_path / "gauge.txt", 1e3 * Y, "Gauge (nm)")
    for source in (tmp_path / "drive_v.txt+gauge.txt", tmp_path):
        record = mh.io.read(source)
        assert record.names == ("drive_v", "Gauge (nm)")
        assert record.units == {"drive_v": "V", "Gauge (nm)": "nm"}
        np.testing.assert_allclose(record["Gauge (nm)"], 1e3 * Y)
        assert any("2 files are joined" in one.text for one in record.assumed)
        words = [str(source), "--input", "drive_v", "--output", "Gauge (nm)", "--rate", "100"]
        result = run("identify", *words, "--operators", "4")
        assert result.exit_code == 0, result.output
    column(tmp_path / "gauge.txt", Y[:-1])
    with pytest.raises(mh.io.ReadError, match="expected files of as many rows each, got"):
        mh.io.read(tmp_path)


def test_a_time_that_files_share_is_there_once(tmp_path: Path) -> None:
    for name, values in (("ch1", U), ("ch2", Y)):
        rows = "".join(f"{t:g},{v:g}\n" for t, v in zip(T, values, strict=True))
        (tmp_path / f"{name}.csv").write_text(f"time_s,{name}_v\n{rows}", encoding="utf-8")
    record = mh.io.read(tmp_path)
    assert record.names == ("time_s", "ch1_v", "ch2_v") and record.time_column == "time_s"
    other = (tmp_path / "ch2.csv").read_text("utf-8").replace("\n0,", "\n-1,", 1)
    (tmp_path / "ch2.csv").write_text(other, encoding="utf-8")
    with pytest.raises(mh.io.ReadError, match=r"the times of .* differ by up to 1\.000 s"):
        mh.io.read(tmp_path)


def tdms(path: Path, late: float, step: float = 0.01, offset: float = 0.0) -> Path:
    start = np.datetime64("2026-11-22T10:00:00.000000")
    later = start + np.timedelta64(round(late * 1e6), "us")
    with TdmsWriter(path) as writer:
        clock = {"wf_increment": step, "wf_start_time": later, "wf_start_offset": offset}
        first = ChannelObject("R", "Amp", U, {**clock, "unit_string": "V"})
        clock = {"wf_increment": 0.01, "wf_start_time": start, "wf_start_offset": 0.0}
        writer.write_segment(
            [first, ChannelObject("R", "Gauge", Y, {**clock, "unit_string": "um"})]
        )
    return path


@pytest.mark.parametrize(("late", "offset"), [(0.03, 0.0), (0.0, 0.03), (-0.02, 0.0), (1.0, 0.0)])
def test_channels_of_one_step_come_together(tmp_path: Path, late: float, offset: float) -> None:
    record = mh.io.read(tdms(tmp_path / "a.tdms", late, offset=offset))
    shift = round((late + offset) / 0.01)
    amp = U[max(0, -shift) :][: U.size - abs(shift)]
    gauge = Y[max(0, shift) :][: Y.size - abs(shift)]
    np.testing.assert_array_equal(record["R/Amp"], amp)
    np.testing.assert_array_equal(record["R/Gauge"], gauge)
    assert record.sample_time == pytest.approx(0.01) and not doubts(record)


def test_channels_that_do_not_fit_are_told(tmp_path: Path) -> None:
    (said,) = doubts(mh.io.read(tdms(tmp_path / "a.tdms", 0.0234)))
    assert "R/Amp begins 23.40 ms after R/Gauge" in said and "3.400 ms are left" in said
    with pytest.raises(mh.io.ReadError, match="when that has ended"):
        mh.io.read(tdms(tmp_path / "a.tdms", 10.0))
    with pytest.raises(
        mh.io.ReadError, match=r"sampled every 0\.01000 s, and R/Amp every 0\.02000 s"
    ):
        mh.io.read(tdms(tmp_path / "a.tdms", 0.0, step=0.02), ["R/Amp", "R/Gauge"])


def test_fill_values_of_netcdf_are_no_numbers(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.nc", "w") as file:
        file["y"] = np.where(np.arange(Y.size) == 7, 9.96921e36, Y)
        file["y"].attrs["_FillValue"] = 9.96921e36
        file["u"] = np.round(U / 0.5).astype("i2")
        file["u"].attrs["scale_factor"] = 0.5
    np.testing.assert_allclose(mh.io.read(tmp_path / "a.nc", "u")["u"], U, atol=0.26)
    with pytest.raises(mh.io.ReadError, match="sample 7, column y: not finite"):
        mh.io.read(tmp_path / "a.nc", "y")
