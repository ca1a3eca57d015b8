"""`mpi-hyst identify`: records in, a model and a report out."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import mpi_hyst as mh
from mpi_hyst._cli.command_line import command_line
from mpi_hyst._cli.errors import CommandError, parameter, renamed, without_record
from mpi_hyst._cli.identify.read import read
from mpi_hyst._cli.identify.request import Kind, Request
from mpi_hyst._cli.outputs import Output, write_outputs
from mpi_hyst._cli.progress import Progress, progress_bar
from mpi_hyst._cli.terminal import require_report_packages
from mpi_hyst._files import write_file
from mpi_hyst._report import provenance
from mpi_hyst._report.identify.records import Records, loops_left_out
from mpi_hyst._report.identify.summary import summary
from mpi_hyst._text import digits, printable


@dataclass(frozen=True)
class Done:
    """What is left to say when the files are written."""

    text: str
    """The summary."""
    verdict: str
    interrupted: bool
    """Whether Ctrl-C ended the work early."""


def run(request: Request) -> Done:
    """Fit and write."""
    request.check()
    if request.report_path is not None:
        require_report_packages("--report")
    records = read(request)
    request = replace(request, units=records.units)
    with progress_bar("fitting", request.output.unit) as progress:
        found = fit(records, request, progress)
    left_out = loops_left_out(records, found)
    interrupted = found.partial
    comparison = compared = None
    if request.compare and not interrupted:
        comparison = _compare_models(records, request)
        interrupted = comparison is None
    if request.report_path is not None and not interrupted:
        compared = _fit_other(records, request)
        interrupted = compared is None
    task = request.task(records)
    outputs = []
    stage = None
    # The stage is written first: if the report fails, the result of the fit is kept.
    if request.stage_path is not None:
        stage = _stage(found, records, request)
        outputs.append(Output(request.stage_path, stage.save))
    if request.report_path is not None:
        from mpi_hyst._report.identify.page import report

        outputs.append(
            Output(
                request.report_path,
                lambda place: write_file(
                    place,
                    report(
                        *(task, found, compared, left_out, comparison),
                        _provenance(records, request),
                    ),
                ),
            )
        )
    write_outputs(outputs)
    parts = [summary(task, found, left_out)]
    if comparison is not None:
        parts.append(_told(comparison, request.output.unit))
    parts.append(_saved(found, stage, request))
    text = "\n\n".join(parts)
    return Done(text, found.verdict, interrupted)


def fit(
    records: Records, request: Request, progress: Progress, model: Kind | None = None
) -> mh.results.Identification:
    """Fit the model that was asked for, or the other kind for comparison."""
    kind = model or request.model
    options = _options(request)
    options["model"] = kind
    if kind == "conventional":
        options.pop("ratios", None)
        # A split model is compared with a conventional one of free weights: that has no split.
        if options.get("weights") == "split":
            options["weights"] = "free"
    _check_time(records, request)
    ends = [record.skip for record in records.held_out] if records.ends else None
    whole = records.held_out if records.ends else records.fitted
    try:
        return mh.identify(
            [(record.input, record.output) for record in whole],
            dt=records.intervals,
            times=[record.seconds for record in whole],
            skip=[record.skip for record in records.fitted],
            validate=records.validate if ends is None else ends,
            progress=progress,
            # A partial fit of the other kind would be no fair comparison.
            keep_partial=request.keep_partial and model is None,
            **options,
        )
    except (ValueError, TypeError) as error:
        raise CommandError(_name_options(error, request)) from error


def _options(request: Request) -> dict[str, Any]:
    """Return the options of the fit as the library takes them."""
    return {name: None if value == "none" else value for name, value in request.fit.items()}


def _check_time(records: Records, request: Request) -> None:
    """Refuse files without times for what is fitted or given in seconds."""
    if records.dt is not None:
        return
    for name in ("dead_time", "dynamics", "modes", "creep", "loop_shift", "amplifier"):
        untimed = (1 if name == "modes" else 0.0, "auto", "none")
        if request.fit.get(name, "auto") not in untimed:
            option = f"--{name.replace('_', '-')}"
            raise CommandError(
                f"{_listed(request.data)}: {option} needs a time column (--time) or --rate"
            )


def _stage(found: mh.results.Identification, records: Records, request: Request) -> mh.Stage:
    """Return the stage with units, limits, and the names and SHA-256 of its records."""
    units = (request.input.suffix or "V", request.output.suffix or "um")
    # Parts of one file have one source.
    sources = list(
        dict.fromkeys((printable(record.name), record.sha256) for record in records.fitted)
    )
    with warnings.catch_warnings():
        # The library warns of a dead time in samples, which a stage cannot hold: _left_out says it.
        warnings.simplefilter("ignore")
        stage = found.stage
    return stage.replace(units=units, **request.bench()).with_records(sources)


def _provenance(records: Records, request: Request) -> provenance.Provenance:
    """Return how the report is made; the stage has been written before."""
    data = [(one.name, one.sha256) for one in (*records.fitted, *records.held_out)]
    stage = None if request.stage_path is None else provenance.of_file(request.stage_path)
    return provenance.rows(command_line(), data, stage)


def _compare_models(records: Records, request: Request) -> mh.results.Comparison | None:
    """Compare models on the fitted rows; with --keep-partial, Ctrl-C omits it."""
    options = _options(request)
    options.pop("model", None)
    try:
        with progress_bar("comparing models", request.output.unit) as progress:
            return mh.compare(
                [(record.input, record.output) for record in records.fitted],
                dt=records.intervals,
                skip=[record.skip for record in records.fitted],
                progress=progress,
                **options,
            )
    except (ValueError, TypeError) as error:
        raise CommandError(_name_options(error, request)) from error
    except KeyboardInterrupt:
        if request.keep_partial:
            return None
        raise


def _told(comparison: mh.results.Comparison, unit: str) -> str:
    """Return the table of the comparison."""
    lines = comparison.table(unit).splitlines()
    return "\n".join(
        ["models compared on held-out stretches", "", *(f"  {line}" for line in lines)]
    )


def _fit_other(records: Records, request: Request) -> mh.results.Identification | None:
    """Fit the other kind of model; with --keep-partial, Ctrl-C omits it."""
    other: Kind = "modified" if request.model == "conventional" else "conventional"
    try:
        with progress_bar("comparing", request.output.unit) as progress:
            return fit(records, request, progress, other)
    except KeyboardInterrupt:
        if request.keep_partial:
            return None
        raise


def _saved(found: mh.results.Identification, stage: mh.Stage | None, request: Request) -> str:
    lines = []
    if stage is None:
        lines.append("not saved: add -o stage.json to save the stage")
    else:
        if stage.limits is not None and stage.is_narrowed:
            lines.append(_unreached(found, stage, stage.limits))
        lines.append(f"stage   {request.stage_path}{_left_out(found)}")
    if request.report_path is not None:
        lines.append(f"report  {request.report_path}")
    return "\n".join(lines)


def _unreached(
    found: mh.results.Identification, stage: mh.Stage, limits: tuple[float, float]
) -> str:
    """Say that the records do not fill the limits, so that drives will not either."""
    (low, high), unit = map(digits, found.drive_range), stage.units[0]
    least, most = limits
    return (
        f"note: the records reach {low} to {high} {unit} of the limits {least:g} to {most:g} "
        f"{unit}; drives stay within the records, unless `precompensate` and `simulate` get "
        f"--limits {least:g},{most:g} too"
    )


def _left_out(found: mh.results.Identification) -> str:
    """Say what the stage lacks: its time is in seconds, also where that of the records is not."""
    if found.dead_time is None and found.dead_time_samples:
        return "  (without the dead time: its records have no time column and no --rate)"
    return ""


def _name_options(error: Exception, request: Request) -> str:
    """Return the message of the library with files, columns and options in place of arguments."""
    argument, message, paths = parameter(error), str(error), request.data
    if argument == "validate":
        paths, message = request.validate or paths, message.removeprefix("validate: ")
    record, message = without_record(message)
    if record is not None:
        paths = (paths[record],)
    if argument in ("skip", *request.fit):
        return renamed(message, argument, f"--{argument.replace('_', '-')}")
    if argument in ("ra", "rb", "rc"):
        return f"--ratios: {message}"
    if argument == "dt" and request.rate is not None:
        return renamed(message, argument, "--rate")
    # A message about a record for validation names u or y as well.
    for name, column in (("u", request.input_column), ("y", request.output_column)):
        message = renamed(message, name, f"column {column}")
    return f"{_listed(paths)}: {message.removeprefix('records: ')}"


def _listed(paths: Sequence[Path]) -> str:
    return ", ".join(map(str, paths))
