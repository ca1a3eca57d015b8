"""Kinds of a few words each: units, headers, stamps and cells of single makers."""

from __future__ import annotations

from pathlib import Path

import mpi_hyst as mh
import numpy as np
import pytest
from commands import run

from odd_files.test_instruments import N, T, U, Y, rows
from odd_files.test_told import told

HEADER = "time_s,drive_v,gauge_um\n"
BODY = rows(T, U, Y)
SCOPE = rows(np.arange(N), U / 12, Y / 3, end=",,,\n")
INLINE = "t0 = -5.000000e-01, tInc = 1.000000e-02,\n"


def written(path: Path, content: str) -> Path:
    path.write_text(content, encoding="utf-8")
    return path


def stamped(form: str) -> str:
    stamps = [form.format(t) for t in T]
    pairs = zip(stamps, rows(U, Y).splitlines(), strict=True)
    return "time,drive_v,gauge_um\n" + "".join(f"{stamp},{line}\n" for stamp, line in pairs)


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("gauge_nano_m", "nm"), ("gauge nano m", "nm"), ("gauge_micro_m", "um"),
        ("gauge_milli_v", "mV"), ("gauge (VDC)", "V"), ("101 <Gauge> (VDC)", "V"),
    ],
)  # fmt: skip
def test_units_of_two_words_are_units(name: str, unit: str, tmp_path: Path) -> None:
    path = written(tmp_path / "record.csv", f"time_s,drive_v,{name}\n{BODY}")
    record = mh.io.read(path)
    assert record.quantity(name).suffix == unit and not told(record, path)


def test_a_unit_that_is_lost_behind_a_name_is_told(tmp_path: Path) -> None:
    path = written(tmp_path / "record.csv", "time / s,cmd /,gauge / um\n" + BODY)
    (said,) = told(mh.io.read(path), path)
    assert "no unit taken from 'cmd /', though it holds '/'" in said


@pytest.mark.parametrize("name", ["Time (s),Drive,Gauge (nm)", "Time,Drive (V),Gauge (um)"])
def test_a_name_without_a_unit_beside_names_with_units_is_told(name: str, tmp_path: Path) -> None:
    path = written(tmp_path / "record.csv", f"{name}\n{BODY}")
    (said,) = told(mh.io.read(path), path)
    assert "all other names have one in brackets: it may be lost" in said
    path = written(path, f"Time,Drive,Gauge (nm)\n{BODY}")
    assert not told(mh.io.read(path), path)


@pytest.mark.parametrize("mark", ["", "# "])
def test_a_sensitivity_of_a_column_in_volts_is_told(mark: str, tmp_path: Path) -> None:
    line = f"{mark}Gauge sensitivity: 3 um/V\n"
    path = written(tmp_path / "record.csv", f"{line}time_s,drive_v,Gauge (V)\n{BODY}")
    (said,) = told(mh.io.read(path), path)
    assert "line 1: '3 um/V' is not applied: Gauge (V) is in V" in said
    # Of the drive alone it says nothing.
    path = written(path, f"{line}time_s,drive_v,Gauge (um)\n{BODY}")
    assert not told(mh.io.read(path), path)


@pytest.mark.parametrize(
    "header",
    [
        f"X,CH1V,CH2V,{INLINE}",
        "X,CH1,CH2,Start,Increment,\nSequence,Volt,Volt,-5.0e-01,1.0e-02,\n",
        "X,CH1,CH2,t0,tInc,\nSequence,Volt,Volt,-5.0e-01,1.0e-02,\n",
    ],
)
def test_a_header_with_start_and_increment_is_the_time(header: str, tmp_path: Path) -> None:
    record = mh.io.read(written(tmp_path / "record.csv", header + SCOPE))
    assert record.time_column == "X" and record.seconds is not None
    np.testing.assert_allclose(record.seconds, T - 0.5, atol=1e-9)


@pytest.mark.parametrize(
    "header", [f"CH1V,CH2V,{INLINE}", "CH1,CH2,Start,Increment,\nVolt,Volt,-5.0e-01,1.0e-02,\n"]
)
def test_a_start_and_an_increment_without_a_count_are_told(header: str, tmp_path: Path) -> None:
    path = written(tmp_path / "record.csv", header + rows(U / 12, Y / 3, end=",\n"))
    said = [one.text for one in mh.io.read(path).assumed if one.level == "assumed"]
    assert any("steps of 0.01000 s" in one and "--rate 100" in one for one in said), said


def test_a_clock_with_a_bad_stamp_is_no_position(tmp_path: Path) -> None:
    times = T.copy()
    times[70] = -0.0
    path = written(tmp_path / "record.csv", "TIME,CH1\n" + rows(times, U))
    shown = run("look", str(path)).stdout
    assert "position  no column looks like it" in shown and "--output TIME" not in shown


@pytest.mark.parametrize(
    "form",
    [
        "2026-11-22T10:00:{:06.3f}Z", "2026-11-22 10:00:{:06.3f}+00:00",
        "2026-11-22 10:00:{:06.3f} UTC", "2026-11-22T10:00:{:06.3f} GMT", "10:00:{:06.3f} UTC",
        "2026-11-22 10:00:{:06.3f} UTC+01:00", "2026-11-22T10:00:{:06.3f}[UTC]",
    ],
)  # fmt: skip
def test_stamps_with_a_zone_are_times(form: str, tmp_path: Path) -> None:
    record = mh.io.read(written(tmp_path / "record.csv", stamped(form)))
    assert record.seconds is not None
    np.testing.assert_allclose(record.seconds, T, atol=1e-9)


def test_a_zone_that_is_not_known_is_refused_with_the_way_out(tmp_path: Path) -> None:
    path = written(tmp_path / "record.csv", stamped("2026-11-22 10:00:{:06.3f} CET"))
    with pytest.raises(mh.io.ReadError, match=r"expected a zone as Z or \+01:00; --time none"):
        mh.io.read(path)


def test_a_logger_of_agilent_is_read(tmp_path: Path) -> None:
    head = "Name:,Rig\nInstrument:,34970A\nTotal Channels:,2\n\nChannel,Name,Function\n"
    head += "101,Drive,DC voltage\n102,Gauge,DC voltage\n\n"
    head += "Scan,Time,101 <Drive> (VDC),Alarm 101,102 <Gauge> (VDC),Alarm 102\n"
    body = "".join(
        f"{k + 1},11/22/2026 10:00:{k // 100:02}:{10 * (k % 100):03},{U[k]:.6g},0,{Y[k]:.6g},0\n"
        for k in range(N)
    )
    path = written(tmp_path / "record.csv", head + body)
    record = mh.io.read(path)
    assert record.time_column == "Time" and record.seconds is not None
    np.testing.assert_allclose(record.seconds, T, atol=1e-9)
    assert record.units["102 <Gauge> (VDC)"] == "V"
    assert "--input '101 <Drive> (VDC)'" in run("look", str(path)).stdout


@pytest.mark.parametrize(
    ("cell", "why"),
    [
        ("0x{:04X}", "no hexadecimal one"), ("{}%", "without '%'"), ("{} um", "without 'um'"),
        ("{} µm", "without 'µm'"),
    ],
)  # fmt: skip
def test_numbers_with_something_more_are_refused_with_the_reason(
    cell: str, why: str, tmp_path: Path
) -> None:
    body = "".join(
        f"{t:.2f},{u:.3f},{cell.format(int(1e3 * y))}\n" for t, u, y in zip(T, U, Y, strict=True)
    )
    path = written(tmp_path / "record.csv", HEADER + body)
    with pytest.raises(mh.io.ReadError, match=f"line 2, column gauge_um: .*expected .*{why}"):
        mh.io.read(path, "gauge_um")
    assert why in run("look", str(path)).stdout
