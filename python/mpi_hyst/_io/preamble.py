"""What stands above a table, in rows and comments: names, units, steps, factors.

Instruments write rows with a key in the first cell, as `Vertical Units,V,,V` or
`"TraceName","CH1","CH2"`; people write `# Position in nm`. What is used is said; what holds a unit
or a factor and is not used is doubtful.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from mpi_hyst._io.cells import is_number, number, seconds_between
from mpi_hyst._io.record import Assumption, Level, Stage
from mpi_hyst._quantity import (
    SECONDS,
    TIME_NAMES,
    Quantity,
    conversion,
    is_like_a_unit,
    known_unit,
    units_told,
    words_of,
)
from mpi_hyst._text import digits

_OF_NAMES = re.compile(r"(waveform|trace ?name|source|channels?|signals?|names?)\b", re.IGNORECASE)
_OF_UNITS = re.compile(
    r"(vertical units?|v ?units?|y[ _]?units?|units?|einheit(en)?)\b", re.IGNORECASE
)
_OF_TIMES = re.compile(r"(horizontal units?|h ?units?|x[ _]?units?|time ?units?)\b", re.IGNORECASE)
_OF_STARTS = re.compile(r"t0|x0|start( ?time)?", re.IGNORECASE)
_OF_STEPS = re.compile(
    r"(sampl\w* ?(interval|period|time)|h ?resolution|(x ?)?increment|delta[ _]?[tx]|dt|t ?inc)\b",
    re.IGNORECASE,
)
# `Sample rate: 100 Hz`, `Sampling frequency (kHz); 10`.
_OF_RATES = re.compile(
    r"\b(sampl\w*[ _]?(rate|freq\w*)|abtast\w*|fs)\b[^\d:=;,\t]*"
    r"[\s:=;,\t]+\d[\d.,]*\s*([kM]?(Hz|S/s))?",
    re.IGNORECASE,
)
# Of `Vertical Scale` of a scope, in volts per division, numbers know already.
_OF_FACTORS = re.compile(
    r"(?P<key>\b\w*(factor|faktor|facteur|fattore|multiplier)\b[^:=;,\t]*"
    r"|\b(scaling|gain|verstärkung|amplification|attenuation)\b([^:=;,\t\d]*(?=[:=])|\s+(of|is|to)\b)?)"
    r"[\s:=;,x×]+(?P<value>[-+]?\d[\d.,eE+-]*)",
    re.IGNORECASE,
)
# What a row of numbers may say of the columns below it.
_APPLIED = re.compile(
    r"(?P<sum>offset|zero)|scale|scaling|gain|slope|(scale |conversion |calibration )?factor"
    r"|multiplier|multiply|faktor|calibration",
    re.IGNORECASE,
)
_IN_COMMENT = re.compile(
    r"\W+(?P<key>NAME(?P<number>\d+)|SAMPLE[_ ]TIME|SAMPLING\w*|DT)\s*[=:]\s*(?P<value>.+)",
    re.IGNORECASE,
)
_UNITS_IN_COMMENT = re.compile(r"\W+(units?|einheiten)\s*[=:]\s*(?P<units>.+)", re.IGNORECASE)
# `Displacement unit: nm`, `Unit of gauge = nm`, `Position in nm`, `gauge: nm`.
_OF_ONE = re.compile(
    r"(?P<name>.*?\S)\s*([:=;,\t]\s*|\s(in|en|em)\s+|[\[(]\s*)(?P<unit>[^\s:=;,()\[\]]+)[\s\])]*",
    re.IGNORECASE,
)
_UNIT_OF = re.compile(
    r"\b(units?|einheit(en)?|unité|unidad|axis)\b(\s+(of|for|von|der|des))?", re.IGNORECASE
)
# `CH1:V CH2:mV`: a channel and its unit.
_CHANNEL = re.compile(r"(?P<channel>[^\s:=]+)\s*[:=]\s*(?P<unit>[^\s:=]+)")
# A name that says nothing, in place of which a name above may come.
_PLAIN = re.compile(r"(Y|\[\d+\]|Y\[\d+\]|\d+)")
_OPTIONS = "--input-unit, --output-unit, --unit"
_MOST_ROWS = 400  # of a table whose number of rows is compared with a number above it
_SETTINGS = 30  # rows beside which settings may stand


def factor_in(text: str) -> str:
    """Return the factor that a line of text tells, as it stands there; nothing if it is one."""
    found = _OF_FACTORS.search(text)
    is_one = found is None or number(found["value"].replace(",", "."), ".") == 1.0
    return "" if found is None or is_one else found[0].strip()


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
    used: set[int] = field(default_factory=set)
    """The lines of which something is used."""

    def read(self, rows: Mapping[int, Sequence[str]], comments: Mapping[int, str]) -> None:
        """Take names and units from rows and comments by their lines."""
        for place, cells in rows.items():
            told = [cell.split(":")[-1].strip() for cell in cells[1:]]
            while told and not told[-1]:
                told.pop()
            key = cells[0].strip('": ')
            if _OF_STARTS.fullmatch(key):
                self._say_starts(place, key, [cell for cell in cells[1:] if cell])
            of_channels = _channels(cells[1:]) if _OF_UNITS.match(key) else {}
            if of_channels:
                self._take_channels(place, of_channels)
            elif told and (applied := _APPLIED.fullmatch(key)) is not None:
                neutral = 0.0 if applied["sum"] else 1.0
                if any(number(one, ".") not in (None, neutral) for one in told):
                    what = f"{key} {', '.join(told)}: not applied; mend the numbers"
                    self._say(place, what, level="doubtful")
            elif told:
                self._take(place, key, told, len(cells) == self.full)
        for place, text in comments.items():
            self._take_comment(place, text)

    def _say_starts(self, place: int, key: str, told: Sequence[str]) -> None:
        """Say if channels begin at different times: each has a stamp, or a number of seconds."""
        for one in told[1:]:
            late = seconds_between(told[0], one)
            if late is None:
                starts = [number(cell.replace(",", "."), ".") for cell in (told[0], one)]
                late = None if None in starts else float(starts[1] or 0) - float(starts[0] or 0)
            if late:
                what = f"{key} {told[0]}, {one}: channels begin {digits(1e3 * abs(late))} ms apart"
                what += ", and their rows are joined by their numbers: the difference becomes a "
                self._say(place, f"{what}dead time or a lead; shift the columns", level="doubtful")
                return

    def read_beside(self, rows: Mapping[int, Sequence[str]]) -> None:
        """Take settings from the first rows, in columns beside the numbers.

        Each block of settings is about the columns of numbers behind it, up to the next block.
        """
        keys = sorted({
            index for cells in rows.values() for index, cell in enumerate(cells[:-1])
            if index not in self.numeric and cells[index + 1]
            and (_OF_UNITS.match(cell) or _OF_TIMES.match(cell) or _OF_NAMES.match(cell))
        })  # fmt: skip
        for place, key in enumerate(keys):
            end = keys[place + 1] if place + 1 < len(keys) else len(self.names)
            columns = [index for index in self.numeric if key < index < end]
            if not columns:
                continue
            for line, cells in rows.items():
                if key + 1 < len(cells):
                    self._take_beside(line, cells[key].strip('": '), cells[key + 1], columns)

    def _take_beside(self, line: int, key: str, told: str, columns: Sequence[int]) -> None:
        signals = columns[1:] or columns
        if _OF_UNITS.match(key) and is_like_a_unit(told):
            self._take_units(line, dict.fromkeys(signals, told))
        elif _OF_TIMES.match(key) and known_unit(told) in SECONDS and len(columns) > 1:
            self._take_units(line, {columns[0]: told})
        elif _OF_NAMES.match(key) and told and len(columns) <= 2 and not is_number(told, "."):
            index = signals[0]
            if _PLAIN.fullmatch(self.names[index]) and told not in self.names:
                self.names[index] = told
                self._say(line, f"column {index} is {told}")
        elif _OF_STEPS.match(key) and not self.stamped and len(columns) == 1:
            self._say(line, f"{key} {told}: not used; --rate says how fast a record is")

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

    def read_words(self, lines: Mapping[int, str]) -> None:
        """Take units from words, as `Position in nm`; say what holds a unit that is not used."""
        for place, text in lines.items():
            if place not in self.used and (rate := _OF_RATES.search(text)) is not None:
                self._say(place, f"{rate[0].strip()!r}: not used; --rate says how fast a record is")
            if factor := factor_in(text):
                what = f"{factor!r} is not applied; mend the numbers, or say their unit"
                self._say(place, what, level="doubtful", stage="units")
            told = conversion(text)
            if told and (about := self._converted(text, told)) is not None:
                unit = Quantity(self.names[about], self.units.get(about, "")).suffix
                what = f"{told!r} is not applied: {self.names[about]} is in {unit}; {_OPTIONS}"
                self._say(place, what, about, "doubtful", "units")
            elif told and self._is_missing(""):
                what = f"{told!r} is not applied: a column without a unit may be in either"
                self._say(place, f"{what}; {_OPTIONS}", level="doubtful", stage="units")
            if place not in self.used:
                self._take_words(place, text.strip().lstrip("#%/;").strip(' "'))

    def say_columns(self, columns: Mapping[int, Sequence[str]]) -> None:
        """Say which columns hold units in all rows, beside the numbers."""
        for index, cells in columns.items():
            units = list(dict.fromkeys(filter(None, map(known_unit, cells))))
            if units and all(known_unit(cell) or not cell for cell in cells):
                told = ", ".join(map(repr, units))
                what = f"column {self.names[index]} holds {told}, and no unit is taken from it"
                level: Level = "doubtful" if any(map(self._is_missing, units)) else "said"
                self.said.append(Assumption("units", f"{what}; {_OPTIONS}", level))

    def _take_words(self, place: int, text: str) -> None:
        left = text
        for clause in dict.fromkeys([text, *re.split(r"[;,\t]\s*", text)]):
            found = self._of_one(clause)
            if found is None:
                continue
            index, unit = found
            before = self.units.get(index) or Quantity(self.names[index]).suffix
            if before and (known_unit(before) or before) != (known_unit(unit) or unit):
                what = f"{self.names[index]} is in {unit}, and beside its name is {before}"
                self._say(place, what, index, "doubtful", "units")
            elif not before:
                self._take_units(place, {index: unit})
            left = left.replace(clause, "")
        told = [unit for unit in units_told(left) if self._is_missing(unit)]
        if told:
            what = f"{text[:60]!r} holds {', '.join(map(repr, told))}, and no unit is taken from it"
            clock = self._clock() if told[0] in SECONDS else None
            options = _OPTIONS if clock is None else "--time-unit"
            self._say(place, f"{what}; {options}", clock, "doubtful", "units")

    def _converted(self, text: str, told: str) -> int | None:
        """Return the column that a conversion names, if it is in the unit that is converted."""
        words = [word.lower() for word in words_of(text)]
        of_unit = [known_unit(word) for word in re.findall(r"[^\W\d_]+", told)]
        for index in self.numeric:
            name = self.names[index] if index < len(self.names) else ""
            quantity = Quantity(name, self.units.get(index, ""))
            own = [word.lower() for word in words_of(quantity.name)]
            if own and set(own) <= set(words) and quantity.suffix == of_unit[-1] != "":
                return index
        return None

    def _of_one(self, text: str) -> tuple[int, str] | None:
        """Return the column of which a text says the unit, and that unit."""
        found = _OF_ONE.fullmatch(text.strip())
        if found is None or not is_like_a_unit(found["unit"]):
            return None
        called = " ".join(_UNIT_OF.sub("", found["name"]).strip(" :=-_").lower().split())
        own = [(Quantity(name).name.strip().lower(), name.lower()) for name in self.names]
        same = [index for index in self.numeric if index < len(own) and called in own[index]]
        return (same[0], found["unit"]) if called and len(same) == 1 else None

    def _is_missing(self, unit: str) -> bool:
        """Whether a column may have this unit: one without a unit, a time or another one."""
        quantities = [
            Quantity(self.names[index], self.units.get(index, ""))
            for index in self.numeric
            if index < len(self.names)
        ]
        without = [one for one in quantities if not one.suffix]
        if unit in SECONDS:
            return self._clock() is not None
        times = [one.column.lower() in TIME_NAMES for one in without]
        # A number of a column may be anything, and the first one a time.
        return not all(times) or (len(times) > 1 and not any(one.suffix for one in quantities))

    def _clock(self) -> int | None:
        """Return the column that is called as a time, and has no unit."""
        for index in self.numeric:
            if index < len(self.names) and self.names[index].lower() in TIME_NAMES:
                unit = self.units.get(index, "")
                return None if Quantity(self.names[index], unit).suffix else index
        return None

    def _take(self, place: int, key: str, told: list[str], is_whole: bool) -> None:
        columns = [index for index in range(1, len(self.names)) if index in self.numeric]
        if _OF_UNITS.match(key) and all(is_like_a_unit(one) or not one for one in told):
            same = is_whole or len(told) == len(self.names) - 1
            given = dict(enumerate(told, start=1)) if same else {}
            if not same and len(told) == len(self.names) == len(self.numeric):
                given = dict(enumerate(told))
            elif not same and len(set(told)) == 1:
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

    def _take_channels(self, place: int, told: Mapping[str, str]) -> None:
        """Take the unit of each channel by its name; without such names by their order."""
        numbers = [index for index in self.numeric if index < len(self.names)]
        places = {self.names[index].strip().lower(): index for index in numbers}
        given = {places[one.lower()]: unit for one, unit in told.items() if one.lower() in places}
        if not given and len(set(told.values())) == 1:
            given = dict.fromkeys(numbers[1:] or numbers, next(iter(told.values())))
        elif not given and len(numbers) - len(told) in (0, 1):
            given = dict(zip(numbers[-len(told) :], told.values(), strict=True))
        for index, unit in given.items():
            before = self.units.get(index, "")
            if before and (known_unit(before) or before) != (known_unit(unit) or unit):
                what = f"{self.names[index]} is in {unit}, and beside its name is {before}"
                self._say(place, what, index, "doubtful", "units")
            else:
                self._take_units(place, {index: unit})
        if not given:
            units = ", ".join(f"{one} {unit}" for one, unit in told.items())
            what = f"{units}: no column is called so, and no unit is taken from it; {_OPTIONS}"
            self._say(place, what, level="doubtful", stage="units")

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

    def _say(
        self,
        place: int,
        what: str,
        index: int | None = None,
        level: Level = "said",
        stage: Stage = "dialect",
    ) -> None:
        self.used.add(place)
        self.said.append(Assumption(stage, f"line {place + 1}: {what}", level, index))


def _channels(cells: Sequence[str]) -> dict[str, str]:
    """Return the units of channels that cells name, as `CH1:V CH2:mV`; nothing of other cells."""
    parts = [part for cell in cells for part in re.split(r"[\s,;]+", cell.strip()) if part]
    found = [_CHANNEL.fullmatch(part) for part in parts]
    told = {one["channel"]: one["unit"].strip("[]()") for one in found if one is not None}
    return told if len(told) == len(parts) and all(map(is_like_a_unit, told.values())) else {}


def is_used_setting(cells: Sequence[str], names: Sequence[str]) -> bool:
    """Whether a row above the header is a setting that is used, or tells the same names."""
    key, told = cells[0].strip('": '), [cell for cell in cells[1:] if cell]
    if _OF_NAMES.fullmatch(key):
        return told == [name for name in names[1:] if name]
    is_key = _OF_UNITS.fullmatch(key) or _OF_TIMES.fullmatch(key)
    return is_key is not None and " " in key and bool(told) and all(map(is_like_a_unit, told))


def settings_beside(rows: Mapping[int, Sequence[str]]) -> Iterator[tuple[int, Sequence[str]]]:
    """Yield the first rows, beside whose numbers settings may stand."""
    yield from list(rows.items())[:_SETTINGS]
