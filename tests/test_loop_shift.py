"""A stage whose loops shift: the laws of quasistatic.rs and loop_shift.rs, and a plain twin."""

from __future__ import annotations

import copy
import math
from pathlib import Path
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpi_hyst._cli.stage import is_static
from mpi_hyst._report.models import linear_parts
from reference.loop_shift import LoopShift
from stack_stage import (
    DT,
    LIMITS,
    MAPS,
    ROUNDING,
    assert_a_file_keeps,
    assert_a_hold_in_parts_is_a_hold,
    assert_forward_of_inverse_is_the_target,
    assert_open_loop_follows_a_raster,
    assert_peek_tells_the_next_step,
    assert_restored,
    hysteresis,
    reference_model,
)
from support import parameter_of

SHIFT = mh.plant.LoopShift(65.0, 85.0, (-6.0, 2.5), 0.05, 0.4)


def stage(**parts: Any) -> mh.Stage:
    return mh.Stage(hysteresis(), **{"limits": LIMITS, "loop_shift": SHIFT, **parts})


def twin(shift: mh.plant.LoopShift, dt: float) -> LoopShift:
    return LoopShift(
        shift.center, shift.half_range, shift.amplitudes, shift.time_constant, shift.limit, dt
    )


def finite(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high, allow_nan=False)


def shifts() -> st.SearchStrategy[mh.plant.LoopShift]:
    amplitudes = st.tuples(finite(-5.0, 5.0), finite(-5.0, 5.0))
    # From a limit that every move reaches to one that none does, from fast to slow.
    return st.builds(
        mh.plant.LoopShift, finite(-20.0, 150.0), st.just(85.0), amplitudes,
        finite(1e-4, 10.0), finite(0.05, 3.0),
    )  # fmt: skip


def drives() -> st.SearchStrategy[list[float]]:
    """Ramps, jumps and plateaus within the limits."""
    ways = st.lists(st.tuples(finite(*LIMITS), st.integers(1, 12)), min_size=1, max_size=15)

    def walk(ways: list[tuple[float, int]]) -> list[float]:
        found = [0.0]
        for end, samples in ways:
            begin = found[-1]
            found += [begin + (end - begin) * k / samples for k in range(1, samples)]
            found.append(end)  # exactly: a rounding beyond a limit is refused
        return found

    return ways.map(walk)


@given(shifts(), drives())
def test_the_stage_is_its_equations(shift: mh.plant.LoopShift, us: list[float]) -> None:
    plain, moved = reference_model(), twin(shift, DT)
    moved.settle(0.0)
    expected = [plain.step(u) + moved.step(u) for u in us]
    got = stage(loop_shift=shift).forward(DT).run(us)
    np.testing.assert_allclose(got, expected, rtol=0, atol=ROUNDING)


@given(shifts(), drives())
def test_forward_of_inverse_is_the_target(shift: mh.plant.LoopShift, us: list[float]) -> None:
    made = stage(loop_shift=shift, creep=mh.plant.Creep([0.01, 0.02], [0.01, 1.0]), **MAPS)
    assert_forward_of_inverse_is_the_target(made, us)


@given(shifts(), drives(), drives())
def test_an_inverse_that_followed_knows_the_history(
    shift: mh.plant.LoopShift, before: list[float], us: list[float]
) -> None:
    made = stage(loop_shift=shift, **MAPS)
    forward, inverse = made.forward(DT), made.inverse(DT)
    forward.follow(before)
    inverse.follow(before)
    targets = copy.deepcopy(forward).run(us)
    np.testing.assert_allclose(forward.run(inverse.run(targets)), targets, rtol=0, atol=ROUNDING)


@given(shifts(), drives())
def test_peek_changes_nothing_and_tells_the_next_step(
    shift: mh.plant.LoopShift, us: list[float]
) -> None:
    made = stage(loop_shift=shift, **MAPS)
    assert_peek_tells_the_next_step(made, us)


@given(shifts(), drives())
def test_a_hold_in_parts_is_a_hold(shift: mh.plant.LoopShift, us: list[float]) -> None:
    made = stage(loop_shift=shift)
    assert_a_hold_in_parts_is_a_hold(made, us)


def test_a_restored_state_continues_bit_for_bit() -> None:
    made = stage(creep=mh.plant.Creep([0.01], [0.5]), **MAPS)
    assert_restored(made)


def test_a_state_from_before_there_was_a_loop_shift_loads() -> None:
    rigid = stage(loop_shift=None).inverse(DT)
    rigid.step(20.0)
    saved = rigid.state
    older = copy.deepcopy(saved)
    assert older["stream"].pop("loop_shift") == []
    rigid.step(40.0)
    rigid.state = older
    assert rigid.state == saved


def test_a_slow_cycle_moves_the_centre_by_the_mean_square() -> None:
    # tau / 4 behind a triangle of 1 Hz: e is 0.25 tau x' but for a while after each reversal.
    u = 65.0 + mh.signals.triangle(40.0, 1.0, seconds=4.0, rate=1.0 / DT)
    shift = mh.plant.LoopShift(65.0, 85.0, (-6.0, 0.0), 0.01, 1.0)
    rows = [stage(loop_shift=one).forward(DT).run(u)[-1000:] for one in (shift, None)]
    behind = 0.25 * 0.01 * 4.0 * 40.0 / 85.0
    assert np.mean(rows[0] - rows[1]) == pytest.approx(-6.0 * behind**2, rel=0.02)


def test_open_loop_follows_a_raster_of_a_stage_that_is_written_apart() -> None:
    def moved(dt: float) -> dict[str, Any]:
        shift = twin(SHIFT, dt)
        shift.settle(0.0)
        return {"loop_shift": shift}

    assert_open_loop_follows_a_raster(stage, moved)


def test_a_stage_keeps_its_shift(tmp_path: Path) -> None:
    made = stage()
    assert made.loop_shift == SHIFT and stage(loop_shift=None).loop_shift is None
    assert "loop shift" in repr(made) and "loop shift" not in repr(stage(loop_shift=None))
    assert made.replace(loop_shift=None) == stage(loop_shift=None) != made
    assert made.replace(dead_time=DT).loop_shift == SHIFT
    assert assert_a_file_keeps(made, "loop_shift", tmp_path / "stage.json") == {
        **{"center": 65.0, "half_range": 85.0, "amplitudes": [-6.0, 2.5]},
        **{"time_constant": 0.05, "limit": 0.4},
    }


def test_the_bracket_leaves_the_shift_out() -> None:
    brackets = [one.bracket() for one in (stage(), stage(loop_shift=None))]
    for u in (20.0, 90.0, 10.0):
        assert brackets[0].step(u) == brackets[1].step(u)


def test_a_plant_shifts_as_its_stage() -> None:
    u = 60.0 + 60.0 * np.sin(0.05 * np.arange(500))
    np.testing.assert_array_equal(stage().plant(DT).run(u)[1], stage().forward(DT).run(u))


def test_the_command_line_names_the_shift_and_needs_the_time() -> None:
    assert linear_parts(stage()) == ["loop shift -6.000 and 2.500 um, time constant 0.05000 s"]
    assert not is_static(stage()) and is_static(stage(loop_shift=None))


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"center": math.nan}, ValueError, "center: expected a finite number"),
        ({"half_range": 0.0}, ValueError, "half_range: expected a number above 0"),
        ({"half_range": "wide"}, TypeError, "half_range: expected a number"),
        ({"amplitudes": (1.0, math.inf)}, ValueError, "amplitudes[1]: expected a finite number"),
        ({"amplitudes": (1.0,)}, TypeError, "amplitudes: expected two numbers (c_1, c_2)"),
        ({"amplitudes": 1.0}, TypeError, "amplitudes: expected two numbers (c_1, c_2), got 1.0"),
        ({"time_constant": 0.0}, ValueError, "time_constant: expected a finite number above 0"),
        ({"limit": -0.1}, ValueError, "limit: expected a number above 0"),
    ],
)
def test_wrong_numbers_are_named(
    change: dict[str, Any], error: type[Exception], message: str
) -> None:
    given: dict[str, Any] = {"center": 0.0, "half_range": 1.0, "amplitudes": (1.0, 2.0)}
    with pytest.raises(error) as caught:
        mh.plant.LoopShift(**{**given, "time_constant": 0.1, "limit": 1.0, **change})
    assert str(caught.value).startswith(message) and ", got " in str(caught.value)
    assert parameter_of(caught.value) == next(iter(change))


def test_what_is_no_loop_shift_is_refused() -> None:
    with pytest.raises(TypeError, match="loop_shift: expected a LoopShift") as caught:
        stage(loop_shift=0.1)
    assert parameter_of(caught.value) == "loop_shift"
