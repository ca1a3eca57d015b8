"""Measurements that do not come: filters go on, and the loop stays stable beside a resonance."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import mpi_hyst as mh
import numpy as np
import pytest

DT = 1e-4  # s
STAGE = mh.Stage(
    mh.PrandtlIshlinskii([1.0], [0.0]),
    dynamics=mh.plant.SecondOrder(100.0, 0.02),
    limits=(-100.0, 100.0),
)
REFERENCE = mh.signals.sine(5.0, 5.0, seconds=1.0, rate=1.0 / DT)
RANDOM = np.random.default_rng(3).random(REFERENCE.size)

Lost = Callable[[int], bool]
Structure = Literal["low-pass", "active damping", "notch"]


def largest_error(structure: Structure, lost: Lost) -> float:
    """The largest error of the position in the second half."""
    tuning = STAGE.tune(DT, peak_sensitivity=1.5, structure=structure)
    controller = mh.control.HybridController(
        STAGE.inverse(DT),
        kp=tuning.kp,
        ki=tuning.ki,
        filters=tuning.filters,
        dt=DT,
        limits=(-100.0, 100.0),
    )
    plant, errors = STAGE.plant(DT), []
    for k, target in enumerate(REFERENCE):
        measured = float("nan") if lost(k) else plant.measured
        errors.append(target - plant.position)
        plant.step(controller.step(target, measured))
    return float(np.abs(errors[REFERENCE.size // 2 :]).max())


@pytest.mark.parametrize("structure", ["low-pass", "active damping", "notch"])
def test_lost_measurements_leave_a_tuned_loop_stable(
    structure: Structure,
) -> None:
    losses: dict[str, Lost] = {
        "none": lambda _: False,
        "one of 20": lambda k: k % 20 == 0,
        "5 % at random": lambda k: bool(RANDOM[k] < 0.05),
        "every other": lambda k: k % 2 == 0,
        "two of three": lambda k: k % 3 > 0,
    }
    errors = {kind: largest_error(structure, lost) for kind, lost in losses.items()}
    # A loss that holds the drive for a sample excites the resonance by a sample of motion, 0.016.
    assert max(errors.values()) < 0.1, errors
