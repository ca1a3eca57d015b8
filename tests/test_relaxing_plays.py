"""A stage whose loops have a width that depends on the rate: laws, twin, identification."""

from __future__ import annotations

import math
import pickle
from pathlib import Path
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpi_hyst._cli.stage import is_static
from mpi_hyst._report.models import linear_parts
from reference.relaxing_plays import RelaxingPlays
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
    drives,
    hysteresis,
    reference_model,
)
from support import Array, parameter_of

PLAYS = mh.plant.RelaxingPlays(
    [0.0, 12.0, 30.0], [0.01, 0.2], [[0.01, 0.03, 0.02], [0.0, 0.02, 0.02]], origin=10.0
)
SHIFT = mh.plant.LoopShift(65.0, 85.0, (-6.0, 2.5), 0.05, 0.4)


def stage(**parts: Any) -> mh.Stage:
    return mh.Stage(hysteresis(), **{"limits": LIMITS, "relaxing_plays": PLAYS, **parts})


def twin(plays: mh.plant.RelaxingPlays, dt: float) -> RelaxingPlays:
    lists = (plays.thresholds.tolist(), plays.time_constants.tolist(), plays.weights.tolist())
    return RelaxingPlays(*lists, plays.origin, dt)


def finite(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high, allow_nan=False)


@st.composite
def all_plays(draw: st.DrawFn) -> mh.plant.RelaxingPlays:
    # From fast to slow, of weights of either sign.
    rows, columns = draw(st.integers(1, 3)), draw(st.integers(1, 4))
    thresholds = np.cumsum([draw(finite(0.0, 20.0)), *draw(st.lists(finite(1.0, 30.0)))])[:columns]
    times = np.cumsum([draw(finite(1e-4, 1.0)) for _ in range(rows)])
    weight = finite(-0.05, 0.1)
    weights = [[draw(weight) for _ in thresholds] for _ in times]
    return mh.plant.RelaxingPlays(thresholds, times, weights, draw(finite(-50.0, 150.0)))


@given(all_plays(), drives())
def test_the_stage_is_its_equations(plays: mh.plant.RelaxingPlays, us: list[float]) -> None:
    plain, relaxing = reference_model(), twin(plays, DT)
    expected = [relaxing.step(u, plain.step(u)) for u in us]
    got = stage(relaxing_plays=plays).forward(DT).run(us)
    np.testing.assert_allclose(got, expected, rtol=0, atol=ROUNDING)


@given(all_plays(), drives())
def test_forward_of_inverse_is_the_target(plays: mh.plant.RelaxingPlays, us: list[float]) -> None:
    creep = mh.plant.Creep([0.01, 0.02], [0.01, 1.0])
    made = stage(relaxing_plays=plays, creep=creep, loop_shift=SHIFT, **MAPS)
    assert_forward_of_inverse_is_the_target(made, us)


@given(all_plays(), drives())
def test_peek_changes_nothing_and_tells_the_next_step(
    plays: mh.plant.RelaxingPlays, us: list[float]
) -> None:
    made = stage(relaxing_plays=plays, loop_shift=SHIFT, **MAPS)
    assert_peek_tells_the_next_step(made, us)


@given(all_plays(), drives())
def test_a_hold_in_parts_is_a_hold(plays: mh.plant.RelaxingPlays, us: list[float]) -> None:
    made = stage(relaxing_plays=plays)
    assert_a_hold_in_parts_is_a_hold(made, us)


@pytest.mark.parametrize("shift", [None, SHIFT])
def test_a_restored_state_continues_bit_for_bit(shift: mh.plant.LoopShift | None) -> None:
    made = stage(creep=mh.plant.Creep([0.01], [0.5]), loop_shift=shift, **MAPS)
    assert_restored(made)


def test_open_loop_follows_a_raster_of_a_stage_that_is_written_apart() -> None:
    assert_open_loop_follows_a_raster(stage, lambda dt: {"relaxing": twin(PLAYS, dt)})


def test_a_stage_keeps_its_plays(tmp_path: Path) -> None:
    made = stage()
    assert made.relaxing_plays == PLAYS and stage(relaxing_plays=None).relaxing_plays is None
    assert "relaxing plays" in repr(made)
    assert "relaxing plays" not in repr(stage(relaxing_plays=None))
    assert made.replace(relaxing_plays=None) == stage(relaxing_plays=None) != made
    assert_a_file_keeps(made, "relaxing_plays", tmp_path / "stage.json")


def test_ranges_count_the_plays_and_the_bracket_leaves_them_out() -> None:
    with_plays, without = stage(), stage(relaxing_plays=None)
    reached, plain = with_plays.position_range, without.position_range
    assert reached is not None and plain is not None
    # Both ends are reached after any rest: so is what the plays may be there at the other end.
    assert LIMITS == (-20.0, 150.0)
    top = 0.01 * 140.0 + 0.05 * 128.0 + 0.04 * 110.0
    bottom = 0.01 * -30.0 + 0.05 * -18.0
    low, high = plain
    middle, room = 0.5 * (top + bottom), min(0.5 * (top - bottom), 0.25 * (high - low))
    np.testing.assert_allclose(reached, (low + middle + room, high + middle - room), rtol=1e-12)
    assert with_plays.slope_range[1] == pytest.approx(without.slope_range[1] + 0.1, rel=1e-12)
    brackets = [one.bracket() for one in (with_plays, without)]
    for u in (20.0, 90.0, 10.0):
        assert brackets[0].step(u) == brackets[1].step(u)


def test_the_command_line_names_the_plays_and_needs_the_time() -> None:
    assert linear_parts(stage()) == ["3 plays that relax, time constants 0.01000 and 0.2000 s"]
    assert not is_static(stage()) and is_static(stage(relaxing_plays=None))


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"thresholds": [1.0, 1.0]}, ValueError, "thresholds[1]: expected"),
        ({"thresholds": []}, ValueError, "thresholds: expected at least one number"),
        ({"time_constants": []}, ValueError, "time_constants: expected at least one number"),
        ({"time_constants": [0.1, 0.0]}, ValueError, "time_constants[1]: expected"),
        ({"weights": [[0.1, 0.2]]}, ValueError, "weights: expected 2 elements"),
        ({"weights": [[0.1], [0.2]]}, ValueError, "weights: expected 2 elements"),
        ({"weights": [0.1, 0.2]}, ValueError, "weights: expected a row for every time constant"),
        ({"weights": [[0.1, math.inf]] * 2}, ValueError, "weights[1]: expected a finite number"),
        ({"origin": math.nan}, ValueError, "origin: expected a finite number"),
        ({"origin": "low"}, TypeError, "origin: expected a number"),
    ],
)
def test_wrong_numbers_are_named(
    change: dict[str, Any], error: type[Exception], message: str
) -> None:
    good: dict[str, Any] = {
        "thresholds": [0.0, 1.0],
        "time_constants": [0.1, 1.0],
        "weights": [[0.1, 0.2], [0.3, 0.4]],
    }
    with pytest.raises(error) as caught:
        mh.plant.RelaxingPlays(**{**good, **change})
    assert str(caught.value).startswith(message) and ", got " in str(caught.value)
    assert parameter_of(caught.value) == next(iter(change))


def test_what_is_no_plays_is_refused() -> None:
    with pytest.raises(TypeError, match="relaxing_plays: expected RelaxingPlays") as caught:
        stage(relaxing_plays=30.0)
    assert parameter_of(caught.value) == "relaxing_plays"


# Identification.

PLAIN: dict[str, Any] = {
    "dt": DT,
    **{"creep": None, "loop_shift": None, "slow_gain": None, "duhem": None, "dynamics": None},
    **{"input_map": None, "output_map": None, "dead_time": 0.0, "amplifier": None},
}


def rates() -> Array:
    """Return loops of several rates that decay, and two rests."""
    parts = []
    for rate in (0.5, 1.5, 5.0, 15.0):
        t = np.arange(int(2500 / rate)) * DT
        size = np.linspace(1.0, 0.15, t.size)
        parts.append(60.0 + 60.0 * size * np.sin(2.0 * np.pi * rate * t))
    way = [np.linspace(60.0, 100.0, 50), np.full(1500, 100.0), np.linspace(100.0, 30.0, 50)]
    return np.concatenate([*parts, *way, np.full(1500, 30.0)])


def held_out() -> Array:
    t = np.arange(6000) * DT
    waves = sum(np.sin(2.0 * np.pi * f * t + p) for f, p in ((0.7, 0.0), (3.1, 1.0), (7.3, 2.0)))
    return np.asarray(60.0 + 15.0 * waves * np.minimum(1.0, t / 0.2))


def relaxing_apart(u: Array) -> Array:
    """Return the positions of twenty plays that each follow by half at once and by half later."""
    thresholds = np.linspace(0.0, 55.0, 20)
    weights = np.r_[0.6, 0.05 * np.exp(-thresholds[1:] / 25.0)]
    decays = np.exp(-DT / (0.03 * (1.0 + thresholds / 20.0)))
    plays, out = np.zeros(20), np.empty(u.size)
    late = None
    for k, now in enumerate(u - u[0]):
        plays = np.minimum(np.maximum(plays, now - thresholds), now + thresholds)
        late = plays if late is None else late
        out[k] = weights[0] * now + 0.5 * weights[1:] @ (plays[1:] + late[1:])
        late = decays * late + (1.0 - decays) * plays
    return out


def begun(made: mh.Stage, u: Array) -> Array:
    """Return the positions from rest at the first drive."""
    forward = made.forward(DT)
    forward.settle(u[0])
    return forward.run(u)


def error_of(found: mh.results.Identification, u: Array, y: Array) -> float:
    return float(np.std(found.predict(u) - y))


def test_given_time_constants_are_found_exactly() -> None:
    u = rates()
    times = [0.02, 0.3]
    # Two of the thresholds that are tried.
    thresholds = np.array([0.15, 0.3]) * 0.5 * np.ptp(u)
    weights = [[0.05, 0.02], [0.0, 0.04]]
    plays = mh.plant.RelaxingPlays(thresholds, times, weights, origin=60.0)
    truth = mh.Stage(hysteresis(input_offset=60.0), relaxing_plays=plays)
    y = begun(truth, u)
    asked = {**PLAIN, "thresholds": hysteresis().r, "ratios": (0.95, 0.3, 0.35)}
    found = mh.identify(u, y, relaxing_plays=times, input_offset=60.0, **asked)
    assert found.relaxing_plays is not None
    assert found.relaxing_plays.time_constants.tolist() == times
    # A threshold more may weigh as little as rounding.
    weighs = found.relaxing_plays.weights.max(axis=0) > 1e-6
    np.testing.assert_allclose(found.relaxing_plays.thresholds[weighs], thresholds)
    np.testing.assert_allclose(found.relaxing_plays.weights[:, weighs], weights, atol=1e-6)
    assert error_of(found, held_out(), begun(truth, held_out())) < 1e-6 * np.ptp(y)


def test_they_are_found_by_default_where_plays_relax_and_predict_better() -> None:
    u, unseen = rates(), held_out()
    y = relaxing_apart(u)
    noise = 5e-4 * np.ptp(y) * np.random.default_rng(1).standard_normal(u.size)
    found = mh.identify(u, y + noise, dt=DT)
    without = mh.identify(u, y + noise, dt=DT, relaxing_plays=None)
    assert found.relaxing_plays is not None and without.relaxing_plays is None
    assert (found.relaxing_plays.weights >= 0.0).all()
    assert found.relaxing_plays_std.shape == found.relaxing_plays.weights.shape
    assert found.stage.relaxing_plays == found.relaxing_plays
    truth = relaxing_apart(unseen)
    assert error_of(found, unseen, truth) < 0.6 * error_of(without, unseen, truth)
    assert pickle.loads(pickle.dumps(found)).relaxing_plays == found.relaxing_plays
    # The stage is what the identification predicts, and its inverse is exact.
    np.testing.assert_allclose(
        begun(found.stage, u), found.predict(u), rtol=0, atol=1e-9 * np.ptp(y)
    )
    stage = found.stage.replace(dynamics=None, dead_time=0.0)
    inverse, forward = stage.inverse(DT), stage.forward(DT)
    inverse.settle(u[0])
    forward.settle(u[0])
    target = found.predict(u)[:4000]
    np.testing.assert_allclose(forward.run(inverse.run(target)), target, rtol=0, atol=1e-9)


def test_there_are_none_where_there_is_nothing_to_relax() -> None:
    u = rates()
    noise = 0.02 * np.random.default_rng(2).standard_normal(u.size)
    found = mh.identify(u, hysteresis().forward().run(u) + noise, dt=DT)
    assert found.relaxing_plays is None
    asked = mh.identify(u, hysteresis().forward().run(u) + noise, relaxing_plays="fit", **PLAIN)
    # What noise makes of weights that are 0 or more.
    plays = asked.relaxing_plays
    assert plays is None or plays.weights.sum() < 0.01


def test_a_position_that_relaxes_while_the_drive_rests_is_no_monitor_at_its_end() -> None:
    # The rest is at the lowest drive, where the position still has a tenth of its range to go.
    way = [np.linspace(30.0, 120.0, 50), np.full(600, 120.0), np.linspace(120.0, 0.0, 5)]
    u = np.concatenate([rates(), *way, np.zeros(1500)])
    y = relaxing_apart(u)
    y += 5e-4 * np.ptp(y) * np.random.default_rng(1).standard_normal(u.size)
    found = mh.identify(u, y, dt=DT, creep=None)
    assert found.relaxing_plays is not None
    assert not {"clipped_input", "stuck_input"} & {one.code for one in found.warnings}


def test_wrong_requests_are_named() -> None:
    u = rates()
    y = hysteresis().forward().run(u)
    with pytest.raises(ValueError, match="sampling interval"):
        mh.identify(u, y, relaxing_plays="fit", **{**PLAIN, "dt": None})
    for wrong, error in (
        ("often", (TypeError, ValueError)),
        ([0.1, 0.1], ValueError),
        ([-1.0], ValueError),
        ([], ValueError),
        (np.linspace(0.01, 1.0, 13), ValueError),
    ):
        with pytest.raises(error, match=r"relaxing_plays.*: expected") as refused:
            mh.identify(u, y, relaxing_plays=wrong, **PLAIN)
        assert parameter_of(refused.value) == "relaxing_plays"
