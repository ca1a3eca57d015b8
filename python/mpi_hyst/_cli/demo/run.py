"""`mpi-hyst demo`: a measured stack, then the actuator of the paper."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from mpi_hyst._cli.command_line import command_line
from mpi_hyst._cli.outputs import (
    Output,
    check_directory,
    check_outputs,
    write_outputs,
)
from mpi_hyst._cli.progress import progress_bar
from mpi_hyst._cli.terminal import require_report_packages
from mpi_hyst._csv import write_table
from mpi_hyst._files import write_file
from mpi_hyst._paper import stack
from mpi_hyst._paper.demo import Measurement, compute, exact, seconds
from mpi_hyst._report import provenance
from mpi_hyst._report.demo.tables import model_errors, stack_errors, tracking_errors
from mpi_hyst._text import text_table
from mpi_hyst._types import Samples

_FILES = (
    *("stack.json", "conventional.json", "modified.json"),
    *("identification.csv", "validation.csv"),
    *("trajectory.csv", "drive.csv", "report.html"),
)


def run(directory: Path) -> str:
    """Compute, write into the directory, and return the main tables."""
    check_directory(directory)
    if directory.exists():
        check_outputs([directory / name for name in _FILES])
    require_report_packages("the demo")
    from mpi_hyst._report.demo.page import report

    measured = stack.compute(progress_bar)
    demo = compute(progress_bar)
    page = report(measured, demo, directory, provenance.rows(command_line()))
    write = [
        measured.found.stage.save,
        demo.conventional.model.save,
        demo.modified.model.save,
        *(_text(_record_table(record)) for record in demo.records),
        _text(_table(demo.target, "target_um")),
        _text(_table(exact(demo).drive, "drive_v")),
        _text(page),
    ]
    outputs = [Output(directory / name, put) for name, put in zip(_FILES, write, strict=True)]
    write_outputs(outputs, directory)
    return "\n\n".join(
        [
            "measured: a piezo stack, errors of the models\n\n"
            + text_table(*stack_errors(measured)),
            "simulated: the actuator of the paper, errors of the models on the fitted record and "
            "on a validation record\n\n" + text_table(*model_errors(demo)),
            "simulated: open-loop tracking of a trajectory within ±3 µm\n\n"
            + text_table(*tracking_errors(demo)),
            "%: of the base, the peak-to-peak range of the measured, true or target position\n\n"
            f"report  {directory / 'report.html'}",
        ]
    )


def _text(text: str) -> Callable[[Path], object]:
    return lambda place: write_file(place, text)


def _record_table(record: Measurement) -> str:
    return write_table(
        {"time_s": seconds(record.drive), "drive_v": record.drive, "position_um": record.measured}
    )


def _table(values: Samples, name: str) -> str:
    return write_table({"time_s": seconds(values), name: values})
