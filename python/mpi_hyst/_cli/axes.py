"""`mpi-hyst axes`: records with several drives and positions in, a stage of several axes out."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import click
import numpy as np

import mpi_hyst as mh
from mpi_hyst._cli.inputs import assumptions, shared_interval, with_time_unit
from mpi_hyst._cli.options import (
    FILE,
    OfText,
    argument,
    command,
    flags,
    group,
    option,
    passed,
    report,
    time_column,
    time_unit,
    whole,
    word_or,
)
from mpi_hyst._cli.outputs import Output, check_outputs, write_outputs
from mpi_hyst._cli.stage import refusing
from mpi_hyst._cli.terminal import CommandError, command_line, note, require_report_packages, say
from mpi_hyst._report import axes as page
from mpi_hyst._report.axes import Found, Record
from mpi_hyst._report.page import hashed_file, made_with
from mpi_hyst.io import Columns

_AXES = ("identify_axes",)


def _names(**how: Any) -> Any:
    """Make a field the names of columns, with commas between them."""

    def convert(context: click.Context, option: click.Parameter, value: str) -> tuple[str, ...]:
        found = tuple(name.strip() for name in value.split(","))
        if not all(found) or len(set(found)) < len(found):
            message = f"expected names of different columns, with commas between, got {value!r}"
            raise click.BadParameter(message, context, option)
        return found

    return option(required=True, metavar="NAME,...", callback=convert, **how)


@dataclass(frozen=True)
class Request:
    """The records, what is tried, and what is written."""

    data: tuple[Path, ...] = argument("RECORD.csv...", nargs=-1, required=True, type=FILE)
    result_path: Path | None = option("-o", help="Stage of several axes to write.")
    drives: tuple[str, ...] = _names(help="Columns of the drives.")
    positions: tuple[str, ...] = _names(help="Columns of the positions.")
    order: int | Literal["auto"] = option(
        passed=_AXES,
        default="auto",
        metavar="COUNT|auto",
        **word_or(("auto",), "a whole number of at least 1", whole),
        help="Number of states. auto: by cross-validation.",
    )
    hysteresis: Literal["auto", "none", "plays", "duhem"] = option(
        passed=_AXES, default="auto", help="Kind of hysteresis. auto: by cross-validation."
    )
    place: Literal["auto", "in_front", "inside"] = option(
        passed=_AXES,
        default="auto",
        help="Where it stands: in front of the dynamics or inside. auto: by cross-validation.",
    )
    skip: int = option(
        passed=_AXES,
        type=click.IntRange(min=0),
        default=0,
        metavar="SAMPLES",
        help="First samples of each record to simulate but not fit.",
    )
    report_path: Path | None = report()
    time: str | Literal[False] | None = time_column()
    time_unit: str | None = time_unit()
    rate: float | None = option(
        metavar="HZ", help="Sampling rate, for files without a time column."
    )
    text: OfText = group(OfText)


@command(Request, short_help="Identify a stage with several drives and positions.")
def axes(request: Request) -> None:
    """Identify a stage with several drives and positions that share their dynamics.

    RECORD.csv are records, each from rest on, with a column for each drive and each position.
    Linear dynamics, hysteresis in front of them and inside are judged by samples that they were not
    fitted to.
    """
    say(run(request))


def run(request: Request) -> str:
    """Identify, write what was asked for, and return the summary."""
    check_outputs([request.result_path, request.report_path], request.data)
    if request.report_path is not None:
        require_report_packages("--report")
    both = sorted(set(request.drives) & set(request.positions))
    if both:
        raise CommandError(f"--positions: expected no column of --drives, got {both[0]}")
    read = [_columns(path, request) for path in request.data]
    for columns in read:
        for said in assumptions(columns, columns.assumed):
            note(said)
    dt = shared_interval(read, request.rate)
    u, y = (
        [np.column_stack([columns[name] for name in names]) for columns in read]
        for names in (request.drives, request.positions)
    )
    with refusing(request.data[0], {**flags(Request), "dt": "--rate"}):
        found = mh.identify_axes(u, y, dt=dt, **passed(request, "identify_axes"))
    named = zip(map(str, request.data), u, y, strict=True)
    records = [Record(name, drives, positions) for name, drives, positions in named]
    result = Found(found, records, request.drives, request.positions, request.skip)
    _write(request, result)
    return page.summary(result)


def _columns(path: Path, request: Request) -> Columns:
    """Read the columns of a record."""
    columns = mh.io.read(
        path,
        [*request.drives, *request.positions],
        time=request.time,
        skip_lines=request.text.skip_lines,
        thousands=request.text.thousands,
    )
    return with_time_unit(columns, request.time_unit)


def _write(request: Request, result: Found) -> None:
    outputs = []
    if request.result_path is not None:
        outputs.append(Output(request.result_path, result.found.model.save))
    if request.report_path is not None:
        made = made_with(command_line(), [hashed_file(path) for path in request.data])
        outputs.append(Output.of(request.report_path, page.report(result, made)))
    write_outputs(outputs)
