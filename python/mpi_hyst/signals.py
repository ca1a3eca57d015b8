"""Sampled signals: tests around an offset, and drives within limits and slew that settle a memory.

`sine`, `triangle`, `decaying_triangle` start at their offset and keep within offset +- amplitude.
`excitation` is a drive to identify from, `demagnetize` one that brings the actuator to rest.
"""

from mpi_hyst._core import (
    Excitation,
    decaying_triangle,
    demagnetize,
    excitation,
    sine,
    triangle,
)

__all__ = ["Excitation", "decaying_triangle", "demagnetize", "excitation", "sine", "triangle"]
