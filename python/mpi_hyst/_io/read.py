"""Reads columns of numbers from files and objects."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from typing import Any, Literal

from mpi_hyst._io.columns import Columns, ReadError, find, key, there_are
from mpi_hyst._io.formats import opened_file
from mpi_hyst._io.objects import read_object
from mpi_hyst._io.table import Table, Wrong, refusal
from mpi_hyst._quantity import Quantity

TIME_COLUMNS = ("time_s", "time")
"""What the time column is called, first choice first; other names of time come after."""

_Names = Sequence[str | int]


def read(
    source: str | PathLike[str] | Any,
    columns: str | int | _Names | None = None,
    *,
    time: str | int | Literal[False] | None = None,
    rows: int | None = None,
) -> Columns:
    r"""Read columns of numbers from a file, or from an object with columns by name.

    Files: text (CSV, TSV, semicolons, white space; also as .gz, .bz2 or .xz), .npy, .npz, .mat,
    HDF5, TDMS and .lvm, recognised by their content. Objects: a dict of arrays, DataFrames of
    pandas and polars, a Dataset of xarray, a structured array.

    In text the header may have lines above it and a row of units below it, or may be missing. Lines
    that begin with #, %, // or ; are comments. The decimal mark is a point, or a comma where no
    comma separates the cells. What is not a finite number, or a time that does not increase, is
    refused.

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
    with opened(source) as table:
        clock = None if time is False else time
        return take(table, lambda _: wanted, clock, rows, ordered=time is not False)


def read_trajectory(
    path: Path, column: str | None, *, time: str | Literal[False] | None = None
) -> tuple[Columns, str]:
    """Read one column and the time. Without a name: the only numeric column but the time."""
    clock = None if time is False else time

    def choose(table: Table) -> _Names:
        return [column] if column is not None else [_only_numeric(table, clock)]

    with opened(path) as table:
        found = take(table, choose, clock, None, ordered=time is not False)
        return found, next(iter(found.values))


@contextmanager
def opened(source: str | PathLike[str] | Any) -> Iterator[Table]:
    """Open a file or an object."""
    if isinstance(source, (str, PathLike)):
        with opened_file(Path(source)) as table:
            yield table
    else:
        yield read_object(source)


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
    chosen = (
        numeric(table) if names is None else [find(table.source, table.names, n) for n in names]
    )
    if rows is not None and rows < 1:
        raise ReadError(f"rows: expected at least 1, got {rows}")
    clock = time_index(table, time) if ordered else None
    indices = list(dict.fromkeys([*chosen, *([] if clock is None else [clock])]))
    if not indices:
        raise ReadError("columns: expected at least one, got none")
    if names is None:
        for index in indices:
            # Two columns of one name: which one is meant must be said.
            find(table.source, table.names, table.names[index])
    loaded = table.load(indices, rows, clock, wrong or _refuser(table))
    keys = [key(table.names, index) for index in indices]
    units = {
        name: table.units.get(table.names[index]) or Quantity(name).suffix
        for name, index in zip(keys, indices, strict=True)
    }
    return Columns(
        table.path,
        dict(zip(keys, loaded, strict=True)),
        None if clock is None else key(table.names, clock),
        {name: unit for name, unit in units.items() if unit},
        table.format,
        tuple(table.names),
    )


def time_index(table: Table, time: str | int | None) -> int | None:
    """Return the index of the time column that was asked for, or that is called so."""
    if time is not None:
        return find(table.source, table.names, time)
    for name in TIME_COLUMNS:
        if name in table.names:
            return find(table.source, table.names, name)
    named = [
        index
        for index in table.numeric
        if Quantity(table.names[index], table.units.get(table.names[index], "")).is_time
    ]
    # A bare t may be something else, so every name that says more goes first.
    bare = [i for i in table.numeric if table.names[i] == "t" and not table.units.get("t")]
    return next(iter([*named, *bare]), None)


def numeric(table: Table) -> Sequence[int]:
    """Return the columns of numbers; a table without is refused."""
    if not table.numeric:
        raise ReadError(f"{table.source}: no numeric column; {there_are(table.names)}")
    return table.numeric


def _only_numeric(table: Table, time: str | None) -> str:
    clock = time_index(table, time)
    names = [table.names[index] for index in numeric(table) if index != clock]
    if not names:
        what = "no numeric column beside the time"
        raise ReadError(f"{table.source}: {what}; {there_are(table.names)}")
    if len(names) > 1:
        several = "several columns, choose one with --column"
        raise ReadError(f"{table.source}: {several}: {', '.join(names)}")
    return names[0]


def _refuser(table: Table) -> Wrong:
    def refuse(index: int, rows: int, place: str, what: str) -> None:
        message = f"{table.source}, {place}, column {table.names[index]}: {what}"
        raise refusal(message, what, rows)

    return refuse
