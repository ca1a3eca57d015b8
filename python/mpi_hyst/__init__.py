"""Piezo hysteresis: coupled-play models, their exact inverse, identification and compensation.

Here are models, streams and identification. Control laws are in `control`, simulation in `plant`,
test signals in `signals`, references in `trajectories`, what identification returns in `results`,
CSV files in `io`, and the published actuator in `paper`.
"""

from mpi_hyst import control, io, paper, plant, results, signals, trajectories
from mpi_hyst._core import (
    ActuatorArray,
    CoupledPlay,
    Forward,
    ForwardArray,
    Inverse,
    InverseArray,
    ModifiedPrandtlIshlinskii,
    NotInvertibleError,
    Play,
    PrandtlIshlinskii,
    RecursiveIdentifier,
    diagnose,
    identify,
    identify_dynamics,
    load,
)

__all__ = [
    "ActuatorArray",
    "CoupledPlay",
    "Forward",
    "ForwardArray",
    "Inverse",
    "InverseArray",
    "ModifiedPrandtlIshlinskii",
    "NotInvertibleError",
    "Play",
    "PrandtlIshlinskii",
    "RecursiveIdentifier",
    "control",
    "diagnose",
    "identify",
    "identify_dynamics",
    "io",
    "load",
    "paper",
    "plant",
    "results",
    "signals",
    "trajectories",
]
