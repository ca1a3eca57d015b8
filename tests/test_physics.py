"""Stages of other physics, identified with default settings from one experiment alone."""

from __future__ import annotations

import mpi_hyst as mh
import numpy as np
import pytest
from physics import DAMPING, DEAD_TIME, FREQUENCY, HIGH, STAGES, STROKE, PhysicalStage
from support import Array

# % of the stroke, rms, on a raster that was not seen: in the class of the model, and beside it.
INSIDE, BESIDE = 0.10, 0.40
LIMITS = dict(zip(STAGES, (INSIDE, INSIDE, BESIDE, BESIDE), strict=True))


@pytest.mark.parametrize("name", STAGES)
def test_an_experiment_tells_the_whole_stage(name: str) -> None:
    truth = STAGES[name]
    parts = mh.signals.experiment(0.0, HIGH, slew=500.0, rate=100.0, fast_rate=1000.0)
    records = [
        (part.drive, truth.measured(part.drive, 1.0 / part.rate, seed=number))
        for number, part in enumerate(parts)
    ]
    found = mh.identify(records, dt=[1.0 / part.rate for part in parts])
    assert isinstance(found.dynamics, mh.plant.SecondOrder)
    assert found.dynamics.frequency == pytest.approx(FREQUENCY, rel=0.002)
    assert found.dynamics.damping == pytest.approx(DAMPING, rel=0.1)
    told = {finding.code for finding in found.warnings}
    assert found.dead_time is not None
    off = abs(found.dead_time - DEAD_TIME) * parts[0].rate
    assert off < 0.1 or told & {"dead_time_confounded", "dead_time_undetermined"}, off
    assert raster_error(found.stage, truth) < LIMITS[name]


def raster_error(stage: mh.Stage, truth: PhysicalStage) -> float:
    """Return the rms error of a 1 Hz raster of 70 % of the stroke after feed-forward, in %."""
    dt, samples = 1e-3, 5000
    phase = np.sin(2.0 * np.pi * np.arange(samples) * dt)
    wave: Array = np.arcsin(0.98 * phase) / np.arcsin(0.98)
    target = 0.5 * STROKE + 0.35 * STROKE * wave
    drive = stage.replace(limits=(0.0, HIGH)).precompensate(target, dt=dt, lead_in=1.0)
    position = truth.position(drive, dt)[-samples:]
    return 100.0 * float(np.sqrt(np.mean((position - target) ** 2))) / STROKE
