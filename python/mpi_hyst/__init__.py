"""Piezo hysteresis: coupled-play models, their exact inverse, identification and compensation."""

from mpi_hyst import paper, signals
from mpi_hyst._core import (
    ActuatorArray,
    CoupledPlay,
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
    RecursiveIdentifier,
    identify,
    load,
)

__all__ = [
    "ActuatorArray",
    "CoupledPlay",
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
    "RecursiveIdentifier",
    "identify",
    "load",
    "paper",
    "signals",
]
