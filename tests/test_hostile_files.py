"""Files and names that somebody else made: endless, once only, or made to break the terminal."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import mpi_hyst as mh
import numpy as np
import pytest
from click.testing import Result
from commands import (
    HEADER,
    actuator,
    assert_refused,
    column,
    names_in,
    record_rows,
    run,
    write_csv,
)
from test_report import parsed, words

posix = pytest.mark.skipif(os.name == "nt", reason="devices, and names that are not UTF-8")

COMMAND = [sys.executable, "-m", "mpi_hyst._cli"]
# Of the drive and of the position: a formula, a broken one; an escape sequence, a text that runs
# from right to left; a long one, another script.
NAMES = [
    ("$$", r"$\frac{$"),
    ("\x1b[31mred\x1b[0m", "\u202eposition"),
    ("drive" * 400, "駆動電圧"),
]


# A fit in a moment: what is tested is how names are shown.
QUICK = ("--operators", "4", "--dynamics", "none", "--dead-time", "0", "--input-offset", "0")


def operators(path: Path) -> int:
    stage = mh.load(path)
    assert isinstance(stage, mh.Stage)
    return stage.hysteresis.operators


@pytest.mark.parametrize("names", NAMES, ids=["formula", "control", "script"])
def test_a_name_cannot_break_the_report(there: Path, names: tuple[str, str]) -> None:
    drive, position = names
    header = HEADER.replace("drive_v", drive).replace("position_um", position)
    write_csv(there / "named.csv", header, record_rows())
    result = run(
        *("identify", "named.csv", "--input", drive, "--output", position),
        *(*QUICK, "-o", "found.json", "--report", "page.html"),
    )
    assert result.exit_code == 0, result.output
    assert operators(there / "found.json") == 4
    parsed(there / "page.html")
    assert "\x1b" not in result.output and "\u202e" not in result.output


@pytest.mark.parametrize("units", [*NAMES, ("<script>", "%&'")])
def test_a_unit_cannot_break_the_report(there: Path, units: tuple[str, str]) -> None:
    header = f"time_s,u [{units[0]}],y [{units[1]}]"
    write_csv(there / "named.csv", header, record_rows())
    given = (*QUICK, "-o", "found.json", "--report", "page.html")
    result = run("identify", "named.csv", "--input", "1", "--output", "2", *given)
    assert result.exit_code == 0, result.output
    assert operators(there / "found.json") == 4
    parsed(there / "page.html")
    assert "\x1b" not in result.output and "\u202e" not in result.output
    result = run("precompensate", "found.json", "trajectory.csv", "-o", "drive.csv")
    assert "\x1b" not in result.output and "\u202e" not in result.output


@posix
@pytest.mark.parametrize(
    "name", [b"\xff.csv", b"$\\frac{$.csv", b"\x1b[31m.csv", b"\xe2\x80\xae.csv"]
)
def test_a_file_name_cannot_break_the_report(there: Path, name: bytes) -> None:
    path = os.fsdecode(name)
    write_csv(Path(path), HEADER, record_rows())
    result = run(
        *("identify", path, "--input", "drive_v", "--output", "position_um"),
        *(*QUICK, "-o", "found.json", "--report", "page.html"),
    )
    assert result.exit_code == 0, result.output
    assert operators(there / "found.json") == 4
    assert ".csv" in words(parsed(there / "page.html"))
    assert "\x1b" not in result.output and "\u202e" not in result.output


@posix
def test_errors_do_not_reach_the_terminal_as_they_are(there: Path) -> None:
    (there / "wrong.json").write_text(json.dumps({"schema": "\x1b[2J" + "x" * 10_000_000}))
    before = names_in(there)
    given = ("precompensate", "wrong.json", "trajectory.csv", "-o", "drive.csv")
    result = run(*given)
    assert_refused(result, there, before, "wrong.json")
    assert "\x1b" not in result.stderr and len(result.stderr) < 2000
    result = run("identify", "\x1b[2J.csv", "--input", "a", "--output", "b")
    assert_refused(result, there, before, "\\x1b[2J.csv: No such file")
    result = run("identify", "record.csv", "--input", "\x1b[2J", "--output", "b")
    assert_refused(result, there, before, "no column")
    assert "\x1b" not in result.stderr


@posix
@pytest.mark.parametrize("name", ["\x1b[2J", "drive\n", os.fsdecode(b"\xff")])
def test_a_column_that_nobody_can_read_is_not_written(there: Path, name: str) -> None:
    before = names_in(there)
    limits = ("--limits", "-500,500", "--rate", "1000", "--slew", "1e4")
    result = run("excite", *limits, "--column", name, "-o", "drive.csv")
    assert_refused(result, there, before, "--column: expected a printable name")


@pytest.mark.parametrize("command", ["precompensate", "simulate"])
def test_a_time_that_is_called_as_a_drive_is_refused(there: Path, command: str) -> None:
    rows = [[k / 100, 0.01 * k] for k in range(50)]
    write_csv(there / "named.csv", "drive,target", rows)
    before = names_in(there)
    options = ["--time", "drive", "--limits", "-500,500", "-o", "out.csv"]
    result = run(command, "stage.json", "named.csv", *options)
    assert_refused(result, there, before, "named.csv: expected other columns than", "drive")


@pytest.mark.parametrize("taken", ["drive", "Drive (V)"])
def test_a_drive_is_no_trajectory(there: Path, taken: str) -> None:
    mh.Stage(actuator(), units=("", "")).save(there / "stage.json")
    write_csv(there / "named.csv", f"time_s,{taken}", [[k / 100, 0.01 * k] for k in range(50)])
    before = names_in(there)
    result = run("precompensate", "stage.json", "named.csv", "-o", "out.csv")
    assert_refused(result, there, before, "named.csv: expected other columns than", taken)


@posix
@pytest.mark.parametrize("command", ["precompensate", "simulate"])
def test_a_pipe_is_read_once(there: Path, command: str) -> None:
    arguments = [command, "stage.json", "/dev/stdin", "-o", "out.csv", "--limits", "-500,500"]
    done = subprocess.run(
        [*COMMAND, *arguments],
        input=(there / "trajectory.csv").read_bytes(),
        capture_output=True,
        cwd=there,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert column(there / "out.csv", "drive").size == 300


@posix
@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ("identify /dev/zero --input a --output b", ", line 1: expected less than 1000000 char"),
        ("precompensate /dev/zero trajectory.csv -o drive.csv", ": expected a file of at most 1 G"),
        ("export /dev/zero --c", ": expected a file of at most 1 GiB"),
    ],
)
def test_an_endless_file_is_refused(arguments: str, said: str, there: Path) -> None:
    # In a process of its own, which may take so much memory and no more.
    code = """
import resource
resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30))
from mpi_hyst._cli.__main__ import main
main()
"""
    before = names_in(there)
    done = subprocess.run(
        [sys.executable, "-c", code, *arguments.split()],
        capture_output=True,
        text=True,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
        timeout=120,
        check=False,
    )
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith(f"mpi-hyst: error: /dev/zero{said}"), done.stderr
    assert names_in(there) == before


def test_a_line_without_end_is_refused(there: Path) -> None:
    (there / "long.csv").write_text("a,b\n" + "1" * 2_000_000 + ",2\n", encoding="utf-8")
    with pytest.raises(mh.io.ReadError, match="line 2: expected less than"):
        mh.io.read(there / "long.csv", ["a", "b"])


@posix
def test_a_closed_terminal_does_not_lose_the_model(there: Path) -> None:
    arguments = "identify record.csv --input drive_v --output position_um --operators 4 -o out.json"
    line = f'exec "$0" -m mpi_hyst._cli {arguments} >&- 2>&-'
    done = subprocess.run(["sh", "-c", line, sys.executable], cwd=there, timeout=120, check=False)
    assert done.returncode == 0
    assert operators(there / "out.json") == 4


def identify_times(there: Path, scale: float) -> Result:
    rows = [[t, scale * float(str(u)), scale * float(str(y))] for t, u, y in record_rows()]
    write_csv(there / "tiny.csv", HEADER, rows)
    return run(
        *("identify", "tiny.csv", "--input", "drive_v", "--output", "position_um"),
        *(*QUICK, "-o", "found.json", "--report", "page.html"),
    )


def test_tiny_numbers_have_a_report(there: Path) -> None:
    result = identify_times(there, 1e-98)
    assert result.exit_code == 0, result.output
    parsed(there / "page.html")


def test_numbers_without_digits_are_refused(there: Path) -> None:
    before = {*names_in(there), "tiny.csv"}
    said = "column drive_v: expected fitted samples that vary by 1e-100 at least"
    assert_refused(identify_times(there, 1e-312), there, before, said)


def test_io_reads_every_column_of_numbers(tmp_path: Path) -> None:
    path = write_csv(tmp_path / "record.csv", "note,time_s,x_um", [["a", 0, 1], ["b", 0.5, 3]])
    record = mh.io.read(path)
    assert sorted(record.values) == ["time_s", "x_um"] and record.time_column == "time_s"
    np.testing.assert_array_equal(record["x_um"], [1.0, 3.0])
    assert (record.samples, record.sample_time) == (2, 0.5)
    assert mh.io.read(str(path), ["x_um"], rows=1).samples == 1
    write_csv(path, "note,other", [["a", "b"]])
    with pytest.raises(mh.io.ReadError, match="no numeric column; the columns are: note, other"):
        mh.io.read(path)
