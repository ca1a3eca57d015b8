"""Rows without a position: a sensor that is slower than the drive, or readings that failed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from mpi_hyst._cli.errors import note
from mpi_hyst._cli.identify.request import Request
from mpi_hyst._io.columns import find
from mpi_hyst._io.read import opened, take
from mpi_hyst._io.table import refusal
from mpi_hyst.io import Columns, ReadError

_LONGEST = 20  # rows in a row: a longer gap hides turns
_MOST = 0.8  # share of all rows
_LEAVE_OUT = "; leave that out with --leave-out {}:{}"
_MEND = "; put a straight line there with --mend {}:{}"


class _Cell(NamedTuple):
    """A cell that is refused."""

    column: int
    row: int
    said: str
    what: str


class Gap(NamedTuple):
    """Rows that lack too much."""

    first: int
    end: int | None
    """The row behind the gap, if it is one gap."""
    why: str


def filled(
    path: Path, names: Sequence[str], rows: int | None, request: Request, refused: ReadError
) -> tuple[Columns, int]:
    """Read a refused file with straight lines where rows have no position.

    Return it with the first row that has a position: those before set the memory only. What is in
    rows that --leave-out and --mend name does not matter. If missing positions are not all that is
    wrong with the rest, raise an error about what else is.
    """
    missing: dict[int, str] = {}
    cells: list[_Cell] = []

    def wrong(index: int, row: int, place: str, what: str) -> None:
        if any(first <= row < end for first, end in named.get(index, ())):
            return
        said = f"{table.source}, {place}, column {table.names[index]}: {what}"
        if index == position and is_missing(what):
            missing[row] = said
        elif cells and cells[0].row != row:
            raise refuse()
        else:
            cells.append(_Cell(index, row, said, what))

    def refuse() -> ReadError:
        """Return the error about the first row, with the option that is enough for all of it."""
        columns, (_, row, said, what) = {cell.column for cell in cells}, cells[0]
        option = _MEND if drive in columns else _LEAVE_OUT
        helps = takes_options and columns <= {drive, position}
        return refusal(said + (option.format(row, row + 1) if helps else ""), what, row)

    if refused.rows is None or not path.is_file():
        raise refused
    takes_options = request.data == (path,) and not request.validate_from
    with opened(path) as table:
        drive, position = (find(table.source, table.names, name) for name in names)
        mended = request.mend if takes_options else ()
        left_out = request.leave_out if takes_options else ()
        named = {drive: mended, position: (*mended, *left_out)}
        ordered = request.time is not False
        clock = None if request.time is False else request.time
        try:
            columns = take(table, lambda _: names, clock, rows, wrong, ordered=ordered)
        except ReadError as later:
            raise (refuse() if cells else later) from later
    if cells:
        raise refuse()
    if (gap := too_long(list(missing), columns.samples)) is not None:
        option = _LEAVE_OUT if takes_options and gap.end is not None else ""
        said = f"{missing[gap.first]}, {gap.why}{option.format(gap.first, gap.end)}"
        raise ReadError(said, gap.first)
    return _interpolated(columns, np.array(list(missing), dtype=int), names)


def is_missing(what: str) -> bool:
    """Whether a cell that is refused for this reason holds no reading, and nothing else."""
    return what.startswith(("empty cell", "not finite"))


def too_long(missing: Sequence[int], count: int) -> Gap | None:
    """Return where these rows, of so many, lack so much that no straight lines take their place."""
    known = np.setdiff1d(np.arange(count), missing)
    if len(missing) > _MOST * count or known.size < 2:
        why = f"the first of {len(missing)} rows of {count} without a position"
        return Gap(missing[0], None, why)
    gaps = np.diff(known) - 1
    if gaps.max(initial=0) <= _LONGEST:
        return None
    longest = int(gaps.argmax())
    what = f"the first of {gaps[longest]} rows in a row without a position"
    first, end = int(known[longest]) + 1, int(known[longest + 1])
    return Gap(first, end, f"{what}: at most {_LONGEST} are filled in")


def _interpolated(
    columns: Columns, missing: np.ndarray, names: Sequence[str]
) -> tuple[Columns, int]:
    """Return the columns with straight lines, as far as rows are known or named by an option."""
    count = columns.samples
    known = np.setdiff1d(np.arange(count), missing)
    first, last = int(known[0]), int(known[-1])
    values = {one: column[: last + 1] for one, column in columns.values.items()}
    for key in map(columns.key, names):
        there = np.flatnonzero(np.isfinite(columns.values[key]))
        if not there.size:
            raise ReadError(f"{columns.source}, column {key}: expected numbers, got none")
        values[key] = np.interp(np.arange(last + 1), there, columns.values[key][there])
    if missing.size:
        what = (
            f"{missing.size} of {count} rows have no position, the first is row {int(missing[0])}: "
            "straight lines take their place, and rows before the first position and after the "
            "last are not fitted"
        )
        note(f"{columns.source}: {what}")
    return replace(columns, values=values), first
