"""`mpi-hyst identify`: records in, a model and a report out."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import click
from mpi_hyst_command.interrupted import STATUS

import mpi_hyst as mh
from mpi_hyst._cli.identify_records import Files, read
from mpi_hyst._cli.options import (
    asked,
    command,
    creep,
    dead_time,
    flag,
    input_offset,
    limits,
    option,
    passed,
    ratios,
    slew,
    smoothness,
    thresholds,
    whole,
    word_or,
)
from mpi_hyst._cli.outputs import Output, write_outputs
from mpi_hyst._cli.stage import name_options
from mpi_hyst._cli.terminal import (
    CommandError,
    Progress,
    command_line,
    note,
    parameter,
    progress_bar,
    renamed,
    require_report_packages,
    say,
    without_record,
)
from mpi_hyst._files import write_file
from mpi_hyst._quantity import Quantity
from mpi_hyst._report import identify as page
from mpi_hyst._report.page import Provenance, hashed_file, made_with
from mpi_hyst._report.records import Records, Task, loops_left_out
from mpi_hyst._report.summary import summary
from mpi_hyst._text import digits, printable

Kind = Literal["modified", "conventional"]
Maps = Literal["auto", "none", "smooth"]

_IDENTIFY = ("identify",)
_FIT = ("identify", "compare")


def _number(context: click.Context, option: click.Parameter, value: str | None) -> int | str | None:
    """Read a small number, or a word."""
    del context, option
    return int(value) if value is not None and value.isdigit() else value


@dataclass(frozen=True)
class Request(Files):
    """The files, what is fitted, and what is made of it."""

    model: Kind = option(
        passed=_IDENTIFY, default="modified", help="Model of coupled plays, or of plays."
    )
    operators: int | Literal["auto"] | None = option(
        passed=_FIT,
        metavar="NUMBER|auto",
        show_default="20, or 40 or 80 where these predict better",
        **word_or(("auto",), "a whole number from 1 on", whole),
        help="Number of operators. auto: the smallest of 4 to 80 whose cross-validation error is "
        "as good as the best.",
    )
    weights: Literal["auto", "free", "quadratic", "split"] = option(
        passed=_FIT,
        default="auto",
        help="Law of the weights. free: each w >= 0. quadratic: four parameters. split: other "
        "weights below zero than above. auto: the simplest whose cross-validation error is as "
        "good as the best; free in place of quadratic where more operators need that.",
    )
    smoothness: float | Literal["auto"] = smoothness(passed=_FIT)
    loss: Literal["auto", "squares", "robust"] | None = option(
        passed=_FIT,
        help="What glitches of the position do to the fit. auto: samples that lie far from those "
        "about them, up to 25 in a row, are left out. squares: all samples count. robust: nearer "
        "ones are left out, too.  [default: auto]",
    )
    thresholds: Literal["uniform", "quantiles", "geometric"] = thresholds(passed=_FIT)
    ratios: tuple[float, float, float] | Literal["fit"] | None = ratios(
        passed=_FIT,
        help="Ratios ra/r, rb/r, rc/r of the coupled plays; fit: to be found.  "
        "[default: plays, 1,1,1, or fit where that predicts better]",
    )
    input_offset: float | None = input_offset(passed=_FIT)
    dead_time: float | None = dead_time(passed=_FIT)
    dynamics: int | Literal["auto", "none"] | None = option(
        passed=_FIT,
        type=click.Choice(["auto", "none", "1", "2"]),
        callback=_number,
        help="Linear dynamics of this order. auto: second order, or first in the place of an "
        "overdamped one that is not told from it, if the records tell them.  [default: auto]",
    )
    modes: int | Literal["auto"] | None = option(
        passed=_FIT,
        type=click.Choice(["auto", "1", "2", "3"]),
        callback=_number,
        help="Number of modes in parallel of second-order dynamics. auto: as many as the records "
        "tell.  [default: auto]",
    )
    creep: int | Literal["auto", "none", "log"] | None = creep(passed=_FIT)
    loop_shift: float | Literal["auto", "none"] | None = option(
        passed=_FIT,
        metavar="SECONDS|auto|none",
        **word_or(("auto", "none"), "a time constant in seconds", float),
        help="Movement of the centre of a loop with its amplitude, with this time constant. auto: "
        "if cross-validation asks for it.  [default: auto]",
    )
    relaxing_plays: Literal["auto", "fit", "none"] | None = option(
        passed=_FIT,
        help="Plays that follow within a time of their own: loops whose width depends on the rate. "
        "auto: if cross-validation asks for it.  [default: auto]",
    )
    slow_gain: float | Literal["auto", "fit", "none"] | None = option(
        passed=_FIT,
        metavar="SECONDS|auto|fit|none",
        **word_or(("auto", "fit", "none"), "a time constant in seconds", float),
        help="Change of the size of all loops while the drive cycles, with this time constant, or "
        "with one that is searched. auto: of 30 s if cross-validation asks for it.  "
        "[default: auto]",
    )
    duhem: Literal["auto", "fit", "none"] | None = option(
        passed=_FIT,
        help="Duhem operator beside the plays. auto: if cross-validation asks for it.  "
        "[default: auto]",
    )
    amplifier: float | Literal["auto", "none"] | None = option(
        passed=_FIT,
        metavar="HZ|auto|none",
        **word_or(("auto", "none"), "a bandwidth in Hz", float),
        help="Amplifier of this bandwidth in front of the hysteresis, beside --dynamics 2 or none. "
        "auto: one that is fitted, if the records tell its lag from a dead time or dynamics.  "
        "[default: auto]",
    )
    input_map: Maps | None = option(
        passed=_FIT,
        help="Smooth map of the drive in front of the hysteresis. auto: if cross-validation asks "
        "for it.  [default: auto]",
    )
    output_map: Maps | None = option(
        passed=_FIT,
        help="Smooth map of the position behind the hysteresis. auto: if cross-validation asks for "
        "it; see the finding map_not_told.  [default: auto]",
    )
    compare: bool = flag(
        help="Compare models: conventional, polynomial + plays, modified, and modified with each "
        "extension. Each is judged on held-out stretches of the fitted rows; the table and the "
        "report show what each buys."
    )
    limits: tuple[float, float] | None = limits("none", passed=("stage",))
    slew: float | None = slew("none", passed=("stage",))
    keep_partial: bool = flag(help="On Ctrl-C write the best fit so far, marked as partial.")
    strict: bool = flag(
        help="Exit with status 1 if the verdict is amber or red. The files are written all the "
        "same."
    )
    units: Mapping[str, str] = field(default_factory=dict)
    """The units of the columns that the first file states, known once it is read."""

    @property
    def input(self) -> Quantity:
        """The drive."""
        return Quantity(self.input_column, self.units.get(self.input_column, ""))

    @property
    def output(self) -> Quantity:
        """The displacement."""
        return Quantity(self.output_column, self.units.get(self.output_column, ""))

    @property
    def fit(self) -> dict[str, Any]:
        """What goes to `mh.identify` under its own name."""
        return passed(self, "identify")

    def task(self, records: Records) -> Task:
        """Return what the reports need to know about the request."""
        given = [name.replace("_", " ") for name, value in self.fit.items() if value != "fit"]
        return Task(records, self.input, self.output, given)

    def check(self) -> None:
        """Refuse options that contradict each other, and outputs that cannot be written."""
        super().check()
        if self.model == "conventional" and self.ratios is not None:
            raise CommandError("--ratios: the conventional model has no ratios")
        if self.model == "conventional" and self.weights == "split":
            raise CommandError("--weights: the conventional model has no split weights")
        try:
            # The stage of a fit is made after the work; any hysteresis shows now what it refuses.
            mh.Stage(mh.PrandtlIshlinskii([1.0], [0.0]), **passed(self, "stage"))
        except (ValueError, TypeError) as error:
            raise CommandError(name_options(error)) from error


@command(Request)
def identify(request: Request) -> int:
    """Fit a stage to measured records in files: CSV, MATLAB, HDF5, and others; see `look`.

    The stage is written with -o: hysteresis, maps, dead time, dynamics, amplifier, creep and loop
    shift as far as the records tell them, and the limits and slew rate of its drive if they are
    given. A record must start from rest, or its start must be skipped with --skip. The first line
    is the verdict on the result: green, amber or red. Ctrl-C writes no files unless --keep-partial
    is given; the exit status is 130.
    """
    done = run(request)
    say(done.text)
    if done.interrupted:
        click.echo("mpi-hyst: interrupted, the partial result is written", err=True)
        return STATUS
    if request.strict and done.verdict != "green":
        click.echo(f"mpi-hyst: --strict: the verdict is {done.verdict}", err=True)
        return 1
    return 0


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
    for text in records.assumed:
        note(text)
    task = request.task(records)
    outputs = []
    stage = None
    # The stage is written first: if the report fails, the result of the fit is kept.
    if request.stage_path is not None:
        stage = _stage(found, records, request)
        outputs.append(Output(request.stage_path, stage.save))
    if request.report_path is not None:

        def put(place: Path) -> None:
            made = _provenance(records, request)
            text = page.report(task, found, compared, left_out, comparison, made)
            write_file(place, text)

        outputs.append(Output(request.report_path, put))
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
    options = {**asked(request, "identify"), "model": kind}
    if kind == "conventional":
        options.pop("ratios", None)
        # A split model is compared with a conventional one of free weights: that has no split.
        if options.get("weights") == "split":
            options["weights"] = "free"
    _check_time(records, request)
    ends = [record.skip for record in records.held_out] if records.ends else None
    whole = records.held_out if records.ends else records.fitted
    try:
        found = mh.identify(
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
    return found.assuming(records.doubts)


def _check_time(records: Records, request: Request) -> None:
    """Refuse files without times for what is fitted or given in seconds."""
    if records.dt is not None:
        return
    timed = ("creep", "loop_shift", "relaxing_plays", "slow_gain", "amplifier")
    for name in ("dead_time", "dynamics", "modes", *timed):
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
    return stage.replace(units=units, **passed(request, "stage")).with_records(sources)


def _provenance(records: Records, request: Request) -> Provenance:
    """Return how the report is made; the stage has been written before."""
    data = [(one.name, one.sha256) for one in (*records.fitted, *records.held_out)]
    stage = None if request.stage_path is None else hashed_file(request.stage_path)
    return made_with(command_line(), data, stage)


def _compare_models(records: Records, request: Request) -> mh.results.Comparison | None:
    """Compare models on the fitted rows; with --keep-partial, Ctrl-C omits it."""
    options = asked(request, "compare")
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
