"""Reads the records of `mpi-hyst identify`: those to fit and those held out."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

import numpy as np

from mpi_hyst import io
from mpi_hyst._cli.errors import CommandError
from mpi_hyst._cli.identify.missing import filled
from mpi_hyst._cli.identify.parts import parted
from mpi_hyst._cli.identify.request import Request
from mpi_hyst._cli.inputs import fitted_interval, with_time_unit
from mpi_hyst._files import sha256
from mpi_hyst._io.columns import TimeOrderError
from mpi_hyst._quantity import stated_unit
from mpi_hyst._report.identify.records import Record, Records
from mpi_hyst._text import digits
from mpi_hyst._types import Samples
from mpi_hyst.io import Columns, ReadError

_Value = TypeVar("_Value", str, int)
_SAME = 1e-3  # share by which equal sampling intervals may differ: clocks are not exact
_AMOUNT = re.compile(r"(?P<count>\d+(\.\d+)?|\.\d+) ?(?P<seconds>s)?")


def read(request: Request) -> Records:
    """Read all records, each with the part to skip."""
    records, units = _read("--skip", request.data, request.skip, request.rows, request)
    held_out, _ = _read("--validate-skip", request.validate, request.validate_skip, (), request)
    first = records[0]
    _check_twice(records, held_out)
    records, held_out = _same_clock(records, first), _same_clock(held_out, first)
    _check_validation(held_out, first)
    if not request.validate_from:
        if request.leave_out or request.mend:
            records = parted(records[0], request.leave_out, request.mend)
        return Records(records, held_out, ends=False, units=units)
    ends = _ends(records, request)
    fitted = [record.until(end) for record, end in zip(records, ends, strict=True)]
    held_out = [replace(record, skip=end) for record, end in zip(records, ends, strict=True)]
    return Records(fitted, held_out, ends=True, units=units)


def _read(
    option: str, paths: Sequence[Path], skip: Sequence[str], rows: Sequence[int], request: Request
) -> tuple[list[Record], dict[str, str]]:
    skips = _per_file(option, skip, "0", paths)
    counts = _per_file("--rows", rows, 0, paths)
    names = [request.input_column, request.output_column]
    records: list[Record] = []
    units: dict[str, str] = {}
    for path, amount, count in zip(paths, skips, counts, strict=True):
        columns, first = _columns(path, names, count or None, request)
        for name, given in zip(names, (request.input_unit, request.output_unit), strict=True):
            unit = stated_unit(given or "") or columns.quantity(name).suffix
            _check_unit(path, name, unit, units)
        dt, seconds = fitted_interval(columns, request.rate), columns.seconds
        position = columns[request.output_column]
        if seconds is None and dt is not None:
            seconds = dt * np.arange(columns.samples, dtype=np.float64)
        records.append(
            Record(
                name=path.name,
                input=columns[request.input_column],
                output=-position if request.negate_output else position,
                seconds=seconds,
                dt=dt,
                skip=max(first, _samples(option, amount, path, seconds, columns.samples)),
                sha256=sha256(path),
            )
        )
    return records, units


def _columns(
    path: Path, names: list[str], rows: int | None, request: Request
) -> tuple[Columns, int]:
    """Read the columns of a file, and say in which row its position begins.

    Of a file that is refused say which part of it can be read.
    """
    try:
        try:
            columns, first = io.read(path, names, time=request.time, rows=rows), 0
        except ReadError as refused:
            columns, first = filled(path, names, rows, request, refused)
    except ReadError as error:
        hint = _hint(error) if path in request.data else ""
        raise CommandError(f"{error}{hint}") from error
    return with_time_unit(columns, request.time_unit), first


def _hint(error: ReadError) -> str:
    """Return what to do about a row that is refused."""
    if not error.rows:
        return ""
    if not isinstance(error, TimeOrderError):
        return f"; mend this row, or read what is before it with --rows {error.rows}"
    backwards = "reverse the rows if they run backwards, " if error.rows == 1 else ""
    return (
        f"; {backwards}read what is before with --rows {error.rows}, or count the rows instead "
        "with --time none --rate HZ"
    )


def _check_unit(path: Path, name: str, unit: str, units: dict[str, str]) -> None:
    """Note the unit of a column; another one than in the files before is refused."""
    before = units.setdefault(name, unit)
    if unit and before and unit != before:
        raise CommandError(f"{path}, column {name}: expected {before} as before, got {unit}")
    units[name] = before or unit


def _ends(records: Sequence[Record], request: Request) -> list[int]:
    """Return the samples from which on the records are held out."""
    option = "--validate-from"
    ends = []
    amounts = _per_file(option, request.validate_from, "", request.data)
    for record, path, amount in zip(records, request.data, amounts, strict=True):
        end = _samples(option, amount, path, record.seconds, record.input.size)
        if end <= record.skip:
            raise CommandError(f"{path}: {option} {amount} leaves no samples to fit")
        ends.append(end)
    return ends


def _per_file(
    option: str, values: Sequence[_Value], default: _Value, data: Sequence[Path]
) -> list[_Value]:
    """Spread the values of an option over the files: one for all, or one for each."""
    if len(values) not in (0, 1, len(data)):
        raise CommandError(
            f"{option}: given {len(values)} times for {len(data)} files; expected once, or once "
            "per file"
        )
    if len(values) == len(data):
        return list(values)
    return [values[0] if values else default] * len(data)


def _samples(option: str, amount: str, path: Path, seconds: Samples | None, samples: int) -> int:
    """Turn rows, as in 1000, or seconds, as in 5s, into samples: fewer than the file has."""
    match = _AMOUNT.fullmatch(amount.strip())
    if match is None or (not match["seconds"] and not match["count"].isdigit()):
        raise CommandError(
            f"{option}: expected rows as in 1000 or seconds as in 5s, got {amount!r}"
        )
    if not match["seconds"]:
        count = int(match["count"])
    elif seconds is None:
        raise CommandError(f"{path}: {option} {amount} needs a time column (--time) or --rate")
    else:
        count = int(np.searchsorted(seconds - seconds[0], float(match["count"])))
    if count >= samples:
        raise CommandError(f"{path}: {option} {amount} leaves none of {samples} samples")
    return count


def _same_clock(records: Sequence[Record], first: Record) -> list[Record]:
    """Give records of nearly the sampling interval of the first one that interval itself.

    Refuse records with and without one together.
    """
    same = []
    for record in records:
        if (first.dt is None) != (record.dt is None):
            known, unknown = (first, record) if record.dt is None else (record, first)
            raise CommandError(f"{unknown.name}: expected a time column as in {known.name}")
        near = first.dt and record.dt and abs(record.dt - first.dt) <= _SAME * first.dt
        same.append(replace(record, dt=first.dt) if near else record)
    return same


def _check_twice(records: Sequence[Record], held_out: Sequence[Record]) -> None:
    """Refuse a file that is fitted twice, or held out in fitted rows: it would predict itself."""
    fitted: dict[str, Record] = {}
    for record in records:
        _refuse_again(record, fitted.get(record.sha256 or ""))
        if record.sha256 is not None:
            fitted[record.sha256] = record
    for record in held_out:
        before = fitted.get(record.sha256 or "")
        if before is not None and record.skip < before.input.size:
            _refuse_again(record, before)


def _refuse_again(record: Record, before: Record | None) -> None:
    if before is not None:
        raise CommandError(
            f"{record.name}: expected another record, got the content of {before.name} again"
        )


def _check_validation(held_out: Sequence[Record], first: Record) -> None:
    """Refuse files for validation at another rate: the library takes that of the first record."""
    for record in held_out:
        if first.dt is not None and record.dt is not None and record.dt != first.dt:
            raise CommandError(
                f"{record.name}: expected the sampling interval of {first.name}, "
                f"{digits(first.dt)} s, got {digits(record.dt)} s"
            )
