"""Changes of running axes: as those of single controllers, bit for bit."""

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
from axes import CROSSTALK, DT, LIMITS, MODELS, controllers, made, model, walk

# The other weights of a running actuator: the operators are the same.
STIFFER = [
    mh.ModifiedPrandtlIshlinskii(0.9 * one.weights, one.r, one.ra, one.rb, one.rc) for one in MODELS
]
NOTCH = mh.control.Notch(900.0, 0.1, 1.0)
CHANGES: dict[str, Callable[..., None]] = {
    "gains": lambda one, *axis: one.set_gains(*axis, kp=3.0, ki=2e3),
    "filters": lambda one, *axis: one.set_filters(*axis, filters=NOTCH),
    "filters, twice": lambda one, *axis: one.set_filters(*axis, filters=[NOTCH, NOTCH]),
    "model": lambda one, *axis: one.set_model(*axis, model=STIFFER[1]),
    "feedforward": lambda one, *axis: one.set_feedforward(
        *axis, feedforward=STIFFER[1].inverse(LIMITS)
    ),
    "no feedforward": lambda one, *axis: one.set_feedforward(*axis, feedforward=None),
}


@pytest.mark.parametrize("name", CHANGES)
def test_a_change_of_one_axis_is_that_of_a_single_controller(name: str) -> None:
    axes, single = mh.control.MultiAxisController(controllers(2)), controllers(2)
    changed = False
    for k, (r, y) in enumerate(zip(walk(150, 2, 3.0), walk(150, 2, 3.0), strict=True)):
        if k == 70:
            before = axes.state
            CHANGES[name](axes, 1)
            CHANGES[name](single[1])
            changed = axes.state != before
        drives = [one.step(*z) for one, *z in zip(single, r, y, strict=True)]
        assert axes.step(r, y).tolist() == drives
    assert changed
    assert [one.state for one in axes.controllers] == [one.state for one in single]
    assert axes.kp.tolist() == [one.kp for one in single]
    assert axes.ki.tolist() == [one.ki for one in single]
    assert [repr(one) for one in axes.terms] == [repr(one.terms) for one in single]


@pytest.mark.parametrize("name", CHANGES)
def test_changed_axes_are_saved_copied_and_pickled(name: str) -> None:
    axes, steps = made(), list(zip(walk(60, 2, 3.0), walk(60, 2, 2.0), strict=True))
    for r, y in steps[:20]:
        axes.step(r, y)
    unchanged = axes.copy() if hasattr(axes, "copy") else copy.copy(axes)
    CHANGES[name](axes, 1)
    for r, y in steps[20:40]:
        axes.step(r, y)
    saved, others = axes.state, [copy.copy(axes), pickle.loads(pickle.dumps(axes))]
    onwards = [axes.step(r, y).tolist() for r, y in steps[40:]]
    for other in others:
        assert other.state == saved
        assert [other.step(r, y).tolist() for r, y in steps[40:]] == onwards
    axes.state = json.loads(json.dumps(saved))
    assert [axes.step(r, y).tolist() for r, y in steps[40:]] == onwards
    # a state belongs to what it was changed to
    if name != "feedforward":
        with pytest.raises(ValueError, match=r"^state"):
            unchanged.state = saved


@pytest.mark.parametrize("name", CHANGES)
def test_a_change_is_no_jump(name: str) -> None:
    axes, y = made(), [0.8, 0.1]
    for _ in range(100):
        before = axes.step([1.0, 0.5], y)
    old = axes.terms[1]
    CHANGES[name](axes, 1)
    step = np.abs(axes.step([1.0, 0.5], y) - before)
    new = axes.terms[1]
    # a fiftieth of what the bumpless term took, and what the integral moves by
    assert step[0] < 1.0 and step[1] < 3.0  # V
    jump = abs(new.feedforward - old.feedforward) + abs(new.proportional - old.proportional)
    assert jump > 10.0 or "filters" in name, "filters begin with what was put out before"


@pytest.mark.parametrize("name", CHANGES)
def test_a_change_drops_what_is_planned_for_all(name: str) -> None:
    axes = made()
    axes.step([1.0, 0.5], [0.0, 0.0])
    axes.plan([1.0, 0.5], [0.0, 0.0])
    CHANGES[name](axes, 0)
    drive = axes.drive.tolist()
    assert not axes.commit()
    assert axes.drive.tolist() == drive


@pytest.mark.parametrize("axis", [2, -1, 1.5, "x", None])
@pytest.mark.parametrize("name", CHANGES)
def test_an_axis_that_is_none_is_named(name: str, axis: object) -> None:
    axes = made()
    axes.plan([1.0, 0.5], [0.0, 0.0])
    before = axes.state
    with pytest.raises(ValueError, match=r"^axis: expected a whole number .*, got ") as caught:
        CHANGES[name](axes, axis)
    assert caught.value.parameter == "axis"  # type: ignore[attr-defined]
    assert axes.state == before and axes.commit()


def test_what_is_refused_is_named_and_changes_nothing() -> None:
    axes = made()
    axes.step([1.0, 0.5], [0.0, 0.0])
    before, drive = axes.state, axes.drive.tolist()
    axes.plan([1.0, 0.5], [0.0, 0.0])
    other_limits = MODELS[0].inverse((-1.0, 1.0))
    refused: list[tuple[str, Callable[[], object]]] = [
        (r"axis: expected a whole number from 0 to 1, got 2$", lambda: axes.set_gains(2, 1.0, 1.0)),
        (r"kp: expected a finite number >= 0, got -1.0", lambda: axes.set_gains(0, -1.0, 1.0)),
        (r"ki: expected a number, got 'x'", lambda: axes.set_gains(0, 1.0, "x")),  # type: ignore[arg-type]
        (r"filters: expected ", lambda: axes.set_filters(0, 5)),  # type: ignore[arg-type]
        (r"model: expected the ", lambda: axes.set_model(0, mh.PrandtlIshlinskii([1.0], [0.0]))),
        (r"model: expected ", lambda: axes.set_model(0, 5)),  # type: ignore[arg-type]
        (r"feedforward: expected ", lambda: axes.set_feedforward(0, other_limits)),
        (r"feedforward: expected ", lambda: axes.set_feedforward(0, 5)),  # type: ignore[arg-type]
        (r"rest_drives\[1\]: expected a number from -560", lambda: axes.stop(1e3, [0.0, 561.0])),
        (r"drives\[0\]: expected a number from -560", lambda: axes.start_at([-561.0, 0.0])),
        (r"drives\[1\]: expected a number from -560", lambda: axes.reset([0.0, math.inf])),
        (r"drives\[1\]: expected a number from -560", lambda: axes.follow([[0.0, 1e3]])),
        (r"drives: expected an array of shape \(2,\)", lambda: axes.reset([0.0])),
        (r"drives: expected an array of shape \(samples, 2\)", lambda: axes.follow([[0.0]])),
    ]
    for message, change in refused:
        with pytest.raises((ValueError, TypeError), match="^" + message) as caught:
            change()
        assert caught.value.parameter == message.partition(":")[0].partition(r"\[")[0]  # type: ignore[attr-defined]
    assert axes.state == before and axes.drive.tolist() == drive
    assert axes.commit(), "a change that is refused leaves the plan"


def test_the_mode_is_that_of_all_or_of_each() -> None:
    axes, single = mh.control.MultiAxisController(controllers(2)), controllers(2)
    modes = ("run", "feedforward", ("hold", "run"), ("feedforward", "hold"), ["run", "run"], "hold")
    samples = zip(walk(120, 2, 3.0), walk(120, 2, 3.0), strict=True)
    for k, (r, y) in enumerate(samples):
        if k % 20 == 0:
            mode = modes[k // 20]
            axes.mode = mode  # type: ignore[assignment]
            each = (mode, mode) if isinstance(mode, str) else mode
            for one, its in zip(single, each, strict=True):
                one.mode = its  # type: ignore[assignment]
            assert axes.mode == tuple(each) and axes.hold == (mode == "hold")
        drives = [one.step(*z) for one, *z in zip(single, r, y, strict=True)]
        assert axes.step(r, y).tolist() == drives
    axes.stop(1e4)
    assert axes.mode == ("stop", "stop")
    before = axes.state
    wrong: list[tuple[Any, str]] = [
        ("stop", r'mode: expected "run", "feedforward" or "hold", got "stop"'),
        (["run", "go"], r'mode\[1\]: expected "run", "feedforward" or "hold", got "go"'),
        (["run"], r'mode: expected "run", "feedforward" or "hold", or a list of 2 of these, got '),
        (5, r'mode: expected "run", "feedforward" or "hold", or a list of 2 of these, got 5'),
    ]
    for mode, message in wrong:
        with pytest.raises((ValueError, TypeError), match="^" + message) as caught:
            axes.mode = mode
        assert caught.value.parameter == "mode"  # type: ignore[attr-defined]
    assert axes.state == before


def test_axes_take_over_what_was_driven_and_begin_again_elsewhere() -> None:
    axes, single = made(), controllers(2, slew=1e6)
    drives = walk(30, 2, 300.0)
    axes.follow(drives)
    for one, its in zip(single, drives.T, strict=True):
        one.follow(its)
    assert [one.state for one in axes.controllers] == [one.state for one in single]
    assert axes.drive.tolist() == drives[-1].tolist()
    axes.reset([5.0, -5.0])
    for one, drive in zip(single, (5.0, -5.0), strict=True):
        one.reset(drive)
    assert [one.state for one in axes.controllers] == [one.state for one in single]
    targets = mh.control.HybridController(
        model(1.0, 1.0).forward(), kp=0.0, ki=0.0, dt=DT, limits=LIMITS
    )
    axes = mh.control.MultiAxisController([single[0], targets], CROSSTALK)
    before = axes.state
    with pytest.raises(ValueError, match=r"^drives: expected a feed-forward that follows drives"):
        axes.follow(drives)
    assert axes.state == before


def test_the_lead_in_is_the_longest_of_the_axes() -> None:
    short, long = controllers(1, bumpless_time=1e-3)[0], controllers(1, bumpless_time=7e-3)[0]
    axes = mh.control.MultiAxisController([short, long])
    assert axes.lead_in == long.lead_in > short.lead_in
