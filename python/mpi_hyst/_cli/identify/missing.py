"""Rows without a position: a sensor that is slower than the drive, or readings that failed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from mpi_hyst._cli.errors import note
from mpi_hyst._cli.identify.request import Request
from mpi_hyst._io.columns import find
from mpi_hyst._io.read import opened, take
from mpi_hyst._io.table import refusal
from mpi_hyst.io import Columns, ReadError

_LONGEST = 20  # rows in a row: a longer gap hides turns
_MOST = 0.8  # share of all rows


def filled(
    path: Path, names: Sequence[str], rows: int | None, request: Request, refused: ReadError
) -> tuple[Columns, int]:
    """Read a refused file with straight lines where rows have no position.

    Return it with the first row that has a position: those before set the memory only. If missing
    positions are not all that is wrong with the file, raise an error about what else is.
    """
    missing: dict[int, str] = {}

    def wrong(index: int, row: int, place: str, what: str) -> None:
        said = f"{table.source}, {place}, column {table.names[index]}: {what}"
        if index != position or not is_missing(what):
            raise refusal(said, what, row)
        missing[row] = said

    if refused.rows is None or not path.is_file():
        raise refused
    with opened(path) as table:
        position = find(table.source, table.names, request.output_column)
        ordered = request.time is not False
        clock = None if request.time is False else request.time
        columns = take(table, lambda _: names, clock, rows, wrong, ordered=ordered)
    if (gap := too_long(list(missing), columns.samples)) is not None:
        first, why = gap
        raise ReadError(f"{missing[first]}, {why}", first)
    return _interpolated(columns, np.array(list(missing), dtype=int), request.output_column)


def is_missing(what: str) -> bool:
    """Whether a cell that is refused for this reason holds no reading, and nothing else."""
    return what.startswith(("empty cell", "not finite"))


def too_long(missing: Sequence[int], count: int) -> tuple[int, str] | None:
    """Return where these rows, of so many, lack so much that no straight lines take their place.

    That is the first row of a gap, and what is wrong with it.
    """
    known = np.setdiff1d(np.arange(count), missing)
    if len(missing) > _MOST * count or known.size < 2:
        return missing[0], f"the first of {len(missing)} rows of {count} without a position"
    gaps = np.diff(known) - 1
    if gaps.max(initial=0) <= _LONGEST:
        return None
    longest = int(gaps.argmax())
    what = f"the first of {gaps[longest]} rows in a row without a position"
    return int(known[longest]) + 1, f"{what}: at most {_LONGEST} are filled in"


def _interpolated(columns: Columns, missing: np.ndarray, name: str) -> tuple[Columns, int]:
    key, count = columns.key(name), columns.samples
    known = np.setdiff1d(np.arange(count), missing)
    first, last = int(known[0]), int(known[-1])
    values = {one: column[: last + 1] for one, column in columns.values.items()}
    values[key] = np.interp(np.arange(last + 1), known, columns.values[key][known])
    what = (
        f"{missing.size} of {count} rows have no position, the first is row {int(missing[0])}: "
        "straight lines take their place, and rows before the first position and after the last "
        "are not fitted"
    )
    note(f"{columns.source}: {what}")
    return replace(columns, values=values), first
