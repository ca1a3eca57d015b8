"""Simulated stages: hysteresis with amplifier, dynamics, dead time, creep, noise and limits.

`Plant` answers one drive sample at a time; `simulate` runs a controller on it and returns a `Run`,
whose `metrics` give the errors.
"""

from mpi_hyst._core import Creep, FirstOrder, Metrics, Plant, Run, SecondOrder, simulate

__all__ = ["Creep", "FirstOrder", "Metrics", "Plant", "Run", "SecondOrder", "simulate"]
