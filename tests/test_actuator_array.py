"""Arrays of actuators: what each gives alone, models, limits, threads and states."""

from __future__ import annotations

import copy
import json
import math
import pickle
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from actuators import LIMITS, MAKERS, MODELS, M, Make, StreamArray, samples
from hypothesis import given
from hypothesis import strategies as st
from support import AnyModel, Array, Drawn, any_invertible_models, bits


@pytest.fixture(params=MAKERS)
def make(request: pytest.FixtureRequest) -> Make:
    return MAKERS[request.param]


# ---- bit for bit


@st.composite
def arrays(draw: st.DrawFn) -> tuple[list[AnyModel], Array, bool]:
    """Models in any order, each used by several actuators, the same object or an equal one."""
    drawn: list[Drawn] = draw(st.lists(any_invertible_models(), min_size=1, max_size=3))
    made = [each.model() for each in drawn]
    order = draw(st.lists(st.integers(0, len(drawn) - 1), min_size=1, max_size=8))
    models = [made[i] if draw(st.booleans()) else drawn[i].model() for i in order]
    seed, inverse = draw(st.integers(0, 2**32 - 1)), draw(st.booleans())
    x = samples(draw(st.integers(0, 40)), len(models), seed) * draw(st.sampled_from([0.1, 1.0, 30]))
    bad = draw(st.lists(st.integers(0, max(x.size - 1, 0)), max_size=3)) if x.size else []
    x.flat[bad] = draw(st.sampled_from([math.nan, math.inf, 1e300]))
    return models, x, inverse


@given(arrays(), st.sampled_from([1, 2, 3, 7, 9]))
def test_array_equals_independent_streams(
    case: tuple[list[AnyModel], Array, bool], threads: int
) -> None:
    models, x, inverse = case
    mirror = mh.ActuatorArray(models)

    def new() -> StreamArray:
        return mirror.inverse(LIMITS) if inverse else mirror.forward()

    singles = [model.inverse(LIMITS) if inverse else model.forward() for model in models]
    expected = np.array([one.run(column) for one, column in zip(singles, x.T.copy(), strict=True)])
    ran, stepped = new(), new()
    assert bits(ran.run(x, threads=threads)) == bits(np.ascontiguousarray(expected.T))
    for row, outputs in zip(x, expected.T, strict=True):
        ahead = stepped.peek(row)
        assert bits(stepped.step(row)) == bits(ahead) == bits(np.ascontiguousarray(outputs))
    for stream in (ran, stepped):
        assert stream.state == [one.state for one in singles]
        assert stream.rejected.tolist() == [one.rejected for one in singles]
        if isinstance(stream, mh.InverseArray):
            saturated = [one.state["saturated"] for one in singles]
            assert stream.saturated.tolist() == saturated


@pytest.mark.parametrize("threads", [1, 2, 3, 7, M, M + 1, 300, 10**6, np.int64(2)])
@pytest.mark.parametrize("kind", ["new", "out", "in place", "strided"])
def test_threads_change_no_bit(make: Make, threads: int, kind: str) -> None:
    x, one, many = samples(1000), make(), make()
    expected = one.run(x)
    out = {"new": None, "out": np.empty_like(x), "in place": x, "strided": np.empty((1000, 9))}[
        kind
    ]
    if kind == "strided":
        assert out is not None
        out = out[:, ::2]
    y = many.run(x, out=out, threads=threads)
    assert (out is None or y is out) and bits(np.ascontiguousarray(y)) == bits(expected)
    assert many.state == one.state


def test_threads_share_out_many_actuators() -> None:
    mirror = mh.ActuatorArray([mh.paper.table_1_recovered()] * 333)
    x = 3.0 * np.sin(np.linspace(0.0, 9.0, 5000))[:, None] * np.linspace(0.1, 1.0, 333)
    expected = mirror.inverse().run(x)
    for threads in (2, 3, 7):
        assert bits(mirror.inverse().run(x, threads=threads)) == bits(expected)


def test_blocks_between_two_looks_at_signals_join_without_a_seam() -> None:
    mirror = mh.ActuatorArray(MODELS[:3])
    x = samples(2 * 2**20 // 3 + 100, 3)  # more samples than two blocks
    expected = np.stack([m.forward().run(c) for m, c in zip(MODELS, x.T.copy(), strict=False)], 1)
    for threads in (1, 2):
        assert bits(mirror.forward().run(x, threads=threads)) == bits(
            np.ascontiguousarray(expected)
        )


def test_run_equals_step_and_peek_changes_nothing(make: Make) -> None:
    x, ran, stepped = samples(), make(), make()
    y = ran.run(x)
    for row, expected in zip(x, y, strict=True):
        before = stepped.state
        assert bits(stepped.peek(row)) == bits(expected)
        assert stepped.state == before
        assert bits(stepped.step(row)) == bits(expected)


def test_one_bad_sample_holds_its_own_actuator_only(make: Make) -> None:
    x, held, other = samples(), make(), make()
    spoilt = x.copy()
    spoilt[50, 3], spoilt[51, 3], spoilt[50, 1] = math.nan, math.inf, -1e300
    y, expected = held.run(spoilt), other.run(x)
    free = [0, 2, 4]
    assert bits(y[:, free].copy()) == bits(expected[:, free].copy())
    assert y[49, 3] == y[50, 3] == y[51, 3] and y[49, 1] == y[50, 1]
    assert held.rejected.dtype == np.uint64 and held.rejected.tolist() == [0, 1, 0, 2, 0]
    assert not other.rejected.any()


def test_reset_is_a_new_array(make: Make) -> None:
    x, stream = samples(), make()
    rest, expected = stream.state, stream.run(x)
    stream.step([math.nan] * M)
    stream.reset()
    assert stream.state == rest and not stream.rejected.any()
    assert bits(stream.run(x)) == bits(expected)


# ---- models and limits


def test_models_are_kept_once_and_in_order() -> None:
    mirror = mh.ActuatorArray(iter(MODELS))
    assert len(mirror) == len(mirror.forward()) == len(mirror.inverse()) == M
    assert mirror.models == tuple(MODELS)
    assert mirror.models[0] is mirror.models[2]  # two equal models, one kernel
    assert repr(mirror) == "<ActuatorArray of 5 actuators, 4 models>"
    assert repr(mh.ActuatorArray(MODELS[:1] * 2)) == "<ActuatorArray of 2 actuators, 1 model>"


def test_arrays_of_equal_models_are_equal() -> None:
    one, other = mh.ActuatorArray(MODELS), mh.ActuatorArray(tuple(MODELS))
    assert one == other and hash(one) == hash(other)
    assert one != mh.ActuatorArray(MODELS[::-1]) and one != mh.ActuatorArray(MODELS[1:])
    assert one != MODELS and one != tuple(MODELS)
    with pytest.raises(AttributeError):
        one.models = ()  # type: ignore[misc]


def test_an_array_survives_pickle_and_copy() -> None:
    mirror = mh.ActuatorArray(MODELS * 100)
    for other in (pickle.loads(pickle.dumps(mirror)), copy.deepcopy(mirror), copy.copy(mirror)):
        assert other == mirror and repr(other) == repr(mirror)
        x = samples(20, 500)
        assert bits(other.inverse(LIMITS).run(x)) == bits(mirror.inverse(LIMITS).run(x))
    # equal models are kept once, so thousands of them are not thousands of tables
    few, many = (len(pickle.dumps(mh.ActuatorArray(MODELS * k))) for k in (1, 400))
    assert many < 4 * few


NO_MODELS: list[tuple[Any, type[Exception], str]] = [
    ([], ValueError, "models: expected at least one model, got none"),
    (
        MODELS[0],
        TypeError,
        "models: expected a sequence of models ([model] * M for M actuators of one model),"
        " got ModifiedPrandtlIshlinskii",
    ),
    (
        [MODELS[0], None],
        TypeError,
        "models[1]: expected a PrandtlIshlinskii or ModifiedPrandtlIshlinskii,"
        " as models[0] is one, got NoneType",
    ),
    (
        [MODELS[0].forward()],
        TypeError,
        "models[0]: expected a PrandtlIshlinskii, ModifiedPrandtlIshlinskii or Stage, got Forward",
    ),
]


@pytest.mark.parametrize(("models", "kind", "message"), NO_MODELS)
def test_what_is_no_model_is_named(models: Any, kind: type[Exception], message: str) -> None:
    with pytest.raises(kind) as caught:
        mh.ActuatorArray(models)
    assert str(caught.value) == message


def test_the_actuator_that_has_no_inverse_is_named() -> None:
    bad = mh.PrandtlIshlinskii([1.0, -2.0], [0.0, 1.0])
    mirror = mh.ActuatorArray([MODELS[0], MODELS[1], bad])
    mirror.forward().step([1.0, 2.0, 3.0])
    with pytest.raises(mh.NotInvertibleError) as caught:
        mirror.inverse()
    assert str(caught.value) == f"actuator 2: {bad.not_invertible_because}"


def test_every_actuator_keeps_its_own_limits() -> None:
    limits = np.array([[-1.0, 1.0], [-60.0, 60.0], [5.0, 9.0], [-0.5, 30.0], [0.0, 1e100]])
    mirror = mh.ActuatorArray(MODELS)
    stream, x = mirror.inverse(limits), samples()
    singles = [m.inverse(tuple(pair)) for m, pair in zip(MODELS, limits.tolist(), strict=True)]
    got, kept = stream.limits, limits.copy()
    limits[:] = 7.0  # they were copied
    assert got is not None and got.tolist() == kept.tolist()
    for row in x:
        drive = stream.step(row)
        assert bits(drive) == bits([one.step(y) for one, y in zip(singles, row, strict=True)])
        assert stream.saturated.tolist() == [one.saturated for one in singles]
        assert ((kept[:, 0] <= drive) & (drive <= kept[:, 1])).all()
    assert stream.saturated.dtype == np.bool_ and stream.saturated.shape == (M,)


def test_one_pair_of_limits_is_for_all() -> None:
    mirror, x = mh.ActuatorArray(MODELS), samples()
    shared = mirror.inverse(LIMITS)
    expected = shared.run(x)
    assert shared.limits is not None and shared.limits.tolist() == [list(LIMITS)] * M
    same: list[Any] = [
        list(LIMITS),
        np.array(LIMITS),
        [LIMITS] * M,
        np.asfortranarray([LIMITS] * M),
    ]
    for limits in same:
        assert bits(mirror.inverse(limits).run(x)) == bits(expected)
    assert mirror.inverse().limits is None and mirror.inverse(limits=None).limits is None
    two = mh.ActuatorArray(MODELS[:2]).inverse([(-1.0, 1.0), (-2.0, 2.0)])  # rows are actuators
    assert two.step([99.0, -99.0]).tolist() == [1.0, -2.0]


ABOVE = "limits[1]: expected a number above the low limit ="
SHAPE = "limits: expected two numbers (low, high) or an array of shape (5, 2), got shape"


@pytest.mark.parametrize(
    ("limits", "kind", "message"),
    [
        ((5.0, 5.0), ValueError, f"{ABOVE} 5.0, got 5.0"),
        (
            [(-1, 1), (-1, 1), (2, 1), (0, 1), (3, 1)],
            ValueError,
            f"actuator 2: {ABOVE} 2.0, got 1.0",
        ),
        ((math.nan, 1.0), ValueError, "limits[0]: expected a finite number (at most 1e100"),
        ([1.0, 2.0, 3.0], ValueError, f"{SHAPE} (3,)"),
        ([(0, 1)] * 4, ValueError, f"{SHAPE} (4, 2)"),
        (np.ones((2, 5)), ValueError, f"{SHAPE} (2, 5)"),
        (5.0, ValueError, f"{SHAPE} ()"),
        ((None, 5.0), TypeError, "limits: expected real numbers, got dtype object"),
        ("ab", TypeError, "limits: expected real numbers, got dtype <U2"),
        ([(0, 1), (0, 1, 2)], ValueError, "limits: expected an array, got"),
    ],
)
def test_wrong_limits_are_named(limits: Any, kind: type[Exception], message: str) -> None:
    with pytest.raises(kind) as caught:
        mh.ActuatorArray(MODELS).inverse(limits)
    assert str(caught.value).startswith(message)


# ---- states


def test_a_state_survives_pickle_and_json_bit_for_bit(make: Make) -> None:
    stream, x = make(), samples()
    stream.run(x[:111])
    stream.step([0.0, math.nan, 0.0, 0.0, 0.0])
    state = stream.state
    expected = stream.run(x[111:])
    for kept in (pickle.loads(pickle.dumps(state)), json.loads(json.dumps(state))):
        other = make()
        other.state = kept
        assert other.state == state and other.rejected.tolist() == [0, 1, 0, 0, 0]
        assert bits(other.run(x[111:])) == bits(expected)


def test_a_state_is_the_states_of_the_single_streams(make: Make) -> None:
    stream = make()
    stream.run(samples())
    single = (
        MODELS[3].forward() if isinstance(stream, mh.ForwardArray) else MODELS[3].inverse(LIMITS)
    )
    single.run(samples()[:, 3].copy())
    assert stream.state[3] == single.state
    other = make()
    other.state = [*other.state[:3], single.state, *other.state[4:]]
    assert other.state[3] == single.state


def changed(state: list[dict[str, Any]], actuator: int, **entries: Any) -> list[dict[str, Any]]:
    other = copy.deepcopy(state)
    other[actuator].update(entries)
    return other


def test_a_wrong_state_is_named_and_nothing_happens(make: Make) -> None:
    stream, count = make(), "state: expected a list of 5 states, got"
    stream.run(samples(30))
    good = stream.state
    stream.run(samples())
    before = stream.state
    wrong: list[tuple[Any, str]] = [
        (None, f"{count} NoneType"),
        (good[0], f"{count} dict"),
        (good[:4], f"{count} 4"),
        ([*good, good[0]], f"{count} 6"),
        ([*good[:4], 1.0], "actuator 4: state: expected what .state returned"),
        ([*good[:4], {}], "actuator 4: state: expected what .state returned"),
        (changed(good, 3, more=1), "actuator 3: state: expected what .state returned"),
        (changed(good, 2, last_input=math.nan), "actuator 2: state.last_input: expected a finite"),
        (changed(good, 1, saturated=2), "actuator 1: state: expected what .state returned"),
        (good[1:] + good[:1], "actuator 0: state.model: expected the fingerprint"),
    ]
    for state, message in wrong:
        with pytest.raises(ValueError) as caught:
            stream.state = state
        assert str(caught.value).startswith(message), str(caught.value)
        assert "\n" not in str(caught.value)
        assert stream.state == before
    stream.state = good
    assert stream.state == good
