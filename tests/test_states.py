"""States of streams: kept, restored, and refused where no stream could be in them."""

from __future__ import annotations

import copy
import json
import math
import pickle
from collections.abc import Callable, Iterator
from typing import Any, Literal

import mpi_hyst as mh
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support import (
    BAD,
    WALK,
    Drawn,
    Stream,
    any_invertible_models,
    banks,
    bits,
    model,
    turning_points,
    used,
    with_history,
)

State = dict[str, Any]


@given(with_history(any_invertible_models(), histories=2), st.booleans())
def test_a_state_survives_pickle_and_json_bit_for_bit(
    case: tuple[Drawn, list[float], list[float]], bank: bool
) -> None:
    drawn, xs, ys = case
    initial = drawn.zeros() if bank else None
    made: list[Callable[[], Stream]] = [
        lambda: drawn.model().forward(initial),
        lambda: drawn.model().inverse((-30.0, 70.0), initial),
    ]
    for make in made:
        stream = make()
        stream.run([*xs, math.nan])
        state = stream.state
        expected = stream.run(ys)
        for kept in (pickle.loads(pickle.dumps(state)), json.loads(json.dumps(state))):
            other = make()
            other.state = kept
            assert other.state == state and other.rejected == 1
            assert bits(other.run(ys)) == bits(expected)


def test_a_state_is_a_copy() -> None:
    for stream in used([*turning_points(), *banks()]):
        before, other = stream.state, stream.state
        stream.step(1.0)
        assert before == other and before != stream.state
        before.clear()
        assert other != before and stream.state != before


def leaves(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """The path to every key, list entry and number in a state."""
    items = value.items() if isinstance(value, dict) else enumerate(value)
    for key, inner in items:
        yield (*path, key)
        if isinstance(inner, (dict, list)):
            yield from leaves(inner, (*path, key))


def at(state: State, path: tuple[Any, ...]) -> Any:
    value: Any = state
    for key in path:
        value = value[key]
    return value


def changed(state: State, path: tuple[Any, ...], value: Any) -> State:
    other = copy.deepcopy(state)
    at(other, path[:-1])[path[-1]] = value
    return other


def assert_refused(stream: Stream, state: Any) -> None:
    before, expected = stream.state, stream.peek(1.0)
    with pytest.raises(ValueError, match=r"^state") as caught:
        stream.state = state
    assert "\n" not in str(caught.value)
    assert stream.state == before and stream.peek(1.0) == expected


# Of a bank that is on a line, or that has made small moves; states of earlier versions have none.
LINE = ("memory", "line")
MAY_BE_MISSING = [LINE, ("memory", "small_moves")]

ALL = [0, 1, 2, 3, 4, 5]  # of turning_points() + banks()


@pytest.fixture(params=ALL)
def stream(request: pytest.FixtureRequest) -> Stream:
    chosen: Stream = used([*turning_points(), *banks()])[request.param]
    return chosen


def test_a_state_without_any_one_of_its_keys_is_refused(stream: Stream) -> None:
    for path in leaves(stream.state):
        cut = copy.deepcopy(stream.state)
        del at(cut, path[:-1])[path[-1]]
        if isinstance(path[-1], str) and path not in MAY_BE_MISSING:
            assert_refused(stream, cut)


def test_a_state_of_a_bank_without_its_line_goes_on_but_for_the_last_bits() -> None:
    for stream in used(banks()):
        stream.run(np.linspace(0.9, 1.0, 50))  # moves so small that a line is drawn
        before = stream.state
        memory = {key: value for key, value in before["memory"].items() if key != "line"}
        assert memory != before["memory"]
        expected = stream.run(np.linspace(1.0, 4.0, 50))
        stream.state = {**before, "memory": memory}
        np.testing.assert_allclose(
            stream.run(np.linspace(1.0, 4.0, 50)), expected, rtol=0, atol=1e-12
        )


def test_a_state_with_an_unknown_key_is_refused(stream: Stream) -> None:
    assert_refused(stream, {**stream.state, "more": 1})
    if stream.method == "turning_points":
        assert_refused(stream, changed(stream.state, ("memory", "more"), 1))


def test_a_state_of_a_bank_with_an_unknown_key_is_refused() -> None:
    for stream in banks():
        assert_refused(stream, changed(stream.state, ("memory", "more"), 1))


@pytest.mark.parametrize("wrong", [None, "7", [], {}, 1j])
def test_a_state_with_a_value_of_the_wrong_type_is_refused(stream: Stream, wrong: object) -> None:
    for path in leaves(stream.state):
        if path == LINE and wrong is None:
            continue
        if path != ("saturated",) and type(at(stream.state, path)) is not type(wrong):
            assert_refused(stream, changed(stream.state, path, wrong))


NO_BOOLEANS: list[Any] = [None, "no", [], 2]


def test_saturated_in_a_state_is_true_or_false() -> None:
    for stream in (*turning_points(), *banks()):
        for wrong in NO_BOOLEANS:
            assert_refused(stream, changed(stream.state, ("saturated",), wrong))


@pytest.mark.parametrize("state", [None, 1.0, [], {}, "state", (1, 2)])
def test_anything_but_a_state_is_refused(stream: Stream, state: object) -> None:
    assert_refused(stream, state)


@pytest.mark.parametrize("bad", BAD)
def test_a_state_with_a_number_that_is_not_finite_is_refused(stream: Stream, bad: float) -> None:
    for path in leaves(stream.state):
        unused = isinstance(stream, mh.Forward) and path == ("last_output",)
        if isinstance(at(stream.state, path), float) and not unused:
            assert_refused(stream, changed(stream.state, path, bad))


def test_the_last_output_in_a_state_of_a_forward_stream_is_finite_too() -> None:
    for stream in (model().forward(), model().forward(np.zeros(8))):
        for bad in BAD:
            assert_refused(stream, changed(stream.state, ("last_output",), bad))


@pytest.mark.parametrize("count", [-1, 9, 2**31, 2**64])
def test_counts_beyond_the_operators_are_refused(stream: Stream, count: int) -> None:
    for path in leaves(stream.state):
        if path[-1] in ("moved", "at_zero"):
            assert_refused(stream, changed(stream.state, path, count))
    assert_refused(stream, changed(stream.state, ("rejected",), -1))


def test_turning_points_out_of_order_or_numbered_wrongly_are_refused() -> None:
    drive = [7.0, -4.0, 3.0, -2.0]
    for stream in turning_points():
        stream.run(model().forward().run(drive) if isinstance(stream, mh.Inverse) else drive)
        for family in ("positive", "negative"):
            path = ("memory", family, "turning_points")
            points = at(stream.state, path)
            assert len(points) >= 2
            assert_refused(stream, changed(stream.state, path, points[::-1]))
            assert_refused(stream, changed(stream.state, path, points + points))
            assert_refused(stream, changed(stream.state, (*path, 0, "reversal"), 0))
            assert_refused(stream, changed(stream.state, (*path, 0, "reversal"), 99))


def test_a_state_of_a_larger_model_is_refused() -> None:
    for small, large in ((turning_points(3), turning_points(8)), (banks(3), banks(8))):
        for one, other in zip(used(small), used(large), strict=True):
            assert_refused(one, other.state)
    for one, other in zip(used(banks(8)), used(banks(3)), strict=True):
        assert_refused(one, other.state)


def test_a_state_of_the_other_method_goes_on_and_is_kept() -> None:
    for makers in ((turning_points, banks), (banks, turning_points)):
        for one, other in zip(used(makers[0]()), used(makers[1]()), strict=True):
            other.run([-9.0, 9.0])
            other.state = json.loads(json.dumps(one.state))
            assert other.method != one.method
            assert pickle.loads(pickle.dumps(other)).method == other.method
            np.testing.assert_allclose(other.run(WALK), one.run(WALK), rtol=0, atol=1e-12)


def test_outputs_that_no_drive_leads_to_are_no_state_of_turning_points() -> None:
    bank = model(3).forward([0.0, 5.0, 3.5])
    bank.step(5.0)
    stream = model(3).forward()
    stream.run(WALK)
    assert_refused(stream, bank.state)
    with pytest.raises(ValueError, match="some drive leads to from rest"):
        stream.state = bank.state


def test_an_array_takes_states_of_either_method() -> None:
    models = [model(), model(5)]
    array = mh.ActuatorArray(models).forward()
    banks_of = [made.forward(method="bank") for made in models]
    for bank in banks_of:
        bank.run(WALK)
    array.state = [bank.state for bank in banks_of]
    expected = [bank.step(-2.0) for bank in banks_of]
    np.testing.assert_allclose(array.step([-2.0, -2.0]), expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize("form", ["state", "state_bytes"])
def test_a_controller_goes_on_from_a_state_of_either_method(form: str) -> None:
    limits = (-20.0, 20.0)
    methods: list[Literal["turning_points", "bank"]] = ["turning_points", "bank"]
    made = [
        mh.control.HybridController(
            model().inverse(limits, method=method), kp=0.1, ki=5.0, dt=1e-3, limits=limits
        )
        for method in methods
    ]
    for one, other in (made, made[::-1]):
        for k in range(40):
            one.step(math.sin(0.3 * k), 0.0)
        other.state = one.state if form == "state" else one.state_bytes()
        for k in range(40):
            sample = (math.sin(0.5 * k), 0.1)
            assert other.step(*sample) == pytest.approx(one.step(*sample), rel=0, abs=1e-12)


def test_a_drive_outside_the_limits_is_no_state_of_an_inverse() -> None:
    wide, narrow = model().inverse((-20.0, 20.0)), model().inverse((-2.0, 2.0))
    wide.step(50.0)
    assert_refused(narrow, wide.state)


@given(st.data())
def test_a_changed_state_is_refused_or_goes_on_with_finite_outputs(data: st.DataObject) -> None:
    stream = used([*turning_points(), *banks()])[data.draw(st.sampled_from(ALL))]
    before = stream.state
    state = before
    for _ in range(data.draw(st.integers(1, 3))):
        path = data.draw(st.sampled_from(list(leaves(state))))
        kinds = st.integers(-1, 12) | st.floats(-30, 30) | st.sampled_from(["rising", "falling"])
        state = changed(state, path, data.draw(kinds))
        if not isinstance(state["memory"], dict):
            break
    try:
        stream.state = state
    except ValueError:
        assert stream.state == before
    xs = data.draw(st.lists(st.floats(-30.0, 30.0), min_size=1, max_size=10))
    assert np.isfinite(stream.run(xs)).all() and stream.memory.size <= 16
