"""A column that is called `t` alone is the time, in seconds, unless another name says more."""

from __future__ import annotations

import shlex
from pathlib import Path

import mpi_hyst as mh
import numpy as np
import pytest
from commands import COLUMNS, RATE, assert_refused, column, names_in, record_rows, run, write_csv

ROWS = [list(map(float, map(str, row))) for row in record_rows()]
T = [row[0] for row in ROWS]


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        (("t", "u"), "t"),
        (("u", "t"), "t"),
        # What says more goes first.
        (("t", "time"), "time"),
        (("t", "Zeit"), "Zeit"),
        (("t", "t_ms"), "t_ms"),
        # A temperature, a thickness, a time in another place: not this name.
        (("T", "u"), None),
        (("t0", "u"), None),
        (("t [°C]", "u"), None),
    ],
)
def test_a_bare_t_is_the_time(names: tuple[str, str], expected: str | None) -> None:
    read = mh.io.read({name: np.arange(3.0) for name in names})
    assert read.time_column == expected


def test_a_row_of_units_tells_what_else_t_is(tmp_path: Path) -> None:
    path = tmp_path / "record.csv"
    for unit, expected in (("s", "t"), ("ms", "t"), ("K", None), ("mm", None)):
        path.write_text(f"t;u\n[{unit}];[V]\n1;2\n2;3\n", encoding="utf-8")
        assert mh.io.read(path).time_column == expected, unit


def test_no_command_needs_the_option(there: Path) -> None:
    write_csv(there / "plain.csv", "t,drive_v,position_um", ROWS)
    words = shlex.split(run("look", "plain.csv").stdout.splitlines()[-1])[1:]
    assert "--time" not in words
    found = run(*words, "--operators", "4")
    assert found.exit_code == 0, found.output
    stage = mh.load(there / "stage.json")
    assert isinstance(stage, mh.Stage) and stage.identified is not None
    assert stage.identified["dt"] == pytest.approx([1.0 / RATE])
    target = [[t, 0.2 * (1.0 - np.cos(t))] for t in T]
    write_csv(there / "target.csv", "t,target", target)
    for command, name in (("precompensate", "drive"), ("simulate", "drive")):
        assert run(command, "stage.json", "target.csv", "-o", "out.csv").exit_code == 0
        np.testing.assert_allclose(column(there / "out.csv", "time_s"), T)
        assert column(there / "out.csv", name).size == len(T)


def test_a_bare_t_that_is_hardly_in_seconds_is_refused(there: Path) -> None:
    rows = [[1e3 * row[0], *row[1:]] for row in ROWS]
    write_csv(there / "ms.csv", "t,drive_v,position_um", rows)
    before = names_in(there)
    said = "time column t has no unit and steps of 5.000, hardly seconds"
    assert_refused(run("identify", "ms.csv", *COLUMNS), there, before, said, "--time-unit ms")
    mh.paper.plant("A1").stage.save(there / "stage.json")
    write_csv(there / "target.csv", "t,target_um", [[1e3 * t, 0.1 - 0.1 * np.cos(t)] for t in T])
    assert "--time-unit ms" in run("look", "target.csv").stdout
    before = names_in(there)
    for command in ("precompensate", "simulate"):
        given = (command, "stage.json", "target.csv", "-o", "out.csv")
        assert_refused(run(*given), there, before, said, "--time-unit ms")
        result = run(*given, "--time-unit", "ms")
        assert result.exit_code == 0 and f"at {RATE:g} Hz" in result.stdout, result.output
        assert (there / "out.csv").read_text("utf-8").startswith("time_ms,")
        np.testing.assert_allclose(column(there / "out.csv", "time_ms"), 1e3 * np.array(T))
        (there / "out.csv").unlink()
    fitted = run("identify", "ms.csv", *COLUMNS, "--time-unit", "ms", "--operators", "4")
    assert fitted.exit_code == 0, fitted.output


@pytest.mark.parametrize("command", ["precompensate", "simulate"])
def test_a_bare_t_that_is_no_time_can_be_left_out(command: str, there: Path) -> None:
    mh.paper.plant("A1").stage.save(there / "stage.json")
    # A temperature that a column calls t: it does not rise.
    write_csv(there / "target.csv", "t,target", [[25.0 - 0.1 * (k % 3), 0.0] for k in range(200)])
    given = (command, "stage.json", "target.csv", "-o", "out.csv", "--column", "target")
    before = names_in(there)
    said = "time does not increase"
    assert_refused(run(*given), there, before, said, "--time none --rate HZ")
    taken = run(*given, "--time", "none", "--rate", "10000")
    assert taken.exit_code == 0, taken.output
