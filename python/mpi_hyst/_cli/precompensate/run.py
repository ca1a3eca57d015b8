"""`mpi-hyst precompensate`: a model and a trajectory in, the drive out."""

from __future__ import annotations

import re
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import mpi_hyst as mh
from mpi_hyst._cli.errors import CommandError
from mpi_hyst._cli.inputs import load_model, sampling_interval
from mpi_hyst._cli.outputs import Output, check_outputs, write_outputs
from mpi_hyst._cli.stage import StageOptions, name_options
from mpi_hyst._csv import read_trajectory, write_table
from mpi_hyst._quantity import Quantity
from mpi_hyst._text import digits, in_unit, text_pairs
from mpi_hyst._types import Flags, Model, Samples
from mpi_hyst.io import Columns

_DRIVE = "drive"
_SATURATED = "saturated"


@dataclass(frozen=True)
class Request:
    """The options, by their names."""

    model_path: Path
    trajectory: Path
    drive_path: Path
    stage: StageOptions
    column: str | None = None
    time: str | None = None
    rate: float | None = None
    limits: tuple[float, float] | None = None

    @classmethod
    def of(cls, given: dict[str, Any]) -> Request:
        """Take what the command line gives."""
        stage, others = StageOptions.split(given)
        return cls(stage=stage, **others)


def run(request: Request) -> str:
    """Compute the drive, write it, and return the summary."""
    check_outputs([request.drive_path], [request.model_path, request.trajectory])
    model = load_model(request.model_path)
    columns, column = read_trajectory(request.trajectory, request.column, time=request.time)
    _check_names(columns, column)
    target, notes = _target(columns, column, request)
    drive, saturated = _drive(model, target, request)
    table: dict[str, Samples | list[int]] = {}
    if columns.time_column is not None:
        table[columns.time_column] = columns[columns.time_column]
    table[_DRIVE] = drive
    if saturated.any():
        table[_SATURATED] = saturated.astype(int).tolist()
    residual = np.abs(model.forward().run(drive) - target)
    write_outputs([Output.of_text(request.drive_path, write_table(table))])
    summary = _summary(request, Quantity(column), drive, residual, saturated)
    return "\n".join([summary, *notes])


def _check_names(columns: Columns, column: str) -> None:
    """Refuse a column that has the name of one that is written."""
    for name in (columns.time_column, column):
        if name in (_DRIVE, _SATURATED):
            raise CommandError(
                f"{columns.path}: expected other columns than {_DRIVE} and {_SATURATED}, which "
                f"are written, got {name}"
            )


def _target(columns: Columns, column: str, request: Request) -> tuple[Samples, list[str]]:
    """Compute the output that the hysteresis must have; return it with notes for the summary."""
    trajectory = columns[column]
    if request.rate is not None or request.stage.given:
        dt = sampling_interval(columns, request.rate)
    if not request.stage.given:
        return trajectory, []
    names = {"trajectory": str(request.trajectory)}
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            target = mh.control.invert_dynamics(trajectory, dt, **request.stage.arguments())
    except ValueError as error:
        raise CommandError(name_options(str(error), names)) from error
    notes = [f"warning: {name_options(str(one.message), names)}" for one in caught]
    return target, [f"target: through the inverse dynamics at {1.0 / dt:g} Hz", *notes]


def _drive(model: Model, target: Samples, request: Request) -> tuple[Samples, Flags]:
    """Run the exact inverse; return the drive and which samples are saturated."""
    try:
        inverse = model.inverse(request.limits)
    except mh.NotInvertibleError as error:
        raise CommandError(f"{request.model_path}: {error}") from error
    except (ValueError, TypeError) as error:
        raise CommandError(re.sub(r"^limits(\[\d\])?", "--limits", str(error))) from error
    if request.limits is None:
        return inverse.run(target), np.zeros(target.size, dtype=np.bool_)
    # A drive at its limit may be exactly what the target needs: only the stream can tell.
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
        ("samples", f"{drive.size}, starting from rest"),
        ("drive", f"{digits(float(drive.min()))} to {digits(float(drive.max()))}"),
    ]
    if request.limits is None:
        pairs.append(("saturated", "none, as no --limits are given"))
    else:
        low, high = request.limits
        pairs.append(("saturated", f"{count} of {drive.size} samples at {low:g} or {high:g}"))
    error = in_unit(float(residual.max()), quantity.unit, 3)
    if 0 < count < drive.size:
        free = float(residual[~saturated].max())
        error += f", {in_unit(free, quantity.unit, 3)} where not saturated"
    pairs.append(("max |model - target|", error))
    title = f"{request.drive_path}: drive for {quantity.column} of {request.trajectory}"
    return f"{title}\n\n{text_pairs(pairs)}"
