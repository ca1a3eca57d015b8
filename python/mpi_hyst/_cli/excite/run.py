"""`mpi-hyst excite`: the drive to identify from, or to demagnetise with, as a CSV to be played."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import mpi_hyst as mh
from mpi_hyst._cli.errors import CommandError
from mpi_hyst._cli.outputs import Output, check_outputs, write_outputs
from mpi_hyst._cli.terminal import require_report_packages
from mpi_hyst._csv import write_table
from mpi_hyst._quantity import Quantity
from mpi_hyst._report.excite.drive import Drive, facts
from mpi_hyst._text import in_unit, printable, text_pairs

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


def run(request: Request) -> str:
    """Design the drive, write it, and return what there is to know about it."""
    check_outputs([request.drive_path, request.report_path])
    if request.column in ("", _TIME):
        raise CommandError(f"--column: expected a name other than {_TIME}, got {request.column!r}")
    if request.column != printable(request.column).strip():
        raise CommandError(f"--column: expected a printable name, got {request.column!r}")
    if request.report_path is not None:
        require_report_packages("--report")
    drive = design(request)
    table = write_table({_TIME: drive.seconds, request.column: drive.values})
    outputs = [Output.of_text(request.drive_path, table)]
    if request.report_path is not None:
        from mpi_hyst._report.excite.page import report

        page = report(drive, request.drive_path.name)
        outputs.append(Output.of_text(request.report_path, page))
    write_outputs(outputs)
    what = f"{request.drive_path}: {drive.title}\n\n{text_pairs(facts(drive))}"
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
                center=request.around,
                start=request.start,
            )
            initialization_samples, reversals = 0, 2 * request.cycles + 1
        else:
            made = mh.signals.excitation(
                low,
                high,
                slew=request.slew,
                rate=request.rate,
                cycles=request.cycles,
                shape=request.shape,
                center=request.around,
                start=request.start,
            )
            values, initialization_samples, reversals = made.drive, made.initialization_samples, made.reversals.size
    except (ValueError, TypeError) as error:
        raise CommandError(_in_terms_of_the_options(str(error))) from error
    return Drive(
        values,
        request.quantity,
        request.rate,
        request.slew,
        request.cycles,
        initialization_samples,
        reversals,
        request.demagnetize,
    )


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
        f"--skip {drive.initialization_samples} --operators {request.cycles} -o stage.json"
    )


def _in_terms_of_the_options(message: str) -> str:
    argument, _, rest = message.partition(": ")
    if argument in ("low", "high"):
        return f"--limits: {argument}: {rest}"
    return f"--{argument}: {rest}" if re.fullmatch("[a-z]+", argument) else message
