"""Drives within limits and slew: what to identify from, and what to forget with."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
import strategies as own
from hypothesis import given
from hypothesis import strategies as st
from mpi_hyst import signals
from support import Array, Drawn

MAKERS: list[Callable[..., Array]] = [
    signals.demagnetize,
    lambda *limits, **options: signals.excitation(*limits, **options).drive,
]


@st.composite
def plans(draw: st.DrawFn) -> dict[str, Any]:
    """Limits, sampling and decay that a drive can have."""
    low = draw(st.floats(-1e3, 1e3))
    width = draw(st.floats(1e-3, 1e3))
    high, cycles = low + width, draw(st.integers(1, 12))
    center = low + width * draw(st.floats(0.05, 0.95))
    decrement = min(high - center, center - low) / (2 * cycles)
    slew = draw(st.floats(1e-2, 1e4))
    return {
        "limits": (low, high),
        "slew": slew,
        # from the coarsest sampling that there may be
        "rate": slew / decrement * draw(st.floats(1.000001, 20.0)),
        "cycles": cycles,
        "shape": draw(st.sampled_from(["triangle", "sine"])),
        "center": center,
        "start": min(max(low + width * draw(st.floats(0.0, 1.0)), low), high),
    }


def made(make: Callable[..., Array], plan: dict[str, Any]) -> Array:
    return make(*plan["limits"], **{k: v for k, v in plan.items() if k != "limits"})


@pytest.mark.parametrize("make", MAKERS)
@given(plan=plans())
def test_limits_and_slew_are_kept_and_the_drive_comes_home(
    make: Callable[..., Array], plan: dict[str, Any]
) -> None:
    drive = made(make, plan)
    low, high = plan["limits"]
    assert low <= drive.min() and drive.max() <= high
    assert drive[0] == plan["start"] == drive[-1]
    longest = plan["slew"] / plan["rate"]
    # a step is a difference of two roundings of numbers up to the larger limit
    assert np.abs(np.diff(drive)).max() <= longest * (1 + 2e-12) + 1e-15 * max(-low, high)


@given(plan=plans())
def test_both_limits_are_reached_then_reversals_shrink(plan: dict[str, Any]) -> None:
    options = {k: v for k, v in plan.items() if k != "limits"}
    got = signals.excitation(*plan["limits"], **options)
    low, high = plan["limits"]
    assert got.reversals[:4].tolist() == [high, low, high, low]
    assert got.reversals.size == 2 + 2 + 2 * plan["cycles"] - 1
    swings = np.abs(got.reversals[2:] - plan["center"])
    assert np.all(np.diff(swings[::2]) < 0) and np.all(np.diff(swings[1::2]) < 0)
    assert np.all(swings > 0)
    # the lead-in ends where both limits were reached, and not before
    assert (
        got.drive[got.initialization_samples] == low
        and got.drive[: got.initialization_samples].max(initial=low) == high
    )
    stroke = got.drive[int(got.drive.argmax()) : got.initialization_samples]
    assert stroke.size and stroke.min() > low
    # every reversal is met by a sample, in this order
    places = iter(got.drive.tolist())
    assert all(reversal in places for reversal in got.reversals.tolist())


@given(operators=st.integers(1, 20), more=st.integers(0, 5), half=st.floats(1e-2, 1e3))
def test_two_reversals_fall_between_any_two_uniform_thresholds(
    operators: int, more: int, half: float
) -> None:
    got = signals.excitation(
        -half, half, slew=half, rate=2.0 * (operators + more) * 1.001, cycles=operators + more
    )
    swings = got.reversals[2:] / half
    for i in range(operators):
        # the upper end belongs to the interval: give it a rounding
        inside = (swings_of := np.abs(swings)) > i / operators + 1e-12
        inside &= swings_of < (i + 1) / operators + 1e-12
        assert (swings[inside] > 0).any() and (swings[inside] < 0).any()


def test_every_operator_moves_both_ways_in_what_is_fitted() -> None:
    got = signals.excitation(-500.0, 500.0, slew=2000.0, rate=1000.0)
    for r in 25.0 * np.arange(20):
        z = np.diff(
            mh.CoupledPlay(r, 0.95 * r, 0.3 * r, 0.35 * r).run(got.drive)[
                got.initialization_samples :
            ]
        )
        assert (z > 0).any() and (z < 0).any()


@given(st.data())
def test_after_the_lead_in_the_memory_is_known(data: st.DataObject) -> None:
    drawn = Drawn(data.draw(own.modified_models()) | {"input_offset": 0.0})
    history = data.draw(own.input_histories(drawn.keywords, scale=250.0))
    known, unknown = drawn.model().forward(), drawn.model().forward()
    unknown.run(history)  # at most 500 in magnitude
    got = signals.excitation(-500.0, 500.0, slew=500.0, rate=500.0, cycles=5)
    a, b = known.run(got.drive), unknown.run(got.drive)
    # both draw their lines from the same turning points
    scale = drawn.output_scale([500.0])
    assert np.abs(a - b)[got.initialization_samples :].max() <= 1e-13 * scale


@st.composite
def actuators(draw: st.DrawFn) -> Drawn:
    """Models whose operators can come to rest at zero: r >= rb, ra >= rc."""
    drawn = Drawn(draw(own.modified_models() | own.conventional_models()))
    keywords = dict(drawn.keywords)
    if "rb" in keywords:
        keywords["rb"] = list(map(min, keywords["rb"], keywords["r"]))
        keywords["rc"] = list(map(min, keywords["rc"], keywords["ra"]))
    return Drawn(keywords)


@given(actuators(), st.integers(1, 30), st.sampled_from(["triangle", "sine"]), st.data())
def test_demagnetising_leaves_what_it_promises(
    drawn: Drawn, cycles: int, shape: Any, data: st.DataObject
) -> None:
    amplitude, rest = 500.0, drawn.rest
    stream, virgin = drawn.model().forward(), drawn.model().forward().step(rest)
    history = data.draw(own.input_histories(drawn.keywords, scale=amplitude))
    stream.run(np.clip(history, rest - amplitude, rest + amplitude))
    drive = signals.demagnetize(
        rest - amplitude,
        rest + amplitude,
        slew=1e4,
        rate=2.001e4 * cycles / amplitude,
        cycles=cycles,
        shape=shape,
        start=rest,
    )
    left = abs(stream.run(drive)[-1] - virgin)
    bound = amplitude / (4 * cycles) * sum(map(abs, drawn.weights[1:]))
    assert left <= bound + 1e-13 * drawn.output_scale([amplitude + abs(rest)])


def test_the_papers_actuator_forgets() -> None:
    model = mh.paper.table_1_recovered()
    random = np.random.default_rng(7)
    for _ in range(20):
        stream = model.forward()
        stream.run(random.uniform(-500.0, 500.0, 50))
        stream.run(signals.demagnetize(-500.0, 500.0, slew=2000.0, rate=1000.0))
        # 1/6000 of its range of 6.17 um
        assert abs(stream.step(0.0)) < 1e-3


def test_a_record_of_the_drive_tells_the_model_from_any_history() -> None:
    model = mh.paper.table_1_recovered()
    stream = model.forward()
    stream.run([500.0, -300.0, 200.0])
    got = signals.excitation(-500.0, 500.0, slew=2000.0, rate=500.0, start=200.0)
    y = stream.run(got.drive)
    found = mh.identify(got.drive, y, skip=got.initialization_samples, thresholds=model.r)
    assert found.fit.rmse < 1e-9 * np.ptp(y)
    np.testing.assert_allclose(found.model.weights, model.weights, rtol=1e-3)


def test_limits_that_do_not_hold_zero_start_at_the_nearest() -> None:
    options: dict[str, Any] = {"slew": 1.0, "rate": 100.0, "cycles": 2}
    assert signals.excitation(2.0, 5.0, **options).drive[0] == 2.0
    assert signals.demagnetize(-5.0, -2.0, **options)[0] == -2.0
    assert signals.demagnetize(-5.0, 2.0, **options)[0] == 0.0
    drive = signals.demagnetize(0.0, 4.0, **options)
    assert drive.max() == 4.0 and drive.min() == 0.0  # about the middle, 2


def test_what_is_made_cannot_be_changed() -> None:
    got = signals.excitation(-1.0, 1.0, slew=1.0, rate=100.0, cycles=2)
    assert not got.drive.flags.writeable and not got.reversals.flags.writeable
    assert (
        repr(got)
        == f"<Excitation: {got.drive.size} samples, {got.initialization_samples} of them to "
        "initialize, 7 reversals>"
    )


@pytest.mark.parametrize("make", MAKERS)
@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"slew": 0.0}, "slew: expected a finite number above 0, got 0.0"),
        ({"slew": math.nan}, "slew: expected a finite number above 0, got NaN"),
        ({"rate": -5.0}, "rate: expected a finite number above 0, got -5.0"),
        ({"rate": 9.9}, "rate: expected at least 10.000000 Hz: .*, got 9.9"),
        ({"rate": 1e12}, r"rate: expected at most 134217728 samples \(2\^27\), got .*"),
        ({"limits": (1.0, 1.0)}, "high: expected a number above low = 1.0, got 1.0"),
        ({"limits": (math.nan, 1.0)}, "low: expected a finite number, got NaN"),
        ({"limits": (0.0, math.inf)}, "high: expected a finite number, got inf"),
        ({"center": 2.0}, "center: expected a number between low = -2.0 and high = 2.0, got 2.0"),
        ({"start": 2.1}, "start: expected a number from low = -2.0 to high = 2.0, got 2.1"),
        ({"cycles": 0}, "cycles: expected a whole number of at least one, got 0"),
        ({"cycles": 2.5}, "cycles: expected a whole number of at least one, got 2.5"),
        ({"cycles": 10**6}, "cycles: expected a whole number from 1 to 16384, got 1000000"),
        ({"shape": "square"}, 'shape: expected "triangle" or "sine", got "square"'),
    ],
)
def test_what_no_drive_can_have_is_named(
    make: Callable[..., Array], changed: dict[str, Any], message: str
) -> None:
    plan = {"limits": (-2.0, 2.0), "slew": 1.0, "rate": 100.0, "cycles": 10} | changed
    with pytest.raises(ValueError, match=f"^{message}$"):
        made(make, plan)
