"""CSV files with columns of numbers below a header.

A file is read once, from start to end, so that it may be a pipe. Every error is a ReadError or an
OSError that names the file, and line and column if there are any.
"""

from __future__ import annotations

import csv
import math
from array import array
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from os import PathLike
from pathlib import Path
from typing import TextIO

import numpy as np

from mpi_hyst._quantity import SECONDS, Quantity
from mpi_hyst._types import Samples

# The library has the same bound, but cannot name the line.
MAX_MAGNITUDE = 1e100
TIME_COLUMNS = ("time_s", "time")
# Bounds for endless files such as devices.
_MAX_LINE = 1_000_000  # characters
_MAX_ROWS = 100_000_000

_Choice = Callable[["_Rows", "list[str] | None"], Sequence[str]]


class ReadError(ValueError):
    """A file without the requested columns of numbers."""


@dataclass(frozen=True)
class Columns:
    """Columns of a file by their names.

    Attributes
    ----------
    path : Path
        The file.
    values : dict of str to ndarray
        Every column that was read, the time included.
    time_column : str or None
        The name of the time column.

    """

    path: Path
    values: dict[str, Samples]
    time_column: str | None

    def __getitem__(self, name: str) -> Samples:
        """Return a column by its name."""
        return self.values[name]

    @property
    def samples(self) -> int:
        """The number of rows."""
        return next(iter(self.values.values())).size

    @property
    def seconds(self) -> Samples | None:
        """The time column in seconds; a name that ends in _ms or _us is converted."""
        if self.time_column is None:
            return None
        return self.values[self.time_column] * SECONDS.get(Quantity(self.time_column).suffix, 1.0)

    @property
    def sample_time(self) -> float | None:
        """The mean step of the time column, in seconds."""
        seconds = self.seconds
        if seconds is None or seconds.size < 2:
            return None
        return float(seconds[-1] - seconds[0]) / (seconds.size - 1)


def read(
    path: str | PathLike[str],
    names: Sequence[str] | None = None,
    *,
    time: str | None = None,
    rows: int | None = None,
) -> Columns:
    r"""Read columns of numbers from a CSV file.

    The first line is a header. Cells are separated by commas, semicolons or tabs. An empty cell,
    a text, a number that is not finite, or a time that does not increase is refused.

    Parameters
    ----------
    path : str or path
        The file, UTF-8 with or without a byte order mark.
    names : sequence of str, optional
        The columns to read; by default all whose first cell is a number.
    time : str, optional
        The time column; by default `time_s` or `time`, if there is one.
    rows : int, optional
        Read only so many rows.

    Returns
    -------
    Columns
        The columns by their names.

    Raises
    ------
    ReadError
        If the file holds something else; the message names file, line and column.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as directory:
    ...     path = Path(directory) / "record.csv"
    ...     _ = path.write_text("time_s,drive_v,position_um\n0,0,0\n0.001,1,0.005\n")
    ...     record = mh.io.read(path, ["drive_v", "position_um"])
    >>> record["position_um"]
    array([0.   , 0.005])
    >>> record.sample_time
    0.001

    """
    if names is not None:
        return _read(Path(path), lambda *_: names, time, rows)
    return _read(Path(path), lambda table, first: _numeric(table, first, set()), time, rows)


def read_trajectory(
    path: Path, column: str | None, *, time: str | None = None
) -> tuple[Columns, str]:
    """Read one column and the time. Without a name: the only numeric column but the time."""

    def choose(table: _Rows, first: list[str] | None) -> list[str]:
        if column is not None:
            return [column]
        return [_only_numeric(table, first, {time} if time else set(TIME_COLUMNS))]

    columns = _read(path, choose, time, None)
    return columns, next(iter(columns.values))


def _read(path: Path, choose: _Choice, time: str | None, rows: int | None) -> Columns:
    # utf-8-sig drops the byte order mark that spreadsheets write.
    with path.open(encoding="utf-8-sig", newline="") as file:
        table = _Rows(path, file)
        # The first row is kept for later, as a pipe can be read only once.
        first = next(iter(table), None)
        time = time or next((name for name in TIME_COLUMNS if name in table.header), None)
        chosen = choose(table, None if first is None else first[1])
        wanted = dict.fromkeys([*chosen, *([time] if time else [])])
        lines = chain([] if first is None else [first], table)
        return Columns(path, _numbers(table, lines, list(wanted), rows, time), time)


def _numeric(table: _Rows, first: list[str] | None, times: set[str]) -> list[str]:
    """Return the columns that hold a number in the first row."""
    if first is None:
        raise ReadError(f"{table.path}: no rows after the header")
    cells = zip(table.header, first, strict=True)
    names = [name for name, cell in cells if name not in times and _is_number(cell)]
    if not names:
        what = "no numeric column beside the time" if times else "no numeric column"
        raise ReadError(f"{table.path}: {what}; {_there_are(table.header)}")
    return names


def _only_numeric(table: _Rows, first: list[str] | None, times: set[str]) -> str:
    names = _numeric(table, first, times)
    if len(names) > 1:
        several = "several columns, choose one with --column"
        raise ReadError(f"{table.path}: {several}: {', '.join(names)}")
    return names[0]


def write_table(columns: Mapping[str, Sequence[float] | Samples]) -> str:
    """Return the text of a CSV file. Every number reads back to the same bits."""
    lines = [",".join(_quoted(name) for name in columns)]
    lists = [np.asarray(column).tolist() for column in columns.values()]
    lines.extend(",".join(map(repr, row)) for row in zip(*lists, strict=True))
    return "\n".join(lines) + "\n"


def _quoted(name: str) -> str:
    return f'"{name.replace(chr(34), chr(34) * 2)}"' if set(name) & set(',"\r\n') else name


class _Rows:
    """The rows after the header, with their line numbers. Their length is checked."""

    def __init__(self, path: Path, file: TextIO) -> None:
        self.path = path
        lines = self._bounded(file)
        first = next(lines, "")
        # Spreadsheets separate by semicolons where the comma is the decimal mark.
        delimiter = next((mark for mark in ",;\t" if mark in first), ",")
        self._reader = csv.reader(chain([first], lines), delimiter=delimiter)
        header = next(self._cells(), None)
        if header is None:
            raise ReadError(f"{path}: empty file, expected a header with column names")
        self.header = [name.strip() for name in header[1]]

    def __iter__(self) -> Iterator[tuple[int, list[str]]]:
        for line, cells in self._cells():
            if len(cells) != len(self.header):
                expected = f"expected {len(self.header)} cells as in the header"
                raise ReadError(f"{self.path}, line {line}: {expected}, got {len(cells)}")
            yield line, cells

    def _cells(self) -> Iterator[tuple[int, list[str]]]:
        try:
            for cells in self._reader:
                if cells:  # a blank line, often the last one
                    yield self._reader.line_num, cells
        except csv.Error as error:
            raise ReadError(f"{self.path}, line {self._reader.line_num}: {error}") from error

    def _bounded(self, file: TextIO) -> Iterator[str]:
        """Yield lines up to a bounded length."""
        number = 0
        while True:
            number += 1
            try:
                line = file.readline(_MAX_LINE)
            except UnicodeDecodeError as error:
                raise ReadError(f"{self.path}: not UTF-8 text (byte {error.start})") from error
            if not line:
                return
            if len(line) == _MAX_LINE:
                raise ReadError(
                    f"{self.path}, line {number}: expected less than {_MAX_LINE} characters"
                )
            yield line

    def index(self, name: str) -> int:
        """Return the index of a column."""
        if name not in self.header:
            raise ReadError(f"{self.path}: no column {name!r}; {_there_are(self.header)}")
        if self.header.count(name) > 1:
            raise ReadError(f"{self.path}: {self.header.count(name)} columns are named {name!r}")
        return self.header.index(name)


def _there_are(header: Sequence[str]) -> str:
    return f"the columns are: {', '.join(header)}"


def _numbers(
    table: _Rows,
    lines: Iterator[tuple[int, list[str]]],
    names: list[str],
    rows: int | None,
    time: str | None,
) -> dict[str, Samples]:
    indices = [table.index(name) for name in names]
    values = [array("d") for _ in names]
    previous = -math.inf
    for count, (line, cells) in enumerate(lines):
        if count == rows:
            break
        if count == _MAX_ROWS:
            raise ReadError(f"{table.path}: expected at most {_MAX_ROWS} rows")
        for name, index, column in zip(names, indices, values, strict=True):
            try:
                value = _number(cells[index])
                if name == time:
                    previous = _later(value, previous)
            except ValueError as error:
                raise ReadError(f"{table.path}, line {line}, column {name}: {error}") from error
            column.append(value)
    if not values[0]:
        raise ReadError(f"{table.path}: no rows after the header")
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
        raise ValueError(f"not finite: {text[:40]}")
    if abs(value) > MAX_MAGNITUDE:
        raise ValueError(f"larger than {MAX_MAGNITUDE:g}: {text[:40]}")
    return value


def _later(time: float, previous: float) -> float:
    if time <= previous:
        raise ValueError(f"time does not increase: {time:g} after {previous:g}")
    return time


def _is_number(text: str) -> bool:
    # float() also accepts 1_000, which is an error in a data file.
    try:
        float(text)
    except ValueError:
        return False
    return "_" not in text
