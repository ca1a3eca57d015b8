"""Files of a lab that are nearly right: gaps in the position, files that differ, wrong clocks."""

from __future__ import annotations

import re
from pathlib import Path

import mpi_hyst as mh
import numpy as np
import pytest
from click.testing import Result
from commands import COLUMNS, run, write_csv
from stages import BENCHES, RATE
from support import Array

BENCH = BENCHES[0]
DRIVE, SKIP = BENCH.drive()
POSITION = BENCH.measured(DRIVE)
ROWS = 4000
FIT = ["--operators", "8", "--weights", "free", "--skip", str(SKIP)]


def text(path: Path, position: Array) -> str:
    """Write a record with an empty cell where the position is not a number."""
    columns = (np.arange(ROWS) / RATE, DRIVE[:ROWS], position[:ROWS])
    rows = zip(*(column.tolist() for column in columns), strict=True)
    lines = [f"{t!r},{u!r},{'' if np.isnan(y) else repr(y)}" for t, u, y in rows]
    path.write_text("time_s,drive_v,position_um\n" + "\n".join(lines) + "\n", encoding="utf-8")
    return str(path)


def refused(result: Result, said: str) -> None:
    assert result.exit_code == 2 and result.stdout == "", result.output
    assert re.search(said, result.stderr), result.stderr


def model(path: Path) -> mh.Stage:
    found = mh.load(str(path))
    assert isinstance(found, mh.Stage)
    return found


@pytest.mark.parametrize("every", [2, 50])
def test_rows_without_a_position_are_filled_and_told(tmp_path: Path, every: int) -> None:
    gaps = POSITION.copy()
    gaps[:3], gaps[7::every] = np.nan, np.nan
    whole, out = text(tmp_path / "whole.csv", POSITION), str(tmp_path / "whole.json")
    assert run("identify", whole, *COLUMNS, *FIT, "-o", out).exit_code == 0
    result = run(
        "identify",
        text(tmp_path / "gaps.csv", gaps),
        *COLUMNS,
        *FIT,
        "-o",
        str(tmp_path / "g.json"),
    )
    assert result.exit_code == 0, result.output
    missing = int(np.isnan(gaps[:ROWS]).sum())
    assert f"{missing} of {ROWS} rows have no position, the first is row 0" in result.stderr
    full, filled = (
        model(Path(name)).forward(dt=1 / RATE).run(DRIVE) for name in (out, tmp_path / "g.json")
    )
    assert np.std(full - filled) < 1e-3 * np.ptp(full)


def test_long_gaps_and_other_cells_are_refused(tmp_path: Path) -> None:
    gaps = POSITION.copy()
    gaps[2000:2030] = np.nan
    refused(
        run("identify", text(tmp_path / "long.csv", gaps), *COLUMNS, *FIT),
        "line 2002, column position_um: empty cell",
    )
    rows = np.stack([np.arange(ROWS) / RATE, DRIVE[:ROWS], POSITION[:ROWS]], axis=1)
    rows[5, 1] = np.nan
    path = write_csv(tmp_path / "drive.csv", "time_s,drive_v,position_um", rows.tolist())
    refused(run("identify", str(path), *COLUMNS, *FIT), "column drive_v: not finite")


def test_a_file_that_is_there_twice_is_refused(tmp_path: Path) -> None:
    first, again = (text(tmp_path / name, POSITION) for name in ("a.csv", "b.csv"))
    said = "b.csv: expected another record, got the content of a.csv again"
    refused(run("identify", first, again, *COLUMNS, *FIT), said)
    refused(run("identify", first, "--validate", again, *COLUMNS, *FIT), said)
    said = "a.csv: expected another record, got the content of a.csv again"
    refused(run("identify", first, first, *COLUMNS, *FIT), said)
    refused(run("identify", first, "--validate", first, *COLUMNS, *FIT), said)


def test_rows_that_were_not_fitted_may_be_held_out(tmp_path: Path) -> None:
    path = text(tmp_path / "a.csv", POSITION)
    held_out = ["--rows", "3000", "--validate", path, "--validate-skip"]
    assert run("identify", path, *COLUMNS, *FIT, *held_out, "3000").exit_code == 0
    refused(run("identify", path, *COLUMNS, *FIT, *held_out, "2999"), "a.csv again")


def test_intervals_that_no_rig_has_are_refused(tmp_path: Path) -> None:
    path = text(tmp_path / "a.csv", POSITION)
    result = run("identify", path, *COLUMNS, *FIT, "--time", "none", "--rate", "0.002")
    refused(result, "--rate: expected a sampling interval of .* got 500")
    refused(run("identify", path, *COLUMNS, *FIT, "--time-unit", "d"), "got 86")


@pytest.mark.parametrize("factor", [-1.0, 1000.0])
def test_records_in_other_units_are_red(factor: float) -> None:
    half = slice(0, 3000), slice(SKIP, DRIVE.size)
    u = [DRIVE[part] for part in half]
    y = [POSITION[half[0]], factor * POSITION[half[1]]]
    found = mh.identify(list(zip(u, y, strict=True)), operators=8, weights="free", dt=1 / RATE)
    assert found.verdict == "red"
    code = "wrong_sign" if factor < 0.0 else "records_differ"
    one = next(one for one in found.warnings if one.code == code)
    assert re.search("in this record alone" if factor < 0.0 else "same units", one.hint)


def test_a_reading_that_is_the_same_twice_at_fast_tips_is_none_that_failed() -> None:
    # Ten samples each way, on a grid of a converter: tips repeat to the last digit.
    tips = np.tile(np.concatenate([np.arange(0.0, 100.0, 10.0), np.arange(100.0, 0.0, -10.0)]), 20)
    slow = mh.signals.decaying_triangle(50.0, 0.1, cycles=5, rate=20) + 50.0
    u = np.concatenate([slow, tips, slow])
    y = np.round(BENCH.position(u) * 1e3 / np.ptp(BENCH.position(u)))
    found = mh.identify(u, y, operators=6, weights="free", dt=1e-3, dynamics=None)
    assert "failed_rows" not in {one.code for one in found.warnings}


def test_the_cell_that_cannot_be_filled_in_is_the_one_that_is_named(tmp_path: Path) -> None:
    gaps = POSITION.copy()
    gaps[700:720] = np.nan
    path = Path(text(tmp_path / "gaps.csv", gaps))
    assert run("identify", str(path), *COLUMNS, *FIT).exit_code == 0
    looked = run("look", str(path)).stdout
    assert "has 20 cells without a number" in looked and "puts straight lines there" in looked
    lines = path.read_text("utf-8").splitlines()
    lines[1501] = lines[1501].rpartition(",")[0] + ",OVL"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    refused(run("identify", str(path), *COLUMNS, *FIT), "line 1502, .*'OVL'; .* --rows 1500")
    assert (
        "has 1 cell that identify refuses, the first in line 1502" in run("look", str(path)).stdout
    )
    gaps[2000:2021] = np.nan
    path = Path(text(tmp_path / "gaps.csv", gaps))
    said = "line 2002, column position_um: empty cell, the first of 21 rows in a row without a"
    refused(run("identify", str(path), *COLUMNS, *FIT), said)
    assert said.replace("line", "position_um, line").replace(", column position_um", "") in (
        run("look", str(path)).stdout
    )
