"""Sampled signals: tests around an offset, and drives within limits and slew that settle a memory.

`sine`, `triangle`, `decaying_triangle` start at their offset and keep within offset +- amplitude.
`chirp` and `multisine` tell resonances; they start and end at their center if they fade.
`experiment` makes the drives from which a whole stage is identified, `excitation` one for the
hysteresis alone, `demagnetize` one that brings the actuator to rest.
"""

from mpi_hyst._core import (
    Excitation,
    ExperimentPart,
    ExperimentSegment,
    chirp,
    decaying_triangle,
    demagnetize,
    excitation,
    experiment,
    multisine,
    sine,
    triangle,
)

__all__ = [
    "Excitation",
    "ExperimentPart",
    "ExperimentSegment",
    "chirp",
    "decaying_triangle",
    "demagnetize",
    "excitation",
    "experiment",
    "multisine",
    "sine",
    "triangle",
]
