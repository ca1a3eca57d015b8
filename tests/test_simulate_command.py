"""`mpi-hyst simulate`: the run it writes, its summary and report, and its errors."""

from __future__ import annotations

import math
from pathlib import Path

import mpi_hyst as mh
import numpy as np
import pytest
from commands import Array, actuator, assert_refused, column, names_in, run, write_csv
from test_report import parsed, sections, words

RATE = 10_000.0
LIMITS = (-400.0, 400.0)
STAGE = ["--dynamics", "400,0.95"]
SIMULATE = ["simulate", "stage.json", "reference.csv", "--limits", "-400,400"]
FILES = {"stage.json", "reference.csv", "bare.csv", "other.json"}


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A directory to be in, with models and a reference that starts and ends at rest."""
    monkeypatch.chdir(tmp_path)
    actuator().save(tmp_path / "stage.json")
    other = mh.ModifiedPrandtlIshlinskii.from_ratios(
        1.1 * actuator().weights, actuator().r, ra=0.9, rb=0.3, rc=0.4
    )
    other.save(tmp_path / "other.json")
    moves = mh.trajectories.PointToPoint(
        [0.0, 1.2, -0.9, 0.0], velocity=100.0, acceleration=1e5, jerk=2e8, dwell=0.01
    )
    reference = moves.sample(1.0 / RATE)[0].tolist()
    rows = [[sample / RATE, value] for sample, value in enumerate(reference)]
    write_csv(tmp_path / "reference.csv", "time_s,target_um", rows)
    write_csv(tmp_path / "bare.csv", "target_um", [[value] for _, value in rows])
    return tmp_path


def test_the_run_is_that_of_the_library(here: Path) -> None:
    more = ["--noise", "0.016", "--seed", "3", "--gains", "60,6000", "-o", "run.csv"]
    result = run(*SIMULATE, *STAGE, *more)
    assert result.exit_code == 0, result.output
    assert result.stderr == ""
    reference = column(here / "reference.csv", "target_um")
    stage = mh.Stage(actuator(), dynamics=mh.plant.SecondOrder(400.0, 0.95), noise=0.016)
    controller = stage.controller(1e-4, LIMITS, "preview", kp=60.0, ki=6000.0)
    expected = mh.plant.simulate(controller, stage.plant(1e-4, seed=3), reference)
    # the time column gives the sampling interval but for rounding
    for name, array in (
        ("drive", expected.drive),
        ("measured_um", expected.measured),
        ("position_um", expected.position),
    ):
        np.testing.assert_allclose(column(here / "run.csv", name), array, rtol=0, atol=1e-8)
    np.testing.assert_array_equal(column(here / "run.csv", "reference_um"), reference)
    times = column(here / "reference.csv", "time_s")
    np.testing.assert_array_equal(column(here / "run.csv", "time_s"), times)
    assert names_in(here) == FILES | {"run.csv"}
    for said in (
        "kp 60.00 V/µm, ki 6000 V/µm/s, given",
        "seed 3",
        "inverse dynamics and exact inverse of stage.json",
        "true position",
    ):
        assert said in result.stdout


def errors(*arguments: str) -> float:
    """The largest true error that is told, um."""
    result = run(*SIMULATE, *arguments)
    assert result.exit_code == 0, result.output
    (line,) = [line for line in result.stdout.splitlines() if "true position" in line]
    return float(line.split()[2])


def test_feed_forward_and_preview_buy_what_they_should(here: Path) -> None:
    assert names_in(here) == FILES
    full, plain = errors(*STAGE), errors(*STAGE, "--feedforward", "inverse")
    feedback = errors(*STAGE, "--feedforward", "none")
    assert 5.0 * full < plain and 1.3 * plain < feedback
    # what the controller does not know of the stage
    assert errors(*STAGE, "--plant", "other.json") > 5.0 * full
    delayed = [*STAGE, "--dead-time", "2.5e-4", "--amplifier-bandwidth", "1000"]
    assert errors(*delayed) < 0.2 * errors(*delayed, "--feedforward", "inverse")


def away(here: Path) -> Array:
    """A reference in motion, far from where the stage rests: with a time column and without."""
    reference: Array = 1.0 + 0.4 * np.sin(0.01 * np.arange(2000))
    rows = [[2.0 + k / RATE, value] for k, value in enumerate(reference.tolist())]
    write_csv(here / "reference.csv", "time_s,target_um", rows)
    write_csv(here / "bare.csv", "target_um", [row[1:] for row in rows])
    return reference


def test_a_lead_in_goes_from_rest_to_the_reference(here: Path) -> None:
    reference = away(here)
    assert errors(*STAGE) > 0.5  # um: half of the jump and more
    result = run(*SIMULATE, *STAGE, "--noise", "0", "--lead-in", "0.05", "-o", "run.csv")
    assert result.exit_code == 0, result.output
    assert "500 rows in front of the samples" in result.stdout and "2000 at" in result.stdout
    assert "warning" not in result.stdout
    position, times = (column(here / "run.csv", name) for name in ("position_um", "time_s"))
    np.testing.assert_allclose(times, 2.0 + (np.arange(2500) - 500) / RATE)
    followed = column(here / "run.csv", "reference_um")
    np.testing.assert_array_equal(followed[500:], reference)
    worst = np.abs(position - followed)[500:].max()
    assert worst < 0.005
    # what is told is of the reference alone
    (line,) = [line for line in result.stdout.splitlines() if "true position" in line]
    assert float(line.split()[2]) == pytest.approx(worst, rel=1e-3)
    # the way is that of precompensate
    drive = mh.Stage(actuator()).precompensate(reference, 1 / RATE, lead_in=0.05)
    way = actuator().forward().run(drive)[:500]
    np.testing.assert_allclose(followed[:500], way, rtol=0, atol=1e-12)


def test_times_before_the_reference_are_negative(here: Path) -> None:
    away(here)
    more = ["--rate", "10000", "--lead-in", "0.01", "-o", "run.csv", "--report", "run.html"]
    result = run(*SIMULATE[:2], "bare.csv", *SIMULATE[3:], *STAGE, *more)
    assert result.exit_code == 0, result.output
    expected = np.arange(-100, 2000) / RATE
    np.testing.assert_allclose(column(here / "run.csv", "time_s"), expected, atol=1e-12)
    assert "A lead-in from rest goes before." in words(parsed(here / "run.html"))


def test_a_reference_that_begins_with_a_jump_is_told(here: Path) -> None:
    assert "warning" not in run(*SIMULATE, *STAGE).stdout
    away(here)
    result = run(*SIMULATE, *STAGE)
    assert result.exit_code == 0, result.output
    assert "warning: reference.csv: begins 1.00 µm from where the stage rests" in result.stdout
    assert "--lead-in" in result.stdout


@pytest.mark.parametrize("feedforward", ["inverse", "none"])
def test_the_slew_rate_is_kept(here: Path, feedforward: str) -> None:
    options = [*STAGE, "--slew", "5000", "--feedforward", feedforward, "-o", "run.csv"]
    result = run(*SIMULATE, *options)
    assert result.exit_code == 0, result.output
    steps = np.abs(np.diff(column(here / "run.csv", "drive"), prepend=0.0))
    # the time column gives the sampling interval but for rounding
    assert steps.max() == pytest.approx(5000.0 / RATE)


def test_saturated_samples_and_the_rate_are_told(here: Path) -> None:
    arguments = ["--limits", "-100,100", "--rate", "10000", "--noise", "0.01"]
    result = run(*SIMULATE[:2], "bare.csv", *arguments, *STAGE, "-o", "run.csv")
    assert result.exit_code == 0, result.output
    drive = column(here / "run.csv", "drive")
    limited = int(((drive == 100.0) | (drive == -100.0)).sum())
    assert limited > 100
    assert f"{limited} of {drive.size} samples at -100 or 100" in result.stdout
    assert "-100.0 to 100.0" in result.stdout and "tuned" in result.stdout
    np.testing.assert_array_equal(column(here / "run.csv", "time_s"), np.arange(drive.size) * 1e-4)


def test_the_report_shows_the_run(here: Path) -> None:
    result = run(*SIMULATE, *STAGE, "--noise", "0.01", "--report", "run.html")
    assert result.exit_code == 0, result.output
    root = parsed(here / "run.html")
    assert sections(root) == ["tracking", "feedback"]
    assert len(list(root.iter("img"))) == 2
    page = words(root)
    for said in (
        "reference.csv on stage.json",
        "natural frequency 400.0 Hz, damping ratio 0.9500",
        "true position",
        "tuned",
        "Proportional and integral gain alone, without filters.",
    ):
        assert said in page
    result = run(*SIMULATE, *STAGE, "--gains", "60,6000", "--report", "given.html")
    assert result.exit_code == 0, result.output
    assert sections(parsed(here / "given.html")) == ["tracking"]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--limits", "5,5"], ["--limits", "above"]),
        (["--limits", "5"], ["--limits", "LOW,HIGH"]),
        (["--dynamics", "0,1"], ["--dynamics: expected a finite number above 0", "got 0.0"]),
        (["--amplifier-bandwidth", "-1"], ["--amplifier-bandwidth: expected", "got -1.0"]),
        (["--dead-time", "nan"], ["--dead-time: expected a finite number", "got NaN"]),
        (["--noise", "-1"], ["--noise: expected a finite number >= 0, got -1.0"]),
        (["--seed", "-1"], ["--seed: expected", "-1"]),
        (["--seed", "x"], ["--seed", "'x'"]),
        (["--lead-in", "-1"], ["--lead-in: expected a finite number above 0"]),
        (["--gains", "1"], ["--gains", "KP,KI"]),
        (["--gains", "1,-1"], ["--gains: expected a finite number >= 0, got -1.0"]),
        (["--feedforward", "both"], ["--feedforward", "both"]),
        (["--rate", "100"], ["--rate: reference.csv has the time column time_s"]),
        (["--column", "y"], ["reference.csv: no column 'y'"]),
        (["--plant", "none.json"], ["none.json"]),
        (["-o", "reference.csv"], ["reference.csv: is an input file"]),
        (["-o", "other.json", "--plant", "other.json"], ["other.json: is an input file"]),
        (["-o", "run", "--report", "run"], ["run: named for two outputs"]),
        (["--report", "no/run.html"], ["does not exist"]),
    ],
)
def test_simulate_refuses(here: Path, arguments: list[str], said: list[str]) -> None:
    assert_refused(run(*SIMULATE, *arguments), here, FILES, *said)


@pytest.mark.parametrize(
    ("rate", "said"),
    [
        ([], "bare.csv: expected a time column (time_s, time, t, or --time NAME) or --rate"),
        (["--rate", "0"], "--rate: expected a finite number above 0, got 0.0"),
        (["--rate", "nan"], "--rate: expected a finite number above 0, got nan"),
        (["--rate", "1e-200"], "--rate: "),
    ],
)
def test_a_reference_without_time_needs_a_rate(here: Path, rate: list[str], said: str) -> None:
    result = run(*SIMULATE[:2], "bare.csv", *SIMULATE[3:], *rate)
    assert_refused(result, here, FILES, said)


def test_what_cannot_be_inverted_or_named_is_refused(here: Path) -> None:
    falling = mh.PrandtlIshlinskii([1e-3, -2e-3], [0.0, 100.0])
    falling.save(here / "other.json")
    result = run("simulate", "other.json", *SIMULATE[2:])
    assert_refused(result, here, FILES, "other.json: ")
    write_csv(here / "bare.csv", "drive,target", [[k / RATE, math.sin(k)] for k in range(50)])
    time = ("--time", "drive", "--column", "target")
    result = run(*SIMULATE[:2], "bare.csv", *SIMULATE[3:], *time, "-o", "run.csv")
    assert_refused(result, here, FILES, "bare.csv: expected other columns", "drive")
    (here / "bare.csv").write_text("time_s,y\n0,0\n0.1,nan\n")
    result = run(*SIMULATE[:2], "bare.csv", *SIMULATE[3:])
    assert_refused(result, here, FILES, "bare.csv, line 3, column y: not finite")
