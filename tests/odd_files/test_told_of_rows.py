"""Rows of numbers above the record, and marks that may part thousands, are told."""

from __future__ import annotations

from pathlib import Path

import mpi_hyst as mh
import numpy as np
import pytest

from odd_files.test_instruments import T, U, Y, rows
from odd_files.test_told import told

HEADER = "time_s,drive_v,gauge_um\n"
PAIR = "drive_v,gauge_um\n"
BODY = rows(T, U, Y)
SETTINGS = "136,0.01,5\n"
# The text, the columns that are read and whether one is the time, and the words of it.
ABOVE: dict[str, tuple[str, list[str], str]] = {
    "a row": (SETTINGS + BODY, ["1", "2"], "line 1 does not go on"),
    "rows": (f"{SETTINGS}2,0,1\n10,20,30\n{BODY}", ["1", "2"], "lines 1 to 3 do not go on"),
    "rows below names": (f"{HEADER}{SETTINGS}{BODY}", ["drive_v", "gauge_um"], "line 2 does"),
    "a time that begins anew": (
        f"a,b,c\n0,1,2\n0.01,1.1,2.1\n{BODY}", ["b", "c"], "lines 2 to 3 do not go on"
    ),
    "whole numbers": (PAIR + "136,100\n" + rows(U, Y, form="{:.3f}"), [], "136, 100: taken for"),
}  # fmt: skip
REFUSED = {
    "wider": (f"1,2,3,4,5\n{BODY}", "line 1: expected 3 cells as in the rows before, got 5$"),
    "narrower": (f"5,7\n{BODY}", "line 1: expected 3 cells as in the rows before, got 2"),
    "wider below names": (f"{HEADER}1,2,3,4,5\n{BODY}", "line 2: expected 3 cells .* got 5$"),
    "a time that goes back": (f"{HEADER}{SETTINGS}{BODY}", "line 3, .*: 0 after 136"),
}
ROWS = {
    "from rest": PAIR + "0,0\n" + rows(U + 60.5, Y + 10.5, form="{:.4f}"),
    "of counts": PAIR + "7,3\n" + rows(np.arange(1, 99), np.arange(5, 103)),
    "from another level": PAIR + rows(U[20:], Y[20:], form="{:.3f}"),
}


@pytest.mark.parametrize("kind", ABOVE)
def test_rows_above_a_record_are_told(kind: str, tmp_path: Path) -> None:
    content, columns, words = ABOVE[kind]
    path = tmp_path / "record.csv"
    path.write_text(content, encoding="utf-8")
    said = told(mh.io.read(path, columns or None, time=False), path)
    assert sum(words in one for one in said) == 1, said


@pytest.mark.parametrize("kind", REFUSED)
def test_rows_of_other_widths_are_refused(kind: str, tmp_path: Path) -> None:
    content, said = REFUSED[kind]
    (tmp_path / "record.csv").write_text(content, encoding="utf-8")
    with pytest.raises(mh.io.ReadError, match=said):
        mh.io.read(tmp_path / "record.csv")


@pytest.mark.parametrize("kind", ROWS)
def test_first_rows_of_a_record_are_rows(kind: str, tmp_path: Path) -> None:
    path = tmp_path / "record.csv"
    path.write_text(ROWS[kind], encoding="utf-8")
    assert not told(mh.io.read(path), path)


@pytest.mark.parametrize("mark", [".", ","])
def test_numbers_that_may_all_be_thousands_are_told(mark: str, tmp_path: Path) -> None:
    path = tmp_path / "record.csv"
    body = rows(U + 1.0, Y + 1.0, separator=";", form="{:.3f}").replace(".", mark)
    path.write_text(f"drive_v;gauge_um\n{body}", encoding="utf-8")
    (said,) = told(mh.io.read(path), path)
    assert f"'1{mark}000' may be 1000" in said and "--thousands none" in said
    assert not told(mh.io.read(path, thousands=""), path)
    whole = mh.io.read(path, thousands=mark)
    np.testing.assert_allclose(whole["gauge_um"], 1e3 * (Y + 1.0), atol=0.51)
    # One number that is none of thousands tells it for all.
    path.write_text(f"drive_v;gauge_um\n0{mark}000;1{mark}000\n{body}", encoding="utf-8")
    assert not told(mh.io.read(path), path)
