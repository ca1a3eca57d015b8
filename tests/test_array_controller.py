"""The controller of an array: equation, limits, neighbours, blocks, wrong arguments."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from actuators import MODELS, M
from support import Array, bits

DT = 1e-3
LIMITS = (-60.0, 60.0)
RANDOM = np.random.default_rng(3)
MATRIX = RANDOM.normal(size=(M, 3))
CHAIN = [(i, i + 1) for i in range(M - 1)]
SOME: dict[str, Any] = {"ki": 100.0, "leak": 5.0, "slew": 2e4, "reconstruction": MATRIX}
SOME |= {"neighbours": CHAIN, "max_difference": 4.0}


def make(**options: Any) -> mh.control.ArrayController:
    return mh.ActuatorArray(MODELS).controller(DT, LIMITS, **options)


def signals(rows: int = 80) -> tuple[Array, Array, Array]:
    reference = 6.0 * np.sin(np.arange(rows * M).reshape(rows, M) * 0.07)
    measurement = RANDOM.normal(size=(rows, 3))
    reference[40, 2], measurement[20, 1] = math.nan, math.inf
    return reference, measurement, 0.1 * RANDOM.normal(size=(rows, 3))


def test_a_block_is_its_samples_and_peek_looks_ahead() -> None:
    reference, measurement, sensors = signals()
    stepped, ran, fed = make(**SOME), make(**SOME), make(**SOME)
    for r, y, s in zip(reference, measurement, sensors, strict=True):
        before = stepped.state
        ahead = stepped.peek(r, y, sensor_reference=s)
        assert stepped.state == before
        out = np.empty(M)
        assert stepped.step(r, y, sensor_reference=s, out=out) is out
        assert bits(out) == bits(ahead) == bits(stepped.drive)
    drives = ran.run(reference, measurement, sensor_reference=sensors)
    assert bits(drives[-1]) == bits(stepped.drive) and ran.state == stepped.state
    assert ran.rejected_count == 1 and ran.missing_count == 1
    assert ran.pair_limited_count and ran.slewing_count
    both = reference.copy()
    assert fed.run(both, measurement, sensor_reference=sensors, out=both) is both
    assert bits(both) == bits(drives)


def test_a_long_block_has_no_seam() -> None:
    rows = 2**20 // M + 100
    reference = np.repeat(np.linspace(-5.0, 5.0, rows)[:, None], M, axis=1)
    measurement = np.zeros_like(reference)
    whole, parts = make(ki=1.0), make(ki=1.0)
    drives = whole.run(reference, measurement)
    for part in np.array_split(np.arange(rows), 7):
        last = parts.run(reference[part], measurement[part])
    assert bits(last[-1]) == bits(drives[-1]) and whole.state == parts.state


def test_open_loop_is_the_inverse() -> None:
    reference = 0.03 * signals()[0][:40]
    controller = make(bumpless_time=0.0, start_drive=[model.input_offset for model in MODELS])
    drives = controller.run(reference)
    expected = mh.ActuatorArray(MODELS).inverse(LIMITS).run(reference[1:])
    assert np.allclose(drives[1:], expected, atol=1e-9)
    assert np.allclose(controller.position, reference[-1], atol=1e-12)


def test_the_integral_is_its_equation() -> None:
    controller = make(ki=80.0, leak=10.0, reconstruction=MATRIX, bumpless_time=0.0)
    r, y = np.full(M, 0.05), np.array([0.02, -0.01, 0.03])
    controller.step(r, y)  # the start
    a = np.zeros(M)
    for k in range(20):
        s = 0.002 * np.array([1.0, k, -1.0])
        controller.step(r, y, sensor_reference=s)
        a += DT * (80.0 * MATRIX @ (s - y) - 10.0 * a)
        assert np.allclose(controller.integral, a, atol=1e-15)
        assert np.allclose(controller.position, r + a, atol=1e-12)
    controller.step(r)
    assert np.allclose(controller.integral, a, atol=1e-15)


def test_hold_stop_and_changes() -> None:
    controller = make(slew=1e4)
    for _ in range(20):
        controller.step(np.ones(M))
    held = controller.drive
    controller.hold = True
    assert controller.hold and str(controller.mode) == "hold"
    assert bits(controller.step(np.zeros(M))) == bits(held)
    controller.stop(1e3, np.arange(M))
    assert str(controller.mode) == "stop"
    for _ in range(200):
        controller.step(np.full(M, math.nan))
    assert controller.drive.tolist() == list(range(M))
    controller.hold = False
    assert str(controller.mode) == "run"
    assert controller.step(np.ones(M)).tolist() == list(range(M))
    controller.set_gains(3.0)
    assert (controller.ki, controller.leak) == (3.0, 0.0)
    controller.set_gains(4.0, 1.0)
    assert (controller.ki, controller.leak) == (4.0, 1.0)
    other = mh.PrandtlIshlinskii([1.0, 0.75], [0.0, 2.0])
    for _ in range(30):
        controller.step(np.full(M, 0.1))
    before = controller.drive
    controller.set_model(M - 1, other)
    controller.step(np.full(M, 0.1))
    moved = np.abs(controller.drive - before)
    assert 0.0 < moved[M - 1] < 0.3 and moved[: M - 1].max() < 1e-12
    controller.reset(5.0)
    assert controller.drive.tolist() == [5.0] * M and controller.rejected_count == 0
    controller.follow([[9.0] * M, [3.0] * M])
    assert controller.drive.tolist() == [3.0] * M
    assert len(controller) == controller.sensors == M and controller.dt == DT
    assert controller.limits.tolist() == [list(LIMITS)] * M
    expected = "<ArrayController of 5 actuators, 5 sensors, ki 4, leak 1, mode run>"
    assert repr(controller) == expected


def test_a_state_belongs_to_its_set_up() -> None:
    saved = make(**SOME).state
    make(**SOME).state = saved
    for other in ({"reconstruction": -MATRIX}, {"slew": 3e4}, {"max_difference": 5.0}):
        with pytest.raises(ValueError, match="same reconstruction, pairs, slew and bumpless time"):
            make(**{**SOME, **other}).state = saved


WRONG: list[tuple[dict[str, Any], str]] = [
    ({"dt": 0.0}, "dt: expected a finite number > 0, got 0.0"),
    ({"dt": "1"}, "dt: expected a number"),
    ({"limits": [(0.0, 1.0)] * 2}, "limits: expected two numbers (low, high) or an array of"),
    ({"limits": (5.0, -5.0)}, "limits[1]: expected a number above the low limit = 5.0, got -5.0"),
    ({"ki": -1.0}, "ki: expected a finite number >= 0, got -1.0"),
    ({"leak": 2e3}, "leak: expected a number from 0.0 to 1000.0, got 2000.0"),
    ({"reconstruction": np.ones((3, M))}, "reconstruction: expected an array of shape (5, "),
    ({"reconstruction": np.full((M, 3), math.nan)}, "reconstruction[0]: expected a finite number"),
    ({"slew": [1.0, 2.0]}, "slew: expected 5 elements, got 2"),
    ({"slew": []}, "slew: expected a number or an array of shape (5,), got shape (0,)"),
    ({"neighbours": [(0, 9)], "max_difference": 1.0}, "neighbours[0]: expected a whole number"),
    ({"neighbours": [(0, -1)], "max_difference": 1.0}, "neighbours: expected an array of shape"),
    ({"neighbours": [(0, 1, 2)], "max_difference": 1.0}, "neighbours: expected an array of shape"),
    ({"neighbours": [(0, 1)]}, "max_difference: expected 1 elements, got 0"),
    ({"neighbours": [(0, 1)], "max_difference": -1.0}, "max_difference: expected a finite"),
    ({"max_difference": 1.0}, "max_difference: expected none without neighbours, got 1.0"),
    ({"bumpless_time": -1.0}, "bumpless_time: expected a finite number >= 0"),
    ({"start_drive": 61.0}, "start_drive[0]: expected a number from -60.0 to 60.0, got 61.0"),
    ({"start_drive": [1.0]*2}, "start_drive: expected a number or an array of shape (5,)"),
]  # fmt: skip


@pytest.mark.parametrize(("options", "message"), WRONG)
def test_a_wrong_option_is_named(options: dict[str, Any], message: str) -> None:
    given = {"dt": DT, "limits": LIMITS, **options}
    with pytest.raises((ValueError, TypeError)) as caught:
        mh.ActuatorArray(MODELS).controller(**given)
    assert str(caught.value).startswith(message), str(caught.value)
    name = message.split(":")[0].split("[")[0]
    assert getattr(caught.value, "parameter", None) == name


def test_a_wrong_sample_is_named_and_not_taken() -> None:
    controller = make(**SOME)
    controller.step(np.zeros(M), np.zeros(3))
    before = controller.state
    r, y = np.zeros(M), np.zeros(3)
    calls: dict[str, Callable[[], object]] = {
        "reference": lambda: controller.step(r[:3], y),
        "measurement": lambda: controller.step(r, r),
        "sensor_reference": lambda: controller.step(r, y, sensor_reference=0.0),
        "out": lambda: controller.step(r, y, out=np.empty(3)),
        "drives": lambda: controller.follow(np.full((2, M), 61.0)),
        "rate": lambda: controller.stop(-1.0),
        "rest_drive": lambda: controller.stop(1.0, 99.0),
        "actuator": lambda: controller.set_model(M, MODELS[0]),
        "model": lambda: controller.set_model(0, MODELS[1]),
        "drive": lambda: controller.reset(99.0),
        "ki": lambda: controller.set_gains(math.nan),
        "state": lambda: setattr(controller, "state", {}),
    }
    for name, call in calls.items():
        with pytest.raises((ValueError, TypeError), match=name) as caught:
            call()
        assert getattr(caught.value, "parameter", None) == name
    with pytest.raises(ValueError, match="measurement"):
        controller.run(np.zeros((4, M)), np.zeros((3, 3)))
    assert controller.state == before
