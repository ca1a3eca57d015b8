"""Identify many actuators with the workers of a dask cluster.

`identify_many` takes any executor of `concurrent.futures`: that of a dask client spreads groups of
256 actuators over machines. The result has the same bits as without one.
"""

from __future__ import annotations

from typing import Any

import mpi_hyst as mh
import numpy as np
from dask.distributed import Client, LocalCluster


def identify(u: Any, positions: Any, **options: Any) -> mh.results.ManyIdentifications:
    """Identify every column of `positions` with two worker processes of this machine."""
    with (
        LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster,
        Client(cluster) as client,
    ):
        return mh.identify_many(u, positions, executor=client.get_executor(), **options)


# Worker processes import this file: what follows is for the one that was started alone.
if __name__ == "__main__":
    u = mh.signals.decaying_triangle(500.0, 1.0, cycles=6, rate=50)
    y = mh.paper.table_1_recovered().forward().run(u)
    positions = np.outer(y, np.linspace(0.8, 1.2, 300))
    print(identify(u, positions, dt=0.02, weights="quadratic", smoothness=0.0))
