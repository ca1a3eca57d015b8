"""What one cell of a text holds: a number, a stamp of time, an error of a spreadsheet, or words."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterable
from datetime import date

from mpi_hyst._quantity import SECONDS, known_unit

_COMMENTS = ("#", "%", "//")
# Errors of spreadsheets in several languages begin with the mark of a comment, and are none.
_ERROR = re.compile(r"\s*\"?#(N/A|NA|N/V|NV|N/D|ND|[¡¿]?[A-ZÄÖÜÉ]+(/0)?[!?])\"?(?=[\s,;|]|$)")
# A number that one of both marks may part at its thousands.
PARTED = {mark: re.compile(rf"[+-]?[1-9]\d{{0,2}}(\{mark}\d{{3}})+") for mark in ".,"}
MISSING = ("", "-", "--", "na", "n/a", "null", "none", "missing", "?")
# Signs that texts are set with in place of -.
_MINUS = dict.fromkeys(map(ord, "\u2212\u2010\u2011\u2012\u2013\u2014\ufe63\uff0d"), "-")
# A number in any notation, also one that is refused later: that must not hide the separators.
_LIKE = re.compile(
    r"[+-]?(\d([\d.,'’\u00a0\u202f]*[\d.])?|[.,]\d+)([eEdD][+-]?\d+)?|[+-]?(nan|inf)"
)
# An exponent of double precision as Fortran writes it: 1.5D-03.
_FORTRAN = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+))[dD]([+-]?\d+)")

_STAMP = re.compile(
    r"((?P<a>\d{1,4})(?P<mark>[-/.])(?P<b>\d{1,2}|[a-z]{3})(?P=mark)(?P<c>\d{1,4})(T|\s+))?"
    r"(?P<hour>\d{1,2}):(?P<minute>\d{2})(:(?P<second>\d{2}([.,]\d+|:\d{3,})?))?"
    r"\s*(?P<half>[ap]m)?\s*\[?(utc|gmt)?(?P<zone>z|[+-]\d{2}:?\d{2})?\]?",
    re.IGNORECASE,
)
# Of an hour that is not told, as spreadsheets write times with fractions.
_MINUTES = re.compile(r"(?P<minute>\d{1,2}):(?P<second>\d{2}[.,]\d+)")
# MATLAB writes durations so: 0.005 sec.
_DURATION = re.compile(
    r"(?P<value>[+-]?(\d+([.,]\d*)?|[.,]\d+)([eE][+-]?\d+)?)\s*(?P<unit>[^\W\d_]+)"
)
_WITH_MORE = re.compile(r"(?P<value>[+-]?[\d.,]+([eE][+-]?\d+)?)\s*(?P<more>%|[^\W\d_]{1,12})")
_MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
_DAY, _HOUR = 86400.0, 3600.0


def split(line: str, delimiter: str) -> list[str]:
    """Split one line into cells; quotation marks hold a cell together, as far as they are closed.

    One that is not closed is a sign like any other.
    """
    text = line.strip().replace("\t", " ") if delimiter == " " else line
    if '"' not in text:
        cells = text.split(delimiter) if delimiter != " " else text.split()
        return [cell.strip() for cell in cells]
    closed = quotes_are_closed(text, delimiter)
    try:
        row = next(
            csv.reader(
                [text],
                delimiter=delimiter,
                skipinitialspace=True,
                quoting=csv.QUOTE_MINIMAL if closed else csv.QUOTE_NONE,
            ),
            [],
        )
    except csv.Error:
        return [line]
    return [cell.strip() for cell in row]


def quotes_are_closed(line: str, delimiter: str) -> bool:
    """Whether every cell that begins with a quotation mark ends with one."""
    if line.count('"') % 2:
        return False
    try:
        next(csv.reader([line], delimiter=delimiter, skipinitialspace=True, strict=True), [])
    except csv.Error as error:
        return "end of data" not in str(error)
    return True


def is_comment(line: str, delimiter: str) -> bool:
    """Whether a line is a comment; a semicolon begins one where it separates no cells."""
    marks = _COMMENTS if delimiter == ";" else (*_COMMENTS, ";")
    return line.lstrip().startswith(marks) and _ERROR.match(line) is None


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


def is_like_a_number(cell: str) -> bool:
    """Whether a cell is a number in any notation, also in one that is refused later."""
    return _LIKE.fullmatch(cell.lower()) is not None


WAY = "; --thousands says what the mark is"


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
    if PARTED["," if decimal == "." else "."].fullmatch(text):
        expected = f"expected a decimal {point}, no separators of thousands{WAY}"
        return f"not a number: {shown!r} ({expected})"
    if is_number(text.replace(",", "."), ".") or is_number(text.replace(".", ","), ","):
        return f"not a number: {shown!r} (expected a decimal {point})"
    if is_number(bare, ".") or is_number(bare, ","):
        return f"not a number: {shown!r} (expected no separators of thousands{WAY})"
    expected = _why_more(text, decimal)
    return f"not a number: {shown!r}" + (f" (expected {expected})" if expected else "")


def _why_more(text: str, decimal: str) -> str:
    """Return what is expected in place of a number or a stamp with something more."""
    if re.fullmatch(r"[+-]?0x[0-9a-f]+", text, re.IGNORECASE):
        return "a decimal number, no hexadecimal one"
    found = _WITH_MORE.fullmatch(text)
    if found is not None and is_number(found["value"], decimal):
        return f"a number without {found['more']!r}: units stand above the rows"
    stamp = _STAMP.match(text)
    if stamp is not None and re.fullmatch(r"\s*[A-Za-z_/]+", text[stamp.end() :]):
        return "a zone as Z or +01:00; --time none --rate HZ leaves the times out"
    return ""


def is_stamp(cell: str) -> bool:
    """Whether a cell is a time of the day, with or without a date, or a number with its unit."""
    return _duration(cell) is not None or _parts(cell) is not None


def _duration(cell: str) -> float | None:
    found = _DURATION.fullmatch(cell.strip())
    unit = "" if found is None else known_unit(found["unit"])
    return None if found is None or unit not in SECONDS else _number(found["value"]) * SECONDS[unit]


class Clock:
    """Turns stamps into seconds since the first one, and durations into seconds.

    Stamps without a date go on past midnight, those without an hour past the full hour. Whether the
    month or the day comes first is that of the first date which tells it.
    """

    def __init__(self, first: Iterable[str] = ()) -> None:
        """Begin with the first stamp; the `first` cells tell the order of dates."""
        self._first: tuple[int, float] | None = None
        self._last = 0.0
        self._turns = 0.0
        self._month_first = next(
            (told for cell in first if (told := _month_first(cell)) is not None), None
        )
        self.doubtful: dict[str, None] = {}
        """The first dates that may be read in either way."""

    def seconds(self, cell: str) -> float | None:
        """Return the time of a cell, or None if it is no stamp."""
        if (duration := _duration(cell)) is not None:
            return duration
        told = _month_first(cell)
        if told is not None and self._month_first is None:
            # Dates before that did not tell it were read so.
            taken = next((("/" in day) for day in self.doubtful), told)
            if taken == told:
                self._month_first = told
                self.doubtful.clear()
        parts = _parts(cell, self._month_first)
        # One date of another order than those before makes all of them uncertain.
        if parts is None or (told is not None and told != self._month_first):
            return None
        if self._month_first is None and len(self.doubtful) < _FEW_DATES:
            self.doubtful |= dict.fromkeys(filter(None, [_date_of(cell)]))
        days, seconds, period = parts
        if seconds < self._last - 0.5 * period:
            self._turns += period
        self._last = seconds
        self._first = self._first or (days, seconds)
        # Days apart from seconds: a sum since the year 1 would round to microseconds.
        return _DAY * (days - self._first[0]) + self._turns + (seconds - self._first[1])


def seconds_between(first: str, second: str) -> float | None:
    """Return how far the second of two stamps is behind the first; None if one is no stamp."""
    clock = Clock((first, second))
    begins, ends = clock.seconds(first), clock.seconds(second)
    return None if begins is None or ends is None else ends - begins


def is_dated(cell: str) -> bool:
    """Whether a cell is a time with its date."""
    parts = None if _duration(cell) is not None else _parts(cell)
    return parts is not None and parts[0] != 0


_FEW_DATES = 2


def _day_and_month(cell: str) -> tuple[re.Match[str], int, int] | None:
    """Return both numbers of a stamp that begins with the day or the month; else None."""
    found = _STAMP.fullmatch(cell.strip())
    if found is None or found["a"] is None or len(found["a"]) > 2 or found["b"].isalpha():
        return None
    return found, int(found["a"]), int(found["b"])


def _date_of(cell: str) -> str:
    """Return the date of a stamp whose day and month may change places; else nothing."""
    told = _day_and_month(cell)
    # Nobody writes the month first between points.
    if told is None or told[0]["mark"] == "." or max(told[1:]) > 12:
        return ""
    return cell.strip()[: told[0].end("c")]


def _month_first(cell: str) -> bool | None:
    """Return whether the month is the first number of a date; None if that is not told."""
    told = _day_and_month(cell)
    if told is None or max(told[1:]) <= 12:
        return None
    return told[2] > 12


def _parts(cell: str, month_first: bool | None = None) -> tuple[int, float, float] | None:
    """Return the day, the seconds, and after how many they begin anew: never with a date."""
    found = _MINUTES.fullmatch(cell.strip())
    if found is not None:
        return 0, 60.0 * int(found["minute"]) + _number(found["second"]), _HOUR
    found = _STAMP.fullmatch(cell.strip())
    if found is None:
        return None
    try:
        day = _day(found["a"], found["mark"], found["b"], found["c"], month_first)
    except ValueError:
        return None
    hour = int(found["hour"])
    if found["half"]:
        hour = hour % 12 + (12 if found["half"].lower() == "pm" else 0)
    seconds = 3600.0 * hour + 60.0 * int(found["minute"]) + _number(found["second"] or "0")
    return day, seconds - _zone(found["zone"] or "z"), math.inf if day else _DAY


def _number(text: str) -> float:
    return float(re.sub("[,:]", ".", text))


def _day(
    a: str | None, mark: str | None, b: str | None, c: str | None, month_first: bool | None
) -> int:
    """Return the number of a day: year first, or last, and then the month first where `/` parts.

    A month that is a word tells itself. Where the order is known, `month_first` is that.
    """
    if a is None or b is None or c is None:
        return 0
    b_is_word = b.isalpha()
    if b_is_word:
        b, mark = str(_MONTHS.index(b.lower()) + 1), "-"
    if len(a) > 2:
        return date(int(a), int(b), int(c)).toordinal()
    first, second = int(a), int(b)
    if b_is_word:
        month_first = False
    elif max(first, second) > 12:
        month_first = second > 12
    elif month_first is None:
        month_first = mark == "/"
    month, day = (first, second) if month_first else (second, first)
    return date(int(c), month, day).toordinal()


def _zone(text: str) -> float:
    """Return how far a zone is ahead of UTC, in seconds."""
    if text in "zZ":
        return 0.0
    sign = -1.0 if text[0] == "-" else 1.0
    return sign * (3600.0 * int(text[1:3]) + 60.0 * int(text[-2:]))
