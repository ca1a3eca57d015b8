"""`mpi-hyst excite`: the files it writes, what it says, and how it refuses."""

from __future__ import annotations

import json
import shlex
from pathlib import Path
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from commands import assert_refused, column, names_in, run
from test_report import parsed, words

PLAN = ["--limits", "-20,120", "--rate", "100", "--slew", "200", "--cycles", "5", "--rest", "2"]
DEMAGNETIZE = ["--limits", "-20,120", "--rate", "100", "--slew", "200", "--cycles", "10"]
DEMAGNETIZE.append("--demagnetize")
FILES = {"fast.csv", "loops.csv", "plan.json", "plan.html"}


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_drives_are_those_of_the_library(here: Path) -> None:
    given = ["--fast-rate", "500", "--frequencies", "0.2,0.5", "--fast-signal", "multisine"]
    given += ["--fast-amplitude", "3", "--fast-frequency", "50"]
    shape = ["--shape", "sine", "--center", "40", "--start", "10"]
    result = run("excite", *PLAN, *given, *shape, "-o", "experiment")
    assert result.exit_code == 0, result.output
    options: dict[str, Any] = {"shape": "sine", "center": 40.0, "start": 10.0, "rest": 2.0}
    options |= {"fast_signal": "multisine", "fast_amplitude": 3.0, "fast_frequency": 50.0}
    options |= {"fast_rate": 500.0, "frequencies": (0.2, 0.5), "cycles": 5}
    made = mh.signals.experiment(-20.0, 120.0, slew=200.0, rate=100.0, **options)
    assert names_in(here / "experiment") == FILES
    for part in made:
        path = here / "experiment" / f"{part.name}.csv"
        np.testing.assert_array_equal(column(path, "voltage_v"), part.drive)
        seconds = np.arange(part.drive.size) / part.rate
        np.testing.assert_array_equal(column(path, "time_s"), seconds)
        for segment in part.segments:
            assert segment.name in result.stdout


def test_the_plan_says_what_is_in_the_files(here: Path) -> None:
    assert run("excite", *PLAN, "-o", "experiment").exit_code == 0
    plan = json.loads((here / "experiment" / "plan.json").read_text("utf-8"))
    assert (plan["schema"], plan["limits"]) == ("mpi_hyst/experiment/1", [-20.0, 120.0])
    for part in plan["parts"]:
        drive = column(here / "experiment" / part["file"], "voltage_v")
        assert part["samples"] == drive.size == part["segments"][-1]["stop"]
        assert (drive[0], drive[-1]) == (plan["start"], plan["start"])
        for segment in part["segments"]:
            own = drive[segment["start"] : segment["stop"]]
            assert (own.min(), own.max()) == (segment["low"], segment["high"])
            assert segment["purpose"]
    root = parsed(here / "experiment" / "plan.html")
    assert len(list(root.iter("img"))) == 1
    page = " ".join(words(root).split())
    for said in ("fast.csv, then loops.csv", "voltage (V)", "200.0 V/s", "rested at 0 V"):
        assert said in page
    assert plan["identify"] in page.replace("\\ ", "")
    assert f"--skip {plan['parts'][1]['initialization_samples']} --skip 0" in page


def test_the_commands_of_the_plan_work(here: Path) -> None:
    options = ["--fast-rate", "500", "--start", "30"]
    result = run("excite", *PLAN, *options, "-o", "experiment")
    assert result.exit_code == 0, result.output
    plan = json.loads((here / "experiment" / "plan.json").read_text("utf-8"))
    ratios = {"ra": 0.9, "rb": 0.3, "rc": 0.4}
    truth = mh.Stage(
        mh.ModifiedPrandtlIshlinskii.from_ratios(
            [4e-2, 3e-3, 2e-3], [0.0, 20.0, 40.0], **ratios, input_offset=50.0
        ),
        dynamics=mh.plant.SecondOrder(30.0, 0.5),
    )
    for part in plan["parts"]:
        drive = column(here / "experiment" / part["file"], "voltage_v")
        position = truth.plant(1.0 / part["rate_hz"]).run(drive)[0]
        rows = zip(drive.tolist(), position.tolist(), strict=True)
        lines = [f"{k / part['rate_hz']!r},{u!r},{y!r}" for k, (u, y) in enumerate(rows)]
        (here / part["record"]).write_text("\n".join(["time_s,voltage_v,position_um", *lines]))
    program, *arguments = shlex.split(plan["identify"])
    assert program == "mpi-hyst"
    result = run(*arguments)
    assert result.exit_code == 0, result.output
    stage = mh.load(here / "stage.json")
    assert isinstance(stage, mh.Stage)
    assert (stage.limits, stage.slew) == ((-20.0, 120.0), 200.0)
    assert isinstance(stage.dynamics, mh.plant.SecondOrder)
    # five operators for a hysteresis that has other thresholds
    assert stage.dynamics.frequency == pytest.approx(30.0, rel=0.05)
    root = parsed(here / "experiment" / "plan.html")
    command = str(next(iter(root.iter("pre"))).text)
    assert "--start 30" in command
    assert run(*shlex.split(command)[1:]).exit_code == 0
    drive = column(here / "demagnetize.csv", "voltage_v")
    assert (drive[0], drive[-1]) == (30.0, 30.0)


def test_a_csv_file_holds_everything(here: Path) -> None:
    result = run("excite", *PLAN, "--column", "drive_v", "-o", "all.csv", "--report", "plan.html")
    assert result.exit_code == 0, result.output
    (made,) = mh.signals.experiment(
        -20.0, 120.0, slew=200.0, rate=100.0, cycles=5, rest=2.0, joined=True
    )
    np.testing.assert_array_equal(column(here / "all.csv", "drive_v"), made.drive)
    assert names_in(here) == {"all.csv", "plan.html"}
    assert "identify all_record.csv" in result.stdout and "chirp" in result.stdout


def test_the_demagnetizing_sequence(here: Path) -> None:
    result = run("excite", *DEMAGNETIZE, "--center", "40", "-o", "drive.csv")
    assert result.exit_code == 0, result.output
    made = mh.signals.demagnetize(-20.0, 120.0, slew=200.0, rate=100.0, cycles=10, center=40.0)
    np.testing.assert_array_equal(column(here / "drive.csv", "voltage_v"), made)
    assert made.max() == 100.0  # as far above 40 as the limits allow below
    assert "input offset 40.00 V" in result.stdout and "21, 19 of them decaying" in result.stdout


def test_the_report_shows_the_demagnetizing_sequence(here: Path) -> None:
    result = run("excite", *DEMAGNETIZE, "-o", "drive.csv", "--report", "drive.html")
    assert result.exit_code == 0, result.output
    root = parsed(here / "drive.html")
    assert len(list(root.iter("img"))) == 1
    page = words(root)
    assert "drive.csv, voltage (V)" in page and "V/s" in page


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--limits", "5"], ["--limits", "LOW,HIGH"]),
        (["--limits", "5,5"], ["--limits: high: expected a number above low = 5.0, got 5.0"]),
        (["--limits", "nan,5"], ["--limits: low", "NaN"]),
        (["--rate", "0"], ["--rate: expected a finite number above 0, got 0.0"]),
        (["--rate", "20"], ["--rate: expected at least "]),
        (["--rate", "fast"], ["--rate", "'fast'"]),
        (["--slew", "-1"], ["--slew: expected a finite number above 0, got -1.0"]),
        (["--slew", "1e-9"], ["--rate", "(2^27)"]),
        (["--cycles", "0"], ["--cycles"]),
        (["--shape", "square"], ["--shape", "square"]),
        (["--center", "120"], ["--center: expected a number between low = -20.0 and"]),
        (["--start", "-21"], ["--start: expected a number from low = -20.0"]),
        (["--column", ""], ["--column", "''"]),
        (["--column", "time_s"], ["--column", "time_s"]),
        (["-o", "no/drive.csv"], ["does not exist"]),
        (["--report", "drive.csv"], ["two outputs"]),
    ],
)
@pytest.mark.parametrize("plan", [PLAN, DEMAGNETIZE])
def test_excite_refuses(here: Path, arguments: list[str], said: list[str], plan: list[str]) -> None:
    result = run("excite", *plan, "-o", "drive.csv", *arguments)
    assert_refused(result, here, set(), *said)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--frequencies", "1"], ["--frequencies", "FIRST,SECOND"]),
        (["--frequencies", "2,1"], ["--frequencies: expected two numbers above 0", "got 1.0"]),
        (["--rest", "-1"], ["--rest: expected a finite number, 0 or more, got -1.0"]),
        (["--fast-rate", "0"], ["--fast-rate: expected a finite number above 0, got 0.0"]),
        (["--fast-frequency", "51"], ["--fast-frequency: expected", "of --fast-rate, 100.0 Hz"]),
        (["--fast-amplitude", "71"], ["--fast-amplitude: expected", "got 71.0"]),
        (["--fast-signal", "noise"], ["--fast-signal", "noise"]),
        (["-o", "all.csv", "--fast-rate", "200"], ["--fast-rate: expected 100.0 Hz", "got 200.0"]),
        (["--demagnetize", "--rest", "2"], ["--rest: not with --demagnetize"]),
        (["--report", "experiment/loops.csv"], ["two outputs"]),
    ],
)
def test_an_experiment_is_refused(here: Path, arguments: list[str], said: list[str]) -> None:
    result = run("excite", *PLAN, "-o", "experiment", *arguments)
    assert_refused(result, here, set(), *said)


def test_a_directory_that_cannot_be_one_is_refused(here: Path) -> None:
    (here / "experiment").write_text("")
    result = run("excite", *PLAN, "-o", "experiment")
    assert_refused(result, here, {"experiment"}, "experiment: is not a directory")


@pytest.mark.parametrize("missing", ["--limits", "--rate", "--slew", "-o"])
def test_what_must_be_given_is_named(here: Path, missing: str) -> None:
    given = [*PLAN, "-o", "drive.csv"]
    place = given.index(missing)
    result = run("excite", *given[:place], *given[place + 2 :])
    assert_refused(result, here, set(), missing)
