"""The way from rest to the beginning of a trajectory: its positions, and the times of a file."""

from __future__ import annotations

import numpy as np

import mpi_hyst as mh
from mpi_hyst._quantity import Quantity, with_unit
from mpi_hyst._types import Samples
from mpi_hyst.io import Columns


def way(reference: Samples, dt: float, seconds: float, rest: float, stage: mh.Stage) -> Samples:
    """Return the positions from rest to the beginning: those that `Stage.precompensate` takes."""
    limits = None
    if stage.position_range is not None:
        reach = [rest, float(reference.min()), float(reference.max()), *stage.position_range]
        limits = min(reach), max(reach)
    # As the drive of this stage is its own position, the drive that it needs is the way itself.
    itself = mh.Stage(mh.PrandtlIshlinskii([1.0], [0.0]), limits=limits)
    path = itself.precompensate(reference, dt, start=rest, lead_in=seconds)
    return path[: path.size - reference.size]


def clock(columns: Columns, samples: int, before: int, dt: float) -> tuple[str, Samples]:
    """Return name and values of the time column of so many samples, `before` of them a lead-in.

    It goes on from the time of the trajectory, in its unit. Without one, seconds count from zero.
    """
    seconds = columns.seconds
    if columns.time_column is None or seconds is None:
        return "time_s", np.arange(-before, samples - before, dtype=np.float64) * dt
    given = columns[columns.time_column]
    step = dt * float(given[-1] - given[0]) / float(seconds[-1] - seconds[0])
    values = np.concatenate([given[0] - step * np.arange(before, 0, -1), given])
    return _clock_name(columns.time_column, columns.time_unit), values


def _clock_name(column: str, unit: str) -> str:
    """Keep a name that says by itself what it is: what is written has no row of units."""
    said = Quantity(column)
    return column if said.is_time and said.suffix == unit else with_unit("time", unit)
