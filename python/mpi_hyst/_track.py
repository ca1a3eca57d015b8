"""`mpi-hyst track`: a model and a reference in, how well a simulated stage follows it out."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

import mpi_hyst as mh
from mpi_hyst._errors import CommandError
from mpi_hyst._inputs import load_model, sampling_interval
from mpi_hyst._outputs import Output, check_outputs, write_outputs
from mpi_hyst._progress import fraction_bar
from mpi_hyst._records import Columns, Quantity, Samples, read_trajectory, write_table
from mpi_hyst._report import require
from mpi_hyst._tables import digits, in_unit, text_pairs, text_table

_AHEAD = 4  # samples beyond the dead time: 2e-7 at 100 Hz for a stage of 400 Hz
_OPTIONS = {
    "frequency": "--dynamics",
    "damping": "--dynamics",
    "dynamics": "--dynamics",
    "amplifier_pole": "--amplifier-pole",
    "delay": "--delay",
    "noise": "--noise",
    "seed": "--seed",
    "limits": "--limits",
    "kp": "--gains",
    "ki": "--gains",
}


@dataclass(frozen=True)
class Request:
    """What was asked, by the names of the options."""

    model_path: Path
    trajectory: Path
    limits: tuple[float, float]
    result_path: Path | None = None
    report_path: Path | None = None
    column: str | None = None
    time: str | None = None
    rate: float | None = None
    plant_path: Path | None = None
    dynamics: tuple[float, float] | None = None
    amplifier_pole: float | None = None
    delay: float = 0.0
    noise: float = 0.0
    seed: int = 0
    gains: tuple[float, float] | None = None
    feedforward: Literal["inverse", "none"] = "inverse"
    preview: bool = True

    @property
    def previewed(self) -> bool:
        """Whether the feed-forward sees references ahead."""
        return self.preview and self.feedforward == "inverse"


@dataclass(frozen=True)
class Tracked:
    """A run and what it was made with."""

    run: mh.Run
    dt: float
    quantity: Quantity
    gains: tuple[float, float]
    ahead: int
    time_column: str
    times: Samples

    @property
    def seconds(self) -> Samples:
        """When each sample is taken, from zero on."""
        return np.arange(len(self.run), dtype=np.float64) * self.dt


def run(request: Request) -> str:
    """Track, write what was asked for, and return what there is to know."""
    inputs = [request.model_path, request.trajectory]
    inputs += [request.plant_path] if request.plant_path is not None else []
    check_outputs([request.result_path, request.report_path], inputs)
    if request.report_path is not None:
        require("the report")
    tracked = track(request)
    outputs = []
    if request.result_path is not None:
        outputs.append(Output.of_text(request.result_path, write_table(_columns(tracked, request))))
    if request.report_path is not None:
        from mpi_hyst import _track_report

        outputs.append(Output.of_text(request.report_path, _track_report.report(tracked, request)))
    write_outputs(outputs)
    title = f"{request.model_path} along {tracked.quantity.column} of {request.trajectory}"
    parts = [title, text_pairs(facts(tracked, request)), text_table(*errors(tracked))]
    parts += ["% of the base: the peak-to-peak of the reference"]
    return "\n\n".join([*parts, *(f"written  {output.path}" for output in outputs)])


def track(request: Request) -> Tracked:
    """Let the simulated stage follow the reference."""
    model = load_model(request.model_path)
    actuator = model if request.plant_path is None else load_model(request.plant_path)
    columns, column = read_trajectory(request.trajectory, request.column, time=request.time)
    dt = _interval(columns, request)
    try:
        plant = _plant(actuator, request, dt)
        gains = request.gains or _tuned(model, request, dt)
        ahead = _AHEAD + math.ceil(request.delay) if request.previewed else 0
        controller = _controller(model, request, dt, gains, ahead)
        with fraction_bar("track") as progress:
            done = mh.simulate(controller, plant, columns.values[column], progress=progress)
    except mh.NotInvertibleError as error:
        raise CommandError(f"{request.model_path}: {error}") from error
    except (ValueError, TypeError) as error:
        raise CommandError(_as_option(str(error), request)) from error
    if columns.time_column is None:
        time_column, times = "time_s", np.arange(len(done), dtype=np.float64) * dt
    else:
        time_column, times = columns.time_column, columns.values[columns.time_column]
    return Tracked(done, dt, Quantity(column), gains, ahead, time_column, times)


def _interval(columns: Columns, request: Request) -> float:
    if request.rate is None:
        return sampling_interval(columns, "or --rate")
    if columns.time_column is not None:
        raise CommandError(
            f"--rate: expected none beside the column {columns.time_column} of {columns.path}, "
            f"got {request.rate!r}"
        )
    if not (math.isfinite(request.rate) and request.rate > 0.0):
        raise CommandError(f"--rate: expected a finite number above 0, got {request.rate!r}")
    return 1.0 / request.rate


def _dynamics(request: Request) -> mh.SecondOrder | None:
    return None if request.dynamics is None else mh.SecondOrder(*request.dynamics)


def _plant(
    actuator: mh.PrandtlIshlinskii | mh.ModifiedPrandtlIshlinskii, request: Request, dt: float
) -> mh.Plant:
    return mh.Plant(
        actuator,
        dynamics=_dynamics(request),
        amplifier_pole=request.amplifier_pole,
        delay=request.delay,
        noise=request.noise,
        limits=request.limits,
        dt=dt,
        seed=request.seed,
    )


def _tuned(
    model: mh.PrandtlIshlinskii | mh.ModifiedPrandtlIshlinskii, request: Request, dt: float
) -> tuple[float, float]:
    tuned = mh.tune(
        model,
        dt=dt,
        dynamics=_dynamics(request),
        amplifier_pole=request.amplifier_pole,
        delay=request.delay,
    )
    return tuned.kp, tuned.ki


def _controller(
    model: mh.PrandtlIshlinskii | mh.ModifiedPrandtlIshlinskii,
    request: Request,
    dt: float,
    gains: tuple[float, float],
    ahead: int,
) -> mh.HybridController:
    preview = None
    if request.previewed:
        preview = mh.preview(
            _dynamics(request),
            dt,
            ahead=ahead,
            amplifier_pole=request.amplifier_pole,
            delay=request.delay,
        )
    return mh.HybridController(
        model.inverse(request.limits) if request.feedforward == "inverse" else None,
        kp=gains[0],
        ki=gains[1],
        dt=dt,
        limits=request.limits,
        preview=preview,
    )


def _as_option(message: str, request: Request) -> str:
    """Name options and the file where the library names arguments."""
    name, colon, rest = message.partition(":")
    argument, bracket, _ = name.partition("[")
    if argument == "dt":
        return f"{'--rate' if request.rate is not None else request.trajectory}{colon}{rest}"
    if argument == "reference":
        return f"{request.trajectory}{bracket and f', sample {name[10:-1]}'}{colon}{rest}"
    if argument == "model":
        return f"{request.model_path}{colon}{rest}"
    return _OPTIONS.get(argument, name) + colon + rest


def _columns(tracked: Tracked, request: Request) -> dict[str, Samples]:
    unit = f"_{tracked.quantity.unit}" if tracked.quantity.unit else ""
    run = tracked.run
    table = [
        (tracked.time_column, tracked.times),
        (tracked.quantity.column, run.reference),
        ("drive", run.drive),
        (f"measured{unit}", run.measured),
        (f"position{unit}", run.position),
    ]
    names = [name for name, _ in table]
    if len(set(names)) < len(names):
        raise CommandError(f"{request.trajectory}: expected other columns than {', '.join(names)}")
    return dict(table)


def facts(tracked: Tracked, request: Request) -> list[tuple[str, str]]:
    """Return what the stage and the controller were."""
    run, metrics = tracked.run, tracked.run.metrics
    low, high = request.limits
    kp, ki = tracked.gains
    plant = [
        *(
            [f"dynamics {request.dynamics[0]:g} Hz, {request.dynamics[1]:g}"]
            if request.dynamics
            else []
        ),
        *([f"amplifier {request.amplifier_pole:g} Hz"] if request.amplifier_pole else []),
        *([f"delay {request.delay:g} samples"] if request.delay else []),
        *(
            [f"noise {in_unit(request.noise, tracked.quantity.unit)} rms, seed {request.seed}"]
            if request.noise
            else []
        ),
    ]
    feedforward = "none"
    if request.feedforward == "inverse":
        feedforward = f"exact inverse of {request.model_path}"
        feedforward += f", {tracked.ahead} samples of preview" if request.previewed else ""
    return [
        ("samples", f"{len(run)} at {1.0 / tracked.dt:.6g} Hz, from rest"),
        ("stage", ", ".join([str(request.plant_path or request.model_path), *plant])),
        ("feed-forward", feedforward),
        ("gains", f"kp {digits(kp)}, ki {digits(ki)}, {'given' if request.gains else 'tuned'}"),
        ("drive", f"{digits(metrics.drive_low)} to {digits(metrics.drive_high)}"),
        ("saturated", f"{metrics.saturated} of {len(run)} samples at {low:g} or {high:g}"),
    ]


def errors(tracked: Tracked) -> tuple[list[str], list[list[str]]]:
    """Return the errors, true and measured, as a table."""
    metrics, unit = tracked.run.metrics, tracked.quantity.unit
    suffix = f" {unit}" if unit else ""
    header = ["error", f"max{suffix}", f"rms{suffix}", "max %", "rms %", f"base{suffix}"]
    rows = []
    for name, largest, rms in (
        ("true position", metrics.max_position_error, metrics.rms_position_error),
        ("measured", metrics.max_error, metrics.rms_error),
    ):
        percents = [
            f"{100.0 * value / metrics.range:.3f}" if metrics.range else "-"
            for value in (largest, rms)
        ]
        rows.append([name, digits(largest), digits(rms), *percents, digits(metrics.range)])
    return header, rows
