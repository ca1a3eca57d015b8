"""An XY stage, its models and controllers, for the tests of several axes."""

from __future__ import annotations

from typing import Any

import mpi_hyst as mh
import numpy as np
from support import Array

DT = 1e-4
LIMITS = (-560.0, 560.0)
LAG = mh.plant.SecondOrder(400.0, 0.95)
CROSSTALK = np.array([[1.0, 0.03], [-0.03, 1.0]])


def model(scale: float, spread: float) -> mh.ModifiedPrandtlIshlinskii:
    """The actuator of the paper, stiffer or softer, with more or less hysteresis."""
    known = mh.paper.table_1_recovered()
    weights = scale * known.weights * np.r_[1.0, np.full(known.operators - 1, spread)]
    return mh.ModifiedPrandtlIshlinskii.from_ratios(weights, known.r, ra=0.95, rb=0.30, rc=0.35)


MODELS = [model(1.0, 1.0), model(0.9, 1.3), model(1.1, 0.8)]


def plants(axes: int, noise: float | None = None, **options: Any) -> list[mh.plant.Plant]:
    given: dict[str, Any] = {"dynamics": LAG, "noise": noise, "limits": LIMITS, "dt": DT, **options}
    return [mh.plant.Plant(MODELS[i], seed=i, **given) for i in range(axes)]


def controllers(axes: int, **options: Any) -> list[mh.control.HybridController]:
    kp, ki = mh.paper.gains("A1")
    given: dict[str, Any] = {"kp": kp, "ki": ki, "dt": DT, "limits": LIMITS, **options}
    return [mh.control.HybridController(MODELS[i].inverse(LIMITS), **given) for i in range(axes)]


def raster(seconds: float = 0.3) -> Array:
    x = mh.trajectories.RoundedTriangle(2.5, 20.0, corner=5e-3).sample(DT, seconds)[0]
    return np.column_stack([x, np.zeros(x.size)])


def walk(rows: int, axes: int, scale: float) -> Array:
    return np.asarray(np.random.default_rng(3).uniform(-scale, scale, (rows, axes)))


def made() -> mh.control.MultiAxisController:
    """Two axes behind their decoupling."""
    return mh.control.MultiAxisController(controllers(2, slew=1e6), np.linalg.inv(CROSSTALK))
