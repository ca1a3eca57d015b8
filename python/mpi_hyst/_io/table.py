"""The stage of the table: named columns with units before they are read, and checked numbers."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from mpi_hyst._io.factors import Setting, factors_told
from mpi_hyst._io.record import Assumption, Level, ReadError, TimeOrderError, there_are
from mpi_hyst._quantity import TIME_NAMES, Quantity, is_like_a_unit, known_unit
from mpi_hyst._text import digits
from mpi_hyst._types import Samples

# The library has the same bound, but cannot name the line.
MAX_MAGNITUDE = 1e100
MAX_ROWS = 100_000_000
_WHOLE = 0.05  # of a sample: starts of channels nearer to whole samples are whole ones

Wrong: TypeAlias = Callable[[int, int, str, str], None]
"""What becomes of a wrong number: takes the index of its column, the rows before it, the place, and
what is wrong."""

Load: TypeAlias = Callable[[], npt.NDArray[Any]]


class Table(Protocol):
    """Named columns of a file or an object, of which some are read."""

    source: str
    path: Path | None
    format: str
    names: Sequence[str]
    units: Mapping[int, str]
    """What the source says of the units, by the numbers of the columns."""
    numeric: Sequence[int]
    """The columns that hold numbers, and belong together where a source has several lengths."""
    other: Mapping[str, str]
    """What the other columns hold, for a person."""
    assumed: list[Assumption]
    """What was taken for granted until now; reading may add to it."""
    begins: str
    """The time at which the table says that it begins, as text; empty if it does not."""

    def load(
        self, indices: Sequence[int], rows: int | None, time: int | None, wrong: Wrong
    ) -> list[Samples]:
        """Read columns. `wrong` is called for each number that is none, which then is NaN."""


def numeric(table: Table) -> Sequence[int]:
    """Return the columns of numbers; a table without is refused."""
    if not table.numeric:
        told = [
            f"{name} is {what}" if " x " in what else f"{name}: {what}"
            for name, what in table.other.items()
            if " x " in what or "(expected" in what
        ]
        said = "; ".join([f"no numeric column; {there_are(table.names)}", *told])
        raise ReadError(f"{table.source}: {said}")
    return table.numeric


@dataclass(frozen=True)
class Began:
    """The clock of one channel: when it began, and its step, both in seconds."""

    start: float
    step: float


class ArrayTable:
    """Columns that are arrays in memory, or are read as a whole."""

    TIME = "time_s"

    def __init__(
        self,
        source: str,
        path: Path | None,
        format_name: str,
        columns: Mapping[str, Load],
        sizes: Mapping[str, int],
        units: Mapping[str, str] | None = None,
        *,
        clocks: Mapping[str, Began] | None = None,
        other: Mapping[str, str] | None = None,
        assumed: Sequence[Assumption] = (),
        called: Mapping[str, str] | None = None,
        settings: Sequence[Setting] = (),
    ) -> None:
        """Take what loads each column, and the rows of those that hold numbers.

        Columns are told apart by their keys; `called` are the names of those that have others.
        Where channels have clocks, rows of the same time come together, and `time_s` is that time.
        """
        self.source: str = source
        self.path: Path | None = path
        self.format: str = format_name
        self.begins: str = ""
        self._clocks = dict(clocks or {})
        self._columns, self._sizes = dict(columns), dict(sizes)
        kinds = {name: self._kind(name) for name in self._sizes}
        # A file may hold settings beside the record: what most columns have is read.
        counts = Counter(kinds.values())
        common = max(counts, key=lambda kind: (counts[kind], kind), default=(0, 0.0))
        self._made_time = common[1] > 0.0 and self.TIME not in self._columns
        self._begins = 0.0
        if self._made_time:
            self._columns = {self.TIME: lambda: np.empty(0), **self._columns}
            self._sizes[self.TIME] = common[0]
            kinds[self.TIME] = common
            own = [clock for name, clock in self._clocks.items() if kinds.get(name) == common]
            self._clocks[self.TIME] = Began(0.0, own[0].step)
        self._keys = list(self._columns)
        self._called = called or {}
        self.aligned: bool = self._made_time
        """Whether rows of the same time come together by the clocks of their channels."""
        self.names: Sequence[str] = [self._name(one) for one in self._keys]
        given = units or {}
        self.units: Mapping[int, str] = {
            index: given[one] for index, one in enumerate(self._keys) if given.get(one)
        }
        self.numeric: Sequence[int] = [
            index for index, one in enumerate(self._keys) if kinds.get(one) == common
        ]
        self.other: Mapping[str, str] = {
            **{
                self._name(one): self._why_other(one, common)
                for one in self._keys
                if kinds.get(one) != common
            },
            **(other or {}),
        }
        places = {self.names[index]: index for index in self.numeric}
        beside = [one for one in settings if one.name not in places]
        self.assumed: list[Assumption] = [*assumed, *factors_told(beside, places)]

    def _why_other(self, one: str, common: tuple[int, float]) -> str:
        """Say why a column is not one of those that belong together."""
        if one not in self._sizes:
            return "no rows of numbers"
        rows, step = self._kind(one)
        clock = ""
        if step != common[1]:
            every = [
                f"every {digits(each)} s" if each else "no clock" for each in (step, common[1])
            ]
            clock = f", {every[0]}; the others: {every[1]}"
        return f"{rows} rows{clock}"

    def load(
        self, indices: Sequence[int], rows: int | None, time: int | None, wrong: Wrong
    ) -> list[Samples]:
        """Read columns of the same length."""
        names = [self._keys[index] for index in indices]
        for name in names:
            if name not in self._sizes:
                shown = self._name(name)
                raise ReadError(f"{self.source}, column {shown}: expected a column of numbers")
        dropped, first = self._dropped(names), names[0]
        for name in names[1:]:
            if not dropped and self._sizes[name] != self._sizes[first]:
                expected = f"expected as many rows as in {self._name(first)}, {self._sizes[first]}"
                raise ReadError(
                    f"{self.source}, column {self._name(name)}: {expected}, got {self._sizes[name]}"
                )
        if min(self._sizes[name] for name in names) == 0:
            raise ReadError(f"{self.source}: no rows in column {self._name(first)}")
        own = [name for name in names if not self._is_made(name)]
        count = min((self._sizes[one] - dropped.get(one, 0) for one in own), default=None)
        return [
            self._checked(index, self._part(name, dropped, count)[:rows], index == time, wrong)
            for index, name in zip(indices, names, strict=True)
        ]

    def _name(self, one: str) -> str:
        return self._called.get(one, one)

    def _kind(self, name: str) -> tuple[int, float]:
        """Return what columns that belong together share: length and step."""
        clock = self._clocks.get(name)
        return self._sizes[name], float(f"{clock.step:.6g}") if clock is not None else 0.0

    def _part(self, name: str, dropped: Mapping[str, int], count: int | None) -> npt.NDArray[Any]:
        count = self._sizes[name] if count is None else count
        if self._is_made(name):
            return self._begins + self._clocks[name].step * np.arange(count)
        column = self._columns[name]()
        first = dropped.get(name, 0)
        return column[first : first + count] if dropped else column

    def _dropped(self, names: Sequence[str]) -> dict[str, int]:
        """Return how many rows of each channel come before all of them have begun."""
        clocks = {one: self._clocks[one] for one in names if one in self._clocks}
        own = {one: clock for one, clock in clocks.items() if not self._is_made(one)}
        self._begins = max((clock.start for clock in own.values()), default=0.0)
        if len(own) < 2:
            return {}
        latest = max(own, key=lambda one: own[one].start)
        earliest = min(own, key=lambda one: own[one].start)
        step = own[latest].step
        for one, clock in own.items():
            if abs(clock.step - step) > 1e-6 * step:
                last = f"{self._name(latest)} every {digits(step)} s"
                said = f"{self._name(one)} is sampled every {digits(clock.step)} s, and {last}"
                raise ReadError(f"{self.source}: {said}: read them apart")
        shifts = {one: (own[latest].start - clock.start) / step for one, clock in own.items()}
        dropped = {one: round(shift) for one, shift in shifts.items()}
        late = own[latest].start - own[earliest].start
        if late <= 1e-9 * step:
            return {}
        before = self._name(earliest)
        said = f"{self._name(latest)} begins {digits(1e3 * late)} ms after {before}"
        if min(self._sizes[one] - count for one, count in dropped.items()) <= 0:
            raise ReadError(f"{self.source}: {said}, when that has ended")
        left = max(abs(shift - dropped[one]) for one, shift in shifts.items())
        if dropped[earliest]:
            said += f": the first {dropped[earliest]} rows of {before} are left out"
            common = min(self._sizes[one] - count for one, count in dropped.items())
            behind = {one: self._sizes[one] - dropped[one] - common for one in own}
            ends = [f"{count} of {self._name(one)}" for one, count in behind.items() if count]
            said += f", and the last {', '.join(ends)}" if ends else ""
        if left > _WHOLE:
            said += (
                f"; {digits(1e3 * left * step)} ms are left, no whole number of samples, "
                "and are taken for a dead time or a lead"
            )
        level: Level = "doubtful" if left > _WHOLE else "assumed"
        if dropped[earliest] or left > _WHOLE:
            self.assumed.append(Assumption("table", said, level))
        return dropped if any(dropped.values()) else {}

    def _is_made(self, name: str) -> bool:
        """Whether a column is the time that the clocks of the channels tell."""
        return name == self.TIME and self._made_time

    def _checked(
        self, index: int, column: npt.NDArray[Any], is_time: bool, wrong: Wrong
    ) -> Samples:
        values = numbers(column)
        if values is None:
            raise ReadError(
                f"{self.source}, column {self.names[index]}: expected numbers, got {column.dtype}"
            )
        masked = np.ma.getmaskarray(column) if np.ma.isMaskedArray(column) else None
        bad = ~(np.abs(values) <= MAX_MAGNITUDE)
        for sample in np.flatnonzero(bad):
            value = float(values[sample])
            problem = "larger than 1e+100" if np.isfinite(value) else "not finite"
            what = f"{problem}: {value:g}"
            if masked is not None and masked[sample]:
                what = "expected a number, got a masked element"
            wrong(index, int(sample), f"sample {sample}", what)
        if bad.any():
            values = np.where(bad, np.nan, values)
        if is_time:
            for sample in np.flatnonzero(~(np.diff(values) > 0.0))[:1] + 1:
                what = later(values[sample], values[sample - 1])
                wrong(index, int(sample), f"sample {sample}", what)
        return values


def numbers(column: npt.NDArray[Any]) -> Samples | None:
    """Return an array as float64, durations and dates in seconds; None if it holds no numbers.

    What is masked is NaN.
    """
    if column.dtype.kind == "O":
        column = _of_objects(column)
    if column.dtype.kind == "M":
        column = column - column[:1]
    if column.dtype.kind == "m":
        column = column / np.timedelta64(1, "s")
    if column.dtype.kind not in "fiub":
        return None
    if np.ma.isMaskedArray(column):
        column = np.ma.filled(column.astype(np.float64), np.nan)
    return np.ascontiguousarray(column, dtype=np.float64)


def _of_objects(column: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return numbers or stamps that are objects as an array of their own kind, if they are such."""
    try:
        return column.astype(np.float64)
    except (TypeError, ValueError):
        pass
    try:
        seconds = [one.timestamp() for one in column]
        return np.array([one - seconds[0] for one in seconds], dtype=np.float64)
    except (AttributeError, TypeError, ValueError, OverflowError):
        return column


_NOT_LATER = "time does not increase"


def later(time: float, previous: float) -> str:
    """Return the message about a time that does not increase."""
    return f"{_NOT_LATER}: {time:g} after {previous:g}"


def refusal(message: str, what: str, rows: int) -> ReadError:
    """Return the error about a wrong number."""
    return (TimeOrderError if what.startswith(_NOT_LATER) else ReadError)(message, rows)


def by_column(name: str, array: npt.NDArray[Any]) -> dict[str, Load]:
    """Split an array into columns: the array itself, `name:0` and so on, or `name/field`.

    Axes of length 1 are dropped before.
    """
    if array.dtype.names is not None:
        prefix = f"{name}/" if name else ""
        return {f"{prefix}{one}": _taken(array, one) for one in array.dtype.names}
    if array.ndim > 2:
        array = array.squeeze()
    if array.ndim == 2 and 1 not in array.shape:
        # A record has more samples than columns, so the columns run along the longer side.
        wide = array if array.shape[0] >= array.shape[1] else array.T
        prefix = f"{name}:" if name else ""
        return {f"{prefix}{number}": _taken(wide.T, number) for number in range(wide.shape[1])}
    flat = array.reshape(-1) if array.ndim else array
    return {name or "0": lambda: flat}


def axes(array: npt.NDArray[Any]) -> int:
    """Return how many axes are longer than 1."""
    return sum(length != 1 for length in array.shape)


def too_many_axes(shape: Sequence[int], dtype: object) -> str:
    """Say what to do with an array that is no column and no table of columns."""
    sides = " x ".join(map(str, shape))
    part = ", ".join([":", *["0"] * (len(shape) - 1)])
    return f"{sides} of {dtype}: no columns; take a part of it in Python, as array[{part}]"


def _taken(array: npt.NDArray[Any], which: str | int) -> Load:
    # Masked arrays stay so.
    return lambda: (
        np.ma.asanyarray(array[which]).reshape(-1)
        if np.ma.isMaskedArray(array)
        else np.asarray(array[which]).reshape(-1)
    )


_UNITS = re.compile(r"(.*?)[ _./]*units?", re.IGNORECASE)
_NAMES = re.compile(
    r"(.*?)[ _./]*(names?|columns?|col_?names?|labels?|headers?|channels?|fields?|legend)",
    re.IGNORECASE,
)


def texts_of(array: npt.NDArray[Any]) -> list[str] | None:
    """Return the first texts in an array, each once; None if it holds something else."""
    if array.dtype.kind not in "USO" or not array.size:
        return None
    cells = [
        one.decode("utf-8", "replace") if isinstance(one, bytes) else one
        for one in array.reshape(-1)[:_FEW_TEXTS].tolist()
    ]
    cells = list(dict.fromkeys(cells)) if len(cells) == _FEW_TEXTS else cells
    return cells if all(isinstance(one, str) for one in cells) else None


def units_of(
    texts: Mapping[str, Sequence[str]],
    columns: Mapping[str, object],
    shapes: Mapping[str, tuple[int, ...]],
    given: Mapping[str, str],
) -> tuple[dict[str, str], list[Assumption]]:
    """Return the units of columns in texts beside them: `gauge_unit`, or `units` of a matrix.

    Names of its columns may hold them, too. What else may be units is told, as nothing is taken
    from it, unless all columns have units of their own, and the same ones.
    """
    units: dict[str, str] = {}
    said: list[Assumption] = []
    leaves = {
        name: Quantity(re.split(r"[./]", name)[-1])
        for name in columns
        if name in shapes or name.rpartition(":")[0] in shapes
    }
    own = {
        given.get(name) or leaf.suffix or ("s" if leaf.column.lower() in TIME_NAMES else "")
        for name, leaf in leaves.items()
    }
    for name, cells in texts.items():
        known = [known_unit(cell) or cell for cell in cells if is_like_a_unit(cell)]
        called = _UNITS.fullmatch(name)
        are_names = called is None and len(cells) > 1
        if are_names:
            called = _NAMES.fullmatch(name)
            known = [Quantity(cell).suffix for cell in cells]
        if called is None or not any(known):
            continue
        whole = len(known) == len(cells)
        matrix = [
            one for one, shape in shapes.items()
            if len(shape) == 2 and 1 not in shape and len(cells) == min(shape)
        ]  # fmt: skip
        if whole and len(cells) == 1 and called[1] in columns:
            units[called[1]] = known[0]
        elif whole and len(matrix) == 1 and called[1] in ("", matrix[0]):
            prefix = f"{matrix[0]}:" if matrix[0] else ""
            units |= {f"{prefix}{number}": unit for number, unit in enumerate(known) if unit}
            if are_names:
                every = ", ".join(f"{prefix}{number} is {one}" for number, one in enumerate(cells))
                said.append(Assumption("table", f"{name}: {every}"))
        elif "" in own or not own.issuperset(filter(None, known)):
            said.append(units_not_taken(name, list(filter(None, known))))
    return units, said


def units_not_taken(where: str, units: Sequence[str]) -> Assumption:
    """Say that texts are units, and that nobody knows of which columns."""
    told = ", ".join(map(repr, units))
    what = f"{where} holds {told}, and no unit is taken from it"
    return Assumption("units", f"{what}; --input-unit, --output-unit, --unit", "doubtful")


_FEW_TEXTS = 100


def of_arrays(
    source: str,
    path: Path | None,
    format_name: str,
    arrays: Mapping[str, npt.NDArray[Any]],
    units: Mapping[str, str] | None = None,
    *,
    clocks: Mapping[str, Began] | None = None,
    other: Mapping[str, str] | None = None,
    assumed: Sequence[Assumption] = (),
    called: Mapping[str, str] | None = None,
    settings: Sequence[Setting] = (),
) -> ArrayTable:
    """Make a table of arrays by their names; those of two dimensions have several columns.

    Settings beside them are no columns, but may say their units.
    """
    columns: dict[str, Load] = {}
    others = dict(other or {})
    said = list(assumed)
    of_columns: dict[str, str] = {}
    beside = {one.name: np.asarray(one.value) for one in settings if not one.column}
    few = {**arrays, **beside}
    texts = {name: found for name, one in few.items() if (found := texts_of(one)) is not None}
    for name, array in arrays.items():
        if array.dtype.names is None and axes(array) > 2:
            others[name or "the array"] = too_many_axes(array.shape, array.dtype)
            continue
        parts = by_column(name, array)
        if array.ndim == 2 and 1 not in array.shape and array.shape[0] < array.shape[1]:
            rows, count = array.shape
            what = f"{name or 'the array'}: {rows} x {count}, each of the {rows} rows is a column"
            said.append(Assumption("table", what, "said"))
        columns |= parts
        if (units or {}).get(name):
            of_columns.update(dict.fromkeys(parts, (units or {})[name]))
    shapes = {name: one.shape for name, one in arrays.items() if name not in texts}
    told, more = units_of(texts, columns, shapes, of_columns)
    of_columns |= {name: unit for name, unit in told.items() if name not in of_columns}
    said += more
    sizes = {}
    for name, load in columns.items():
        column = load()
        if column.ndim == 1 and numbers(column[:1]) is not None:
            sizes[name] = column.size
    return ArrayTable(
        *(source, path, format_name, columns, sizes, of_columns),
        clocks=clocks,
        other=others,
        assumed=said,
        called=called,
        settings=[*settings, *(Setting(name, array) for name, array in arrays.items())],
    )
