"""What has a hysteresis, and the loops that show it. Needs no package for figures."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from mpi_hyst._core import Identification, ModifiedPrandtlIshlinskii, PrandtlIshlinskii, Stage
from mpi_hyst._types import Model, Samples

Shown: TypeAlias = Stage | Model | Identification
_MOVE = 400  # samples of each
_MODELS = (PrandtlIshlinskii, ModifiedPrandtlIshlinskii)


def model_of(shown: Shown) -> Model:
    """Return the hysteresis."""
    if isinstance(shown, Stage):
        return shown.hysteresis
    return shown.model if isinstance(shown, Identification) else shown


def default_drive(shown: Shown) -> Samples:
    """Return decaying loops over the range of a stage, or over all thresholds of a model."""
    model = model_of(shown)
    known = None if isinstance(shown, _MODELS) else shown.drive_range
    if known is None:
        reach = 1.25 * max(float(one.max()) for one in _thresholds(model)) or 1.0
        known = (model.input_offset - reach, model.input_offset + reach)
    low, high = known
    corners = [0.0, *(sign * share for share in (1.0, 0.7, 0.4, 0.15) for sign in (1.0, -1.0)), 0.0]
    moves = len(corners) - 1
    course = np.interp(np.linspace(0.0, moves, moves * _MOVE + 1), range(moves + 1), corners)
    # The first point is where a model rests, if that is within the range.
    drive = 0.5 * (low + high) + 0.5 * (high - low) * course
    rest = min(max(model.input_offset, low), high)
    return np.concatenate([np.linspace(rest, drive[0], 100), drive])


def _thresholds(model: Model) -> list[Samples]:
    if isinstance(model, PrandtlIshlinskii):
        return [model.thresholds]
    return [model.r, model.ra, model.rb, model.rc]


def run(shown: Stage | Model, u: Samples, dt: float | None) -> Samples:
    """Run a model along a drive; a stage without dt has the part that does not know time."""
    if not isinstance(shown, Stage):
        return shown.forward().run(u)
    if dt is not None:
        return shown.forward(dt).run(u)
    timeless = Stage(shown.hysteresis, input_map=shown.input_map, output_map=shown.output_map)
    return timeless.forward(1.0).run(u)
