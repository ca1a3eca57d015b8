"""`mpi-hyst realtime`: a stage in, its loop on the clock of this machine."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import click
import numpy as np

import mpi_hyst as mh
from mpi_hyst._cli.inputs import assumed_of, interval_of_rate, known_interval
from mpi_hyst._cli.options import argument, command, flag, flags, numbers, option, passed, slew
from mpi_hyst._cli.outputs import (
    Output,
    call_at_interrupts,
    check_figure,
    check_outputs,
    write_outputs,
)
from mpi_hyst._cli.stage import StageOptions, check_unit, load_stage, refusing, say_steady
from mpi_hyst._cli.terminal import CommandError, note, one_line, require_report_packages, say
from mpi_hyst._files import write_file
from mpi_hyst._io.read import read_trajectory
from mpi_hyst._quantity import stated_unit
from mpi_hyst._report import canvas
from mpi_hyst._report.closed_loop import loop_facts, loop_times
from mpi_hyst._text import text_pairs, text_table
from mpi_hyst._types import Samples
from mpi_hyst.io import Columns

_FREQUENCY = 10.0  # Hz, of the reference that nobody gave
_RAMP = 0.5  # seconds from one limit to the other
_LONG = 10.0  # seconds, of a ramp to rest that is worth a word
_WAITS = 1.0  # seconds without a sample that are worth a word
_UNEQUAL = 1e-3  # of the interval: times are written with few digits
_FASTEST, _SLOWEST = 1e6, 0.1  # Hz
_AS_ASKED = ("time_over", "reference_over", "requested")
NOT_AS_ASKED = 3
"""The exit status when something else ended the loop, rows are missing, or the drive may be up."""
_PASSED = ("run",)


def _priority(context: click.Context, option: click.Parameter, value: str | None) -> int | None:
    """Read a priority, which must not be taken for the name of the file behind it."""
    if value is None:
        return None
    try:
        return int(value)
    except ValueError:
        message = f"expected a priority from 1 to 99, got {value!r}; "
        message += "without one put --fifo behind STAGE.json"
        raise click.BadParameter(message, context, option) from None


@dataclass(frozen=True)
class Request:
    """The stage, what its loop does, and what is written of it."""

    stage_path: Path = argument("STAGE.json")
    rate: float = option(default=10_000.0, help="Samples per second.")
    seconds: float = option(
        passed=_PASSED,
        default=10.0,
        help="When it goes to rest. Ctrl-C, SIGTERM and SIGHUP do the same.",
    )
    reference: Path | None = option(
        metavar="FILE.csv",
        help="Positions, one for each sample, followed again and again. A time column must fit "
        "--rate.  [default: a sine of 10 Hz over half of what the stage reaches]",
    )
    column: str | None = option(help="Column of the reference.  [default: the only numeric one]")
    udp: str | None = option(
        metavar="HOST:PORT",
        help="Plant that talks in datagrams; needs --local.  [default: a simulated plant]",
    )
    local: str | None = option(metavar="HOST:PORT", help="Where its measurements come in.")
    shared_memory: Path | None = option(metavar="FILE", help="Memory that the plant maps too.")
    rest: float | None = option(
        metavar="V", help="Drive at the end.  [default: 0, or nearest to it]"
    )
    rest_rate: float | None = option(
        metavar="V/s",
        help="How fast it goes there.  [default: the range of the drive in half a second]",
    )
    misses: Literal["skip", "catch_up", "stop"] = option(
        passed=_PASSED, default="skip", help="What becomes of missed deadlines."
    )
    watchdog: tuple[float, float] | None = option(
        **numbers("STALE,REST"),
        help="Seconds without a measurement until the drive is held, and until it goes to rest.  "
        "[default: 0,0.1]",
    )
    spin: float = option(
        passed=_PASSED,
        default=0.0,
        show_default=False,
        metavar="SECONDS",
        help="How long to spin before each deadline instead of sleeping.  [default: 0]",
    )
    cpu: int | None = option(passed=_PASSED, help="Processor on which the loop runs.")
    fifo: int | None = option(
        passed=_PASSED,
        type=str,
        is_flag=False,
        flag_value="80",
        metavar="PRIORITY",
        callback=_priority,
        help="SCHED_FIFO, with this priority or 80.",
    )
    mlock: bool = flag(help="Keep all memory in memory.")
    slew: float | None = slew("that of the stage, and no more")
    record_path: Path | None = option("-o", help="Record to write (npy).")
    json_path: Path | None = option("--json", help="Report to write (JSON).")
    plot_path: Path | None = option("--plot", help="Histograms to draw (PNG, SVG or PDF).")


@command(Request, short_help="Run the loop of a stage in real time.")
def realtime(request: Request) -> None:
    """Run the loop of a stage in real time, and show how late and how long its samples were.

    STAGE.json is a stage with limits, written by identify. The loop ends by a ramp to the rest
    drive within the slew rate: after --seconds, at Ctrl-C, and when measurements are missing.

    The exit status is 0 if it ended as it was asked to, and 3 if the watchdog, a missed deadline or
    input and output ended it, if the drive is not at rest or the other side of UDP says that nobody
    listens, or if rows of the record are missing.
    """
    click.get_current_context().exit(run(request))


def run(request: Request) -> int:
    """Run the loop, write what was asked for, say what it did, and return the exit status."""
    inputs = [path for path in (request.stage_path, request.reference) if path is not None]
    memory = request.shared_memory
    check_outputs([request.record_path, request.json_path, request.plot_path, memory], inputs)
    if request.plot_path is not None:
        check_figure(request.plot_path)
        require_report_packages("--plot")
    dt = interval_of_rate(request.rate)
    if not _SLOWEST <= request.rate <= _FASTEST:
        span = f"{_SLOWEST:g} to {_FASTEST:g} samples per second"
        raise CommandError(f"--rate: expected {span}, got {request.rate:g}")
    stage = _stage(request)
    if stage.drive_range is None:
        raise CommandError(f"{request.stage_path}: expected a stage with limits, got one without")
    reference = _reference(stage, request)
    report = _loop(stage, stage.drive_range, dt, reference, request)
    outputs = _outputs(report, request)
    try:
        write_outputs(outputs)
    except BaseException:
        # The loop cannot be repeated: what it did is said in any case.
        say(_summary(report, request, []))
        raise
    say(_summary(report, request, [output.path for output in outputs]))
    rests = report.at_rest and report.rest_refused == 0
    as_asked = report.end in _AS_ASKED and rests and _is_recorded(report, request)
    return 0 if as_asked else NOT_AS_ASKED


def _stage(request: Request) -> mh.Stage:
    """Return the stage; the slew rate that it allows is that of the amplifier, so no more of it."""
    path, slew = request.stage_path, request.slew
    stage = load_stage(path, StageOptions())
    say_steady(path, stage)
    if slew is None:
        return stage
    if stage.slew is not None and slew > stage.slew:
        most = f"{stage.slew:g}, which {path} allows"
        raise CommandError(f"--slew: expected at most {most}, got {slew:g}")
    with refusing(path):
        return stage.replace(slew=slew)


def _is_recorded(report: mh.realtime.LoopReport, request: Request) -> bool:
    """Whether the whole record was written, if one was wanted."""
    everything = report.to_dict()
    whole = everything["recorded_rows"] is not None and everything["counts"]["lost_rows"] == 0
    return request.record_path is None or whole


def _outputs(report: mh.realtime.LoopReport, request: Request) -> list[Output]:
    """Return the files; a figure is drawn only when the report has been written."""
    outputs = []
    if request.json_path is not None:
        outputs.append(Output.of(request.json_path, json.dumps(report.to_dict(), indent=1) + "\n"))
    if request.plot_path is not None:

        def draw(path: Path) -> None:
            write_file(path, canvas.image(mh.plot.realtime(report), path.suffix.lower()[1:]))

        outputs.append(Output(request.plot_path, draw))
    return outputs


def _reference(stage: mh.Stage, request: Request) -> Samples:
    """Return the positions of a file, or a sine over half of what the stage reaches."""
    if request.reference is not None:
        columns, column = read_trajectory(request.reference, request.column)
        _check_times(columns, request.rate)
        check_unit(str(request.reference), columns.quantity(column), stage)
        for text in assumed_of(columns, column, stated_unit(stage.units[1]), None):
            note(text)
        return columns[column]
    if stage.position_range is None:
        raise CommandError(f"--reference: expected a file, as {request.stage_path} has no range")
    low, high = stage.position_range
    samples = max(2, round(request.rate / _FREQUENCY))
    turn = 2.0 * np.pi * np.arange(samples) / samples
    wave: Samples = 0.5 * (low + high) + 0.25 * (high - low) * np.sin(turn)
    return wave


def _check_times(columns: Columns, rate: float) -> None:
    """Refuse a reference with the times of another rate: it would be followed at another speed.

    Times that are no sure seconds, or uneven, tell no rate.
    """
    try:
        dt = known_interval(columns)
    except CommandError:
        return
    if dt is not None and abs(dt * rate - 1.0) > _UNEQUAL:
        said = f"expected the times of --rate {rate:g}, got one sample each {dt:g} s"
        raise CommandError(f"{columns.source}: {columns.time_column}: {said} (--rate {1.0 / dt:g})")


def _io(
    stage: mh.Stage, request: Request
) -> mh.plant.Plant | mh.realtime.Udp | mh.realtime.SharedMemory:
    if request.udp is not None and request.shared_memory is not None:
        raise CommandError("--udp: expected none beside --shared-memory")
    if (request.udp is None) != (request.local is None):
        raise CommandError("--local: expected HOST:PORT beside --udp, and only there")
    if request.udp is not None and request.local is not None:
        return mh.realtime.Udp(request.udp, local=request.local)
    if request.shared_memory is not None:
        return mh.realtime.SharedMemory(request.shared_memory)
    return stage.plant(1.0 / request.rate)


def _warn(stage: mh.Stage, rest_rate: float, request: Request) -> None:
    """Say before the drive moves what may surprise."""
    for one in (stage.identified or {}).get("warnings", []):
        note(f"{request.stage_path}: {one['severity']}: {one['message']}")
    if stage.slew is None:
        note(
            f"{request.stage_path} has no slew rate: the drive may jump from limit to limit in "
            "one sample; --slew bounds it"
        )
    low, high = stage.drive_range or (0.0, 0.0)
    slowest = min(rest_rate, stage.slew or rest_rate)
    if slowest > 0.0 and (high - low) / slowest > _LONG:
        seconds = (high - low) / slowest
        note(f"going to rest may take {seconds:.3g} s, and nothing ends that earlier: --rest-rate")


def _loop(
    stage: mh.Stage, limits: tuple[float, float], dt: float, reference: Samples, request: Request
) -> mh.realtime.LoopReport:
    low, high = limits
    names = {
        **flags(Request),
        "dt": "--rate",
        "reference": str(request.reference),
        "rest_drive": "--rest",
        "record": "-o",
        "lock_memory": "--mlock",
        "plant": "--udp",
    }
    rest_rate = (high - low) / _RAMP if request.rest_rate is None else request.rest_rate
    stop = mh.realtime.Stop()
    try:
        with refusing(request.stage_path, names):
            controller, io = stage.controller(dt), _io(stage, request)
            _warn(stage, rest_rate, request)
            # Until the end: what comes behind the loop interrupts neither summary nor files.
            call_at_interrupts(stop.request)
            return mh.realtime.run(
                controller,
                io,
                reference,
                rest_drive=min(max(0.0, low), high) if request.rest is None else request.rest,
                rest_rate=rest_rate,
                watchdog=request.watchdog or (0.0, 0.1),
                lock_memory=request.mlock,
                record=request.record_path,
                progress=_live_line(stage, dt),
                stop=stop,
                **passed(request, "run"),
            )
    except OSError as error:
        # A record and a memory are told by their names.
        if request.udp is None or error.filename == str(request.record_path):
            raise
        raise CommandError(f"--udp: {one_line(error)}") from error
    finally:
        _say_live("\n")


def _live_line(stage: mh.Stage, dt: float) -> Callable[[dict[str, Any]], None]:
    """Show the newest numbers, on a terminal alone."""
    volts, micrometres = stage.units

    def show(now: dict[str, Any]) -> None:
        if now["waiting"] > _WAITS + 2.0 * dt:
            what = "input or output does not return, the drive stays"
            _say_live(f"\rno sample for {now['waiting']:.0f} s: {what}\x1b[K")
            return
        _say_live(
            "\r{taken} samples, {missed} missed, {skipped} skipped, {stale} stale, ".format(**now)
            + f"{now['measurement']:.4g} {micrometres}, {now['drive']:.4g} {volts}\x1b[K"
        )

    return show


def _say_live(text: str) -> None:
    if sys.stderr is not None and sys.stderr.isatty():
        sys.stderr.write(text)
        sys.stderr.flush()


def _summary(report: mh.realtime.LoopReport, request: Request, written: list[Path]) -> str:
    title = f"{request.stage_path} at {request.rate:g} Hz"
    if request.record_path is not None and report.to_dict()["recorded_rows"]:
        written = [request.record_path, *written]
    parts = [title, text_pairs(loop_facts(report)), text_table(*loop_times(report))]
    parts += [f"written  {path}" for path in written]
    return "\n\n".join(parts + [f"warning: {one}" for one in report.warnings])
