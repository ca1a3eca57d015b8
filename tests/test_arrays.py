"""Arrays in and out of every ``run``: what is read in place, converted, refused, written."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable, Iterator
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support import Array, bits

Runner = mh.Forward | mh.Inverse | mh.Play | mh.CoupledPlay
Make = Callable[[], Runner]

MAKERS: dict[str, Make] = {
    "play": lambda: mh.Play(2.0),
    "coupled play": lambda: mh.CoupledPlay(4.0, 3.0, 1.0, 2.0),
    "forward": lambda: mh.paper.table_1().forward(),
    "bank": lambda: mh.paper.table_1().forward(np.zeros(20)),
    "inverse": lambda: mh.paper.table_1().inverse((-100.0, 100.0)),
    "bank inverse": lambda: mh.paper.table_1().inverse(initial=np.zeros(20)),
}


@pytest.fixture(params=MAKERS)
def make(request: pytest.FixtureRequest) -> Make:
    return MAKERS[request.param]


def samples(count: int = 40) -> Array:
    return np.round(np.random.default_rng(3).uniform(0.0, 120.0, count))


# ---- in


def test_a_new_array_comes_back_and_the_input_stays(make: Make) -> None:
    x = samples()
    kept = x.copy()
    y = make().run(x)
    assert y.dtype == np.float64 and y.shape == x.shape and y.flags.c_contiguous
    assert y.flags.writeable and y.flags.owndata and not np.shares_memory(x, y)
    assert bits(x) == bits(kept)


@pytest.mark.parametrize("dtype", ["i8", "i4", "u2", "f4", "f2", ">f8", ">i4", "g"])
def test_any_real_dtype_is_converted(make: Make, dtype: str) -> None:
    x = samples()
    assert bits(make().run(x.astype(dtype))) == bits(make().run(x))


def test_booleans_are_numbers(make: Make) -> None:
    assert bits(make().run(np.array([True, False]))) == bits(make().run([1.0, 0.0]))


@pytest.mark.parametrize(
    "view",
    [
        lambda x: list(x),
        lambda x: tuple(x),
        lambda x: x.astype(int).tolist(),
        lambda x: np.repeat(x, 3)[::3],
        lambda x: x[::-1].copy()[::-1],
        lambda x: np.stack([x, x], axis=1)[:, 0],
        lambda x: np.asfortranarray(np.stack([x, x]))[0],
        lambda x: memoryview(x),
    ],
    ids=["list", "tuple", "ints", "strided", "reversed", "column", "row", "buffer"],
)
def test_lists_and_views_are_converted(make: Make, view: Callable[[Array], Any]) -> None:
    x = samples()
    assert bits(make().run(view(x))) == bits(make().run(x))


def unaligned(values: Array) -> Array:
    raw = bytearray(b"-" + values.tobytes())
    return np.frombuffer(raw, dtype=np.float64, offset=1)


def test_unaligned_input_is_converted() -> None:
    x = samples()
    for make in MAKERS.values():
        assert bits(make().run(unaligned(x))) == bits(make().run(x))


def test_read_only_input_is_read(make: Make) -> None:
    x = samples()
    x.flags.writeable = False
    assert bits(make().run(x)) == bits(make().run(x.copy()))


@pytest.fixture
def traced() -> Iterator[None]:
    tracemalloc.start()
    yield
    tracemalloc.stop()


@pytest.mark.usefixtures("traced")
def test_c_contiguous_float64_is_read_in_place(make: Make) -> None:
    x, out = np.zeros(500_000), np.empty(500_000)

    def peak(array: Any) -> int:
        tracemalloc.reset_peak()
        before, _ = tracemalloc.get_traced_memory()
        make().run(array, out=out)
        return tracemalloc.get_traced_memory()[1] - before

    assert peak(x) < 100_000 < 4_000_000 <= peak(x.astype("f4"))


@pytest.mark.parametrize(
    ("bad", "dtype"),
    [
        (np.array([1j]), "complex128"),
        (np.array([1.0], dtype=object), "object"),
        ([None], "object"),
        (None, "object"),
        ([10**30], "object"),
        ("abc", "<U3"),
        (["1", "2"], "<U1"),
        (np.array(["2020-01-01"], dtype="M8[s]"), "datetime64"),
    ],
)
def test_no_real_numbers_are_a_type_error_that_names_the_argument(
    make: Make, bad: Any, dtype: str
) -> None:
    with pytest.raises(TypeError, match=f"^input: expected real numbers, got dtype {dtype}"):
        make().run(bad)


@pytest.mark.parametrize("shape", [(), (1, 4), (4, 1), (2, 2, 1), (0, 3)])
def test_a_wrong_shape_is_a_value_error_that_names_it(make: Make, shape: tuple[int, ...]) -> None:
    for dtype in (float, int):
        with pytest.raises(ValueError) as caught:
            make().run(np.zeros(shape, dtype))
        got = f"input: expected a one-dimensional array, got shape {shape}"
        assert str(caught.value) == got


def test_ragged_lists_are_refused_with_the_name(make: Make) -> None:
    with pytest.raises(ValueError, match=r"^input: expected an array"):
        make().run([[1.0, 2.0], [3.0]])


@pytest.mark.parametrize("empty", [[], (), np.zeros(0), np.zeros(0, dtype=int)])
def test_a_run_of_no_samples_gives_none_and_changes_nothing(make: Make, empty: Any) -> None:
    stream = make()
    stream.run(samples())
    before = stream.state
    y = stream.run(empty)
    assert y.shape == (0,) and y.dtype == np.float64
    out = np.zeros(0)
    assert stream.run(empty, out=out) is out
    assert stream.state == before


# ---- out


def test_out_is_what_is_returned(make: Make) -> None:
    x, out = samples(), np.full(40, np.nan)
    assert make().run(x, out=out) is out
    assert bits(out) == bits(make().run(x))
    assert make().run(x, out) is out  # also by position, as in numpy
    assert make().run(list(x), out=out) is out


def test_out_may_be_the_input(make: Make) -> None:
    x = samples()
    expected = make().run(x)
    assert make().run(x, out=x) is x
    assert bits(x) == bits(expected)


@pytest.mark.parametrize("step", [2, 3, -1, -2])
def test_out_may_be_strided(make: Make, step: int) -> None:
    x, room = samples(), np.full(200, -1.0)
    out = room[::step][:40]
    assert make().run(x, out=out) is out
    assert bits(out) == bits(make().run(x))
    assert (room == -1.0).sum() >= 200 - 40  # and nothing beside it


def test_out_may_be_the_strided_input(make: Make) -> None:
    room = samples(80)
    kept, view = room.copy(), room[::2]
    expected = make().run(view.copy())
    assert make().run(view, out=view) is view
    assert bits(view) == bits(expected) and bits(room[1::2]) == bits(kept[1::2])


SLICES = st.builds(
    lambda start, step: (start, step), st.integers(0, 10), st.sampled_from([1, 2, -1])
)


@given(st.sampled_from(sorted(MAKERS)), SLICES, SLICES)
def test_overlapping_views_give_what_separate_ones_do(
    name: str, one: tuple[int, int], other: tuple[int, int]
) -> None:
    room = samples(100)

    def view(start: int, step: int) -> Array:
        return (room if step > 0 else room[::-1])[start :: abs(step)][:40]

    x, out = view(*one), view(*other)
    expected = MAKERS[name]().run(x.copy())
    assert MAKERS[name]().run(x, out=out) is out
    assert bits(out) == bits(expected)


@pytest.mark.parametrize(
    ("out", "kind", "message"),
    [
        (np.zeros(39), ValueError, "out: expected 40 elements, got 39"),
        (np.zeros(41), ValueError, "out: expected 40 elements, got 41"),
        (np.zeros(0), ValueError, "out: expected 40 elements, got 0"),
        (np.zeros(40, "f4"), TypeError, "out: expected a one-dimensional float64 array"),
        (np.zeros(40, "i8"), TypeError, "out: expected a one-dimensional float64 array"),
        (np.zeros(40, ">f8"), TypeError, "out: expected a one-dimensional float64 array"),
        (np.zeros((40, 1)), TypeError, "out: expected a one-dimensional float64 array"),
        ([0.0] * 40, TypeError, "out: expected a one-dimensional float64 array"),
    ],
)
def test_a_wrong_out_is_named_and_nothing_happens(
    make: Make, out: Any, kind: type[Exception], message: str
) -> None:
    stream = make()
    before, kept = stream.state, np.array(out)
    with pytest.raises(kind, match=f"^{message}"):
        stream.run(samples(), out=out)
    assert stream.state == before and np.array_equal(kept, out)


def test_a_read_only_out_is_refused_and_nothing_happens(make: Make) -> None:
    x, stream = samples(), make()
    before = stream.state
    out, view = np.zeros(40), x[:]
    out.flags.writeable = view.flags.writeable = False
    for wrong in (out, view):
        with pytest.raises(ValueError, match=r"^out: expected an array that can be written to$"):
            stream.run(x, out=wrong)
    assert stream.state == before and not out.any() and bits(x) == bits(samples())


def test_wrong_input_leaves_out_and_stream_alone(make: Make) -> None:
    stream, out = make(), np.full(3, 7.0)
    before = stream.state
    with pytest.raises(TypeError):
        stream.run([1j, 2j, 3j], out=out)
    assert stream.state == before and out.tolist() == [7.0] * 3


def test_masked_elements_are_refused_and_an_unused_mask_is_not() -> None:
    x = samples()
    masked = np.ma.masked_array(x, mask=[k == 3 for k in range(x.size)])
    for make in MAKERS.values():
        with pytest.raises(TypeError, match="input: expected an array without masked elements"):
            make().run(masked)
        assert bits(make().run(np.ma.masked_array(x))) == bits(make().run(x))
