"""`mpi-hyst identify`: records in, a model and a report out."""

from __future__ import annotations

import re
from collections.abc import Sequence

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
    """Fit, write what was asked for; return the summary, and whether Ctrl-C cut the work short."""
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
    # The model comes first: whatever happens to the report, the result of the work is kept.
    if request.model_path is not None:
        outputs.append(Output(request.model_path, found.model.save))
    if request.report_path is not None:
        from mpi_hyst._report.identify.page import report

        outputs.append(
            Output(
                request.report_path,
                lambda place: write_file(place, report(task, found, compared, left_out)),
            )
        )
    write_outputs(outputs)
    return f"{summary(task, found, left_out)}\n\n{_saved(request)}", interrupted


def fit(
    records: Records, request: Request, progress: Progress, model: Kind | None = None
) -> mh.results.Identification:
    """Identify the model that was asked for, or the other kind for comparison."""
    kind = model or request.model
    # Beside a split model stands the conventional one with free weights: it has no split.
    unsplit = request.weights == "split" and kind == "conventional"
    weights: Weights = "free" if unsplit else request.weights
    ends = [record.skip for record in records.held_out] if records.ends else None
    whole = records.held_out if records.ends else records.fitted
    try:
        return mh.identify(
            [(record.input, record.output) for record in whole],
            model=kind,
            operators=request.operators,
            weights=weights,
            thresholds=request.thresholds,
            smoothness=request.smoothness,
            ratios=request.ratios if request.ratios and kind == "modified" else "fit",
            input_offset="fit" if request.input_offset is None else request.input_offset,
            delay="fit" if request.delay is None else request.delay,
            skip=[record.skip for record in records.fitted],
            validate=records.validate if ends is None else ends,
            progress=progress,
            # Half a comparison would be unfair to the other kind.
            keep_partial=request.keep_partial and model is None,
        )
    except (ValueError, TypeError) as error:
        raise CommandError(_in_terms_of_the_options(str(error), request)) from error


def loops_left_out(
    records: Records, found: mh.results.Identification
) -> Sequence[mh.results.LeftOutLoop]:
    """Predict every loop from the others; nothing if there are no others."""
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
    """Identify the other kind of model; with --keep-partial, Ctrl-C leaves it away."""
    other: Kind = "modified" if request.model == "conventional" else "conventional"
    try:
        with progress_bar("comparing", request.output.unit) as progress:
            return fit(records, request, progress, other)
    except KeyboardInterrupt:
        if request.keep_partial:
            return None
        raise


def _saved(request: Request) -> str:
    lines = []
    if request.model_path is None:
        lines.append("not saved: add -o stage.json to keep the model")
    else:
        lines.append(f"model   {request.model_path}  (the delay is not part of it)")
    if request.report_path is not None:
        lines.append(f"report  {request.report_path}")
    return "\n".join(lines)


def _in_terms_of_the_options(message: str, request: Request) -> str:
    """Say which file and column, or which option, the library means."""
    paths = request.data
    if message.startswith("validate: "):
        paths, message = request.validate or paths, message.removeprefix("validate: ")
    if match := re.match(r"record (\d+): ", message):
        paths, message = (paths[int(match[1])],), message[match.end() :]
    argument, _, rest = message.partition(": ")
    if argument in ("operators", "delay", "skip", "ratios", "input_offset", "smoothness"):
        return f"--{argument.replace('_', '-')}: {rest}"
    if argument in ("ra", "rb", "rc"):
        return f"--ratios: {message}"
    columns = {"u": request.input_column, "y": request.output_column}
    files = ", ".join(map(str, paths))
    if argument in columns:
        return f"{files}: column {columns[argument]}: {rest}"
    return f"{files}: {rest if argument == 'records' else message}"
