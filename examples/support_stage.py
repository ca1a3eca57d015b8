"""What the examples share: a stage, as `mh.load("stage.json")` would give it, and a raster."""

from __future__ import annotations

import mpi_hyst as mh

DT = 1e-3
"""Sampling interval in seconds."""


def stage() -> mh.Stage:
    """Return a piezo stage of 0 to 100 um for 0 to 10 V: yours comes from `mh.load`."""
    hysteresis = mh.ModifiedPrandtlIshlinskii.from_ratios(
        [8.0, 0.6, 0.4, 0.4, 0.3], [0.0, 1.0, 2.0, 3.0, 4.0], ra=0.9, rb=0.5, rc=0.6
    )
    return mh.Stage(
        hysteresis,
        limits=(0.0, 10.0),
        slew=500.0,
        creep=mh.plant.Creep.logarithmic(0.01, 0.1, 100.0, 4),
        dynamics=mh.plant.SecondOrder(150.0, 0.7),
    )


def scanner() -> mh.scan.Scanner:
    """Return a scanner of two such stages."""
    return mh.scan.Scanner({"x": stage(), "y": stage()}, DT)
