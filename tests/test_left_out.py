"""Rows left out or mended, times in other units, and what `identify` refuses about them."""

from __future__ import annotations

from pathlib import Path

import mpi_hyst as mh
import numpy as np
import pytest
from commands import COLUMNS, HEADER, RATE, assert_refused, names_in, record_rows, run, write_csv
from mpi_hyst._cli.identify_records import parted
from mpi_hyst._report.records import Record
from odd_files.case import PLAIN

DRIVE = np.arange(100.0)


def record(skip: int = 0) -> Record:
    return Record("a", DRIVE, 2.0 * DRIVE, None, None, skip)


def test_a_record_is_parted_and_every_part_has_the_memory_of_all_before() -> None:
    parts = parted(record(5), [(40, 50)], [(20, 30)])
    assert [(part.skip, part.input.size) for part in parts] == [(5, 20), (30, 40), (50, 100)]
    np.testing.assert_array_equal(parts[-1].input, DRIVE)  # the straight line of a straight line
    # stretches overlap, and parts of fewer than ten rows are left out with them
    (part,) = parted(record(), [(3, 50), (40, 90)], [])
    assert part.skip == 90


def test_a_mended_drive_is_straight() -> None:
    bent = record().input.copy()
    bent[20:25] = -99.0
    broken = Record("a", bent, 2.0 * DRIVE, None, None, 0)
    (_, last) = parted(broken, [], [(20, 25)])
    np.testing.assert_allclose(last.input, DRIVE, rtol=0.0, atol=1e-12)
    assert last.skip == 25


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (
            ["--leave-out", "7"],
            "expected rows FROM:TO, the first and the one behind the last, got '7'",
        ),
        (["--leave-out", "9:9"], "got '9:9'"),
        (["--mend", "a:b"], "got 'a:b'"),
        (["--mend", "0:99999"], "--mend: expected rows up to 1000, got 0:99999"),
        (["--leave-out", "5:998"], "leave no samples to fit"),
        (["--mend", "0:1000"], "--mend: expected rows that are left as they are"),
        (["--leave-out", "5:6", "--validate-from", "500"], "--leave-out and --validate-from"),
        (["--time-unit", "weeks"], "weeks"),
        (["--time", "none", "--time-unit", "ms"], "--time-unit: record.csv has no time column"),
        (["--rate", "200"], "--rate: record.csv has the time column time_s; give one of both, or"),
    ],
)
def test_what_is_wrong_is_named(there: Path, options: list[str], said: str) -> None:
    before = names_in(there)
    result = run("identify", "record.csv", *COLUMNS, *PLAIN, *options, "-o", "found.json")
    assert_refused(result, there, before, said)


def test_parts_of_several_files_are_refused(there: Path) -> None:
    files = ["record.csv", "record.csv"]
    result = run("identify", *files, *COLUMNS, *PLAIN, "--leave-out", "5:6")
    assert_refused(result, there, names_in(there), "--leave-out: expected one file, got 2")


def test_what_is_left_out_does_not_count(there: Path) -> None:
    rows = record_rows()
    for row in rows[300:310]:
        row[2] = 77.0
    write_csv(there / "bad.csv", HEADER, rows)
    options = [*COLUMNS, *PLAIN, "--leave-out", "300:310", "-o", "good.json"]
    result = run("identify", "bad.csv", *options, "--report", "report.html")
    assert result.exit_code == 0 and "fitted to 990 samples of 2 records" in result.stdout
    stage = mh.load(str(there / "good.json"))
    assert isinstance(stage, mh.Stage) and stage.identified is not None
    # one file is one source
    assert len(stage.identified["records"]) == 1
    assert (there / "report.html").stat().st_size > 0


@pytest.mark.parametrize(
    ("unit", "scale"), [("ms", 1e3), ("us", 1e6), ("min", 1.0 / 60.0), ("d", 1.0 / 86400.0)]
)
def test_the_unit_of_the_time_may_be_given(there: Path, unit: str, scale: float) -> None:
    rows = [[scale * float(str(t)), u, y] for t, u, y in record_rows()]
    write_csv(there / "timed.csv", HEADER.replace("time_s", "time"), rows)
    result = run("identify", "timed.csv", *COLUMNS, *PLAIN, "--time-unit", unit, "-o", "s.json")
    assert result.exit_code == 0, result.output
    stage = mh.load(str(there / "s.json"))
    assert isinstance(stage, mh.Stage) and stage.identified is not None
    assert stage.identified["dt"] == [pytest.approx(1.0 / RATE)]


def holes(there: Path, cells: dict[int, tuple[int, str]]) -> None:
    """Write the record with other texts in columns of rows."""
    rows = record_rows()
    for row, (place, text) in cells.items():
        rows[row][place] = text
    write_csv(there / "holes.csv", HEADER, rows)


def fitted(*options: str) -> str:
    result = run("identify", "holes.csv", *COLUMNS, *PLAIN, "-o", "found.json", *options)
    assert result.exit_code == 0, result.output
    return result.stdout


def refusal(there: Path, *options: str) -> str:
    result = run("identify", "holes.csv", *COLUMNS, *PLAIN, "-o", "found.json", *options)
    assert result.exit_code == 2, result.output
    assert not (there / "found.json").exists()
    return result.stderr


@pytest.mark.parametrize("text", ["", "nan", "OVL", "1e200"])
def test_cells_of_rows_that_are_left_out_may_hold_anything(there: Path, text: str) -> None:
    holes(there, dict.fromkeys(range(500, 521), (2, text)))
    said = refusal(there)
    assert "--leave-out 500:5" in said and "--rows 500" in said
    assert "fitted to 979 samples of 2 records" in fitted("--leave-out", "500:521")
    found = mh.load(there / "found.json")
    holes(there, dict.fromkeys(range(500, 521), (2, "0.5")))
    fitted("--leave-out", "500:521")
    again = mh.load(there / "found.json")
    assert isinstance(found, mh.Stage) and isinstance(again, mh.Stage)
    assert found.hysteresis == again.hysteresis


@pytest.mark.parametrize("text", ["", "nan", "OVL"])
@pytest.mark.parametrize("place", [1, 2])
def test_cells_of_rows_that_are_mended_may_hold_anything(
    there: Path, text: str, place: int
) -> None:
    holes(there, {60: (place, text)})
    if place == 1:
        assert "column drive_v" in refusal(there) and "--mend 60:61" in refusal(there)
    assert "fitted to 999 samples of 2 records" in fitted("--mend", "60:61")


def test_what_is_missing_elsewhere_is_refused(there: Path) -> None:
    holes(there, {60: (1, ""), 80: (1, ""), 90: (2, "OVL")})
    assert "line 82, column drive_v: empty cell; put a straight line there with --mend 80:81" in (
        refusal(there, "--mend", "60:61", "--leave-out", "80:91")
    )
    said = refusal(there, "--mend", "60:61", "--mend", "80:81")
    assert "line 92, column position_um: not a number: 'OVL'; leave that out" in said
    fitted("--mend", "60:61", "--mend", "80:81", "--leave-out", "90:91")
    (there / "found.json").unlink()
    # a row is said first, and with the option that is enough for all of it
    holes(there, {60: (2, "OVL"), 61: (1, "OVL")})
    assert "line 62, column position_um" in refusal(there)
    rows = record_rows()
    rows[60] = ["x", "x", "x"]
    rows[61] = [rows[61][0], "x", "x"]
    rows[62] = [1]
    write_csv(there / "holes.csv", HEADER, rows)
    said = refusal(there)
    assert "column drive_v: not a number: 'x'; another table may begin here: --skip-" in said
    assert "; mend this row, or read" in said
    rows[60] = record_rows()[60]
    write_csv(there / "holes.csv", HEADER, rows)
    assert "line 63, column drive_v: not a number: 'x'; put a straight" in refusal(there)
    # a time is never left out
    holes(there, {60: (0, "")})
    assert "column time_s: empty cell; mend this row" in refusal(there, "--leave-out", "60:61")


def test_rows_that_are_left_out_may_be_the_first_and_the_last(there: Path) -> None:
    holes(there, dict.fromkeys((*range(40), *range(960, 1000)), (2, "")))
    said = fitted("--leave-out", "0:40", "--leave-out", "960:1000")
    assert "fitted to 920 samples of" in said
    # gaps that nobody names are filled in as ever
    holes(there, dict.fromkeys((*range(500, 540), *range(700, 710)), (2, "")))
    assert "fitted to 960 samples of" in fitted("--leave-out", "500:540")


def test_rows_of_a_record_for_validation_are_not_left_out(there: Path) -> None:
    holes(there, dict.fromkeys(range(500, 521), (2, "OVL")))
    options = ("--validate", "holes.csv", "--leave-out", "500:521")
    result = run("identify", "record.csv", *COLUMNS, *PLAIN, *options)
    assert result.exit_code == 2 and "line 502, column position_um" in result.stderr
    assert "leave that out" not in result.stderr
