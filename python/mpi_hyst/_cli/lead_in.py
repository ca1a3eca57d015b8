"""The way from rest to the beginning of a trajectory: its positions, and its times in a file."""

from __future__ import annotations

import numpy as np

import mpi_hyst as mh
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


def times(columns: Columns, samples: int, dt: float) -> Samples | None:
    """Return the time column, with the times of a lead-in in front; None without such a column."""
    seconds = columns.seconds
    if columns.time_column is None or seconds is None:
        return None
    given = columns[columns.time_column]
    before = samples - given.size
    # The unit of the column: seconds, or what its name says.
    step = dt * float(given[-1] - given[0]) / float(seconds[-1] - seconds[0])
    return np.concatenate([given[0] - step * np.arange(before, 0, -1), given])
