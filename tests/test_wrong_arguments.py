"""An argument of a wrong type is named in one line, which says what was expected and what came."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import mpi_hyst as mh
import pytest
from support import Array

FLAG = "True or False"
FILE = "the path of a file"
NAMES = '"A1" or "P3"'
MODES = '"run", "feedforward" or "hold"'
MODELS = '"modified" or "conventional"'
WEIGHTS = '"auto", "free", "quadratic" or "split"'
LOSSES = '"auto", "squares" or "robust"'
SHAPES = '"triangle" or "sine"'
SOURCES = '"inverse", "preview" or "given"'
TEXT = "a text"
CALLABLE = "a callable or None"


def _records() -> tuple[Array, Array]:
    u = mh.signals.decaying_triangle(500.0, 1.0, cycles=10, rate=20)
    return u, mh.paper.table_1().forward().run(u)


def _controller() -> mh.control.HybridController:
    return mh.control.HybridController(None, kp=0.1, ki=1.0, dt=1e-4, limits=(-1.0, 1.0))


def _array_controller() -> mh.control.ArrayController:
    array = mh.ActuatorArray([mh.paper.table_1_recovered()] * 2)
    return array.controller(dt=1e-4, ki=1.0, limits=(-500.0, 500.0))


def _cases() -> dict[str, tuple[Callable[..., object], str]]:
    """Of every argument, as "callable name": what takes it as a keyword, and what it may be."""
    u, y = _records()
    model, stage = mh.paper.table_1_recovered(), mh.paper.plant("A1").stage
    array = mh.ActuatorArray([model] * 2)
    signals, control = mh.signals, mh.control
    drive: dict[str, Any] = {"low": 0.0, "high": 100.0, "slew": 2000.0, "rate": 1000.0}
    loop: dict[str, Any] = {
        "kp": 0.0,
        "ki": 1.0,
        "slope": 1.0,
        "dynamics": mh.plant.FirstOrder(50.0),
        "dt": 1e-3,
    }
    law: dict[str, Any] = {"kp": 0.1, "ki": 1.0, "dt": 1e-4, "limits": (-1.0, 1.0)}
    sweep: dict[str, Any] = {"seconds": 1.0, "rate": 1000.0}
    tables: list[tuple[str, Callable[..., object], dict[str, str]]] = [
        (
            "identify",
            partial(mh.identify, u, y),
            {"model": MODELS, "weights": WEIGHTS, "loss": LOSSES, "keep_partial": FLAG},
        ),
        ("compare", partial(mh.compare, u, y), {"weights": WEIGHTS, "loss": LOSSES}),
        (
            "identify_many",
            partial(mh.identify_many, u, y[:, None]),
            {"model": MODELS, "weights": WEIGHTS},
        ),
        (
            "experiment",
            partial(signals.experiment, **drive),
            {"shape": SHAPES, "fast_signal": '"chirp" or "multisine"', "joined": FLAG},
        ),
        ("excitation", partial(signals.excitation, **drive), {"shape": SHAPES}),
        ("demagnetize", partial(signals.demagnetize, **drive), {"shape": SHAPES}),
        (
            "array.demagnetize",
            partial(array.demagnetize, (-500.0, 500.0), slew=2000.0, rate=1000.0),
            {"shape": SHAPES},
        ),
        (
            "chirp",
            partial(signals.chirp, 1.0, 1.0, 10.0, **sweep),
            {"sweep": '"linear" or "logarithmic"'},
        ),
        ("paper.plant", mh.paper.plant, {"name": NAMES}),
        ("paper.gains", mh.paper.gains, {"name": NAMES}),
        ("load", mh.load, {"path": FILE}),
        ("model.save", model.save, {"path": FILE}),
        ("stage.save", stage.save, {"path": FILE}),
        ("array.save", array.save, {"path": FILE}),
        ("ActuatorArray.load", mh.ActuatorArray.load, {"path": FILE}),
        ("stage.controller", partial(stage.controller, 1e-4), {"feedforward": SOURCES}),
        (
            "stage.simulate",
            partial(stage.simulate, [0.0, 1.0], 1e-4),
            {"feedforward": '"inverse" or "preview"', "progress": CALLABLE},
        ),
        (
            "stage.iterative_learning",
            partial(stage.iterative_learning, [0.0, 1.0], 1e-4),
            {"on_demand": FLAG},
        ),
        (
            "IterativeLearning",
            partial(control.IterativeLearning, [0.0, 1.0], **loop),
            {"on_demand": FLAG},
        ),
        (
            "stage.with_records",
            stage.with_records,
            {"records": "a list of (name, SHA-256 or None)"},
        ),
        ("Stage.from_bytes", mh.Stage.from_bytes, {"bytes": "the bytes that `to_bytes` gave"}),
        (
            "precompensate",
            partial(control.precompensate, reference=[0.0, 1.0], dt=1e-4),
            {"stage": "a mh.Stage"},
        ),
        (
            "c_header",
            lambda **given: mh.export.c_header(**{"stage": stage, "path": "x.h", **given}),
            {"stage": "a mh.Stage", "name": TEXT},
        ),
        (
            "fmu",
            lambda **given: mh.export.fmu(**{"stage": stage, "path": "x.fmu", "dt": 1e-4, **given}),
            {"stage": "a mh.Stage"},
        ),
        (
            "HybridController",
            partial(control.HybridController, None, **law),
            {
                "law": '"positional" or "incremental"',
                "anti_windup": '"conditional" or "back_calculation"',
            },
        ),
        (
            "Biquad",
            lambda **given: control.Biquad(**{"b": [1.0, 0.0, 0.0], "a": [0.0, 0.0], **given}),
            {"b": "three numbers (b0, b1, b2)", "a": "two numbers (a1, a2)"},
        ),
        (
            "simulate",
            partial(mh.plant.simulate, _controller(), mh.paper.plant("A1"), [0.0, 1.0]),
            {"progress": CALLABLE},
        ),
        (
            "simulate of axes",
            partial(
                mh.plant.simulate,
                control.MultiAxisController([_controller()]),
                mh.plant.MultiAxisPlant([mh.paper.plant("A1")], [[1.0]]),
                [[0.0], [1.0]],
            ),
            {"progress": CALLABLE},
        ),
        ("controller", partial(_set, _controller()), {"mode": MODES, "hold": FLAG}),
        ("axes", partial(_set, control.MultiAxisController([_controller()])), {"hold": FLAG}),
        ("array controller", partial(_set, _array_controller()), {"hold": FLAG}),
        (
            "Raster",
            partial(mh.trajectories.Raster, 10.0, 10.0, 4, line_rate=10.0),
            {"bidirectional": FLAG, "steps": FLAG},
        ),
        (
            "raster.line_index",
            partial(mh.trajectories.Raster(10.0, 10.0, 4, line_rate=10.0).line_index, 1e-3),
            {"retrace": FLAG},
        ),
    ]
    return {
        f"{called} {name}": (call, expected)
        for called, call, names in tables
        for name, expected in names.items()
    }


def _set(target: object, **attribute: Any) -> None:
    ((name, value),) = attribute.items()
    setattr(target, name, value)


CASES = _cases()
# None stands for the default of these, as it does for most arguments.
OPTIONAL = {
    *("identify model", "identify weights", "identify loss"),
    *("compare weights", "compare loss"),
    *("identify_many model", "identify_many weights"),
    *("HybridController law", "HybridController anti_windup"),
    "c_header name",
    *("simulate progress", "simulate of axes progress", "stage.simulate progress"),
}


def _check(call: Callable[..., object], name: str, wrong: object, expected: str) -> None:
    with pytest.raises(TypeError) as caught:
        call(**{name: wrong})
    assert str(caught.value) == f"{name}: expected {expected}, got {wrong}"
    assert caught.value.parameter == name  # type: ignore[attr-defined]


@pytest.mark.parametrize("case", CASES)
def test_an_argument_of_a_wrong_type_is_named(case: str) -> None:
    call, expected = CASES[case]
    _check(call, case.split()[-1], 3, expected)


@pytest.mark.parametrize("case", sorted(CASES.keys() - OPTIONAL))
def test_none_is_a_wrong_type_where_it_is_no_default(case: str) -> None:
    call, expected = CASES[case]
    _check(call, case.split()[-1], None, expected)


def test_what_a_prediction_and_a_table_take_is_named() -> None:
    u, y = _records()
    options: dict[str, Any] = {"operators": 4, "input_offset": 0.0, "dead_time": 0.0}
    _check(partial(mh.identify(u, y, **options).predict, u), "return_std", 3, FLAG)
    _check(mh.compare(u, y, **options).table, "unit", 3, TEXT)


@pytest.mark.parametrize("wrong", [3, None])
def test_where_an_export_cannot_go_is_named(wrong: Any) -> None:
    stage = mh.paper.plant("A1").stage
    for write in (mh.export.c_header, mh.export.fmu):
        with pytest.raises(TypeError, match=f"^path: expected the name of a file, got {wrong}$"):
            write(stage, wrong, dt=1e-4)
