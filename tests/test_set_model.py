"""A model swapped into a running stream: the memory stays, the drive does not jump."""

from __future__ import annotations

import math
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from support import (
    AnyModel,
    Drawn,
    any_invertible_models,
    banks,
    bits,
    invertible_models,
    model,
    steps,
    turning_points,
    used,
    with_history,
)


def reweighed(drawn: Drawn, weights: list[float], offset: float) -> AnyModel:
    weights = [weights[0] + 0.1, *weights[1 : len(drawn.weights)]]
    keywords = {**drawn.keywords, "weights": weights, "output_offset": offset}
    if "weights_negative" in keywords:
        # An identity that is split otherwise counts as another operator: not to be swapped in.
        below = keywords["weights_negative"]
        assume(all(drawn.weights[i] == below[i] for i in identities(drawn)))
        below = [
            w if i in identities(drawn) else v
            for i, (w, v) in enumerate(zip(weights, below, strict=True))
        ]
        keywords["weights_negative"] = below
    return Drawn(keywords).model()


def identities(drawn: Drawn) -> list[int]:
    thresholds = [drawn.keywords[name] for name in ("r", "ra", "rb", "rc")]
    return [i for i, row in enumerate(zip(*thresholds, strict=True)) if not any(row)]


WEIGHTS = st.lists(st.floats(0.0, 10.0), min_size=40, max_size=40)
OFFSETS = st.just(0.0) | st.floats(-50.0, 50.0)


@given(with_history(any_invertible_models(), histories=2), st.booleans())
def test_swapping_in_the_same_model_changes_no_bit(
    case: tuple[Drawn, list[float], list[float]], bank: bool
) -> None:
    drawn, xs, ys = case
    initial = drawn.zeros() if bank else None
    made = drawn.model()
    for stream, other in (
        (made.forward(initial), made.forward(initial)),
        (made.inverse((-30.0, 70.0), initial), made.inverse((-30.0, 70.0), initial)),
    ):
        stream.run(xs)
        other.run(xs)
        other.set_model(drawn.model())
        assert other.state == stream.state
        assert bits(other.run(ys)) == bits(stream.run(ys))


@given(with_history(any_invertible_models(), histories=2), WEIGHTS, OFFSETS, st.booleans())
def test_a_stream_goes_on_as_the_new_model(
    case: tuple[Drawn, list[float], list[float]], weights: list[float], offset: float, bank: bool
) -> None:
    drawn, xs, ys = case
    new = reweighed(drawn, weights, offset)
    initial = drawn.zeros() if bank else None
    stream, fresh = drawn.model().forward(initial), new.forward(initial)
    stream.run(xs)
    fresh.run(xs)
    stream.set_model(new)
    assert bits(stream.memory) == bits(fresh.memory)
    # n roundings of the largest sum
    scale = (sum(new.weights) + sum(drawn.weights)) * drawn.input_scale([*xs, *ys]) + 100.0
    np.testing.assert_allclose(steps(stream, ys), steps(fresh, ys), rtol=0, atol=1e-13 * scale)


@given(with_history(invertible_models(), histories=2), WEIGHTS, OFFSETS, st.booleans())
def test_an_inverse_goes_on_as_the_new_model_without_a_jump(
    case: tuple[Drawn, list[float], list[float]], weights: list[float], offset: float, bank: bool
) -> None:
    drawn, xs, ys = case
    old, new = drawn.model(), reweighed(drawn, weights, offset)
    initial = drawn.zeros() if bank else None
    inverse, actuator = old.inverse((-600.0, 600.0), initial), new.forward()
    drives = inverse.run(old.forward().run(xs))
    reached = actuator.run(drives)[-1]
    inverse.set_model(new)
    assert inverse.peek(math.nan) == drives[-1]  # held
    scale = (sum(new.weights) + sum(drawn.weights)) * max(
        600.0, drawn.input_scale([*xs, *ys])
    ) + 100.0
    assert inverse.step(reached) == pytest.approx(drives[-1], abs=1e-12 * scale / new.weights[0])
    for target in ys:
        drive = inverse.step(target)
        assert -600.0 <= drive <= 600.0
        y = actuator.step(drive)
        assert inverse.saturated or y == pytest.approx(target, abs=1e-12 * scale)


def test_other_operators_are_refused_and_change_nothing() -> None:
    others: list[tuple[Any, type[Exception], str]] = [
        (model(7), ValueError, "model: expected the number of operators of the running stream, .*"),
        (
            mh.PrandtlIshlinskii(np.ones(8), np.arange(8.0) * 1.5),
            ValueError,
            "model: expected the r of .*, 1, got 1.5",
        ),
        (
            mh.PrandtlIshlinskii(np.ones(8), np.arange(8.0), input_offset=2.0),
            ValueError,
            "model: expected the input_offset of the running stream, 0, got 2",
        ),
        (
            "model",
            TypeError,
            "model: expected a PrandtlIshlinskii or a ModifiedPrandtlIshlinskii, got 'model'",
        ),
    ]
    for stream in used([*turning_points(), *banks()]):
        before = stream.state
        for other, kind, message in others:
            with pytest.raises(kind, match=f"^{message}$"):
                stream.set_model(other)
        if isinstance(stream, mh.Inverse):
            with pytest.raises(mh.NotInvertibleError):
                stream.set_model(mh.PrandtlIshlinskii([1.0, *[-1.0] * 7], np.arange(8.0)))
        assert stream.state == before
