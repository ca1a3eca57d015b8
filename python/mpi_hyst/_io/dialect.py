"""How a text holds its table: what separates cells, the decimal mark, header, units and preamble.

The data decide. What separates cells is what makes most of the first lines rows of the same number
of cells, most of them numbers. The header is the last row of that many cells above the numbers that
is none itself. What is above the header is a preamble, as instruments write it.
"""

from __future__ import annotations

import csv
import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

from mpi_hyst._quantity import is_like_a_unit, known_unit

DELIMITERS = {
    "\t": "tabs",
    ";": "semicolons",
    ",": "commas",
    "|": "vertical bars",
    " ": "white space",
}
_COMMENTS = ("#", "%", "//")
_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2}(,\d{3})+")
_MISSING = {"", "-", "--", "na", "n/a", "null", "none", "missing", "?"}
# Signs that texts are set with in place of -.
_MINUS = dict.fromkeys(map(ord, "\u2212\u2010\u2011\u2012\u2013\u2014\ufe63\uff0d"), "-")
# A number in any notation, also one that is refused later: that must not hide the separators.
_LIKE = re.compile(
    r"[+-]?(\d([\d.,'’\u00a0\u202f]*[\d.])?|[.,]\d+)([eEdD][+-]?\d+)?|[+-]?(nan|inf)"
)
# An exponent of double precision as Fortran writes it: 1.5D-03.
_FORTRAN = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+))[dD]([+-]?\d+)")
_UNIT_WORDS = {"", "-", "--", "raw", "bit", "k"}


@dataclass(frozen=True)
class Dialect:
    """What the first lines tell about the table. Lines are counted from 0."""

    delimiter: str = ","
    decimal: str = "."
    names: Sequence[str] = ()
    units: Sequence[str] = ()
    numeric: Sequence[int] = field(default=())
    header: int | None = None
    first: int = 0
    """The line of the first row, or the one behind the last if there is none."""

    @property
    def text(self) -> str:
        """A description for a person."""
        comma = ", decimal comma" if self.decimal == "," else ""
        header = "" if self.header is not None else ", no header"
        cells = (
            f"separated by {DELIMITERS[self.delimiter]}" if len(self.names) > 1 else "one column"
        )
        return f"{cells}{comma}{header}"

    def cells(self, line: str) -> list[str]:
        """Split one line."""
        return split(line, self.delimiter)


def split(line: str, delimiter: str) -> list[str]:
    """Split one line into cells; quotes hold a cell together."""
    try:
        row = next(reader([prepared(line, delimiter)], delimiter), [])
    except csv.Error:
        return [line]
    return [cell.strip() for cell in row]


def prepared(line: str, delimiter: str) -> str:
    """Return a line as `csv` splits it: runs of white space are one separator there."""
    return line.strip().replace("\t", " ") if delimiter == " " else line


def reader(lines: Iterable[str], delimiter: str) -> Iterator[list[str]]:
    """Split prepared lines into cells."""
    return csv.reader(lines, delimiter=delimiter, skipinitialspace=delimiter == " ")


def is_comment(line: str, delimiter: str) -> bool:
    """Whether a line is a comment; a semicolon begins one where it separates no cells."""
    marks = _COMMENTS if delimiter == ";" else (*_COMMENTS, ";")
    return line.lstrip().startswith(marks)


def number(cell: str, decimal: str) -> float | None:
    """Return the number in a cell with this decimal mark, or None if it holds none."""
    if decimal == ",":
        if "." in cell:
            return None
        cell = cell.replace(",", ".")
    # float() also accepts 1_000, which is an error in a data file.
    if "_" in cell:
        return None
    # Some separators are space for strip() and none for float().
    cell = cell.strip()
    try:
        return float(cell)
    except ValueError:
        return float(_FORTRAN.sub(r"\1e\2", cell)) if _FORTRAN.fullmatch(cell) else None


def is_number(cell: str, decimal: str) -> bool:
    """Whether a cell is a number with this decimal mark."""
    return number(cell, decimal) is not None


def detect(lines: Sequence[str]) -> Dialect:
    """Return the dialect of a text by its first lines."""
    guesses = [_Guess(lines, delimiter) for delimiter in DELIMITERS]
    best = max(guesses, key=lambda guess: guess.score)
    return best.dialect() if best.score[1] else _without_numbers(lines)


def _without_numbers(lines: Sequence[str]) -> Dialect:
    """Return the dialect of a text without numbers: its first row is the header."""
    for number, line in enumerate(lines):
        if line.strip() and not is_comment(line, ","):
            # Spreadsheets separate by semicolons where the comma is the decimal mark.
            delimiter = next((mark for mark in ",;\t" if mark in line), ",")
            names = _trimmed(split(line, delimiter))
            return Dialect(delimiter, ".", names, (), (), number, number + 1)
    return Dialect(first=len(lines))


class _Guess:
    """The first lines, split by one delimiter."""

    def __init__(self, lines: Sequence[str], delimiter: str) -> None:
        self.lines = lines
        self.delimiter = delimiter
        self.rows = {
            number: split(line, delimiter)
            for number, line in enumerate(lines)
            if line.strip() and not is_comment(line, delimiter)
        }
        likes = {number: self._likes(cells) for number, cells in self.rows.items()}
        most = max(likes.values(), default=0)
        # A preamble has numbers too, but fewer in a row than the table.
        data = [self.rows[number] for number, count in likes.items() if count and 2 * count >= most]
        self.width = _width(data)
        self.data = [cells for cells in data if self.fits(cells)]
        self.decimal = self._decimal()
        self.numeric = self._numeric()
        count = sum(likes[number] for number, cells in self.rows.items() if self.fits(cells))
        share = count / max(1, sum(map(len, self.data)))
        self.header = self._header() if self.numeric else None
        self.score = (self.header is not None or self._starts_with_numbers(), count, share)

    def _likes(self, cells: Sequence[str]) -> int:
        """Return how many cells look like numbers; alone in its line, a cell must be one."""
        if len(cells) == 1:
            return int(is_number(cells[0], "."))
        return sum(_LIKE.fullmatch(cell.lower()) is not None for cell in cells)

    def fits(self, cells: Sequence[str]) -> bool:
        """Whether a row has the columns of the table, and beyond them empty cells only."""
        return len(cells) >= self.width > 0 and not any(cells[self.width :])

    def _decimal(self) -> str:
        if self.delimiter == "," or self.width < 2:
            return "."
        found = {
            mark: sum(is_number(cell, mark) for cells in self.data for cell in cells)
            for mark in ".,"
        }
        return "," if found[","] > found["."] and not self._has_thousands() else "."

    def _has_thousands(self) -> bool:
        """Whether commas part thousands: below one, numbers of the same column have none."""
        columns = [[row[index] for row in self.data if row[index]] for index in range(self.width)]
        parted = [cells for cells in columns if any("," in cell for cell in cells)]
        return all(map(_are_thousands, parted))

    def _numeric(self) -> list[int]:
        """Return the columns that hold a number in at least half of the rows."""
        return [
            index
            for index in range(self.width)
            if 2 * sum(is_number(cells[index], self.decimal) for cells in self.data)
            >= max(1, len(self.data))
        ]

    def _numbers(self, cells: Sequence[str]) -> int:
        """Return how many of the numeric columns hold a number in a row."""
        return sum(is_number(cells[index], self.decimal) for index in self.numeric)

    def _starts_with_numbers(self) -> bool:
        first = next(iter(self.rows.values()), [])
        return self.fits(first) and self._numbers(first) > 0

    def _first_whole_row(self) -> int:
        """Return the line of the first row with a number in every numeric column."""
        rows = [number for number, cells in self.rows.items() if self.fits(cells)]
        counts = {number: self._numbers(self.rows[number]) for number in rows}
        most = max(counts.values(), default=0)
        return next(number for number in rows if counts[number] == most)

    def _names(self, cells: Sequence[str]) -> bool:
        """Whether a row may be a header: of the width of the table, filled, and no numbers."""
        if not self.fits(cells) or any(is_number(cells[index], ".") for index in self.numeric):
            return False
        filled = [cell for cell in cells[: self.width] if cell.lower() not in _MISSING]
        return bool(filled) and 2 * len(filled) >= self.width

    def _header(self) -> tuple[int, int | None] | None:
        """Return the lines of the header and of the units, if there are such."""
        first = self._first_whole_row()
        above = [number for number in self.rows if number < first]
        last = next((n for n in reversed(above) if self._names(self.rows[n])), None)
        if last is None:
            return None
        block = above[: above.index(last) + 1]
        while len(block) > 1 and all(self._names(self.rows[n]) for n in block[-2:]):
            if are_units(self.rows[block[-1]][: self.width]):
                return block[-2], block[-1]
            block.pop()
        return last, None

    def dialect(self) -> Dialect:
        """Return what was found."""
        names, units, header, first = self._top()
        return Dialect(
            self.delimiter,
            self.decimal,
            [name or str(index) for index, name in enumerate(names)],
            units,
            [index for index in self.numeric if index < len(names)],
            header,
            first,
        )

    def _top(self) -> tuple[Sequence[str], Sequence[str], int | None, int]:
        """Return names, units, the line of the header and that of the first row."""
        whole = self._first_whole_row()
        if self.header is not None:
            line, units = self.header
            names = self.rows[line][: self.width]
            below = [n for n in self.rows if n > line and not self._names(self.rows[n])]
            first = min([whole, *below])
            return names, () if units is None else self.rows[units][: self.width], line, first
        first = self._first_number(whole)
        named = self._commented(first) or self._spaced(first) or self._of_other_width(first)
        if named is not None:
            return named[1], (), named[0], first
        return [str(index) for index in range(self.width)], (), None, first

    def _first_number(self, whole: int) -> int:
        """Return the line of the first row of a table without a header: numbers only, or fitting.

        A row of numbers that has another width belongs to the table, and is refused in reading.
        """
        first = whole
        for number in [n for n in reversed(self.rows) if n < whole]:
            cells = [cell for cell in self.rows[number] if cell]
            fits = self.fits(self.rows[number]) and self._numbers(self.rows[number]) > 0
            if not fits and not all(is_number(cell, self.decimal) for cell in cells):
                break
            first = number
        return first

    def _commented(self, first: int) -> tuple[int, list[str]] | None:
        """Return the header in the last comment above the table, as numpy.savetxt writes it."""
        comments = [n for n in range(first) if is_comment(self.lines[n], self.delimiter)]
        if not comments or any(n > comments[-1] for n in self.rows if n < first):
            return None
        text = self.lines[comments[-1]].strip().lstrip("#%/;").strip()
        for names in (split(text, self.delimiter), _wide_gaps(text)):
            if self._names(names):
                return comments[-1], names[: self.width]
        return None

    def _spaced(self, first: int) -> tuple[int, list[str]] | None:
        """Return a header whose names contain single spaces, above columns of white space."""
        above = [number for number in self.rows if number < first]
        if self.delimiter != " " or not above:
            return None
        names = _wide_gaps(self.lines[above[-1]])
        return (above[-1], names[: self.width]) if self._names(names) else None

    def _of_other_width(self, first: int) -> tuple[int, list[str]] | None:
        """Return what must be meant as a header but has another width: every row is refused then.

        Other lines of another width are a preamble.
        """
        above = [number for number in self.rows if number < first]
        if len(above) != 1 or self.delimiter == " ":
            return None
        cells = _trimmed(self.rows[above[0]])
        words = len(cells) > 1 or not re.search(r"[\s:=]", cells[0])
        return (above[0], cells) if words else None


def _are_thousands(cells: Sequence[str]) -> bool:
    others = [cell for cell in cells if not _THOUSANDS.fullmatch(cell)]
    if any("," in cell for cell in others):
        return False
    values = [number(cell, ".") for cell in others]
    below = [abs(value) for value in values if value is not None and math.isfinite(value)]
    return bool(below) and max(below) < 1000.0


def are_units(cells: Sequence[str]) -> bool:
    """Whether a row below the header holds units: s, V, [µm]."""
    known = [known_unit(cell) != "" for cell in cells]
    other = [
        cell.lower() in _UNIT_WORDS
        or is_like_a_unit(cell)
        or (cell[0] in "[(" and cell[-1] in "])")
        for cell, is_known in zip(cells, known, strict=True)
        if not is_known
    ]
    return any(known) and all(other)


def _wide_gaps(text: str) -> list[str]:
    return re.split(r"\s{2,}|\t", text.strip())


def _trimmed(cells: Sequence[str]) -> list[str]:
    count = max((index + 1 for index, cell in enumerate(cells) if cell), default=0)
    return list(cells[:count])


def _width(data: Sequence[Sequence[str]]) -> int:
    """Return the width that most rows have, without columns that are empty in all of them."""
    if not data:
        return 0
    common, _ = Counter(map(len, data)).most_common(1)[0]
    return max(len(_trimmed(cells)) for cells in data if len(cells) == common)


def why_no_number(cell: str, decimal: str) -> str:
    """Return why a cell is refused: the message that follows its place."""
    text = cell.strip()
    if not text:
        return "empty cell"
    shown = text[:40]
    if (value := number(text, decimal)) is not None:
        return f"larger than 1e+100: {shown}" if math.isfinite(value) else f"not finite: {shown}"
    if is_number(text.translate(_MINUS), decimal):
        return f"not a number: {shown!r} (expected the sign - below zero)"
    point = "point" if decimal == "." else "comma"
    bare = re.sub(r"[\s'’,.](?=\d{3}(\D|$))", "", text)
    if decimal == "." and _THOUSANDS.fullmatch(text):
        return f"not a number: {shown!r} (expected a decimal point, no separators of thousands)"
    if is_number(text.replace(",", "."), ".") or is_number(text.replace(".", ","), ","):
        return f"not a number: {shown!r} (expected a decimal {point})"
    if is_number(bare, ".") or is_number(bare, ","):
        return f"not a number: {shown!r} (expected no separators of thousands)"
    return f"not a number: {shown!r}"
