"""`mpi-hyst identify`: records in, a model and a report out."""

from __future__ import annotations

import re
from collections.abc import Sequence

import mpi_hyst as mh
from mpi_hyst._errors import CommandError
from mpi_hyst._identify_records import Records, read
from mpi_hyst._identify_request import Kind, Request, Weights
from mpi_hyst._identify_summary import summary
from mpi_hyst._outputs import Output, write_outputs
from mpi_hyst._progress import Progress, progress_bar


def run(request: Request) -> tuple[str, bool]:
    """Fit, write what was asked for; return the summary, and whether Ctrl-C cut the work short."""
    request.check()
    if request.report_path is not None:
        from mpi_hyst._report import require

        require("--report")
    records = read(request)
    with progress_bar("fitting", request.output.unit) as progress:
        found = fit(records, request, progress)
    left_out = loops_left_out(records, found)
    outputs, interrupted = [], found.partial
    if request.report_path is not None:
        from mpi_hyst._identify_report import report

        compared = None if found.partial else _compare(records, request)
        interrupted = compared is None
        page = report(records, found, compared, left_out, request)
        outputs.append(Output.of_text(request.report_path, page))
    if request.model_path is not None:
        outputs.append(Output(request.model_path, found.model.save))
    write_outputs(outputs)
    return f"{summary(records, found, left_out, request)}\n\n{_saved(request)}", interrupted


def fit(
    records: Records, request: Request, progress: Progress, model: Kind | None = None
) -> mh.Identification:
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


def loops_left_out(records: Records, found: mh.Identification) -> Sequence[mh.LeftOutLoop]:
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


def _compare(records: Records, request: Request) -> mh.Identification | None:
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
    if argument in ("operators", "delay", "skip", "ratios", "input_offset"):
        return f"--{argument.replace('_', '-')}: {rest}"
    if argument in ("ra", "rb", "rc"):
        return f"--ratios: {message}"
    columns = {"u": request.input_column, "y": request.output_column}
    files = ", ".join(map(str, paths))
    if argument in columns:
        return f"{files}: column {columns[argument]}: {rest}"
    return f"{files}: {rest if argument == 'records' else message}"
