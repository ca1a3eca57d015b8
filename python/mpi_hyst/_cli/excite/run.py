"""`mpi-hyst excite`: the drives of an experiment, or a demagnetizing sequence, as CSV files."""

from __future__ import annotations

from pathlib import Path

import mpi_hyst as mh
from mpi_hyst._cli.command_line import command_line
from mpi_hyst._cli.errors import CommandError
from mpi_hyst._cli.excite.request import TIME, Request
from mpi_hyst._cli.outputs import Output, check_directory, check_outputs, write_outputs
from mpi_hyst._cli.terminal import require_report_packages
from mpi_hyst._csv import write_table
from mpi_hyst._report import provenance
from mpi_hyst._report.excite.drive import Drive, facts
from mpi_hyst._report.excite.plan import Part, Plan
from mpi_hyst._text import in_unit, text_pairs
from mpi_hyst._types import Samples


def run(request: Request) -> str:
    """Design the drives, write them, and return the summary."""
    request.check()
    return _demagnetize(request) if request.demagnetize else _experiment(request)


def _experiment(request: Request) -> str:
    directory = None if request.single_file else request.out
    report_path = request.report_path
    if directory is not None and report_path is None:
        report_path = directory / "plan.html"
    paths = _check_places(request, directory, report_path)
    plan = _plan(request)
    outputs = [
        _table(path, part.seconds, request.column, part.drive)
        for path, part in zip(paths, plan.parts, strict=True)
    ]
    if directory is not None:
        outputs.append(Output.of(directory / "plan.json", plan.as_json()))
    if report_path is not None:
        from mpi_hyst._report.excite.plan_page import report

        outputs.append(Output.of(report_path, report(plan, provenance.rows(command_line()))))
    write_outputs(outputs, directory)
    return plan.as_text([str(output.path) for output in outputs])


def _check_places(request: Request, directory: Path | None, report_path: Path | None) -> list[Path]:
    """Refuse files that cannot be written, and return those for the drives."""
    if report_path is not None:
        what = "--report" if request.report_path is not None else "the plan in a directory"
        require_report_packages(what)
    if directory is None:
        check_outputs([request.out, report_path])
        return [request.out]
    check_directory(directory)
    drives = [directory / "fast.csv", directory / "loops.csv"]
    own = [*drives, directory / "plan.json"]
    if report_path in own:
        raise CommandError(f"{report_path}: named for two outputs")
    # What lies in a directory that is yet to be made has nothing in its way.
    outputs = [path for path in (*own, report_path) if path is not None]
    check_outputs([path for path in outputs if directory.exists() or path.parent != directory])
    return drives


def _plan(request: Request) -> Plan:
    try:
        made = mh.signals.experiment(
            *request.limits, joined=request.single_file, **request.of_experiment()
        )
    except (ValueError, TypeError) as error:
        raise request.explain(error) from error
    names = [request.out.name] if request.single_file else [f"{one.name}.csv" for one in made]
    parts = [Part.of(name, one) for name, one in zip(names, made, strict=True)]
    return Plan(
        parts,
        request.quantity,
        request.limits,
        request.slew,
        request.cycles,
        request.center,
        request.start,
    )


def _demagnetize(request: Request) -> str:
    check_outputs([request.out, request.report_path])
    if request.report_path is not None:
        require_report_packages("--report")
    try:
        values = mh.signals.demagnetize(*request.limits, **request.shared())
    except (ValueError, TypeError) as error:
        raise request.explain(error) from error
    drive = Drive(values, request.quantity, request.rate, request.slew, request.cycles)
    outputs = [_table(request.out, drive.seconds, request.column, drive.values)]
    if request.report_path is not None:
        from mpi_hyst._report.excite.page import report

        outputs.append(
            Output.of(
                request.report_path,
                report(drive, request.out.name, provenance.rows(command_line())),
            )
        )
    write_outputs(outputs)
    low, high = request.limits
    center = 0.5 * (low + high) if request.center is None else request.center
    return (
        f"{request.out}: demagnetizing sequence\n\n{text_pairs(facts(drive))}\n\n"
        "Next: play it. The actuator is then in the state in which a model with the input "
        f"offset {in_unit(center, drive.quantity.unit)} starts."
    )


def _table(path: Path, seconds: Samples, column: str, drive: Samples) -> Output:
    return Output.of(path, write_table({TIME: seconds, column: drive}))
