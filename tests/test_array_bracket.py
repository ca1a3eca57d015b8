"""Brackets of arrays, the common demagnetising sequence, and parts of arrays."""

from __future__ import annotations

import math
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from actuators import MODELS, M, samples
from support import bits

LIMITS = np.array([(-60.0, 60.0), (0.0, 90.0), (-20.0, 30.0), (-60.0, 60.0), (-5.0, 5.0)])


def test_the_brackets_are_those_of_single_models() -> None:
    drives = samples()
    brackets = mh.ActuatorArray(MODELS).bracket(LIMITS)
    singles = [model.bracket(tuple(own)) for model, own in zip(MODELS, LIMITS, strict=True)]
    low, high = brackets.run(drives)
    for k, row in enumerate(drives):
        for m, (single, u) in enumerate(zip(singles, row, strict=True)):
            assert (low[k, m], high[k, m]) == single.step(u)
    assert brackets.width.tolist() == [single.width for single in singles]
    assert [list(one) for one in brackets.outputs] == [
        [single.outputs[side] for single in singles] for side in (0, 1)
    ]
    stepped = mh.ActuatorArray(MODELS).bracket(LIMITS)
    for row, lowest, highest in zip(drives, low, high, strict=True):
        a, b = stepped.step(row)
        assert bits(a) == bits(lowest) and bits(b) == bits(highest)
    assert stepped.state == brackets.state and len(stepped) == M
    assert brackets.limits.tolist() == LIMITS.tolist()
    stepped.reset()
    inside = np.clip(drives, LIMITS[:, 0], LIMITS[:, 1])
    stepped.follow(inside)
    assert bits(stepped.width) == bits(brackets.width)


def test_the_truth_lies_in_the_bracket_whatever_was_before() -> None:
    random = np.random.default_rng(1)
    mirror = mh.ActuatorArray(MODELS)
    bracket = mirror.bracket(LIMITS)
    low, high = bracket.run(drives := random.uniform(LIMITS[:, 0], LIMITS[:, 1], (50, M)))
    for _ in range(20):
        plant = mirror.forward()
        plant.run(random.uniform(LIMITS[:, 0], LIMITS[:, 1], (30, M)))
        y = plant.run(drives)
        assert np.all((low - 1e-12 <= y) & (y <= high + 1e-12))


def test_one_sequence_demagnetises_all_within_its_bound() -> None:
    random = np.random.default_rng(2)
    mirror = mh.ActuatorArray(MODELS)
    slew, center = np.array([500.0, 700.0, 400.0, 500.0, 90.0]), [m.input_offset for m in MODELS]
    limits = np.array([(c - 40.0, c + 40.0) for c in center])
    limits[2] = (-20.0, 400.0)  # not in the middle: 400 V are not wiped out
    given: dict[str, Any] = {"slew": slew, "rate": 1e3, "center": center, "start": center}
    drives, left = mirror.demagnetize(limits, cycles=10, **given)
    assert drives[0].tolist() == drives[-1].tolist() == center
    assert np.all((limits[:, 0] <= drives) & (drives <= limits[:, 1]))
    assert np.all(np.abs(np.diff(drives, axis=0)) <= slew / 1e3 * (1 + 1e-9))
    rest, ends = mirror.forward().step(center), []
    for _ in range(20):
        plant = mirror.forward()
        plant.run(random.uniform(limits[:, 0], limits[:, 1], (30, M)))
        ends.append(plant.run(drives)[-1])
    errors = np.abs(np.array(ends) - rest).max(axis=0)
    assert np.all(errors <= left + 1e-12) and errors.max() > 0.1
    stroke = np.ptp(mirror.forward().run(limits.T.copy()), axis=0)
    symmetric = [0, 1, 3, 4]
    assert np.all(left[symmetric] < 0.02 * stroke[symmetric])
    twice = mirror.demagnetize(limits, cycles=20, **given)[1]
    assert np.all(twice[symmetric] <= 0.7 * left[symmetric] + 1e-12)
    # The history is known behind a full stroke, though the memory is not that of rest.
    known = mirror.bracket(limits)
    known.follow(drives)
    assert np.all(known.width[symmetric] == 0.0) and known.width[2] > 0.0


def test_a_sequence_starts_and_ends_where_it_is_told() -> None:
    mirror = mh.ActuatorArray(MODELS)
    drives, left = mirror.demagnetize(LIMITS, slew=500.0, rate=1e3, start=1.0, shape="sine")
    assert drives[0].tolist() == drives[-1].tolist() == [1.0] * M
    assert np.all((LIMITS[:, 0] <= drives) & (drives <= LIMITS[:, 1])) and np.all(left >= 0.0)
    assert drives.max(axis=0).tolist() == LIMITS[:, 1].tolist()
    assert drives.min(axis=0).tolist() == LIMITS[:, 0].tolist()


def test_a_negative_weight_has_no_bound() -> None:
    model = mh.PrandtlIshlinskii([1.0, -0.5], [0.0, 2.0])
    mirror = mh.ActuatorArray([MODELS[0], model])
    left = mirror.demagnetize((-5.0, 5.0), slew=100.0, rate=1e3, shape="sine")[1]
    assert left[0] < 0.01 and math.isnan(left[1])
    with pytest.raises(
        ValueError, match="actuator 1: weights: expected a finite number >= 0"
    ) as no:
        mirror.bracket((-5.0, 5.0))
    assert getattr(no.value, "parameter", None) == "weights"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"limits": (5.0, -5.0)}, "limits[1]: expected a number above the low limit = 5.0"),
        ({"limits": None}, "limits: expected"),
        ({"slew": 0.0}, "slew: expected a finite number above 0 (of actuator 0), got 0.0"),
        ({"slew": [1.0, 2.0]}, "slew: expected a number or an array of shape (5,), got 2 elements"),
        ({"rate": 1.0}, "rate: expected at least "),
        ({"cycles": 0}, "cycles: expected a whole number of at least one, got 0"),
        ({"shape": "square"}, 'shape: expected "triangle" or "sine"'),
        ({"center": 60.0}, "center: expected a number between low = -60.0"),
        ({"start": math.nan}, "start: expected a number from low = -60.0"),
    ],
)
def test_a_wrong_argument_is_named(options: dict[str, Any], message: str) -> None:
    given = {"limits": (-60.0, 60.0), "slew": 100.0, **options}
    with pytest.raises((ValueError, TypeError)) as caught:
        mh.ActuatorArray(MODELS).demagnetize(**given)
    assert str(caught.value).startswith(message), str(caught.value)


def test_wrong_drives_of_a_bracket_are_named() -> None:
    bracket = mh.ActuatorArray(MODELS).bracket((-5.0, 5.0))
    before = bracket.state
    with pytest.raises(ValueError, match=r"drives\[4\]: expected a number from -5.0 to 5.0"):
        bracket.follow([[0.0] * 5, [0.0] * 4 + [6.0]])
    with pytest.raises(ValueError, match="drive: expected an array of shape"):
        bracket.step([0.0])
    with pytest.raises(ValueError, match="state: expected a list of 5 states, got 4"):
        bracket.state = before[:4]
    with pytest.raises(ValueError, match="actuator 1"):
        bracket.state = [before[0], before[0], *before[2:]]
    assert bracket.state == before


def test_parts_of_an_array() -> None:
    mirror = mh.ActuatorArray(MODELS)
    assert mirror[-1] == MODELS[-1] and mirror[np.int64(1)] == MODELS[1]
    assert mirror[1:4] == mh.ActuatorArray(MODELS[1:4])
    assert mirror[::-2].models == tuple(MODELS[::-2])
    assert [mirror[m] for m in range(M)] == MODELS
    for wrong in (M, -M - 1):
        with pytest.raises(IndexError):
            mirror[wrong]
    with pytest.raises(ValueError, match="models: expected at least one model"):
        mirror[3:3]


def test_another_model_makes_another_array() -> None:
    mirror = mh.ActuatorArray(MODELS)
    other = mirror.set_model(-2, MODELS[0])
    assert mirror.models == tuple(MODELS)
    assert other.models == (*MODELS[:3], MODELS[0], MODELS[4]) and other != mirror
    assert other.set_model(np.int64(3), MODELS[3]) == mirror
    for wrong in (M, -M - 1, 1.5, "1"):
        with pytest.raises(ValueError, match="actuator: expected a whole number from -5 to 4"):
            mirror.set_model(wrong, MODELS[0])  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="model"):
        mirror.set_model(0, 3.0)  # type: ignore[arg-type]
