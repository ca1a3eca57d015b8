"""A simulated piezo stack of 20 coupled plays, for the laws of what stands beside them.

Roundings: positions are of up to 200, through two maps, a hysteresis and three sums.
"""

from __future__ import annotations

import mpi_hyst as mh
import numpy as np
import reference
from hypothesis import strategies as st

LIMITS = (-20.0, 150.0)
ROUNDING = 1e-11 * 200.0


def hysteresis(input_offset: float = 0.0) -> mh.ModifiedPrandtlIshlinskii:
    r = 7.5 * np.arange(20)
    w = np.where(np.arange(20) == 0, 0.53, 0.02 * 0.9 ** np.arange(20))
    return mh.ModifiedPrandtlIshlinskii.from_ratios(
        w, r, ra=0.95, rb=0.3, rc=0.35, input_offset=input_offset
    )


def reference_model() -> reference.ModifiedPrandtlIshlinskii:
    """Return its plain twin, of what is beside the input offset."""
    model = hysteresis()
    return reference.ModifiedPrandtlIshlinskii(model.weights, model.r, model.ra, model.rb, model.rc)


def drives() -> st.SearchStrategy[list[float]]:
    """Jumps and plateaus within the limits."""
    drive = st.floats(*LIMITS, allow_nan=False)
    ways = st.lists(st.tuples(drive, st.integers(1, 12)), min_size=1, max_size=15)
    return ways.map(lambda ways: [u for end, samples in ways for u in [end] * samples])
