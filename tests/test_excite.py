"""`mpi-hyst excite`: the files it writes, what it says, and how it refuses."""

from __future__ import annotations

from pathlib import Path

import mpi_hyst as mh
import numpy as np
import pytest
from commands import assert_refused, column, names_in, run
from test_report import parsed, words

PLAN = ["--limits", "-20,120", "--rate", "100", "--slew", "200", "--cycles", "10"]


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_drive_is_that_of_the_library(here: Path) -> None:
    options = ["--shape", "sine", "--center", "40", "--start", "10"]
    result = run("excite", *PLAN, *options, "-o", "drive.csv")
    assert result.exit_code == 0, result.output
    made = mh.signals.excitation(
        -20.0, 120.0, slew=200.0, rate=100.0, cycles=10, shape="sine", center=40.0, start=10.0
    )
    np.testing.assert_array_equal(column(here / "drive.csv", "voltage_v"), made.drive)
    np.testing.assert_array_equal(
        column(here / "drive.csv", "time_s"), np.arange(made.drive.size) / 100.0
    )
    assert names_in(here) == {"drive.csv"}
    for said in (
        *(f"{made.drive.size} at 100.0 Hz", f"{(made.drive.size - 1) / 100:.2f} s"),
        *("-20.00 to 120.0 V", f"--skip {made.initialization_samples} ", "23, 19 of them decaying"),
    ):
        assert said in result.stdout


def test_the_drive_can_be_played_recorded_and_identified(here: Path) -> None:
    assert run("excite", *PLAN, "--column", "drive_v", "--out", "drive.csv").exit_code == 0
    drive = column(here / "drive.csv", "drive_v")
    ratios = {"ra": 0.9, "rb": 0.3, "rc": 0.4}
    actuator = mh.ModifiedPrandtlIshlinskii.from_ratios(
        [4e-2, 3e-3, 2e-3], [0.0, 20.0, 40.0], **ratios, input_offset=50.0
    )
    stream = actuator.forward()
    stream.run([100.0, 0.0])
    lines = ["drive_v,position_um"]
    lines += [
        f"{u!r},{y!r}" for u, y in zip(drive.tolist(), stream.run(drive).tolist(), strict=True)
    ]
    (here / "record.csv").write_text("\n".join(lines))
    skip = str(
        mh.signals.excitation(
            -20.0, 120.0, slew=200.0, rate=100.0, cycles=10
        ).initialization_samples
    )
    result = run(
        *("identify", "record.csv", "--input", "drive_v", "--output", "position_um"),
        *("--skip", skip, "--operators", "10", "-o", "stage.json"),
    )
    assert result.exit_code == 0, result.output
    stage = mh.load(here / "stage.json")
    assert isinstance(stage, mh.Stage)
    found = stage.forward(0.01).run(drive)
    measured = column(here / "record.csv", "position_um")
    assert np.abs(found - measured)[int(skip) :].max() < 2e-3 * np.ptp(measured)


def test_the_demagnetizing_sequence(here: Path) -> None:
    result = run("excite", *PLAN, "--demagnetize", "--center", "40", "-o", "drive.csv")
    assert result.exit_code == 0, result.output
    made = mh.signals.demagnetize(-20.0, 120.0, slew=200.0, rate=100.0, cycles=10, center=40.0)
    np.testing.assert_array_equal(column(here / "drive.csv", "voltage_v"), made)
    assert made.max() == 100.0  # as far above 40 as the limits allow below
    assert "input offset 40.00 V" in result.stdout and "skip" not in result.stdout


@pytest.mark.parametrize("more", [[], ["--demagnetize"]])
def test_the_report_shows_the_drive(here: Path, more: list[str]) -> None:
    result = run("excite", *PLAN, *more, "-o", "drive.csv", "--report", "drive.html")
    assert result.exit_code == 0, result.output
    root = parsed(here / "drive.html")
    assert len(list(root.iter("img"))) == 1
    page = words(root)
    assert "drive.csv, voltage (V)" in page and "V/s" in page
    assert ("initialization" in page) == (not more)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--limits", "5"], ["--limits", "LOW,HIGH"]),
        (["--limits", "5,5"], ["--limits: high: expected a number above low = 5.0, got 5.0"]),
        (["--limits", "nan,5"], ["--limits: low", "NaN"]),
        (["--rate", "0"], ["--rate: expected a finite number above 0, got 0.0"]),
        (["--rate", "50"], ["--rate: expected at least 57.142857 Hz"]),
        (["--rate", "fast"], ["--rate", "'fast'"]),
        (["--slew", "-1"], ["--slew: expected a finite number above 0, got -1.0"]),
        (["--slew", "1e-9"], ["--rate", "(2^27)"]),
        (["--cycles", "0"], ["--cycles"]),
        (["--shape", "square"], ["--shape", "square"]),
        (["--center", "120"], ["--center: expected a number between low = -20.0 and"]),
        (["--start", "-21"], ["--start: expected a number from low = -20.0"]),
        (["--column", ""], ["--column", "''"]),
        (["--column", "time_s"], ["--column", "time_s"]),
        (["-o", "."], ["is a directory"]),
        (["-o", "no/drive.csv"], ["does not exist"]),
        (["--report", "drive.csv"], ["two outputs"]),
    ],
)
@pytest.mark.parametrize("more", [[], ["--demagnetize"]])
def test_excite_refuses(here: Path, arguments: list[str], said: list[str], more: list[str]) -> None:
    result = run("excite", *PLAN, "-o", "drive.csv", *more, *arguments)
    assert_refused(result, here, set(), *said)


@pytest.mark.parametrize("missing", ["--limits", "--rate", "--slew", "-o"])
def test_what_must_be_given_is_named(here: Path, missing: str) -> None:
    given = [*PLAN, "-o", "drive.csv"]
    place = given.index(missing)
    result = run("excite", *given[:place], *given[place + 2 :])
    assert_refused(result, here, set(), missing)
