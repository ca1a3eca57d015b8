"""The trajectory of a command: its sampling interval, and the unit of its time."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NoReturn

import numpy as np

from mpi_hyst._cli.options import Sampled
from mpi_hyst._cli.terminal import CommandError, note
from mpi_hyst._io.clocks import LONGEST, usual_step
from mpi_hyst._io.read import read_trajectory, unit_doubt
from mpi_hyst._io.record import TimeOrderError
from mpi_hyst._quantity import Quantity, with_unit
from mpi_hyst._text import digits
from mpi_hyst._types import Samples
from mpi_hyst.io import Assumption, Columns

# Seconds. Steps outside are those of no record of hysteresis.
_SHORTEST, _SLOWEST = 1e-7, 60.0


# Share by which equal sampling intervals may differ: clocks are not exact.
SAME_INTERVAL = 1e-3


class UnevenTimesError(CommandError):
    """Times that are not those of an even grid."""


def sampling_interval(columns: Columns, rate: float | None = None) -> float:
    """Return the sampling interval in seconds, from the time column or from --rate."""
    dt = known_interval(columns, rate)
    if dt is None and columns.time_column is not None:
        raise CommandError(
            f"{columns.source}: one row, so {columns.time_column} tells no sampling interval; "
            "give it with --time none --rate HZ"
        )
    if dt is None:
        raise CommandError(
            f"{columns.source}: expected a time column (time_s, time, t, or --time NAME) or "
            "--rate, to know the sampling interval"
        )
    return dt


def shared_interval(records: Sequence[Columns], rate: float | None = None) -> float:
    """Return the sampling interval in seconds, which all records share."""
    first, *others = [sampling_interval(columns, rate) for columns in records]
    for columns, other in zip(records[1:], others, strict=True):
        if abs(other - first) > SAME_INTERVAL * first:
            raise CommandError(
                f"{columns.source}: expected the sampling interval of {records[0].source}, "
                f"{first:g} s, got {other:g} s"
            )
    return first


def known_interval(columns: Columns, rate: float | None = None) -> float | None:
    """Return the sampling interval in seconds, or None without time column and --rate."""
    if rate is not None:
        return _interval_of(rate, columns)
    seconds, dt = columns.seconds, columns.sample_time
    if seconds is None or dt is None:
        return None
    _say_unit(columns)
    # A time written with few digits is rounded by a part of a step; the roundings do not add up.
    uneven = float(np.abs(seconds - seconds[0] - dt * np.arange(seconds.size)).max())
    if uneven > 0.1 * dt:
        raise UnevenTimesError(
            f"{columns.source}: expected equal time steps of {dt:g} s, got a time {uneven:g} s off"
        )
    _check_unit(columns, dt)
    return dt


def _say_unit(columns: Columns) -> None:
    """Say on standard error that times were converted: a unit taken wrongly scales all of them."""
    if columns.time_unit != "s":
        what = f"time column {columns.time_column} is converted from {columns.time_unit} to seconds"
        note(f"{columns.source}: {what}")


def fitted_interval(columns: Columns, rate: float | None = None) -> float | None:
    """Return the same for a record to fit, whose uneven times are a finding and no error."""
    try:
        dt = known_interval(columns, rate)
    except UnevenTimesError:
        seconds = columns.seconds
    else:
        if dt is not None and not _SHORTEST <= dt < _SLOWEST:
            _refuse_interval(columns, rate, dt)
        return dt
    assert seconds is not None
    return usual_step(seconds)


def with_time_unit(columns: Columns, unit: str | None) -> Columns:
    """Return the columns with the time in the unit that was given, if one was."""
    if unit is None:
        return columns
    if columns.time_column is None:
        raise CommandError(f"--time-unit: {columns.source} has no time column; name it with --time")
    return replace(columns, units={**columns.units, columns.time_column: unit})


def trajectory(path: Path, sampled: Sampled, *, beside: str | None = None) -> tuple[Columns, str]:
    """Read one column and the time; where that does not increase, say what can be done.

    A unit that was given is that of the column. Another column may be read `beside` it.
    """
    try:
        columns, column = read_trajectory(
            *(path, sampled.column),
            time=sampled.time,
            beside=beside,
            options=sampled.text.options,
        )
    except TimeOrderError as error:
        raise CommandError(
            f"{error}; mend the rows, or count them instead with --time none --rate HZ"
        ) from error
    if sampled.unit is not None:
        columns = replace(columns, units={**columns.units, column: sampled.unit})
    if sampled.time_unit is not None:
        said = [one for one in columns.assumed if not _is_of_time_unit(one, columns)]
        columns = replace(columns, assumed=tuple(said))
    return with_time_unit(columns, sampled.time_unit), column


def assumed_of(columns: Columns, name: str, stage_unit: str, sampled: Sampled | None) -> list[str]:
    """Return what was assumed of a reference: in reading it, and of its unit, that of a stage.

    What something in the file speaks against is refused. Without `sampled` a command has no option
    for the unit.
    """
    option = "" if sampled is None else "--unit"
    is_given = sampled is not None and sampled.unit is not None
    said = [
        one
        for one in columns.assumed
        if one.stage != "units"
        or _is_of_time_unit(one, columns)
        or (one.text != _again(columns, name) and not is_given)
    ]
    doubt = unit_doubt(columns.quantity(name), stage_unit or "that of the stage", option)
    if doubt is not None and not is_given:
        said.append(doubt)
    return assumptions(columns, said)


def assumptions(columns: Columns, said: Iterable[Assumption]) -> list[str]:
    """Return what was assumed of columns; what something in the file speaks against is refused."""
    lines = []
    for one in said:
        if one.level == "doubtful":
            raise CommandError(f"{columns.source}: {one.text}")
        if one.level == "assumed":
            lines.append(f"{columns.source}: {one.text}")
    return lines


def _again(columns: Columns, name: str) -> str:
    """Return what reading said of the unit of a column, which is told with what decides it."""
    doubt = unit_doubt(columns.quantity(name))
    return "" if doubt is None else doubt.text


def _is_of_time_unit(one: Assumption, columns: Columns) -> bool:
    is_time = one.column is not None and columns.names[one.column] == columns.time_column
    return is_time and one.stage == "units"


def _check_unit(columns: Columns, dt: float) -> None:
    """Refuse a time without a unit whose steps are hardly those of a record in seconds."""
    column = columns.time_column
    assert column is not None
    if not columns.quantity(column).time_unit and not _SHORTEST <= dt < LONGEST:
        raise CommandError(
            f"{columns.source}: time column {column} has no unit and steps of {digits(dt)}, "
            "hardly seconds: say what it is with --time-unit s or --time-unit ms, or leave it "
            "out with --time none --rate HZ"
        )


def _refuse_interval(columns: Columns, rate: float | None, dt: float) -> NoReturn:
    """Refuse what no rig samples at, as a rate for an interval, or another unit of time."""
    span = f"expected a sampling interval of {digits(_SHORTEST)} to {digits(_SLOWEST)} s"
    if rate is not None:
        raise CommandError(f"--rate: {span}, got {digits(dt)} s; --rate is samples per second")
    raise CommandError(
        f"{columns.source}: {span}, got {digits(dt)} s; say what the unit of the time is with "
        "--time-unit, or leave the time out with --time none --rate HZ"
    )


def interval_of_rate(rate: float) -> float:
    """Return the sampling interval in seconds of --rate."""
    if not (math.isfinite(rate) and rate > 0.0):
        raise CommandError(f"--rate: expected a finite number above 0, got {rate!r}")
    return 1.0 / rate


def _interval_of(rate: float, columns: Columns) -> float:
    if columns.time_column is not None:
        raise CommandError(
            f"--rate: {columns.source} has the time column {columns.time_column}; give one of "
            "both, or --time none"
        )
    return interval_of_rate(rate)


def clock_column(columns: Columns, samples: int, before: int, dt: float) -> tuple[str, Samples]:
    """Return name and values of the time column of so many samples, `before` of them a lead-in.

    It goes on from the time of the trajectory, in its unit. Without one, seconds count from zero.
    """
    seconds = columns.seconds
    if columns.time_column is None or seconds is None:
        return "time_s", np.arange(-before, samples - before, dtype=np.float64) * dt
    given = columns[columns.time_column]
    step = dt * float(given[-1] - given[0]) / float(seconds[-1] - seconds[0])
    values = np.concatenate([given[0] - step * np.arange(before, 0, -1), given])
    return _clock_name(columns.time_column, columns.time_unit), values


def _clock_name(column: str, unit: str) -> str:
    """Keep a name that says by itself what it is: what is written has no row of units."""
    said = Quantity(column)
    return column if said.is_time and said.suffix == unit else with_unit("time", unit)
