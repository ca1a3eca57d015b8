"""Samples that are no numbers: the fast calls name the argument too."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from typing import Any

import mpi_hyst as mh
import pytest


def _calls() -> dict[str, Any]:
    stage = mh.paper.plant("A1").stage
    controller = mh.control.HybridController(None, kp=0.1, ki=1.0, dt=1e-4, limits=(-1.0, 1.0))
    model = mh.paper.table_1_recovered()
    forward, inverse = model.forward(), model.inverse((-10.0, 10.0))
    operator = mh.CoupledPlay(4.0, 3.0, 1.0, 2.0)
    repetitive = mh.control.RepetitiveControl(
        100, kp=0.0, ki=0.0, slope=1.0, dynamics=mh.plant.FirstOrder(50.0), bandwidth=100.0, dt=1e-3
    )
    return {
        "sample": [operator.step, forward.step, forward.peek, inverse.step, inverse.peek],
        "reference, measurement": [controller.step, controller.peek, controller.plan],
        "drive, measurement": [mh.control.Observer(stage, drift=0.5, dt=1e-4).step],
        "drive": [mh.plant.Plant(stage, dt=1e-4).step, mh.plant.Plant(stage, dt=1e-4).write],
        "error": [repetitive.step],
        "u, y": [mh.RecursiveIdentifier(model).update],
    }


@pytest.mark.parametrize("wrong", ["1", None, [1.0]])
def test_a_sample_that_is_no_number_is_named(wrong: Any) -> None:
    for arguments, calls in _calls().items():
        names = arguments.split(", ")
        for call in calls:
            for name in names:
                given = [wrong if one == name else 0.5 for one in names]
                with pytest.raises(TypeError) as caught:
                    call(*given)
                assert str(caught.value) == f"{name}: expected a number, got {wrong!r}"
                assert caught.value.parameter == name  # type: ignore[attr-defined]


@pytest.mark.parametrize("name", ["feedforward", "target", "correction"])
def test_what_a_controller_takes_besides_is_named(name: str) -> None:
    controller = mh.control.HybridController(None, kp=0.1, ki=1.0, dt=1e-4, limits=(-1.0, 1.0))
    wrong: Any = {name: "x"}
    for call in (controller.step, controller.peek, controller.plan):
        with pytest.raises(TypeError) as caught:
            call(0.5, 0.5, **wrong)
        assert str(caught.value) == f"{name}: expected a number, got 'x'"


def test_what_a_number_raises_itself_is_its_own() -> None:
    class Sample:
        def __float__(self) -> float:
            raise RuntimeError("broken")

    wrong: Any = Sample()
    controller = mh.control.HybridController(None, kp=0.1, ki=1.0, dt=1e-4, limits=(-1.0, 1.0))
    with pytest.raises(RuntimeError, match=r"^broken"):
        controller.step(wrong, 0.0)
    with pytest.raises(RuntimeError, match=r"^broken"):
        mh.CoupledPlay(4.0, 3.0, 1.0, 2.0).step(wrong)


class Wrong:
    """Whatever is asked of it, it raises."""

    def __init__(self, error: BaseException) -> None:
        self.error = error

    def __repr__(self) -> str:
        return "<wrong>"

    def _raise(self) -> Any:
        raise self.error

    __float__ = __bool__ = __fspath__ = _raise


def of_io(wrong: Wrong) -> object:
    """What is read of an object, which the loop asks for a number."""

    class Object:
        def read(self) -> Any:
            return wrong

        def write(self, drive: float) -> None:
            pass

    stage = mh.paper.plant("A1").stage
    rest: dict[str, Any] = {"rest_drive": 0.0, "rest_rate": 5e3, "rate": 1000.0, "seconds": 0.05}
    return mh.realtime.run(stage, Object(), [0.5], **rest)


CONVERTED: list[Callable[[Any], object]] = [
    lambda wrong: mh.paper.table_1_recovered().forward().step(wrong),
    lambda wrong: mh.paper.plant("A1").stage.controller(1e-3).step(0.0, wrong),
    lambda wrong: mh.paper.plant("A1").stage.controller(wrong),
    lambda wrong: mh.realtime.SharedMemory(wrong),
    of_io,
]


@pytest.mark.parametrize("convert", CONVERTED)
def test_an_own_type_error_is_the_cause_of_the_one_that_names_the_argument(
    convert: Callable[[Any], object],
) -> None:
    own = TypeError("of the object itself")
    with pytest.raises(TypeError, match=r"expected .*, got <wrong>") as caught:
        convert(Wrong(own))
    assert caught.value.__cause__ is own


@pytest.mark.parametrize("convert", CONVERTED)
def test_what_else_is_raised_stays(convert: Callable[[Any], object]) -> None:
    own = MemoryError("of the object itself")
    with pytest.raises(MemoryError) as caught:
        convert(Wrong(own))
    assert caught.value is own


def test_a_panic_of_a_sample_is_raised() -> None:
    # In a process of its own, which must live on. The class is there from the first error on.
    code = """
import mpi_hyst as mh
forward = mh.paper.table_1_recovered().forward()
try:
    mh.realtime.SharedMemory(1)
except TypeError:
    pass
(panic,) = [one for one in BaseException.__subclasses__() if one.__name__ == "PanicException"]

class Sample:
    def __float__(self):
        raise panic("of the sample")

for method in (forward.step, forward.peek):
    try:
        method(Sample())
    except panic as error:
        print(error)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, "of the sample\n" * 2), done.stderr


@pytest.mark.parametrize("name", ["repeat", "misses", "lock_memory"])
def test_none_is_no_default_of_a_loop(name: str) -> None:
    stage = mh.paper.plant("A1").stage
    options: dict[str, Any] = {"rest_drive": 0.0, "rest_rate": 5e3, "rate": 1000.0, name: None}
    with pytest.raises(TypeError, match=f"^{name}: expected .*, got None$") as caught:
        mh.realtime.run(stage, stage.plant(1e-3), [0.5], seconds=0.05, **options)
    assert caught.value.parameter == name  # type: ignore[attr-defined]


@pytest.mark.parametrize("method", ["step", "peek", "plan"])
def test_none_is_no_correction(method: str) -> None:
    controller: Any = mh.paper.plant("A1").stage.controller(1e-3)
    with pytest.raises(TypeError) as caught:
        getattr(controller, method)(0.0, 0.0, correction=None)
    assert str(caught.value) == "correction: expected a number, got None"
