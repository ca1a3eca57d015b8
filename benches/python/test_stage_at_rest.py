"""A stage at rest beside the same one in motion: a sample must cost the same."""

from __future__ import annotations

import mpi_hyst as mh
import numpy as np
import pytest
from pytest_benchmark.fixture import BenchmarkFixture

DT = 1e-4
SAMPLES = 100_000
MOVING = 100.0 * np.sin(2.0 * np.pi * 5.0 * DT * np.arange(SAMPLES))


@pytest.mark.parametrize("way", ["forward", "inverse"])
@pytest.mark.parametrize("case", ["moving", "at rest at 50 V", "at rest at 0 V"])
def test_a_stage(benchmark: BenchmarkFixture, case: str, way: str) -> None:
    benchmark.group = f"a stage with a mode and creep, {way}, {SAMPLES} samples"
    benchmark.extra_info.update(face="rest", case=case, n=20, samples=SAMPLES)
    stage = mh.Stage(
        mh.paper.table_1_recovered(),
        limits=(-500.0, 500.0),
        dynamics=mh.plant.SecondOrder(800.0, 0.05) if way == "forward" else None,
        creep=mh.plant.Creep([0.01, 0.01], [5e-4, 2e-3]),
    )
    made = stage.forward(dt=DT) if way == "forward" else stage.inverse(dt=DT)
    scale = 1.0 if way == "forward" else 0.01  # um for V
    made.run(scale * MOVING)
    level = {"moving": MOVING, "at rest at 50 V": 50.0, "at rest at 0 V": 0.0}[case]
    samples, out = scale * np.broadcast_to(level, SAMPLES), np.empty(SAMPLES)
    # What decays has become what it comes to.
    made.run(samples, out)
    benchmark(made.run, samples, out)
    assert np.isfinite(out).all()
