"""`mpi-hyst demo`: a measured stack, then the actuator of the paper."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from mpi_hyst._cli.options import command, directory
from mpi_hyst._cli.outputs import Output, check_directory, check_outputs, write_outputs, write_table
from mpi_hyst._cli.terminal import command_line, progress_bar, require_report_packages, say
from mpi_hyst._files import write_file
from mpi_hyst._paper.demo import Measurement, compute, compute_stack, exact, seconds
from mpi_hyst._report import demo as page
from mpi_hyst._report.page import made_with
from mpi_hyst._text import text_table
from mpi_hyst._types import Samples

_FILES = (
    *("stack.json", "conventional.json", "modified.json"),
    *("identification.csv", "validation.csv"),
    *("trajectory.csv", "drive.csv", "report.html"),
)


@dataclass(frozen=True)
class Request:
    """Where the files go."""

    directory: Path = directory("mpi-hyst-demo", "the report, the models and the records")


@command(Request, short_help="Identify a measured stack and a simulated actuator.")
def demo(request: Request) -> None:
    """Fit a measured piezo stack, then the simulated actuator of the paper. Needs no data."""
    say(run(request.directory))


def run(directory: Path) -> str:
    """Compute, write into the directory, and return the main tables."""
    check_directory(directory)
    if directory.exists():
        check_outputs([directory / name for name in _FILES])
    require_report_packages("the demo")
    measured = compute_stack(progress_bar)
    demo = compute(progress_bar)
    text = page.report(measured, demo, directory, made_with(command_line()))
    write = [
        measured.found.stage.save,
        demo.conventional.model.save,
        demo.modified.model.save,
        *(_text(_record_table(record)) for record in demo.records),
        _text(_table(demo.target, "target_um")),
        _text(_table(exact(demo).drive, "drive_v")),
        _text(text),
    ]
    outputs = [Output(directory / name, put) for name, put in zip(_FILES, write, strict=True)]
    write_outputs(outputs, directory)
    return "\n\n".join(
        [
            "measured: a piezo stack, errors of the models\n\n"
            + text_table(*page.stack_errors(measured)),
            "simulated: the actuator of the paper, errors of the models on the fitted record and "
            "on a validation record\n\n" + text_table(*page.model_errors(demo)),
            "simulated: open-loop tracking of a trajectory within ±3 µm\n\n"
            + text_table(*page.tracking_errors(demo)),
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
