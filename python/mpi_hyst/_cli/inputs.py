"""Model files and sampled trajectories, as commands take them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import mpi_hyst as mh
from mpi_hyst._cli.errors import CommandError
from mpi_hyst._types import Model
from mpi_hyst.io import Columns


def load_model(path: Path) -> Model:
    """Read a model file; an error names it."""
    try:
        return mh.load(path)
    except (ValueError, TypeError) as error:
        message = str(error)
        raise CommandError(message if str(path) in message else f"{path}: {message}") from error


def sampling_interval(columns: Columns, otherwise: str) -> float:
    """Return the step of the time column, which has to be the same everywhere.

    `otherwise` ends the sentence that asks for a time column.
    """
    seconds, dt = columns.seconds, columns.sample_time
    if seconds is None or dt is None:
        expected = "a column time_s or time, or --time, which tells the sampling interval"
        raise CommandError(f"{columns.path}: expected {expected}, {otherwise}")
    # written with few digits a time may be off by a part of a step, which does not add up
    uneven = float(np.abs(seconds - seconds[0] - dt * np.arange(seconds.size)).max())
    if uneven > 0.1 * dt:
        raise CommandError(f"{columns.path}: expected equal steps of time, got {uneven:g} s off")
    return dt
