"""The stage of the dialect: how a text holds its table.

The data decide. What separates cells is what makes most of the first lines rows of the same number
of cells, most of them numbers. The header is the last row above the numbers that fits their width
and is none itself. What is above the header is a preamble, as instruments write it. What looks
like a header and does not fit is told, and never used in part.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import zip_longest

from mpi_hyst._io.cells import (
    MISSING,
    is_comment,
    is_like_a_number,
    is_number,
    is_stamp,
    number,
    split,
)
from mpi_hyst._io.first_row import COUNT, goes_on
from mpi_hyst._io.layout_doubts import OF_REMARKS, OF_RIGOL, Laid, doubts_of
from mpi_hyst._io.marks import Marks, marks_of, unparted, why_pairs
from mpi_hyst._io.names import (
    are_names,
    are_units,
    is_prose,
    names_in,
    trimmed,
    unnamed,
    without_numbers,
)
from mpi_hyst._io.preamble import Preamble, is_used_setting, settings_beside
from mpi_hyst._io.record import Assumption
from mpi_hyst._quantity import Quantity, known_unit
from mpi_hyst._text import digits

DELIMITERS = {
    "\t": "tabs",
    ";": "semicolons",
    ",": "commas",
    "|": "vertical bars",
    " ": "white space",
}
_FIRST_ROWS = 20  # rows that tell a column of stamps
_MOST_STAMPS = 0.9  # of them; one may be that of a line above the table
_START_OR_STEP = re.compile(r"(?P<start>start|t0)|increment|t_?inc", re.IGNORECASE)
# A text of more columns than rows has its channels in rows.
_WIDE, _CHANNELS = 4, 32


@dataclass(frozen=True)
class Dialect:
    """What the first lines tell about the table. Lines are counted from 0."""

    delimiter: str = ","
    decimal: str = "."
    """The decimal mark; empty where the first lines have none."""
    names: Sequence[str] = ()
    units: Mapping[int, str] = field(default_factory=dict)
    numeric: Sequence[int] = ()
    stamped: Sequence[int] = ()
    header: int | None = None
    first: int = 0
    """The line of the first row, or the one behind the last if there is none."""
    full: int = 0
    """How many cells most rows have, with empty ones behind the table."""
    in_rows: bool = False
    """Whether each row is a channel."""
    begins: int = 0
    """Of rows that are channels, how many cells stand before their samples: name and unit."""
    steps: tuple[float, float] | None = None
    """Start and step of a first column that counts samples, in seconds."""
    refused: str = ""
    """Why the numbers cannot be read; empty if they can."""
    assumed: Sequence[Assumption] = ()

    @property
    def text(self) -> str:
        """A description for a person."""
        comma = ", decimal comma" if self.decimal == "," else ""
        header = "" if self.header is not None else ", no header"
        cells = (
            f"separated by {DELIMITERS[self.delimiter]}" if len(self.names) > 1 else "one column"
        )
        return f"{cells}{comma}{header}"


def detect(lines: Sequence[str], first: int = 0, thousands: str | None = None) -> Dialect:
    """Return the dialect of a text by its first lines, from one of them on.

    `thousands` is what a user says that parts thousands; empty if nothing does.
    """
    layouts = [
        Layout(
            {
                number: [unparted(cell, thousands) for cell in split(line, delimiter)]
                for number, line in enumerate(lines)
                if number >= first and line.strip() and not is_comment(line, delimiter)
            },
            delimiter,
            lines,
            thousands,
        )
        for delimiter in DELIMITERS
    ]
    tabs, *others, blanks = layouts
    # Names with spaces are no reason to part rows at blanks that tabs part as well.
    layouts = [tabs, *others] if tabs.width == blanks.width > 1 else layouts
    best = max(layouts, key=lambda layout: layout.score)
    return best.dialect() if best.score[0] else _without_numbers(lines, first)


def _without_numbers(lines: Sequence[str], first: int) -> Dialect:
    """Return the dialect of a text without numbers: its first row is the header."""
    for place, line in enumerate(lines):
        if place >= first and line.strip() and not is_comment(line, ","):
            # Spreadsheets separate by semicolons where the comma is the decimal mark.
            delimiter = next((mark for mark in ",;\t" if mark in line), ",")
            names = trimmed(split(line, delimiter))
            return Dialect(delimiter, ".", names, header=place, first=place + 1, full=len(names))
    return Dialect(first=len(lines))


class Layout:
    """Rows of cells, by one delimiter: what of them is the table, its header and its units.

    The cells of a workbook are laid out in the same way, without lines.
    """

    def __init__(
        self,
        rows: Mapping[int, Sequence[str]],
        delimiter: str = ",",
        lines: Sequence[str] = (),
        thousands: str | None = None,
    ) -> None:
        """Take the rows by the numbers of their lines."""
        self.lines = lines
        self.delimiter = delimiter
        self.rows = {place: list(cells) for place, cells in rows.items()}
        likes = {place: self._likes(cells) for place, cells in self.rows.items()}
        most = max(likes.values(), default=0)
        # A preamble has numbers too, but fewer in a row than the table.
        rows_ = {place: self.rows[place] for place, count in likes.items() if 2 * count >= most > 0}
        usual = Counter(likes[place] for place in rows_).most_common(1)
        begins = next((place for place in rows_ if likes[place] >= usual[0][0]), 0)
        # Units above the table may have numbers in columns beyond.
        self.full, self.width = _width([rows_[place] for place in rows_ if place >= begins])
        self.data = [cells for cells in rows_.values() if self.fits(cells)]
        self.marks = self._marks(thousands)
        self.decimal = self.marks.decimal
        self.numeric = self._numeric()
        self.stamped = self._stamped()
        self.said: list[Assumption] = []
        self.header = self._header() if self.numeric else None
        count = sum(likes[place] for place, cells in self.rows.items() if self.fits(cells))
        share = count / max(1, sum(map(len, self.data)))
        named = self.header is not None or self._starts_with_numbers()
        self.score = (count * (1.0 if named else 0.8), share)
        if delimiter == " " and self._is_parted_otherwise():
            self.score = (0.0, 0.0)

    def _is_parted_otherwise(self) -> bool:
        """Whether in most rows blanks stand beside a separator: then they part nothing."""
        alone = sum(any(cell in (";", ",", "|") for cell in row) for row in self.data)
        return 2 * alone > len(self.data)

    def _likes(self, cells: Sequence[str]) -> int:
        """Return how many cells look like numbers; alone in its line, a cell must be one."""
        if len(cells) == 1:
            return int(is_number(cells[0], ".") or is_stamp(cells[0]))
        # A date and a time of the day with a space between are no two cells.
        stamps = [cell for cell in cells if ":" in cell and is_stamp(cell)]
        if self.delimiter == " ":
            # Blanks beside other separators part nothing.
            cells = [cell for cell in cells if cell[:1] not in (",", ";", "|")]
        return sum(map(is_like_a_number, cells)) + sum(len(one.split()) + 1 for one in stamps)

    def fits(self, cells: Sequence[str]) -> bool:
        """Whether a row has the columns of the table, and beyond them empty cells only."""
        return len(cells) >= self.width > 0 and not any(cells[self.width :])

    def _marks(self, thousands: str | None) -> Marks:
        """Return the marks of numbers; between commas a decimal comma is one in quotation marks."""
        width = min([self.width, *map(len, self.data)])
        marks = marks_of([[row[index] for row in self.data] for index in range(width)], thousands)
        if self.width < 2 and self.delimiter != "," and marks.decimal == "," and not marks.said:
            return replace(marks, decimal=".")
        return marks

    def why_refused(self, found: Dialect | None = None) -> str:
        """Return why no number is read, with the line; empty if they can be."""
        if self.marks.refused:
            place = next(n for n, cells in self.rows.items() if self.marks.cell in cells)
            return f"line {place + 1}: {self.marks.refused}"
        if found is None or self.delimiter != "," or not self.data or self.header is not None:
            return ""
        rows = [row[: self.width] for row in self.data]
        why = why_pairs(rows, self._misfit, found.header is not None)
        return why and f"line {found.first + 1}: {why}"

    def _numeric(self) -> list[int]:
        """Return the columns that hold a number in at least half of the rows."""
        return [
            index
            for index in range(self.width)
            if 2 * sum(is_number(cells[index], self.decimal or ".") for cells in self.data)
            >= max(1, len(self.data))
        ]

    def _stamped(self) -> list[int]:
        """Return the columns of dates or times of the day."""
        first = self.data[:_FIRST_ROWS]
        most = max(1.0, _MOST_STAMPS * len(first))
        return [
            index
            for index in range(self.width)
            if index not in self.numeric and sum(is_stamp(row[index]) for row in first) >= most
        ]

    def _numbers(self, cells: Sequence[str]) -> int:
        """Return how many of the columns of numbers and stamps hold one in a row."""
        numbers = sum(
            index < len(cells) and is_number(cells[index], self.decimal or ".")
            for index in self.numeric
        )
        stamps = sum(index < len(cells) and is_stamp(cells[index]) for index in self.stamped)
        return numbers + stamps

    def _starts_with_numbers(self) -> bool:
        first = next(iter(self.rows.values()), [])
        return self.fits(first) and self._numbers(first) > 0

    def _first_whole_row(self) -> int:
        """Return the line of the first row with a number in every numeric column."""
        rows = [place for place, cells in self.rows.items() if self.fits(cells)]
        if self._keys_are_beside:
            rows = [place for place in rows if not self.rows[place][0]]
        counts = {place: self._numbers(self.rows[place]) for place in rows}
        most = max(counts.values(), default=0)
        return next(place for place in rows if counts[place] == most)

    @cached_property
    def _keys_are_beside(self) -> bool:
        """Whether the first column is empty in the rows, and above them says what others are."""
        return 10 * sum(row[0] == "" for row in self.data) > 9 * len(self.data)

    def _is_setting(self, place: int) -> bool:
        """Whether a row has a key where those of the table have nothing: `Offset,5,0.5`."""
        first = self.rows[place][0]
        # Settings may also stand beside rows, with their values in columns of their own.
        is_key = bool(first) and not is_like_a_number(first)
        return is_key and 1 in self.numeric and self._keys_are_beside

    # The header.

    def _header(self) -> tuple[int, list[str], int | None] | None:
        """Return the line of the header, its names, and the line of the units, if there are such.

        Names have the width of the table, or that of its rows with the empty cells behind.
        """
        first = self._first_whole_row()
        above = [place for place in self.rows if place < first]
        for place in reversed(above):
            names = self._names(place)
            if names is None:
                continue
            before = above[above.index(place) - 1] if above.index(place) else None
            upper = None if before is None else self._names(before, numbered=True)
            if upper is not None and self._are_remarks(place, above):
                continue
            if before is not None and upper is not None:
                if self._are_units(self.rows[place]):
                    return before, upper, place
                if self._are_units(upper):
                    # Units may stand above the names, too.
                    return place, names, before
                if are_units(names, one_is_known=False):
                    return before, upper, place
                self._say_two(before, place)
            behind = above[above.index(place) + 1 :][:1]
            if behind and self._are_units(self.rows[behind[0]]):
                return place, names, behind[0]
            # Columns that are called like their units have these units.
            return place, names, place if self._are_units(names) else None
        return self._numbered(first)

    def _say_two(self, upper: int, lower: int) -> None:
        """Say that two rows may be the header, if what is above is no setting."""
        cells = [cell for cell in self.rows[upper] if cell]
        if len(cells) < len(self.numeric) or len(set(cells)) < len(cells):
            return
        if is_used_setting(self.rows[upper], self.rows[lower]):
            return
        has_units = [
            any(Quantity(cell).suffix and not known_unit(cell) for cell in self.rows[n])
            for n in (upper, lower)
        ]
        if has_units == [False, True]:
            return
        if any(map(is_like_a_number, cells)):
            return
        said = f"lines {upper + 1} and {lower + 1} may both hold the names: line {lower + 1} does"
        self.said.append(
            Assumption("dialect", f"{said}; --skip-lines, or mend the other", "doubtful")
        )

    def _are_remarks(self, place: int, above: Sequence[int]) -> bool:
        """Whether the two rows above are names and units: then this one is a row of remarks."""
        at = above.index(place)
        if at < 2 or self._names(above[at - 2], numbered=True) is None:
            return False
        return self._are_units(self.rows[above[at - 1]])

    def _names(self, place: int, *, numbered: bool = False) -> list[str] | None:
        """Return the names that a row holds, if it may be a header: filled, and no numbers.

        With units below it, numbers may be names too, as of the channels of an oscilloscope.
        """
        cells = self.rows[place]
        names = trimmed(cells)
        if cells[0] and self._keys_are_beside and not OF_REMARKS.match(cells[0]):
            # What it says is about the other columns: `TraceName,CH1,CH2` above `,0.1,0.2`.
            return None
        if len(cells) == self.full and len(names) >= self.width:
            names = list(cells) if len(cells) == self.width else names
        elif len(names) > self.width:
            if not all(OF_RIGOL.fullmatch(name) for name in names[self.width :]):
                return None
            names = names[: self.width]
        names += [""] * (self.width - len(names)) if len(cells) >= self.width else []
        if len(names) < self.width:
            return None
        # A row of another length than those of the table, with a name too few, is shifted.
        if len(cells) != self.full and any(not names[index] for index in self.numeric):
            return None
        ints = [name.isdigit() for name in names]
        is_numbered = numbered and not all(ints)
        # Numbers in the other notation are those of a row that is refused.
        if not is_numbered and any(is_like_a_number(names[index]) for index in self.numeric):
            return None
        if any(is_stamp(names[index]) for index in self.stamped):
            return None
        if not are_names(names):
            return None
        filled = [name for name in names if name.lower() not in MISSING]
        return names if filled and 2 * len(filled) >= self.width else None

    def _are_units(self, cells: Sequence[str]) -> bool:
        return are_units((list(cells) + [""] * self.width)[: self.width])

    def _numbered(self, first: int) -> tuple[int, list[str], int | None] | None:
        """Return a first row of consecutive whole numbers that are names, as pandas writes them."""
        above = [place for place in self.rows if place < first]
        if above and self.fits(self.rows[above[-1]]) and not self.rows[above[-1]][0]:
            # Behind an empty cell, which stands above the numbers of the rows.
            first = above[-1]
        elif above and self._names(above[-1], numbered=True) is not None:
            return None
        row = self.rows[first]
        cells = row[: self.width]
        begins = 1 if cells and not cells[0] and not self._keys_are_beside else 0
        digits = cells[begins:]
        if not digits or not all(COUNT.fullmatch(cell) for cell in digits):
            return None
        counts = [int(float(cell)) for cell in digits]
        if counts not in (list(range(len(counts))), list(range(1, len(counts) + 1))):
            return None
        below = [cells for place, cells in self.rows.items() if place > first and self.fits(cells)]
        if not begins and (len(below) < 2 or goes_on(digits, below, self.decimal or ".")):
            return None
        what = ", ".join(cells)
        self.said.append(
            Assumption(
                "dialect", f"line {first + 1}, {what}: taken for names, not for a row", "assumed"
            )
        )
        return first, cells, None

    # What is handed on.

    def dialect(self) -> Dialect:
        """Return what was found."""
        names, units, header, first = self._top()
        steps = self._steps(names, units)
        found = Dialect(
            delimiter=self.delimiter,
            decimal=self.decimal,
            names=[name or unnamed(index, names) for index, name in enumerate(names)],
            units={
                index: unit for index, unit in enumerate(units[: len(names)])
                if unit and not (steps is not None and index == 0)
            },
            numeric=[index for index in self.numeric if index < len(names)],
            stamped=[index for index in self.stamped if index < len(names)],
            header=header,
            first=first,
            full=max(self.full, len(names)),
            steps=steps,
        )  # fmt: skip
        if steps is not None:
            found = replace(found, units={**found.units, 0: "s"})
            what = f"time: {steps[0]:g} s + {steps[1]:g} s x {found.names[0]}, which counts samples"
            self.said.append(Assumption("dialect", what, "assumed", 0))
        self.said += self.marks.told()
        self.said += doubts_of(self._laid(found))
        return self._with_preamble(self._in_rows(found), first, header)

    def _laid(self, found: Dialect) -> Laid:
        """Return the table that was found, with its rows among those that decided."""
        rows = {n: cells for n, cells in self.rows.items() if n >= found.first and self.fits(cells)}
        heading, place = "", found.header
        if self.delimiter == " " and place is not None and place < len(self.lines):
            heading = self._bare(place)
        return Laid(
            names=found.names,
            units=found.units,
            numeric=found.numeric,
            stamped=found.stamped,
            decimal=self.decimal or ".",
            header=found.header,
            above=() if self.header is None else self.header[1],
            heading=heading,
            first=found.first,
            first_row=self.rows.get(found.first, []),
            rows=rows,
            texts=[line.strip() for line in self.lines[found.first : found.first + _FIRST_ROWS]],
            data=self.data,
            width=self.width,
        )

    def _top(self) -> tuple[Sequence[str], Sequence[str], int | None, int]:
        """Return names, units, the line of the header and that of the first row."""
        whole = self._first_whole_row()
        if self.header is not None:
            place, names, units = self.header
            # Rows with cells that are missing belong to the table, and are refused in reading.
            last = place if units is None else max(place, units)
            below = [n for n in self.rows if n > last and self._names(n) is None]
            below = [n for n in below if not self._is_setting(n)]
            first = min([n for n in [whole, *below] if n > last], default=last + 1)
            return names, () if units is None else self.rows[units], place, first
        first = self._first_number(whole)
        named = self._commented(first) or self._other_text(first) or self._of_rows(first)
        if named is not None:
            told = () if self._commented_units is None else self._commented_units[1]
            return named[1], told, named[0], first
        self._say_misfit()
        return [str(index) for index in range(self.width)], (), None, first

    def _first_number(self, whole: int) -> int:
        """Return the line of the first row of a table without a header: numbers only, or fitting.

        A row of numbers that has another width belongs to the table, and is refused in reading. One
        number alone above a table of several columns is none.
        """
        first = whole
        for place in [n for n in reversed(self.rows) if n < whole]:
            cells = [cell for cell in self.rows[place] if cell]
            fits = self.fits(self.rows[place]) and self._numbers(self.rows[place]) > 0
            alone = len(self.rows[place]) == 1 < self.width
            numbers = sum(is_number(cell, self.decimal or ".") for cell in cells)
            # With as many numbers as columns it is a row, whatever else it has.
            is_row = numbers == len(cells) or numbers >= len(self.numeric) > 1
            if alone or self._is_setting(place) or not (fits or is_row):
                break
            first = place
        return first

    def _commented(self, first: int) -> tuple[int, list[str]] | None:
        """Return the header in a comment above the table, as numpy.savetxt writes it."""
        comments = [n for n in range(min(first, len(self.lines))) if self._is_comment(n)]
        if not comments or any(n > comments[-1] for n in self.rows if n < first):
            return None
        # Remarks may follow the names.
        lowest = max((n for n in self.rows if n < first), default=-1)
        for place in [n for n in reversed(comments) if n > lowest]:
            names = names_in(self._bare(place), self.delimiter, self.width, self.full)
            if names is None:
                continue
            upper = names_in(self._bare(place - 1), self.delimiter, self.width, self.full)
            if place - 1 in comments and upper is not None and are_units(names):
                self._commented_units = place, names
                return place - 1, upper
            return place, names
        text = self._bare(comments[-1])
        words = split(text, self.delimiter)
        count = len(words)
        if count > 1 and not is_prose(text) and not any(map(is_like_a_number, words)):
            self._misfit = comments[-1], count
        return None

    def _bare(self, place: int) -> str:
        """Return what stands behind the mark of a comment."""
        return self.lines[place].strip().lstrip("#%/;").strip()

    _commented_units: tuple[int, Sequence[str]] | None = None
    """The line of units below names, both of them comments."""
    _misfit: tuple[int, int] | None = None
    """A line that looks like a header and is none, and its names."""

    def _is_comment(self, place: int) -> bool:
        line = self.lines[place]
        return bool(line.strip()) and is_comment(line, self.delimiter)

    def _other_text(self, first: int) -> tuple[int, list[str]] | None:
        """Return a header whose names are parted otherwise than the numbers."""
        above = [place for place in self.rows if place < first]
        if not above or self._keys_are_beside:
            return None
        place = above[-1]
        text = self.lines[place].strip() if place < len(self.lines) else ""
        names = names_in(text, self.delimiter, self.width, self.full) if text else None
        if names is None:
            cells = trimmed(self.rows[place])
            of_numbers = sum(is_like_a_number(cell) for cell in cells)
            words = len(cells) > 1 or not re.search(r"[\s:=]", cells[0] if cells else ":")
            units = any(Quantity(cell).suffix or Quantity(cell).unused for cell in cells)
            units = units and not re.search(r"\d", text)
            is_header = units or (words and not is_prose(text))
            if cells and is_header and not of_numbers:
                self._misfit = place, len(cells)
        return None if names is None else (place, names)

    def _of_rows(self, first: int) -> tuple[int, list[str]] | None:
        """Return a header without a name for those of the rows, which stand in quotation marks."""
        above = [place for place in self.rows if place < first]
        if not above or first >= len(self.lines) or self.lines[first].lstrip()[:1] != '"':
            return None
        names = self.rows[above[-1]]
        if len(names) != self.width - 1 or without_numbers(names) is None:
            return None
        return above[-1], ["", *names]

    def _say_misfit(self) -> None:
        """Say what looks like a header and is none: nothing of it is used."""
        if self._misfit is None:
            return
        place, count = self._misfit
        called = "1 name" if count == 1 else f"{count} names"
        said = (
            f"line {place + 1} looks like a header of {called}, the rows have {self.width} cells: "
            "columns are numbered, and no name and no unit is taken from it; mend that line"
        )
        self.said.append(Assumption("dialect", said, "doubtful"))

    # What else the lines above tell.

    def _steps(self, names: Sequence[str], units: Sequence[str]) -> tuple[float, float] | None:
        """Return start and step of a column that counts samples, as one kind of scope writes."""
        told = self._start_and_step()
        if told is None:
            return None
        values = [number(cells[0], ".") for cells in self.data[:_FIRST_ROWS]]
        counts = 0 in self.numeric and all(value == k for k, value in enumerate(values))
        if (units[:1] and units[0].lower() == "sequence") or (counts and names[0] in ("X", "")):
            return told
        quantities = [
            Quantity(*pair) for pair in zip_longest(names, units[: len(names)], fillvalue="")
        ]
        if not self.stamped and not any(one.is_time or one.time_unit for one in quantities):
            said = f"the header tells steps of {digits(told[1])} s, and no column counts them: "
            self.said.append(Assumption("dialect", f"{said}--rate {1.0 / told[1]:g}", "assumed"))
        return None

    def _start_and_step(self) -> tuple[float, float] | None:
        """Return what a header says of start and step: beside its names, or in the row below."""
        if self.header is None:
            return None
        place, _, units = self.header
        cells = trimmed(self.rows[place])
        below = self.rows[units] if units is not None else []
        told: dict[str, float] = {}
        for name, cell in zip_longest(cells, below[: len(cells)], fillvalue=""):
            key, _, value = name.partition("=")
            found = _START_OR_STEP.fullmatch(key.strip())
            known = number(value or cell, ".") if found is not None else None
            if found is not None and known is not None:
                told["start" if found["start"] else "step"] = known
        start, step = told.get("start"), told.get("step")
        return None if start is None or step is None or step <= 0.0 else (start, step)

    def _with_preamble(self, found: Dialect, first: int, header: int | None) -> Dialect:
        """Take names and units that instruments write in rows of their own above the table."""
        top = first if header is None else header
        above = {place: cells for place, cells in self.rows.items() if place < top}
        told = Preamble(
            *(list(found.names), dict(found.units), self.numeric, self.full),
            has_header=header is not None,
            stamped=bool(self.stamped),
        )
        below = {place: cells for place, cells in self.rows.items() if place >= first}
        lines = {n: line for n, line in enumerate(self.lines[:first]) if line.strip()}
        comments = {n: line for n, line in lines.items() if n < top and self._is_comment(n)}
        told.read(above, comments)
        told.read_beside(dict(settings_beside(below)))
        told.say_alone(above, len(below))
        told.read_words({n: line for n, line in lines.items() if n not in self._named(header)})
        words = [n for n in range(self.width) if n not in {*self.numeric, *self.stamped}]
        cells = {n: [row[n] for row in self.data] for n in words if n < len(found.names)}
        told.say_columns(cells)
        said = (*self.said, *told.said)
        refused = self.why_refused(found)
        return replace(found, names=told.names, units=told.units, refused=refused, assumed=said)

    def _named(self, header: int | None) -> set[int]:
        """Return the lines of the names, and of the units that stand beside them."""
        units = None if self.header is None else self.header[2]
        misfit = None if self._misfit is None else self._misfit[0]
        below = None if self._commented_units is None else self._commented_units[0]
        return {place for place in (header, units, misfit, below) if place is not None}

    def _in_rows(self, found: Dialect) -> Dialect:
        """Take rows for channels where there are a few of many cells, and no header above."""
        rows = [cells for place, cells in self.rows.items() if place >= found.first]
        named = rows and all(cells and not is_number(cells[0], ".") for cells in rows)
        if found.header is not None and not (named and found.header == min(self.rows)):
            return found
        if not rows or len(rows) > _CHANNELS or self.width < max(10, _WIDE * len(rows)):
            return found
        if found.header is not None or len({len(trimmed(cells)) for cells in rows}) > 1:
            return found
        names = [cells[0] if named else str(index) for index, cells in enumerate(rows)]
        second = [cells[1] for cells in rows]
        numbers = any(is_number(cell, self.decimal or ".") for cell in second)
        has_units = bool(named) and not numbers and any(map(known_unit, second))
        units = {n: cell for n, cell in enumerate(second) if cell} if has_units else {}
        what = f"{len(rows)} rows of {self.width} cells: each row is taken for a channel"
        self.said.append(Assumption("dialect", what, "assumed" if named else "doubtful"))
        every = list(range(len(rows)))
        return replace(
            found, names=names, units=units, numeric=every, stamped=[], in_rows=True,
            begins=bool(named) + has_units,
        )  # fmt: skip


def _width(data: Sequence[Sequence[str]]) -> tuple[int, int]:
    """Return how many cells most rows have: all, and without columns that are empty in all."""
    if not data:
        return 0, 0
    common, _ = Counter(map(len, data)).most_common(1)[0]
    return common, max(len(trimmed(cells)) for cells in data if len(cells) == common)
