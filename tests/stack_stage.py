"""A simulated piezo stack of 20 coupled plays, and the laws of whatever stands beside them.

Roundings: positions are of up to 200, through two maps, a hysteresis and three sums.
"""

from __future__ import annotations

import copy
import json
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mpi_hyst as mh
import numpy as np
import reference
from hypothesis import strategies as st
from reference.stages import ReferenceStage
from support import Array

DT = 1e-3
LIMITS = (-20.0, 150.0)
ROUNDING = 1e-11 * 200.0
MAPS: dict[str, Any] = {
    "input_map": ([-20.0, 40.0, 150.0], [-20.0, 45.0, 150.0]),
    "output_map": ([-20.0, 60.0, 160.0], [-20.0, 55.0, 160.0]),
}


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


# ---- laws


def assert_forward_of_inverse_is_the_target(made: mh.Stage, us: list[float]) -> None:
    targets = made.forward(DT).run(us)
    reached = made.forward(DT).run(made.inverse(DT).run(targets))
    np.testing.assert_allclose(reached, targets, rtol=0, atol=ROUNDING)


def assert_peek_tells_the_next_step(made: mh.Stage, us: list[float]) -> None:
    forward, inverse = made.forward(DT), made.inverse(DT)
    for u in us:
        ahead, position = forward.peek(u), forward.step(u)
        assert ahead == position
        assert inverse.peek(position) == inverse.step(position)


def assert_a_hold_in_parts_is_a_hold(made: mh.Stage, us: list[float]) -> None:
    parts = made.forward(DT / 4).run(np.repeat(us, 4))[::4]
    np.testing.assert_allclose(parts, made.forward(DT).run(us), rtol=0, atol=ROUNDING)


def assert_restored(made: mh.Stage) -> list[tuple[Any, dict[str, Any], Any]]:
    """Return forward and inverse as they are then, what was restored, and a twin of each."""
    us, streams = 60.0 + 60.0 * np.sin(0.05 * np.arange(300)), []
    for stream in (made.forward(DT), made.inverse(DT)):
        stream.run(us)
        saved = json.loads(json.dumps(stream.state))
        twins = [pickle.loads(pickle.dumps(stream)), copy.deepcopy(stream)]
        expected = stream.run(us[::-1])
        stream.state = saved
        for other in (*twins, stream):
            np.testing.assert_array_equal(other.run(us[::-1]), expected)
        streams.append((stream, saved, twins[0]))
    return streams


def assert_open_loop_follows_a_raster(
    stage: Callable[..., mh.Stage], beside: Callable[[float], dict[str, Any]]
) -> None:
    """Drive a plant that is written apart, with what `beside` makes for a sampling interval."""
    dt, t = 1e-4, 1e-4 * np.arange(10_000)
    raster: Array = 70.0 * 2.0 * np.abs((t * 10.0 + 0.5) % 1.0 - 0.5)
    creep = mh.plant.Creep.logarithmic(0.012, 0.01, 100.0, 8)
    mode = mh.plant.SecondOrder(800.0, 0.02)
    made = stage(limits=(-30.0, 150.0), dynamics=mode, creep=creep, dead_time=dt)
    terms = list(zip(creep.amplitudes, creep.time_constants, strict=True))
    plays = reference_model()
    truth = ReferenceStage(plays, 800.0, 0.02, creep=terms, delay=1, dt=dt, **beside(dt))
    error = np.array(truth.run(made.precompensate(raster, dt).tolist())) - raster
    # As much as with nothing beside the plays: 0.02 % of the stroke of 100 um.
    assert np.sqrt(np.mean(error**2)) < 2e-4 * 100.0


def assert_a_file_keeps(made: mh.Stage, part: str, path: Path) -> Any:
    """Return what the file has of the part."""
    without = made.replace(**{part: None})
    assert without != made
    made.save(path)
    assert mh.load(path) == made == pickle.loads(pickle.dumps(made))
    written = json.loads(path.read_text())
    assert written["schema"] == "mpi_hyst/stage/1"
    kept = written.pop(part)
    path.write_text(json.dumps(written))
    assert mh.load(path) == without
    return kept
