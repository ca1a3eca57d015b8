"""`mpi-hyst simulate`: a model and a reference in, the errors of a simulated closed loop out."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import mpi_hyst as mh
from mpi_hyst._cli.errors import CommandError
from mpi_hyst._cli.inputs import load_model, sampling_interval
from mpi_hyst._cli.outputs import Output, check_outputs, write_outputs
from mpi_hyst._cli.progress import fraction_bar
from mpi_hyst._cli.stage import StageOptions, name_options
from mpi_hyst._cli.terminal import require_report_packages
from mpi_hyst._csv import read_trajectory, write_table
from mpi_hyst._quantity import Quantity
from mpi_hyst._report.simulate.outcome import BASE, Outcome, Setup, errors, facts
from mpi_hyst._text import text_pairs, text_table
from mpi_hyst._types import Model, Samples
from mpi_hyst.io import Columns

# Samples of preview beyond the dead time. Four leave an error of 2e-7 at 100 Hz with a natural
# frequency of 400 Hz.
_PREVIEW = 4


@dataclass(frozen=True)
class Request:
    """The options, by their names."""

    model_path: Path
    trajectory: Path
    limits: tuple[float, float]
    stage: StageOptions
    result_path: Path | None = None
    report_path: Path | None = None
    column: str | None = None
    time: str | None = None
    rate: float | None = None
    plant_path: Path | None = None
    noise: float = 0.0
    seed: int = 0
    gains: tuple[float, float] | None = None
    feedforward: Literal["inverse", "none"] = "inverse"
    preview: bool = True

    @classmethod
    def of(cls, given: dict[str, Any]) -> Request:
        """Take what the command line gives."""
        stage, others = StageOptions.split(given)
        return cls(stage=stage, **others)

    @property
    def previewed(self) -> bool:
        """Whether the reference passes through the inverse dynamics."""
        return self.preview and self.feedforward == "inverse"


def run(request: Request) -> str:
    """Simulate, write what was asked for, and return the summary."""
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
    parts = [title, text_pairs(facts(outcome)), text_table(*errors(outcome)) + f"\n  {BASE}"]
    return "\n\n".join([*parts, *(f"written  {output.path}" for output in outputs)])


def simulate(columns: Columns, column: str, request: Request) -> Outcome:
    """Simulate the closed loop."""
    model = load_model(request.model_path)
    actuator = model if request.plant_path is None else load_model(request.plant_path)
    dt = sampling_interval(columns, request.rate)
    try:
        plant = mh.plant.Plant(
            actuator,
            noise=request.noise,
            limits=request.limits,
            dt=dt,
            seed=request.seed,
            **request.stage.arguments(),
        )
        gains = request.gains or _tuned(model, request, dt)
        ahead = _PREVIEW + math.ceil(request.stage.dead_time_samples(dt))
        ahead = ahead if request.previewed else 0
        controller = _controller(model, request, dt, gains, ahead)
        with fraction_bar("simulate") as progress:
            done = mh.plant.simulate(controller, plant, columns[column], progress=progress)
    except mh.NotInvertibleError as error:
        raise CommandError(f"{request.model_path}: {error}") from error
    except CommandError:
        raise
    except (ValueError, TypeError) as error:
        raise CommandError(_name_options(str(error), request)) from error
    return Outcome(done, dt, Quantity(column), _setup(request, gains, ahead))


def _setup(request: Request, gains: tuple[float, float], ahead: int) -> Setup:
    return Setup(
        model=str(request.model_path),
        plant=str(request.plant_path or request.model_path),
        reference=str(request.trajectory),
        limits=request.limits,
        dynamics=request.stage.dynamics,
        amplifier_bandwidth=request.stage.amplifier_bandwidth,
        dead_time=request.stage.dead_time or 0.0,
        noise=request.noise,
        seed=request.seed,
        gains=gains,
        tuned=request.gains is None,
        inverse=request.feedforward == "inverse",
        preview_samples=ahead,
    )


def _tuned(model: Model, request: Request, dt: float) -> tuple[float, float]:
    tuned = mh.control.tune(model, dt=dt, **request.stage.arguments())
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
        stage = request.stage.arguments()
        preview = mh.control.preview(stage.pop("dynamics"), dt, ahead=ahead, **stage)
    return mh.control.HybridController(
        model.inverse(request.limits) if request.feedforward == "inverse" else None,
        kp=gains[0],
        ki=gains[1],
        dt=dt,
        limits=request.limits,
        preview=preview,
    )


def _name_options(message: str, request: Request) -> str:
    """Name options and files in a message of the library, which names arguments."""
    argument, bracket, index = message.partition(":")[0].partition("[")
    if argument == "reference" and bracket:
        rest = message.partition(":")[2]
        return f"{request.trajectory}, sample {index.rstrip(']')}:{rest}"
    others = {
        "noise": "--noise",
        "seed": "--seed",
        "limits": "--limits",
        "kp": "--gains",
        "ki": "--gains",
        "dt": "--rate" if request.rate is not None else str(request.trajectory),
        "reference": str(request.trajectory),
        "model": str(request.model_path),
    }
    return name_options(message, others)


def _table(columns: Columns, outcome: Outcome, request: Request) -> dict[str, Samples]:
    unit = f"_{outcome.quantity.suffix}" if outcome.quantity.suffix else ""
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
