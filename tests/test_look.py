"""`mpi-hyst look`: what it says of a file, what it guesses, and that its command runs."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from datetime import datetime, timezone
from pathlib import Path

import mpi_hyst as mh
import numpy as np
import pytest
from commands import Array, actuator, assert_refused, names_in, run
from mpi_hyst._io.roles import guess, leads

RATE = 200.0
DRIVE = mh.signals.decaying_triangle(400.0, 1.0, cycles=3, rate=RATE)
POSITION = actuator().forward().run(DRIVE)
SECONDS = np.arange(DRIVE.size) / RATE


def table(path: Path, header: str, columns: list[Array], separator: str = ",") -> Path:
    rows = [
        separator.join(repr(float(value)) for value in row) for row in zip(*columns, strict=True)
    ]
    path.write_text("\n".join([*([header] if header else []), *rows]) + "\n", encoding="utf-8")
    return path


def suggested(output: str) -> list[str]:
    words = shlex.split(output.rstrip().splitlines()[-1])
    assert words[0] == "mpi-hyst"
    return words[1:]


def test_the_command_that_look_suggests_runs(there: Path) -> None:
    path = there / "a record.csv"
    table(path, "Zeit;Spannung;Weg\nms;V;µm", [1e3 * SECONDS, DRIVE, POSITION], ";")
    path.write_text(path.read_text("utf-8").replace(".", ","), encoding="latin-1")
    result = run("look", "a record.csv")
    assert (result.exit_code, result.stderr) == (0, "")
    for said in (
        *("semicolons, decimal comma, latin-1", "600 rows read; columns of numbers: 3"),
        *("-400.0", "400.0", "0.005000 s on average, 200.0 Hz", "jitter     none"),
        *("time unit  ms, converted to seconds", "gaps       none", "guess, quite sure"),
    ):
        assert said in result.stdout
    words = suggested(result.stdout)
    assert words == [
        *("identify", "a record.csv", "--input", "Spannung", "--output", "Weg"),
        *("-o", "stage.json"),
    ]
    found = run(*words, "--operators", "4")
    assert found.exit_code == 0, found.output
    assert "time column Zeit is converted from ms to seconds" in found.stderr
    stage = mh.load(there / "stage.json")
    assert isinstance(stage, mh.Stage) and stage.units == ("V", "um")


def test_columns_without_names_are_told_by_their_data(there: Path) -> None:
    # The position comes first: only the loop tells which one is the drive.
    table(there / "bare.txt", "", [SECONDS, 1e3 * POSITION, DRIVE], "  ")
    result = run("look", "bare.txt")
    assert suggested(result.stdout) == [
        *("identify", "bare.txt", "--input", "2", "--output", "1", "--time", "0"),
        *("-o", "stage.json"),
    ]
    assert "it leads 1" in result.stdout and "likely" in result.stdout
    assert run(*suggested(result.stdout), "--operators", "4").exit_code == 0


def test_the_drive_leads_also_when_the_position_falls() -> None:
    assert leads(DRIVE, POSITION) > 1e-3 and leads(POSITION, DRIVE) < -1e-3
    assert leads(DRIVE, -POSITION) > 1e-3
    # Without hysteresis nothing leads.
    assert abs(leads(DRIVE, 2.0 * DRIVE + 1.0)) < 1e-9


@pytest.mark.parametrize(
    ("drive", "position", "time"),
    [
        ("cmd", "sensor", "t_s"),
        ("AO0 (V)", "Gauge (um)", "Time (s)"),
        ("DAC out", "displacement", "zeit"),
        ("piezo_voltage", "pos_nm", "elapsed time"),
        ("U [V]", "s [um]", "t [ms]"),
        ("Tension", "Deplacement", "Temps"),
        ("HV monitor (kV)", "strain gauge (V)", "timestamp"),
    ],
)
def test_names_of_many_labs_are_understood(drive: str, position: str, time: str) -> None:
    values: dict[str, Array] = {
        "index": np.arange(DRIVE.size, dtype=np.float64),
        position: POSITION,
        "target_um": POSITION * 1.01,
    }
    values |= {drive: DRIVE, time: SECONDS}
    found = guess(values, {})
    assert [found[role].column for role in ("drive", "position", "time")] == [drive, position, time]


def test_gaps_and_jitter_are_located(there: Path) -> None:
    late = SECONDS + np.where(np.arange(SECONDS.size) >= 100, 0.5, 0.0)
    late[1:] += 2e-4 * np.sin(np.arange(1, late.size))
    table(there / "gap.csv", "time_s,drive_v,pos_um", [late, DRIVE, POSITION])
    said = run("look", "gap.csv").stdout
    assert "0.505 s before row 100;" in said and "the usual step is 0.00" in said
    assert "% of a step" in said and "note: the time steps are unequal" in said


def test_a_time_that_stands_and_cells_without_numbers_are_told(there: Path) -> None:
    times = SECONDS.copy()
    times[50] = times[49]
    path = table(there / "holes.csv", "time_s,drive_v,pos_um", [times, DRIVE, POSITION])
    assert "does not increase at row 50\n" in run("look", "holes.csv").stdout
    lines = path.read_text("utf-8").splitlines()
    lines[7] = lines[7].rpartition(",")[0] + ",nan"
    lines[9] = lines[9].rpartition(",")[0] + ","
    path.write_text("\n".join(lines), encoding="utf-8")
    said = run("look", "holes.csv").stdout
    assert "2 refused, line 8: not finite: nan" in said
    assert "column pos_um has 2 cells without a number, the first in line 8" in said
    assert suggested(said)[1:6] == ["holes.csv", "--input", "drive_v", "--output", "pos_um"]


@pytest.mark.parametrize(
    ("stamp", "said"),
    [
        # A clock without fractions, and a stamp that is none.
        ("{:%H:%M:%S}", "time does not increase at row 1:"),
        ("{:%d of %B}", "time holds no numbers in most rows:"),
    ],
)
def test_a_time_that_tells_none_is_left_out(there: Path, stamp: str, said: str) -> None:
    path = table(there / "log.csv", "time,drive_v,pos_um", [SECONDS, DRIVE, POSITION])
    header, *rows = path.read_text("utf-8").splitlines()
    stamps = [stamp.format(datetime.fromtimestamp(one, timezone.utc)) for one in SECONDS]
    cells = [row.partition(",")[2] for row in rows]
    lines = [f"{one},{row}" for one, row in zip(stamps, cells, strict=True)]
    path.write_text("\n".join([header, *lines]), encoding="utf-8")
    shown = run("look", "log.csv").stdout
    assert said in shown and "add --rate HZ" in shown
    assert run(*suggested(shown), "--operators", "4").exit_code == 0


@pytest.mark.parametrize("name", ["time_s", "time"])
def test_a_time_that_goes_back_is_two_records(there: Path, name: str) -> None:
    times = np.where(SECONDS < 1.0, SECONDS, SECONDS - 1.0)
    table(there / "twice.csv", f"{name},drive_v,pos_um", [times, DRIVE, POSITION])
    shown = run("look", "twice.csv").stdout
    assert "the time does not increase everywhere: cut the file there" in shown
    assert "no time column" not in shown


def test_stamps_of_whole_seconds_are_in_seconds(there: Path) -> None:
    path = table(there / "slow.csv", "time,drive_v,pos_um", [SECONDS, DRIVE, POSITION])
    header, *rows = path.read_text("utf-8").splitlines()
    cells = [row.partition(",")[2] for row in rows]
    lines = [f"10:{n // 60:02d}:{n % 60:02d},{row}" for n, row in enumerate(cells)]
    path.write_text("\n".join([header, *lines]), encoding="utf-8")
    shown = run("look", "slow.csv").stdout
    assert "1.000 s on average" in shown and "note:" not in shown
    assert run(*suggested(shown), "--operators", "4").exit_code == 0


def test_what_is_wrong_at_the_end_says_how_to_look_before_it(there: Path) -> None:
    path = table(there / "cut.csv", "time_s,drive_v,pos_um", [SECONDS, DRIVE, POSITION])
    path.write_text(path.read_text("utf-8") + "aborted\n", encoding="utf-8")
    before = names_in(there)
    said = "got 1; look at what is before it with --rows 600"
    assert_refused(run("look", "cut.csv"), there, before, said)
    assert run("look", "cut.csv", "--rows", "600").exit_code == 0
    path.write_text(path.read_text("utf-8").replace("aborted", "Mean,0,0"), encoding="utf-8")
    shown = run("look", "cut.csv").stdout
    assert "column time_s has 1 cell that identify refuses" in shown
    assert "no time column" not in shown and "--time" not in shown


@pytest.mark.parametrize("scale", [1e3, 1e6])
def test_a_time_in_an_unsaid_unit_is_doubted(there: Path, scale: float) -> None:
    table(there / "ms.csv", "time,drive_v,pos_um", [scale * SECONDS, DRIVE, POSITION])
    result = run("look", "ms.csv")
    assert "time has no unit and steps of 5" in result.stdout
    assert "--time-unit ms" in result.stdout


def test_a_record_without_time_needs_a_rate(there: Path) -> None:
    table(there / "untimed.csv", "drive_v,pos_um,note", [DRIVE, POSITION, POSITION * 0.0])
    result = run("look", "untimed.csv", "--rows", "300")
    assert "300 rows read (--rows; there may be more)" in result.stdout
    assert "add --rate HZ" in result.stdout
    assert suggested(result.stdout)[-4:] == ["--rows", "300", "-o", "stage.json"]


def test_a_file_without_a_pair_has_no_command(there: Path) -> None:
    table(there / "lonely.csv", "time_s,drive_v", [SECONDS, DRIVE])
    result = run("look", "lonely.csv", "--plot", "lonely.png")
    assert result.exit_code == 0 and "no command to suggest" in result.stdout
    assert (there / "lonely.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("clock", ["time_s", None])
def test_one_column_may_be_a_trajectory(there: Path, clock: str | None) -> None:
    mh.paper.plant("A1").stage.save(there / "stage.json")
    target = 1.0 - np.cos(2.0 * np.pi * 5.0 * np.asarray(SECONDS))
    columns, names = ([SECONDS, target], "time_s,target_um") if clock else ([target], "target_um")
    table(there / "target.csv", names, columns)
    said = run("look", "target.csv").stdout
    assert "target_um alone may be a trajectory" in said
    words = suggested(said)
    words = [str(RATE) if word == "HZ" else word for word in words]
    assert run(*words).exit_code == 0
    assert (there / "drive.csv").exists()


def test_a_saved_stage_is_no_record(there: Path) -> None:
    mh.Stage(actuator()).save("stage.json")
    actuator().save("model.json")
    for name, kind in (("stage.json", "stage"), ("model.json", "model")):
        said = f"{name}: expected a record, got a saved {kind} of mpi_hyst"
        assert_refused(run("look", name), there, names_in(there), said)
        with pytest.raises(mh.io.ReadError, match=said):
            mh.io.read(name)


def test_settings_are_listed_but_not_read(there: Path) -> None:
    np.savez(there / "record.npz", u=DRIVE, pos=POSITION, gains=np.ones(3), note=np.array("x"))
    said = run("look", "record.npz").stdout
    assert "not read: gains (3 rows), note (no rows of numbers)" in said


def test_a_name_that_looks_like_an_option_or_a_formula(there: Path) -> None:
    table(there / "-o $x$.csv", "drive $_v,pos'_um", [DRIVE, POSITION])
    result = run("look", "--plot", "look.svg", "--", "-o $x$.csv")
    words = suggested(result.stdout)
    assert words[1:6] == ["./-o $x$.csv", "--input", "drive $_v", "--output", "pos'_um"]
    assert run(*words, "--operators", "4").exit_code == 0


@pytest.mark.parametrize(
    ("plot", "place", "start"),
    [
        ("fig.svg", "fig.svg", b"<?xml"),
        ("fig.png", "fig.png", b"\x89PNG"),
        ("fig.pdf", "fig.pdf", b"%PDF"),
        (".", "look.svg", b"<?xml"),
    ],
)
def test_the_figure_is_written_whole_and_always_the_same(
    there: Path, plot: str, place: str, start: bytes
) -> None:
    before = names_in(there)
    contents = []
    for _ in range(2):
        result = run("look", "record.csv", "--plot", plot)
        assert result.exit_code == 0 and f"figure  {place}" in result.stdout
        contents.append((there / place).read_bytes())
    assert contents[0].startswith(start) and contents[0] == contents[1]
    assert names_in(there) == before | {place}


def test_a_figure_that_cannot_be_written_leaves_nothing(
    there: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = names_in(there)

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    result = run("look", "record.csv", "--plot", "fig.png")
    monkeypatch.undo()
    assert_refused(result, there, before, "fig.png: No space left on device")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["missing.csv"], "missing.csv: No such file"),
        (["."], "directory"),
        (["prose.txt"], "prose.txt: no numeric column"),
        (["record.csv", "--plot", "fig.gif"], "--plot: expected a name that ends in .svg, .png or"),
        (["record.csv", "--plot", "no/fig.svg"], "does not exist"),
        (["record.csv", "--plot", "record.csv"], "--plot: expected a name that ends in"),
        (["record.csv", "--rows", "0"], "--rows"),
        ([], "FILE"),
    ],
)
def test_look_refuses(there: Path, arguments: list[str], said: str) -> None:
    (there / "prose.txt").write_text("Dear reader,\nthere is nothing here.\n", encoding="utf-8")
    before = names_in(there)
    assert_refused(run("look", *arguments), there, before, said)


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (lambda cell: cell.replace("-", "−"), "'−1000.0' (expected the sign - below zero)"),
        (lambda cell: f'"{cell.replace(".", ",")}"', "(expected a decimal point)"),
        (lambda cell: f"{cell}V", "(expected a number without 'V': units stand above the rows)"),
        (lambda cell: f"{cell}?", ""),
    ],
)
def test_a_column_that_is_not_read_says_why(
    there: Path, change: Callable[[str], str], why: str
) -> None:
    table(there / "signs.csv", "time_s,drive_v,pos_um", [SECONDS, DRIVE - 1000.0, POSITION])
    lines = (there / "signs.csv").read_text("utf-8").splitlines()
    for row, line in enumerate(lines[1:], 1):
        time, drive, position = line.split(",")
        lines[row] = f"{time},{change(drive)},{position}"
    (there / "signs.csv").write_text("\n".join(lines), encoding="utf-8")
    said = run("look", "signs.csv").stdout
    assert "not read: drive_v (no numbers in most rows" in said and why in said
    assert ("expected" in said.split("not read:")[1].split("\n")[0]) == bool(why)


def test_why_a_column_is_not_read_may_stand_behind_its_first_rows(there: Path) -> None:
    rows = [f"{row};{40 * row:,}" for row in range(200)]
    (there / "large.csv").write_text("\n".join(["t;u", *rows]), encoding="utf-8")
    said = run("look", "large.csv").stdout
    assert "not read: u (no numbers in most rows: not a number: '1,000' (expected" in said
    assert "no separators of thousands" in said
