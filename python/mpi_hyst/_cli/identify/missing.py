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
from mpi_hyst.io import Columns, ReadError

_LONGEST = 20  # rows in a row: a longer gap hides turns
_MOST = 0.8  # share of all rows


class _OtherError(Exception):
    """Something else than a position is missing."""


def filled(
    path: Path, names: Sequence[str], rows: int | None, request: Request
) -> tuple[Columns, int] | None:
    """Read a file with rows without a position, straight lines in their place.

    Return it with the first row that has a position: those before set the memory only. None if
    missing positions are not all that is wrong with the file.
    """
    missing: list[int] = []

    def wrong(index: int, row: int, place: str, what: str) -> None:
        is_empty = what.startswith(("empty cell", "not finite"))
        if index != position or not is_empty:
            raise _OtherError(place)
        missing.append(row)

    if not path.is_file():
        return None
    try:
        with opened(path) as table:
            position = find(table.source, table.names, request.output_column)
            ordered = request.time is not False
            clock = None if request.time is False else request.time
            columns = take(table, lambda _: names, clock, rows, wrong, ordered=ordered)
    except (_OtherError, ReadError):
        return None
    return _interpolated(columns, np.array(missing, dtype=int), request.output_column)


def _interpolated(columns: Columns, missing: np.ndarray, name: str) -> tuple[Columns, int] | None:
    key, count = columns.key(name), columns.samples
    known = np.setdiff1d(np.arange(count), missing)
    if missing.size > _MOST * count or known.size < 2:
        return None
    if np.diff(known).max() > _LONGEST:
        return None
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
