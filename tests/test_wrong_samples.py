"""Samples that are no numbers: the fast calls name the argument too."""

from __future__ import annotations

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
