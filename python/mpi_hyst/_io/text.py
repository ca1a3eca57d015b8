"""Tables in text: comma, semicolon, tab or white space between the cells."""

from __future__ import annotations

import csv
import math
from array import array
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from itertools import chain, islice
from pathlib import Path

import numpy as np

from mpi_hyst._io import dialect as dialects
from mpi_hyst._io.clock import Clock, is_stamp
from mpi_hyst._io.columns import ReadError
from mpi_hyst._io.lines import Lines
from mpi_hyst._io.table import MAX_MAGNITUDE, MAX_ROWS, Wrong, later
from mpi_hyst._quantity import known_unit
from mpi_hyst._types import Samples

_SAMPLE_LINES = 500
_FIRST_ROWS = 20  # rows that tell a column of dates
_SAMPLE_CHARACTERS = 4_000_000


class TextTable:
    """The table in a text. Its rows are read from start to end, once."""

    def __init__(self, path: Path, lines: Lines, packed: str = "") -> None:
        """Look at the first lines; `packed` is the suffix of the packer."""
        self.path: Path | None = path
        self.source: str = str(path)
        sample = list(_sample(lines))
        if not any(line.strip() for line in sample):
            raise ReadError(f"{path}: empty file, expected a header with column names")
        self._dialect = dialects.detect(sample)
        self._lines = chain(sample[self._dialect.first :], lines)
        self._number = self._dialect.first
        self._whole_rows = 0
        self.names: Sequence[str] = self._dialect.names
        first = _rows_of(self._dialect, sample)
        self._stamped = _stamped(self._dialect, first[:_FIRST_ROWS])
        self.numeric: Sequence[int] = sorted({*self._dialect.numeric, *self._stamped})
        units = zip(self.names, self._dialect.units, strict=False)
        # Whatever their name or a row of units says: stamps become seconds.
        self.units: Mapping[str, str] = {
            **{name: known_unit(unit) or unit for name, unit in units if unit},
            **{self.names[index]: "s" for index in self._stamped},
        }
        self.other: Mapping[str, str] = {
            name: f"no numbers in most rows{_why(self._dialect, first, index)}"
            for index, name in enumerate(self.names)
            if index not in self.numeric
        }
        parts = ["text", f"packed as {packed}" if packed else "", self._dialect.text]
        self.format: str = ", ".join(part for part in parts if part)
        if lines.encoding != "utf-8":
            self.format += f", {lines.encoding}"

    def load(
        self, indices: Sequence[int], rows: int | None, time: int | None, wrong: Wrong
    ) -> list[Samples]:
        """Read columns of numbers."""
        columns = [array("d") for _ in indices]
        decimal, previous, count = self._dialect.decimal, -math.inf, 0
        number = partial(_value, decimal=decimal)
        convert = [Clock().seconds if one in self._stamped else number for one in indices]
        places = list(zip(indices, columns, convert, strict=True))
        # What is behind the rows that are asked for may be anything.
        for cells in islice(self._rows(), rows):
            if count == MAX_ROWS:
                raise ReadError(f"{self.source}: expected at most {MAX_ROWS} rows")
            count += 1
            for index, column, value_of in places:
                value = value_of(cells[index])
                if value is None:
                    value, why = math.nan, dialects.why_no_number(cells[index], decimal)
                    wrong(index, count - 1, f"line {self._number}", why)
                elif index == time:
                    if value <= previous:
                        what = later(value, previous)
                        wrong(index, count - 1, f"line {self._number}", what)
                    previous = value
                column.append(value)
        if not count:
            raise ReadError(f"{self.source}: no rows after the header")
        return [np.array(column) for column in columns]

    def _rows(self) -> Iterator[list[str]]:
        """Yield the rows; each has the cells of the header, and beyond them empty ones only."""
        width, header = len(self.names), self._dialect.header
        reader = dialects.reader(self._texts(), self._dialect.delimiter)
        try:
            for cells in reader:
                got = len(cells)
                if got != width and (got < width or any(map(str.strip, cells[width:]))):
                    self._refuse(got, width, header)
                yield cells
                self._whole_rows += 1
        except csv.Error as error:
            raise ReadError(f"{self.source}, line {self._number}: {error}") from error

    def _refuse(self, got: int, width: int, header: int | None) -> None:
        where = (
            "as in the rows before" if header is None else f"as in the header, line {header + 1}"
        )
        raise ReadError(
            f"{self.source}, line {self._number}: expected {width} cells {where}, got {got}",
            self._whole_rows,
        )

    def _texts(self) -> Iterator[str]:
        """Yield the lines that hold cells, and count all."""
        delimiter = self._dialect.delimiter
        for line in self._lines:
            self._number += 1
            # A blank line is often the last one.
            if line.strip() and not dialects.is_comment(line, delimiter):
                yield dialects.prepared(line, delimiter)


def _stamped(dialect: dialects.Dialect, rows: Sequence[Sequence[str]]) -> set[int]:
    """Return the columns of dates or times of the day."""
    columns = [index for index in range(len(dialect.names)) if index not in dialect.numeric]
    return {
        index
        for index in columns
        if rows and all(index < len(row) and is_stamp(row[index]) for row in rows)
    }


def _rows_of(dialect: dialects.Dialect, sample: Sequence[str]) -> list[list[str]]:
    lines = [line for line in sample[dialect.first :] if line.strip()]
    return [
        dialect.cells(line) for line in lines if not dialects.is_comment(line, dialect.delimiter)
    ]


def _why(dialect: dialects.Dialect, rows: Sequence[Sequence[str]], index: int) -> str:
    """Return what is expected in place of the first cell that could be a number, if one could."""
    cells = [row[index] for row in rows if index < len(row)]
    reasons = (dialects.why_no_number(cell, dialect.decimal) for cell in cells)
    return next((f": {reason}" for reason in reasons if "(expected" in reason), "")


def _sample(lines: Lines) -> Iterator[str]:
    characters = 0
    for line in islice(lines, _SAMPLE_LINES):
        yield line
        characters += len(line)
        if characters > _SAMPLE_CHARACTERS:
            return


def _value(cell: str, decimal: str) -> float | None:
    """Return the number in a cell, or None if it holds no admissible one."""
    value = dialects.number(cell, decimal)
    return value if value is not None and -MAX_MAGNITUDE <= value <= MAX_MAGNITUDE else None
