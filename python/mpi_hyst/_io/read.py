"""Reads columns of numbers from files and objects: the stages of the package, one after another."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from itertools import pairwise
from os import PathLike
from pathlib import Path
from typing import Any, Literal

import numpy as np

from mpi_hyst._io.cells import Clock
from mpi_hyst._io.clocks import hardly_seconds
from mpi_hyst._io.formats import opened_file
from mpi_hyst._io.formats.arrays import read_object
from mpi_hyst._io.record import Assumption, Columns, Level, ReadError, find, key, there_are
from mpi_hyst._io.roles import looks_like_a_time, time_index
from mpi_hyst._io.source import PLAIN, TextOptions
from mpi_hyst._io.table import ArrayTable, Table, Wrong, of_arrays, refusal
from mpi_hyst._quantity import SECONDS, Quantity
from mpi_hyst._text import digits
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
    options: TextOptions = PLAIN,
) -> tuple[Columns, str]:
    """Read one column and the time. Without a name: the only numeric column but the time."""
    clock = None if time is False else time

    def choose(table: Table) -> _Names:
        return [column] if column is not None else [_only_numeric(table, clock)]

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
            yield _joined(parts, options, is_directory=Path(source).is_dir())
        except ReadError as error:
            where = "of a directory, " if Path(source).is_dir() else ""
            raise ReadError(f"{source}: files {where}that are joined: {error}") from error
    else:
        with opened_file(Path(source), options) as table:
            yield table


def joined_files(path: Path) -> list[Path] | None:
    """Return the files of a directory, or those of `a.txt+b.txt`; None of one file."""
    if path.is_dir():
        files = sorted(one for one in path.iterdir() if one.is_file())
        files = [one for one in files if not one.name.startswith(".")]
        return files if files else None
    if path.exists() or "+" not in str(path):
        return None
    parts = [Path(one.strip()) for one in str(path).split("+")]
    # `data/a.txt+b.txt` are beside each other.
    parts = [one if one.exists() else parts[0].parent / one for one in parts]
    return parts if all(one.is_file() for one in parts) else None


def _joined(paths: Sequence[Path], options: TextOptions, *, is_directory: bool) -> Table:
    """Join files of single channels: columns that all of them share are there once.

    A column alone in its file is called as in its header, or else like its file.
    """
    columns: list[tuple[Path, str, str, Samples]] = []
    said: list[Assumption] = []
    if is_directory:
        paths, notes = _without_notes(paths, options)
        said += notes
    begins: dict[Path, str] = {}
    for path in paths:
        with opened_file(path, options) as table:
            begins[path] = table.begins
            indices = list(numeric(table))
            loaded = table.load(indices, None, None, lambda *_: None)
            for index, values in zip(indices, loaded, strict=True):
                unit = table.units.get(index, "") or Quantity(table.names[index]).suffix
                columns.append((path, table.names[index], unit, values))
            said += [one for one in table.assumed if one.level != "said"]
    rows = {values.size for *_, values in columns}
    if len(rows) > 1:
        counts = ", ".join(dict.fromkeys(f"{path} {values.size}" for path, *_, values in columns))
        raise ReadError(f"expected files of as many rows each, got {counts}")
    shared = {
        index for index, (path, *_, values) in enumerate(columns)
        if len(paths) > 1 and bool((np.diff(values) > 0.0).all()) and all(
            any(other == one and np.array_equal(values, more) for other, *_, more in columns)
            for one in paths
        )
    }  # fmt: skip
    kept: dict[str, tuple[str, Samples]] = {}
    own = [index for index in range(len(columns)) if index not in shared]
    names = [columns[index][1] for index in own]
    for index, (path, name, unit, values) in enumerate(columns):
        if index in shared:
            called = name if not name.isdigit() else "time"
            kept.setdefault(called, (unit, values))
            continue
        alone = sum(columns[one][0] == path for one in own) == 1
        if not alone:
            called = f"{path.stem}/{name}"
        else:
            called = name if names.count(name) == 1 and not name.isdigit() else path.stem
        kept[called] = (unit, values)
    leaves = [(one.rpartition("/")[2], unit) for one, (unit, _) in kept.items()]
    if sum(Quantity(leaf, unit).is_time for leaf, unit in leaves) > 1:
        raise ReadError(f"the times of {' and '.join(map(str, paths))} differ: read them apart")
    what = " + ".join(map(str, paths))
    said += _starts(begins)
    said.append(Assumption("bytes", f"{len(paths)} files are joined, row by row", "assumed"))
    return of_arrays(
        what, None, what, {one: values for one, (_, values) in kept.items()},
        {one: unit for one, (unit, _) in kept.items()}, assumed=said,
    )  # fmt: skip


def _starts(begins: Mapping[Path, str]) -> Iterator[Assumption]:
    """Say if files that are joined tell different times above their tables."""
    told = {path: stamp for path, stamp in begins.items() if stamp}
    if len(set(told.values())) < 2:
        return
    (one, first), (other, second) = next((a, b) for a, b in pairwise(told.items()) if a[1] != b[1])
    clock = Clock((first, second))
    # Between a date and a time of the day a file may have commas.
    times = [clock.seconds(re.sub(r"[,;]\s*(?=\d+:)", " ", stamp)) for stamp in (first, second)]
    apart = ""
    if times[0] is not None and times[1] is not None:
        apart = f", {digits(1e3 * abs(times[1] - times[0]))} ms apart"
    said = (
        f"{one.name} tells {first}, {other.name} tells {second}{apart}: rows are joined by their "
        "numbers, and a difference of starts becomes a dead time or a lead; cut the earlier file"
    )
    yield Assumption("table", said, "doubtful")


def _without_notes(
    paths: Sequence[Path], options: TextOptions
) -> tuple[list[Path], list[Assumption]]:
    """Leave out the files of a directory that hold no columns of numbers, and say so."""
    kept = []
    for path in paths:
        try:
            with opened_file(path, options) as table:
                kept += [path] if table.numeric else []
        except ReadError as error:
            # Where numbers are refused there are some.
            if error.rows is not None or path.suffix.lower() not in _NOTES:
                raise
    left = [path.name for path in paths if path not in kept]
    if not left or not kept:
        return list(paths), []
    what = f"no columns of numbers in {', '.join(left)}: left out of the files that are joined"
    return kept, [Assumption("bytes", what, "assumed")]


_NOTES = (".txt", ".md", ".log", ".json", ".ini", ".pdf", ".png", ".jpg", ".svg", ".docx", "")


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
    witness = _witness(table, indices) if ordered and clock is None and names is not None else []

    def unless_witness(index: int, rows: int, place: str, what: str) -> None:
        if index not in witness:
            refuse(index, rows, place, what)

    clocks = [] if clock is None or not ordered else _other_clocks(table, clock, chosen)
    if clock is not None:
        witness = [index for index in clocks if index not in indices]
    loaded = table.load([*indices, *witness], rows, clock, unless_witness)
    if clock is None:
        for values in loaded[len(indices) :]:
            table.assumed += _told_by(table, witness[0], values)
    else:
        columns = dict(zip([*indices, *witness], loaded, strict=True))
        table.assumed += _clocks_apart(table, clock, {one: columns[one] for one in clocks}, columns)
    if ordered and clock is None:
        table.assumed += _unused_clocks(table)
    if names is None and table.other:
        left = ", ".join(f"{name} ({what})" for name, what in table.other.items())
        table.assumed.append(Assumption("table", f"not read: {left}", "assumed"))
    keys = [key(table.names, index) for index in indices]
    units = {
        name: table.units.get(index) or Quantity(table.names[index]).suffix
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


def _witness(table: Table, indices: Sequence[int]) -> list[int]:
    """Return a column that may be the time, though neither its name nor anybody said so."""
    others = [index for index in table.numeric if index not in indices]
    quantities = [Quantity(table.names[index], table.units.get(index, "")) for index in others]
    may_be = ("", *SECONDS)
    return [index for index, one in zip(others, quantities, strict=True) if one.suffix in may_be][
        :1
    ]


def _other_clocks(table: Table, clock: int, chosen: Sequence[int]) -> list[int]:
    """Return the other columns that may be a time of the chosen ones: beside them in their group.

    Where starts of channels are known, rows of the same time come together already.
    """
    if isinstance(table, ArrayTable) and table.aligned:
        return []
    groups = {re.split(r"[./][^./]*$", table.names[index])[0] for index in chosen}
    found = []
    for index in table.numeric:
        group, _, leaf = table.names[index].replace(".", "/").rpartition("/")
        quantity = Quantity(leaf, table.units.get(index, ""))
        is_time = quantity.is_time or quantity.column == "t" or quantity.time_unit
        is_near = not group or group in {one.replace(".", "/") for one in groups}
        if index != clock and is_time and is_near:
            found.append(index)
    return found


def _clocks_apart(
    table: Table, clock: int, others: Mapping[int, Samples], columns: Mapping[int, Samples]
) -> Iterator[Assumption]:
    """Say which other clocks differ from the one that is the time."""

    def seconds(index: int) -> Samples:
        leaf = re.split(r"[./]", table.names[index])[-1]
        unit = Quantity(leaf, table.units.get(index, "")).time_unit or "s"
        return columns[index] * SECONDS[unit]

    time = seconds(clock)
    for index, values in others.items():
        if values.size < _FEWEST or not bool((np.diff(values) > 0.0).all()):
            continue
        apart = seconds(index) - time
        if abs(apart[0]) > _OTHER_ERA:
            # Of a date and a time since the start only the steps can be compared.
            apart = apart - apart[0]
        step = float(np.median(np.diff(time)))
        off = float(np.median(np.abs(apart)))
        if off > _APART * step or np.abs(apart).max() > 2.0 * step:
            most = off if off > _APART * step else float(np.abs(apart).max())
            said = f"{table.names[index]} and {table.names[clock]}, which is the time, are "
            said += f"{digits(1e3 * most)} ms apart: columns of another clock are shifted by that"
            yield Assumption("roles", said, "doubtful")


_FEWEST = 3  # samples that make a clock
_OTHER_ERA = 1e6  # seconds
_APART = 0.05  # of a step


def _unused_clocks(table: Table) -> Iterator[Assumption]:
    """Say which columns are called or measured as a time, where none of them is used."""
    clocks = []
    for index in table.numeric:
        name, unit = table.names[index], table.units.get(index, "")
        leaf = Quantity(re.split(r"[./]", name)[-1], unit)
        if leaf.is_time or leaf.column == "t" or (unit and leaf.time_unit):
            clocks.append(name)
    if clocks:
        which = "looks like a time" if len(clocks) == 1 else "look like times"
        said = f"{', '.join(clocks)} {which}, and none is used: --time says which"
        yield Assumption("roles", said, "doubtful")


def _told_by(table: Table, index: int, values: Samples) -> Iterator[Assumption]:
    """Say if a column that is not used runs like a time."""
    if looks := looks_like_a_time(values):
        said = f"column {table.names[index]} looks like a time: {looks}"
        yield Assumption("roles", said, "doubtful")
    elif (
        re.fullmatch(r"\d+|index|", table.names[index].lower())
        and values.size > 2
        and bool((np.diff(values) > 0.0).all())
    ):
        said = f"column {table.names[index]} grows as a time does and is not used: --time says it"
        yield Assumption("roles", said, "assumed")


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


def clock_doubt(quantity: Quantity, values: Samples) -> Assumption:
    """Return what is assumed of a time without a unit of time, and whether it is doubtful."""
    unlikely = f"is in {quantity.suffix!r}" if quantity.suffix else hardly_seconds(values)
    what = unlikely or "has no unit: seconds are assumed; --time-unit"
    if quantity.suffix:
        what += ": seconds are assumed; --time-unit"
    level: Level = "doubtful" if unlikely else "assumed"
    return Assumption("units", f"time column {quantity.column} {what}", level)


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


def numeric(table: Table) -> Sequence[int]:
    """Return the columns of numbers; a table without is refused."""
    if not table.numeric:
        told = [
            f"{name} is {what}" if " x " in what else f"{name}: {what}"
            for name, what in table.other.items()
            if " x " in what or "(expected" in what
        ]
        said = "; ".join([f"no numeric column; {there_are(table.names)}", *told])
        raise ReadError(f"{table.source}: {said}")
    return table.numeric


def _only_numeric(table: Table, time: str | None) -> str | int:
    clock = time_index(table, time)
    others = [index for index in numeric(table) if index != clock]
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
