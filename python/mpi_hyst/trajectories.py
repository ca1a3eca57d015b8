"""References that know their derivatives: what feed-forward through inverse dynamics needs.

`Sine` and `RoundedTriangle` repeat themselves, `PointToPoint` moves within limits of velocity,
acceleration and jerk. `control.precompensate` and `control.invert_dynamics` take them as they
are; `sample` gives arrays.
"""

from mpi_hyst._core import PointToPoint, RoundedTriangle, Sine

__all__ = ["PointToPoint", "RoundedTriangle", "Sine"]
