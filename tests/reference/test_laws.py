"""Laws of the plain Python twin on random models and histories.

Here and not in ``tests/test_reference.py``, which keeps to the paper's own numbers.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
import strategies as own
from hypothesis import given, settings
from hypothesis import strategies as st

from reference import (
    CoupledPlay,
    ExactInverse,
    ModifiedPrandtlIshlinskii,
    OneSidedPlay,
    Play,
    PrandtlIshlinskii,
    closed_form_inverse,
)

Thresholds = tuple[float, float, float, float]
KindAndModel = tuple[type[ModifiedPrandtlIshlinskii] | type[PrandtlIshlinskii], own.ModelDict]

laws = settings(max_examples=40, deadline=None)

ANY_MODEL: st.SearchStrategy[KindAndModel] = st.one_of(
    own.modified_models().map(lambda m: (ModifiedPrandtlIshlinskii, m)),
    own.not_nested_models().map(lambda m: (ModifiedPrandtlIshlinskii, m)),
    own.conventional_models().map(lambda m: (PrandtlIshlinskii, m)),
)


@given(own.coupled_play_thresholds(), own.input_histories())
@laws
def test_coupled_play_is_the_sum_of_two_one_sided_plays(
    thresholds: Thresholds, xs: list[float]
) -> None:
    r, ra, rb, rc = thresholds
    whole, up, down = CoupledPlay(r, ra, rb, rc), OneSidedPlay(r, rb), OneSidedPlay(ra, rc)
    for x in xs:
        p, q = up.step(x), down.step(-x)
        # exact: one of p, q is zero; the next line is the formula of the engine page
        assert whole.step(x) == p - q
        assert p == max(0.0, x - r, p) and q == max(0.0, -x - ra, q)


@given(own.coupled_play_thresholds(), own.input_histories())
@laws
def test_one_sided_play_is_the_printed_recurrence(thresholds: Thresholds, xs: list[float]) -> None:
    a, b, *_ = thresholds
    play, p = OneSidedPlay(a, b), 0.0
    for x in xs:
        p = max(0.0, x - a, min(x + b, p))
        assert play.step(x) == p


@given(st.floats(0, 500), own.input_histories())
@laws
def test_play_is_the_coupled_play_with_four_equal_thresholds(r: float, xs: list[float]) -> None:
    assert np.array_equal(Play(r).run(xs), CoupledPlay(r, r, r, r).run(xs))


@given(own.coupled_play_thresholds(), own.input_histories(), st.floats(-2000, 2000))
@laws
def test_first_sample_projects_any_state(
    thresholds: Thresholds, xs: list[float], z0: float
) -> None:
    z = CoupledPlay(*thresholds)
    z.state = z0
    x = xs[0]
    assert z.step(x) == min(max(z0, z.lo(x)), z.hi(x))
    z.reset()
    assert z.state == 0.0


@given(own.modified_models(), own.input_histories(), st.integers(2, 9))
@laws
def test_the_max_min_form_does_not_depend_on_the_sampling(
    model: own.ModelDict, xs: list[float], parts: int
) -> None:
    coarse, fine = (ModifiedPrandtlIshlinskii(**model) for _ in range(2))
    for a, b in pairwise([xs[0], *xs]):
        low, high = min(a, b), max(a, b)
        between = [min(max(a + (b - a) * (k / parts), low), high) for k in range(1, parts)]
        # end points exact, points between monotone (rounding keeps order): exact equality
        assert coarse.step(b) == fine.run([*between, b])[-1]
    assert coarse.outputs == fine.outputs


@given(ANY_MODEL, st.data())
@laws
def test_exact_inverse_round_trip_both_ways(
    kind_and_model: KindAndModel, data: st.DataObject
) -> None:
    kind, keywords = kind_and_model
    xs = data.draw(own.input_histories(keywords))
    model, inverse = kind(**keywords), ExactInverse(kind(**keywords))
    y = model.run(xs)
    # y is known to a few ulp of the largest |y|, and dy/dx >= w_0 turns that into x
    scale = max(1.0, np.abs(xs).max(), np.abs(y).max() / keywords["weights"][0])
    back = inverse.run(y)
    np.testing.assert_allclose(back, xs, rtol=0, atol=1e-13 * scale)
    model.reset()
    np.testing.assert_allclose(model.run(back), y, rtol=0, atol=1e-13 * max(1, np.abs(y).max()))


@given(ANY_MODEL, st.data())
@laws
def test_exact_inverse_holds_at_its_limits_and_says_so(
    kind_and_model: KindAndModel, data: st.DataObject
) -> None:
    kind, keywords = kind_and_model
    xs = data.draw(own.input_histories(keywords))
    low, high = -100.0, 200.0
    forward, inverse = kind(**keywords), ExactInverse(kind(**keywords), (low, high))
    wide = kind(**keywords)
    for y in wide.run(xs):
        reachable = forward.peek(low) <= y <= forward.peek(high)
        limit = high if y > forward.peek(high) else low
        expected = inverse.peek(y)
        x = inverse.step(y)
        assert inverse.saturated == (not reachable)
        assert low <= x <= high and x == expected
        assert reachable or x == limit
        got = forward.step(x)  # the memory advances with the drive that was applied
        assert inverse.model.outputs == forward.outputs
        if reachable:
            assert got == pytest.approx(y, rel=1e-12, abs=1e-10)  # |terms| up to 1e4


@given(own.conventional_models(), st.data())
@laws
def test_closed_form_inverts_the_conventional_model(
    keywords: own.ModelDict, data: st.DataObject
) -> None:
    xs = data.draw(own.input_histories(keywords))
    model = PrandtlIshlinskii(**keywords)
    inverse = PrandtlIshlinskii(
        *closed_form_inverse(keywords["weights"], keywords["thresholds"]),
        input_offset=keywords["output_offset"],
        output_offset=keywords["input_offset"],
    )
    y = model.run(xs)
    scale = max(1.0, np.abs(xs).max(), np.abs(y).max() / keywords["weights"][0])
    np.testing.assert_allclose(inverse.run(y), xs, rtol=0, atol=1e-12 * scale)  # n sums of n


@given(ANY_MODEL, st.data())
@laws
def test_peek_is_step_without_memory_and_rises_between_w0_and_the_sum(
    kind_and_model: KindAndModel, data: st.DataObject
) -> None:
    kind, keywords = kind_and_model
    model = kind(**keywords)
    model.run(data.draw(own.input_histories(keywords)))
    before = model.outputs
    a, b = sorted(data.draw(st.lists(st.floats(-900, 900), min_size=2, max_size=2)))
    ya, yb = model.peek(a), model.peek(b)
    assert ya <= yb and model.outputs == before
    w = keywords["weights"]
    slack = 1e-11 * max(1, abs(ya), abs(yb))  # rounding of two sums, seen through b - a
    assert w[0] * (b - a) - slack <= yb - ya <= sum(w) * (b - a) + slack
    assert model.step(b) == yb


@given(ANY_MODEL, st.data())
@laws
def test_peek_is_straight_between_neighbouring_kinks(
    kind_and_model: KindAndModel, data: st.DataObject
) -> None:
    kind, keywords = kind_and_model
    model = kind(**keywords)
    model.run(data.draw(own.input_histories(keywords)))
    kinks = model.kinks()
    for a, b in pairwise([kinks[0] - 10, *kinks, kinks[-1] + 10]):
        middle = model.peek(a + (b - a) / 2)
        assert middle == pytest.approx((model.peek(a) + model.peek(b)) / 2, rel=1e-11, abs=1e-10)


@given(ANY_MODEL, st.data())
@laws
def test_loops_close_after_one_cycle(kind_and_model: KindAndModel, data: st.DataObject) -> None:
    kind, keywords = kind_and_model
    model = kind(**keywords)
    model.run(data.draw(own.input_histories(keywords)))
    low, high = data.draw(st.tuples(st.floats(-900, 0), st.floats(0, 900)))
    model.run([low, high])
    first = model.outputs
    model.run([low, 0.0, high])
    assert model.outputs == first  # exact: only max and min


@given(own.modified_models(), own.not_nested_models(), own.conventional_models())
@laws
def test_strategies_draw_what_they_say(
    modified: own.ModelDict, scattered: own.ModelDict, conventional: own.ModelDict
) -> None:
    def nested(model: own.ModelDict, *names: str) -> bool:
        return all(np.all(np.diff(model[name]) >= 0) for name in names)

    assert nested(modified, "r", "ra", "rb", "rc") and nested(conventional, "thresholds")
    assert not nested(scattered, "r")
    for model in (modified, scattered, conventional):
        assert model["weights"][0] >= 0.1 and min(model["weights"]) >= 0
