"""Wrong input: a named exception, one line that says what and where, and nothing half-done.

Constructor arguments are in ``test_models.py`` and ``test_operators.py``, arrays and states of
streams in ``test_arrays.py`` and ``test_states.py``; here records and model files.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from support import AnyModel, Array

Record = tuple[Array, Array]
SCHEMAS = 'schema: expected "mpi_hyst/stage/1", "mpi_hyst/model/1" or "mpi_hyst/model/2"'


def good(samples: int = 200) -> Record:
    u = mh.signals.decaying_triangle(500.0, 1.0, cycles=10, rate=samples / 10)
    return u, mh.paper.table_1().forward().run(u)


def refusal(kind: type[Exception], *arguments: Any, **options: Any) -> str:
    with pytest.raises(kind) as caught:
        mh.identify(*arguments, **options)
    assert type(caught.value) is kind
    message = str(caught.value)
    assert message and "\n" not in message
    return message


def spoilt(values: Array, index: int, value: float) -> Array:
    other: Array = values.copy()
    other[index] = value
    return other


# ---- records


COUNT = "operators: expected a whole number of at least one"


@pytest.mark.parametrize(("bad", "shown"), [(math.nan, "NaN"), (math.inf, "inf")])
def test_a_sample_that_is_not_finite_is_named(bad: float, shown: str) -> None:
    u, y = good()
    domain = "expected a finite number (at most 1e100 in magnitude), got"
    assert refusal(ValueError, spoilt(u, 7, bad), y) == f"u[7]: {domain} {shown}"
    assert refusal(ValueError, u, spoilt(y, 8, bad)) == f"y[8]: {domain} {shown}"
    # also where it is not fitted: it moves the operators
    assert refusal(ValueError, spoilt(u, 7, bad), y, skip=50) == f"u[7]: {domain} {shown}"
    records = [(u, y), (u, spoilt(y, 9, bad))]
    assert refusal(ValueError, records) == f"record 1: y[9]: {domain} {shown}"


def test_a_sample_beyond_1e100_is_named_in_few_digits() -> None:
    u, y = good()
    message = refusal(ValueError, spoilt(u, 7, 1e300), y)
    assert message.startswith("u[7]: expected a finite number") and len(message) < 100


def test_unequal_lengths_are_named() -> None:
    u, y = good()
    assert refusal(ValueError, u, y[:-1]) == "y: expected 200 samples, got 199"
    assert (
        refusal(ValueError, [(u, y), (u[:-1], y)]) == "record 1: y: expected 199 samples, got 200"
    )


def test_a_constant_input_or_output_is_named() -> None:
    u, y = good()
    flat = np.full(200, 2.5)
    vary = "expected fitted samples that vary, got 2.5 throughout"
    assert refusal(ValueError, flat, y) == f"u: {vary}"
    assert refusal(ValueError, u, flat) == f"y: {vary}"
    assert refusal(ValueError, [(u, y), (flat, y)]) == f"record 1: u: {vary}"
    small = "expected fitted samples that vary by 1e-100 at least, got a range of "
    assert refusal(ValueError, u, 1e-300 * y).startswith(f"y: {small}")
    rests = np.concatenate([u, flat])
    assert refusal(ValueError, rests, np.concatenate([y, y]), skip=200) == f"u: {vary}"


def test_too_few_samples_for_the_operators_are_counted() -> None:
    u, y = good()
    # twice 20 weights, one output offset, three ratios, input offset and delay
    expected = "records: expected at least 52 fitted samples (twice the unknowns), got 51"
    assert refusal(ValueError, u[:51], y[:51], ratios="fit") == expected
    assert refusal(ValueError, u[:71], y[:71], skip=20, ratios="fit") == expected
    assert mh.identify(u[:52], y[:52], ratios="fit").fit.samples == 52
    # Plays have neither ratios nor an input offset to search.
    assert mh.identify(u[:44], y[:44], operators=20).ratios == (1.0, 1.0, 1.0)


@pytest.mark.parametrize("skip", [200, 201, 10**9])
def test_a_skip_of_everything_is_named(skip: int) -> None:
    expected = f"skip: expected fewer than the 200 samples of the record, got {skip}"
    assert refusal(ValueError, *good(), skip=skip) == expected


@pytest.mark.parametrize("skip", [-1, [1, 2], [], "5", 1.5])
def test_a_skip_that_is_no_count_of_samples_is_named(skip: Any) -> None:
    message = refusal(ValueError, *good(), skip=skip)
    assert message.startswith("skip: expected a number of samples, or a ") and ", got " in message


def test_empty_records_and_no_records_are_refused() -> None:
    assert refusal(ValueError, [], []) == "u: expected samples, got none"
    assert refusal(ValueError, []) == "records: expected at least one, got none"


@pytest.mark.parametrize("bad", [["a"] * 200, [1j] * 200, None])
def test_a_record_of_no_real_numbers_is_a_type_error(bad: Any) -> None:
    u, y = good()
    assert refusal(TypeError, bad, y).startswith("u: expected real numbers, got dtype ")
    if bad is not None:
        assert refusal(TypeError, u, bad).startswith("y: expected real numbers, got dtype ")
        message = refusal(TypeError, [(u, y), (u, bad)])
        assert message.startswith("record 1: y: expected real numbers, got dtype ")


def test_a_record_of_another_shape_is_named() -> None:
    u, y = good()
    got = "expected a one-dimensional array, got shape (200, 1)"
    assert refusal(ValueError, u[:, None], y) == f"u: {got}"
    assert refusal(ValueError, u, y[:, None]) == f"y: {got}"


def test_an_input_without_its_output_is_refused() -> None:
    message = refusal(TypeError, good()[0])
    assert message == "u: expected an array with y beside it, or a list of (u, y) pairs alone"


@pytest.mark.parametrize(
    ("kind", "options", "message"),
    [
        (ValueError, {"model": "play"}, 'model: expected "modified" or "conventional", got "play"'),
        (ValueError, {"operators": 0}, f"{COUNT}, got 0"),
        (ValueError, {"operators": -3}, f"{COUNT}, got -3"),
        (ValueError, {"operators": 2**70}, f"{COUNT}, got 1180591620717411303424"),
        (ValueError, {"operators": 2.5}, f"{COUNT}, got 2.5"),
        (ValueError, {"thresholds": []}, "operators: expected at least one, got none"),
        (ValueError, {"thresholds": [0, 2, 1]}, "thresholds[2]: expected finite thresholds >= 0"),
        (ValueError, {"thresholds": [-1, 2]}, "thresholds[0]: expected finite thresholds >= 0"),
        (ValueError, {"thresholds": [0, math.nan]}, "thresholds[1]: expected finite thresholds"),
        (TypeError, {"thresholds": ["a"]}, "thresholds: expected real numbers, got dtype <U1"),
        (ValueError, {"ratios": (0.2, 0.3, 0.3)}, "rb: expected 0 <= rb <= ra = 0.2, got 0.3"),
        (ValueError, {"ratios": (1, 0.3, 1.3)}, "rc: expected a number from 0.0 to 1.0, got 1.3"),
        (TypeError, {"ratios": (1, 2)}, 'ratios: expected "auto", "fit" or three numbers'),
        (TypeError, {"ratios": "paper"}, 'ratios: expected "auto", "fit" or three'),
        (ValueError, {"input_offset": math.nan}, "input_offset: expected a finite number"),
        (TypeError, {"input_offset": "x"}, 'input_offset: expected "fit" or a number, got '),
        (ValueError, {"dead_time": -1.0}, "dead_time: expected a number >= 0 below the length"),
        (ValueError, {"dead_time": 200.0}, "dead_time: expected a number >= 0 below the length"),
        (ValueError, {"dead_time": math.nan}, "dead_time: expected a number >= 0 below the length"),
        (TypeError, {"dead_time": [1]}, 'dead_time: expected "fit" or a number, got [1]'),
    ],
)
def test_an_impossible_option_is_named(
    kind: type[Exception], options: dict[str, Any], message: str
) -> None:
    assert refusal(kind, *good(), **options).startswith(message)


# ---- model files


MODELS: dict[str, AnyModel] = {
    "conventional": mh.PrandtlIshlinskii([1.0, 0.5], [0.0, 2.0], input_offset=0.1),
    "modified": mh.ModifiedPrandtlIshlinskii([1.0], [2.0], [1.5], [0.5], [0.25]),
}
FIELDS = [
    (kind, field)
    for kind, names in {
        "conventional": ["weights", "thresholds"],
        "modified": ["weights", "r", "ra", "rb", "rc"],
    }.items()
    for field in ("schema", "model", "input_offset", "output_offset", *names)
]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "stage.json"


def fields(kind: str, path: Path) -> dict[str, Any]:
    MODELS[kind].save(path)
    loaded: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return loaded


def loading(path: Path, content: str | bytes | dict[str, Any]) -> str:
    """The message about a file with this content: one line that begins with its name."""
    if isinstance(content, dict):
        content = json.dumps(content)
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(ValueError) as caught:
        mh.load(path)
    assert type(caught.value) is ValueError
    message = str(caught.value)
    assert message.startswith(f"{path}: ") and "\n" not in message
    return message.removeprefix(f"{path}: ")


@pytest.mark.parametrize("kind", MODELS)
def test_a_file_cut_off_at_any_byte_is_refused(kind: str, path: Path) -> None:
    fields(kind, path)
    whole = path.read_bytes().rstrip()
    for length in range(len(whole)):
        assert loading(path, whole[:length]).startswith("not a model file: ")


@pytest.mark.parametrize("kind", MODELS)
def test_a_file_with_any_byte_lost_is_refused_or_another_model(kind: str, path: Path) -> None:
    fields(kind, path)
    whole = path.read_bytes()
    for i in range(len(whole)):
        path.write_bytes(whole[:i] + whole[i + 1 :])
        try:
            mh.load(path)
        except ValueError as error:
            assert str(error).startswith(f"{path}: ") and "\n" not in str(error)


@pytest.mark.parametrize(("kind", "field"), FIELDS)
def test_a_missing_field_is_named(kind: str, field: str, path: Path) -> None:
    content = fields(kind, path)
    del content[field]
    message = loading(path, content)
    if field == "schema":
        assert message == f"{SCHEMAS}, got none"
    else:
        assert message.startswith(f"not a model file: missing field `{field}`")


@pytest.mark.parametrize(("kind", "field"), FIELDS)
@pytest.mark.parametrize("wrong", [None, {}, True, "wrong", [[1.0]], ["a", "b"]])
def test_a_field_of_the_wrong_type_is_refused(
    kind: str, field: str, wrong: object, path: Path
) -> None:
    message = loading(path, {**fields(kind, path), field: wrong})
    assert message.startswith(("not a model file: ", "schema: expected "))


@pytest.mark.parametrize("kind", MODELS)
def test_an_unknown_field_is_named(kind: str, path: Path) -> None:
    content = {**fields(kind, path), "creep": 0.1}
    assert loading(path, content).startswith("not a model file: unknown field `creep`")


@pytest.mark.parametrize("schema", ["mpi_hyst/model/3", "mpi_hyst/model", "", "other/1"])
def test_another_schema_is_called_just_that(schema: str, path: Path) -> None:
    expected = f'{SCHEMAS}, got "{schema}"'
    assert loading(path, {**fields("modified", path), "schema": schema}) == expected
    # also where nothing else is as in this schema
    assert loading(path, {"schema": schema, "operators": [1, 2]}) == expected


@pytest.mark.parametrize("field", ["schema", "model"])
def test_a_line_break_in_the_file_is_none_in_the_message(field: str, path: Path) -> None:
    loading(path, {**fields("modified", path), field: "one\ntwo"})
    loading(path, {**fields("modified", path), "more\nthan": 1.0})


def test_an_unknown_model_is_named(path: Path) -> None:
    message = loading(path, {**fields("modified", path), "model": "preisach"})
    assert message.startswith("not a model file: unknown variant `preisach`")


@pytest.mark.parametrize("number", ["NaN", "Infinity", "-Infinity", "1e999", "nan"])
@pytest.mark.parametrize("field", ["weights", "input_offset"])
def test_a_file_with_a_number_that_is_not_finite_is_refused(
    field: str, number: str, path: Path
) -> None:
    content = fields("conventional", path)
    content[field] = [0.0, 7.5] if field == "weights" else 7.5
    assert loading(path, json.dumps(content).replace("7.5", number)).startswith("not a model file:")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"r": [-1.0]}, "r[0]: expected a finite number >= 0, got -1.0"),
        ({"rc": [2.5]}, "rc[0]: expected 0 <= rc <= r = 2.0, got 2.5"),
        ({"rb": [2.5]}, "rb[0]: expected 0 <= rb <= ra = 1.5, got 2.5"),
        ({"ra": [1.5, 2.0]}, "ra: expected 1 elements, got 2"),
        ({"weights": []}, "weights: expected at least one element, got none"),
    ],
)
def test_a_file_with_a_model_that_cannot_be_names_the_number(
    change: dict[str, Any], message: str, path: Path
) -> None:
    assert loading(path, {**fields("modified", path), **change}) == message


def test_a_file_with_a_number_beyond_1e100_is_told_in_few_digits(path: Path) -> None:
    message = loading(path, {**fields("modified", path), "output_offset": 1e300})
    assert message.startswith("output_offset: expected a finite number") and len(message) < 120


@pytest.mark.parametrize(
    "text", ["", " ", "null", "[]", "5", '"text"', "u,y\n1,2\n", "{}", "\ufeff{}", "[" * 10_000]
)
def test_any_other_text_is_no_model(text: str, path: Path) -> None:
    assert loading(path, text).startswith(("not a model file: ", "schema: expected "))


def test_text_after_the_model_is_refused(path: Path) -> None:
    content = json.dumps(fields("modified", path))
    assert loading(path, content + "{}").startswith("not a model file: trailing characters")


def test_a_field_given_twice_is_refused(path: Path) -> None:
    content = json.dumps(fields("modified", path))
    assert "duplicate field" in loading(path, content[:-1] + ', "r": [3.0]}')


def test_bytes_that_are_no_text_are_refused_with_the_name(path: Path) -> None:
    assert loading(path, b"\xff\xfe{}").startswith("not a model file: ")


def test_a_missing_file_is_file_not_found_with_its_name(path: Path) -> None:
    with pytest.raises(FileNotFoundError) as caught:
        mh.load(path)
    assert caught.value.filename == str(path)
    assert str(caught.value) == f"[Errno 2] No such file or directory: {str(path)!r}"


def test_a_directory_is_no_file(tmp_path: Path) -> None:
    with pytest.raises(IsADirectoryError) as caught:
        mh.load(tmp_path)
    assert caught.value.filename == str(tmp_path)


@pytest.mark.parametrize("bad", [None, 5, 1.5, ["a"]])
def test_a_path_that_is_none_is_a_type_error(bad: Any) -> None:
    for call in (mh.load, MODELS["modified"].save):
        with pytest.raises(TypeError):
            call(bad)
