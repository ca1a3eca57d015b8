"""`mpi-hyst precompensate`: a stage and a trajectory in, the drive out."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import mpi_hyst as mh
from mpi_hyst._cli.inputs import (
    assumed_of,
    clock_column,
    known_interval,
    sampling_interval,
    trajectory,
)
from mpi_hyst._cli.options import (
    Sampled,
    argument,
    command,
    flags,
    group,
    lead_in,
    limits,
    numbers,
    option,
    passed,
)
from mpi_hyst._cli.outputs import Output, check_outputs, write_outputs, write_table
from mpi_hyst._cli.stage import (
    StageOptions,
    check_unit,
    is_static,
    load_stage,
    name_options,
    of_stage,
    refusing,
    say_red,
    say_steady,
    why_narrowed,
)
from mpi_hyst._cli.terminal import CommandError, note, say
from mpi_hyst._quantity import Quantity, drive_with_unit, stated_unit
from mpi_hyst._report.models import linear_parts
from mpi_hyst._text import in_unit, span, text_pairs, without_noise
from mpi_hyst._types import Samples
from mpi_hyst.io import Columns

_MAX_MISS = 5e-3
"""Share of the range of a trajectory by which the stage itself may miss it without a warning."""
_ROUNDING = 1e-9
_PASSED = ("precompensate",)


@dataclass(frozen=True)
class Request:
    """The stage, the trajectory, and the state before it."""

    stage_path: Path = argument("STAGE.json")
    trajectory: Path = argument("TRAJECTORY.csv")
    drive_path: Path = option(
        "-o", required=True, help="Drive to write (CSV), with columns such as time_s and drive."
    )
    sampled: Sampled = group(Sampled, what="trajectory")
    limits: tuple[float, float] | None = limits(
        "those of the stage, as far as its records reach", passed=_PASSED
    )
    start: float | None = option(
        passed=_PASSED,
        metavar="V",
        help="Drive at which the stage has rested, virgin but for the way there.  "
        "[default: 0, or the limit nearest to it]",
    )
    history: tuple[float, ...] | None = option(
        passed=_PASSED,
        **numbers("V,V,..."),
        help="Drives since that rest, oldest first: 0,150,0 after a full stroke from 0 to 150 V.",
    )
    lead_in: float | None = lead_in("trajectory", passed=_PASSED)
    temperature: str | None = option(
        metavar="COLUMN",
        help="Column of TRAJECTORY.csv that is the temperature, for a stage that follows one.  "
        "[default: it stays at the reference of the stage]",
    )
    stage: StageOptions = group(StageOptions)


@command(Request)
def precompensate(request: Request) -> None:
    """Compute the drive for which a stage follows a trajectory.

    STAGE.json is a stage or a model written by identify. Dynamics, creep and dead time of the
    stage are inverted, then the hysteresis, exactly. Without --lead-in the trajectory must begin
    where the stage is: at rest and virgin, unless --history says how it was driven before.
    """
    say(run(request))


def run(request: Request) -> str:
    """Compute the drive, write it, and return the summary."""
    check_outputs([request.drive_path], [request.stage_path, request.trajectory])
    stage = load_stage(request.stage_path, request.stage)
    say_red(request.stage_path, stage)
    if request.temperature is not None and stage.temperature is None:
        raise CommandError(
            f"--temperature: expected none, as {request.stage_path} follows no temperature, "
            f"got {request.temperature}"
        )
    columns, column = trajectory(request.trajectory, request.sampled, beside=request.temperature)
    dt = _interval(columns, stage, request)
    quantity = columns.quantity(column)
    check_unit(str(request.trajectory), quantity, stage)
    assumed = assumed_of(columns, column, stated_unit(stage.units[1]), request.sampled)
    quantity = of_stage(quantity, stage)
    _refuse_drive(columns, quantity)
    warmth = _Warmth.of(stage, columns, column, dt, request.temperature)
    drive, residual, within, notes = _design(
        stage, columns[column], warmth, dt, quantity.unit, request
    )
    table = {drive_with_unit(stage.units[0]): drive}
    is_timed = columns.time_column is not None or request.sampled.rate is not None
    if is_timed:
        time, times = clock_column(columns, drive.size, drive.size - residual.size, dt)
        table = {time: times, **table}
    for text in assumed:
        note(text)
    if request.temperature is None:
        say_steady(request.stage_path, stage, "; --temperature COLUMN says otherwise")
    write_outputs([Output.of(request.drive_path, write_table(table))])
    rate = f" at {1.0 / dt:.6g} Hz" if is_timed else ""
    summary = _summary(request, stage, quantity, warmth, drive, residual, within, rate)
    return "\n".join([summary, *notes])


@dataclass(frozen=True)
class _Warmth:
    """The temperature along a trajectory, and what it adds to the position; None without one."""

    temperature: Samples | None
    added: Samples
    text: str = ""

    @classmethod
    def of(
        cls, stage: mh.Stage, columns: Columns, column: str, dt: float, name: str | None
    ) -> _Warmth:
        """Return the column of this name; without a name the reference of the stage."""
        samples, term = columns[column].size, stage.temperature
        if term is None:
            return cls(None, np.zeros(samples))
        if name is None:
            return cls(np.full(samples, term.reference), np.zeros(samples))
        if columns.key(name) in (column, columns.time_column):
            expected = "another column than target and time"
            raise CommandError(f"--temperature: expected {expected}, got {columns.key(name)}")
        temperature = columns[name]
        added = term.response(temperature, dt)
        spans = (
            span(float(values.min()), float(values.max()), unit)
            for values, unit in (
                (temperature, columns.quantity(name).suffix),
                (added, stage.units[1]),
            )
        )
        text = f"{', which adds '.join(spans)}; nothing at {term.reference:g}"
        return cls(temperature, added, text)


def _refuse_drive(columns: Columns, quantity: Quantity) -> None:
    """Refuse a drive, as this command writes it, in place of a trajectory or of a time."""
    for column in (columns.time_column, quantity.column):
        if column is not None and Quantity(column).name.lower() == "drive":
            raise CommandError(
                f"{columns.source}: expected other columns than a drive, which is written, "
                f"got {column}"
            )


def _interval(columns: Columns, stage: mh.Stage, request: Request) -> float:
    """Return the sampling interval; a stage of hysteresis alone does not need to know it."""
    if is_static(stage) and stage.slew is None and request.lead_in is None:
        return known_interval(columns, request.sampled.rate) or 1.0
    return sampling_interval(columns, request.sampled.rate)


def _design(
    stage: mh.Stage,
    reference: Samples,
    warmth: _Warmth,
    dt: float,
    unit: str,
    request: Request,
) -> tuple[Samples, Samples, float | None, list[str]]:
    """Return the drive, the error of the stage itself under it, its bound, and warnings."""
    names = {**flags(Request), "reference": str(request.trajectory)}
    names["dt"] = "--rate" if request.sampled.rate is not None else names["reference"]
    with refusing(request.stage_path, names):
        drive, within, caught = _drive(stage, reference, warmth, dt, request)
        residual = _residual(stage, reference - warmth.added, drive, dt, request)
    notes = [f"warning: {name_options(one, names)}" for one in caught]
    worst = int(residual.argmax())
    # Of one row, and of a trajectory that stands, rounding is no miss.
    rounding = _ROUNDING * float(np.abs(reference).max())
    if not notes and residual[worst] > max(_MAX_MISS * np.ptp(reference), rounding):
        miss = in_unit(float(residual[worst]), unit, 3)
        notes.append(
            f"warning: {request.trajectory}: the stage misses it by up to {miss}, "
            f"at sample {worst}: it is too fast there, or needs --lead-in to begin in motion"
        )
    return drive, residual, within, notes


def _drive(
    stage: mh.Stage, reference: Samples, warmth: _Warmth, dt: float, request: Request
) -> tuple[Samples, float | None, list[Warning | str]]:
    """Return the drive, what the position misses with 95 % by no more, and warnings.

    A stage that knows no error band says nothing of the second.
    """
    given = {**passed(request, "precompensate"), "temperature": warmth.temperature}
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            drive, error = stage.precompensate(reference, dt, **given, return_error=True)
            within: float | None = error.within
    except ValueError as error:
        if getattr(error, "parameter", None) != "error_band":
            raise
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            drive, within = stage.precompensate(reference, dt, **given), None
    return drive, within, [one.message for one in caught]


def _residual(
    stage: mh.Stage, reference: Samples, drive: Samples, dt: float, request: Request
) -> Samples:
    """Return the magnitude of the error of the stage itself under this drive."""
    stream = stage.forward(dt)
    stream.settle(_start(stage, request))
    stream.follow(request.history or ())
    return np.abs(stream.run(drive)[-reference.size :] - reference)


def _start(stage: mh.Stage, request: Request) -> float:
    """Return the drive at which the stage rests before: 0, or the limit nearest to it."""
    if request.start is not None:
        return request.start
    low, high = request.limits or stage.drive_range or (0.0, 0.0)
    return min(max(0.0, low), high)


def _summary(
    request: Request,
    stage: mh.Stage,
    quantity: Quantity,
    warmth: _Warmth,
    drive: Samples,
    residual: Samples,
    within: float | None,
    rate: str,
) -> str:
    unit, _ = stage.units
    start, before = _start(stage, request), drive.size - residual.size
    last = request.history[-1] if request.history else start
    low, high = float(drive.min()), float(drive.max())
    scale = max(map(abs, (low, high, *(request.limits or stage.drive_range or ()))))
    low, high = without_noise(low, scale), without_noise(high, scale)
    step = without_noise(float(drive[0]) - last, scale)
    pairs = [
        ("samples", f"{residual.size}{rate}"),
        ("before", _before(request, start, unit)),
        *([("lead-in", f"{before} rows in front of the samples")] if before else []),
        ("stage", ", ".join(["hysteresis", *linear_parts(stage)])),
        *([("temperature", warmth.text)] if warmth.text else []),
        ("drive", span(low, high, unit)),
        ("first step", in_unit(step, unit)),
        ("limits", _limits(request, stage, drive)),
        *([] if stage.slew is None else [("slew rate", f"{stage.slew:g} {unit}/s")]),
        ("max |model - target|", in_unit(float(residual.max()), quantity.unit, 3)),
        ("position - target", _claim(within, quantity.unit)),
    ]
    title = f"{request.drive_path}: drive for {quantity.column} of {request.trajectory}"
    return f"{title}\n\n{text_pairs(pairs)}"


def _claim(within: float | None, unit: str) -> str:
    if within is None:
        return "not known: the stage has no error band"
    return f"within {in_unit(within, unit, 3)} with 95 %, the offset apart"


def _before(request: Request, start: float, unit: str) -> str:
    """Say what the stage is taken to remember."""
    rest = f"at rest at {start:g} {unit}".rstrip()
    if not request.history:
        return f"{rest}, never driven farther (--history says otherwise)"
    return (
        f"{rest}, then driven to {', '.join(f'{one:g}' for one in request.history)} {unit}".rstrip()
    )


def _limits(request: Request, stage: mh.Stage, drive: Samples) -> str:
    limits = request.limits or stage.drive_range
    if limits is None:
        return "none"
    low, high = limits
    count = int(((drive <= low) | (drive >= high)).sum())
    span = f"{low:g} to {high:g} {stage.units[0]}".rstrip()
    why = why_narrowed(stage) if count and not request.limits else ""
    return f"{span}, reached by {count} of {drive.size} samples" + (f" ({why})" if why else "")
