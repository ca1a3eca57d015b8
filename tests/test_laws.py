"""The laws of the engine on random models and histories; the same names as in laws.rs.

That an array equals independent streams is in ``test_actuator_array.py``.

Bit for bit where the contract says so. Other tolerances are relative to the largest number
that the sums handle (``Drawn.output_scale``), or to what an error of that size moves the
drive by (``Drawn.drive_scale``): 1e-14 is 45 roundings, for sums of up to 8 products that
the two sides form in different orders.
"""

from __future__ import annotations

from itertools import pairwise

import mpi_hyst as mh
import numpy as np
import numpy.typing as npt
import pytest
import reference
import strategies as own
from hypothesis import given
from hypothesis import strategies as st
from support import (
    BAD,
    Drawn,
    any_invertible_models,
    any_models,
    any_nested_models,
    bits,
    invertible_models,
    steps,
    unnested_models,
    walk,
    with_history,
)

Case = tuple[Drawn, list[float]]
Case2 = tuple[Drawn, list[float], list[float]]

AGREE = 1e-14


@given(with_history(any_nested_models(20)))
def test_engine_equals_bank(case: Case) -> None:
    drawn, xs = case
    engine, bank = drawn.model().forward(), drawn.model().forward(initial=drawn.zeros())
    assert (engine.method, bank.method) == ("turning_points", "bank")
    # up to 20 operators, and the engine takes differences of prefix sums
    tolerance = 3 * AGREE * drawn.output_scale(xs)
    np.testing.assert_allclose(steps(engine, xs), steps(bank, xs), rtol=0, atol=tolerance)


@given(with_history(any_models()))
def test_slopes_keep_within_their_range(case: Case) -> None:
    drawn, xs = case
    made = drawn.model()
    outputs = steps(made.forward(), xs)
    least, most = made.slope_range
    tolerance = 3 * AGREE * drawn.output_scale(xs)
    for (x0, x1), (y0, y1) in zip(pairwise(xs), pairwise(outputs.tolist()), strict=True):
        rise, moved = (y1 - y0) * np.sign(x1 - x0), abs(x1 - x0)
        assert least * moved - tolerance <= rise <= most * moved + tolerance


@given(with_history(any_models()))
def test_engine_equals_twin(case: Case) -> None:
    drawn, xs = case
    got, expected = drawn.model().forward().run(xs), drawn.twin().run(xs)
    np.testing.assert_allclose(got, expected, rtol=0, atol=AGREE * drawn.output_scale(xs))


@given(with_history(any_models()), st.data())
def test_bank_from_any_initial_outputs_equals_twin(case: Case, data: st.DataObject) -> None:
    drawn, xs = case
    n = len(drawn.weights)
    z = data.draw(st.lists(st.floats(-2000.0, 2000.0), min_size=n, max_size=n))
    twin = drawn.twin()
    twin.outputs = z
    stream = drawn.model().forward(initial=z)
    assert stream.method == "bank"
    tolerance = AGREE * drawn.output_scale([*xs, 2000.0])
    for x in xs:
        assert stream.peek(x) == pytest.approx(twin.peek(x), rel=0, abs=tolerance)
        assert stream.step(x) == pytest.approx(twin.step(x), rel=0, abs=tolerance)


@given(own.coupled_play_thresholds(), own.input_histories())
def test_coupled_play_is_two_one_sided_plays(
    thresholds: tuple[float, float, float, float], xs: list[float]
) -> None:
    r, ra, rb, rc = thresholds
    z = mh.CoupledPlay(r, ra, rb, rc)
    positive = negative = 0.0
    for x in xs:
        positive = max(0.0, x - r, min(x + rb, positive))
        negative = max(0.0, -x - ra, min(-x + rc, negative))
        assert z.step(x) == positive - negative  # exact: one of the two is zero


@given(st.floats(0.0, 500.0), own.input_histories())
def test_play_is_coupled_play_with_equal_thresholds(r: float, xs: list[float]) -> None:
    play, coupled = mh.Play(r), mh.CoupledPlay(r, r, r, r)
    assert [play.step(x) for x in xs] == [coupled.step(x) for x in xs]


@given(with_history(any_nested_models()), st.integers(2, 20))
def test_sampling_independence(case: Case, parts: int) -> None:
    # Bit for bit: on a branch the line is a function of input and turning points alone.
    drawn, xs = case
    whole, split = drawn.model().forward(), drawn.model().forward()
    for a, b in pairwise([drawn.rest, *xs]):
        assert bits(whole.step(b)) == bits(split.run(walk([a, b], parts))[-1])


@given(with_history(any_models(), histories=2))
def test_wiping_out(case: Case2) -> None:
    # A stroke beyond every threshold and back leaves no trace, to the bit, of what was before.
    drawn, xs, ys = case
    one, other = drawn.model().forward(), drawn.model().forward()
    one.run([*xs, 5000.0, -5000.0])
    other.run([5000.0, -5000.0])
    assert bits(one.run(ys)) == bits(other.run(ys))


@given(with_history(any_models()), st.floats(0.0, 1.0))
def test_return_point_memory(case: Case, inner: float) -> None:
    # A small excursion that comes back to where it began changes nothing.
    drawn, xs = case
    stream = drawn.model().forward()
    before, turn = [drawn.rest, *xs][-2:]
    expected = stream.run(xs)[-1]
    stream.step(turn + (before - turn) * inner)
    assert stream.step(turn) == pytest.approx(expected, abs=AGREE * drawn.output_scale(xs))


@given(with_history(any_models(), histories=2), st.floats(-900.0, 900.0), st.floats(-900.0, 900.0))
def test_congruency(case: Case2, one: float, other: float) -> None:
    # Loops between the same two inputs are congruent whatever came before: for coupled plays
    # too, as for every z = max(lo(x), min(hi(x), z)) with lo and hi that never fall.
    drawn, xs, ys = case
    low, high = sorted([one, other])

    def loop(history: list[float]) -> npt.NDArray[np.float64]:
        y = drawn.model().forward().run([*history, low, *walk([high, low, high], 4)])
        part: npt.NDArray[np.float64] = y[-9:] - y[-9]
        return part

    # four outputs, each with its roundings
    tolerance = 4 * AGREE * drawn.output_scale([*xs, *ys, low, high])
    np.testing.assert_allclose(loop(xs), loop(ys), rtol=0, atol=tolerance)


@given(with_history(any_invertible_models()), st.floats(-2e3, 2e3), st.floats(-2e3, 2e3))
def test_monotone_and_lipschitz(case: Case, one: float, other: float) -> None:
    # w_0 <= slope <= sum w, between any two inputs that may come next.
    drawn, xs = case
    stream = drawn.model().forward()
    stream.run(xs)
    low, high = sorted([one, other])
    rise = stream.peek(high) - stream.peek(low)
    slack = 2 * AGREE * drawn.output_scale([*xs, low, high])
    least, most = drawn.slopes
    assert least * (high - low) - slack <= rise <= most * (high - low) + slack


@given(with_history(invertible_models(20)))
def test_inverse_undoes_forward(case: Case) -> None:
    drawn, xs = case
    back = drawn.model().inverse().run(drawn.model().forward().run(xs))
    np.testing.assert_allclose(back, xs, rtol=0, atol=3 * AGREE * drawn.drive_scale(xs))


@given(with_history(invertible_models(20)))
def test_forward_undoes_inverse(case: Case) -> None:
    drawn, ys = case
    drive = drawn.model().inverse().run(ys)
    tolerance = 3 * AGREE * drawn.output_scale(drive)
    np.testing.assert_allclose(drawn.model().forward().run(drive), ys, rtol=0, atol=tolerance)


@given(with_history(any_invertible_models()))
def test_bank_inverse_undoes_forward(case: Case) -> None:
    drawn, xs = case
    forward = drawn.model().forward(initial=drawn.zeros())
    inverse = drawn.model().inverse(initial=drawn.zeros())
    assert inverse.method == "bank"
    back = inverse.run(forward.run(xs))
    np.testing.assert_allclose(back, xs, rtol=0, atol=3 * AGREE * drawn.drive_scale(xs))


@given(with_history(any_invertible_models()), st.data())
def test_inverse_equals_twin(case: Case, data: st.DataObject) -> None:
    drawn, xs = case
    # targets of a drive within reach, and any others
    inside = drawn.model().forward().run(xs)
    anywhere = data.draw(own.input_histories(drawn.keywords, max_moves=8))
    ys = np.concatenate([inside, anywhere])
    expected = reference.ExactInverse(drawn.twin()).run(ys)
    tolerance = 3 * AGREE * drawn.drive_scale([*xs, *expected])
    np.testing.assert_allclose(drawn.model().inverse().run(ys), expected, rtol=0, atol=tolerance)


LIMITS = st.tuples(st.floats(-800.0, 799.0), st.floats(-799.0, 800.0)).filter(
    lambda pair: pair[0] + 1.0 <= pair[1]
)


@given(with_history(any_invertible_models()), LIMITS)
def test_limited_inverse_equals_twin(case: Case, limits: tuple[float, float]) -> None:
    drawn, xs = case
    ys = drawn.model().forward().run(xs)
    twin = drawn.twin()
    if not limits[0] <= drawn.rest <= limits[1]:
        # the drive cannot rest there: the memory starts at the nearer limit
        twin.step(min(max(drawn.rest, limits[0]), limits[1]))
    exact = reference.ExactInverse(twin, limits)
    inverse = drawn.model().inverse(limits)
    tolerance = 3 * AGREE * drawn.drive_scale([*xs, *limits])
    margin = 3 * AGREE * drawn.output_scale([*xs, *limits])
    for y in map(float, ys):
        least, most = (exact.model.peek(limit) for limit in limits)
        assert inverse.peek(y) == pytest.approx(exact.peek(y), rel=0, abs=tolerance)
        assert inverse.step(y) == pytest.approx(exact.step(y), rel=0, abs=tolerance)
        if min(abs(y - least), abs(y - most)) > margin:  # else rounding may decide
            assert inverse.saturated == exact.saturated


@given(unnested_models())
def test_unnested_thresholds_go_to_the_bank(drawn: Drawn) -> None:
    assert drawn.model().forward().method == "bank"
    assert drawn.model().inverse().method == "bank"


@given(with_history(any_invertible_models()), LIMITS)
def test_out_of_reach_clamps_and_says_so(case: Case, limits: tuple[float, float]) -> None:
    drawn, xs = case
    ys = drawn.model().forward().run(xs)
    inverse, forward = drawn.model().inverse(limits), drawn.model().forward()
    if not limits[0] <= drawn.rest <= limits[1]:
        forward.step(min(max(drawn.rest, limits[0]), limits[1]))
    tolerance = 3 * AGREE * drawn.output_scale([*xs, *limits])
    for y in map(float, ys):
        least, most = (forward.peek(limit) for limit in limits)
        drive = inverse.step(y)
        assert limits[0] <= drive <= limits[1]
        # where the target, clamped to its reach, is: also back from a limit, without a jump
        clamped = min(max(y, least), most)
        assert forward.step(drive) == pytest.approx(clamped, rel=0, abs=tolerance)
        if y > most + tolerance or y < least - tolerance:
            assert inverse.saturated
        if least + tolerance < y < most - tolerance:
            assert not inverse.saturated


@given(with_history(any_invertible_models()), st.sampled_from(BAD), st.booleans())
def test_non_finite_input_holds(case: Case, bad: float, bank: bool) -> None:
    drawn, xs = case
    initial = drawn.zeros() if bank else None
    forward = drawn.model().forward(initial)
    inverse = drawn.model().inverse((drawn.rest - 30.0, drawn.rest + 30.0), initial)
    for count, x in enumerate(xs, start=1):
        for stream in (forward, inverse):
            held = stream.step(x)
            before = stream.state
            assert bits(stream.peek(bad)) == bits(stream.step(bad)) == bits(held)
            assert stream.rejected == count
            assert stream.state == {**before, "rejected": count}


@given(with_history(any_invertible_models()), st.floats(-2e3, 2e3), st.booleans())
def test_peek_changes_nothing(case: Case, probe: float, bank: bool) -> None:
    drawn, xs = case
    initial = drawn.zeros() if bank else None
    for stream in (drawn.model().forward(initial), drawn.model().inverse((-150.0, 50.0), initial)):
        for x in xs:
            before = stream.state
            stream.peek(probe)
            expected = stream.peek(x)
            assert stream.state == before
            assert bits(stream.step(x)) == bits(expected)


@given(with_history(any_invertible_models()), st.integers(1, 40))
def test_run_equals_step(case: Case, parts: int) -> None:
    # In many parts, so that whole blocks lie on a line.
    drawn, points = case
    xs = walk(points, parts).tolist()
    model = drawn.model()
    assert bits(model.forward().run(xs)) == bits(steps(model.forward(), xs))
    assert bits(model.inverse().run(xs)) == bits(steps(model.inverse(), xs))
    limits = (-150.0, 50.0)
    assert bits(model.inverse(limits).run(xs)) == bits(steps(model.inverse(limits), xs))


@pytest.mark.parametrize("n", [1, 2, 20, 300, 2000])
def test_inverse_undoes_forward_for_any_number_of_operators(n: int) -> None:
    rng = np.random.default_rng(n)
    r = np.concatenate([[0.0], np.sort(rng.uniform(0.0, 450.0, n - 1))])
    weights = rng.uniform(0.0, 1.0 / n, n)
    weights[0] = 0.5
    model = mh.ModifiedPrandtlIshlinskii.from_ratios(weights, r, ra=0.95, rb=0.3, rc=0.35)
    walks = np.clip(np.cumsum(rng.normal(0.0, 20.0, 5000)), -500.0, 500.0)
    x = np.concatenate([walks, rng.uniform(-500.0, 500.0, 5000), rng.normal(0.0, 1e-3, 2000)])
    y = model.forward().run(x)
    # the goal that is stated: 1e-11 of the range; engine and bank: 1e-12
    assert np.abs(model.inverse().run(y) - x).max() <= 1e-11 * np.ptp(x)
    bank = model.forward(initial=np.zeros(n)).run(x)
    np.testing.assert_allclose(bank, y, rtol=0, atol=1e-12 * np.ptp(y))
