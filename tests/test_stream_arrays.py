"""Samples of arrays of actuators: what is read in place, converted, refused, written."""

from __future__ import annotations

import math
import tracemalloc
from collections.abc import Callable, Iterator
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from actuators import MAKERS, MODELS, M, Make, StreamArray, samples
from support import Array, bits


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
