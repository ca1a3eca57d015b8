"""Play and coupled play: against the plain twin, the paper's figure, and their arguments."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

import mpi_hyst as mh
import pytest
import reference
import strategies as own
from hypothesis import given
from hypothesis import strategies as st
from support import BAD, bits

Operator = mh.Play | mh.CoupledPlay
Thresholds = tuple[float, float, float, float]

STATES = st.floats(-2000.0, 2000.0)


@st.composite
def operators(draw: st.DrawFn) -> tuple[Operator, reference.Play | reference.CoupledPlay]:
    """An operator and its twin, both in the same state."""
    r, *rest = draw(own.coupled_play_thresholds())
    one: Operator
    other: reference.Play | reference.CoupledPlay
    if draw(st.booleans()):
        one, other = mh.Play(r), reference.Play(r)
    else:
        one, other = mh.CoupledPlay(r, *rest), reference.CoupledPlay(r, *rest)
    one.state = other.state = draw(st.just(0.0) | STATES)
    return one, other


@given(operators(), own.input_histories())
def test_operator_equals_twin(
    pair: tuple[Operator, reference.Play | reference.CoupledPlay], xs: list[float]
) -> None:
    one, other = pair
    for x in xs:
        assert one.peek(x) == other.peek(x)  # the same max and min of the same sums: exact
        assert one.step(x) == other.step(x) == one.state


@given(operators(), own.input_histories())
def test_run_equals_step(pair: tuple[Operator, object], xs: list[float]) -> None:
    one, _ = pair
    start = one.state
    stepped = [one.step(x) for x in xs]
    one.state = start
    assert bits(one.run(xs)) == bits(stepped)


@given(operators(), own.input_histories(), own.input_histories())
def test_state_is_the_whole_memory(
    pair: tuple[Operator, object], xs: list[float], ys: list[float]
) -> None:
    one, _ = pair
    one.run(xs)
    kept = one.state
    expected = one.run(ys)
    one.state = kept
    assert bits(one.run(ys)) == bits(expected)


@given(operators(), st.floats(-2000.0, 2000.0), st.sampled_from(BAD))
def test_peek_changes_nothing_and_bad_input_holds(
    pair: tuple[Operator, object], x: float, bad: float
) -> None:
    one, _ = pair
    before = one.state
    one.peek(x)
    assert one.state == before and one.rejected == 0
    assert one.peek(bad) == one.step(bad) == before
    assert one.state == before and one.rejected == 1


@given(operators(), own.input_histories())
def test_reset_is_rest(pair: tuple[Operator, object], xs: list[float]) -> None:
    one, _ = pair
    one.run([*xs, math.nan])
    one.reset()
    assert one.state == 0.0 and one.rejected == 0


@given(own.coupled_play_thresholds())
def test_thresholds_read_back(thresholds: Thresholds) -> None:
    z = mh.CoupledPlay(*thresholds)
    assert (z.r, z.ra, z.rb, z.rc) == thresholds
    assert mh.Play(thresholds[0]).r == thresholds[0]


def test_a_state_out_of_reach_is_projected_by_the_first_sample() -> None:
    z = mh.CoupledPlay(10.0, 8.0, 3.0, 4.0)
    z.state = 99.0
    assert z.state == 99.0
    assert z.step(5.0) == 8.0  # x + rb
    z.state = -99.0
    assert z.step(5.0) == 0.0


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: mh.Play(-1.0), "r: expected a finite number >= 0, got -1.0"),
        (lambda: mh.Play(math.nan), "r: expected a finite number >= 0, got NaN"),
        (lambda: mh.Play(math.inf), "r: expected a finite number >= 0, got inf"),
        (lambda: mh.CoupledPlay(-1, 1, 1, 1), "r: expected a finite number >= 0, got -1.0"),
        (lambda: mh.CoupledPlay(1, math.nan, 1, 1), "ra: expected a finite number >= 0, got NaN"),
        (lambda: mh.CoupledPlay(1, 2, 3, 1), "rb: expected 0 <= rb <= ra = 2.0, got 3.0"),
        (lambda: mh.CoupledPlay(1, 2, -1, 1), "rb: expected 0 <= rb <= ra = 2.0, got -1.0"),
        (lambda: mh.CoupledPlay(1, 2, 1, 1.5), "rc: expected 0 <= rc <= r = 1.0, got 1.5"),
        (lambda: mh.CoupledPlay(1, 2, 1, math.nan), "rc: expected 0 <= rc <= r = 1.0, got NaN"),
    ],
)
def test_impossible_thresholds_are_named(build: Callable[[], object], message: str) -> None:
    with pytest.raises(ValueError) as caught:
        build()
    assert str(caught.value) == message


@pytest.mark.parametrize("bad", BAD)
@pytest.mark.parametrize("z", [mh.Play(1.0), mh.CoupledPlay(1.0, 1.0, 1.0, 1.0)])
def test_a_state_that_is_not_finite_is_refused(z: Operator, bad: float) -> None:
    before = z.state
    with pytest.raises(ValueError, match=r"^state: expected a finite number"):
        z.state = bad
    assert z.state == before


def test_operators_show_their_thresholds() -> None:
    assert repr(mh.Play(2.5)) == "Play(r=2.5)"
    assert repr(mh.CoupledPlay(10, 8, 3, 4)) == "CoupledPlay(r=10, ra=8, rb=3, rc=4)"


@given(own.coupled_play_thresholds(), own.input_histories())
def test_monotone_and_lipschitz(thresholds: Thresholds, xs: list[float]) -> None:
    z = mh.CoupledPlay(*thresholds)
    z.run(xs)
    for a, b in pairwise(sorted(xs)):
        rise = z.peek(b) - z.peek(a)
        # rounding of two sums of numbers up to 1500
        assert -1e-12 <= rise <= b - a + 1e-12
