"""Executors of dask and joblib: worker processes change no bit of `identify_many`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest

pytest.importorskip("dask.distributed", reason="LEFT OUT: dask is not installed")
pytest.importorskip("joblib", reason="LEFT OUT: joblib is not installed")

import many_with_dask
import many_with_joblib

U = mh.signals.decaying_triangle(500.0, 1.0, cycles=6, rate=25)
CLEAN = mh.paper.table_1_recovered().forward().run(U)
RANDOM = np.random.default_rng(5)
GAINS = RANDOM.uniform(0.8, 1.2, 260)  # two groups
POSITIONS = np.outer(CLEAN, GAINS) + RANDOM.normal(0.0, 0.01, (U.size, GAINS.size))
OPTIONS: dict[str, Any] = {"dt": 0.04, "operators": 4, "weights": "quadratic", "smoothness": 0.0}
OPTIONS |= {"ratios": (0.95, 0.3, 0.35), "input_offset": 0.0, "dead_time": 0.0}


@pytest.fixture(scope="module")
def alone() -> mh.results.ManyIdentifications:
    return mh.identify_many(U, POSITIONS, **OPTIONS)


# Both start processes and sockets of their own, and may leave some to the garbage collector.
@pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::DeprecationWarning")
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("identify", [many_with_dask.identify, many_with_joblib.identify])
def test_processes_change_no_bit(
    identify: Callable[..., mh.results.ManyIdentifications],
    alone: mh.results.ManyIdentifications,
) -> None:
    told: list[tuple[float, int]] = []
    found = identify(U, POSITIONS, progress=lambda *now: told.append(now), **OPTIONS)
    assert found == alone and len(found) == 260
    np.testing.assert_array_equal(found.weights, alone.weights)
    assert told == [(256 / 260, 256), (1.0, 260)]


@pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::DeprecationWarning")
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("identify", [many_with_dask.identify, many_with_joblib.identify])
def test_ctrl_c_stops_it(identify: Callable[..., mh.results.ManyIdentifications]) -> None:
    def stop(*_: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        identify(U, POSITIONS, progress=stop, **OPTIONS)
