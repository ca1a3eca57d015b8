"""`mpi-hyst realtime`: a stage in, its loop on the clock of this machine."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

import mpi_hyst as mh
from mpi_hyst._cli.errors import CommandError
from mpi_hyst._cli.outputs import Output, check_figure, check_outputs, write_outputs
from mpi_hyst._cli.stage import StageOptions, check_unit, load_stage, name_options
from mpi_hyst._cli.terminal import require_report_packages
from mpi_hyst._io.read import read_trajectory
from mpi_hyst._report.realtime import facts, times
from mpi_hyst._text import text_pairs, text_table
from mpi_hyst._types import Samples

_FREQUENCY = 10.0  # Hz, of the reference that nobody gave
_RAMP = 0.5  # seconds from one limit to the other


@dataclass(frozen=True)
class Request:
    """The options, by their names."""

    stage_path: Path
    rate: float
    seconds: float
    reference: Path | None
    column: str | None
    udp: str | None
    local: str | None
    shared_memory: Path | None
    rest: float | None
    rest_rate: float | None
    misses: Literal["skip", "catch_up", "stop"]
    watchdog: tuple[float, float] | None
    spin: float
    cpu: int | None
    fifo: int | None
    mlock: bool
    record_path: Path | None
    json_path: Path | None
    plot_path: Path | None


def run(request: Request) -> str:
    """Run the loop, write what was asked for, and return the summary."""
    inputs = [path for path in (request.stage_path, request.reference) if path is not None]
    check_outputs([request.record_path, request.json_path, request.plot_path], inputs)
    if request.plot_path is not None:
        check_figure(request.plot_path)
        require_report_packages("--plot")
    stage = load_stage(request.stage_path, StageOptions())
    if stage.drive_range is None:
        raise CommandError(f"{request.stage_path}: expected a stage with limits, got one without")
    reference = _reference(stage, request)
    report = _loop(stage, stage.drive_range, reference, request)
    outputs = []
    if request.json_path is not None:
        outputs.append(Output.of(request.json_path, json.dumps(report.to_dict(), indent=1) + "\n"))
    if request.plot_path is not None:
        from mpi_hyst._report.look.figure import image

        kind = request.plot_path.suffix.lower()[1:]
        outputs.append(Output.of(request.plot_path, image(mh.plot.realtime(report), kind)))
    write_outputs(outputs)
    return _summary(report, request, [output.path for output in outputs])


def _reference(stage: mh.Stage, request: Request) -> Samples:
    """Return the positions of a file, or a sine over half of what the stage reaches."""
    if request.reference is not None:
        columns, column = read_trajectory(request.reference, request.column)
        check_unit(str(request.reference), columns.quantity(column), stage)
        return columns[column]
    if stage.position_range is None:
        raise CommandError(f"--reference: expected a file, as {request.stage_path} has no range")
    low, high = stage.position_range
    samples = max(2, round(request.rate / _FREQUENCY))
    turn = 2.0 * np.pi * np.arange(samples) / samples
    wave: Samples = 0.5 * (low + high) + 0.25 * (high - low) * np.sin(turn)
    return wave


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


def _loop(
    stage: mh.Stage, limits: tuple[float, float], reference: Samples, request: Request
) -> mh.realtime.LoopReport:
    low, high = limits
    names = {
        "dt": "--rate",
        "reference": str(request.reference),
        "rest_drive": "--rest",
        "record": "-o",
        "lock_memory": "--mlock",
        "stale_after": "--watchdog",
        "rest_after": "--watchdog",
    }
    names |= {one: f"--{one.replace('_', '-')}" for one in ("rate", "seconds", "rest_rate")}
    names |= {one: f"--{one}" for one in ("spin", "cpu", "fifo", "misses")}
    try:
        return mh.realtime.run(
            stage.controller(1.0 / request.rate),
            _io(stage, request),
            reference,
            rest_drive=min(max(0.0, low), high) if request.rest is None else request.rest,
            rest_rate=(high - low) / _RAMP if request.rest_rate is None else request.rest_rate,
            seconds=request.seconds,
            misses=request.misses,
            watchdog=request.watchdog or (0.0, 0.1),
            spin=request.spin,
            cpu=request.cpu,
            fifo=request.fifo,
            lock_memory=request.mlock,
            record=request.record_path,
            progress=_live_line(stage),
        )
    except mh.NotInvertibleError as error:
        raise CommandError(f"{request.stage_path}: {error}") from error
    except (ValueError, TypeError) as error:
        raise CommandError(name_options(error, names)) from error
    finally:
        _say_live("\n")


def _live_line(stage: mh.Stage) -> Callable[[dict[str, Any]], None]:
    """Show the newest numbers, on a terminal alone."""
    volts, micrometres = stage.units

    def show(now: dict[str, Any]) -> None:
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
    if request.record_path is not None:
        written = [request.record_path, *written]
    parts = [title, text_pairs(facts(report)), text_table(*times(report))]
    parts += [f"written  {path}" for path in written]
    return "\n\n".join(parts + [f"warning: {one}" for one in report.warnings])
