"""`mpi-hyst excite`: the drive to identify from, or to demagnetise with, as a CSV to be played."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

import mpi_hyst as mh
from mpi_hyst._errors import CommandError
from mpi_hyst._outputs import Output, check_outputs, write_outputs
from mpi_hyst._records import Quantity, Samples, write_table
from mpi_hyst._tables import digits, in_unit, text_pairs

_TIME = "time_s"


@dataclass(frozen=True)
class Request:
    """What was asked, by the names of the options."""

    limits: tuple[float, float]
    rate: float
    slew: float
    drive_path: Path
    cycles: int = 20
    shape: Literal["triangle", "sine"] = "triangle"
    around: float | None = None
    start: float | None = None
    demagnetize: bool = False
    column: str = "voltage_v"
    report_path: Path | None = None

    @property
    def quantity(self) -> Quantity:
        """The drive."""
        return Quantity(self.column)


@dataclass(frozen=True)
class Drive:
    """The samples, how many of them come before the memory is known, and where they turn."""

    values: Samples
    seconds: Samples
    lead_in: int
    reversals: int


def run(request: Request) -> str:
    """Design the drive, write it, and return what there is to know about it."""
    check_outputs([request.drive_path, request.report_path])
    if request.column in ("", _TIME):
        raise CommandError(f"--column: expected a name other than {_TIME}, got {request.column!r}")
    if request.report_path is not None:
        from mpi_hyst._report import require

        require("--report")
    drive = design(request)
    table = write_table({_TIME: drive.seconds, request.column: drive.values})
    outputs = [Output.of_text(request.drive_path, table)]
    if request.report_path is not None:
        from mpi_hyst._excite_report import report

        outputs.append(Output.of_text(request.report_path, report(drive, request)))
    write_outputs(outputs)
    what = f"{request.drive_path}: {title(request)}\n\n{text_pairs(facts(drive, request))}"
    return f"{what}\n\n{_next(drive, request)}"


def design(request: Request) -> Drive:
    """Make the drive that was asked for."""
    low, high = request.limits
    try:
        if request.demagnetize:
            values = mh.signals.demagnetize(
                low,
                high,
                slew=request.slew,
                rate=request.rate,
                cycles=request.cycles,
                shape=request.shape,
                around=request.around,
                start=request.start,
            )
            lead_in, reversals = 0, 2 * request.cycles + 1
        else:
            made = mh.signals.excitation(
                low,
                high,
                slew=request.slew,
                rate=request.rate,
                cycles=request.cycles,
                shape=request.shape,
                around=request.around,
                start=request.start,
            )
            values, lead_in, reversals = made.drive, made.lead_in, made.reversals.size
    except (ValueError, TypeError) as error:
        raise CommandError(_in_terms_of_the_options(str(error))) from error
    return Drive(values, np.arange(values.size) / request.rate, lead_in, reversals)


def title(request: Request) -> str:
    """Say what the drive is for."""
    return "demagnetising sequence" if request.demagnetize else "drive to identify from"


def facts(drive: Drive, request: Request) -> list[tuple[str, str]]:
    """Name what an engineer checks before playing the file."""
    unit, values = request.quantity.unit, drive.values
    seconds = (values.size - 1) / request.rate
    pairs = [
        ("samples", f"{values.size} at {digits(request.rate)} Hz"),
        ("duration", f"{digits(seconds)} s"),
        ("range", f"{digits(float(values.min()))} to {in_unit(float(values.max()), unit)}"),
        ("start and end", in_unit(float(values[0]), unit)),
        ("largest step", _largest_step(drive, request)),
        ("reversals", f"{drive.reversals}, of them {2 * request.cycles - 1} decaying"),
    ]
    if not request.demagnetize:
        lead_in = f"{drive.lead_in} samples, {digits(drive.lead_in / request.rate)} s"
        pairs.append(("until the memory is known", lead_in))
    return pairs


def _largest_step(drive: Drive, request: Request) -> str:
    unit = request.quantity.unit
    step = float(np.abs(np.diff(drive.values)).max())
    speed = f"{digits(step * request.rate)} {unit}/s" if unit else digits(step * request.rate)
    return f"{in_unit(step, unit)} a sample, {speed}"


def _next(drive: Drive, request: Request) -> str:
    if request.demagnetize:
        low, high = request.limits
        around = 0.5 * (low + high) if request.around is None else request.around
        return (
            "play it: it forgets what it did, and starts as a model does whose input offset is "
            f"{in_unit(around, request.quantity.unit)}"
        )
    return (
        "play it, record the displacement beside it at the same rate, then\n"
        f"mpi-hyst identify RECORD.csv --input {request.column} --output COLUMN "
        f"--skip {drive.lead_in} --operators {request.cycles} -o stage.json"
    )


def _in_terms_of_the_options(message: str) -> str:
    argument, _, rest = message.partition(": ")
    if argument in ("low", "high"):
        return f"--limits: {argument}: {rest}"
    return f"--{argument}: {rest}" if re.fullmatch("[a-z]+", argument) else message
