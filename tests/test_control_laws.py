"""Laws of the controller, whatever happens to it; the same names as in control_laws.rs.

Terms are compared relative to the largest of them, summed in other orders than by the twin.
"""

from __future__ import annotations

import json
import math
import pickle
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from controllers import DT, Call, Drawn, calls, events, happen, numbers, setups
from hypothesis import given
from hypothesis import strategies as st
from support import bits

ROUNDING = 1e-11
"""Roundings of 100 samples of four terms, and of the inverse's drive by targets that differ."""

Events = list[tuple[str, Any]]


def drives(controller: mh.control.HybridController, happenings: Events) -> bytes:
    found = []
    for event in happenings:
        happen(controller, event, [])
        found.append(controller.drive)
    return bits(found)


@given(setups(), st.lists(events(upheavals=True), min_size=1, max_size=40))
def test_the_drive_never_leaves_limits_nor_slew(drawn: Drawn, happenings: Events) -> None:
    controller, saved = drawn.controller(), list[Any]()
    (low, high), slew = drawn.keywords["limits"], drawn.keywords["slew"]
    step = math.inf if slew is None else slew * 1e-4
    last = controller.drive
    for event in happenings:
        told = happen(controller, event, saved)
        drive = controller.drive
        assert low <= drive <= high
        assert told or last - step <= drive <= last + step
        last = drive


@given(setups(), st.lists(events(), max_size=30), st.lists(events(), min_size=1, max_size=30))
def test_save_and_restore_continue_bit_for_bit(drawn: Drawn, xs: Events, ys: Events) -> None:
    controller = drawn.controller()
    drives(controller, xs)
    state = controller.state
    expected = drives(controller, ys)
    for kept in (pickle.loads(pickle.dumps(state)), json.loads(json.dumps(state))):
        other = drawn.controller()
        drives(other, ys)
        other.state = kept
        assert other.state == state
        assert drives(other, ys) == expected
        assert other.state == controller.state


@given(setups(), st.lists(calls(), min_size=1, max_size=40))
def test_plan_and_commit_equal_step(drawn: Drawn, samples: list[Call]) -> None:
    one, other = drawn.controller(), drawn.controller()
    for arguments, keywords in samples:
        planned = other.plan(*arguments, **keywords)
        assert bits(planned) == bits(one.step(*arguments, **keywords))
        assert other.commit() and not other.commit()
        assert one.state == other.state


@given(setups(), st.lists(events(upheavals=True), max_size=30), calls())
def test_peek_and_a_plan_that_is_dropped_change_nothing(
    drawn: Drawn, happenings: Events, call: Call
) -> None:
    controller, saved = drawn.controller(), list[Any]()
    for event in happenings:
        happen(controller, event, saved)
    before = controller.state
    peeked = controller.peek(*call[0], **call[1])
    assert bits(controller.plan(*call[0], **call[1])) == bits(peeked)
    assert controller.state == before
    assert bits(controller.step(*call[0], **call[1])) == bits(peeked)


@given(
    setups(),
    st.lists(events(upheavals=True), max_size=30),
    st.sampled_from(["reset", "hold", "reject"]),
    numbers(-4.0, 4.0),
)
def test_a_motion_starts_from_the_present_drive(
    drawn: Drawn, happenings: Events, how: str, reference: float
) -> None:
    controller, saved = drawn.controller(), list[Any]()
    for event in happenings:
        happen(controller, event, saved)
    if how == "reset":
        controller.reset()
    elif how == "hold":
        controller.hold = True
    else:
        controller.step(math.nan, 0.0)
    controller.hold = False
    held = controller.drive
    assert bits(controller.step(reference, 0.0, 100.0)) == bits(held)


@given(setups(("positional",)), st.lists(events(), min_size=20, max_size=60))
def test_it_equals_its_twin(drawn: Drawn, happenings: Events) -> None:
    controller, twin = drawn.controller(), drawn.twin()
    for name, value in happenings:
        if name == "plan":
            continue
        if name == "step":
            controller.step(*value[0], **value[1])
            twin.step(*value[0], **value[1])
        elif name == "hold":
            controller.hold = False
            twin.set_mode(twin.resumes)
        else:
            controller.mode = value
            twin.set_mode(value)
        terms = controller.terms
        parts = (terms.feedforward, terms.proportional, terms.integral, terms.bumpless)
        scale = max(1.0, *map(abs, parts))
        assert controller.drive == pytest.approx(twin.drive, rel=0, abs=ROUNDING * scale)
        kept = controller.state["feedback_loop"]["integral"]
        assert kept == pytest.approx(twin.integral, rel=0, abs=ROUNDING * scale)
        if abs(terms.unlimited_drive) > 1e6:
            break  # roundings of what is far beyond the limits would decide
    counted = (controller.rejected_count, controller.missing_count)
    assert counted == (twin.rejected_count, twin.missing_count)


@given(
    setups(("incremental",)).filter(lambda drawn: drawn.source != "given"),
    st.lists(st.tuples(numbers(-4.0, 4.0), numbers(-4.0, 4.0)), min_size=1, max_size=60),
)
def test_the_incremental_law_is_increments_of_the_last_drive(
    drawn: Drawn, samples: list[tuple[float, float]]
) -> None:
    controller, twin = drawn.controller(), drawn.twin()
    for reference, measurement in samples:
        # up to 60 samples of terms up to 1e4 V, which the twin adds one by one
        drive = controller.step(reference, measurement)
        assert drive == pytest.approx(twin.step(reference, measurement), rel=0, abs=1e-8)


@given(setups(("positional",)), st.lists(events(), min_size=1, max_size=40))
def test_incremental_is_positional_where_nothing_is_limited(
    drawn: Drawn, happenings: Events
) -> None:
    free = {"limits": (-1e100, 1e100), "slew": None}
    positional = drawn.controller(**free)
    incremental = drawn.controller(**free, law="incremental")
    assert drives(positional, happenings) == drives(incremental, happenings)


@given(numbers(0.0, 100.0), numbers(100.0, 1e5), numbers(4.0, 1e3), st.booleans())
def test_the_integral_does_not_wind_up(kp: float, ki: float, reference: float, back: bool) -> None:
    controller = mh.control.HybridController(
        None,
        kp=kp,
        ki=ki,
        dt=DT,
        limits=(-500.0, 500.0),
        anti_windup="back_calculation" if back else "conditional",
    )
    for _ in range(4000):
        controller.step(reference, 0.0)
    # What one error per integral time adds: kp e, or one sample's. Without it would be 4000.
    largest = 1000.0 + 2.0 * max(kp, ki * DT) * reference
    assert controller.state["feedback_loop"]["integral"] <= largest
    samples = 0
    while controller.step(0.0, reference) >= 500.0:
        samples += 1
    integral_time = max(1.0, kp / (ki * DT))  # samples
    assert samples <= (20.0 * integral_time if back else 0.0)
    assert np.isfinite(controller.drive)
