"""`mpi-hyst excite`: a drive for identification or demagnetization as a CSV file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import mpi_hyst as mh
from mpi_hyst._cli.errors import CommandError, parameter, renamed
from mpi_hyst._cli.outputs import Output, check_outputs, write_outputs
from mpi_hyst._cli.terminal import require_report_packages
from mpi_hyst._csv import write_table
from mpi_hyst._quantity import Quantity
from mpi_hyst._report.excite.drive import Drive, facts
from mpi_hyst._text import in_unit, printable, text_pairs

_TIME = "time_s"
_OPTIONS = ("slew", "rate", "cycles", "shape", "center", "start")


@dataclass(frozen=True)
class Request:
    """The options, by their names."""

    limits: tuple[float, float]
    rate: float
    slew: float
    drive_path: Path
    cycles: int = 20
    shape: Literal["triangle", "sine"] = "triangle"
    center: float | None = None
    start: float | None = None
    demagnetize: bool = False
    column: str = "voltage_v"
    report_path: Path | None = None


def run(request: Request) -> str:
    """Design the drive, write it, and return the summary."""
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
    return f"{what}\n\n{_next_step(drive, request)}"


def design(request: Request) -> Drive:
    """Make the drive."""
    options: dict[str, Any] = {name: getattr(request, name) for name in _OPTIONS}
    try:
        if request.demagnetize:
            values = mh.signals.demagnetize(*request.limits, **options)
            initialization_samples, reversals = 0, 2 * request.cycles + 1
        else:
            made = mh.signals.excitation(*request.limits, **options)
            values, reversals = made.drive, made.reversals.size
            initialization_samples = made.initialization_samples
    except (ValueError, TypeError) as error:
        raise CommandError(_name_options(error)) from error
    return Drive(
        values,
        Quantity(request.column),
        request.rate,
        request.slew,
        request.cycles,
        initialization_samples,
        reversals,
        request.demagnetize,
    )


def _next_step(drive: Drive, request: Request) -> str:
    if request.demagnetize:
        low, high = request.limits
        center = 0.5 * (low + high) if request.center is None else request.center
        return (
            "Next: play it. The actuator is then in the state in which a model with the input "
            f"offset {in_unit(center, drive.quantity.unit)} starts."
        )
    return (
        "Next: play it and record the position at the same rate, then\n"
        f"mpi-hyst identify RECORD.csv --input {request.column} --output COLUMN "
        f"--skip {drive.initialization_samples} --operators {request.cycles} -o stage.json"
    )


def _name_options(error: Exception) -> str:
    """Return the message of the library with the option in front, or in place of the argument."""
    argument = parameter(error)
    if argument in ("low", "high"):
        return f"--limits: {error}"
    return renamed(str(error), argument, f"--{argument}") if argument in _OPTIONS else str(error)
