"""`mpi-hyst identify`: records in, a model and a report out."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Literal

import mpi_hyst as mh
from mpi_hyst._cli.errors import CommandError
from mpi_hyst._cli.identify.read import read
from mpi_hyst._cli.identify.request import Kind, Request, Weights
from mpi_hyst._cli.outputs import Output, write_file, write_outputs
from mpi_hyst._cli.progress import Progress, progress_bar
from mpi_hyst._cli.terminal import require_report_packages
from mpi_hyst._report.identify.records import Records
from mpi_hyst._report.identify.summary import summary


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
        outputs.append(Output(request.stage_path, _saver(found, request)))
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
    # A split model is compared with a conventional one of free weights: that has no split.
    unsplit = request.weights == "split" and kind == "conventional"
    weights: Weights = "free" if unsplit else request.weights
    ends = [record.skip for record in records.held_out] if records.ends else None
    whole = records.held_out if records.ends else records.fitted
    dead_time = _dead_time(request.dead_time, records)
    try:
        return mh.identify(
            [(record.input, record.output) for record in whole],
            dt=records.dt,
            model=kind,
            operators=request.operators,
            weights=weights,
            thresholds=request.thresholds,
            smoothness=request.smoothness,
            ratios=request.ratios if request.ratios and kind == "modified" else "fit",
            input_offset="fit" if request.input_offset is None else request.input_offset,
            dead_time=dead_time,
            dynamics=request.dynamics,
            creep=request.creep,
            skip=[record.skip for record in records.fitted],
            validate=records.validate if ends is None else ends,
            progress=progress,
            # A partial fit of the other kind would be no fair comparison.
            keep_partial=request.keep_partial and model is None,
        )
    except (ValueError, TypeError) as error:
        raise CommandError(_name_options(str(error), request)) from error


def _dead_time(seconds: float | None, records: Records) -> float | Literal["fit"]:
    """Return the dead time as the library takes it."""
    if seconds is None:
        return "fit"
    if seconds != 0.0 and records.dt is None:
        name = records.fitted[0].name
        raise CommandError(f"{name}: --dead-time needs a time column (--time) or --rate")
    return seconds


def _saver(found: mh.results.Identification, request: Request) -> Callable[[Path], object]:
    """Return the function that writes the stage, or without sampling interval the hysteresis."""
    if not found.dt:
        return found.model.save
    units = (request.input.suffix or "V", request.output.suffix or "um")
    return found.stage.replace(units=units).save


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
    elif found.dt:
        lines.append(f"stage   {request.stage_path}")
    else:
        lines.append(f"model   {request.stage_path}  (hysteresis alone: no sampling interval)")
    if request.report_path is not None:
        lines.append(f"report  {request.report_path}")
    return "\n".join(lines)


def _name_options(message: str, request: Request) -> str:
    """Name files, columns and options in a message of the library, which names arguments."""
    paths = request.data
    if message.startswith("validate: "):
        paths, message = request.validate or paths, message.removeprefix("validate: ")
    if match := re.match(r"record (\d+): ", message):
        paths, message = (paths[int(match[1])],), message[match.end() :]
    argument, _, rest = message.partition(": ")
    named = ("operators", "skip", "ratios", "input_offset", "smoothness", "dead_time", "creep")
    if argument in (*named, "dynamics"):
        return f"--{argument.replace('_', '-')}: {rest}"
    if argument in ("ra", "rb", "rc"):
        return f"--ratios: {message}"
    columns = {"u": request.input_column, "y": request.output_column}
    files = ", ".join(map(str, paths))
    if argument in columns:
        return f"{files}: column {columns[argument]}: {rest}"
    return f"{files}: {rest if argument == 'records' else message}"
