"""Columns before they are read, the checks that all numbers pass, and readers of other projects."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from errno import EINVAL
from importlib import import_module
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from mpi_hyst._io.columns import ReadError, TimeOrderError
from mpi_hyst._types import Samples

# The library has the same bound, but cannot name the line.
MAX_MAGNITUDE = 1e100
MAX_ROWS = 100_000_000

Wrong = Callable[[int, int, str, str], None]
"""What becomes of a wrong number: takes the index of its column, the rows before it, the place, and
what is wrong."""


class Table(Protocol):
    """Named columns of a file or an object, of which some are read."""

    source: str
    path: Path | None
    format: str
    names: Sequence[str]
    units: Mapping[str, str]
    numeric: Sequence[int]
    """The columns that hold numbers, and belong together where a source has several lengths."""
    other: Mapping[str, str]
    """What the other columns hold, for a person."""

    def load(
        self, indices: Sequence[int], rows: int | None, time: int | None, wrong: Wrong
    ) -> list[Samples]:
        """Read columns. `wrong` is called for each number that is none, which then is NaN."""


class ArrayTable:
    """Columns that are arrays in memory, or are read as a whole."""

    def __init__(
        self,
        source: str,
        path: Path | None,
        format_name: str,
        columns: Mapping[str, Callable[[], npt.NDArray[Any]]],
        sizes: Mapping[str, int],
        units: Mapping[str, str] | None = None,
    ) -> None:
        """Take what loads each column, and the rows of those that hold numbers."""
        self.source: str = source
        self.path: Path | None = path
        self.format: str = format_name
        self.names: Sequence[str] = list(columns)
        self.units: Mapping[str, str] = units or {}
        self._columns = columns
        self._sizes = sizes
        numbers = [index for index, name in enumerate(self.names) if name in sizes]
        lengths = [sizes[self.names[index]] for index in numbers]
        # A file may hold settings beside the record: the length that most columns have is read.
        common = max(lengths, key=lambda length: (lengths.count(length), length), default=0)
        self.numeric: Sequence[int] = [
            index for index in numbers if sizes[self.names[index]] == common
        ]
        self.other: Mapping[str, str] = {
            name: f"{sizes[name]} rows" if name in sizes else "no numbers"
            for name in self.names
            if sizes.get(name) != common
        }

    def load(
        self, indices: Sequence[int], rows: int | None, time: int | None, wrong: Wrong
    ) -> list[Samples]:
        """Read columns of the same length."""
        names = [self.names[index] for index in indices]
        for name in names:
            if name not in self._sizes:
                raise ReadError(f"{self.source}, column {name}: expected a column of numbers")
        first = names[0]
        for name in names[1:]:
            if self._sizes[name] != self._sizes[first]:
                expected = f"expected as many rows as in {first}, {self._sizes[first]}"
                raise ReadError(
                    f"{self.source}, column {name}: {expected}, got {self._sizes[name]}"
                )
        if self._sizes[first] == 0:
            raise ReadError(f"{self.source}: no rows in column {first}")
        return [
            self._checked(index, np.asarray(self._columns[name]())[:rows], index == time, wrong)
            for index, name in zip(indices, names, strict=True)
        ]

    def _checked(
        self, index: int, column: npt.NDArray[Any], is_time: bool, wrong: Wrong
    ) -> Samples:
        values = numbers(column)
        if values is None:
            raise ReadError(
                f"{self.source}, column {self.names[index]}: expected numbers, got {column.dtype}"
            )
        bad = ~(np.abs(values) <= MAX_MAGNITUDE)
        for sample in np.flatnonzero(bad):
            value = float(values[sample])
            problem = "larger than 1e+100" if np.isfinite(value) else "not finite"
            wrong(index, int(sample), f"sample {sample}", f"{problem}: {value:g}")
        if bad.any():
            values = np.where(bad, np.nan, values)
        if is_time:
            for sample in np.flatnonzero(~(np.diff(values) > 0.0))[:1] + 1:
                what = later(values[sample], values[sample - 1])
                wrong(index, int(sample), f"sample {sample}", what)
        return values


def numbers(column: npt.NDArray[Any]) -> Samples | None:
    """Return an array as float64, durations and dates in seconds; None if it holds no numbers."""
    if column.dtype.kind == "O":
        try:
            column = column.astype(np.float64)
        except (TypeError, ValueError):
            return None
    if column.dtype.kind == "M":
        column = column - column[:1]
    if column.dtype.kind == "m":
        column = column / np.timedelta64(1, "s")
    if column.dtype.kind not in "fiub":
        return None
    return np.ascontiguousarray(column, dtype=np.float64)


_NOT_LATER = "time does not increase"


def later(time: float, previous: float) -> str:
    """Return the message about a time that does not increase."""
    return f"{_NOT_LATER}: {time:g} after {previous:g}"


def refusal(message: str, what: str, rows: int) -> ReadError:
    """Return the error about a wrong number."""
    return (TimeOrderError if what.startswith(_NOT_LATER) else ReadError)(message, rows)


def by_column(name: str, array: npt.NDArray[Any]) -> dict[str, Callable[[], npt.NDArray[Any]]]:
    """Split an array into columns: the array itself, `name:0` and so on, or `name/field`."""
    if array.dtype.names is not None:
        prefix = f"{name}/" if name else ""
        return {f"{prefix}{one}": _taken(array, one) for one in array.dtype.names}
    if array.ndim == 2 and 1 not in array.shape:
        # A record has more samples than columns, so the columns run along the longer side.
        wide = array if array.shape[0] >= array.shape[1] else array.T
        prefix = f"{name}:" if name else ""
        return {f"{prefix}{number}": _taken(wide.T, number) for number in range(wide.shape[1])}
    flat = array.reshape(-1) if array.ndim else array
    return {name or "0": lambda: flat}


def _taken(array: npt.NDArray[Any], which: str | int) -> Callable[[], npt.NDArray[Any]]:
    return lambda: np.asarray(array[which]).reshape(-1)


def of_arrays(
    source: str,
    path: Path | None,
    format_name: str,
    arrays: Mapping[str, npt.NDArray[Any]],
    units: Mapping[str, str] | None = None,
) -> ArrayTable:
    """Make a table of arrays by their names; those of two dimensions have several columns."""
    columns: dict[str, Callable[[], npt.NDArray[Any]]] = {}
    for name, array in arrays.items():
        if array.ndim <= 2:
            columns |= by_column(name, array)
    sizes = {}
    for name, load in columns.items():
        column = load()
        if column.ndim == 1 and numbers(column[:1]) is not None:
            sizes[name] = column.size
    return ArrayTable(source, path, format_name, columns, sizes, units)


def reader(source: str, package: str, extra: str) -> Any:
    """Import a package, or say which extra of mpi_hyst installs it."""
    try:
        return import_module(package)
    except ModuleNotFoundError as error:
        needed = f"needs {error.name}: pip install 'mpi_hyst[{extra}]'"
        raise ReadError(f"{source}: reading this format {needed}") from error


@contextmanager
def whole(path: Path, what: str) -> Iterator[None]:
    """Turn whatever a reader happens to meet in a broken file into an error that names the file.

    What the machine refuses stays as it is: memory, and errors of the system with a number. Only an
    invalid argument is a place in the file that cannot be.
    """
    try:
        yield
    except Exception as error:
        ours = isinstance(error, ReadError | MemoryError)
        if ours or getattr(error, "errno", None) not in (None, EINVAL):
            raise
        raise ReadError(f"{path}: not a whole {what}: {error or repr(error)}") from error
