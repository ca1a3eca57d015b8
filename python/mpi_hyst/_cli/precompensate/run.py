"""`mpi-hyst precompensate`: a model and a trajectory in, the drive that follows it out."""

from __future__ import annotations

import re
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import mpi_hyst as mh
from mpi_hyst._cli.errors import CommandError
from mpi_hyst._cli.inputs import load_model, sampling_interval
from mpi_hyst._cli.outputs import Output, check_outputs, write_outputs
from mpi_hyst._csv import read_trajectory, write_table
from mpi_hyst._quantity import Quantity
from mpi_hyst._text import digits, in_unit, text_pairs
from mpi_hyst._types import Flags, Model, Samples
from mpi_hyst.io import Columns

_SATURATED = "saturated"
_DRIVE = "drive"


@dataclass(frozen=True)
class Request:
    """What was asked, by the names of the options."""

    model_path: Path
    trajectory: Path
    drive_path: Path
    column: str | None = None
    time: str | None = None
    limits: tuple[float, float] | None = None
    dynamics: tuple[float, float] | None = None
    delay: float | None = None
    amplifier_bandwidth: float | None = None

    @property
    def shaped(self) -> bool:
        """Whether there are dynamics to invert."""
        return (self.dynamics, self.delay, self.amplifier_bandwidth) != (None, None, None)


def run(request: Request) -> str:
    """Compute the drive, write it, and return what there is to know about it."""
    check_outputs([request.drive_path], [request.model_path, request.trajectory])
    model = load_model(request.model_path)
    columns, column = read_trajectory(request.trajectory, request.column, time=request.time)
    _check_names(columns, column)
    target, notes = _target(columns, column, request)
    drive, saturated = _drive(model, target, request)
    table: dict[str, Samples | list[int]] = {}
    if columns.time_column is not None:
        table[columns.time_column] = columns.values[columns.time_column]
    table[_DRIVE] = drive
    if saturated.any():
        table[_SATURATED] = saturated.astype(int).tolist()
    residual = np.abs(model.forward().run(drive) - target)
    write_outputs([Output.of_text(request.drive_path, write_table(table))])
    summary = _summary(request, Quantity(column), drive, residual, saturated)
    return "\n".join([summary, *notes])


def _check_names(columns: Columns, column: str) -> None:
    """Refuse columns that would stand beside what is written under the same name."""
    for name in (columns.time_column, column):
        if name in (_DRIVE, _SATURATED):
            written = f"{_DRIVE} and {_SATURATED}, which are written"
            raise CommandError(f"{columns.path}: expected other columns than {written}, got {name}")


def _target(columns: Columns, column: str, request: Request) -> tuple[Samples, list[str]]:
    """Compute what the hysteresis has to put out, and note what is to be said of it."""
    trajectory = columns.values[column]
    if not request.shaped:
        return trajectory, []
    dt = sampling_interval(columns, "as dynamics were given")
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            target = mh.control.invert_dynamics(
                trajectory,
                dt,
                dynamics=None
                if request.dynamics is None
                else mh.plant.SecondOrder(*request.dynamics),
                amplifier_bandwidth=request.amplifier_bandwidth,
                delay=request.delay,
            )
    except ValueError as error:
        raise CommandError(_as_options(str(error), request.trajectory)) from error
    notes = [f"warning: {_as_options(str(one.message), request.trajectory)}" for one in caught]
    return target, [f"target: inverse dynamics, {1e3 * dt:g} ms per sample", *notes]


def _as_options(message: str, path: Path) -> str:
    """Name options and the file where the library names arguments."""
    options = {
        "frequency": "--dynamics",
        "damping": "--dynamics",
        "delay": "--delay",
        "amplifier_bandwidth": "--amplifier-bandwidth",
        "trajectory": str(path),
    }
    name, colon, rest = message.partition(":")
    return options.get(name, name) + colon + rest


def _drive(model: Model, target: Samples, request: Request) -> tuple[Samples, Flags]:
    """Run the exact inverse; with limits, note which targets are out of reach."""
    try:
        inverse = model.inverse(request.limits)
    except mh.NotInvertibleError as error:
        raise CommandError(f"{request.model_path}: {error}") from error
    except (ValueError, TypeError) as error:
        raise CommandError(re.sub(r"^limits(\[\d\])?", "--limits", str(error))) from error
    if request.limits is None:
        return inverse.run(target), np.zeros(target.size, dtype=np.bool_)
    # A drive at its limit may be just what the target needs: only the stream knows.
    steps = [(inverse.step(value), inverse.saturated) for value in target.tolist()]
    return np.array([drive for drive, _ in steps]), np.array([flag for _, flag in steps])


def _summary(
    request: Request,
    quantity: Quantity,
    drive: Samples,
    residual: Samples,
    saturated: Flags,
) -> str:
    count = int(saturated.sum())
    pairs = [
        ("samples", f"{drive.size}, from rest"),
        ("drive", f"{digits(float(drive.min()))} to {digits(float(drive.max()))}"),
    ]
    if request.limits is None:
        pairs.append(("saturated", "none, no --limits given"))
    else:
        low, high = request.limits
        pairs.append(("saturated", f"{count} of {drive.size} samples at {low:g} or {high:g}"))
    residual_text = in_unit(float(residual.max()), quantity.unit, 3)
    if 0 < count < drive.size:
        free = float(residual[~saturated].max())
        residual_text += f", {in_unit(free, quantity.unit, 3)} where not saturated"
    pairs.append(("max |model - target|", residual_text))
    return f"{request.drive_path}: drive that makes the model follow {quantity.column}\n\n" + (
        text_pairs(pairs)
    )
