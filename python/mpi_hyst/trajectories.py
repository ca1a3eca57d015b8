"""References that know their derivatives: what feed-forward through inverse dynamics needs.

`Sine` and `RoundedTriangle` repeat themselves, `PointToPoint` moves within limits of velocity,
acceleration and jerk. `Raster`, `Spiral` and `Lissajous` scan a plane from rest to rest; their
axes `x` and `y` are trajectories. `control.precompensate` and `control.invert_dynamics` take all of
them as they are; `sample` gives arrays.
"""

from mpi_hyst._core import (
    Lissajous,
    PointToPoint,
    Raster,
    RoundedTriangle,
    ScanAxis,
    Sine,
    Spiral,
)

__all__ = [
    "Lissajous",
    "PointToPoint",
    "Raster",
    "RoundedTriangle",
    "ScanAxis",
    "Sine",
    "Spiral",
]
