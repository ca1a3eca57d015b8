"""What instruments write above a table, in rows and comments of their own: names, units, steps.

Each such row has a key in its first cell, as `Vertical Units,V,,V` or `"TraceName","CH1","CH2"`.
What is not used, as the step of a record, is told with the option that says it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from mpi_hyst._io.cells import is_number
from mpi_hyst._io.record import Assumption, Level
from mpi_hyst._quantity import SECONDS, is_like_a_unit, known_unit

_OF_NAMES = re.compile(r"(waveform|trace ?name|source|channels?|signals?|names?)\b", re.IGNORECASE)
_OF_UNITS = re.compile(
    r"(vertical units?|v ?units?|y[ _]?units?|units?|einheit(en)?)\b", re.IGNORECASE
)
_OF_TIMES = re.compile(r"(horizontal units?|h ?units?|x[ _]?units?|time ?units?)\b", re.IGNORECASE)
_OF_STEPS = re.compile(
    r"(sampl\w* ?(interval|period|time)|h ?resolution|(x ?)?increment|delta[ _]?[tx]|dt|t ?inc)\b",
    re.IGNORECASE,
)
_IN_COMMENT = re.compile(
    r"\W+(?P<key>NAME(?P<number>\d+)|SAMPLE[_ ]TIME|SAMPLING\w*|DT)\s*[=:]\s*(?P<value>.+)",
    re.IGNORECASE,
)
_UNITS_IN_COMMENT = re.compile(r"\W+(units?|einheiten)\s*[=:]\s*(?P<units>.+)", re.IGNORECASE)
# A name that says nothing, in place of which a name above may come.
_PLAIN = re.compile(r"(Y|\[\d+\]|Y\[\d+\]|\d+)")
_MOST_ROWS = 400  # of a table whose number of rows is compared with a number above it
_SETTINGS = 30  # rows beside which settings may stand


@dataclass
class Preamble:
    """The rows and comments above a table, and what they tell of its columns."""

    names: list[str]
    units: dict[int, str]
    numeric: Sequence[int]
    full: int
    """How many cells most rows of the table have."""
    has_header: bool
    stamped: bool
    said: list[Assumption] = field(default_factory=list)

    def read(self, rows: Mapping[int, Sequence[str]], comments: Mapping[int, str]) -> None:
        """Take names and units from rows and comments by their lines."""
        for place, cells in rows.items():
            told = [cell.split(":")[-1].strip() for cell in cells[1:]]
            while told and not told[-1]:
                told.pop()
            if told:
                self._take(place, cells[0].strip('": '), told, len(cells) == self.full)
        for place, text in comments.items():
            self._take_comment(place, text)

    def say_alone(self, rows: Mapping[int, Sequence[str]], count: int) -> None:
        """Say that numbers alone in their lines are no rows of a table of several columns.

        One of them is often the number of its rows; else a cell may be lost.
        """
        alone = {n: cells[0] for n, cells in rows.items() if len(cells) == 1}
        alone = {n: cell for n, cell in alone.items() if is_number(cell, ".")}
        if self.has_header or not alone or len(self.names) < 2:
            return
        lines = ", ".join(f"{n + 1} ({cell})" for n, cell in list(alone.items())[:3])
        counts = any(one.isdigit() and int(one) >= min(count, _MOST_ROWS) for one in alone.values())
        level: Level = "said" if counts else "doubtful"
        what = f"line {lines}: a number alone is no row of the table"
        self.said.append(Assumption("dialect", what, level))

    def _take(self, place: int, key: str, told: list[str], is_whole: bool) -> None:
        columns = [index for index in range(1, len(self.names)) if index in self.numeric]
        if _OF_UNITS.match(key) and all(is_like_a_unit(one) or not one for one in told):
            same = is_whole or len(told) == len(self.names) - 1
            given = dict(enumerate(told, start=1)) if same else {}
            if not same and len(set(told)) == 1:
                # One unit for all but the time, which comes first.
                given = dict.fromkeys(columns if self.has_header else columns[1:], told[0])
            self._take_units(place, given)
        elif _OF_TIMES.match(key) and known_unit(told[0]) in SECONDS:
            clock = 0 if self.has_header or len(columns) == len(self.names) else columns[0]
            if clock in self.numeric and len(set(filter(None, told))) == 1:
                self._take_units(place, {clock: told[0]})
        elif _OF_NAMES.match(key) and len(told) == len(self.names) - 1 and all(told):
            are_numbers = any(is_number(one, ".") for one in told)
            if all(map(_PLAIN.fullmatch, self.names[1:])) and not are_numbers:
                self.names[1:] = told
                self._say(place, f"names {', '.join(told)}")
        elif _OF_STEPS.match(key) and not self.stamped:
            self._say(place, f"{key} {told[0]}: not used; --rate says how fast a record is")

    def _take_comment(self, place: int, text: str) -> None:
        units = _UNITS_IN_COMMENT.match(text)
        if units is not None:
            parts = [one.strip() for one in re.split(r"[,;\s]+", units["units"].strip())]
            if len(parts) == len(self.names) and all(map(is_like_a_unit, parts)):
                self._take_units(place, dict(enumerate(parts)))
        told = _IN_COMMENT.match(text)
        if told is None:
            return
        value = told["value"].strip()
        if told["number"] and not self.has_header and int(told["number"]) < len(self.names):
            self.names[int(told["number"])] = value
            self._say(place, f"column {told['number']} is {value}")
        elif not told["number"]:
            self._say(place, f"{told['key']} {value}: not used; --rate says how fast a record is")

    def _take_units(self, place: int, given: Mapping[int, str]) -> None:
        for index, unit in given.items():
            if unit and index < len(self.names):
                self.units.setdefault(index, unit)
                self._say(place, f"{self.names[index]} is in {unit}", index)

    def _say(self, place: int, what: str, index: int | None = None) -> None:
        self.said.append(Assumption("dialect", f"line {place + 1}: {what}", "said", index))


def settings_beside(rows: Mapping[int, Sequence[str]]) -> Iterator[tuple[int, Sequence[str]]]:
    """Yield settings in the first two columns of the first rows, beside the numbers."""
    for place, cells in list(rows.items())[:_SETTINGS]:
        yield place, cells[:2]
