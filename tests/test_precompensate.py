"""`mpi-hyst precompensate`: the drive it writes, and how it refuses."""

from __future__ import annotations

import re
from pathlib import Path

import mpi_hyst as mh
import numpy as np
import pytest
from commands import (
    RATE,
    RATIOS,
    actuator,
    assert_refused,
    column,
    names_in,
    run,
    write_csv,
)
from mpi_hyst._cli.stage import name_options
from mpi_hyst._text import span, without_noise


def test_precompensate_makes_the_model_follow(there: Path) -> None:
    result = run("precompensate", "stage.json", "trajectory.csv", "-o", "drive.csv")
    assert result.exit_code == 0, result.output
    drive = column(there / "drive.csv", "drive")
    target = column(there / "trajectory.csv", "target_um")
    assert np.abs(actuator().forward().run(drive) - target).max() < 1e-14
    np.testing.assert_array_equal(
        column(there / "drive.csv", "time_s"), column(there / "trajectory.csv", "time_s")
    )
    assert (there / "drive.csv").read_text("utf-8").splitlines()[0] == "time_s,drive"
    assert "at rest at 0 V, never driven farther" in result.stdout
    assert "lead-in" not in result.stdout


@pytest.mark.filterwarnings("ignore:dead_time")
@pytest.mark.parametrize(
    "command",
    [
        ("precompensate", "judged.json", "trajectory.csv", "-o", "drive.csv"),
        ("simulate", "judged.json", "trajectory.csv"),
        ("export", "judged.json", "--c", "-o", "stage.h"),
    ],
)
def test_a_red_stage_is_told(there: Path, command: tuple[str, ...]) -> None:
    drive = mh.signals.decaying_triangle(100.0, 1.0, cycles=5, rate=1000)
    found = mh.identify(drive, actuator().forward().run(drive), operators=4, dead_time=2)
    found.stage.replace(limits=(-500.0, 500.0)).save(there / "judged.json")
    said = "mpi-hyst: note: judged.json: do not use it yet: "
    assert said not in run(*command).stderr
    text = (there / "judged.json").read_text("utf-8")
    red, ambers = re.subn(r'("severity":\s*)"amber"', r'\1"red"', text)
    assert ambers > 0
    (there / "judged.json").write_text(red, "utf-8")
    assert run(*command).stderr.count(said) == ambers


def test_arguments_in_a_message_are_options() -> None:
    names = {"reference": "wave.csv", "lead_in": "--lead-in"}
    error, warning = ValueError("reference[3]: give `lead_in`"), UserWarning("limits: not `other`")
    error.parameter = "reference"  # type: ignore[attr-defined]
    assert name_options(error, names) == "wave.csv, sample 3: give --lead-in"
    assert name_options(warning, names) == "--limits: not `other`"
    assert name_options(ValueError("reference: of nobody"), names) == "reference: of nobody"


def test_a_step_that_is_rounding_is_none_in_words(there: Path) -> None:
    rows = [[k / RATE, 1.0 + 0.5 * np.sin(k / 20.0)] for k in range(300)]
    write_csv(there / "offset.csv", "time_s,target_um", rows)
    given = ("precompensate", "stage.json", "offset.csv", "-o", "drive.csv", "--lead-in", "0.5")
    said = run(*given, "--history", "100,3.3").stdout
    # The file has what is put out.
    assert 0.0 < abs(column(there / "drive.csv", "drive")[0] - 3.3) < 1e-14
    assert re.search(r"\n  first step +0 V\n", said), said


def test_numbers_are_rounding_beside_others() -> None:
    assert without_noise(-2e-15, 150.0) == 0.0 and without_noise(2e-9, 150.0) == 2e-9
    assert without_noise(2e-15, 1e-12) == 2e-15 and without_noise(0.0, 0.0) == 0.0
    assert span(-2e-15, 150.0, "V") == "0 to 150.0 V"
    assert span(-150.0, 1e-14, "") == "-150.0 to 0"
    assert span(-2e-15, 1e-15, "V") == "-2.000e-15 to 1.000e-15 V"


def test_precompensate_tells_what_the_limits_held_back(there: Path) -> None:
    result = run(
        *("precompensate", "stage.json", "trajectory.csv", "-o", "drive.csv"),
        *("--column", "target_um", "--limits", "-150,200"),
    )
    assert result.exit_code == 0, result.output
    drive = column(there / "drive.csv", "drive")
    at_limit = (drive == -150.0) | (drive == 200.0)
    target = column(there / "trajectory.csv", "target_um")
    assert (drive.min(), drive.max()) == (-150.0, 200.0)
    missed = np.abs(actuator().forward().run(drive) - target)
    assert missed[~at_limit].max() < 1e-14 < missed[at_limit].min()
    assert f"-150 to 200 V, reached by {at_limit.sum()} of 300 samples" in result.stdout
    assert f"warning: trajectory.csv: {at_limit.sum()} of 300 drives were held" in result.stdout


def test_precompensate_inverts_dynamics(there: Path) -> None:
    result = run(
        *("precompensate", "stage.json", "trajectory.csv", "-o", "drive.csv"),
        *("--dynamics", "40,0.7", "--dead-time", "0.005", "--amplifier-bandwidth", "60"),
    )
    assert result.exit_code == 0, result.output
    target = column(there / "trajectory.csv", "target_um")
    stage = mh.Stage(
        actuator(),
        dynamics=mh.plant.SecondOrder(40.0, 0.7),
        dead_time=0.005,
        amplifier_bandwidth=60.0,
    )
    with pytest.warns(UserWarning, match="begins in motion"):
        expected = stage.precompensate(target, 1 / RATE)
    # the times in the file are rounded, and with them the sampling interval
    np.testing.assert_allclose(column(there / "drive.csv", "drive"), expected, rtol=1e-9)
    assert "natural frequency 40.00 Hz, damping ratio 0.7000" in result.stdout
    assert "dead time 5.000 ms" in result.stdout
    assert "begins in motion, so the drive begins with a step of" in result.stdout


def test_a_lead_in_moves_the_stage_to_the_beginning(there: Path) -> None:
    rows = [[2.0 + k / RATE, 1.0 + 0.5 * np.sin(k / 20.0)] for k in range(300)]
    write_csv(there / "offset.csv", "time_s,target_um", rows)
    given = ("precompensate", "stage.json", "offset.csv", "-o", "drive.csv")
    before = names_in(there)
    refused = run(*given)
    assert_refused(refused, there, before, "offset.csv, sample 0: expected the position")
    assert "give --lead-in, the" in refused.stderr and "or --start, the drive" in refused.stderr
    result = run(*given, "--lead-in", "0.25")
    assert result.exit_code == 0, result.output
    drive, times = column(there / "drive.csv", "drive"), column(there / "drive.csv", "time_s")
    assert drive.size == 350 and "50 rows in front of the samples" in result.stdout
    np.testing.assert_allclose(times, 2.0 + (np.arange(350) - 50) / RATE)
    position = actuator().forward().run(drive)[50:]
    np.testing.assert_allclose(position, [row[1] for row in rows], atol=1e-12)


def test_a_history_is_taken_over_and_told(there: Path) -> None:
    given = ("precompensate", "stage.json", "trajectory.csv", "-o", "drive.csv", "--lead-in", "0.1")
    result = run(*given, "--history", "0,500,0")
    assert result.exit_code == 0, result.output
    assert "at rest at 0 V, then driven to 0, 500, 0 V" in result.stdout
    bench = actuator().forward()
    bench.run(np.concatenate([np.linspace(0.0, 500.0, 40), np.linspace(500.0, 0.0, 40)]))
    position = bench.run(column(there / "drive.csv", "drive"))[20:]
    np.testing.assert_allclose(position, column(there / "trajectory.csv", "target_um"), atol=1e-12)
    before = names_in(there)
    for history, said in (("0,x", "expected V,V,..., any numbers"), ("0,nan", "--history")):
        assert_refused(run(*given, "--history", history), there, before, said)


def test_a_trajectory_in_another_unit_is_refused(there: Path) -> None:
    write_csv(there / "nm.csv", "time_s,position_nm", [[k / RATE, 0.0] for k in range(9)])
    before = names_in(there)
    for command in ("precompensate", "simulate"):
        given = (command, "stage.json", "nm.csv", "-o", "out.csv")
        expected = "nm.csv: position_nm: expected um, as the stage has, got nm"
        assert_refused(run(*given), there, before, expected)


def test_a_slew_rate_is_kept_and_told(there: Path) -> None:
    result = run(
        *("precompensate", "stage.json", "trajectory.csv", "-o", "drive.csv", "--slew", "1000")
    )
    assert result.exit_code == 0, result.output
    drive = column(there / "drive.csv", "drive")
    # the times in the file are rounded, and with them the sampling interval
    assert np.abs(np.diff(drive, prepend=0.0)).max() == pytest.approx(1000.0 / RATE)
    assert "slew rate             1000 V/s" in result.stdout
    assert "trajectory.csv: " in result.stdout and "held back by the slew rate" in result.stdout


def test_the_drive_starts_from_the_limit_nearest_to_zero(there: Path) -> None:
    dynamics = mh.plant.SecondOrder(40.0, 0.7)
    stage = mh.Stage(actuator(), limits=(50.0, 400.0), dynamics=dynamics, units=("mV", "um"))
    stage.save(there / "stage.json")
    rest = stage.forward(1.0 / RATE).settle(50.0)
    rows = [[k / RATE, rest + 0.004 * k] for k in range(200)]
    write_csv(there / "ramp.csv", "time_s,target_um", rows)
    result = run("precompensate", "stage.json", "ramp.csv", "-o", "drive.csv")
    assert result.exit_code == 0, result.output
    told = {line[2:22].strip(): line[22:].strip() for line in result.stdout.splitlines()}
    assert told["before"].startswith("at rest at 50 mV, ")
    first = column(there / "drive.csv", "drive_mv")[0]
    assert first > 51.0
    assert told["first step"].endswith(" mV")
    assert float(told["first step"].split()[0]) == pytest.approx(first - 50.0, rel=1e-3)
    assert told["limits"].startswith("50 to 400 mV, ")
    assert float(told["max |model - target|"].split()[0]) < 0.01


def test_the_stage_rests_at_the_drive_that_is_given(there: Path) -> None:
    stage = mh.Stage(actuator(), dynamics=mh.plant.SecondOrder(40.0, 0.7))
    stage.save(there / "stage.json")
    rest = stage.forward(1.0 / RATE).settle(120.0)
    rows = [[k / RATE, rest - 0.2 * (1.0 - np.cos(k / 20.0))] for k in range(300)]
    write_csv(there / "wave.csv", "time_s,target_um", rows)
    given = ("precompensate", "stage.json", "wave.csv", "-o", "drive.csv", "--start")
    result = run(*given, "120")
    assert result.exit_code == 0, result.output
    told = {line[2:22].strip(): line[22:].strip() for line in result.stdout.splitlines()}
    assert told["before"].startswith("at rest at 120 V, ")
    assert abs(float(told["first step"].split()[0])) < 2.0
    assert float(told["max |model - target|"].split()[0]) < 0.01


def test_precompensate_says_what_dynamics_cannot_follow(there: Path) -> None:
    rows = [[k / RATE, float(k // 20 % 2)] for k in range(300)]
    write_csv(there / "steps.csv", "time_s,target_um", rows)
    result = run(
        *("precompensate", "stage.json", "steps.csv", "-o", "drive.csv", "--dynamics", "40,0.7")
    )
    assert result.exit_code == 0, result.output
    assert "warning: steps.csv: the stage misses it by" in result.stdout


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--dynamics", "0,0.7"], ["--dynamics: expected a finite number above 0"]),
        (["--dynamics", "400"], ["FREQUENCY,DAMPING"]),
        (["--slew", "0"], ["--slew: expected a finite number > 0, got 0.0"]),
        (["--start", "inf"], ["--start: expected"]),
        (["--lead-in", "-1"], ["--lead-in: expected a finite number above 0"]),
        (["--dead-time", "-1"], ["--dead-time: expected 0 s or more, got -1.0"]),
        (["--dead-time", "1e9"], ["--dead-time: expected at most 2^20 sampling intervals"]),
        (
            ["--amplifier-bandwidth", "0"],
            ["--amplifier-bandwidth: expected a finite number above 0"],
        ),
    ],
)
def test_precompensate_refuses_dynamics(there: Path, options: list[str], said: list[str]) -> None:
    before = names_in(there)
    given = ("precompensate", "stage.json", "trajectory.csv", "-o", "drive.csv", *options)
    assert_refused(run(*given), there, before, *said)


@pytest.mark.parametrize(
    ("header", "times", "said"),
    [
        ("target_um", None, "expected a time column (time_s, time"),
        ("time_s,target_um", 0.7, "equal time steps"),
    ],
)
def test_precompensate_needs_to_know_the_sampling(
    there: Path, header: str, times: float | None, said: str
) -> None:
    rows: list[list[object]] = [[0.0] if times is None else [k**times, 0.0] for k in range(20)]
    write_csv(there / "other.csv", header, rows)
    before = names_in(there)
    given = ("precompensate", "stage.json", "other.csv", "-o", "drive.csv", "--dead-time", "0.01")
    assert_refused(run(*given), there, before, "other.csv", said)


@pytest.mark.parametrize(
    ("files", "options", "said"),
    [
        ({}, ["missing.json", "trajectory.csv"], ["missing.json", "No such file"]),
        ({}, ["stage.json", "missing.csv"], ["missing.csv", "No such file"]),
        ({"cut.json": '{"schema": "mpi_h'}, ["cut.json", "trajectory.csv"], ["cut.json"]),
        ({"old.json": '{"schema": "mpi_hyst/model/0"}'}, ["old.json", "trajectory.csv"],
         ["old.json", "schema"]),
        ({}, ["record.csv", "trajectory.csv"], ["record.csv", "not a model file"]),
        ({"flat.csv": "time_s,target_um\n0,text\n"}, ["stage.json", "flat.csv"], ["no numeric"]),
        ({"nan.csv": "time_s,target_um\n0,1\n1,nan\n"}, ["stage.json", "nan.csv"],
         ["nan.csv, line 3, column target_um"]),
        ({}, ["stage.json", "record.csv"], ["--column", "drive_v, position_um"]),
        ({}, ["stage.json", "trajectory.csv", "--column", "x"], ["no column 'x'", "target_um"]),
        ({}, ["stage.json", "trajectory.csv", "--limits", "5"], ["--limits", "LOW,HIGH"]),
        ({}, ["stage.json", "trajectory.csv", "--limits", "5,-5"], ["--limits:", "-5"]),
        ({}, ["stage.json", "trajectory.csv", "--limits", "nan,5"], ["--limits:", "NaN"]),
        ({}, ["stage.json", "trajectory.csv", "-o", "stage.json"], ["overwritten"]),
        ({}, ["stage.json", "trajectory.csv", "-o", "trajectory.csv"], ["overwritten"]),
        ({}, ["stage.json", "trajectory.csv", "-o", "no/drive.csv"], ["does not exist"]),
    ],
)  # fmt: skip
def test_precompensate_refuses(
    there: Path, files: dict[str, str], options: list[str], said: list[str]
) -> None:
    for name, text in files.items():
        (there / name).write_text(text, encoding="utf-8")
    before = names_in(there)
    contents = {path: path.read_bytes() for path in there.iterdir()}
    given = [] if "-o" in options else ["-o", "drive.csv"]
    assert_refused(run("precompensate", *options, *given), there, before, *said)
    assert contents == {path: path.read_bytes() for path in there.iterdir()}


@pytest.fixture
def warm(there: Path) -> mh.plant.TemperatureTerm:
    """Write a stage that follows a temperature, and a trajectory with one."""
    term = mh.plant.TemperatureTerm(0.02, 0.05, 23.0)
    mh.Stage(actuator(), temperature=term).save(there / "warm.json")
    rows = [[k / RATE, np.sin(k / 50.0), 25.0 + 2.0 * np.sin(k / 80.0)] for k in range(600)]
    write_csv(there / "warm.csv", "time_s,target_um,room_degC", rows)
    return term


@pytest.mark.parametrize("more", [[], ["--column", "target_um"]])
def test_a_temperature_is_taken_from_the_target(
    there: Path, warm: mh.plant.TemperatureTerm, more: list[str]
) -> None:
    given = ("precompensate", "warm.json", "warm.csv", "-o", "drive.csv", "--lead-in", "0.1")
    result = run(*given, "--temperature", "room_degC", *more)
    assert result.exit_code == 0, result.output
    target = column(there / "warm.csv", "target_um")
    added = warm.response(column(there / "warm.csv", "room_degC"), 1.0 / RATE)
    drive = column(there / "drive.csv", "drive")
    reached = actuator().forward().run(drive)[-target.size :] + added
    assert np.abs(reached - target).max() < 1e-12
    temperatures = re.search(r"\n  temperature +(.+)\n", result.stdout)
    assert temperatures is not None
    assert temperatures[1].startswith("23.00 to 27.00 degC, which adds ")
    assert temperatures[1].endswith(" um; nothing at 23")
    assert "warning" not in result.output and "temperature" not in result.stderr


def test_a_temperature_that_is_not_given_is_told(
    there: Path, warm: mh.plant.TemperatureTerm
) -> None:
    target = ("--column", "target_um")
    said = f"warm.json: follows a temperature, which is taken to stay at {warm.reference:g}"
    result = run("precompensate", "warm.json", "warm.csv", "-o", "drive.csv", *target)
    assert result.exit_code == 0, result.output
    assert f"{said}; --temperature COLUMN says otherwise\n" in result.stderr
    drive = column(there / "drive.csv", "drive")
    missed = actuator().forward().run(drive) - column(there / "warm.csv", "target_um")
    assert np.abs(missed).max() < 1e-12
    simulated = run("simulate", "warm.json", "warm.csv", *target, "--limits", "-500,500")
    assert simulated.exit_code == 0, simulated.output
    assert f"{said}\n" in simulated.stderr


@pytest.mark.parametrize(
    ("stage", "options", "said"),
    [
        ("stage.json", ["--temperature", "room_degC"],
         ["--temperature: expected none", "stage.json", "room_degC"]),
        ("warm.json", ["--temperature", "room"], ["warm.csv", "no column 'room'", "room_degC"]),
        ("warm.json", ["--temperature", "target_um", "--column", "target_um"],
         ["--temperature: expected another column than target and time, got target_um"]),
        ("warm.json", ["--temperature", "time_s", "--column", "target_um"],
         ["--temperature: expected another column than target and time, got time_s"]),
        ("warm.json", [], ["--column", "target_um, room_degC"]),
    ],
)  # fmt: skip
def test_a_wrong_temperature_is_refused(
    there: Path, warm: mh.plant.TemperatureTerm, stage: str, options: list[str], said: list[str]
) -> None:
    assert warm.reference == 23.0
    before = names_in(there)
    given = ("precompensate", stage, "warm.csv", "-o", "drive.csv", *options)
    assert_refused(run(*given), there, before, *said)


def test_a_temperature_that_is_no_number_is_refused(
    there: Path, warm: mh.plant.TemperatureTerm
) -> None:
    write_csv(
        there / "warm.csv",
        "time_s,target_um,room_degC",
        [[0.0, 0.0, warm.reference], [1e-3, 0.0, "nan"]],
    )
    before = names_in(there)
    given = ("precompensate", "warm.json", "warm.csv", "-o", "drive.csv")
    result = run(*given, "--temperature", "room_degC")
    assert_refused(result, there, before, "warm.csv, line 3, column room_degC")


def test_precompensate_says_why_a_model_has_no_inverse(there: Path) -> None:
    wrong = mh.ModifiedPrandtlIshlinskii.from_ratios([1e-3, -2e-3], [0.0, 10.0], **RATIOS)
    wrong.save(there / "wrong.json")
    before = names_in(there)
    result = run("precompensate", "wrong.json", "trajectory.csv", "-o", "drive.csv")
    assert_refused(result, there, before, "wrong.json", "not invertible")
