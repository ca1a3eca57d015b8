"""`mpi-hyst identify`: records in, a model and a report out."""

from __future__ import annotations

import re
from collections.abc import Sequence

import mpi_hyst as mh
from mpi_hyst._cli.errors import CommandError
from mpi_hyst._cli.identify.read import read
from mpi_hyst._cli.identify.request import Kind, Request
from mpi_hyst._cli.outputs import Output, write_file, write_outputs
from mpi_hyst._cli.progress import Progress, progress_bar
from mpi_hyst._cli.terminal import require_report_packages
from mpi_hyst._report.identify.records import Records
from mpi_hyst._report.identify.summary import summary
from mpi_hyst._text import printable


def run(request: Request) -> tuple[str, bool]:
    """Fit and write; return the summary, and whether Ctrl-C ended the work early."""
    request.check()
    if request.report_path is not None:
        require_report_packages("--report")
    records = read(request)
    with progress_bar("fitting", request.output.unit) as progress:
        found = fit(records, request, progress)
    left_out = loops_left_out(records, found)
    interrupted = found.partial
    compared = None
    if request.report_path is not None and not found.partial:
        compared = _compare(records, request)
        interrupted = compared is None
    task = request.task(records)
    outputs = []
    # The stage is written first: if the report fails, the result of the fit is kept.
    if request.stage_path is not None:
        outputs.append(Output(request.stage_path, _stage(found, records, request).save))
    if request.report_path is not None:
        from mpi_hyst._report.identify.page import report

        outputs.append(
            Output(
                request.report_path,
                lambda place: write_file(place, report(task, found, compared, left_out)),
            )
        )
    write_outputs(outputs)
    return f"{summary(task, found, left_out)}\n\n{_saved(found, request)}", interrupted


def fit(
    records: Records, request: Request, progress: Progress, model: Kind | None = None
) -> mh.results.Identification:
    """Fit the model that was asked for, or the other kind for comparison."""
    kind = model or request.model
    options = request.fit | {"model": kind}
    if kind == "conventional":
        options.pop("ratios", None)
        # A split model is compared with a conventional one of free weights: that has no split.
        if options.get("weights") == "split":
            options["weights"] = "free"
    _check_dead_time(options.get("dead_time", 0.0), records)
    ends = [record.skip for record in records.held_out] if records.ends else None
    whole = records.held_out if records.ends else records.fitted
    try:
        return mh.identify(
            [(record.input, record.output) for record in whole],
            dt=records.dt,
            skip=[record.skip for record in records.fitted],
            validate=records.validate if ends is None else ends,
            progress=progress,
            # A partial fit of the other kind would be no fair comparison.
            keep_partial=request.keep_partial and model is None,
            **options,
        )
    except (ValueError, TypeError) as error:
        raise CommandError(_name_options(str(error), request)) from error


def _check_dead_time(seconds: float, records: Records) -> None:
    if seconds != 0.0 and records.dt is None:
        name = records.fitted[0].name
        raise CommandError(f"{name}: --dead-time needs a time column (--time) or --rate")


def _stage(found: mh.results.Identification, records: Records, request: Request) -> mh.Stage:
    """Return the stage with units and with the names and SHA-256 of its records."""
    units = (request.input.suffix or "V", request.output.suffix or "um")
    sources = [(printable(record.name), record.sha256) for record in records.fitted]
    return found.stage.replace(units=units).with_records(sources)


def loops_left_out(
    records: Records, found: mh.results.Identification
) -> Sequence[mh.results.LeftOutLoop]:
    """Predict every loop from a fit to the others; empty if there is only one loop."""
    try:
        return found.leave_one_loop_out(
            [(record.input, record.output) for record in records.fitted],
            skip=[record.skip for record in records.fitted],
        )
    except ValueError as error:
        if str(error).startswith("records: expected at least two loops"):
            return []
        raise


def _compare(records: Records, request: Request) -> mh.results.Identification | None:
    """Fit the other kind of model; with --keep-partial, Ctrl-C omits it."""
    other: Kind = "modified" if request.model == "conventional" else "conventional"
    try:
        with progress_bar("comparing", request.output.unit) as progress:
            return fit(records, request, progress, other)
    except KeyboardInterrupt:
        if request.keep_partial:
            return None
        raise


def _saved(found: mh.results.Identification, request: Request) -> str:
    lines = []
    if request.stage_path is None:
        lines.append("not saved: add -o stage.json to save the stage")
    else:
        lines.append(f"stage   {request.stage_path}{_left_out(found)}")
    if request.report_path is not None:
        lines.append(f"report  {request.report_path}")
    return "\n".join(lines)


def _left_out(found: mh.results.Identification) -> str:
    """Say what the stage lacks: its time is in seconds, also where that of the records is not."""
    if found.dead_time is None and found.dead_time_samples:
        return "  (without the dead time: its records have no time column and no --rate)"
    return ""


def _name_options(message: str, request: Request) -> str:
    """Name files, columns and options in a message of the library, which names arguments."""
    paths = request.data
    if message.startswith("validate: "):
        paths, message = request.validate or paths, message.removeprefix("validate: ")
    if match := re.match(r"record (\d+): ", message):
        paths, message = (paths[int(match[1])],), message[match.end() :]
    argument, _, rest = message.partition(": ")
    if argument in ("skip", *request.fit):
        return f"--{argument.replace('_', '-')}: {rest}"
    if argument in ("ra", "rb", "rc"):
        return f"--ratios: {message}"
    columns = {"u": request.input_column, "y": request.output_column}
    files = ", ".join(map(str, paths))
    if argument in columns:
        return f"{files}: column {columns[argument]}: {rest}"
    return f"{files}: {rest if argument == 'records' else message}"
