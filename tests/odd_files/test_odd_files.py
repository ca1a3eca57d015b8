"""Files of other labs, each after the kind of a public report: its right values, or why not.

The stage behind all of them goes from 0 to 120 V and 0 to 25.8 um, 136 rows at 100 Hz unless said.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mpi_hyst as mh
import numpy as np
import pandas as pd
import pytest
from commands import run

FILES = Path(__file__).parent / "files"
FIT = mh.io.read(FILES / "fit_um.csv")
U, Y, T = FIT["Drive"], FIT["Gauge"], FIT["Time"]
Columns = tuple[str | int, str | int]

# File, the columns of drive and position, their units, drive and position in V and um over what the
# file has, and the sampling interval in seconds.
READ: dict[str, tuple[Columns, tuple[str, str], tuple[float, float], float | None]] = {
    "fit_um.csv": (("Drive", "Gauge"), ("V", "um"), (1.0, 1.0), 0.01),
    "pre_comment.csv": (("Drive (V)", "Gauge (nm)"), ("V", "nm"), (1.0, 1e-3), 0.01),
    "tek.csv": (("CH1", "CH2"), ("V", "V"), (12.0, 3.0), 0.01),
    "spaced.txt": (("Drive (V)", "Gauge (nm)"), ("V", "nm"), (1.0, 1e-3), 0.01),
    "savetxt.txt": (("drive_v", "position_nm"), ("V", "nm"), (1.0, 1e-3), 0.01),
    "pandas.csv": (("1", "2"), ("", ""), (120.0, 1e3), None),
    "comma_unit.txt": (("Voltage, V", "Displacement, nm"), ("V", "nm"), (1.0, 1e-3), 0.01),
    "word_unit.csv": (("Voltage (volts)", "Position (nanometers)"), ("V", "nm"), (1.0, 1e-3), 0.01),
    "keysight.csv": (("1", "2"), ("V", "V"), (12.0, 3.0), 0.01),
    "quote.csv": (("drive_v", "position_um"), ("V", "um"), (1.0, 1.0), None),
    "quoted_comma.csv": (("drive_v", "position_um"), ("V", "um"), (1.0, 1.0), None),
    "spaced_quotes.csv": (("drive_v", "position_um"), ("V", "um"), (1.0, 1.0), 0.01),
    "long_pre.csv": (("drive_v", "position_um"), ("V", "um"), (1.0, 1.0), 0.01),
    "lvtext.txt": (("Amp", "Gauge"), ("", ""), (1.0, 1.0), 0.01),
    "wide.txt": (("drive_v", "position_um"), ("V", "um"), (1.0, 1.0), 0.01),
    "count.txt": (("0", "1"), ("", ""), (1.0, 1.0), None),
    "group.h5": (("run1/drive_v", "run1/position_um"), ("V", "um"), (1.0, 1.0), 0.01),
    "dup.lvm": ((1, "Position"), ("V", "nm"), (1.0, 1e-3), 0.01),
    "badclock.txt": (("2", "1"), ("", ""), (1.0, float("nan")), None),
}


@pytest.mark.parametrize("name", READ)
def test_it_is_read_rightly(name: str) -> None:
    (drive, position), units, (of_drive, of_position), dt = READ[name]
    record = mh.io.read(FILES / name, [drive, position])
    assert record.samples == 136
    assert record.sample_time == (dt and pytest.approx(dt))
    assert tuple(record.quantity(one).suffix for one in (drive, position)) == units
    u = record[drive] + (0.5 if name == "pandas.csv" else 0.0)
    np.testing.assert_allclose(of_drive * u, U, atol=0.01)
    # The stage of this file is late.
    late = 4 if name == "group.h5" else 0
    if late:
        np.testing.assert_allclose(record[position][late:], Y[:-late], atol=0.03)
    elif np.isfinite(of_position):
        np.testing.assert_allclose(of_position * record[position], Y, atol=0.03)


REFUSED = {
    "dmm_target.csv": (
        "line 4: expected 2 cells as in the header, line 3, got 4: twice as many cells as names: "
        "decimal commas between commas? separate the cells by semicolons"
    ),
    "dmm.csv": "line 7: expected 3 cells .* got 6: twice as many cells as names: decimal commas",
    "na.csv": "line 52, column position_um: not a number: '#N/A'",
    "nul.csv": "line 138: NUL bytes in place of text",
    "dup.lvm": "2 columns are named 'Voltage'; take one by number: 1, 2",
}


@pytest.mark.parametrize("name", REFUSED)
def test_it_is_refused_with_the_reason(name: str) -> None:
    with pytest.raises(mh.io.ReadError, match=re.escape(REFUSED[name]).replace(r"\.\*", ".*")):
        mh.io.read(FILES / name)


def test_channels_have_the_labels_above_them() -> None:
    record = mh.io.read(FILES / "multi_unit.lvm")
    assert record.names == ("time_s", "Amp", "Monitor", "Gauge")
    assert record.units == {"time_s": "s", "Amp": "V", "Monitor": "um", "Gauge": "nm"}
    assert record["Gauge"].max() == 25818.0 and record["Amp"].max() == 120.0
    units = mh.io.read(FILES / "dup.lvm", [1, 2, 3]).units
    assert units == {"1": "V", "2": "V", "Position": "nm", "time_s": "s"}


def test_channels_that_begin_apart_come_together() -> None:
    record = mh.io.read(FILES / "start.tdms", ["R/Amp", "R/Gauge"])
    (said,) = [one.text for one in record.assumed if one.level == "assumed"]
    assert said.startswith("R/Amp begins 20.00 ms after R/Gauge: the first 2 rows of R/Gauge")
    shown = identified("start.tdms", "--input", "R/Amp", "--output", "R/Gauge")
    dead_time = re.search(r"dead time +(\S+)(?: ± \S+)? ms", shown)
    assert dead_time is None or abs(float(dead_time[1])) < 3.0, shown


def identified(name: str, *options: str) -> str:
    result = run("identify", str(FILES / name), *options, "--operators", "4")
    assert result.exit_code == 0, result.output
    return str(result.output)


@pytest.mark.parametrize("name", ["pandas_target.csv"])
def test_a_header_of_one_number_is_no_sample(name: str) -> None:
    record = mh.io.read(FILES / name)
    assert record.samples == 100 and record["0"].min() > 9.0
    assert any("line 1, 0: taken for names" in one.text for one in record.assumed)


def test_a_late_decimal_comma_is_one() -> None:
    record = mh.io.read(FILES / "late_comma.csv")
    assert record.samples == 656 and record["drive_v"].max() == 120.0
    assert record["position_um"].max() == 25.82
    assert record.format == "text, separated by semicolons, decimal comma"


def test_a_bad_clock_is_told() -> None:
    shown = run("look", str(FILES / "badclock.txt")).stdout
    assert "column 0 looks like a time: row 70 goes back" in shown
    assert "--input 2 --output 1" in shown


def test_arrays_of_more_axes_are_read_or_listed(tmp_path: Path) -> None:
    record = mh.io.read(FILES / "nd.npz", ["u:0", "y:0"])
    np.testing.assert_allclose(record["u:0"], U, atol=0.01)
    np.savez(tmp_path / "a.npz", t=T, u=np.zeros((136, 2, 3)))
    with pytest.raises(mh.io.ReadError, match=r"u is 136 x 2 x 3 .* as array\[:, 0, 0\]"):
        mh.io.read(tmp_path / "a.npz", "u")
    assert "u (136 x 2 x 3 of float64: no columns" in run("look", str(tmp_path / "a.npz")).stdout
    np.save(tmp_path / "a.npy", np.zeros((136, 2, 3)))
    with pytest.raises(mh.io.ReadError, match=r"no numeric column.*136 x 2 x 3"):
        mh.io.read(tmp_path / "a.npy")


def test_masked_elements_are_refused() -> None:
    y = np.ma.array([0.0, 0.1, 9.96921e36, 0.3], mask=[False, False, True, False])
    with pytest.raises(mh.io.ReadError, match=r"sample 2, column y: .*masked"):
        mh.io.read({"time_s": [0.0, 0.1, 0.2, 0.3], "y": y})
    assert mh.io.read({"y": np.ma.array([0.0, 1.0])})["y"].tolist() == [0.0, 1.0]


CLOCK = pd.date_range("2026-01-01", periods=4, freq="5ms")
INDEXES: dict[str, Callable[[], Any]] = {
    "without a name": lambda: CLOCK,
    "with a name": lambda: CLOCK.rename("time"),
    "with a zone": lambda: CLOCK.tz_localize("UTC").rename("time"),
    "with a zone, without a name": lambda: CLOCK.tz_localize("Europe/Berlin"),
    "durations": lambda: CLOCK - CLOCK[0],
}


@pytest.mark.parametrize("kind", INDEXES)
def test_a_clock_as_index_is_the_time(kind: str) -> None:
    table = {"u": [0.0, 1.0, 2.0, 3.0], "y": [0.0, 0.1, 0.2, 0.3]}
    record = mh.io.read(pd.DataFrame(table, index=INDEXES[kind]()))
    assert record.sample_time == pytest.approx(0.005)
    column = pd.DataFrame({**table, "time": INDEXES[kind]()})
    assert mh.io.read(column).sample_time == pytest.approx(0.005)


def test_durations_of_matlab_are_seconds(tmp_path: Path) -> None:
    rows = "".join(f"{0.005 * k:g} sec,{k}\n" for k in range(30))
    for name in ("Time", "time"):
        (tmp_path / "a.csv").write_text(f"{name},u\n{rows}", encoding="utf-8")
        assert mh.io.read(tmp_path / "a.csv").sample_time == pytest.approx(0.005)
        (tmp_path / "a.csv").write_text(f"{name},u\n{rows.replace('sec', 'ticks')}", "utf-8")
        with pytest.raises(mh.io.ReadError, match=f"column {name}: not a number: '0 ticks'"):
            mh.io.read(tmp_path / "a.csv", ["u"])


# The commands.


def test_units_of_validation_are_compared() -> None:
    fit, other = str(FILES / "fit_um.csv"), str(FILES / "valid_nm.csv")
    given = ["identify", fit, "--input", "Drive", "--output", "Gauge", "--operators", "4"]
    for option in (["--validate", other], [other]):
        words = [*given, *option] if option[0] != other else [*given[:2], other, *given[2:]]
        result = run(*words)
        assert result.exit_code == 2
        assert "valid_nm.csv, column Gauge: expected um as before, got nm" in result.output


def test_a_stage_in_volts_takes_no_micrometres(tmp_path: Path) -> None:
    stage = tmp_path / "stage.json"
    shown = run("look", str(FILES / "keysight.csv")).stdout.splitlines()[-1].split()[1:]
    assert shown[2:] == ["--input", "1", "--output", "2", "-o", "stage.json"]
    result = run(*shown[:-1], str(stage), "--operators", "4")
    assert result.exit_code == 0, result.output
    loaded = mh.load(stage)
    assert isinstance(loaded, mh.Stage) and loaded.units == ("V", "V")
    (tmp_path / "target.csv").write_text("time_s,target_um\n0,3\n0.01,4\n0.02,5\n", "utf-8")
    words = [str(stage), str(tmp_path / "target.csv"), "-o", str(tmp_path / "drive.csv")]
    result = run("precompensate", *words)
    assert result.exit_code == 2 and "expected V, as the stage has, got um" in result.output


def test_a_name_that_seems_to_hold_a_unit_is_amber(tmp_path: Path) -> None:
    text = (FILES / "fit_um.csv").read_text("utf-8").split("\n", 2)[2]
    path, stage = tmp_path / "record.csv", tmp_path / "stage.json"
    path.write_text(f"time_s;drive_v;PosNm\n{text}", encoding="utf-8")
    words = ["identify", str(path), "--input", "drive_v", "--output", "PosNm", "--operators", "4"]
    page = tmp_path / "page.html"
    result = run(*words, "-o", str(stage), "--report", str(page), "--strict")
    assert result.stdout.startswith("verdict: amber (assumed")
    said = "no unit taken from 'PosNm', though it holds 'Nm': um is assumed; --output-unit"
    assert said in result.stdout and result.exit_code == 1
    assert "amber" in page.read_text("utf-8") and "PosNm" in page.read_text("utf-8")
    # the stage keeps it, as everything else that makes its numbers doubtful
    loaded = mh.load(stage)
    assert isinstance(loaded, mh.Stage) and loaded.identified is not None
    (kept,) = (one for one in loaded.identified["warnings"] if one["code"] == "assumed")
    assert said in kept["message"] and kept["severity"] == "amber"
    result = run(*words, "--output-unit", "nm", "--strict")
    assert result.stdout.startswith("verdict: green") and result.exit_code == 0
    # Where there is no verdict, it is refused until somebody says it.
    (tmp_path / "target.csv").write_text("time_s,PosNm\n0,0\n0.01,0.4\n0.02,0.5\n", "utf-8")
    words = ["precompensate", str(stage), str(tmp_path / "target.csv")]
    words += ["-o", str(tmp_path / "drive.csv")]
    assert "--unit" in run(*words).output and not (tmp_path / "drive.csv").exists()
    result = run(*words, "--unit", "um", "--lead-in", "0.1")
    assert result.exit_code == 0, result.output


def test_a_header_that_does_not_fit_is_told(tmp_path: Path) -> None:
    rows = (FILES / "pre_comment.csv").read_text("utf-8").replace(",\n", "\n")
    path = tmp_path / "record.csv"
    path.write_text(rows, encoding="utf-8")
    said = "line 3 looks like a header of 4 names, the rows have 3 cells"
    assert said in run("look", str(path)).stdout
    words = ["identify", str(path), "--input", "1", "--output", "2", "--operators", "4"]
    result = run(*words)
    assert result.stdout.startswith("verdict: amber (assumed") and said in result.stdout
    assert said in run("identify", str(path), "--input", "Drive (V)", "--output", "2").output


def test_one_row_is_told(tmp_path: Path) -> None:
    stage, drive = tmp_path / "stage.json", str(tmp_path / "drive.csv")
    shown = run(
        *("identify", str(FILES / "fit_um.csv"), "--input", "Drive", "--output", "Gauge"),
        *("--operators", "4", "-o", str(stage), "--dynamics", "none"),
    )
    assert shown.exit_code == 0
    loaded = mh.load(stage)
    assert isinstance(loaded, mh.Stage)
    loaded.replace(dead_time=0.001).save(stage)
    words = ["precompensate", str(stage), str(FILES / "one.csv"), "-o", drive]
    assert "one row, so time_s tells no sampling interval" in run(*words).output
    result = run(*words, "--time", "none", "--rate", "100", "--lead-in", "0.2")
    assert result.exit_code == 0 and "too fast" not in result.output, result.output
