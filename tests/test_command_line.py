"""The command line: what `identify` writes, what it says, and how it refuses."""

from __future__ import annotations

import os
from pathlib import Path

import mpi_hyst as mh
import numpy as np
import pytest
from commands import (
    COLUMNS,
    HEADER,
    RATE,
    assert_refused,
    column,
    names_in,
    record_rows,
    run,
    write_csv,
)


def test_identify_recovers_the_model_of_a_record(there: Path) -> None:
    result = run("identify", "record.csv", *COLUMNS, "--operators", "4", "-o", "found.json")
    assert result.exit_code == 0, result.output
    stage = mh.load(there / "found.json")
    assert isinstance(stage, mh.Stage) and stage.units == ("V", "um")
    found = stage.hysteresis
    drive = column(there / "record.csv", "drive_v")
    measured = column(there / "record.csv", "position_um")
    assert np.abs(found.forward().run(drive) - measured).max() < 1e-2 * np.ptp(measured)
    for words in ("modified", "4 coupled plays", "record.csv", "1000", "rms (µm)", "of the range"):
        assert words in result.stdout
    assert "found.json" in result.stdout
    assert result.stderr == ""


def test_identify_without_a_file_says_how_to_save(there: Path) -> None:
    before = names_in(there)
    result = run("identify", "record.csv", *COLUMNS, "--operators", "4")
    assert result.exit_code == 0
    assert "-o stage.json" in result.stdout
    assert names_in(there) == before


def test_identify_keeps_what_is_given(there: Path) -> None:
    result = run(
        *("identify", "record.csv", *COLUMNS, "--operators", "4", "--ratios", "0.9,0.3,0.4"),
        *("--input-offset", "-1.5", "--dead-time", "0", "-o", "found.json"),
    )
    stage = mh.load(there / "found.json")
    assert isinstance(stage, mh.Stage)
    found = stage.hysteresis
    assert found.input_offset == -1.5
    np.testing.assert_allclose(found.ra[1:] / found.r[1:], 0.9)
    assert result.stdout.count("(given)") == 3


def test_identify_fits_the_conventional_model(there: Path) -> None:
    result = run("identify", "record.csv", *COLUMNS, "--model", "conventional", "-o", "found.json")
    assert result.exit_code == 0
    stage = mh.load(there / "found.json")
    assert isinstance(stage, mh.Stage)
    np.testing.assert_array_equal(stage.hysteresis.ra, stage.hysteresis.r)


@pytest.mark.parametrize("skips", [("1s", "1s"), ("200", "200"), ("1s",), ("200",)])
def test_seconds_and_rows_to_skip_mean_the_same(there: Path, skips: tuple[str, ...]) -> None:
    write_csv(there / "other.csv", HEADER, record_rows(300.0))
    options = [word for skip in skips for word in ("--skip", skip)]
    result = run("identify", "record.csv", "other.csv", *COLUMNS, "--operators", "4", *options)
    assert result.exit_code == 0, result.output
    assert "1600 samples of 2 records" in result.stdout
    assert result.stdout.count(" 800 ") == 2


@pytest.mark.usefixtures("there")
def test_rows_limit_what_is_read() -> None:
    result = run("identify", "record.csv", *COLUMNS, "--operators", "4", "--rows", "700")
    assert "700 samples" in result.stdout


@pytest.mark.parametrize(
    ("encoding", "separator", "end"),
    [("utf-8-sig", ",", "\n"), ("utf-8", ";", "\r\n"), ("utf-8", "\t", "\n\n\n")],
)
def test_files_of_spreadsheets_are_read(
    there: Path, encoding: str, separator: str, end: str
) -> None:
    text = (there / "record.csv").read_text("utf-8").strip().replace(",", separator)
    (there / "other.csv").write_text(text.replace("\n", end), encoding=encoding, newline="")
    result = run("identify", "other.csv", *COLUMNS, "--operators", "4")
    assert result.exit_code == 0, result.output


def changed(line: int, text: str) -> list[list[object]]:
    rows = record_rows()
    rows[line - 2] = [text]
    return rows


WRONG_RECORDS: dict[str, tuple[list[list[object]], list[str]]] = {
    "text": (changed(11, "0.045,volts,1"), ["line 11, column drive_v", "'volts'"]),
    "empty cell": (changed(11, "0.045,,1"), ["line 11, column drive_v", "empty cell"]),
    "nan": (changed(11, "0.045,nan,1"), ["line 11, column drive_v", "not finite: nan"]),
    "huge": (changed(11, "0.045,1e200,1"), ["line 11, column drive_v", "larger than 1e+100"]),
    "infinite": (changed(11, "0.045,-inf,1"), ["line 11, column drive_v", "not finite: -inf"]),
    "underscore": (changed(11, "0.045,1_0,1"), ["line 11, column drive_v", "'1_0'"]),
    "short row": (changed(11, "0.045,1"), ["line 11", "expected 3 cells", "got 2"]),
    "long row": (changed(11, "0.045,1,2,3"), ["line 11", "expected 3 cells", "got 4"]),
    "time runs back": (changed(11, "0.001,1,2"), ["line 11, column time_s", "does not increase"]),
    "no rows": ([], ["no rows"]),
    "too few samples": (record_rows()[:9], ["at least", "got 9"]),
    "constant input": ([[k, 1.5, k] for k in range(99)], ["column drive_v", "vary", "1.5"]),
    "constant output": ([[k, k, 7] for k in range(99)], ["column position_um", "vary", "7"]),
}


@pytest.mark.parametrize("wrong", WRONG_RECORDS)
def test_identify_refuses_a_wrong_record(there: Path, wrong: str) -> None:
    rows, said = WRONG_RECORDS[wrong]
    write_csv(there / "wrong.csv", HEADER, rows)
    before = names_in(there)
    result = run("identify", "wrong.csv", *COLUMNS, "-o", "out.json", "--report", "out.html")
    assert_refused(result, there, before, "wrong.csv", *said)


def test_the_wrong_one_of_two_records_is_named(there: Path) -> None:
    write_csv(there / "wrong.csv", HEADER, WRONG_RECORDS["constant input"][0])
    before = names_in(there)
    result = run("identify", "record.csv", "wrong.csv", *COLUMNS, "-o", "out.json")
    assert_refused(result, there, before, "wrong.csv")


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", ["empty file"]),
        ("zeit,µm\n1,2\n".encode("latin-1"), ["no column 'drive_v'", "zeit, µm"]),
        (b"a,b\n1,2\n", ["no column 'drive_v'", "a, b"]),
        (b"drive_v,drive_v,position_um\n1,2,3\n", ["2 columns are named 'drive_v'"]),
        (b'drive_v,position_um\n"1,5",2.5\n', ["line 2, column drive_v", "decimal point"]),
    ],
)
def test_identify_refuses_a_wrong_file(there: Path, content: bytes, said: list[str]) -> None:
    (there / "wrong.csv").write_bytes(content)
    before = names_in(there)
    result = run("identify", "wrong.csv", *COLUMNS, "-o", "out.json")
    assert_refused(result, there, before, "wrong.csv", *said)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["missing.csv", *COLUMNS], ["missing.csv", "No such file"]),
        ([".", *COLUMNS], ["directory"]),
        (["record.csv", "--input", "volt", "--output", "position_um"], ["'volt'", HEADER[:6]]),
        (["record.csv", "--input", "drive_v", "--output", "drive_v"], ["both", "'drive_v'"]),
        (["record.csv", *COLUMNS, "--time", "clock"], ["no column 'clock'"]),
        (["record.csv", *COLUMNS, "--ratios", "0.9,0.3"], ["--ratios", "RA,RB,RC"]),
        (["record.csv", *COLUMNS, "--ratios", "0.3,0.9,0.3"], ["--ratios", "rb"]),
        (["record.csv", *COLUMNS, "--ratios", "0.9,-0.3,0.3"], ["--ratios", "rb"]),
        (["record.csv", *COLUMNS, "--ratios", "0.9,0.3,1.2"], ["--ratios", "rc"]),
        (
            ["record.csv", *COLUMNS, "--ratios", "0.9,0.3,0.3", "--model", "conventional"],
            ["--ratios", "conventional"],
        ),
        (["record.csv", *COLUMNS, "--operators", "0"], ["--operators", "from 1 on", "'0'"]),
        (["record.csv", *COLUMNS, "--operators", "many"], ["--operators", "auto", "'many'"]),
        (["record.csv", *COLUMNS, "--operators", "-3"], ["--operators", "'-3'"]),
        (["record.csv", *COLUMNS, "--smoothness", "much"], ["--smoothness", "'much'"]),
        (["record.csv", *COLUMNS, "--smoothness", "-1"], ["--smoothness", "-1"]),
        (["record.csv", *COLUMNS, "--smoothness", "nan"], ["--smoothness", "NaN"]),
        (["record.csv", *COLUMNS, "--validate", "none.csv"], ["none.csv", "No such file"]),
        (
            ["record.csv", *COLUMNS, "--validate", "trajectory.csv"],
            ["trajectory.csv", "no column 'drive_v'"],
        ),
        (
            ["record.csv", *COLUMNS, "--validate", "record.csv", "--validate-from", "500"],
            ["--validate and --validate-from"],
        ),
        (
            ["record.csv", *COLUMNS, "--validate", "record.csv", "--validate-skip", "1000"],
            ["record.csv: --validate-skip 1000 leaves none of 1000 samples"],
        ),
        (
            ["record.csv", *COLUMNS, "--validate-skip", "10"],
            ["--validate-skip: no --validate file"],
        ),
        (["record.csv", *COLUMNS, "--validate-from", "5s"], ["record.csv", "--validate-from 5s"]),
        (["record.csv", *COLUMNS, "--validate-from", "0"], ["leaves no samples to fit"]),
        (
            ["record.csv", *COLUMNS, "--validate-from", "40", "--skip", "40"],
            ["record.csv: --validate-from 40 leaves no samples to fit"],
        ),
        (["record.csv", *COLUMNS, "--validate-from", "half"], ["--validate-from", "'half'"]),
        (
            ["record.csv", *COLUMNS, "--validate-from", "30"],
            ["at least", "got 30"],
        ),
        (
            ["record.csv", *COLUMNS, "--validate", "record.csv", "-o", "./record.csv"],
            ["overwritten"],
        ),
        (["record.csv", *COLUMNS, "--operators", "800"], ["at least"]),
        (["record.csv", *COLUMNS, "--operators", "5000"], ["--operators: expected at most"]),
        (["record.csv", *COLUMNS, "--operators", "200000"], ["--operators: expected at most 4096"]),
        (["record.csv", *COLUMNS, "--creep", "200"], ["--creep: expected a number of terms"]),
        (["record.csv", *COLUMNS, "--creep", "0"], ["--creep", "from 1 on", "'0'"]),
        (["record.csv", *COLUMNS, "--limits", "5,-5"], ["--limits: expected", "got -5.0"]),
        (["record.csv", *COLUMNS, "--slew", "0"], ["--slew: expected", "got 0.0"]),
        (["record.csv", *COLUMNS, "--dead-time", "-1"], ["--dead-time: expected", "-1"]),
        (["record.csv", *COLUMNS, "--dead-time", "1e9"], ["--dead-time: expected", "got"]),
        (["record.csv", *COLUMNS, "--input-offset", "nan"], ["--input-offset", "NaN"]),
        (["record.csv", *COLUMNS, "--skip", "5 minutes"], ["--skip", "'5 minutes'"]),
        (["record.csv", *COLUMNS, "--skip", "1.5"], ["--skip", "'1.5'"]),
        (["record.csv", *COLUMNS, "--skip", "5s"], ["record.csv", "--skip 5s"]),
        (
            ["record.csv", *COLUMNS, "--skip", "1", "--skip", "2"],
            ["--skip", "2 times", "expected once"],
        ),
        (["record.csv", *COLUMNS, "--model", "preisach"], ["--model", "'preisach'"]),
        (["record.csv", "--input", "drive_v"], ["--output"]),
        ([*COLUMNS], ["DATA"]),
        (["record.csv", *COLUMNS, "--speed", "1"], ["--speed"]),
        (["record.csv", *COLUMNS, "-o", "no/such/out.json"], ["no/such", "does not exist"]),
        (["record.csv", *COLUMNS, "-o", "."], ["is a directory"]),
        (["record.csv", *COLUMNS, "-o", "record.csv"], ["record.csv", "overwritten"]),
        (["record.csv", *COLUMNS, "--report", "./record.csv"], ["record.csv", "overwritten"]),
        (["record.csv", *COLUMNS, "-o", "a", "--report", "./a"], ["two outputs"]),
        (["record.csv", *COLUMNS, "-o", os.devnull], ["not a regular file"]),
    ],
)
def test_identify_refuses_wrong_arguments(
    there: Path, arguments: list[str], said: list[str]
) -> None:
    if "-o" not in arguments:
        arguments = [*arguments, "-o", "out.json"]
    before = names_in(there)
    assert_refused(run("identify", *arguments), there, before, *said)


def test_the_wrong_one_of_two_held_out_records_is_named(there: Path) -> None:
    write_csv(there / "wrong.csv", HEADER, WRONG_RECORDS["constant output"][0])
    slow = [[10 * k, *row[1:]] for k, row in enumerate(record_rows())]
    write_csv(there / "slow.csv", HEADER, slow)
    write_csv(there / "other.csv", HEADER, record_rows(300.0))
    before = names_in(there)
    for wrong, said in (("wrong.csv", "sampling interval"), ("slow.csv", "sampling interval")):
        result = run(
            *("identify", "record.csv", *COLUMNS, "-o", "out.json"),
            *("--validate", "other.csv", "--validate", wrong),
        )
        assert_refused(result, there, before, wrong, said)
    flat = [[k / RATE, k, 7] for k in range(99)]
    write_csv(there / "wrong.csv", HEADER, flat)
    result = run(
        *("identify", "record.csv", *COLUMNS, "-o", "out.json"),
        *("--validate", "other.csv", "--validate", "wrong.csv"),
    )
    assert_refused(result, there, before, "wrong.csv: column position_um: ", "vary, got 7.0")


def test_held_out_files_are_predicted_and_not_fitted(there: Path) -> None:
    write_csv(there / "other.csv", HEADER, record_rows(300.0))
    write_csv(there / "third.csv", HEADER, record_rows(200.0))
    options = ["--operators", "4"]
    plain = run("identify", "record.csv", *COLUMNS, *options, "-o", "plain.json")
    result = run(
        *("identify", "record.csv", *COLUMNS, *options, "-o", "found.json"),
        *("--validate", "other.csv", "--validate", "third.csv", "--validate-skip", "1s"),
    )
    assert result.exit_code == plain.exit_code == 0, result.output
    assert (there / "found.json").read_bytes() == (there / "plain.json").read_bytes()
    rows = [line.split() for line in result.stdout.splitlines() if "held out: " in line]
    assert [row[2:4] for row in rows] == [["other.csv", "800"], ["third.csv", "800"],
                                          ["all", "1600"]]  # fmt: skip


@pytest.mark.parametrize("begin", ["600", "3s"])
def test_the_end_of_a_record_is_predicted_and_not_fitted(there: Path, begin: str) -> None:
    options = [*COLUMNS, "--operators", "4"]
    result = run("identify", "record.csv", *options, "--validate-from", begin, "-o", "found.json")
    assert result.exit_code == 0, result.output
    run("identify", "record.csv", *options, "--rows", "600", "-o", "plain.json")
    assert (there / "found.json").read_bytes() == (there / "plain.json").read_bytes()
    row = next(line.split() for line in result.stdout.splitlines() if "held out: " in line)
    assert row[2:4] == ["record.csv", "400"]
    assert "loops, each left out of the fit in turn" in result.stdout


@pytest.mark.usefixtures("there")
def test_the_number_of_operators_is_chosen() -> None:
    result = run("identify", "record.csv", *COLUMNS, "--operators", "auto")
    assert result.exit_code == 0, result.output
    assert "operators chosen by cross-validation" in result.stdout
    assert "±" in result.stdout  # standard errors of the parameters


def test_seconds_to_skip_need_a_time_column(there: Path) -> None:
    rows = [row[1:] for row in record_rows()]
    write_csv(there / "untimed.csv", "drive_v,position_um", rows)
    before = names_in(there)
    result = run("identify", "untimed.csv", *COLUMNS, "--skip", "1s", "-o", "out.json")
    assert_refused(result, there, before, "untimed.csv", "--time")


@pytest.mark.parametrize("option", ["--dynamics", "--creep", "--dead-time"])
def test_what_is_in_seconds_needs_a_time_column(there: Path, option: str) -> None:
    write_csv(there / "untimed.csv", "drive_v,position_um", [row[1:] for row in record_rows()])
    before = names_in(there)
    result = run("identify", "untimed.csv", *COLUMNS, option, "1", "-o", "out.json")
    said = f"untimed.csv: {option} needs a time column (--time) or --rate"
    assert_refused(result, there, before, said)


def test_a_dead_time_in_samples_is_said_to_be_left_out(
    there: Path, recwarn: pytest.WarningsRecorder
) -> None:
    rows = record_rows()
    late = [[row[1], other[2]] for row, other in zip(rows[1:], rows, strict=False)]
    write_csv(there / "untimed.csv", "drive_v,position_um", late)
    result = run("identify", "untimed.csv", *COLUMNS, "--operators", "4", "-o", "out.json")
    assert result.exit_code == 0, result.output
    assert "without the dead time: its records have no time column" in result.stdout
    assert result.stderr == "" and not recwarn.list


def test_the_stage_has_the_limits_and_the_slew_rate_that_are_given(there: Path) -> None:
    options = ["--operators", "4", "--limits", "-350,300", "--slew", "2e4", "-o", "found.json"]
    assert run("identify", "record.csv", *COLUMNS, *options).exit_code == 0
    stage = mh.load(there / "found.json")
    assert isinstance(stage, mh.Stage)
    assert (stage.limits, stage.slew) == ((-350.0, 300.0), 2e4)
    assert stage.identified is not None and stage.identified["records"]


def test_records_of_different_rates_are_fitted_together(there: Path) -> None:
    # Hysteresis is independent of the rate: the same record again, at half the rate.
    rows = [[2.0 * sample / RATE, *row[1:]] for sample, row in enumerate(record_rows())]
    write_csv(there / "slow.csv", HEADER, rows)
    more = ["--operators", "4", "--dead-time", "0", "-o", "out.json", "--report", "out.html"]
    result = run("identify", "record.csv", "slow.csv", *COLUMNS, *more)
    assert result.exit_code == 0, result.output
    stage = mh.load(there / "out.json")
    assert isinstance(stage, mh.Stage)
    drive, measured = (column(there / "slow.csv", name) for name in ("drive_v", "position_um"))
    found = stage.hysteresis.forward().run(drive)
    assert np.abs(found - measured).max() < 1e-2 * np.ptp(measured)
    page = (there / "out.html").read_text("utf-8")
    # Its deviation is known at the rate of the first record alone.
    assert "Uncertainty of the prediction of record.csv" in page
    assert "Uncertainty of the prediction of slow.csv" not in page


@pytest.mark.parametrize(
    "arguments", [["bogus"], ["demo", "extra"], ["demo", "--out", "stage.json"]]
)
def test_other_wrong_commands(there: Path, arguments: list[str]) -> None:
    before = names_in(there)
    assert_refused(run(*arguments), there, before, arguments[-1])


@pytest.mark.parametrize("arguments", [[], ["--help"], ["identify", "-h"], ["--version"]])
def test_help_and_version_are_no_errors(arguments: list[str]) -> None:
    result = run(*arguments)
    assert result.exit_code == 0, result.output
    assert result.stdout and not result.stderr


def test_the_law_and_the_smoothness_are_chosen(there: Path) -> None:
    result = run(
        *("identify", "record.csv", *COLUMNS, "--operators", "8", "--smoothness", "auto"),
        *("--report", "report.html"),
    )
    assert result.exit_code == 0, result.output
    assert "weights chosen by cross-validation: the simplest candidate" in result.stdout
    assert "smoothness 0 chosen by cross-validation: the candidate that predicts" in result.stdout
    page = (there / "report.html").read_text("utf-8")
    assert "Chosen by cross-validation" in page and "held-out folds: smoothness" in page
