"""`mpi-hyst track`: a model and a reference in, how well a simulated stage follows it out."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import mpi_hyst as mh
from mpi_hyst._cli.errors import CommandError
from mpi_hyst._cli.inputs import load_model, sampling_interval
from mpi_hyst._cli.outputs import Output, check_outputs, write_outputs
from mpi_hyst._cli.progress import fraction_bar
from mpi_hyst._cli.terminal import require_report_packages
from mpi_hyst._csv import read_trajectory, write_table
from mpi_hyst._quantity import Quantity
from mpi_hyst._report.simulate.outcome import Outcome, Setup, errors, facts
from mpi_hyst._text import text_pairs, text_table
from mpi_hyst._types import Model, Samples
from mpi_hyst.io import Columns

_AHEAD = 4  # samples beyond the dead time: 2e-7 at 100 Hz for a stage of 400 Hz
_OPTIONS = {
    "frequency": "--dynamics",
    "damping": "--dynamics",
    "dynamics": "--dynamics",
    "amplifier_bandwidth": "--amplifier-bandwidth",
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
    amplifier_bandwidth: float | None = None
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


def run(request: Request) -> str:
    """Track, write what was asked for, and return what there is to know."""
    inputs = [request.model_path, request.trajectory]
    inputs += [request.plant_path] if request.plant_path is not None else []
    check_outputs([request.result_path, request.report_path], inputs)
    if request.report_path is not None:
        require_report_packages("--report")
    columns, column = read_trajectory(request.trajectory, request.column, time=request.time)
    outcome = simulate(columns, column, request)
    outputs = []
    if request.result_path is not None:
        table = write_table(_table(columns, outcome, request))
        outputs.append(Output.of_text(request.result_path, table))
    if request.report_path is not None:
        from mpi_hyst._report.simulate.page import report

        outputs.append(Output.of_text(request.report_path, report(outcome)))
    write_outputs(outputs)
    title = f"{request.model_path} along {column} of {request.trajectory}"
    parts = [title, text_pairs(facts(outcome)), text_table(*errors(outcome))]
    parts += ["% of the base: the peak-to-peak of the reference"]
    return "\n\n".join([*parts, *(f"written  {output.path}" for output in outputs)])


def simulate(columns: Columns, column: str, request: Request) -> Outcome:
    """Let the simulated stage follow the reference."""
    model = load_model(request.model_path)
    actuator = model if request.plant_path is None else load_model(request.plant_path)
    dt = _interval(columns, request)
    try:
        plant = _plant(actuator, request, dt)
        gains = request.gains or _tuned(model, request, dt)
        ahead = _AHEAD + math.ceil(request.delay) if request.previewed else 0
        controller = _controller(model, request, dt, gains, ahead)
        with fraction_bar("track") as progress:
            done = mh.plant.simulate(controller, plant, columns[column], progress=progress)
    except mh.NotInvertibleError as error:
        raise CommandError(f"{request.model_path}: {error}") from error
    except (ValueError, TypeError) as error:
        raise CommandError(_as_option(str(error), request)) from error
    return Outcome(done, dt, Quantity(column), _setup(request, gains, ahead))


def _setup(request: Request, gains: tuple[float, float], ahead: int) -> Setup:
    return Setup(
        model=str(request.model_path),
        stage=str(request.plant_path or request.model_path),
        reference=str(request.trajectory),
        limits=request.limits,
        dynamics=request.dynamics,
        amplifier_bandwidth=request.amplifier_bandwidth,
        delay=request.delay,
        noise=request.noise,
        seed=request.seed,
        gains=gains,
        tuned=request.gains is None,
        inverse=request.feedforward == "inverse",
        ahead=ahead,
    )


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


def _dynamics(request: Request) -> mh.plant.SecondOrder | None:
    return None if request.dynamics is None else mh.plant.SecondOrder(*request.dynamics)


def _plant(actuator: Model, request: Request, dt: float) -> mh.plant.Plant:
    return mh.plant.Plant(
        actuator,
        dynamics=_dynamics(request),
        amplifier_bandwidth=request.amplifier_bandwidth,
        delay=request.delay,
        noise=request.noise,
        limits=request.limits,
        dt=dt,
        seed=request.seed,
    )


def _tuned(model: Model, request: Request, dt: float) -> tuple[float, float]:
    tuned = mh.control.tune(
        model,
        dt=dt,
        dynamics=_dynamics(request),
        amplifier_bandwidth=request.amplifier_bandwidth,
        delay=request.delay,
    )
    return tuned.kp, tuned.ki


def _controller(
    model: Model,
    request: Request,
    dt: float,
    gains: tuple[float, float],
    ahead: int,
) -> mh.control.HybridController:
    preview = None
    if request.previewed:
        preview = mh.control.preview(
            _dynamics(request),
            dt,
            ahead=ahead,
            amplifier_bandwidth=request.amplifier_bandwidth,
            delay=request.delay,
        )
    return mh.control.HybridController(
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


def _table(columns: Columns, outcome: Outcome, request: Request) -> dict[str, Samples]:
    unit = f"_{outcome.quantity.unit}" if outcome.quantity.unit else ""
    run, time = outcome.run, columns.time_column
    table = [
        (time or "time_s", outcome.seconds if time is None else columns[time]),
        (outcome.quantity.column, run.reference),
        ("drive", run.drive),
        (f"measured{unit}", run.measured),
        (f"position{unit}", run.position),
    ]
    names = [name for name, _ in table]
    if len(set(names)) < len(names):
        raise CommandError(f"{request.trajectory}: expected other columns than {', '.join(names)}")
    return dict(table)
