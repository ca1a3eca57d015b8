"""Sampled signals: tests around an offset, and drives within limits and slew that settle a memory.

`sine`, `triangle`, `decaying_triangle` start at their offset and keep within offset +- amplitude.
`excitation` is what to identify from, `demagnetize` what to forget with.
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
