"""Piezo hysteresis: coupled-play models, their exact inverse, identification and compensation."""

from mpi_hyst import paper, signals
from mpi_hyst._core import (
    ActuatorArray,
    CoupledPlay,
    Finding,
    Forward,
    ForwardArray,
    Identification,
    Inverse,
    InverseArray,
    ModifiedPrandtlIshlinskii,
    NotInvertibleError,
    Play,
    PrandtlIshlinskii,
    Quality,
    diagnose,
    identify,
    load,
    loop_width,
)

__all__ = [
    "ActuatorArray",
    "CoupledPlay",
    "Finding",
    "Forward",
    "ForwardArray",
    "Identification",
    "Inverse",
    "InverseArray",
    "ModifiedPrandtlIshlinskii",
    "NotInvertibleError",
    "Play",
    "PrandtlIshlinskii",
    "Quality",
    "diagnose",
    "identify",
    "load",
    "loop_width",
    "paper",
    "signals",
]
