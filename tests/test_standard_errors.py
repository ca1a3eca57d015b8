"""Standard errors of a measured record."""

from __future__ import annotations

from typing import Any

import mpi_hyst as mh
import numpy as np
from support import Array


def test_the_errors_of_the_measured_stack_are_no_smaller_than_the_spread_of_fits() -> None:
    """Fits to the model's own output, and what it leaves, moved round in time: its colour stays.

    Some operators never move. Their weights are told by the smoothness alone.
    """
    records = [mh.datasets.piezo_stack(name) for name in ("major_loops", "decaying_loops")]
    skip = [1000, 400]

    def fit(outputs: list[Array]) -> Any:
        pairs = [(record.u, y) for record, y in zip(records, outputs, strict=True)]
        return mh.identify(
            pairs,
            dt=records[0].dt,
            skip=skip,
            operators=20,
            weights="split",
            ratios="fit",
            smoothness=1e-5,
            dynamics=None,
            creep=None,
            loop_shift=None,
            input_map=None,
            output_map=None,
        )

    found = fit([record.y for record in records])
    rng = np.random.default_rng(1)
    dead_times = []
    for _ in range(6):
        outputs = []
        for record, first in zip(records, skip, strict=True):
            output = found.predict(record.u).copy()
            left = (record.y - output)[first:]
            output[first:] += np.roll(left - left.mean(), rng.integers(left.size))
            outputs.append(output)
        dead_times.append(fit(outputs).dead_time)
    spread = np.std([np.nan if one is None else one for one in dead_times], ddof=1)
    # The spread of six is within a factor of two of the true one. The error also has what dynamics
    # that are left out may add, but not as much as the dead time that all see in this record.
    assert 0.5 * spread < found.dead_time_std < (found.dead_time or 0.0)
