"""Reads columns of numbers from files and objects: the stages of the package, one after another."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Any, Literal

from mpi_hyst._io.clock_doubts import (
    clock_doubt,
    clocks_apart,
    other_clocks,
    told_by,
    unused_clocks,
    witness_of,
)
from mpi_hyst._io.formats import opened_file
from mpi_hyst._io.formats.arrays import read_object
from mpi_hyst._io.joined import joined, joined_files
from mpi_hyst._io.record import Assumption, Columns, Level, ReadError, find, key, there_are
from mpi_hyst._io.roles import looks_like_a_time, time_index
from mpi_hyst._io.source import PLAIN, TextOptions
from mpi_hyst._io.table import Table, Wrong, numeric, refusal
from mpi_hyst._quantity import SECONDS, Quantity
from mpi_hyst._types import Samples

_Names = Sequence[str | int]


def read(
    source: str | PathLike[str] | Any,
    columns: str | int | _Names | None = None,
    *,
    time: str | int | Literal[False] | None = None,
    rows: int | None = None,
    skip_lines: int = 0,
    thousands: str | None = None,
) -> Columns:
    r"""Read columns of numbers from a file, or from an object with columns by name.

    Files: text (CSV, TSV, semicolons, white space; also as .gz, .bz2 or .xz), .npy, .npz, .mat,
    HDF5, TDMS, .lvm and .xlsx, recognised by their content. A directory, and "a.txt+b.txt", are
    single channels that are joined. Objects: a dict of arrays, DataFrames of pandas and polars, a
    Dataset of xarray, a structured array.

    In text the header may have lines above it and a row of units below it, or may be missing. Lines
    that begin with #, %, // or ; are comments. The decimal mark is a point, or a comma where no
    comma separates the cells. What is not a finite number, or a time that does not increase, is
    refused. What was assumed is in `Columns.assumed`.

    Parameters
    ----------
    source : str, path, or object
        The file, or the object.
    columns : sequence of str or int, optional
        The columns to read, by name or by number from 0. Names in structures are paths:
        "data/drive" or "data.drive". By default all columns of numbers that are equally long.
    time : str, int or False, optional
        The time column; by default `time_s` or `time`, else one that is called so with a unit, as
        `t_ms` or `Time (us)`, else `t`, in seconds, if there is one. False: none is.
    rows : int, optional
        Read only so many rows.
    skip_lines : int, default 0
        Of a text, leave out so many lines at the top.
    thousands : {".", ",", "'", " ", ""}, optional
        Of a text, what parts thousands; "" if nothing does. By default numbers are refused where
        1.277 may be 1277.

    Returns
    -------
    Columns
        The columns by their names.

    Raises
    ------
    ReadError
        If the source holds something else; the message names file, line and column.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as directory:
    ...     path = Path(directory) / "record.csv"
    ...     _ = path.write_text("Time;Drive;Sensor\nms;V;µm\n0;0,0;0,0\n0,5;1,0;0,005\n")
    ...     record = mh.io.read(path, ["Drive", "Sensor"])
    >>> record["Sensor"]
    array([0.   , 0.005])
    >>> record.units["Sensor"], record.sample_time
    ('um', 0.0005)
    >>> mh.io.read({"clock": [0.0, 0.1], "u": [0.0, 5.0]}, time="clock")["u"]
    array([0., 5.])

    """
    wanted = [columns] if isinstance(columns, (str, int)) else columns
    with opened(source, TextOptions(skip_lines, thousands)) as table:
        clock = None if time is False else time
        return take(table, lambda _: wanted, clock, rows, ordered=time is not False)


def read_trajectory(
    path: Path,
    column: str | None,
    *,
    time: str | Literal[False] | None = None,
    beside: str | None = None,
    options: TextOptions = PLAIN,
) -> tuple[Columns, str]:
    """Read one column and the time; and another column, if it is named.

    Without a name: the only numeric column but these.
    """
    clock = None if time is False else time

    def choose(table: Table) -> _Names:
        further = [] if beside is None else [_find(table, beside)]
        return [_only_numeric(table, clock, further) if column is None else column, *further]

    with opened(path, options) as table:
        found = take(table, choose, clock, None, ordered=time is not False)
        return found, next(iter(found.values))


@contextmanager
def opened(source: str | PathLike[str] | Any, options: TextOptions = PLAIN) -> Iterator[Table]:
    """Open a file, several that are joined, or an object."""
    if not isinstance(source, (str, PathLike)):
        yield read_object(source)
    elif (parts := joined_files(Path(source))) is not None:
        try:
            yield joined(parts, options, is_directory=Path(source).is_dir())
        except ReadError as error:
            where = "of a directory, " if Path(source).is_dir() else ""
            raise ReadError(f"{source}: files {where}that are joined: {error}") from error
    else:
        with opened_file(Path(source), options) as table:
            yield table


def take(
    table: Table,
    choose: Callable[[Table], _Names | None],
    time: str | int | None,
    rows: int | None,
    wrong: Wrong | None = None,
    *,
    ordered: bool = True,
) -> Columns:
    """Read the chosen columns and the time; None chooses all of numbers.

    If they need not be `ordered`, no column is treated as the time.
    """
    names = choose(table)
    chosen = numeric(table) if names is None else [_find(table, name) for name in names]
    if rows is not None and rows < 1:
        raise ReadError(f"rows: expected at least 1, got {rows}")
    clock = time_index(table, time, chosen) if ordered else None
    indices = list(dict.fromkeys([*chosen, *([] if clock is None else [clock])]))
    if not indices:
        raise ReadError("columns: expected at least one, got none")
    if names is None:
        for index in indices:
            # Two columns of one name: which one is meant must be said.
            find(table.source, table.names, table.names[index])
    refuse = wrong or _refuser(table)
    witness = witness_of(table, indices) if ordered and clock is None and names is not None else []

    def unless_witness(index: int, rows: int, place: str, what: str) -> None:
        if index not in witness:
            refuse(index, rows, place, what)

    clocks = [] if clock is None or not ordered else other_clocks(table, clock, chosen)
    if clock is not None:
        witness = [index for index in clocks if index not in indices]
    loaded = table.load([*indices, *witness], rows, clock, unless_witness)
    if clock is None:
        for values in loaded[len(indices) :]:
            table.assumed += told_by(table, witness[0], values)
    else:
        columns = dict(zip([*indices, *witness], loaded, strict=True))
        table.assumed += clocks_apart(table, clock, {one: columns[one] for one in clocks}, columns)
    if ordered and clock is None:
        table.assumed += unused_clocks(table)
    if names is None and table.other:
        left = ", ".join(f"{name} ({what})" for name, what in table.other.items())
        table.assumed.append(Assumption("table", f"not read: {left}", "assumed"))
    keys = [key(table.names, index) for index in indices]
    units = {
        name: Quantity(table.names[index], table.units.get(index, "")).suffix
        for name, index in zip(keys, indices, strict=True)
    }
    return Columns(
        table.path,
        dict(zip(keys, loaded, strict=False)),
        None if clock is None else key(table.names, clock),
        {name: unit for name, unit in units.items() if unit},
        table.format,
        tuple(table.names),
        tuple(_assumed(table, indices, clock, loaded)),
    )


def _find(table: Table, wanted: str | int) -> int:
    """Return the index of a column; where there is none, say also what was not understood."""
    try:
        return find(table.source, table.names, wanted)
    except ReadError as error:
        doubts = [one.text for one in table.assumed if one.level == "doubtful"]
        wide = [f"{name} is {what}" for name, what in table.other.items() if " x " in what]
        raise ReadError("; ".join([str(error), *doubts, *wide])) from error


def _assumed(
    table: Table, indices: Sequence[int], clock: int | None, loaded: Sequence[Samples]
) -> Iterator[Assumption]:
    """Go through what the stages assumed, as far as it is about these columns."""
    yield from (one for one in table.assumed if one.column is None or one.column in indices)
    for index, values in zip(indices, loaded, strict=False):
        quantity = Quantity(table.names[index], table.units.get(index, ""))
        if index == clock:
            if quantity.time_unit:
                continue
            yield replace(clock_doubt(quantity, values), column=index)
            continue
        if (doubt := unit_doubt(quantity)) is not None:
            yield replace(doubt, column=index)
        looks = "" if quantity.suffix not in ("", *SECONDS) else looks_like_a_time(values)
        if looks:
            said = f"column {quantity.column} looks like a time: {looks}"
            yield Assumption("roles", said, "doubtful", index)
    said = "no column is the time" if clock is None else f"the time is {table.names[clock]}"
    yield Assumption("roles", said)


def unit_doubt(
    quantity: Quantity, assumed: str = "", option: str = "", nameless: Level = "assumed"
) -> Assumption | None:
    """Return what is doubtful about the unit of a column, or assumed; None if it is told.

    `assumed` is the unit that a column without one is taken to have, which `option` decides.
    `nameless` is how doubtful that is of a column that has a number in place of a name: a header
    may be lost.
    """
    unused, unit = quantity.unused, quantity.suffix
    if quantity.factor:
        said = f"{quantity.column!r} holds the factor {quantity.factor!r}, which is not applied"
        return Assumption("units", f"{said}; {option}" if option else said, "doubtful")
    if unit:
        if not unused:
            return None
        said = f"{quantity.column!r} holds {unused!r}, and {unit} is taken"
        return Assumption("units", f"{said}; {option}" if option else said, "doubtful")
    takes = f": {assumed} is assumed" + (f"; {option}" if option else "") if assumed else ""
    if unused:
        level: Level = "doubtful" if quantity.meant != assumed else "assumed"
        if not assumed and quantity.is_word:
            level = "assumed"
        holds = f"no unit taken from {quantity.column!r}, though it holds {unused!r}"
        return Assumption("units", holds + takes, level)
    said = f"no unit in {quantity.column!r}{takes}"
    level = nameless if _NUMBER.fullmatch(quantity.column) else "assumed"
    return Assumption("units", said, level) if assumed else None


_NUMBER = re.compile(r"(column )?\d+(\.0)?")


def _only_numeric(table: Table, time: str | None, beside: Sequence[int]) -> str | int:
    clock = time_index(table, time)
    others = [index for index in numeric(table) if index != clock and index not in beside]
    if not others:
        what = "no numeric column beside the time"
        raise ReadError(f"{table.source}: {what}; {there_are(table.names)}")
    if len(others) > 1:
        several = "several columns, choose one with --column"
        names = ", ".join(table.names[index] for index in others)
        raise ReadError(f"{table.source}: {several}: {names}")
    return others[0]


def _refuser(table: Table) -> Wrong:
    def refuse(index: int, rows: int, place: str, what: str) -> None:
        message = f"{table.source}, {place}, column {table.names[index]}: {what}"
        raise refusal(message, what, rows)

    return refuse
