"""Many actuators at once: single fits, threads, executors, and what is left of them."""

from __future__ import annotations

import copy
import pickle
import warnings
from collections.abc import Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import Array

DT = 1e-3
SAMPLES = 500
U = 60.0 + mh.signals.decaying_triangle(50.0, 1.0, cycles=5, rate=100)
OPTIONS: dict[str, Any] = {"dt": DT, "operators": 5, "weights": "free", "smoothness": 0.0}
ALONE: dict[str, Any] = {"dynamics": None, "creep": None, "loop_shift": None}
ALONE |= {"relaxing_plays": None, "input_map": None, "output_map": None}
"""What a single fit leaves out to be one of many."""


def position(u: Array, seed: int) -> Array:
    """An actuator with ratios, weights, offsets, dead time and noise of its own."""
    random = np.random.default_rng(seed)
    gain, ra = random.uniform(0.01, 0.03), random.uniform(0.7, 1.2)
    model = mh.ModifiedPrandtlIshlinskii.from_ratios(
        gain * np.array([1.0, *random.uniform(0.05, 0.3, 4)]),
        12.0 * np.arange(5),
        ra=ra,
        rb=ra * random.uniform(0.2, 0.8),
        rc=random.uniform(0.2, 0.8),
        input_offset=random.uniform(50.0, 70.0),
        output_offset=random.uniform(-1.0, 1.0),
    )
    clean = model.forward().run(u)
    late = np.interp(np.arange(u.size) - random.uniform(0.0, 3.0), np.arange(u.size), clean)
    measured: Array = late + random.normal(0.0, 0.1 * gain, u.size)
    return measured


def positions(u: Array, actuators: int, seed: int = 1) -> Array:
    return np.column_stack([position(u, seed + m) for m in range(actuators)])


Y = positions(U, 6)


@pytest.fixture(scope="module")
def found() -> mh.results.ManyIdentifications:
    return mh.identify_many(U, Y, **OPTIONS)


# ---- as single fits


@settings(max_examples=3)
@given(st.integers(0, 10**6))
def test_many_equals_single(seed: int) -> None:
    u = np.column_stack([U, 0.9 * U + 2.0])
    y = np.column_stack([position(u[:, m].copy(), seed + m) for m in range(2)])
    own = mh.identify_many(u, y, skip=20, threads=2, **OPTIONS)
    for m in range(2):
        single = mh.identify(u[:, m], y[:, m], skip=20, **OPTIONS, **ALONE)
        assert own[m] == single.model
        assert own.dead_times[m] == single.dead_time and own.rmse[m] == single.fit.rmse
        assert own.verdicts[m] == single.verdict
        assert [code for code, _, _ in own.findings[m]] == [w.code for w in single.warnings]
    shared = mh.identify_many(U, positions(U, 3, seed), **OPTIONS)
    assert shared == mh.identify_many(U, positions(U, 3, seed), threads=3, **OPTIONS)
    assert shared[2] == mh.identify_many(U, positions(U, 1, seed + 2), **OPTIONS)[0]


def test_one_drive_is_as_good_as_single_fits(found: mh.results.ManyIdentifications) -> None:
    single = np.array([mh.identify(U, y, **OPTIONS, **ALONE).fit.rmse for y in Y.T])
    assert np.all(found.rmse < 1.02 * single)
    assert np.median(found.rmse / single) < 1.0 + 1e-6


def test_the_models_predict_what_was_fitted(found: mh.results.ManyIdentifications) -> None:
    later = found.dead_times / DT
    output = found.actuator_array().forward().run(np.repeat(U[:, None], 6, axis=1))
    sample = np.arange(SAMPLES)
    predicted = np.column_stack(
        [np.interp(sample - late, sample, y) for late, y in zip(later, output.T, strict=True)]
    )
    error = Y - predicted
    assert np.allclose(np.sqrt((error**2).mean(axis=0)), found.rmse, rtol=1e-6)
    assert np.allclose(abs(error).max(axis=0), found.max_errors, rtol=1e-6)
    assert np.allclose(found.rmse / np.ptp(Y, axis=0), found.nrmse, rtol=1e-12)
    assert np.all((found.noise > found.rmse) & (found.noise < 1.05 * found.rmse))


@pytest.mark.parametrize(
    "options",
    [
        {"model": "conventional"},
        {"weights": "split"},
        {"weights": "quadratic", "operators": 6, "thresholds": "quantiles"},
        {"weights": "auto", "smoothness": "auto"},
        {"operators": "auto", "weights": "quadratic"},
        {"thresholds": [0.0, 10.0, 30.0], "operators": 3},
    ],
)
def test_options_are_those_of_identify(options: dict[str, Any]) -> None:
    known = {"ratios": (0.9, 0.45, 0.5), "input_offset": 60.0, "dead_time": 1e-3, "dt": DT}
    given = {**known, "weights": "free", "operators": 5, **options}
    many = mh.identify_many(U, Y[:, :1], **given)
    single = mh.identify(U, Y[:, 0], **given, **ALONE)
    assert many.weights_law == single.weights_law and many.smoothness == single.smoothness
    assert many.rmse[0] == pytest.approx(single.fit.rmse, rel=1e-7)
    assert type(many[0]) is type(single.model) and many.operators == many.weights.shape[1]
    assert np.allclose(many.weights[0], np.asarray(single.model.weights), rtol=1e-3, atol=1e-6)


# ---- executors


class Inline(Executor):
    """Runs what is submitted at once."""

    def __init__(self) -> None:
        self.futures: list[Future[Any]] = []

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        self.futures.append(future)
        future.set_result(fn(*args, **kwargs))
        return future


@pytest.fixture(params=["threads", "processes", "inline"])
def executor(request: pytest.FixtureRequest) -> Iterator[Executor]:
    if request.param == "inline":
        yield Inline()
    elif request.param == "threads":
        with ThreadPoolExecutor(2) as pool:
            yield pool
    else:
        with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
            yield pool


def test_an_executor_changes_no_bit(
    executor: Executor, found: mh.results.ManyIdentifications
) -> None:
    assert mh.identify_many(U, Y, executor=executor, **OPTIONS) == found
    u = np.column_stack([U, 0.9 * U])
    options = {**OPTIONS, "weights": "auto", "skip": "0.02s"}
    own = mh.identify_many(u, Y[:, :2], **options)
    assert mh.identify_many(u, Y[:, :2], executor=executor, **options) == own


def test_groups_come_back_in_order() -> None:
    columns = np.tile(Y[:, :2], (1, 130))
    columns[3, 258] = np.nan
    options = {**OPTIONS, "operators": 2, "ratios": (0.9, 0.4, 0.5), "input_offset": 60.0}
    inline, told = Inline(), []
    many = mh.identify_many(
        U, columns, executor=inline, progress=lambda *now: told.append(now), **options
    )
    assert len(inline.futures) == 2 and len(many) == 260
    assert told[-2:] == [(256 / 260, 256), (1.0, 260)]
    assert list(many.errors) == [258] and many.errors[258].startswith("actuator 258: y[3]: ")
    assert many == mh.identify_many(U, columns, **options)


def test_a_task_that_fails_stops_the_others() -> None:
    class Broken(Inline):
        def submit(self, *_: Any, **__: Any) -> Future[Any]:
            future: Future[Any] = Future()
            self.futures.append(future)
            if len(self.futures) == 1:
                future.set_exception(RuntimeError("the worker is gone"))
            return future

    broken = Broken()
    with pytest.raises(RuntimeError, match="the worker is gone"):
        mh.identify_many(U, np.tile(Y[:, :1], (1, 300)), executor=broken, **OPTIONS)
    assert broken.futures[1].cancelled()


# ---- results


def test_copies_are_equal_and_small(found: mh.results.ManyIdentifications) -> None:
    packed = pickle.dumps(found)
    for other in (pickle.loads(packed), copy.deepcopy(found)):
        assert other == found and repr(other) == repr(found)
        assert other.models() == found.models()
    assert found != mh.identify_many(U, Y[:, ::-1], **OPTIONS)
    assert len(packed) < 0.1 * Y.nbytes + 2000


@pytest.mark.parametrize("unit", [1e-300, 1e-320])
def test_a_column_of_too_small_numbers_is_refused_alone(
    found: mh.results.ManyIdentifications, unit: float
) -> None:
    columns = Y.copy()
    columns[:, 2] *= unit
    many = mh.identify_many(U, columns, **OPTIONS)
    assert [many[m] for m in (0, 5)] == [found[m] for m in (0, 5)]
    assert list(many.errors) == [2]
    assert many.errors[2].startswith("actuator 2: y: expected fitted samples that vary by 1e-100")


def test_a_bad_column_takes_nothing_from_the_others(
    found: mh.results.ManyIdentifications,
) -> None:
    columns = Y.copy()
    columns[:, 1], columns[7, 2], columns[:, 3] = 0.5, np.inf, -Y[:, 3]
    many = mh.identify_many(U, columns, threads=2, **OPTIONS)
    assert [many[m] for m in (0, 4, 5)] == [found[m] for m in (0, 4, 5)]
    assert many.errors == {
        1: "actuator 1: y: expected fitted samples that vary, got 0.5 throughout",
        2: "actuator 2: y[7]: expected a finite number (at most 1e100 in magnitude), got inf",
    }
    assert many.verdicts[1:4] == ["red"] * 3
    assert next(code for code, _, _ in many.findings[3]) == "wrong_sign"
    assert np.isnan(many.rmse[1]) and np.isnan(many.weights[2]).all()
    assert repr(many).endswith("3 red, 2 of them not fitted>")
    assert pickle.loads(pickle.dumps(many)) == many
    assert many.models()[1] is None
    with pytest.raises(ValueError, match=r"actuator 2: y\[7\]"):
        many[2]
    with pytest.raises(ValueError, match=r"^actuator 1: .*: give `missing`, a model that takes"):
        many.actuator_array()
    with pytest.warns(UserWarning, match=r"^1 of 6 actuators have red fits.*: 3 \(wrong_sign, "):
        assert many.actuator_array(missing=found[0])[1] == found[0]
    with pytest.raises(TypeError, match=r"^missing: expected a PrandtlIshlinskii"):
        many.actuator_array(missing=3)  # type: ignore[arg-type]


def test_an_array_of_many_red_fits_names_the_first(
    found: mh.results.ManyIdentifications,
) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found.actuator_array()
    many = mh.identify_many(U, np.column_stack([-Y, Y[:, 0], -Y[:, 0]]), **OPTIONS)
    with pytest.warns(UserWarning, match=r"^7 of 8 actuators") as caught:
        array = many.actuator_array()
    assert len(array) == 8 and len(caught) == 1
    named = str(caught[0].message).partition(": ")[2]
    assert named.startswith("0 (wrong_sign") and " 4 (" in named and named.endswith(", ...")
    assert " 5 (" not in named


def test_no_column_can_be_fitted() -> None:
    many = mh.identify_many(U, np.full((SAMPLES, 2), 1.0))
    assert list(many.errors) == [0, 1] and many.models() == [None, None]


def test_actuators_are_counted_like_those_of_a_list(
    found: mh.results.ManyIdentifications,
) -> None:
    assert len(found) == 6 and found[-1] == found[5]
    for beyond in (6, -7):
        with pytest.raises(IndexError):
            found[beyond]
    with pytest.raises(TypeError):
        found["0"]  # type: ignore[index]


# ---- arguments


@pytest.mark.parametrize(
    ("changed", "kind", "message"),
    [
        (
            {"Y": Y[1:]},
            ValueError,
            "Y: expected an array of shape (500, actuators), got shape (499, 6)",
        ),
        ({"Y": Y[:, :0]}, ValueError, "Y: expected at least one actuator, got none"),
        ({"Y": U}, ValueError, "Y: expected an array of shape (samples, actuators)"),
        ({"u": Y[:, :2]}, ValueError, "Y: expected an array of shape (500, 2), got shape (500, 6)"),
        ({"u": np.full(500, 1.0)}, ValueError, "u: expected fitted samples that vary"),
        ({"u": 1e-300 * U}, ValueError, "u: expected fitted samples that vary by 1e-100 at least"),
        ({"u": np.where(U > 100.0, np.nan, U)}, ValueError, "u["),
        ({"skip": 500}, ValueError, "skip: expected fewer than the 500 samples"),
        ({"skip": 1.5}, TypeError, "skip: expected a number of samples"),
        ({"dt": "fast"}, TypeError, "dt: expected a number"),
        ({"dt": 0.0}, ValueError, "dt: expected a finite number of seconds above 0"),
        ({"threads": 0}, ValueError, "threads: expected a whole number of at least one"),
        ({"executor": 3}, TypeError, "executor: expected an executor of concurrent.futures"),
        ({"progress": 3}, TypeError, "progress: expected a callable"),
        ({"weights": "any"}, ValueError, 'weights: expected "auto"'),
        ({"operators": 400}, ValueError, "records: expected at least"),
        ({"dead_time": 9.0}, ValueError, "dead_time: expected a number >= 0 below"),
    ],
)
def test_errors_name_the_argument(
    changed: dict[str, Any], kind: type[Exception], message: str
) -> None:
    with pytest.raises(kind) as caught:
        mh.identify_many(**{"u": U, "Y": Y, **OPTIONS, **changed})
    assert type(caught.value) is kind and str(caught.value).startswith(message)
    assert caught.value.parameter == message.split(":")[0].split("[")[0]  # type: ignore[attr-defined]


@pytest.mark.parametrize("drives", ["shared", "own"])
@pytest.mark.parametrize("threads", [1, 2])
def test_progress_is_told_and_may_stop(drives: str, threads: int) -> None:
    u = U if drives == "shared" else np.repeat(U[:, None], 6, axis=1)
    told: list[tuple[float, int]] = []
    mh.identify_many(u, Y, threads=threads, progress=lambda *now: told.append(now), **OPTIONS)
    assert told == sorted(told) and all(share == done / 6 for share, done in told)
    assert threads > 1 or told[-1] == (1.0, 6)

    def stop(*_: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        mh.identify_many(u, Y, threads=threads, progress=stop, **OPTIONS)
