"""Loops that are all alike: what may stand for something else has a rival without it."""

from __future__ import annotations

import mpi_hyst as mh
import numpy as np
import pytest
from law_stages import DT, Stage, measured, named, screw, way
from support import Array

SIZE = 100.0  # V
TRIANGLES = way([0.0, *[SIZE, 0.0] * 3], 2.0 * SIZE)


def identified(stage: Stage, u: Array) -> mh.results.Identification:
    return mh.identify(u, measured(stage, u), dt=DT)


def missed(stage: Stage, found: mh.results.Identification) -> float:
    """The rms error on smaller and slower loops, about its mean, as a share of the range."""
    u = way([0.0, 80.0, 30.0, 60.0, 20.0, 90.0, 0.0], 0.5 * SIZE)
    y = stage.position(u)
    return float(np.std(np.asarray(found.predict(u, dt=DT)) - y) / np.ptp(y))


def outcomes(found: mh.results.Identification, term: str) -> list[str]:
    return [trial["outcome"] for trial in found.terms_tried if trial["term"] == term]


def test_a_periodic_error_is_neither_a_mode_nor_a_dead_time() -> None:
    stage = Stage("screw", 0.0, SIZE, screw)
    found = identified(stage, TRIANGLES)
    assert found.dynamics is None and found.dead_time == 0.0
    assert outcomes(found, "dynamics of second order")[-1] == "needless"
    assert outcomes(found, "dead time") == ["needless"]
    # The error itself is 0.003; 0.010 with a mode, and with a dead time.
    assert missed(stage, found) < 0.005


def test_a_dead_time_that_is_there_stays() -> None:
    def late(u: Array) -> Array:
        return screw(np.concatenate([np.full(20, u[0]), u[:-20]]))

    found = identified(Stage("late screw", 0.0, SIZE, late), TRIANGLES)
    assert found.dead_time == pytest.approx(20 * DT, abs=4 * DT)
    assert "needless" not in outcomes(found, "dead time")


def test_a_map_leaves_room_for_an_operator_that_is_right() -> None:
    stage = named("one side curved")
    low, high = stage.low, stage.high
    found = identified(stage, way([0.0, *[high, low] * 3, 0.0], 2.0 * (high - low)))
    assert found.duhem is not None and found.input_map is None
    assert "overruled" in outcomes(found, "input map")


def test_a_first_way_that_plays_fail_at_may_be_that_of_an_operator() -> None:
    stage = named("Bouc-Wen")
    low, high = stage.low, stage.high
    found = identified(stage, way([0.0, *[high, low] * 3, 0.0], 2.0 * (high - low)))
    assert found.duhem is not None
    # Plays leave 0.0064 of the range.
    assert found.fit.rmse < 6e-4 * found.fit.range
