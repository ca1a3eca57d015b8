"""Rows of plain numbers are read in blocks: with the numbers and the refusals of single rows."""

from __future__ import annotations

import random
from pathlib import Path
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from mpi_hyst._core import plain_rows
from mpi_hyst._io.formats import text


def nothing(*arguments: Any) -> tuple[int, int, list[np.ndarray]]:
    """Take no row as a plain one."""
    return 0, 0, [np.empty(0) for _ in arguments[-1]]


def told(path: Path, rows: int | None) -> object:
    try:
        record = mh.io.read(path, rows=rows)
    except mh.io.ReadError as error:
        return str(error), error.rows
    columns = {name: values.tolist() for name, values in record.values.items()}
    return columns, record.units, record.time_column, record.format, record.assumed


# What comes into the rows, anywhere; each with what stands for a cell or for a line.
ODD_CELLS = (
    "",
    " 7",
    "1e3",
    "+.5",
    "5.",
    "1.5D2",
    "nan",
    "inf",
    "1_0",
    '"3"',
    "#N/A",
    "x",
    "1e101",
)
ODD_LINES = (
    "",
    "# paused",
    "0.5,1",
    "0.5,1,2,3",
    "1,2,3,",
    "\x00\x00",
    "Mean,1,2",
    '1,"2,3',
    "µ,1,2",
)


@pytest.mark.parametrize("seed", range(24))
def test_blocks_and_rows_read_the_same(
    seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    draw = random.Random(seed)
    separator = draw.choice([",", ";", "\t", " ", ","])
    comma = separator in ";\t" and draw.random() < 0.5
    count = draw.choice([900, 3000, 6000])
    lines = [
        separator.join([f"{0.01 * k:.2f}", repr(draw.uniform(-9, 9)), f"{draw.gauss(0, 1):.6e}"])
        for k in range(count)
    ]
    for _ in range(draw.choice([0, 1, 3, 200])):
        at = draw.randrange(600, count)
        if draw.random() < 0.5:
            cells = lines[at].split(separator)
            cells[draw.randrange(len(cells))] = draw.choice(ODD_CELLS[: draw.choice([6, 13])])
            lines[at] = separator.join(cells)
        else:
            some = ODD_LINES[: draw.choice([2, 9])]
            lines[at] = draw.choice(some).replace(",", separator)
    if draw.random() < 0.2:
        lines[count // 2 : count // 2 + 2] = reversed(lines[count // 2 : count // 2 + 2])
    body = "\n".join(lines) + draw.choice(["\n", ""])
    if comma:
        body = body.replace(".", ",")
    path = tmp_path / "record.csv"
    whole = f"{separator.join(['time_s', 'u', 'y'])}\n{body}"
    path.write_bytes(whole.replace("\n", draw.choice(["\n", "\r\n"])).encode())
    rows = draw.choice([None, None, count // 2])
    in_blocks = told(path, rows)
    monkeypatch.setattr(text, "plain_rows", nothing)
    assert in_blocks == told(path, rows)


def test_most_rows_go_in_blocks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    taken = 0

    def counted(*arguments: Any) -> Any:
        nonlocal taken
        found = real(*arguments)
        taken += found[1]
        return found

    real = plain_rows
    monkeypatch.setattr(text, "plain_rows", counted)
    values = np.random.default_rng(1).normal(size=(50_000, 3))
    np.savetxt(tmp_path / "a.csv", values, delimiter=",", header="a,b,c", comments="")
    record = mh.io.read(tmp_path / "a.csv", ["b", "c"])
    np.testing.assert_array_equal(record["c"], values[:, 2])
    assert taken > 48_000
