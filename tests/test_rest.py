"""What stands still comes to rest: no state decays into numbers that make processors slow."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest

DT = 1e-4
LIMITS = (-200.0, 200.0)
# In the unit of a state, below everything that acts; a state there is 0.
FADED = 1e-150

# All as fast as real ones are slow: what takes an hour of rest there takes seconds here.
PARTS: dict[str, Any] = {
    "modes": mh.plant.SecondOrder(800.0, 0.05),
    "lag": mh.plant.FirstOrder(300.0),
    "creep": mh.plant.Creep([0.01, 0.02], [5e-4, 2e-3]),
    "loop_shift": mh.plant.LoopShift(0.0, 200.0, (-6.0, 2.5), 1e-3, 0.4),
    "slow_gain": mh.plant.SlowGain(200.0, -0.04, 30.0, 1e-3),
    "relaxing_plays": mh.plant.RelaxingPlays([50.0], [1e-3], [[0.1]]),
}
WAY = 100.0 * np.sin(2.0 * np.pi * 50.0 * DT * np.arange(401))


def numbers(state: Any) -> Iterator[float]:
    """All of them, however deep."""
    if isinstance(state, dict):
        state = list(state.values())
    if isinstance(state, list):
        for one in state:
            yield from numbers(one)
    elif isinstance(state, float):
        yield state


def stage(part: str) -> mh.Stage:
    name = "dynamics" if part in {"modes", "lag"} else part
    return mh.Stage(mh.paper.table_1_recovered(), limits=LIMITS, **{name: PARTS[part]})


@pytest.mark.parametrize("rest", [0.0, 50.0])
@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize("way", ["forward", "inverse"])
def test_a_stage_at_rest_has_no_state_that_fades(way: str, part: str, rest: float) -> None:
    made = stage(part)
    stream = made.forward(dt=DT) if way == "forward" else made.inverse(dt=DT)
    scale = 1.0 if way == "forward" else 0.01  # um for V
    stream.run(scale * WAY)
    assert max(map(abs, numbers(stream.state))) > 1e-3
    stream.run(np.full(60_000, scale * rest))
    assert [x for x in numbers(stream.state) if 0.0 < abs(x) < FADED] == []


def test_filters_of_a_controller_without_an_error_come_to_rest() -> None:
    filters: list[mh.control.Notch | mh.control.LowPass] = [
        mh.control.Notch(800.0, 0.01, 0.5),
        mh.control.LowPass(300.0, 0.7),
    ]
    made = mh.control.HybridController(None, kp=0.1, ki=0.0, dt=DT, limits=LIMITS, filters=filters)
    for error in [1.0, -2.0, 0.5, *[0.0] * 20_000]:
        made.step(error, 0.0)
    assert [x for x in numbers(made.state) if 0.0 < abs(x) < FADED] == []


def test_several_axes_come_to_rest() -> None:
    one = np.eye(2)
    parts: dict[str, Any] = {"operators": [([0.2], [1.0])] * 2, "dt": 1e-3}
    made = mh.MultiAxisStage(
        0.95 * one, 0.4 * one, one, 0 * one, bw=0 * one, cq=0 * one, dq=one, **parts
    )
    forward = made.forward()
    forward.run(np.vstack([np.ones((100, 2)), np.zeros((20_000, 2))]))
    assert [x for x in numbers(forward.state) if 0.0 < abs(x) < FADED] == []
