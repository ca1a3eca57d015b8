"""What speaks against a table as it was found: names, units and rows that may be others."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from mpi_hyst._io.cells import is_dated, number, seconds_between
from mpi_hyst._io.clocks import even_step, rows_before
from mpi_hyst._io.first_row import is_word, may_be_names, may_be_settings
from mpi_hyst._io.record import Assumption
from mpi_hyst._quantity import SECONDS, Quantity
from mpi_hyst._text import digits

OF_REMARKS = re.compile(r"(comment|remark|note|kommentar|bemerkung)s?\b", re.IGNORECASE)
OF_RIGOL = re.compile(r"(start|increment|t0|tinc|t_?inc\w*)\b.*", re.IGNORECASE)
_EVEN = 1e-3  # of a step: steps of a time
_OF_ZONES = 900.0  # seconds: clocks of two zones are apart by so many, or a multiple
_APART = 0.05  # of a step


@dataclass(frozen=True)
class Laid:
    """A table as it was found. Lines are counted from 0."""

    names: Sequence[str]
    units: Mapping[int, str]
    numeric: Sequence[int]
    stamped: Sequence[int]
    decimal: str
    header: int | None
    above: Sequence[str]
    """The names of a header among the rows, also those beyond the table; empty without one."""
    heading: str
    """The text of a header whose names are parted at blanks; else empty."""
    first: int
    first_row: Sequence[str]
    """What stands there, if it is a row or not."""
    rows: Mapping[int, Sequence[str]]
    """The rows from there on that fit the table, by their lines."""
    texts: Sequence[str]
    """The first rows as they stand."""
    data: Sequence[Sequence[str]]
    """The rows by which the table was found."""
    width: int


def doubts_of(laid: Laid) -> Iterator[Assumption]:
    """Say all that may be otherwise."""
    if laid.above:
        yield from _shifted(laid)
    yield from _first(laid)
    yield from _gaps(laid)
    yield from _lost_unit(laid)
    yield from _starts(laid)


def _doubtful(said: str) -> Assumption:
    return Assumption("dialect", said, "doubtful")


def _shifted(laid: Laid) -> Iterator[Assumption]:
    """Say if names may stand above other columns than theirs.

    A column without a name has numbers, and one with a name has none. Or no column is called as a
    time, and one with another unit grows as a time does.
    """
    names = laid.above
    nameless = [index for index in laid.numeric if index and not names[index]]
    if nameless and any(names[laid.width :]):
        empty = next(name for name in names[laid.width :] if name)
        said = f"column {nameless[0]} has numbers and no name, {empty} has a name and no numbers"
        yield _doubtful(f"{said}: names may be shifted")
    for index in laid.numeric:
        if '"' in names[index] and not Quantity(names[index], laid.units.get(index, "")).suffix:
            yield _doubtful(f"a quotation mark in the name {names[index]!r}: it may part a unit")
    named = [names[index] for index in laid.numeric]
    remarks = [one for one in named if OF_REMARKS.match(one) or OF_RIGOL.fullmatch(one)]
    if remarks:
        yield _doubtful(f"column {remarks[0]} has numbers: names may be shifted")
    quantities = [Quantity(name, laid.units.get(i, "")) for i, name in enumerate(laid.names)]
    if len(laid.numeric) < 3 or any(one.is_time or one.name == "t" for one in quantities):
        return
    for index in laid.numeric:
        column = [number(cells[index], laid.decimal) for cells in laid.data]
        known = [value for value in column if value is not None]
        unit = quantities[index].suffix
        if unit and unit not in SECONDS and even_step(known, _EVEN):
            said = f"{laid.names[index]} grows in equal steps as a time does, and no column is "
            yield _doubtful(f"{said}called so: a name may be missing")


def _first(laid: Laid) -> Iterator[Assumption]:
    """Say if the first row may be a setting, or a header of numbers."""
    row = laid.first_row[: laid.width]
    below = [cells for line, cells in laid.rows.items() if line > laid.first]
    words = [row[index] for index in laid.numeric if index < len(row) and is_word(row[index])]
    line = f"line {laid.first + 1}"
    if words:
        said = f"{line}: {words[0]!r} stands where the rows below have numbers: it is hardly a "
        yield _doubtful(f"{said}row of the table; leave out that line")
    if laid.header is None and may_be_names(row, below, laid.decimal):
        said = f"{line}, {', '.join(row)}: taken for a row, though it may be names"
        yield _doubtful(f"{said}; --skip-lines {laid.first + 1}")
    elif laid.header is not None and may_be_settings(row, below, laid.decimal):
        said = f"{line}, {', '.join(row)}: taken for a row, though it is far from the next ones "
        yield _doubtful(f"{said}and may hold settings; leave out that line")
    else:
        yield from _before_clock(laid)


def _before_clock(laid: Laid) -> Iterator[Assumption]:
    """Say which first rows do not lead to the first clock that runs behind them."""
    lines, rows = list(laid.rows), list(laid.rows.values())
    for index in laid.numeric:
        name, unit = laid.names[index], laid.units.get(index, "")
        values = [number(cells[index], laid.decimal) for cells in rows]
        known = [value for value in values if value is not None]
        if Quantity(name, unit).suffix not in ("", *SECONDS) or len(known) < len(values):
            continue
        if (count := rows_before(known)) is None:
            continue
        if count:
            top, last, next_ = lines[0] + 1, lines[count - 1] + 1, lines[count] + 1
            which = f"line {top} does" if count == 1 else f"lines {top} to {last} do"
            way = f"--skip-lines {last}" if laid.header is None else "leave them out"
            said = f"{which} not go on as column {name} does from line {next_} on, and may hold "
            yield _doubtful(f"{said}settings; {way}")
        return


def _gaps(laid: Laid) -> Iterator[Assumption]:
    """Say if names are parted at single blanks, and wider gaps part another number of them."""
    names, wide = laid.heading, r"\S(\s{2,}|\t)\S"
    if not re.search(wide, names) or any(re.search(wide, row) for row in laid.texts):
        return
    count = len(re.split(r"\s{2,}|\t", names))
    if count != laid.width and not re.search(r"[\[(,;]", names):
        assert laid.header is not None
        said = f"line {laid.header + 1} has {count} names with wide gaps between them, and "
        yield _doubtful(f"{said}{laid.width} words: names may be shifted")


def _lost_unit(laid: Laid) -> Iterator[Assumption]:
    """Say if all names have a unit in brackets but for one."""
    names = {index: laid.names[index] for index in laid.numeric}
    without = [n for n, name in names.items() if not re.search(r"[\[(].+[\])]", name)]
    quantities = [Quantity(name) for index, name in names.items() if index not in without]
    if len(without) != 1 or len(quantities) < 2 or not all(one.suffix for one in quantities):
        return
    name = names[without[0]]
    if without[0] not in laid.units and not Quantity(name).suffix:
        said = f"no unit in {name!r}, and all other names have one in brackets: it may be lost"
        yield Assumption("units", said, "doubtful", without[0])


def _starts(laid: Laid) -> Iterator[Assumption]:
    """Say if columns of dates begin at other times: each counts from its own first row."""
    rows = list(laid.rows.values())
    if len(rows) < 2:
        return
    top, below = rows[:2]
    dated = [index for index in laid.stamped if is_dated(top[index])]
    steps = {index: seconds_between(top[index], below[index]) or 0.0 for index in dated}
    # A date that stands is that of the record.
    clocks = [index for index in dated if steps[index] > 0.0]
    for index in clocks[1:]:
        late = seconds_between(top[clocks[0]], top[index]) or 0.0
        zones = abs(late / _OF_ZONES - round(late / _OF_ZONES)) * _OF_ZONES
        if zones > _APART * steps[clocks[0]]:
            where = "behind" if late > 0.0 else "before"
            said = f"{laid.names[index]} begins {digits(1e3 * abs(late))} ms {where} "
            said += f"{laid.names[clocks[0]]}: rows are joined by their numbers, and the "
            yield _doubtful(f"{said}difference becomes a dead time or a lead; shift the columns")
