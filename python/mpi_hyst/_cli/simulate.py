"""`mpi-hyst simulate`: a stage and a reference in, the errors of a simulated closed loop out."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

import mpi_hyst as mh
from mpi_hyst._cli.inputs import (
    assumed_of,
    clock_column,
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
    report,
)
from mpi_hyst._cli.outputs import Output, check_outputs, write_outputs, write_table
from mpi_hyst._cli.stage import (
    StageOptions,
    check_unit,
    load,
    load_stage,
    name_options,
    of_stage,
    refusing,
    say_red,
    say_steady,
    why_narrowed,
)
from mpi_hyst._cli.terminal import (
    CommandError,
    command_line,
    fraction_bar,
    note,
    require_report_packages,
    say,
)
from mpi_hyst._quantity import Stated, drive_with_unit, stated_unit, with_unit
from mpi_hyst._report import simulate as page
from mpi_hyst._report.models import linear_parts
from mpi_hyst._report.page import Provenance, hashed_file, made_with
from mpi_hyst._report.simulate import Setup, Simulation
from mpi_hyst._text import in_unit, text_pairs, text_table
from mpi_hyst._types import Samples
from mpi_hyst.io import Columns
from mpi_hyst.scan import way_to

_MAX_JUMP = 5e-3
"""Share of the range of a reference by which it may begin beside the rest without a warning."""


@dataclass(frozen=True)
class Request:
    """The stage, the reference, and what they are simulated with."""

    stage_path: Path = argument("STAGE.json")
    trajectory: Path = argument("REFERENCE.csv")
    limits: tuple[float, float] | None = limits("those of the stage, as far as its records reach")
    result_path: Path | None = option("-o", help="Run to write (CSV).")
    report_path: Path | None = report()
    sampled: Sampled = group(Sampled, what="reference")
    lead_in: float | None = lead_in("reference")
    plant_path: Path | None = option(
        "--plant",
        metavar="OTHER.json",
        help="Stage or hysteresis that is simulated.  [default: STAGE.json]",
    )
    stage: StageOptions = group(StageOptions)
    noise: float | None = option(
        metavar="RMS",
        help="Noise of the sensor, in the unit of the reference.  [default: that of the stage]",
    )
    seed: int = option(default=0, help="Seed of the sensor noise.")
    gains: tuple[float, float] | None = option(
        **numbers("KP,KI"),
        help="Proportional gain (V/µm) and integral gain (V/µm/s).  [default: tuned]",
    )
    feedforward: Literal["preview", "inverse", "none"] = option(
        default="preview",
        help="preview: the reference passes through the inverse dynamics, then the exact inverse "
        "of the hysteresis. inverse: exact inverse of the hysteresis. none: feedback alone.",
    )


@command(Request, short_help="Simulate control of a stage along a reference.")
def simulate(request: Request) -> None:
    """Simulate a stage that follows a reference under feed-forward and feedback.

    STAGE.json is a stage or a model written by identify. The controller knows this stage, but not
    the noise, nor the stage given with --plant. Without --lead-in the reference should begin where
    the stage rests: else it begins with a jump, which counts in the errors.
    """
    say(run(request))


def run(request: Request) -> str:
    """Simulate, write what was asked for, and return the summary."""
    inputs = [request.stage_path, request.trajectory]
    inputs += [request.plant_path] if request.plant_path is not None else []
    check_outputs([request.result_path, request.report_path], inputs)
    if request.report_path is not None:
        require_report_packages("--report")
    # First what is not a table: of two files in the wrong order, the message names the stage.
    stage = load_stage(request.stage_path, request.stage)
    say_red(request.stage_path, stage)
    say_steady(request.stage_path, stage)
    columns, column = trajectory(request.trajectory, request.sampled)
    check_unit(str(request.trajectory), columns.quantity(column), stage)
    assumed = assumed_of(columns, column, stated_unit(stage.units[1]), request.sampled)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        simulation = _simulate(columns, column, stage, request)
    outputs = []
    if request.result_path is not None:
        table = write_table(_table(columns, simulation, stage))
        outputs.append(Output.of(request.result_path, table))
    if request.report_path is not None:
        text = page.report(simulation, _provenance(request))
        outputs.append(Output.of(request.report_path, text))
    for text in assumed:
        note(text)
    write_outputs(outputs)
    title = f"{request.stage_path} along {column} of {request.trajectory}"
    parts = [title, text_pairs(page.facts(simulation))]
    parts.append(text_table(*page.errors(simulation)) + f"\n  {page.BASE}")
    # A controller that is copied warns again.
    told = dict.fromkeys(name_options(one.message) for one in caught)
    told |= {} if simulation.jump is None else {_jump(simulation, request): None}
    notes = [f"warning: {one}" for one in told]
    written = (f"written  {output.path}" for output in outputs)
    return "\n\n".join([*parts, *notes, *written])


def _jump(simulation: Simulation, request: Request) -> str:
    """Say that the reference begins elsewhere than the stage rests."""
    far = in_unit(abs(simulation.jump or 0.0), simulation.quantity.unit, 3)
    return (
        f"{request.trajectory}: begins {far} from where the stage rests; this jump counts in the "
        "errors. --lead-in SECONDS goes there smoothly before"
    )


def _provenance(request: Request) -> Provenance:
    data = [request.trajectory, *([] if request.plant_path is None else [request.plant_path])]
    stage = hashed_file(request.stage_path)
    return made_with(command_line(), map(hashed_file, data), stage)


def _simulate(columns: Columns, column: str, stage: mh.Stage, request: Request) -> Simulation:
    """Simulate the closed loop."""
    other = stage if request.plant_path is None else _other(request.plant_path, stage)
    dt = sampling_interval(columns, request.sampled.rate)
    with refusing(request.stage_path, _names(request)):
        plant_stage = other if request.noise is None else other.replace(noise=request.noise)
        plant = plant_stage.plant(dt, seed=request.seed)
        controller = _controller(stage, dt, request)
        rest, reference = plant.position, columns[column]
        before = np.empty(0)
        if request.lead_in is not None:
            within = stage.position_range
            before = way_to(reference, dt, request.lead_in, start=rest, within=within)
        with fraction_bar("simulate") as progress:
            path = np.concatenate([before, reference])
            done = mh.plant.simulate(controller, plant, path, progress=progress)
    tuning = None
    if request.gains is None and request.report_path is not None:
        tuning = stage.tune(dt)
    setup = _setup(request, stage, plant_stage, controller, tuning)
    drive = Stated("drive", stage.units[0])
    quantity = of_stage(columns.quantity(column), stage)
    name = f"{request.trajectory.name} on {request.stage_path.name}"
    jump = None if request.lead_in is not None else _jump_of(reference, rest)
    return Simulation(
        *(done, dt, quantity, setup, name, drive.label, drive.unit),
        lead_in_samples=before.size,
        jump=jump,
    )


def _jump_of(reference: Samples, rest: float) -> float | None:
    """Return how far from rest a reference begins, if that stands out of its range."""
    jump = float(reference[0]) - rest
    return jump if abs(jump) > _MAX_JUMP * float(np.ptp(reference)) else None


def _other(path: Path, stage: mh.Stage) -> mh.Stage:
    """Read the stage to be simulated; a hysteresis model takes the place of that of the stage."""
    loaded = load(path)
    return loaded if isinstance(loaded, mh.Stage) else stage.replace(hysteresis=loaded)


def _controller(stage: mh.Stage, dt: float, request: Request) -> mh.control.HybridController:
    limits = request.limits or stage.drive_range
    if limits is None:
        raise CommandError(f"--limits: expected LOW,HIGH, as {request.stage_path} has no limits")
    if request.feedforward != "none":
        # Gains that are not given are tuned there.
        kp, ki = request.gains or (None, None)
        return stage.controller(dt, limits, request.feedforward, kp=kp, ki=ki)
    if request.gains is not None:
        kp, ki = request.gains
        return mh.control.HybridController(
            None, kp=kp, ki=ki, dt=dt, limits=limits, slew=stage.slew
        )
    tuned = stage.tune(dt)
    return mh.control.HybridController(
        None, kp=tuned.kp, ki=tuned.ki, filters=tuned.filters, dt=dt, limits=limits, slew=stage.slew
    )


def _setup(
    request: Request,
    stage: mh.Stage,
    plant: mh.Stage,
    controller: mh.control.HybridController,
    tuning: mh.control.Tuning | None,
) -> Setup:
    return Setup(
        stage=str(request.stage_path),
        plant=str(request.plant_path or request.stage_path),
        reference=str(request.trajectory),
        limits=controller.limits,
        why="" if request.limits else why_narrowed(stage),
        linear_parts=linear_parts(plant),
        noise=plant.noise or 0.0,
        seed=request.seed,
        gains=(controller.kp, controller.ki),
        tuned=request.gains is None,
        tuning=tuning,
        feedforward=request.feedforward,
    )


def _names(request: Request) -> dict[str, str]:
    """Return the options and files that stand for arguments of the library."""
    return {
        **flags(Request),
        "kp": "--gains",
        "ki": "--gains",
        "dt": "--rate" if request.sampled.rate is not None else str(request.trajectory),
        "reference": str(request.trajectory),
        "model": str(request.stage_path),
    }


def _table(columns: Columns, simulation: Simulation, stage: mh.Stage) -> dict[str, Samples]:
    run, before = simulation.whole, simulation.lead_in_samples
    # A column without a unit is taken to be in that of the stage.
    drive_unit, unit = stage.units[0], simulation.quantity.suffix or stage.units[1]
    time, times = clock_column(columns, len(run), before, simulation.dt)
    table = {
        with_unit("reference", unit): run.reference,
        drive_with_unit(drive_unit): run.drive,
        with_unit("measured", unit): run.measured,
        with_unit("position", unit): run.position,
    }
    if columns.time_column in table:
        names = ", ".join(table)
        raise CommandError(
            f"{columns.source}: expected other columns than {names}, which are written, "
            f"got {columns.time_column}"
        )
    return {time: times, **table}
