"""The records of `mpi-hyst identify`: its options about files, and what is read from them.

Rows without a position come from a sensor that is slower than the drive, or from readings that
failed: straight lines take their place. Rows that are not fitted part a record into several, each
with a zero of its own.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, NamedTuple, TypeVar

import click
import numpy as np

from mpi_hyst import io
from mpi_hyst._cli.inputs import SAME_INTERVAL, fitted_interval, with_time_unit
from mpi_hyst._cli.options import (
    FILE,
    OfText,
    argument,
    flag,
    group,
    option,
    report,
    time_column,
    time_unit,
)
from mpi_hyst._cli.outputs import check_outputs
from mpi_hyst._cli.terminal import CommandError, note
from mpi_hyst._files import sha256
from mpi_hyst._io.read import opened, take, unit_doubt
from mpi_hyst._io.record import Level, TimeOrderError, find, key
from mpi_hyst._io.table import refusal
from mpi_hyst._quantity import Quantity, stated_unit
from mpi_hyst._report.records import Record, Records
from mpi_hyst._text import digits
from mpi_hyst._types import Samples
from mpi_hyst.io import Assumption, Columns, ReadError

Stretch = tuple[int, int]
_Value = TypeVar("_Value", str, int)

# Without a name and a unit nothing tells of which size the numbers are.
_NAMELESS: Level = "doubtful"
_ROLES = (("V", "--input-unit"), ("um", "--output-unit"))
_AMOUNT = re.compile(r"(?P<count>\d+(\.\d+)?|\.\d+) ?(?P<seconds>s)?")
_STRETCH = re.compile(r"(?P<first>[0-9]{1,9}):(?P<end>[0-9]{1,9})")
_SHORTEST_PART = 10  # samples; what is shorter tells little beside a zero of its own
_LONGEST_GAP = 20  # rows in a row: a longer gap hides turns
_MOST = 0.8  # share of all rows
_LEAVE_OUT = "; leave that out with --leave-out {}:{}"
_MEND = "; put a straight line there with --mend {}:{}"


def _stretches(
    context: click.Context, option: click.Parameter, values: tuple[str, ...]
) -> tuple[tuple[int, int], ...]:
    """Read stretches of rows, each as in 700:706."""
    found = []
    for value in values:
        match = _STRETCH.fullmatch(value)
        if match is None or int(match["first"]) >= int(match["end"]):
            message = f"expected rows FROM:TO, the first and the one behind the last, got {value!r}"
            raise click.BadParameter(message, context, option)
        found.append((int(match["first"]), int(match["end"])))
    return tuple(sorted(found))


@dataclass(frozen=True)
class Files:
    """The files that are read and written, and what of the records counts."""

    data: tuple[Path, ...] = argument(nargs=-1, required=True, type=FILE)
    input_column: str = option(
        "--input", required=True, help="Column of the drive, by name or number from 0."
    )
    output_column: str = option("--output", required=True, help="Column of the position.")
    stage_path: Path | None = option("-o", help="Stage to write (JSON).")
    report_path: Path | None = report()
    skip: tuple[str, ...] = option(
        multiple=True,
        metavar="ROWS|SECONDSs",
        help="Leading part that initializes the model but is not fitted: 1000 (rows) or 5s. "
        "Once for all files, or once per file.",
    )
    rows: tuple[int, ...] = option(
        multiple=True,
        type=click.IntRange(min=1),
        help="Number of rows to read. Once for all files, or once per file.  [default: all]",
    )
    leave_out: tuple[Stretch, ...] = option(
        multiple=True,
        metavar="FROM:TO",
        callback=_stretches,
        help="Rows whose position is not fitted, or is missing: 700:706 are rows 700 to 705, "
        "counted from 0. What is behind them has a zero of its own. Repeatable.",
    )
    mend: tuple[Stretch, ...] = option(
        multiple=True,
        metavar="FROM:TO",
        callback=_stretches,
        help="Rows whose drive was recorded wrong, or is missing: a straight line takes its place, "
        "and the position is not fitted. Repeatable.",
    )
    time: str | Literal[False] | None = time_column()
    time_unit: str | None = time_unit()
    rate: float | None = option(
        metavar="HZ", help="Sampling rate, for files without a time column."
    )
    input_unit: str | None = option(
        metavar="UNIT",
        help="Unit of the drive; nothing is converted.  [default: that in its name or in the file, "
        "else V]",
    )
    output_unit: str | None = option(
        metavar="UNIT",
        help="Unit of the position, likewise.  [default: that in its name or in the file, else um]",
    )
    negate_output: bool = flag(
        help="Turn the sign of the position, in all files: for a sensor that counts the other way."
    )
    text: OfText = group(OfText)
    validate: tuple[Path, ...] = option(
        multiple=True,
        type=FILE,
        metavar="FILE",
        help="Record for validation, with the same columns: predicted, not fitted. Repeatable.",
    )
    validate_skip: tuple[str, ...] = option(
        multiple=True,
        metavar="ROWS|SECONDSs",
        help="Leading part of the --validate files that initializes the model but counts in no "
        "error.",
    )
    validate_from: tuple[str, ...] = option(
        multiple=True,
        metavar="ROWS|SECONDSs",
        help="Reserve each file from here to its end for validation. Once for all files, or once "
        "per file.",
    )

    def check(self) -> None:
        """Refuse options that contradict each other, and outputs that cannot be written."""
        check_outputs([self.stage_path, self.report_path], [*self.data, *self.validate])
        if self.input_column == self.output_column:
            raise CommandError(f"--input and --output: both are column {self.input_column!r}")
        if self.validate and self.validate_from:
            raise CommandError("--validate and --validate-from: give one of both")
        for named, stretches in (("--leave-out", self.leave_out), ("--mend", self.mend)):
            if stretches and len(self.data) > 1:
                raise CommandError(f"{named}: expected one file, got {len(self.data)}")
            if stretches and self.validate_from:
                raise CommandError(f"{named} and --validate-from: give one of both")
        if self.validate_skip and not self.validate:
            raise CommandError("--validate-skip: no --validate file is given")


def read(files: Files) -> Records:
    """Read all records, each with the part to skip."""
    units: dict[str, str] = {}
    seen: dict[str, list[str]] = {}
    said: list[Assumption] = []
    records = _read("--skip", files.data, files.skip, files.rows, files, units, seen, said)
    held_out = _read(
        *("--validate-skip", files.validate, files.validate_skip, (), files, units, seen, said)
    )
    # What is assumed of several files alike is said once.
    assumed, doubts = (
        list(dict.fromkeys(one.text for one in said if one.level == level))
        for level in ("assumed", "doubtful")
    )
    first = records[0]
    _check_twice(records, held_out)
    records, held_out = _same_clock(records, first), _same_clock(held_out, first)
    _check_validation(held_out, first)
    if not files.validate_from:
        if files.leave_out or files.mend:
            records = parted(records[0], files.leave_out, files.mend)
        return Records(records, held_out, False, units, assumed, doubts)
    ends = _ends(records, files)
    fitted = [record.until(end) for record, end in zip(records, ends, strict=True)]
    held_out = [replace(record, skip=end) for record, end in zip(records, ends, strict=True)]
    return Records(fitted, held_out, True, units, assumed, doubts)


def _read(
    option: str,
    paths: Sequence[Path],
    skip: Sequence[str],
    rows: Sequence[int],
    files: Files,
    units: dict[str, str],
    seen: dict[str, list[str]],
    said: list[Assumption],
) -> list[Record]:
    """Read files; add to the units, to what files state of them, and to what is assumed."""
    skips = _per_file(option, skip, "0", paths)
    counts = _per_file("--rows", rows, 0, paths)
    names = [files.input_column, files.output_column]
    records: list[Record] = []
    for path, amount, count in zip(paths, skips, counts, strict=True):
        columns, first = _columns(path, names, count or None, files)
        said += _assumed(columns, files, units)
        own = zip(names, (files.input_unit, files.output_unit), _ROLES, strict=True)
        for name, given, (_, flag_of) in own:
            quantity = columns.quantity(name)
            said += _check_unit(f"{path}, column {name}", quantity, given, flag_of, seen)
            units[name] = units.get(name) or stated_unit(given or "") or quantity.suffix
        dt, seconds = fitted_interval(columns, files.rate), columns.seconds
        position = columns[files.output_column]
        if seconds is None and dt is not None:
            seconds = dt * np.arange(columns.samples, dtype=np.float64)
        records.append(
            Record(
                name=path.name,
                input=columns[files.input_column],
                output=-position if files.negate_output else position,
                seconds=seconds,
                dt=dt,
                skip=max(first, _samples(option, amount, path, seconds, columns.samples)),
                sha256=sha256(path),
            )
        )
    return records


def _assumed(columns: Columns, files: Files, units: Mapping[str, str]) -> Iterator[Assumption]:
    """Say what was assumed of a file: in reading it, and of the units of drive and position."""
    where = f"{columns.source}: "
    own = ((files.input_column, files.input_unit), (files.output_column, files.output_unit))
    given_of = {columns.key(name): given for name, given in own}
    # These are told below, with what decides them.
    again = [unit_doubt(columns.quantity(name)) for name, _ in own]
    texts = [one.text for one in again if one is not None]
    for one in columns.assumed:
        if one.stage == "units":
            name = "" if one.column is None else key(columns.names, one.column)
            is_given = all(given_of.values()) if one.column is None else bool(given_of.get(name))
            is_given = files.time_unit is not None if name == columns.time_column else is_given
            if is_given or one.text in texts:
                continue
        yield replace(one, text=where + one.text)
    for (name, given), (default, flag_of) in zip(own, _ROLES, strict=True):
        quantity = columns.quantity(name)
        doubt = (
            None if given else unit_doubt(quantity, units.get(name) or default, flag_of, _NAMELESS)
        )
        if doubt is not None:
            yield replace(doubt, text=where + doubt.text)


def _columns(path: Path, names: list[str], rows: int | None, files: Files) -> tuple[Columns, int]:
    """Read the columns of a file, and say in which row its position begins.

    Of a file that is refused say which part of it can be read.
    """
    try:
        try:
            columns, first = (
                io.read(
                    path,
                    names,
                    time=files.time,
                    rows=rows,
                    skip_lines=files.text.skip_lines,
                    thousands=files.text.thousands,
                ),
                0,
            )
        except ReadError as refused:
            columns, first = filled(path, names, rows, files, refused)
    except ReadError as error:
        hint = _hint(error) if path in files.data else ""
        if len(files.data) > 1 and "no column" in str(error):
            hint = f"; files of one record are joined: {'+'.join(map(str, files.data))}"
        raise CommandError(f"{error}{hint}") from error
    return with_time_unit(columns, files.time_unit), first


def _hint(error: ReadError) -> str:
    """Return what to do about a row that is refused."""
    if not error.rows:
        return ""
    if not isinstance(error, TimeOrderError):
        return f"; mend this row, or read what is before it with --rows {error.rows}"
    backwards = "reverse the rows if they run backwards, " if error.rows == 1 else ""
    return (
        f"; {backwards}read what is before with --rows {error.rows}, or count the rows instead "
        "with --time none --rate HZ"
    )


def _check_unit(
    where: str, quantity: Quantity, given: str | None, flag_of: str, seen: dict[str, list[str]]
) -> Iterator[Assumption]:
    """Compare the unit of a column with those of the files before; another one is refused.

    `seen` has what each file states. Where one says the unit and another says none, it is doubtful.
    """
    stated, before = quantity.suffix, seen.setdefault(flag_of, [])
    known = next(filter(None, before), "")
    if stated and known and stated != known:
        raise CommandError(f"{where}: expected {known} as before, got {stated}")
    if before and not given and (stated == "") != (before[0] == ""):
        one, other = ("this file", "files before") if stated else ("files before", "this file")
        said = f"{where}: the unit is {stated or known} in {one}, and none in {other}"
        yield Assumption("units", f"{said}: taken to be the same; {flag_of}", "doubtful")
    before.append(stated)


def _ends(records: Sequence[Record], files: Files) -> list[int]:
    """Return the samples from which on the records are held out."""
    option = "--validate-from"
    ends = []
    amounts = _per_file(option, files.validate_from, "", files.data)
    for record, path, amount in zip(records, files.data, amounts, strict=True):
        end = _samples(option, amount, path, record.seconds, record.input.size)
        if end <= record.skip:
            raise CommandError(f"{path}: {option} {amount} leaves no samples to fit")
        ends.append(end)
    return ends


def _per_file(
    option: str, values: Sequence[_Value], default: _Value, data: Sequence[Path]
) -> list[_Value]:
    """Spread the values of an option over the files: one for all, or one for each."""
    if len(values) not in (0, 1, len(data)):
        raise CommandError(
            f"{option}: given {len(values)} times for {len(data)} files; expected once, or once "
            "per file"
        )
    if len(values) == len(data):
        return list(values)
    return [values[0] if values else default] * len(data)


def _samples(option: str, amount: str, path: Path, seconds: Samples | None, samples: int) -> int:
    """Turn rows, as in 1000, or seconds, as in 5s, into samples: fewer than the file has."""
    match = _AMOUNT.fullmatch(amount.strip())
    if match is None or (not match["seconds"] and not match["count"].isdigit()):
        raise CommandError(
            f"{option}: expected rows as in 1000 or seconds as in 5s, got {amount!r}"
        )
    if not match["seconds"]:
        count = int(match["count"])
    elif seconds is None:
        raise CommandError(f"{path}: {option} {amount} needs a time column (--time) or --rate")
    else:
        count = int(np.searchsorted(seconds - seconds[0], float(match["count"])))
    if count >= samples:
        raise CommandError(f"{path}: {option} {amount} leaves none of {samples} samples")
    return count


def _same_clock(records: Sequence[Record], first: Record) -> list[Record]:
    """Give records of nearly the sampling interval of the first one that interval itself.

    Refuse records with and without one together.
    """
    same = []
    for record in records:
        if (first.dt is None) != (record.dt is None):
            known, unknown = (first, record) if record.dt is None else (record, first)
            raise CommandError(f"{unknown.name}: expected a time column as in {known.name}")
        near = first.dt and record.dt and abs(record.dt - first.dt) <= SAME_INTERVAL * first.dt
        same.append(replace(record, dt=first.dt) if near else record)
    return same


def _check_twice(records: Sequence[Record], held_out: Sequence[Record]) -> None:
    """Refuse a file that is fitted twice, or held out in fitted rows: it would predict itself."""
    fitted: dict[str, Record] = {}
    for record in records:
        _refuse_again(record, fitted.get(record.sha256 or ""))
        if record.sha256 is not None:
            fitted[record.sha256] = record
    for record in held_out:
        before = fitted.get(record.sha256 or "")
        if before is not None and record.skip < before.input.size:
            _refuse_again(record, before)


def _refuse_again(record: Record, before: Record | None) -> None:
    if before is not None:
        raise CommandError(
            f"{record.name}: expected another record, got the content of {before.name} again"
        )


def _check_validation(held_out: Sequence[Record], first: Record) -> None:
    """Refuse files for validation at another rate: the library takes that of the first record."""
    for record in held_out:
        if first.dt is not None and record.dt is not None and record.dt != first.dt:
            raise CommandError(
                f"{record.name}: expected the sampling interval of {first.name}, "
                f"{digits(first.dt)} s, got {digits(record.dt)} s"
            )


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
    path: Path, names: Sequence[str], rows: int | None, files: Files, refused: ReadError
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
    takes_options = files.data == (path,) and not files.validate_from
    with opened(path, files.text.options) as table:
        drive, position = (find(table.source, table.names, name) for name in names)
        mended = files.mend if takes_options else ()
        left_out = files.leave_out if takes_options else ()
        named = {drive: mended, position: (*mended, *left_out)}
        ordered = files.time is not False
        clock = None if files.time is False else files.time
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
    if gaps.max(initial=0) <= _LONGEST_GAP:
        return None
    longest = int(gaps.argmax())
    what = f"the first of {gaps[longest]} rows in a row without a position"
    first, end = int(known[longest]) + 1, int(known[longest + 1])
    return Gap(first, end, f"{what}: at most {_LONGEST_GAP} are filled in")


def _interpolated(
    columns: Columns, missing: np.ndarray, names: Sequence[str]
) -> tuple[Columns, int]:
    """Return the columns with straight lines, as far as rows are known or named by an option."""
    count = columns.samples
    known = np.setdiff1d(np.arange(count), missing)
    first, last = int(known[0]), int(known[-1])
    values = {one: column[: last + 1] for one, column in columns.values.items()}
    for one in map(columns.key, names):
        there = np.flatnonzero(np.isfinite(columns.values[one]))
        if not there.size:
            raise ReadError(f"{columns.source}, column {one}: expected numbers, got none")
        values[one] = np.interp(np.arange(last + 1), there, columns.values[one][there])
    if missing.size:
        what = (
            f"{missing.size} of {count} rows have no position, the first is row {int(missing[0])}: "
            "straight lines take their place, and rows before the first position and after the "
            "last are not fitted"
        )
        note(f"{columns.source}: {what}")
    return replace(columns, values=values), first


def parted(record: Record, left_out: Sequence[Stretch], mended: Sequence[Stretch]) -> list[Record]:
    """Return what lies between, each part with all samples before it: they set the memory."""
    for named, stretches in (("--leave-out", left_out), ("--mend", mended)):
        for first, last in stretches:
            if last > record.input.size:
                raise CommandError(
                    f"{named}: expected rows up to {record.input.size}, got {first}:{last}"
                )
    mended_record = replace(record, input=_mended(record, mended))
    found, begin = [], record.skip
    for first, last in [*sorted([*left_out, *mended]), (record.input.size, record.input.size)]:
        if first - begin >= _SHORTEST_PART:
            found.append(replace(mended_record.until(first), skip=begin))
        begin = max(begin, last)
    if not found:
        raise CommandError("--leave-out and --mend leave no samples to fit")
    return found


def _mended(record: Record, stretches: Sequence[Stretch]) -> Samples:
    """Return the drive with straight lines over the stretches."""
    known = np.ones(record.input.size, dtype=bool)
    for first, last in stretches:
        known[first:last] = False
    if not known.any():
        raise CommandError("--mend: expected rows that are left as they are, got none")
    rows = np.arange(record.input.size)
    return np.interp(rows, rows[known], record.input[known])
