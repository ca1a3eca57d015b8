"""The controller in Python: arguments, modes, states; its laws are in ``test_control_laws.py``."""

from __future__ import annotations

import copy
import json
import math
import pickle
from collections.abc import Callable
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from support import BAD, bits

MODEL = mh.paper.table_1_recovered()
LIMITS = (-500.0, 500.0)


def made(feedforward: Any = None, **keywords: Any) -> mh.control.HybridController:
    return mh.control.HybridController(
        feedforward, **{"kp": 5.0, "ki": 6e3, "dt": 1e-4, "limits": LIMITS, **keywords}
    )


def moving(samples: int = 300, **keywords: Any) -> mh.control.HybridController:
    controller = made(MODEL.inverse(LIMITS), **keywords)
    for k in range(samples):
        controller.step(2e-3 * k, 2e-3 * k - 0.02)
    return controller


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"feedforward": MODEL}, "feedforward: expected model.inverse(limits) of an actuator"),
        (
            {"feedforward": "given?"},
            "feedforward: expected model.inverse(limits), stage.inverse(dt),",
        ),
        ({"feedforward": 3.0}, "feedforward: expected model.inverse(limits), stage.inverse(dt), m"),
        ({"limits": 5.0}, "limits: expected two numbers (low, high), got 5.0"),
        ({"preview": 5.0}, "preview: expected a mh.control.Preview, got 5.0"),
    ],
)
def test_arguments_of_another_type_are_named(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(TypeError) as caught:
        made(**arguments)
    assert str(caught.value).startswith(message)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"kp": -1.0}, "kp: expected a finite number >= 0, got -1.0"),
        ({"ki": math.nan}, "ki: expected a finite number >= 0, got NaN"),
        ({"dt": 0.0}, "dt: expected a finite number > 0, got 0.0"),
        ({"slew": -5.0}, "slew: expected a finite number > 0, got -5.0"),
        ({"limits": (5.0, 5.0)}, "limits[1]: expected a number above the low limit = 5.0, got 5.0"),
        ({"limits": (-math.inf, 5.0)}, "limits[0]: expected a finite number"),
        ({"bumpless_time": -1.0}, "bumpless_time: expected a finite number >= 0, got -1.0"),
        ({"start_drive": 501.0}, "start_drive: expected a number from -500.0 to 500.0, got 501.0"),
        ({"max_missing": -1}, "max_missing: expected a whole number of at least zero, got -1"),
        ({"max_missing": 1.5}, "max_missing: expected a whole number of at least zero, got 1.5"),
        ({"law": "printed"}, 'law: expected "positional" or "incremental", got "printed"'),
        ({"anti_windup": "off"}, 'anti_windup: expected "conditional" or "back_calculation", got'),
        ({"tracking_time": 0.1}, 'tracking_time: expected None unless anti_windup="back_calcula'),
        (
            {"tracking_time": 0.0, "anti_windup": "back_calculation"},
            "tracking_time: expected a finite number > 0, got 0.0",
        ),
    ],
)
def test_arguments_out_of_their_domain_are_named(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError) as caught:
        made(**arguments)
    assert str(caught.value).startswith(message)


def test_a_preview_that_is_none_is_named() -> None:
    for arguments, message in [
        (([], 0), "coefficients: expected at least one element, got none"),
        (([1.0, math.inf], 0), "coefficients[1]: expected a finite number"),
        (([1.0, 2.0], 2), "ahead: expected a whole number from 0 to 1, got 2"),
        (([1.0], -1), "ahead: expected a whole number of at least zero, got -1"),
    ]:
        with pytest.raises(ValueError) as caught:
            mh.control.Preview(*arguments)
        assert str(caught.value).startswith(message)
    preview = pickle.loads(pickle.dumps(mh.control.Preview([1.0, 2.0], 1)))
    assert (list(preview.coefficients), preview.ahead) == ([1.0, 2.0], 1)
    with pytest.raises(ValueError):
        preview.coefficients[0] = 3.0


def test_the_controller_goes_on_with_a_copy_of_the_stream() -> None:
    stream = MODEL.inverse(LIMITS)
    stream.run([3.0, -1.0])
    one, other = made(stream), made(stream)
    before = stream.state
    drives = [one.step(r, 0.0) for r in (0.5, 2.0, -1.0)]
    assert stream.state == before and one.state["feedforward"] != before
    stream.step(2.0)
    assert [other.step(r, 0.0) for r in (0.5, 2.0, -1.0)] == drives


def test_hold_is_an_attribute_that_stops_and_goes_on_where_it_was() -> None:
    controller = moving()
    assert (controller.hold, controller.mode) == (False, "run")
    controller.mode = "feedforward"
    controller.hold = True
    assert (controller.hold, controller.mode) == (True, "hold")
    held, before = controller.drive, controller.state
    for bad in [1.0, *BAD]:
        assert bits(controller.step(bad, bad)) == bits(held)
    assert controller.state == before
    controller.hold = False
    assert controller.mode == "feedforward"
    assert controller.step(1.0, math.nan) == held
    with pytest.raises(ValueError, match='mode: expected "run", "feedforward" or "hold", got "on"'):
        controller.mode = "on"  # type: ignore[assignment]
    with pytest.raises(TypeError):
        controller.hold = "yes"  # type: ignore[assignment]
    assert controller.mode == "feedforward"


@pytest.mark.parametrize("bad", BAD)
def test_what_is_not_finite_holds_the_drive_and_is_counted(bad: float) -> None:
    controller = moving(max_missing=2)
    held = controller.drive
    for arguments in [(bad, 0.6), (0.6, 0.6, bad)]:
        assert controller.step(*arguments) == held
    assert controller.step(0.6, 0.6, target=bad) == held
    assert (controller.rejected_count, controller.missing_count) == (3, 0)
    for _ in range(2):
        assert controller.step(0.6, bad) == held
    for _ in range(20):
        controller.step(0.7, bad)
    assert controller.drive != held and controller.terms.proportional == 0.0
    assert (controller.rejected_count, controller.missing_count) == (3, 22)


def test_terms_add_up() -> None:
    terms = moving().terms
    parts = (terms.feedforward, terms.proportional, terms.integral, terms.bumpless)
    assert terms.unlimited_drive == pytest.approx(
        sum(parts), rel=0, abs=1e-12
    )  # four roundings of 100 V
    assert (terms.reference, terms.target) == (2e-3 * 299, 2e-3 * 299)
    assert terms.error == pytest.approx(0.02, abs=1e-12)
    assert terms.proportional == pytest.approx(0.1, abs=1e-12)
    assert terms.drive == terms.unlimited_drive and not (terms.saturated or terms.slewing)


def test_switches_are_no_jumps() -> None:
    changed = mh.ModifiedPrandtlIshlinskii(
        1.2 * MODEL.weights, MODEL.r, MODEL.ra, MODEL.rb, MODEL.rc
    )

    switches: list[Callable[[Any], object]] = [
        lambda c: c.set_gains(500.0, 6e3),
        lambda c: c.set_model(changed),
        lambda c: c.set_feedforward(mh.paper.table_2().forward()),
        lambda c: c.set_feedforward(None),
        lambda c: setattr(c, "mode", "feedforward"),
    ]
    for switch in switches:
        controller = moving()
        drive = controller.drive
        expected = controller.peek(0.6, 0.58)
        switch(controller)
        assert controller.drive == drive
        # the motion goes on: of what the bumpless term takes, the drive at most, a fiftieth is
        # lost; without feed-forward so is its motion of 0.4 V per sample
        assert abs(controller.peek(0.6, 0.58) - expected) < 0.02 * abs(drive) + 0.5
    assert (controller.kp, controller.ki) == (5.0, 6e3)


def test_changes_that_cannot_be_are_refused_and_change_nothing() -> None:
    controller: Any = moving()
    before = controller.state
    refusals: list[tuple[type[Exception], Any]] = [
        (ValueError, lambda: controller.set_gains(-1.0, 0.0)),
        (ValueError, lambda: controller.set_model(mh.paper.table_2())),
        (TypeError, lambda: controller.set_model(MODEL.forward())),
        (TypeError, lambda: controller.set_feedforward(MODEL)),
        (ValueError, lambda: controller.reset(600.0)),
        (TypeError, lambda: controller.step("1", 0.0)),
        (TypeError, lambda: controller.step(0.0)),
    ]
    for kind, call in refusals:
        with pytest.raises(kind):
            call()
        assert (controller.state, controller.kp) == (before, 5.0)
    with pytest.raises(ValueError, match="model: expected a feed-forward that has one"):
        made().set_model(MODEL)


def test_a_state_that_is_none_is_refused_and_changes_nothing() -> None:
    controller: Any = moving(preview=mh.control.Preview([0.5, 0.5], 1))
    before = controller.state

    def refusal(*path: str, value: Any) -> str:
        state = copy.deepcopy(before)
        inner = state
        for name in path[:-1]:
            inner = inner[name]
        inner[path[-1]] = value
        with pytest.raises(ValueError) as caught:
            controller.state = state
        assert controller.state == before
        return str(caught.value)

    drive = refusal("feedback_loop", "terms", "drive", value=500.5)
    expected = "expected a number from -500.0 to 500.0, got 500.5"
    assert drive == f"state.feedback_loop.terms.drive: {expected}"
    for value in (math.nan, "1", None):
        refusal("feedback_loop", "terms", "drive", value=value)
    assert "another type" in refusal("feedback_loop", "started", value="yes")
    assert "finite terms" in refusal("feedback_loop", "integral", value=math.inf)
    refusal("feedback_loop", "mode", value="sleep")
    refusal("feedback_loop", "missing_in_a_row", value=-1)
    refusal("feedforward", value=None)
    refusal("preview", value=None)
    refusal("preview", "past", value=[])
    refusal("unheard_of", value=1)
    nonsense: list[Any] = [None, 3, {}]
    for value in nonsense:
        with pytest.raises(ValueError, match=r"state: expected what \.state returned"):
            controller.state = value
    changes: list[dict[str, Any]] = [{"limits": (0.0, 1.0)}, {"kp": 4.0}, {"ki": 1.0}, {"dt": 1e-3}]
    for options in changes:
        keywords = {"limits": LIMITS, **options}
        preview = mh.control.Preview([0.5, 0.5], 1)
        other = made(MODEL.inverse(keywords["limits"]), preview=preview, **keywords)
        with pytest.raises(ValueError, match=rf"^state\.{next(iter(options))}[.\w]*: expected"):
            other.state = before


def test_a_state_belongs_to_its_preview() -> None:
    plain = mh.control.Preview([0.25, 0.5, 0.25], 1)
    controller = made(MODEL.inverse(LIMITS), preview=plain)
    for k in range(10):
        controller.step(0.1 * k, 0.1 * k)
    saved = json.loads(json.dumps(controller.state))
    same = made(MODEL.inverse(LIMITS), preview=mh.control.Preview([0.25, 0.5, 0.25], 1))
    same.state = saved
    assert same.step(1.0, 0.9) == controller.step(1.0, 0.9)
    others = [mh.control.Preview([0.25, 0.5, 0.25], 0), mh.control.Preview([0.3, 0.4, 0.3], 1)]
    for other in [made(MODEL.inverse(LIMITS), preview=preview) for preview in others]:
        before = other.state
        with pytest.raises(ValueError, match=r"^state: expected the state of a preview with the s"):
            other.state = saved
        assert other.state == before
    # nobody could tell whether a state that does not name its preview belongs here
    del saved["preview"]["window"]
    with pytest.raises(ValueError, match=r"^state: expected what \.state returned; .*`window`"):
        same.state = saved


def test_reset_keeps_the_drive_unless_the_amplifier_has_another() -> None:
    controller = moving()
    controller.step(math.nan, 0.0)
    drive = controller.drive
    controller.reset()
    assert (controller.drive, controller.rejected_count, controller.mode) == (drive, 0, "run")
    assert controller.state["feedforward"]["stream"] == MODEL.inverse(LIMITS).state
    controller.reset(0.0)
    assert bits([controller.step(2e-3 * k, 2e-3 * k - 0.02) for k in range(300)]) == bits(
        [(fresh := made(MODEL.inverse(LIMITS))).step(0.0, -0.02)]
        + [fresh.step(2e-3 * k, 2e-3 * k - 0.02) for k in range(1, 300)]
    )


def test_the_example_of_back_calculation_takes_its_time() -> None:
    def returns(tracking_time: float) -> int:
        controller = made(anti_windup="back_calculation", tracking_time=tracking_time)
        for _ in range(1000):
            controller.step(1e3, 0.0)
        return next(k for k in range(10**5) if controller.step(0.0, 0.01) < 500.0)

    assert returns(1e-4) <= returns(1e-2) <= returns(1.0)
    assert returns(1e-4) < 10 < returns(1.0)


def test_numpy_numbers_are_numbers() -> None:
    controller, other = made(), made()
    for k in np.arange(5.0):
        assert controller.step(k, np.float64(0.1)) == other.step(float(k), 0.1)
    assert controller.step(np.int64(3), 0) == other.step(3.0, 0.0)
