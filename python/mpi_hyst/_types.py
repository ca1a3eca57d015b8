"""Types that the private packages share."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from mpi_hyst._core import ModifiedPrandtlIshlinskii, PrandtlIshlinskii

Samples: TypeAlias = npt.NDArray[np.float64]
Flags: TypeAlias = npt.NDArray[np.bool_]
Model: TypeAlias = PrandtlIshlinskii | ModifiedPrandtlIshlinskii
