"""Five actuators of four models, one of them a bank, and samples for them."""

from __future__ import annotations

from collections.abc import Callable

import mpi_hyst as mh
import numpy as np
from support import AnyModel, Array

StreamArray = mh.ForwardArray | mh.InverseArray
Make = Callable[[], StreamArray]

M = 5
LIMITS = (-60.0, 60.0)

MODELS: list[AnyModel] = [
    mh.paper.table_1_recovered(),
    mh.PrandtlIshlinskii([1.0, 0.5, 0.25], [0.0, 2.0, 5.0], input_offset=1.0),
    mh.paper.table_1_recovered(),
    mh.ModifiedPrandtlIshlinskii(
        [1.0, 0.5, 0.5], [0, 2, 4], [0, 2, 2], [0, 2, 1], [0, 0, 0], output_offset=-3.0
    ),  # no order nests r and rb: a bank
    mh.PrandtlIshlinskii([1.0, 0.5], [0.0, 2.0]),
]

MAKERS: dict[str, Make] = {
    "forward": lambda: mh.ActuatorArray(MODELS).forward(),
    "inverse": lambda: mh.ActuatorArray(MODELS).inverse(LIMITS),
}


def samples(rows: int = 200, actuators: int = M, seed: int = 5) -> Array:
    """Smooth in parts, with jumps and targets out of reach in between."""
    random = np.random.default_rng(seed)
    walk = np.cumsum(random.normal(size=(rows, actuators)), axis=0)
    walk[rows // 2 :: 17] = random.uniform(-90.0, 90.0, walk[rows // 2 :: 17].shape)
    return walk
