"""Tables in text: comma, semicolon, tab or white space between the cells."""

from __future__ import annotations

import math
import re
from array import array
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import islice, pairwise
from pathlib import Path
from typing import Protocol

import numpy as np

from mpi_hyst._core import plain_rows
from mpi_hyst._io import dialect as dialects
from mpi_hyst._io.cells import (
    Clock,
    is_comment,
    is_like_a_number,
    is_number,
    number,
    quotes_are_closed,
    split,
    why_no_number,
)
from mpi_hyst._io.marks import unparted
from mpi_hyst._io.preamble import factor_in
from mpi_hyst._io.record import Assumption, ReadError
from mpi_hyst._io.source import PLAIN, NulError, TextOptions
from mpi_hyst._io.table import MAX_MAGNITUDE, MAX_ROWS, Wrong, later
from mpi_hyst._quantity import Quantity, known_unit, units_told
from mpi_hyst._types import Samples

_SAMPLE_LINES = 500
_SAMPLE_CHARACTERS = 4_000_000
_ABOVE = 100  # lines above a table in which its header is
_NEAR_ROWS = 5
_SHOWN = 60  # characters of a comment
_LAST_ROWS = 20  # that tell how long a last number should be
# Bytes of a block of rows. Behind a row that is not plain the rest of a block is read again.
_SMALLEST, _LARGEST = 1 << 16, 1 << 22
_WORTH_A_BLOCK = 200  # rows


class Text(Protocol):
    """Lines of a text that come one after the other, as `source.Lines` and the rows of a sheet."""

    encoding: str
    last_is_open: bool

    def __iter__(self) -> Iterator[str]:
        """Return the iterator itself."""

    def __next__(self) -> str:
        """Return the next line."""

    def block(self, least: int) -> bytes:
        """Return whole lines that come next, as bytes, without reading them off."""

    def skip(self, size: int, lines: int) -> None:
        """Read off so many bytes of a block, which are so many lines."""

    def not_text(self) -> ReadError:
        """Return the error about a content that is none."""


class TextTable:
    """The table in a text. Its rows are read from start to end, once."""

    def __init__(
        self, path: Path, lines: Text, packed: str = "", options: TextOptions = PLAIN
    ) -> None:
        """Look at the first lines; `packed` is the suffix of the packer."""
        self.path: Path | None = path
        self.source: str = str(path)
        self._lines = lines
        self._before: deque[str] = deque()
        """Lines that were looked at, and are still to be read."""
        self._nul: NulError | None = None
        # Of single lines, until the end tells of them: comments since the last row, all of them
        # with whether they hold a row, and quotation marks that are not closed.
        self._comments: list[tuple[int, str]] = []
        self._left_out: list[tuple[int, bool]] = []
        self._clocks: dict[int, Clock] = {}
        self._changes: list[tuple[int, str]] = []
        self._open_quotes: list[int] = []
        self._late_header = 0
        self._not_plain = 0
        """The line from which on it is worth to try whole blocks of rows."""
        self._block = _SMALLEST
        self._options = options
        skipped = self._sample(options.skip_lines)
        sample = [*([""] * len(skipped)), *self._sample(_SAMPLE_LINES)]
        if not any(line.strip() for line in sample):
            raise ReadError(f"{path}: empty file, expected a header with column names")
        found = dialects.detect(sample, options.skip_lines, options.thousands)
        if _width(found) < 2 and not found.in_rows:
            found = self._below(sample, found)
        if not found.numeric and self._nul is not None:
            raise lines.not_text()
        if found.refused:
            raise ReadError(f"{path}, {found.refused}")
        self._dialect = found
        self.begins: str = _stamp_in(sample[: found.first])
        """The first time of the day above the table, as text; empty if there is none."""
        self._first_lines = sample[found.first :]
        self._before.extend(self._first_lines)
        self._number = found.first
        self._whole_rows = 0
        self.names: Sequence[str] = found.names
        for place, line in enumerate(sample[: found.first]):
            is_above = found.header is not None and place <= found.header
            if not is_above and is_comment(line, found.delimiter):
                self._left_out += [(place + 1, True)] if self._is_row(line) else []
        self.numeric: Sequence[int] = sorted({*found.numeric, *found.stamped})
        # Whatever their name or a row of units says: stamps become seconds.
        self.units: Mapping[int, str] = {
            **{index: known_unit(unit) or unit for index, unit in found.units.items()},
            **dict.fromkeys(found.stamped, "s"),
        }
        first = [split(line, found.delimiter) for line in sample[found.first :] if line.strip()]
        self.other: Mapping[str, str] = {
            name: f"no numbers in most rows{_why(found, first, index)}"
            for index, name in enumerate(self.names)
            if index not in self.numeric
        }
        parts = ["text", f"packed as {packed}" if packed else "", found.text]
        self.format: str = ", ".join(part for part in parts if part)
        if lines.encoding != "utf-8":
            self.format += f", {lines.encoding}"
        self.assumed: list[Assumption] = [*self._told(), *found.assumed]

    def _sample(self, count: int) -> list[str]:
        """Read the next lines, up to NUL bytes, which are refused where their row is read."""
        sample, characters = [], 0
        try:
            for line in islice(self._lines, count):
                sample.append(line)
                characters += len(line)
                if characters > _SAMPLE_CHARACTERS:
                    break
        except NulError as error:
            self._nul = error
        return sample

    def _below(self, sample: list[str], found: dialects.Dialect) -> dialects.Dialect:
        """Look for a table below a preamble that is longer than the first lines."""
        read = sum(map(len, sample))
        top = len(sample)
        while self._nul is None and read <= _SAMPLE_CHARACTERS:
            more = self._sample(_SAMPLE_LINES)
            if not more:
                break
            sample += more
            read += sum(map(len, more))
            if not _may_be_a_row(more[-1]):
                top = len(sample)
                continue
            # Lines before these are no rows, but may hold the header.
            other = dialects.detect(sample, max(0, top - _ABOVE), self._options.thousands)
            if _width(other) > max(1, _width(found)):
                return other
            top = len(sample)
        return found

    def _told(self) -> Iterator[Assumption]:
        """Say what the stages of bytes and dialect found."""
        found, encoding = self._dialect, self._lines.encoding
        if encoding == "latin-1":
            yield Assumption("bytes", "not UTF-8: read as Latin-1", "said")
        else:
            yield Assumption("bytes", encoding.upper())
        top = found.first if found.header is None else found.header
        if top:
            lines = "line 1 is" if top == 1 else f"lines 1 to {top} are"
            yield Assumption("dialect", f"{lines} a preamble, and not rows of the table")
        cells = f"cells are parted by {dialects.DELIMITERS[found.delimiter]}"
        if len(found.names) > 1:
            yield Assumption("dialect", cells)
        mark = {"": "none in the first rows", ".": "a point", ",": "a comma"}[found.decimal]
        yield Assumption("dialect", f"decimal mark: {mark}")
        header = f"names from line {top + 1}" if found.header is not None else "no names"
        yield Assumption("dialect", header)
        if found.units:
            units = ", ".join(f"{found.names[i]} {unit}" for i, unit in found.units.items())
            yield Assumption("dialect", f"units beside the names: {units}")

    def load(
        self, indices: Sequence[int], rows: int | None, time: int | None, wrong: Wrong
    ) -> list[Samples]:
        """Read columns of numbers."""
        if self._dialect.in_rows:
            return self._load_across(indices, rows, time, wrong)
        columns = [array("d") for _ in indices]
        previous, count = -math.inf, 0
        convert, walk = self._converters(indices), self._rows()
        # What is behind the rows that are asked for may be anything.
        while count != rows:
            previous = self._take_plain(indices, rows, time, wrong, columns, previous)
            count = len(columns[0])
            cells = next(walk, None) if count != rows else None
            if cells is None:
                break
            if count >= MAX_ROWS:
                raise ReadError(f"{self.source}: expected at most {MAX_ROWS} rows")
            count += 1
            if not self._decimal and self._decides(cells):
                convert = self._converters(indices)
            for place, index in enumerate(indices):
                value = convert[place](cells[index])
                if value is None:
                    value, why = math.nan, why_no_number(cells[index], self._decimal or ".")
                    why += self._way_to_the_next_table(cells)
                    wrong(index, count - 1, f"line {self._number}", why)
                elif index == time:
                    if value <= previous:
                        what = later(value, previous)
                        wrong(index, count - 1, f"line {self._number}", what)
                    previous = value
                columns[place].append(value)
        if not count:
            raise ReadError(f"{self.source}: no rows after the header")
        self._tell_comments()
        self._tell_dates()
        # Without a copy: columns may be as large as the memory.
        return [np.frombuffer(column, dtype=np.float64) for column in columns]

    def _take_plain(
        self,
        indices: Sequence[int],
        rows: int | None,
        time: int | None,
        wrong: Wrong,
        columns: Sequence[array[float]],
        previous: float,
    ) -> float:
        """Take the rows of plain numbers that come next, all at once; return the last time.

        It ends at the first row that is not plain, which goes its way by itself.
        """
        found = self._dialect
        if self._options.thousands:
            # Every cell is looked at.
            return previous
        special = {*found.stamped, *([0] if found.steps is not None else [])}
        while not self._before and self._number >= self._not_plain and not special & set(indices):
            text = self._lines.block(self._block)
            if not text:
                return previous
            size, count, taken = plain_rows(
                *(text, found.delimiter, found.decimal, len(self.names), found.full),
                list(indices),
            )
            before = len(columns[0])
            if rows is not None and count > rows - before:
                count = rows - before
                taken = [column[:count] for column in taken]
            if count + before > MAX_ROWS:
                raise ReadError(f"{self.source}: expected at most {MAX_ROWS} rows")
            self._lines.skip(size, count)
            first = self._number + 1
            self._number += count
            self._whole_rows += count
            for column, values in zip(columns, taken, strict=True):
                column.frombytes(values.view(np.uint8).data)
            if time is not None and count:
                times = taken[indices.index(time)]
                late = 1 + np.flatnonzero(~(times[1:] > times[:-1]))
                for row in late if times[0] > previous else [0, *late]:
                    what = later(times[row], times[row - 1] if row else previous)
                    wrong(time, before + int(row), f"line {first + int(row)}", what)
                previous = float(times[-1])
            if count < _WORTH_A_BLOCK:
                self._not_plain = self._number + _WORTH_A_BLOCK
            if size < len(text):
                # Where rows are often not plain, little is read twice.
                self._block = max(_SMALLEST, min(self._block, 2 * size))
                break
            self._block = min(2 * self._block, _LARGEST)
        return previous

    def _way_to_the_next_table(self, cells: Sequence[str]) -> str:
        """Say how to begin at a row that may be the header of another table; else nothing."""
        words = [cells[index] for index in self.numeric]
        if len(words) < 2 or any(not word or is_like_a_number(word) for word in words):
            return ""
        return f"; another table may begin here: --skip-lines {self._number - 1}"

    # Cells and rows.

    @property
    def _decimal(self) -> str:
        return self._dialect.decimal

    def _converters(self, indices: Sequence[int]) -> list[Callable[[str], float | None]]:
        number_of = partial(_value, decimal=self._decimal or ".")
        made: list[Callable[[str], float | None]] = []
        for index in indices:
            if index in self._dialect.stamped:
                if index not in self._clocks:
                    rows = [self._cells(line) for line in self._first_lines if line.strip()]
                    self._clocks[index] = Clock(row[index] for row in rows if index < len(row))
                made.append(self._clocks[index].seconds)
            elif index == 0 and self._dialect.steps is not None:
                made.append(partial(_scaled, number_of=number_of, steps=self._dialect.steps))
            else:
                made.append(number_of)
        return made

    def _decides(self, cells: Sequence[str]) -> bool:
        """Whether a row has the first decimal mark of the file; the rows behind help to tell it."""
        index = next((i for i in self._dialect.numeric if set(",.") & set(cells[i])), None)
        if index is None:
            return False
        delimiter = self._dialect.delimiter
        self._before.extend(self._sample_behind())
        lines = {number: line for number, line in enumerate(self._first_lines) if line.strip()}
        lines |= {self._number + number: line for number, line in enumerate(self._before)}
        rows = {number: self._cells(line) for number, line in lines.items()}
        rows = {number: row for number, row in rows.items() if len(row) == len(cells)}
        rows[self._number - 1] = list(cells)
        layout = dialects.Layout(rows, delimiter, thousands=self._options.thousands)
        if refused := layout.why_refused():
            raise ReadError(f"{self.source}, {refused}")
        decimal = layout.decimal
        self._dialect = replace(self._dialect, decimal=decimal or ".")
        self.assumed += layout.marks.told()
        mark = "comma" if decimal == "," else "point"
        said = f"decimal mark: a {mark}, as in line {self._number}, the first with one"
        self.assumed.append(Assumption("dialect", said))
        if decimal == ",":
            self.format = self.format.replace(", no header", "") + ", decimal comma"
        return True

    def _cells(self, line: str) -> list[str]:
        cells = split(line, self._dialect.delimiter)
        if not self._options.thousands:
            return cells
        return [unparted(cell, self._options.thousands) for cell in cells]

    def _sample_behind(self) -> list[str]:
        return [] if len(self._before) >= _SAMPLE_LINES else self._sample(_SAMPLE_LINES)

    def _next_line(self) -> str | None:
        if self._before:
            return self._before.popleft()
        try:
            return next(self._lines, None)
        except NulError as error:
            raise ReadError(str(error), self._whole_rows) from error

    def _rows(self) -> Iterator[list[str]]:
        """Yield the rows; each has the cells of the header, and beyond them empty ones only."""
        width, delimiter = len(self.names), self._dialect.delimiter
        last: deque[list[str]] = deque(maxlen=_LAST_ROWS)
        while (line := self._next_line()) is not None:
            self._number += 1
            if not line.strip():
                continue
            if is_comment(line, delimiter):
                self._comments.append((self._number, line))
                continue
            cells = self._cells(line)
            self._check_width(line, cells, width)
            if self._comments:
                self._note_comments()
            if '"' in line and not quotes_are_closed(line, delimiter):
                self._open_quotes.append(self._number)
            yield cells
            self._whole_rows += 1
            last.append(cells)
        self._note_comments()
        if self._nul is not None and not self._before:
            raise ReadError(str(self._nul), self._whole_rows)
        self._check_end(last)

    def _check_width(self, line: str, cells: Sequence[str], width: int) -> None:
        got, full, numeric = len(cells), self._dialect.full, self.numeric
        short = got < width or (got != full and not cells[width - 1])
        # A row of another length may have a number where others have a text or nothing.
        moved = got != full and any(
            is_number(cell, ".") for index, cell in enumerate(cells[:width]) if index not in numeric
        )
        if not short and not moved and not any(cells[width:]):
            return
        header = self._dialect.header
        where = (
            "as in the rows before" if header is None else f"as in the header, line {header + 1}"
        )
        why = ""
        if not quotes_are_closed(line, self._dialect.delimiter):
            why = ": a quotation mark is not closed"
        elif self._dialect.delimiter == "," and got > width and self._decimal != ".":
            bare = [cell for cell in cells if cell]
            if all(is_number(cell, ".") and "." not in cell for cell in bare):
                twice = "twice as many cells as names, " if got == 2 * width else ""
                why = f": {twice}decimal commas between commas? separate the cells by semicolons"
        elif got > width:
            why = self._way_to_the_next_table(cells)
        message = f"expected {width} cells {where}, got {got}{why}"
        raise ReadError(f"{self.source}, line {self._number}: {message}", self._whole_rows)

    # What is told of single rows.

    def _is_row(self, comment: str) -> bool:
        """Whether a row stands behind the mark of a comment."""
        cells = self._cells(comment.strip().lstrip("#%/;").strip())
        numbers = sum(is_number(cell, self._decimal or ".") for cell in cells)
        return len(cells) >= len(self.names) and 0 < numbers == len(self._dialect.numeric)

    def _note_comments(self) -> None:
        """Keep what stands behind the mark of a comment between two rows."""
        for place, line in self._comments:
            is_row = self._is_row(line)
            if self._whole_rows and (factor_in(line) or units_told(line)):
                self._changes.append((place, line.strip()))
            words = "" if self._dialect.header is not None else line.strip().lstrip("#%/;").strip()
            if any(Quantity(one).suffix or Quantity(one).unused for one in words.split()):
                self._late_header = self._late_header or place
            # A header may stand behind such a mark above the rows.
            if is_row or self._whole_rows:
                self._left_out.append((place, is_row))
        self._comments.clear()

    def _tell_dates(self) -> None:
        """Say which dates may be read in two ways: it matters where there are several."""
        for index, clock in self._clocks.items():
            if clock.doubtful:
                day, several = next(iter(clock.doubtful)), len(clock.doubtful) > 1
                order = "the month" if "/" in day else "the day"
                said = f"dates as {day}: {order} is taken to come first; --time none --rate HZ"
                self.assumed.append(
                    Assumption("table", said, "doubtful" if several else "said", index)
                )

    def _tell_comments(self) -> None:
        left_out = self._left_out
        rows = [place for place, is_row in left_out if is_row]
        if left_out:
            count = "1 comment" if len(left_out) == 1 else f"{len(left_out)} comments"
            said = f"{count} between the rows, the first in line {left_out[0][0]}"
            self.assumed.append(Assumption("table", said))
        if rows:
            said = f"line {rows[0]} is a row behind the mark of a comment, and is left out"
            more = f"; so are {len(rows) - 1} more" if len(rows) > 1 else ""
            self.assumed.append(Assumption("table", said + more, "doubtful"))
        if self._changes:
            place, line = self._changes[0]
            more = f", and {len(self._changes) - 1} more like it" if self._changes[1:] else ""
            said = f"line {place}, between the rows: {line[:_SHOWN]!r}{more}"
            said += "; nothing is taken from it, and the numbers behind it may be of another size"
            self.assumed.append(Assumption("table", said, "doubtful"))
        if self._late_header:
            said = (
                f"line {self._late_header} looks like a header behind the first rows: no name and "
                "no unit is taken from it; move it above them"
            )
            self.assumed.append(Assumption("table", said, "doubtful"))
        if self._open_quotes:
            said = f"line {self._open_quotes[0]}: a quotation mark is not closed: taken as a text"
            more = f"; so are {len(self._open_quotes) - 1} more" if self._open_quotes[1:] else ""
            self.assumed.append(Assumption("table", said + more, "assumed"))

    def _check_end(self, last: Sequence[Sequence[str]]) -> None:
        """Say if the last number may be cut: its line has no end, and it is shorter than others."""
        if not self._lines.last_is_open or len(last) < 3:
            return
        *before, row = last
        index = max((i for i, cell in enumerate(row) if cell), default=0)
        if index in self._dialect.stamped or not is_number(row[index], self._decimal or "."):
            return
        near = before[-_NEAR_ROWS:]
        lengths = sorted(_decimals(one[index], self._decimal) for one in near if one[index])
        shorter = lengths and _decimals(row[index], self._decimal) < lengths[len(lengths) // 2]
        numbers = [_value(one[index], self._decimal or ".") for one in last]
        steps = [abs(b - a) for a, b in pairwise(numbers) if a is not None and b is not None]
        leaps = len(steps) > 2 and steps[-1] > 1.5 * max(steps[:-1])
        # Equal steps, and then another one: digits may be gone that others have not either.
        usual = steps[-_NEAR_ROWS:-1]
        uneven = len(usual) > 2 and max(usual) - min(usual) <= 1e-6 * max(usual)
        uneven = uneven and abs(steps[-1] - usual[-1]) > 1e-6 * usual[-1]
        if shorter or leaps or uneven or len(row) != len(before[-1]):
            said = (
                f"line {self._number} has no end and its last number is hardly whole: it may be "
                f"cut; --rows {self._whole_rows - 1} leaves it out"
            )
            self.assumed.append(Assumption("table", said, "doubtful"))

    # Channels in rows.

    def _load_across(
        self, indices: Sequence[int], rows: int | None, time: int | None, wrong: Wrong
    ) -> list[Samples]:
        """Read rows that are channels; the cells of each are its samples."""
        delimiter, found = self._dialect.delimiter, []
        while (line := self._next_line()) is not None:
            if line.strip() and not is_comment(line, delimiter):
                found.append(self._cells(line)[self._dialect.begins :])
        lengths = {len([cell for cell in cells if cell]) for cells in found}
        if len(lengths) > 1 or len(found) != len(self.names):
            raise ReadError(f"{self.source}: expected channels of one length in the rows")
        columns = []
        for index in indices:
            values: list[float] = []
            for sample, cell in enumerate(found[index][:rows]):
                if not cell:
                    continue
                value = _value(cell, self._decimal or ".")
                if value is None:
                    why = why_no_number(cell, self._decimal or ".")
                    wrong(index, sample, f"row {index}, cell {sample}", why)
                elif index == time and values and value <= values[-1]:
                    wrong(index, sample, f"row {index}, cell {sample}", later(value, values[-1]))
                values.append(math.nan if value is None else value)
            columns.append(np.array(values))
        return columns


def _decimals(cell: str, decimal: str) -> int:
    mantissa = cell.lower().partition("e")[0]
    return len(mantissa.partition(decimal or ".")[2]) + 100 * ("e" in cell.lower())


def _stamp_in(lines: Sequence[str]) -> str:
    """Return the first time of the day in lines, with its date if it has one."""
    found = (_STAMP.search(line) for line in lines)
    return next((one[0].strip() for one in found if one is not None), "")


# A time of the day, with or without a date: what `cells.Clock` can read is told by it alone.
_STAMP = re.compile(
    r"(\b\d{1,4}[-/.](\d{1,2}|[A-Za-z]{3})[-/.]\d{1,4}[T\s,;]+)?\b\d{1,2}:\d{2}:\d{2}([.,]\d+)?"
    r"(\s*[AaPp][Mm])?"
)


def _may_be_a_row(line: str) -> bool:
    """Whether a line has several numbers, whatever parts them."""
    parted = (split(line, delimiter) for delimiter in dialects.DELIMITERS)
    return any(sum(map(is_like_a_number, cells)) > 1 for cells in parted)


def _width(dialect: dialects.Dialect) -> int:
    """Return how many columns of numbers and stamps there are."""
    return len(dialect.numeric) + len(dialect.stamped)


def _why(dialect: dialects.Dialect, rows: Sequence[Sequence[str]], index: int) -> str:
    """Return what is expected in place of the first cell that could be a number, if one could."""
    cells = [row[index] for row in rows if index < len(row)]
    reasons = (why_no_number(cell, dialect.decimal or ".") for cell in cells)
    return next((f": {reason}" for reason in reasons if "(expected" in reason), "")


def _value(cell: str, decimal: str) -> float | None:
    """Return the number in a cell, or None if it holds no admissible one."""
    value = number(cell, decimal)
    return value if value is not None and -MAX_MAGNITUDE <= value <= MAX_MAGNITUDE else None


def _scaled(
    cell: str, number_of: Callable[[str], float | None], steps: tuple[float, float]
) -> float | None:
    """Return the time of a sample that is counted."""
    value = number_of(cell)
    return None if value is None else steps[0] + steps[1] * value
