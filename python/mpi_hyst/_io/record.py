"""What reading returns: columns by their names, with units and what was assumed, or a refusal."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, TypeAlias

from mpi_hyst._quantity import SECONDS, Quantity
from mpi_hyst._text import printable
from mpi_hyst._types import Samples

_LONGEST = 600
"""Of a message, in characters."""


Stage: TypeAlias = Literal["bytes", "dialect", "table", "units", "roles"]
Level: TypeAlias = Literal["said", "assumed", "doubtful"]


@dataclass(frozen=True)
class Assumption:
    """What a stage of reading took for granted, in words.

    Attributes
    ----------
    stage : str
        "bytes", "dialect", "table", "units" or "roles".
    text : str
        What was not said by the source, what is assumed, and the option that decides it.
    level : str
        "said" is for the list of `look` only. "assumed" may be wrong. "doubtful" may make numbers
        wrong, and speaks against it: the verdict of `identify` is amber, other commands refuse.
    column : int or None
        The number of the column that it is about; None if it is about the whole source.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> record = mh.io.read({"time": [0.0, 0.1], "PosNm": [1.0, 2.0]})
    >>> [(one.level, one.text) for one in record.assumed if one.level == "doubtful"]
    [('doubtful', "no unit taken from 'PosNm', though it holds 'Nm'")]

    """

    stage: Stage
    text: str
    level: Level = "said"
    column: int | None = field(default_factory=lambda: None)


class ReadError(ValueError):
    """A file or an object without the requested columns of numbers.

    Attributes
    ----------
    rows : int or None
        The rows before the one that is refused; None where no single row is.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> try:
    ...     mh.io.read({"drive_v": [0.0, 1.0, float("nan")]})
    ... except mh.io.ReadError as error:
    ...     print(error.rows, error)
    2 dict, sample 2, column drive_v: not finite: nan

    """

    def __init__(self, message: str, rows: int | None = None) -> None:
        """Take the message, and how many rows could be read.

        What the source says of itself is escaped, and is cut where it is too long for a person.
        """
        shown = printable(message)
        super().__init__(shown if len(shown) <= _LONGEST else f"{shown[:_LONGEST]}...")
        self.rows = rows


class TimeOrderError(ReadError):
    """A time that does not increase."""


@dataclass(frozen=True)
class Columns:
    """Columns of a file or of an object in memory by their names.

    Attributes
    ----------
    path : Path or None
        The file; None for an object in memory.
    values : dict of str to ndarray
        Every column that was read, the time included.
    time_column : str or None
        The name of the time column.
    units : dict of str to str
        The units of the columns that were read, as far as the source or their names tell them:
        V, um, ms. ASCII where the unit is a known one, else as the source has it.
    format : str
        What was read, for example "text, separated by semicolons, decimal comma".
    names : tuple of str
        All columns of the source, in its order.
    assumed : tuple of Assumption
        What the stages of reading assumed about these columns.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> columns = mh.io.read({"t_ms": [0.0, 0.5, 1.0], "drive_v": [0.0, 1.0, 2.0]})
    >>> columns["drive_v"]
    array([0., 1., 2.])
    >>> columns.time_column, columns.sample_time, columns.units["drive_v"]
    ('t_ms', 0.0005, 'V')

    """

    path: Path | None
    values: dict[str, Samples]
    time_column: str | None
    units: Mapping[str, str] = field(default_factory=dict)
    format: str = ""
    names: tuple[str, ...] = ()
    assumed: tuple[Assumption, ...] = ()

    def __getitem__(self, name: str | int) -> Samples:
        """Return a column by its name, or by its number in the source."""
        return self.values[self.key(name)]

    def key(self, name: str | int) -> str:
        """Return the name under which a column was read that was asked for by name or number."""
        if name in self.values:
            return str(name)
        return key(self.names, find(self.source, self.names, name))

    def quantity(self, name: str | int) -> Quantity:
        """Return name and unit of a column."""
        found = self.key(name)
        return Quantity(found, self.units.get(found, ""))

    @property
    def source(self) -> str:
        """The file, or the kind of object, for messages."""
        return str(self.path) if self.path is not None else self.format

    @property
    def samples(self) -> int:
        """The number of rows."""
        return next(iter(self.values.values())).size

    @property
    def time_unit(self) -> str:
        """The unit of the time column; seconds where nothing tells it, or without a time column."""
        if self.time_column is None:
            return "s"
        return self.quantity(self.time_column).time_unit or "s"

    @property
    def seconds(self) -> Samples | None:
        """The time column in seconds; one in ns, us, ms, min or h is converted."""
        if self.time_column is None:
            return None
        return self.values[self.time_column] * SECONDS[self.time_unit]

    @property
    def sample_time(self) -> float | None:
        """The mean step of the time column, in seconds."""
        seconds = self.seconds
        if seconds is None or seconds.size < 2:
            return None
        return float(seconds[-1] - seconds[0]) / (seconds.size - 1)


def find(source: str, names: Sequence[str], wanted: str | int) -> int:
    """Return the index of a column: by its name, by a path in other notation, or by its number."""
    if isinstance(wanted, int):
        matches = [wanted] if 0 <= wanted < len(names) else []
    else:
        matches = [index for index, name in enumerate(names) if name == wanted]
        matches = matches or [i for i, name in enumerate(names) if _path(name) == _path(wanted)]
        if not matches and wanted.isascii() and wanted.isdigit() and int(wanted) < len(names):
            matches = [int(wanted)]
    if not matches:
        raise ReadError(f"{source}: no column {wanted!r}; {there_are(names)}")
    if len(matches) > 1:
        numbers = ", ".join(map(str, matches))
        raise ReadError(
            f"{source}: {len(matches)} columns are named {wanted!r}; take one by number: {numbers}"
        )
    return matches[0]


def key(names: Sequence[str], index: int) -> str:
    """Return the name of a column, or its number where several columns have this name."""
    return names[index] if names.count(names[index]) == 1 else str(index)


def there_are(names: Sequence[str]) -> str:
    """List the columns for a message."""
    return f"the columns are: {', '.join(names)}" if names else "there are no columns"


def _path(name: str) -> str:
    """`data.drive`, `data/drive` and `/data/drive` are the same place."""
    return re.sub(r"[./]+", "/", name).strip("/")
