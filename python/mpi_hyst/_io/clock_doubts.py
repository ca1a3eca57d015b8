"""What speaks against the time that is taken, or against taking none."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from mpi_hyst._io.clocks import hardly_seconds
from mpi_hyst._io.record import Assumption, Level
from mpi_hyst._io.roles import looks_like_a_time
from mpi_hyst._io.table import ArrayTable, Table
from mpi_hyst._quantity import SECONDS, Quantity
from mpi_hyst._text import digits
from mpi_hyst._types import Samples


def clock_doubt(quantity: Quantity, values: Samples) -> Assumption:
    """Return what is assumed of a time without a unit of time, and whether it is doubtful."""
    unlikely = f"is in {quantity.suffix!r}" if quantity.suffix else hardly_seconds(values)
    what = unlikely or "has no unit: seconds are assumed; --time-unit"
    if quantity.suffix:
        what += ": seconds are assumed; --time-unit"
    level: Level = "doubtful" if unlikely else "assumed"
    return Assumption("units", f"time column {quantity.column} {what}", level)


def witness_of(table: Table, indices: Sequence[int]) -> list[int]:
    """Return a column that may be the time, though neither its name nor anybody said so."""
    others = [index for index in table.numeric if index not in indices]
    quantities = [Quantity(table.names[index], table.units.get(index, "")) for index in others]
    may_be = ("", *SECONDS)
    return [index for index, one in zip(others, quantities, strict=True) if one.suffix in may_be][
        :1
    ]


def other_clocks(table: Table, clock: int, chosen: Sequence[int]) -> list[int]:
    """Return the other columns that may be a time of the chosen ones: beside them in their group.

    Where starts of channels are known, rows of the same time come together already.
    """
    if isinstance(table, ArrayTable) and table.aligned:
        return []
    groups = {re.split(r"[./][^./]*$", table.names[index])[0] for index in chosen}
    found = []
    for index in table.numeric:
        group, _, leaf = table.names[index].replace(".", "/").rpartition("/")
        quantity = Quantity(leaf, table.units.get(index, ""))
        is_time = quantity.is_time or quantity.column == "t" or quantity.time_unit
        is_near = not group or group in {one.replace(".", "/") for one in groups}
        if index != clock and is_time and is_near:
            found.append(index)
    return found


def clocks_apart(
    table: Table, clock: int, others: Mapping[int, Samples], columns: Mapping[int, Samples]
) -> Iterator[Assumption]:
    """Say which other clocks differ from the one that is the time."""

    def seconds(index: int) -> Samples:
        leaf = re.split(r"[./]", table.names[index])[-1]
        unit = Quantity(leaf, table.units.get(index, "")).time_unit or "s"
        return columns[index] * SECONDS[unit]

    time = seconds(clock) if others else columns[clock]
    for index, values in others.items():
        if values.size < _FEWEST or not bool((np.diff(values) > 0.0).all()):
            continue
        apart = seconds(index) - time
        if abs(apart[0]) > _OTHER_ERA:
            # Of a date and a time since the start only the steps can be compared.
            apart = apart - apart[0]
        step = float(np.median(np.diff(time)))
        off = float(np.median(np.abs(apart)))
        if off > _APART * step or np.abs(apart).max() > 2.0 * step:
            most = off if off > _APART * step else float(np.abs(apart).max())
            said = f"{table.names[index]} and {table.names[clock]}, which is the time, are "
            said += f"{digits(1e3 * most)} ms apart: columns of another clock are shifted by that"
            yield Assumption("roles", said, "doubtful")


_FEWEST = 3  # samples that make a clock
_OTHER_ERA = 1e6  # seconds
_APART = 0.05  # of a step


def unused_clocks(table: Table) -> Iterator[Assumption]:
    """Say which columns are called or measured as a time, where none of them is used."""
    clocks = []
    for index in table.numeric:
        name, unit = table.names[index], table.units.get(index, "")
        leaf = Quantity(re.split(r"[./]", name)[-1], unit)
        if leaf.is_time or leaf.column == "t" or (unit and leaf.time_unit):
            clocks.append(name)
    if clocks:
        which = "looks like a time" if len(clocks) == 1 else "look like times"
        said = f"{', '.join(clocks)} {which}, and none is used: --time says which"
        yield Assumption("roles", said, "doubtful")


def told_by(table: Table, index: int, values: Samples) -> Iterator[Assumption]:
    """Say if a column that is not used runs like a time."""
    if looks := looks_like_a_time(values):
        said = f"column {table.names[index]} looks like a time: {looks}"
        yield Assumption("roles", said, "doubtful")
    elif (
        re.fullmatch(r"\d+|index|", table.names[index].lower())
        and values.size > 2
        and bool((np.diff(values) > 0.0).all())
    ):
        said = f"column {table.names[index]} grows as a time does and is not used: --time says it"
        yield Assumption("roles", said, "assumed")
