"""Identify many actuators with the worker processes of joblib.

joblib keeps its processes from call to call. They are an executor of `concurrent.futures`, which
`identify_many` takes. The result has the same bits as without one.
"""

from __future__ import annotations

from typing import Any

import mpi_hyst as mh
import numpy as np
from joblib.externals.loky import get_reusable_executor


def identify(u: Any, positions: Any, **options: Any) -> mh.results.ManyIdentifications:
    """Identify every column of `positions` with two worker processes."""
    executor = get_reusable_executor(max_workers=2, timeout=60)
    return mh.identify_many(u, positions, executor=executor, **options)


# Worker processes import this file: what follows is for the one that was started alone.
if __name__ == "__main__":
    u = mh.signals.decaying_triangle(500.0, 1.0, cycles=6, rate=50)
    y = mh.paper.table_1_recovered().forward().run(u)
    positions = np.outer(y, np.linspace(0.8, 1.2, 300))
    print(identify(u, positions, dt=0.02, weights="quadratic", smoothness=0.0))
