"""Linear dynamics and simulated stages.

`SecondOrder`, `FirstOrder`, `Modes` and `StateSpace` describe the dynamics behind the hysteresis,
`Creep` slow drift after a change of the drive, `LoopShift` the motion of the centre of a loop with
its amplitude. `Plant` simulates a stage with converters, noise and limits, one drive at a time.
`simulate` runs a controller on a plant and returns a `Run` with the errors.
"""

from mpi_hyst._core import (
    Antiresonance,
    Creep,
    FirstOrder,
    LoopShift,
    Metrics,
    Modes,
    Plant,
    Run,
    SecondOrder,
    StateSpace,
    simulate,
)

__all__ = [
    "Antiresonance",
    "Creep",
    "FirstOrder",
    "LoopShift",
    "Metrics",
    "Modes",
    "Plant",
    "Run",
    "SecondOrder",
    "StateSpace",
    "simulate",
]
