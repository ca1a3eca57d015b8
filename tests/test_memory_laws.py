"""The laws of what streams remember, on random models; the same names as in memory_laws.rs."""

from __future__ import annotations

import json
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import mpi_hyst as mh
import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from support import (
    BAD,
    Drawn,
    any_invertible_models,
    any_nested_models,
    bits,
    invertible_models,
    with_history,
    with_oscillations,
)

Case = tuple[Drawn, list[float]]
Case2 = tuple[Drawn, list[float], list[float]]


@given(
    with_history(invertible_models(20)),
    st.lists(st.floats(0.01, 0.99), min_size=1, max_size=40),
)
def test_steps_where_nothing_slides_are_not_remembered(case: Case, parts: list[float]) -> None:
    # Between a reversal and 1 V behind it, less than any operator needs to slide again.
    drawn, xs = case
    model = drawn.with_gaps_of_at_least(1.0).model()
    turn = 5000.0
    walk_back = [turn - part for part in parts]
    forward = model.forward()
    forward.run([*xs, -turn, turn, turn - 0.5])
    before, outputs = forward.state, forward.run(walk_back)
    forward.step(turn - 0.5)
    assert forward.state == before

    inverse = model.inverse()
    inverse.follow([*xs, -turn, turn, turn - 0.995])
    inverse.step(outputs[0])
    before, drives = inverse.state, inverse.run(outputs)
    tolerance = 4e-14 * drawn.drive_scale([turn])  # as in test_laws.py
    np.testing.assert_allclose(drives, walk_back, rtol=0, atol=tolerance)
    inverse.step(outputs[0])
    assert inverse.state == before


@given(with_history(any_invertible_models(), histories=2), st.booleans())
def test_restored_state_continues_bit_for_bit(case: Case2, bank: bool) -> None:
    drawn, xs, ys = case
    model, initial = drawn.model(), drawn.zeros() if bank else None
    limits = (drawn.rest - 60.0, drawn.rest + 60.0)

    def streams() -> list[mh.Forward | mh.Inverse]:
        return [
            model.forward(initial),
            model.inverse(limits, initial),
            model.inverse(None, initial),
        ]

    for one, other in zip(streams(), streams(), strict=True):
        one.run(xs)
        other.run(ys)
        other.state = one.state
        assert other.state == one.state
        if isinstance(one, mh.Inverse) and isinstance(other, mh.Inverse):
            assert other.saturated == one.saturated
        assert bits(other.run(ys)) == bits(one.run(ys))


@given(with_history(any_invertible_models(), histories=2), st.booleans())
def test_reset_is_a_new_stream(case: Case2, bank: bool) -> None:
    drawn, xs, ys = case
    model, initial, limits = drawn.model(), drawn.zeros() if bank else None, (5.0, 60.0)
    for used, new in (
        (model.forward(initial), model.forward(initial)),
        (model.inverse(limits, initial), model.inverse(limits, initial)),
    ):
        used.run([*xs, BAD[0]])
        used.reset()
        assert used.state == new.state and used.rejected == 0
        assert bits(used.run(ys)) == bits(new.run(ys))


def check_stacks(drawn: Drawn, state: dict[str, Any]) -> None:
    """At most n turning points above the virgin state of each family.

    Each has fewer operators than the one below it: on a stack of n + 1 there is always room.
    """
    n = len(drawn.weights)
    for family in (state["memory"]["positive"], state["memory"]["negative"]):
        moved = [point["moved"] for point in family["turning_points"]]
        assert len(moved) <= n
        assert all(n >= below > above for below, above in pairwise([*moved, 0]))
        assert family["moved"] < min(moved, default=n + 1)


@given(with_oscillations(invertible_models()))
def test_memory_is_bounded_by_the_operators(case: Case) -> None:
    drawn, xs = case
    forward = drawn.model().forward()
    limits = (drawn.rest - 300.0, drawn.rest + 400.0)
    inverses = [drawn.model().inverse(), drawn.model().inverse(limits)]
    for x in xs:
        y = forward.step(x)
        check_stacks(drawn, forward.state)
        for inverse in inverses:
            inverse.step(y)
            check_stacks(drawn, inverse.state)


@given(with_oscillations(any_nested_models()))
def test_memory_of_any_weights_is_bounded_by_the_operators(case: Case) -> None:
    drawn, xs = case
    stream = drawn.model().forward()
    for x in xs:
        stream.step(x)
        check_stacks(drawn, stream.state)


def test_memory_can_need_every_turning_point() -> None:
    # Ever smaller swings that each leave one operator more behind.
    stream = mh.PrandtlIshlinskii(np.ones(11), np.arange(11.0)).forward()
    stream.run([(k + 0.25) * (-1.0) ** k for k in range(10, -1, -1)])
    memory = stream.state["memory"]
    counts = [len(memory[name]["turning_points"]) for name in ("positive", "negative")]
    assert counts == [10, 9]


@given(with_history(any_nested_models()))
def test_memory_holds_inputs_of_the_history_in_their_order(case: Case) -> None:
    drawn, xs = case
    centred = Drawn({**drawn.keywords, "input_offset": 0.0})
    stream = centred.model().forward()
    stream.run(xs)
    later = iter([0.0, *xs[:-1]])  # the rest position may be the first reversal
    assert all(any(x == reversal for x in later) for reversal in stream.memory)


def both_methods(drawn: Drawn, limits: tuple[float, float] | None) -> Iterator[list[Any]]:
    """Forward models and inverses by turning points and by the bank, in either order."""
    model = drawn.model()
    for methods in (("turning_points", "bank"), ("bank", "turning_points")):
        yield [model.forward(method=method) for method in methods]
        if model.invertible:
            yield [model.inverse(limits, method=method) for method in methods]


@given(with_history(any_nested_models() | invertible_models(), histories=3))
def test_a_state_goes_on_by_either_method(
    case: tuple[Drawn, list[float], list[float], list[float]],
) -> None:
    drawn, xs, ys, zs = case
    for one, other in both_methods(drawn, (drawn.rest - 300.0, drawn.rest + 400.0)):
        assert one.method != other.method
        scale = drawn.output_scale if isinstance(one, mh.Forward) else drawn.drive_scale
        tolerance = 1e-12 * scale([*xs, *ys, *zs])
        one.run(xs)
        other.run(zs)  # what the taker remembers before makes no difference
        other.state = json.loads(json.dumps(one.state))
        np.testing.assert_allclose(other.run(ys), one.run(ys), rtol=0, atol=tolerance)
        one.state = json.loads(json.dumps(other.state))
        np.testing.assert_allclose(one.run(zs), other.run(zs), rtol=0, atol=tolerance)
