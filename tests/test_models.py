"""The two models as values: arguments, arrays, equality, pickle, files, invertibility."""

from __future__ import annotations

import copy
import math
import pickle
from pathlib import Path
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support import AnyModel, Drawn, any_models, bits, invertible_models, unnested_models

NAMES = {
    mh.PrandtlIshlinskii: ("weights", "thresholds"),
    mh.ModifiedPrandtlIshlinskii: ("weights", "r", "ra", "rb", "rc"),
}
OFFSETS = ("input_offset", "output_offset")


def arrays(model: AnyModel) -> list[np.ndarray]:
    below = ("weights_negative",) if isinstance(model, mh.ModifiedPrandtlIshlinskii) else ()
    return [getattr(model, name) for name in (*NAMES[type(model)], *below)]


def arguments(kind: type[AnyModel]) -> dict[str, Any]:
    return {name: [1.0, 2.0, 3.0] for name in NAMES[kind]}


ARRAY_ARGUMENTS = [(kind, name) for kind, names in NAMES.items() for name in names]


# ---- arguments


@given(any_models())
def test_arguments_read_back_bit_for_bit(drawn: Drawn) -> None:
    model = drawn.model()
    for name, values in drawn.keywords.items():
        assert bits(getattr(model, name)) == bits(values)
    assert model.operators == len(drawn.weights)


@pytest.mark.parametrize(("kind", "name"), ARRAY_ARGUMENTS)
@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 1e101])
def test_numbers_that_are_not_finite_are_named(kind: type[AnyModel], name: str, bad: float) -> None:
    with pytest.raises(ValueError, match=rf"^{name}\[1\]: expected .*, got "):
        kind(**{**arguments(kind), name: [1.0, bad, 3.0]})


@pytest.mark.parametrize(("kind", "name"), ARRAY_ARGUMENTS)
def test_negative_thresholds_are_named(kind: type[AnyModel], name: str) -> None:
    values = {**arguments(kind), name: [1.0, 2.0, -0.5]}
    if name == "weights":
        assert kind(**values).weights[2] == -0.5
        return
    with pytest.raises(ValueError, match=rf"^{name}\[2\]: expected .*, got -0.5$"):
        kind(**values)


@pytest.mark.parametrize(("outer", "inner"), [("r", "rc"), ("ra", "rb")])
def test_an_inner_threshold_above_its_outer_one_is_named(outer: str, inner: str) -> None:
    values = {**arguments(mh.ModifiedPrandtlIshlinskii), inner: [1.0, 2.5, 3.0]}
    with pytest.raises(ValueError) as caught:
        mh.ModifiedPrandtlIshlinskii(**values)
    assert str(caught.value) == f"{inner}[1]: expected 0 <= {inner} <= {outer} = 2.0, got 2.5"


@pytest.mark.parametrize(("kind", "name"), ARRAY_ARGUMENTS)
@pytest.mark.parametrize("length", [0, 2, 4])
def test_unequal_lengths_are_named(kind: type[AnyModel], name: str, length: int) -> None:
    values = {**arguments(kind), name: [0.5] * length}
    if name == "weights":
        what = "weights: expected at least" if length == 0 else rf"\w+: expected {length} elements"
    else:
        what = f"{name}: expected 3 elements, got {length}"
    with pytest.raises(ValueError, match=f"^{what}"):
        kind(**values)


@pytest.mark.parametrize(("kind", "name"), ARRAY_ARGUMENTS)
@pytest.mark.parametrize("bad", [["a", "b", "c"], [1j, 2j, 3j], [None, 1.0, 2.0], None, "abc"])
def test_values_that_are_no_real_numbers_are_named(
    kind: type[AnyModel], name: str, bad: object
) -> None:
    with pytest.raises(TypeError, match=f"^{name}: expected real numbers, got dtype "):
        kind(**{**arguments(kind), name: bad})


@pytest.mark.parametrize(("kind", "name"), ARRAY_ARGUMENTS)
@pytest.mark.parametrize("bad", [1.0, [[1.0, 2.0, 3.0]], np.ones((3, 1))])
def test_wrong_shapes_are_named(kind: type[AnyModel], name: str, bad: object) -> None:
    with pytest.raises(ValueError, match=rf"^{name}: expected a one-dimensional array, got shape "):
        kind(**{**arguments(kind), name: bad})


@pytest.mark.parametrize("kind", NAMES)
@pytest.mark.parametrize("name", OFFSETS)
@pytest.mark.parametrize("bad", [math.nan, math.inf, 1e101])
def test_offsets_that_are_not_finite_are_named(kind: type[AnyModel], name: str, bad: float) -> None:
    with pytest.raises(ValueError, match=f"^{name}: expected a finite number"):
        kind(**arguments(kind), **{name: bad})


@pytest.mark.parametrize("kind", NAMES)
def test_no_operators_are_refused(kind: type[AnyModel]) -> None:
    no_operators: Any = []
    with pytest.raises(ValueError, match=r"^weights: expected at least one element, got none$"):
        kind(**dict.fromkeys(NAMES[kind], no_operators))


@pytest.mark.parametrize("kind", NAMES)
def test_offsets_are_by_keyword_only(kind: type[AnyModel]) -> None:
    with pytest.raises(TypeError, match="positional"):
        kind(*arguments(kind).values(), 1.0)  # type: ignore[call-arg]


@pytest.mark.parametrize("dtype", ["f4", "f2", "i8", "u1", "?", ">f8", "g"])
def test_any_real_dtype_is_converted(dtype: str) -> None:
    values = np.array([0, 1, 1], dtype=dtype)
    model = mh.PrandtlIshlinskii(values, values)
    assert model.weights.dtype == np.float64 and model.weights.tolist() == [0.0, 1.0, 1.0]
    assert model == mh.PrandtlIshlinskii([0, 1, 1], (0, 1, 1))
    assert model == mh.PrandtlIshlinskii(np.repeat(values, 2)[::2], values[::-1][::-1])


def test_a_model_does_not_follow_the_array_it_was_made_of() -> None:
    values = np.array([1.0, 2.0])
    model = mh.PrandtlIshlinskii(values, values)
    values[:] = 9.0
    assert model.weights.tolist() == [1.0, 2.0]


# ---- from_ratios


def test_from_ratios_multiplies_r() -> None:
    r = np.array([0.0, 25.0, 50.0])
    model = mh.ModifiedPrandtlIshlinskii.from_ratios(
        [3, 2, 1], r, ra=0.95, rb=0.3, rc=0.35, input_offset=1.0, output_offset=2.0
    )
    assert model == mh.ModifiedPrandtlIshlinskii(
        [3, 2, 1], r, 0.95 * r, 0.3 * r, 0.35 * r, input_offset=1.0, output_offset=2.0
    )


@pytest.mark.parametrize(
    ("ratios", "message"),
    [
        ({"ra": -1.0}, "ra: expected a finite number >= 0, got -1.0"),
        ({"ra": math.nan}, "ra: expected a finite number >= 0, got NaN"),
        ({"rb": 1.0}, "rb: expected 0 <= rb <= ra = 0.9, got 1.0"),
        ({"rc": 1.5}, "rc: expected a number from 0.0 to 1.0, got 1.5"),
        ({"rc": -0.1}, "rc: expected a number from 0.0 to 1.0, got -0.1"),
    ],
)
def test_impossible_ratios_are_named(ratios: dict[str, float], message: str) -> None:
    with pytest.raises(ValueError) as caught:
        mh.ModifiedPrandtlIshlinskii.from_ratios(
            [1.0], [0.0], **{"ra": 0.9, "rb": 0.35, "rc": 0.35, **ratios}
        )
    assert str(caught.value) == message
    with pytest.raises(ValueError) as caught:
        mh.paper.table_1().parametric_inverse(**ratios)
    assert str(caught.value) == message


# ---- values


@given(any_models())
def test_arrays_are_read_only_and_a_model_does_not_change(drawn: Drawn) -> None:
    model = drawn.model()
    for array in arrays(model):
        assert array.dtype == np.float64 and array.ndim == 1 and array.flags.c_contiguous
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0
    for name in (*NAMES[type(model)], *OFFSETS, "operators", "new"):
        with pytest.raises(AttributeError):
            setattr(model, name, 1.0)


@given(any_models())
def test_models_with_equal_numbers_are_equal_and_hash_alike(drawn: Drawn) -> None:
    one, other = drawn.model(), drawn.model()
    assert one == other and hash(one) == hash(other)
    assert (one != other) is False and len({one, other}) == 1


@given(any_models(), st.data())
def test_one_number_tells_models_apart(drawn: Drawn, data: st.DataObject) -> None:
    name = data.draw(st.sampled_from(["weights", *OFFSETS]))
    value = drawn.keywords[name]
    changed = [value[0] + 0.5, *value[1:]] if name == "weights" else value + 0.5
    assert drawn.model() != Drawn({**drawn.keywords, name: changed}).model()


def test_thresholds_tell_models_apart() -> None:
    one: dict[str, Any] = {"weights": [1.0], "r": [3.0], "ra": [3.0], "rb": [1.0], "rc": [1.0]}
    made = {mh.ModifiedPrandtlIshlinskii(**{**one, name: [2.0]}) for name in one}
    assert len(made) == 5
    assert mh.PrandtlIshlinskii([1], [0]) != mh.PrandtlIshlinskii([1], [1])


def test_equal_weights_below_zero_are_no_split() -> None:
    thresholds: dict[str, Any] = {key: [0.0, 2.0] for key in ("r", "ra", "rb", "rc")}
    plain = mh.ModifiedPrandtlIshlinskii([1.0, 0.5], **thresholds)
    same = mh.ModifiedPrandtlIshlinskii([1.0, 0.5], **thresholds, weights_negative=[1.0, 0.5])
    assert plain == same and hash(plain) == hash(same) and not same.split
    assert same.weights_negative.tolist() == [1.0, 0.5]
    split = mh.ModifiedPrandtlIshlinskii.from_ratios(
        [1.0, 0.5], [0.0, 2.0], ra=1, rb=1, rc=1, weights_negative=[1.0, 0.25]
    )
    assert split != plain and hash(split) != hash(plain) and split.split
    assert repr(split) == "<ModifiedPrandtlIshlinskii of 2 operators, split>"
    # 2 V past the threshold: 4 + 0.5 x 2 above zero, -4 - 0.25 x 2 below
    assert split.forward().run([4.0, -4.0]).tolist() == [5.0, -4.5]
    assert split.inverse().run([5.0, -4.5]) == pytest.approx([4.0, -4.0], rel=1e-14)
    with pytest.raises(ValueError, match="operator 1: expected the same weight in both families"):
        split.parametric_inverse()


def test_wrong_weights_below_zero_are_named() -> None:
    def make(below: object) -> mh.ModifiedPrandtlIshlinskii:
        values: Any = {**arguments(mh.ModifiedPrandtlIshlinskii), "weights_negative": below}
        return mh.ModifiedPrandtlIshlinskii(**values)

    with pytest.raises(ValueError, match=r"^weights_negative: expected 3 elements, got 2$"):
        make([1.0, 2.0])
    with pytest.raises(ValueError, match=r"^weights_negative\[1\]: expected a finite number"):
        make([1.0, math.nan, 1.0])
    with pytest.raises(TypeError, match=r"^weights_negative: expected real numbers"):
        make(["a", "b", "c"])


def test_zeros_of_either_sign_are_equal_and_hash_alike() -> None:
    one, other = mh.PrandtlIshlinskii([1], [0.0]), mh.PrandtlIshlinskii([1], [-0.0])
    assert one == other and hash(one) == hash(other)


def test_models_of_two_kinds_or_anything_else_are_not_equal() -> None:
    play = mh.PrandtlIshlinskii([1], [1])
    coupled = mh.ModifiedPrandtlIshlinskii([1], [1], [1], [1], [1])
    assert play != coupled and play != 1 and play != "play" and play is not None
    with pytest.raises(TypeError):
        assert play < play  # type: ignore[operator]


def test_repr_tells_kind_and_size() -> None:
    assert repr(mh.PrandtlIshlinskii([1, 2], [0, 1])) == "<PrandtlIshlinskii of 2 operators>"
    assert repr(mh.paper.table_1()) == "<ModifiedPrandtlIshlinskii of 20 operators>"


@given(any_models())
def test_pickle_and_copies_are_equal_bit_for_bit(drawn: Drawn) -> None:
    model = drawn.model()
    copies = [
        pickle.loads(pickle.dumps(model, protocol))
        for protocol in range(2, pickle.HIGHEST_PROTOCOL + 1)
    ]
    for other in (*copies, copy.deepcopy(model), copy.copy(model)):
        assert type(other) is type(model) and other == model
        assert list(map(bits, arrays(other))) == list(map(bits, arrays(model)))
        assert bits(other.input_offset) == bits(model.input_offset)
        assert bits(other.output_offset) == bits(model.output_offset)


# ---- files


def files(directory: Path) -> list[str]:
    return sorted(path.name for path in directory.iterdir())


@given(any_models())
def test_save_and_load_bit_for_bit(tmp_path_factory: pytest.TempPathFactory, drawn: Drawn) -> None:
    model, path = drawn.model(), tmp_path_factory.getbasetemp() / "model.json"
    model.save(path)
    loaded = mh.load(str(path))
    assert type(loaded) is type(model) and loaded == model
    assert list(map(bits, arrays(loaded))) == list(map(bits, arrays(model)))
    assert bits(loaded.input_offset) == bits(model.input_offset)
    assert bits(loaded.output_offset) == bits(model.output_offset)


def test_save_leaves_the_model_file_alone_in_its_directory(tmp_path: Path) -> None:
    for model in (mh.paper.table_1(), mh.paper.table_2()):
        model.save(tmp_path / "stage.json")
        assert files(tmp_path) == ["stage.json"]
        assert mh.load(tmp_path / "stage.json") == model


def test_a_save_over_a_directory_fails_and_leaves_no_temporary_file(tmp_path: Path) -> None:
    (tmp_path / "taken").mkdir()
    with pytest.raises(IsADirectoryError, match="taken"):
        mh.paper.table_1().save(tmp_path / "taken")
    assert files(tmp_path) == ["taken"]


def test_a_save_into_no_directory_names_the_file(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError) as caught:
        mh.paper.table_1().save(tmp_path / "none" / "stage.json")
    assert caught.value.filename == str(tmp_path / "none" / "stage.json")
    assert files(tmp_path) == []


# ---- invertible or not


@given(invertible_models() | unnested_models())
def test_an_identity_and_no_negative_weight_are_invertible(drawn: Drawn) -> None:
    model = drawn.model()
    assert model.invertible and model.not_invertible_because is None
    model.inverse()


@pytest.mark.parametrize(
    ("weights", "thresholds", "invertible"),
    [
        ([1.0, 1.0, -1.5], [0, 1, 2], False),  # slope -0.5 where all three slide
        ([1.0, -0.6, 5.0, -0.3], [0, 1, 2, 3], True),  # 1 - 0.9 > 0
        ([1.0, -0.6, 5.0, -0.4], [0, 1, 2, 3], False),  # 1 - 1 = 0
        ([0.6, 0.6, -1.0], [0, 0, 1], True),  # two identities
        ([0.0, 1.0], [0, 1], False),
        ([1.0], [1], False),  # no identity: flat after a reversal
        ([-1.0], [0], False),
    ],
)
def test_the_identity_must_outweigh_all_negative_weights(
    weights: list[float], thresholds: list[float], invertible: bool
) -> None:
    r = thresholds
    for model in (
        mh.PrandtlIshlinskii(weights, r),
        mh.ModifiedPrandtlIshlinskii(weights, r, r, r, r),
    ):
        assert model.invertible is invertible
        reason = model.not_invertible_because
        if invertible:
            assert reason is None
            x = np.array([0.5, 3.0, -2.0, 1.5])
            back = model.inverse().run(model.forward().run(x))
            # 1e-16 of sums near 10, over a slope of at least 0.1
            np.testing.assert_allclose(back, x, rtol=0, atol=1e-13)
            continue
        assert reason is not None and reason.startswith("the model is not invertible: its slope")
        with pytest.raises(mh.NotInvertibleError) as caught:
            model.inverse()
        assert str(caught.value) == reason and "\n" not in reason


def test_not_invertible_error_is_a_value_error() -> None:
    assert issubclass(mh.NotInvertibleError, ValueError)


@pytest.mark.parametrize(
    ("weights", "r"),
    [([1.0], [1.0]), ([1.0, 1.0, 1.0], [0.0, 2.0, 1.0]), ([1.0, -1.0], [0, 1]), ([0.0], [0.0])],
)
def test_no_closed_form_names_the_operator(weights: list[float], r: list[float]) -> None:
    message = r"^no closed-form inverse: operator \d: expected .*, got "
    with pytest.raises(ValueError, match=message):
        mh.PrandtlIshlinskii(weights, r).closed_form_inverse()
    with pytest.raises(ValueError, match=message):
        mh.ModifiedPrandtlIshlinskii(weights, r, r, r, r).parametric_inverse()
