"""Sampled test signals: each starts at its offset and keeps within offset +- amplitude."""

from mpi_hyst._core import decaying_triangle, sine, triangle

__all__ = ["decaying_triangle", "sine", "triangle"]
