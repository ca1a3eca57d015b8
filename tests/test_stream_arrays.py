"""Streams of arrays of actuators: samples in and out, and the method of each actuator."""

from __future__ import annotations

import copy
import math
import pickle
import re
import tracemalloc
from collections.abc import Callable, Iterator
from typing import Any, Literal

import mpi_hyst as mh
import numpy as np
import pytest
from actuators import LIMITS, MAKERS, MODELS, M, Make, StreamArray, samples
from support import AnyModel, Array, bits

Method = Literal["turning_points", "bank"]


@pytest.fixture(params=MAKERS)
def make(request: pytest.FixtureRequest) -> Make:
    return MAKERS[request.param]


def calls(stream: StreamArray) -> list[tuple[Any, Array]]:
    return [(stream.step, samples()[7]), (stream.peek, samples()[7]), (stream.run, samples())]


def test_a_new_array_comes_back_and_the_input_stays(make: Make) -> None:
    for call, x in calls(make()):
        kept = x.copy()
        y = call(x)
        assert y.dtype == np.float64 and y.shape == x.shape and y.flags.c_contiguous
        assert y.flags.writeable and y.flags.owndata and bits(x) == bits(kept)


def test_real_numbers_in_any_layout_are_converted(make: Make) -> None:
    whole = np.round(samples())
    for k in range(3):
        expected = calls(make())[k][0](whole if k == 2 else whole[7])
        x = whole if k == 2 else whole[7]
        for view in (
            x.astype("i4"),
            x.astype(">f8"),
            x.astype("f4"),
            x.tolist(),
            np.asfortranarray(x),
            np.repeat(x, 2, axis=-1)[..., ::2],
            x.data,
        ):
            assert bits(calls(make())[k][0](view)) == bits(expected)


OUTS: dict[str, Callable[[Array], Array]] = {
    "dense": np.empty_like,
    "by columns": lambda x: np.asfortranarray(np.empty(x.shape)),
    "strided": lambda x: np.full((*x.shape[:-1], 2 * M), -7.0)[..., ::2],
    "the input": lambda x: x,
    "a view of the input": lambda x: x[...],
}


@pytest.mark.parametrize("name", OUTS)
@pytest.mark.parametrize("k", [0, 1, 2])
def test_out_is_what_is_returned(make: Make, name: str, k: int) -> None:
    one, other = make(), make()
    (call, x), (same, _) = calls(one)[k], calls(other)[k]
    expected, out = call(x), OUTS[name](x)
    assert same(x, out=out) is out
    assert bits(np.ascontiguousarray(out)) == bits(expected)
    assert one.state == other.state
    x = samples() if k == 2 else samples()[7]
    assert same(x, out) is out  # also by position, as in numpy
    assert bits(np.ascontiguousarray(out)) == bits(call(x))
    beside = out.base if name == "strided" else None
    assert beside is None or (beside[..., 1::2] == -7.0).all()


def test_an_overlapping_out_gives_what_a_separate_one_does(make: Make) -> None:
    room = samples(101)
    for threads in (1, 2):
        shifted = room.copy()
        expected = make().run(room[:-1].copy())
        make().run(shifted[:-1], out=shifted[1:], threads=threads)
        assert bits(shifted[1:]) == bits(expected) and bits(shifted[0]) == bits(room[0])
    row = np.append(room[3], 0.0)
    expected = make().step(room[3])
    make().step(row[:-1], out=row[1:])
    assert bits(row[1:]) == bits(expected)


@pytest.fixture
def traced() -> Iterator[None]:
    tracemalloc.start()
    yield
    tracemalloc.stop()


@pytest.mark.usefixtures("traced")
@pytest.mark.parametrize("in_place", [False, True])
def test_a_step_into_out_allocates_no_array(in_place: bool) -> None:
    stream = mh.ActuatorArray([MODELS[4]] * 4096).inverse()
    x = np.linspace(-9.0, 9.0, 4096)
    out = x if in_place else np.empty(4096)
    stream.step(x, out=out)
    tracemalloc.reset_peak()
    before, _ = tracemalloc.get_traced_memory()
    for _ in range(10):
        stream.step(x, out=out)
        stream.peek(x, out=out)
    assert tracemalloc.get_traced_memory()[1] - before < 4096


WRONG_ROWS = [(), (4,), (6,), (0,), (1, 5), (5, 1), (2, 2, 5)]
WRONG_BLOCKS = [(), (5,), (10,), (3, 4), (4, 3), (0, 4), (5, 200), (1, 2, 5)]


@pytest.mark.parametrize("shape", WRONG_ROWS)
@pytest.mark.parametrize("method", ["step", "peek"])
def test_a_wrong_shape_of_a_row_is_named(make: Make, method: str, shape: tuple[int, ...]) -> None:
    stream = make()
    before = stream.state
    with pytest.raises(ValueError) as caught:
        getattr(stream, method)(np.ones(shape))
    assert str(caught.value) == f"input: expected an array of shape (5,), got shape {shape}"
    assert stream.state == before


@pytest.mark.parametrize("shape", WRONG_BLOCKS)
@pytest.mark.parametrize("threads", [1, 2])
def test_a_wrong_shape_of_a_block_is_named(
    make: Make, shape: tuple[int, ...], threads: int
) -> None:
    stream = make()
    before = stream.state
    with pytest.raises(ValueError) as caught:
        stream.run(np.ones(shape), threads=threads)
    assert str(caught.value) == f"input: expected an array of shape (samples, 5), got shape {shape}"
    assert stream.state == before


def test_a_block_without_samples_gives_none(make: Make) -> None:
    stream = make()
    before = stream.state
    for threads in (1, 2):
        assert stream.run(np.zeros((0, M)), threads=threads).shape == (0, M)
    assert stream.state == before


@pytest.mark.parametrize(
    ("bad", "message"),
    [
        ([1j] * M, "input: expected real numbers, got dtype complex128"),
        ([None] * M, "input: expected real numbers, got dtype object"),
        (None, "input: expected real numbers, got dtype object"),
        (["1"] * M, "input: expected real numbers, got dtype <U1"),
        (
            np.ma.masked_array(np.ones(M), [m == 2 for m in range(M)]),
            "input: expected an array without mask",
        ),
    ],
)
def test_no_real_numbers_are_a_type_error(make: Make, bad: Any, message: str) -> None:
    stream = make()
    before = stream.state
    for call in (stream.step, stream.peek, stream.run):
        with pytest.raises(TypeError, match=f"^{message}"):
            call(bad)
    assert stream.state == before


ONE, TWO = (
    "a one-dimensional float64 array of 5 elements",
    "a two-dimensional float64 array of shape",
)


@pytest.mark.parametrize(
    ("shape", "out", "kind", "message"),
    [
        ((M,), np.zeros(4), ValueError, "out: expected 5 elements, got 4 elements"),
        ((M,), np.zeros((1, M)), TypeError, f"out: expected {ONE}, got ndarray"),
        ((M,), np.zeros(M, "f4"), TypeError, f"out: expected {ONE}, got ndarray"),
        ((M,), [0.0] * M, TypeError, f"out: expected {ONE}, got list"),
        ((3, M), np.zeros((3, 4)), ValueError, "out: expected shape (3, 5), got shape (3, 4)"),
        ((3, M), np.zeros((5, 3)), ValueError, "out: expected shape (3, 5), got shape (5, 3)"),
        ((3, M), np.zeros(15), TypeError, f"out: expected {TWO} (3, 5), got ndarray"),
        ((3, M), np.zeros((3, M), "i8"), TypeError, f"out: expected {TWO} (3, 5), got ndarray"),
        ((3, M), [[0.0] * M] * 3, TypeError, f"out: expected {TWO} (3, 5), got list"),
    ],
)
def test_a_wrong_out_is_named_and_nothing_happens(
    make: Make, shape: tuple[int, ...], out: Any, kind: type[Exception], message: str
) -> None:
    stream = make()
    before = stream.state
    for call in [stream.step, stream.peek] if len(shape) == 1 else [stream.run]:
        with pytest.raises(kind) as caught:
            call(np.ones(shape), out=out)
        assert str(caught.value) == message
    assert stream.state == before and not np.any(out)


def test_a_read_only_out_is_refused_and_nothing_happens(make: Make) -> None:
    stream = make()
    before = stream.state
    for call, x in calls(stream):
        out = np.zeros(x.shape)
        out.flags.writeable = False
        with pytest.raises(ValueError, match=r"^out: expected an array that can be written to$"):
            call(x, out=out)
        assert not out.any()
    assert stream.state == before


@pytest.mark.parametrize("threads", [0, -1, 1.5, "2", None, [2], 2**70, math.nan])
def test_threads_are_a_whole_number_of_at_least_one(make: Make, threads: Any) -> None:
    stream = make()
    before = stream.state
    with pytest.raises(ValueError) as caught:
        stream.run(samples(), threads=threads)
    expected = f"threads: expected a whole number of at least one, got {threads!r}"
    assert str(caught.value) == expected
    assert stream.state == before


# ---- method

METHODS: list[Method] = ["turning_points", "bank"]
NESTED = [*MODELS[:3], MODELS[4]]  # those that have a choice


def by(method: Method | None, forward: bool, models: list[AnyModel]) -> StreamArray:
    array = mh.ActuatorArray(models)
    return array.forward(method=method) if forward else array.inverse(LIMITS, method=method)


@pytest.mark.parametrize("forward", [True, False])
@pytest.mark.parametrize("method", METHODS)
def test_a_method_is_that_of_every_single_stream(method: Method, forward: bool) -> None:
    models = MODELS if method == "bank" else NESTED
    x = samples(actuators=len(models))
    singles = [
        m.forward(method=method) if forward else m.inverse(LIMITS, method=method) for m in models
    ]
    expected = np.stack([one.run(c) for one, c in zip(singles, x.T.copy(), strict=True)], 1)
    for threads in (1, 2):
        stream = by(method, forward, models)
        assert stream.method == [method] * len(models)
        assert bits(stream.run(x, threads=threads)) == bits(np.ascontiguousarray(expected))
        assert stream.state == [one.state for one in singles]
    stepped = by(method, forward, models)
    assert bits(np.array([stepped.step(row) for row in x])) == bits(np.ascontiguousarray(expected))


def test_without_a_method_each_actuator_has_its_usual_one(make: Make) -> None:
    usual = ["turning_points"] * 3 + ["bank", "turning_points"]
    assert make().method == usual
    forward = isinstance(make(), mh.ForwardArray)
    assert by(None, forward, MODELS).method == usual


@pytest.mark.parametrize("forward", [True, False])
def test_the_method_stays_when_a_stream_is_pickled_copied_and_given_a_model(forward: bool) -> None:
    stream, x = by("bank", forward, MODELS), samples()
    stream.run(x[:150])
    stream.set_model(4, mh.PrandtlIshlinskii([1.5, 0.5], [0.0, 2.0]))
    others = [pickle.loads(pickle.dumps(stream)), copy.copy(stream), copy.deepcopy(stream)]
    expected = stream.run(x[150:])
    for other in others:
        assert other.method == ["bank"] * M
        assert bits(other.run(x[150:])) == bits(expected)
    stream.reset()
    assert stream.method == ["bank"] * M


def test_repr_tells_the_methods(make: Make) -> None:
    name, forward = type(make()).__name__, isinstance(make(), mh.ForwardArray)
    assert repr(make()) == f"<{name} of 5 actuators by bank and turning_points>"
    assert repr(by("bank", forward, MODELS)) == f"<{name} of 5 actuators by bank>"
    assert repr(by(None, forward, NESTED)) == f"<{name} of 4 actuators by turning_points>"


@pytest.mark.parametrize("forward", [True, False])
@pytest.mark.parametrize(("one", "other"), [METHODS, METHODS[::-1]])
def test_a_state_goes_on_by_the_other_method(one: Method, other: Method, forward: bool) -> None:
    x = samples(actuators=4)
    before, after = by(one, forward, NESTED), by(other, forward, NESTED)
    before.run(x[:150])
    after.state = before.state
    assert after.method == [other] * 4
    expected, got = before.run(x[150:]), after.run(x[150:])
    within = 1e-12 * np.ptp(expected, axis=0)
    assert (abs(got - expected) <= within).all() and (within > 0.0).all()


@pytest.mark.parametrize("bad", ["engine", "", 3])
def test_a_method_that_cannot_be_is_named_as_by_a_single_stream(bad: Any) -> None:
    array, single = mh.ActuatorArray(MODELS), MODELS[3]
    makers: list[list[Callable[..., Any]]] = [
        [single.forward, array.forward],
        [single.inverse, array.inverse],
    ]
    for alone, make in makers:
        words = r'^method: expected "turning_points", "bank" or None, got'
        with pytest.raises((ValueError, TypeError), match=words) as expected:
            alone(method=bad)
        with pytest.raises(expected.type, match=f"^{re.escape(str(expected.value))}$"):
            make(method=bad)


def test_a_method_is_no_positional_argument() -> None:
    array = mh.ActuatorArray(MODELS)
    makers: list[tuple[Callable[..., Any], list[Any]]] = [
        (array.forward, ["bank"]),
        (array.inverse, [None, "bank"]),
    ]
    for make, arguments in makers:
        with pytest.raises(TypeError, match="positional argument"):
            make(*arguments)


@pytest.mark.parametrize("limits", [None, LIMITS, [LIMITS] * M])
def test_the_actuator_whose_thresholds_are_not_nested_is_named(limits: Any) -> None:
    array, single = mh.ActuatorArray(MODELS), MODELS[3]
    with pytest.raises(ValueError, match=r"^rb\[2\]: expected nested thresholds") as alone:
        single.forward(method="turning_points")
    with pytest.raises(ValueError) as caught:
        array.forward(method="turning_points")
    assert str(caught.value) == f"actuator 3: {alone.value}"
    with pytest.raises(ValueError) as caught:
        array.inverse(limits, method="turning_points")
    assert str(caught.value) == f"actuator 3: {alone.value}"
