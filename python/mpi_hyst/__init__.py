"""Piezo hysteresis: coupled-play models, their exact inverse, identification and compensation."""

from mpi_hyst._core import (
    CoupledPlay,
    Forward,
    Inverse,
    ModifiedPrandtlIshlinskii,
    NotInvertibleError,
    Play,
    PrandtlIshlinskii,
    load,
    paper,
    signals,
)

__all__ = [
    "CoupledPlay",
    "Forward",
    "Inverse",
    "ModifiedPrandtlIshlinskii",
    "NotInvertibleError",
    "Play",
    "PrandtlIshlinskii",
    "load",
    "paper",
    "signals",
]
