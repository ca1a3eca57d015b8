"""Times in text that are written as dates or as times of the day."""

from __future__ import annotations

import math
import re
from datetime import date

_STAMP = re.compile(
    r"((?P<a>\d{1,4})(?P<mark>[-/.])(?P<b>\d{1,2}|[a-z]{3})(?P=mark)(?P<c>\d{1,4})(T|\s+))?"
    r"(?P<hour>\d{1,2}):(?P<minute>\d{2})(:(?P<second>\d{2}([.,]\d+)?))?"
    r"\s*(?P<half>[ap]m)?\s*(?P<zone>z|[+-]\d{2}:?\d{2})?",
    re.IGNORECASE,
)
# Of an hour that is not told, as spreadsheets write times with fractions.
_MINUTES = re.compile(r"(?P<minute>\d{1,2}):(?P<second>\d{2}[.,]\d+)")
_MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
_DAY, _HOUR = 86400.0, 3600.0


def is_stamp(cell: str) -> bool:
    """Whether a cell is a time of the day, with or without a date, or minutes and seconds."""
    return _parts(cell) is not None


class Clock:
    """Turns stamps into seconds since the first one.

    Those without a date go on past midnight, those without an hour past the full hour.
    """

    def __init__(self) -> None:
        """Begin with the first stamp."""
        self._first: tuple[int, float] | None = None
        self._last = 0.0
        self._turns = 0.0

    def seconds(self, cell: str) -> float | None:
        """Return the time of a cell, or None if it is no stamp."""
        parts = _parts(cell)
        if parts is None:
            return None
        days, seconds, period = parts
        if seconds < self._last - 0.5 * period:
            self._turns += period
        self._last = seconds
        self._first = self._first or (days, seconds)
        # Days apart from seconds: a sum since the year 1 would round to microseconds.
        return _DAY * (days - self._first[0]) + self._turns + (seconds - self._first[1])


def _parts(cell: str) -> tuple[int, float, float] | None:
    """Return the day, the seconds, and after how many they begin anew: never with a date."""
    found = _MINUTES.fullmatch(cell.strip())
    if found is not None:
        return 0, 60.0 * int(found["minute"]) + _number(found["second"]), _HOUR
    found = _STAMP.fullmatch(cell.strip())
    if found is None:
        return None
    try:
        day = _day(found["a"], found["mark"], found["b"], found["c"])
    except ValueError:
        return None
    hour = int(found["hour"])
    if found["half"]:
        hour = hour % 12 + (12 if found["half"].lower() == "pm" else 0)
    seconds = 3600.0 * hour + 60.0 * int(found["minute"]) + _number(found["second"] or "0")
    return day, seconds - _zone(found["zone"] or "z"), math.inf if day else _DAY


def _number(text: str) -> float:
    return float(text.replace(",", "."))


def _day(a: str | None, mark: str | None, b: str | None, c: str | None) -> int:
    """Return the number of a day: year first, or last, and then the month first where `/` parts.

    A month that is a word tells itself.
    """
    if a is None or b is None or c is None:
        return 0
    if b.isalpha():
        b, mark = str(_MONTHS.index(b.lower()) + 1), "-"
    if len(a) > 2:
        return date(int(a), int(b), int(c)).toordinal()
    first, second = int(a), int(b)
    month_first = (mark == "/" and first <= 12) or second > 12
    month, day = (first, second) if month_first else (second, first)
    return date(int(c), month, day).toordinal()


def _zone(text: str) -> float:
    """Return how far a zone is ahead of UTC, in seconds."""
    if text in "zZ":
        return 0.0
    sign = -1.0 if text[0] == "-" else 1.0
    return sign * (3600.0 * int(text[1:3]) + 60.0 * int(text[-2:]))
