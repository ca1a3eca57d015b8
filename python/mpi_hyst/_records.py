"""Records in CSV files: columns of numbers below a header, read strictly.

Every error is a CommandError or an OSError that names the file, and the line and the column if
it has one.
"""

from __future__ import annotations

import csv
import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

import numpy as np
import numpy.typing as npt

from mpi_hyst._errors import CommandError

Samples = npt.NDArray[np.float64]

# What the library refuses too, but there without the line.
MAX_MAGNITUDE = 1e100
TIME_COLUMNS = ("time_s", "time")
_SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6}
_UNITS = {
    unit.lower(): unit
    for unit in (
        *("V", "mV", "kV", "A", "mA", "C", "nC", "uC"),
        *("m", "mm", "um", "nm", "pm", "rad", "mrad", "urad", "deg", "N", "mN"),
        *_SECONDS,
    )
}


@dataclass(frozen=True)
class Quantity:
    """What a column holds, told by its name: `displacement_um` is displacement in um."""

    column: str

    @property
    def unit(self) -> str:
        """The unit that ends the name after an underscore, or nothing."""
        name, _, suffix = self.column.rpartition("_")
        return _UNITS.get(suffix.lower(), "") if name else ""

    @property
    def name(self) -> str:
        """The name without its unit."""
        name = self.column.rpartition("_")[0] if self.unit else self.column
        return name.replace("_", " ")

    @property
    def label(self) -> str:
        """For an axis: displacement (µm)."""
        return f"{self.name} ({self.shown_unit})" if self.unit else self.column

    @property
    def shown_unit(self) -> str:
        """The unit with the micro sign: um becomes µm."""
        return f"µ{self.unit[1:]}" if self.unit in ("um", "us", "urad", "uC") else self.unit


@dataclass(frozen=True)
class Columns:
    """The columns that were asked for, and the time column if there is one."""

    path: Path
    values: dict[str, Samples]
    time_column: str | None

    @property
    def samples(self) -> int:
        """How many rows."""
        return next(iter(self.values.values())).size

    @property
    def seconds(self) -> Samples | None:
        """The time column in seconds: its name may end in _s, _ms or _us."""
        if self.time_column is None:
            return None
        return self.values[self.time_column] * _SECONDS.get(Quantity(self.time_column).unit, 1.0)

    @property
    def sample_time(self) -> float | None:
        """The mean step of the time column, in seconds."""
        seconds = self.seconds
        if seconds is None or seconds.size < 2:
            return None
        return float(seconds[-1] - seconds[0]) / (seconds.size - 1)


def read_columns(
    path: Path, names: Sequence[str], *, time: str | None = None, rows: int | None = None
) -> Columns:
    """Read the named columns of the first `rows` rows, and the time.

    The time column is `time`, or one named time_s or time if there is one.
    """
    with _opened(path) as file:
        table = _Rows(path, file)
        time = time or next((name for name in TIME_COLUMNS if name in table.header), None)
        wanted = dict.fromkeys([*names, *([time] if time else [])])
        return Columns(path, _numbers(table, list(wanted), rows, time), time)


def read_trajectory(
    path: Path, column: str | None, *, time: str | None = None
) -> tuple[Columns, str]:
    """Read one column and the time; without a name, the only numeric column beside the time."""
    if column is None:
        column = _only_numeric_column(path, {time} if time else set(TIME_COLUMNS))
    return read_columns(path, [column], time=time), column


def _only_numeric_column(path: Path, times: set[str]) -> str:
    with _opened(path) as file:
        table = _Rows(path, file)
        first = next(iter(table), None)
        if first is None:
            raise CommandError(f"{path}: no rows after the header")
        cells = zip(table.header, first[1], strict=True)
        numeric = [name for name, cell in cells if name not in times and _is_number(cell)]
    if len(numeric) == 1:
        return numeric[0]
    if not numeric:
        raise CommandError(f"{path}: no numeric column beside the time; {_there_are(table.header)}")
    raise CommandError(f"{path}: several columns, choose one with --column: {', '.join(numeric)}")


def write_table(columns: Mapping[str, Sequence[float] | Samples]) -> str:
    """Return the text of a CSV file; every number reads back to the same bits."""
    lines = [",".join(_quoted(name) for name in columns)]
    lists = [np.asarray(column).tolist() for column in columns.values()]
    lines.extend(",".join(map(repr, row)) for row in zip(*lists, strict=True))
    return "\n".join(lines) + "\n"


def _quoted(name: str) -> str:
    return f'"{name.replace(chr(34), chr(34) * 2)}"' if set(name) & set(',"\n') else name


def _opened(path: Path) -> TextIO:
    # utf-8-sig drops the byte order mark that spreadsheets put in front.
    return path.open(encoding="utf-8-sig", newline="")


class _Rows:
    """The rows after the header, each with its line number and as long as the header."""

    def __init__(self, path: Path, file: TextIO) -> None:
        self.path = path
        first = self._first_line(file)
        # Where the comma is the decimal mark, spreadsheets put semicolons between the cells.
        delimiter = next((mark for mark in ",;\t" if mark in first), ",")
        self._reader = csv.reader(itertools.chain([first], file), delimiter=delimiter)
        header = next(self._lines(), None)
        if header is None:
            raise CommandError(f"{path}: empty file, expected a header with column names")
        self.header = [name.strip() for name in header[1]]

    def __iter__(self) -> Iterator[tuple[int, list[str]]]:
        for line, cells in self._lines():
            if len(cells) != len(self.header):
                expected = f"expected {len(self.header)} cells as in the header"
                raise CommandError(f"{self.path}, line {line}: {expected}, got {len(cells)}")
            yield line, cells

    def _lines(self) -> Iterator[tuple[int, list[str]]]:
        try:
            for cells in self._reader:
                if cells:  # a blank line, often the last one
                    yield self._reader.line_num, cells
        except UnicodeDecodeError as error:
            raise CommandError(f"{self.path}: not UTF-8 text (byte {error.start})") from error
        except csv.Error as error:
            raise CommandError(f"{self.path}, line {self._reader.line_num}: {error}") from error

    def _first_line(self, file: TextIO) -> str:
        try:
            return file.readline()
        except UnicodeDecodeError as error:
            raise CommandError(f"{self.path}: not UTF-8 text (byte {error.start})") from error

    def index(self, name: str) -> int:
        """Where the column is."""
        if name not in self.header:
            raise CommandError(f"{self.path}: no column {name!r}; {_there_are(self.header)}")
        if self.header.count(name) > 1:
            raise CommandError(f"{self.path}: {self.header.count(name)} columns are named {name!r}")
        return self.header.index(name)


def _there_are(header: Sequence[str]) -> str:
    return f"the columns are: {', '.join(header)}"


def _numbers(
    table: _Rows, names: list[str], rows: int | None, time: str | None
) -> dict[str, Samples]:
    indices = [table.index(name) for name in names]
    values: list[list[float]] = [[] for _ in names]
    previous = -math.inf
    for count, (line, cells) in enumerate(table):
        if count == rows:
            break
        for name, index, column in zip(names, indices, values, strict=True):
            try:
                value = _number(cells[index])
                if name == time:
                    previous = _later(value, previous)
            except ValueError as error:
                raise CommandError(f"{table.path}, line {line}, column {name}: {error}") from error
            column.append(value)
    if not values[0]:
        raise CommandError(f"{table.path}: no rows after the header")
    return {name: np.array(column) for name, column in zip(names, values, strict=True)}


def _number(cell: str) -> float:
    text = cell.strip()
    if not text:
        raise ValueError("empty cell")
    if not _is_number(text):
        hint = " (expected a decimal point)" if _is_number(text.replace(",", ".")) else ""
        raise ValueError(f"not a number: {text[:40]!r}{hint}")
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(f"not finite: {text}")
    if abs(value) > MAX_MAGNITUDE:
        raise ValueError(f"larger than {MAX_MAGNITUDE:g}: {text[:40]}")
    return value


def _later(time: float, previous: float) -> float:
    if time <= previous:
        raise ValueError(f"time does not increase: {time:g} after {previous:g}")
    return time


def _is_number(text: str) -> bool:
    # float() also takes 1_000, which in a data file is a slip.
    try:
        float(text)
    except ValueError:
        return False
    return "_" not in text
