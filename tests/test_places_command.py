"""The command places: drives, images, pairs and lengths in files; stage, image and report out."""

from __future__ import annotations

from pathlib import Path

import mpi_hyst as mh
import numpy as np
import pytest
from commands import assert_refused, run
from support import Array
from test_places import lengths_of, simulated

DT = 0.005


@pytest.fixture
def room(tmp_path: Path) -> Path:
    u, y, pairs = simulated()
    table = np.column_stack([np.arange(u.size) * DT, u])
    np.savetxt(tmp_path / "drive.csv", table, delimiter=",", header="time_s,drive_v", comments="")
    np.save(tmp_path / "pairs.npy", pairs)
    np.savetxt(tmp_path / "lengths.csv", lengths_of(y, [(50, 150)]), delimiter=",")
    return tmp_path


def given(room: Path) -> list[str]:
    return ["places", str(room / "drive.csv"), "--lengths", str(room / "lengths.csv")]


def test_pairs_of_a_file_give_a_stage(room: Path) -> None:
    result = run(*given(room), "--pairs", str(room / "pairs.npy"), "-o", str(room / "stage.json"))
    assert result.exit_code == 0, result.output
    assert "verdict: green" in result.stdout
    u, y, pairs = simulated()
    found = mh.identify_places(u, pairs, lengths_of(y, [(50, 150)]), dt=DT)
    stage = mh.load(room / "stage.json")
    assert isinstance(stage, mh.Stage)
    assert stage.forward(DT).run(u) == pytest.approx(found.predict(u), abs=1e-6)


def stage_of(room: Path, *words: str) -> mh.Stage:
    """Return the stage that the command makes of the drive and what else is said."""
    result = run("places", str(room / "drive.csv"), *words, "-o", str(room / "stage.json"))
    assert result.exit_code == 0, result.output
    stage = mh.load(room / "stage.json")
    assert isinstance(stage, mh.Stage)
    return stage


def test_fringes_give_a_stage(room: Path) -> None:
    u, y, _ = simulated()
    np.save(room / "signal.npy", np.cos(4 * np.pi * y / 0.2))
    stage = stage_of(room, "--fringes", str(room / "signal.npy"), "--wavelength", "0.2")
    assert np.std(stage.forward(DT).run(u) - y) < 0.01 * np.ptp(y)


def test_lengths_alone_give_a_stage_with_the_options_that_are_asked_for(room: Path) -> None:
    u, y, _ = simulated()
    at = range(10, u.size, 10)
    seen = 20.0 + 5.0 * np.sin(np.arange(u.size) / 70.0)
    lengths = lengths_of(y + 0.01 * seen, [(0, k) for k in at])
    np.savetxt(room / "lengths.csv", lengths, delimiter=",")
    np.savetxt(room / "temperature.txt", seen)
    words = ["--lengths", str(room / "lengths.csv"), "--temperature", str(room / "temperature.txt")]
    options = ["--dead-time", "0", "--creep", "none", "--model", "conventional"]
    more = ["--smoothness", "0.001", "--operators", "15", "--thermal-lag", "0"]
    stage = stage_of(room, *words, *options, *more)
    assert stage.dead_time == 0.0 and stage.creep is None
    assert stage.temperature is not None
    assert stage.temperature.sensitivity == pytest.approx(0.01, abs=1e-3)
    assert stage.temperature.time_constant == 0.0
    assert len(stage.hysteresis.weights) == 15
    assert np.std(stage.forward(DT).run(u) - y) < 0.01 * np.ptp(y)


def test_a_gauge_keeps_its_units(room: Path) -> None:
    text = (room / "drive.csv").read_text("utf-8").replace("drive_v", "load [kg]", 1)
    (room / "loads.csv").write_text(text, "utf-8")
    words = ["--lengths", str(room / "lengths.csv"), "--pairs", str(room / "pairs.npy")]
    more = ["--position-unit", "mV", "-o", str(room / "cell.json")]
    result = run("places", str(room / "loads.csv"), *words, *more)
    assert result.exit_code == 0, result.output
    cell = mh.load(room / "cell.json")
    assert isinstance(cell, mh.Stage) and cell.units == ("kg", "mV")
    assert stage_of(room, *words).units == ("V", "um")


def test_without_any_length_it_is_refused(room: Path) -> None:
    before = {path.name for path in room.iterdir()}
    result = run("places", str(room / "drive.csv"), "--pairs", str(room / "pairs.npy"))
    assert_refused(
        result, room, before, "--lengths: expected known lengths, or --fringes, got neither"
    )


def write_scan(room: Path) -> Array:
    """Write images of 64 lines by 64 pixels, and return the drive."""
    pixels, lines = 64, 64
    there = np.linspace(-1.0, 1.0, pixels)
    line = np.concatenate([there, there[::-1]])
    way = np.concatenate([np.linspace(0, 1, pixels), np.linspace(1, -1, pixels)])
    u = 2.0 * np.concatenate([way, np.tile(line, lines)])
    model = mh.PrandtlIshlinskii([0.6, 0.15, 0.1], [0.0, 0.3, 0.8])
    at = model.forward().run(u)[way.size :].reshape(lines, 2, pixels)
    height = np.sin(9.0 * at) + np.sin(14.0 * at + 1.0)
    np.save(room / "trace.npy", height[:, 0])
    np.savetxt(room / "retrace.csv", height[:, 1], delimiter=",")
    table = np.column_stack([np.arange(u.size) * DT, u])
    np.savetxt(room / "drive.csv", table, delimiter=",", header="time_s,drive_v", comments="")
    length = at[0, 0, 50] - at[0, 0, 10]
    np.savetxt(room / "lengths.csv", [(0, way.size + 10, way.size + 50, length)], delimiter=",")
    return u


def test_images_give_a_corrected_image_and_a_report(room: Path) -> None:
    pytest.importorskip("skimage", reason="the extra `images` is not installed")
    write_scan(room)
    images = ["--trace", str(room / "trace.npy"), "--retrace", str(room / "retrace.csv")]
    outputs = ["--corrected", str(room / "even.npy"), "--report", str(room / "report.html")]
    result = run(*given(room), *images, "--before", "128", *outputs)
    assert result.exit_code == 0, result.output
    assert "one_loop_size" in result.stdout
    assert np.load(room / "even.npy").shape == (64, 64)
    text = (room / "report.html").read_text("utf-8")
    assert "The image before and after" in text and "data:image/svg+xml" in text
    (line,) = (one for one in result.stdout.splitlines() if "trace and retrace differ" in one)
    before, after = (float(word) for word in line.split() if word[0].isdigit())
    assert after < 0.2 * before


def test_images_that_show_nothing_in_common_are_named(room: Path) -> None:
    pytest.importorskip("skimage", reason="the extra `images` is not installed")
    write_scan(room)
    shape = np.load(room / "trace.npy").shape
    np.save(room / "trace.npy", np.random.default_rng(4).normal(size=shape))
    images = ["--trace", str(room / "trace.npy"), "--retrace", str(room / "retrace.csv")]
    result = run(*given(room), *images, "--before", "128")
    assert result.exit_code == 2, result.output
    assert "trace.npy: expected marks that are in" in result.stderr
    assert "retrace.csv, too, lines in the order of time; found none" in result.stderr


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--model", "plain"], "is not one of"),
        (["--creep", "some"], "expected auto, none, log or a whole number from 1 on, got 'some'"),
        (["--pairs", "pairs.npy", "--dead-time", "1e6"], "--dead-time: expected"),
        (["--pairs", "pairs.npy", "--smoothness", "-1"], "--smoothness: expected"),
        (["--fringes", "signal.npy"], "--wavelength: expected that of the --fringes, got none"),
        (
            ["--fringes", "pairs.npy", "--wavelength", "0.6"],
            "pairs.npy: expected a number for each of",
        ),
        (
            ["--fringes", "signal.npy", "--wavelength", "-1"],
            "--wavelength: expected a number above",
        ),
        (["--fringes", "signal.npy", "--wavelength", "1", "--lag", "-1"], "--lag: expected 0"),
        (
            ["--pairs", "pairs.npy", *["--temperature", "signal.npy"] * 2],
            "--temperature: expected one for each of 1 drives, got 2",
        ),
        (["--trace", "trace.npy"], "--retrace: expected one for each --trace, got 1 and 0"),
        (["--pairs", "trace.npy"], "--pairs: expected rows of 3 numbers"),
        (["--pairs", "drive.csv"], "drive.csv: expected a table of numbers"),
        (["--pairs", "signal.npy"], "signal.npy: expected rows and columns, got shape (8320,)"),
        (["--pairs", "complex.npy"], "complex.npy: expected a table of numbers, .npy or text: its"),
        (
            ["--trace", "narrow.npy", "--retrace", "narrow.npy"],
            "narrow.npy: expected lines of 16 pixels or more, got 1",
        ),
        (
            ["--trace", "trace.npy", "--retrace", "narrow.npy"],
            "narrow.npy: expected the shape of the trace, (64, 64), got (64, 1)",
        ),
        (
            ["--trace", "two.npy", "--retrace", "back.npy", "--before", "128"],
            "--trace and --retrace: expected at least 10 pairs and lengths that say something",
        ),
        (
            ["--pairs", "pairs.npy", "--before", "-1"],
            "--before: expected samples from 0 on, one number for all drives or one for each of 1,"
            " got -1",
        ),
        (["--pairs", "pairs.npy", "--corrected", "even.npy"], "--corrected: expected --trace"),
        (["--pairs", "pairs.npy", "-o", "pairs.npy"], "is an input file"),
    ],
)
def test_wrong_input_is_refused(room: Path, options: list[str], said: str) -> None:
    u = write_scan(room)
    np.save(room / "signal.npy", np.cos(u))
    np.save(room / "narrow.npy", np.zeros((64, 1)))
    shown = np.tile(np.cos(np.arange(64) ** 2 / 90.0), (2, 1))
    np.save(room / "two.npy", shown)
    np.save(room / "back.npy", shown[:, ::-1])
    np.save(room / "complex.npy", np.zeros((3, 3)) + 1j)
    before = {path.name for path in room.iterdir()}
    whole = [str(room / one) if one.endswith((".npy", ".csv")) else one for one in options]
    assert_refused(run(*given(room), *whole), room, before, said)


def test_every_drive_has_the_same_interval(room: Path) -> None:
    table = np.loadtxt(room / "drive.csv", delimiter=",", skiprows=1) * [2.0, 1.0]
    np.savetxt(room / "slow.csv", table, delimiter=",", header="time_s,drive_v", comments="")
    before = {path.name for path in room.iterdir()}
    words = ["places", str(room / "drive.csv"), str(room / "slow.csv")]
    known = ["--lengths", str(room / "lengths.csv"), "--pairs", str(room / "pairs.npy")]
    result = run(*words, *known, "-o", str(room / "stage.json"))
    assert_refused(result, room, before, "slow.csv: expected the sampling interval of")


def test_what_is_doubtful_in_a_drive_is_refused(room: Path) -> None:
    text = (room / "drive.csv").read_text("utf-8")
    (room / "drive.csv").write_text("# gain 20\n" + text, encoding="utf-8")
    before = {path.name for path in room.iterdir()}
    result = run(*given(room), "--pairs", str(room / "pairs.npy"))
    assert_refused(result, room, before, "'gain 20' is not applied")


def test_a_drive_shorter_than_its_images_is_named(room: Path) -> None:
    write_scan(room)
    before = {path.name for path in room.iterdir()}
    images = ["--trace", str(room / "trace.npy"), "--retrace", str(room / "retrace.csv")]
    result = run(*given(room), *images, "--before", "5000")
    assert_refused(result, room, before, "--before: expected 13192 samples of drive 0")


def test_between_semicolons_a_comma_is_a_decimal_mark(room: Path) -> None:
    text = (room / "lengths.csv").read_text("utf-8").replace(",", ";").replace(".", ",")
    (room / "comma.csv").write_text(text, encoding="utf-8")
    outputs = []
    for name in ("lengths.csv", "comma.csv"):
        words = ["places", str(room / "drive.csv"), "--lengths", str(room / name)]
        result = run(*words, "--pairs", str(room / "pairs.npy"))
        assert result.exit_code == 0, result.output
        outputs.append(result.stdout)
    assert outputs[0] == outputs[1]
