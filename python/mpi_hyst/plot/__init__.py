"""Figures on matplotlib axes, in the style of the reports. They need `mpi_hyst[report]`.

`loops`, `operators`, `weights` and `memory` show a model, a stage or a stream. `residuals` and
`uncertainty` show what identification found. `tuning`, `run` and `realtime` show feedback and
closed loops. Each returns the figure and draws into `axes` of your own if you give them.

`units` are the names of the units of drive and position. A `Stage` has its own; elsewhere labels
have no unit unless you give both.
"""

from mpi_hyst.plot._control import realtime, run, tuning
from mpi_hyst.plot._identified import residuals, uncertainty
from mpi_hyst.plot._models import loops, memory, operators, weights

__all__ = [
    "loops",
    "memory",
    "operators",
    "realtime",
    "residuals",
    "run",
    "tuning",
    "uncertainty",
    "weights",
]
