"""Streams of a model beyond the laws: method, start, memory, limits, samples that are refused.

Arrays in and out are in ``test_arrays.py``, states in ``test_states.py``.
"""

from __future__ import annotations

import math
import pickle
from typing import Any, Literal

import mpi_hyst as mh
import numpy as np
import pytest
from support import BAD, THRESHOLDS, banks, model, turning_points, used

# ---- method


def test_nested_thresholds_in_any_order_run_on_turning_points() -> None:
    shuffled = mh.PrandtlIshlinskii(np.ones(8), np.random.default_rng(1).permutation(THRESHOLDS))
    for stream in (*turning_points(), shuffled.forward(), shuffled.inverse()):
        assert stream.method == "turning_points"


def test_initial_outputs_and_thresholds_that_are_not_nested_run_on_the_bank() -> None:
    crossed = mh.ModifiedPrandtlIshlinskii([1, 1, 1], [0, 1, 2], [0, 1, 2], [0, 1, 0], [0, 0, 0])
    for stream in (*banks(), crossed.forward(), crossed.inverse()):
        assert stream.method == "bank" and stream.memory.size == 0


@pytest.mark.parametrize("method", ["turning_points", "bank"])
def test_a_method_may_be_chosen_and_stays_when_pickled(
    method: Literal["turning_points", "bank"],
) -> None:
    drive = np.random.default_rng(2).uniform(-20, 20, 200)
    chosen, usual = model().forward(method=method), model().forward()
    assert chosen.method == method
    np.testing.assert_allclose(chosen.run(drive), usual.run(drive), rtol=0, atol=1e-12)
    inverse = model().inverse((-20, 20), method=method)
    targets = model().forward().run(drive)
    np.testing.assert_allclose(inverse.run(targets), drive, rtol=0, atol=1e-9)
    for stream in (chosen, inverse):
        again = pickle.loads(pickle.dumps(stream))
        assert again.method == method and again.step(1.5) == stream.step(1.5)


def test_a_method_that_cannot_be_is_named() -> None:
    words = 'method: expected "turning_points", "bank" or None, got '
    beside = 'method: expected "bank" or None beside initial, got "turning_points"'
    for make in (model().forward, model().inverse):
        with pytest.raises(ValueError, match=f'^{words}"engine"$'):
            make(method="engine")  # type: ignore[arg-type]
        with pytest.raises(TypeError, match=f"^{words}3$"):
            make(method=3)  # type: ignore[arg-type]
        with pytest.raises(ValueError, match=f"^{beside}$"):
            make(initial=np.zeros(8), method="turning_points")
    assert model().forward(np.zeros(8), method="bank").method == "bank"
    crossed = mh.ModifiedPrandtlIshlinskii([1, 1, 1], [0, 1, 2], [0, 1, 2], [0, 1, 0], [0, 0, 0])
    with pytest.raises(ValueError, match=r"^rb\[2\]: expected nested thresholds"):
        crossed.forward(method="turning_points")


def test_repr_tells_the_method_and_the_limits() -> None:
    shown = [repr(stream) for stream in (*turning_points(), *banks())]
    assert shown == [
        "<Forward by turning_points>",
        "<Inverse by turning_points>",
        "<Inverse by turning_points, limits (-20, 20)>",
        "<Forward by bank>",
        "<Inverse by bank>",
        "<Inverse by bank, limits (-20, 20)>",
    ]


def test_streams_come_from_models_only() -> None:
    for kind in (mh.Forward, mh.Inverse):
        with pytest.raises(TypeError, match="cannot create"):
            kind()


# ---- initial outputs


def test_initial_outputs_are_where_a_stream_starts_and_where_reset_goes() -> None:
    forward = mh.PrandtlIshlinskii([1, 1], [0, 5]).forward(initial=[3, -4])
    assert forward.step(0.0) == -4.0  # the identity takes 0, the play stays
    forward.run([100.0, -100.0])
    forward.reset()
    assert forward.step(0.0) == -4.0
    inverse = mh.PrandtlIshlinskii([1, 1], [0, 5]).inverse(initial=[3, -4])
    assert inverse.step(-4.0) == 0.0


@pytest.mark.parametrize(
    ("initial", "message"),
    [
        ([0.0] * 7, "initial: expected 8 elements, got 7"),
        ([0.0] * 9, "initial: expected 8 elements, got 9"),
        ([0.0] * 7 + [math.nan], r"initial\[7\]: expected a finite number .*, got NaN"),
        (np.zeros((2, 4)), r"initial: expected a one-dimensional array, got shape \(2, 4\)"),
    ],
)
def test_wrong_initial_outputs_are_named(initial: object, message: str) -> None:
    for make in (lambda: model().forward(initial), lambda: model().inverse(initial=initial)):  # type: ignore[arg-type]
        with pytest.raises(ValueError, match=f"^{message}$"):
            make()
    with pytest.raises(TypeError, match=r"^initial: expected real numbers, got dtype complex128$"):
        model().forward(np.zeros(8, dtype=complex))


# ---- samples that are refused


@pytest.mark.parametrize("bad", BAD)
def test_bad_samples_hold_and_are_counted(bad: float) -> None:
    for stream in used([*turning_points(), *banks()]):
        held, state = stream.step(2.0), stream.state
        assert stream.run([bad, bad]).tolist() == [held, held]
        assert stream.step(bad) == held and stream.rejected == 3
        assert stream.peek(bad) == held and stream.rejected == 3
        assert stream.state == {**state, "rejected": 3}
        stream.reset()
        assert stream.rejected == 0


def test_a_bad_first_sample_holds_the_output_at_rest() -> None:
    made = mh.PrandtlIshlinskii([1, 1], [0, 1], input_offset=2.0, output_offset=5.0)
    assert made.forward().step(math.nan) == 5.0
    assert made.inverse().step(math.nan) == 2.0
    assert made.inverse((3.0, 4.0)).step(math.nan) == 3.0


@pytest.mark.parametrize("bad", ["a", None, [1.0], 1j])
def test_a_sample_that_is_no_real_number_is_a_type_error(bad: Any) -> None:
    for stream in used([*turning_points(), *banks()]):
        before = stream.state
        for call in (stream.step, stream.peek):
            with pytest.raises(TypeError):
                call(bad)
        assert stream.state == before


# ---- limits


@pytest.mark.parametrize(
    ("limits", "message"),
    [
        ((1.0, 1.0), r"limits\[1\]: expected a number above the low limit = 1.0, got 1.0"),
        ((2.0, -1.0), r"limits\[1\]: expected a number above the low limit = 2.0, got -1.0"),
        ((math.nan, 1.0), r"limits\[0\]: expected a finite number .*, got NaN"),
        ((0.0, math.inf), r"limits\[1\]: expected a finite number .*, got inf"),
    ],
)
def test_impossible_limits_are_named(limits: tuple[float, float], message: str) -> None:
    for initial in (None, np.zeros(8)):
        with pytest.raises(ValueError, match=f"^{message}$"):
            model().inverse(limits, initial)


@pytest.mark.parametrize("limits", [(1.0,), (1.0, 2.0, 3.0), 5.0, "ab", (None, 1.0)])
def test_limits_that_are_no_pair_of_numbers_are_refused(limits: Any) -> None:
    with pytest.raises((TypeError, ValueError)):
        model().inverse(limits)


def test_limits_read_back() -> None:
    assert model().inverse((-3.0, 4.5)).limits == (-3.0, 4.5)
    assert model().inverse().limits is None


@pytest.mark.parametrize("initial", [None, np.zeros(8)])
def test_a_target_out_of_reach_saturates_and_comes_back_without_a_jump(initial: Any) -> None:
    inverse, reach = model().inverse((-20.0, 20.0), initial), model().forward().step(20.0)
    assert not inverse.saturated
    assert inverse.step(reach + 1.0) == 20.0 and inverse.saturated
    assert inverse.peek(0.0) < 20.0 and inverse.saturated  # as of the last step
    # right after the reversal the identity alone moves: slope 1
    assert inverse.step(reach - 0.25) == 19.75 and not inverse.saturated
    assert inverse.step(-1e9) == -20.0 and inverse.saturated
    inverse.reset()
    assert not inverse.saturated


def test_a_target_at_the_limit_is_in_reach() -> None:
    inverse, reach = model().inverse((-20.0, 20.0)), model().forward().step(20.0)
    assert inverse.step(reach) == 20.0 and not inverse.saturated


@pytest.mark.parametrize("limits", [(5.0, 60.0), (-60.0, -5.0)])
def test_a_rest_outside_the_limits_starts_at_the_nearer_one(limits: tuple[float, float]) -> None:
    start = min(limits, key=abs)
    inverse, forward = model().inverse(limits), model().forward()
    y = forward.step(start)
    assert inverse.step(y) == start and not inverse.saturated
    assert inverse.step(0.0) == start and inverse.saturated


# (-1.8 + 4.2) - 4.2 is one rounding above -1.8
@pytest.mark.parametrize(("offset", "limits"), [(-4.2, (-1.8, -1.0)), (0.0, (-0.1, 0.3))])
def test_a_saturated_drive_is_the_limit_itself(offset: float, limits: tuple[float, float]) -> None:
    inverse = mh.PrandtlIshlinskii([1.0, 0.5], [0.0, 0.2], input_offset=offset).inverse(limits)
    assert (inverse.step(-99.0), inverse.step(99.0)) == limits


# ---- memory


def memory_of(points: list[float]) -> list[float]:
    stream = mh.PrandtlIshlinskii(np.ones(101), np.arange(101.0)).forward()
    stream.run(points)
    return [float(x) for x in stream.memory]


@pytest.mark.parametrize(
    ("points", "memory"),
    [
        ([], []),
        ([50], []),  # the virgin curve has no reversal yet
        ([50, 40], [50]),
        ([50, 45, 40], [50]),
        ([50, -30, 20, -10, 5], [50, -30, 20, -10]),
        ([50, -30, 20, -10, 20.5], [50, -30]),  # past 20: the loop 20, -10 is wiped out
        ([50, -30, 20, -10, 5, -10.5], [50, -30, 20]),
        ([50, -30, 20, -10, -30.5], [50]),
        ([50, -30, 20, -10, 60], []),  # past everything: the virgin curve again
        ([50, -60], []),
        ([50, -60, 30], [-60]),
        ([50, -30, -30, 20, 20], [50, -30]),
    ],
)
def test_memory_is_the_reversals_not_yet_passed(points: list[float], memory: list[float]) -> None:
    assert memory_of(points) == memory
    assert memory_of([-x for x in points]) == [-x for x in memory]


def test_memory_is_in_the_unit_of_the_input() -> None:
    made = mh.PrandtlIshlinskii(np.ones(101), np.arange(101.0), input_offset=7.0, output_offset=1.0)
    forward, inverse = made.forward(), made.inverse()
    drive = [57.0, -23.0, 27.0, 12.0]
    inverse.run(forward.run(drive))
    assert forward.memory.tolist() == drive[:3]
    # a drive is solved for: 1e-16 of outputs near 2500 over a slope of 1
    np.testing.assert_allclose(inverse.memory, drive[:3], rtol=0, atol=1e-11)


@pytest.mark.parametrize("limits", ["ab", (1.0,), (1.0, 2.0, 3.0), 5.0, (None, 1.0)])
def test_limits_that_are_not_two_numbers_are_named(limits: Any) -> None:
    with pytest.raises(TypeError, match=r"^limits: expected two numbers \(low, high\), got "):
        mh.paper.table_1().inverse(limits)


@pytest.mark.parametrize("weight", [1e-310, 1e-320, 5e-324, 1e-101])
def test_a_slope_whose_reciprocal_is_not_finite_has_no_inverse(weight: float) -> None:
    with pytest.raises(mh.NotInvertibleError, match="exceeds 1e-100"):
        mh.PrandtlIshlinskii([weight], [0.0]).inverse((-500.0, 500.0))


def test_the_smallest_slopes_have_finite_inverses() -> None:
    inverse = mh.PrandtlIshlinskii([1e-99, 1e-99], [0.0, 1.0]).inverse((-500.0, 500.0))
    assert inverse.step(0.0) == 0.0 and not inverse.saturated
    assert inverse.step(1e100) == 500.0 and inverse.saturated
