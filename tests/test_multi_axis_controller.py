"""A controller that a stage of several axes leads, on a mirror simulated without the package."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from support import Array

DT = 1.0 / 6400.0
COUPLING = np.array([[1.0, -0.4], [0.5, 0.9]])
MODES = 2.0 * np.pi * np.array([600.0, 750.0])
DAMPING = np.array([0.04, 0.05])
THRESHOLDS, WEIGHTS = np.array([0.15, 0.5, 1.0]), np.array([0.15, 0.12, 0.1])
NOISE = 1e-3


class Mirror:
    """Drives go through plays, their sums move two coupled resonances; ten steps in a sample."""

    def __init__(self, seed: int, gain: float = 1.0) -> None:
        self.rng, self.gain = np.random.default_rng(seed), gain
        self.plays, self.y, self.v = np.zeros((2, 3)), np.zeros(2), np.zeros(2)

    def read(self) -> Array:
        return np.asarray(self.y + NOISE * self.rng.standard_normal(2))

    def hold(self, drives: Array) -> None:
        row = drives[:, None]
        self.plays = np.maximum(row - THRESHOLDS, np.minimum(row + THRESHOLDS, self.plays))
        force = self.gain * COUPLING @ (drives + self.plays @ WEIGHTS)
        for _ in range(10):
            self.v = self.v + 0.1 * DT * (
                MODES**2 * (force - self.y) - 2.0 * DAMPING * MODES * self.v
            )
            self.y = self.y + 0.1 * DT * self.v


def record(seed: int, samples: int = 3000) -> tuple[Array, Array]:
    rng, plant = np.random.default_rng(seed), Mirror(seed)
    white = rng.standard_normal((samples, 2))
    kernel = np.hanning(9)
    u = np.column_stack([np.convolve(one, kernel, "same") for one in white.T])
    slow = np.hanning(301)
    u += 0.4 * np.column_stack([np.convolve(one, slow, "same") for one in white.T])
    u *= np.minimum(np.arange(samples) / 100.0, 1.0)[:, None] / u.std(axis=0)
    y = np.empty_like(u)
    for k, row in enumerate(u):
        y[k] = plant.read()
        plant.hold(row)
    return u, y


@pytest.fixture(scope="module")
def stage() -> mh.MultiAxisStage:
    u, y = zip(*(record(seed) for seed in (1, 2)), strict=True)
    found = mh.identify_axes(
        list(u), list(y), dt=DT, order=6, skip=50, hysteresis="plays", place="in_front"
    )
    return found.model


def scan(samples: int = 2000) -> Array:
    """A triangle with round corners along the first axis, a slow line along the second."""
    time = DT * np.arange(samples)
    soft = np.clip(time / 0.05, 0.0, 1.0)
    soft = soft**2 * (3.0 - 2.0 * soft)
    triangle = 2.0 / np.pi * np.arcsin(np.sin(2.0 * np.pi * 30.0 * time))
    kernel = np.hanning(61) / np.hanning(61).sum()
    triangle = np.convolve(np.pad(triangle, 30, mode="edge"), kernel, "valid")
    return np.column_stack([1.5 * soft * triangle, soft * np.sin(2.0 * np.pi * 4.0 * time)])


def missed(controller: mh.control.MultiAxisController, plant: Mirror, wanted: Array) -> Array:
    ahead = controller.ahead
    early = np.vstack([wanted[ahead:], np.repeat(wanted[-1:], ahead, axis=0)])
    # The window fills while the reference rests.
    for row in wanted[:ahead]:
        plant.hold(controller.step(row, plant.read()))
    errors = np.empty_like(wanted)
    for k, row in enumerate(early):
        errors[k] = plant.y - wanted[k]
        plant.hold(controller.step(row, plant.read()))
    return np.asarray(np.sqrt((errors[500:] ** 2).mean(axis=0)))


def test_a_scan_is_tracked_near_the_noise_in_a_closed_loop(stage: mh.MultiAxisStage) -> None:
    wanted = scan()
    open_loop = stage.controller((-5.0, 5.0))
    open_loop.mode = "feedforward"
    without = missed(open_loop, Mirror(7, gain=1.03), wanted)
    closed = missed(stage.controller((-5.0, 5.0)), Mirror(7, gain=1.03), wanted)
    assert (closed < 0.25 * without).all(), (closed, without)
    assert (closed < 6.0 * NOISE).all(), closed


def test_the_feed_forward_is_that_of_a_whole_reference(stage: mh.MultiAxisStage) -> None:
    wanted = scan() + stage.output_offset
    controller = stage.controller((-5.0, 5.0))
    controller.mode = "feedforward"
    ahead, drives = controller.ahead, np.empty_like(wanted)
    for row in np.repeat(wanted[:1], ahead, axis=0):
        controller.step(row, row)
    for k in range(len(wanted)):
        row = wanted[min(k + ahead, len(wanted) - 1)]
        drives[k] = controller.step(row, row)
    whole, _ = stage.precompensate(wanted)
    inner = slice(100, -100)
    assert (np.abs(drives - whole)[inner].max(axis=0) < 0.01 * np.abs(whole).max()).all()


def test_bad_samples_are_held_and_counted(stage: mh.MultiAxisStage) -> None:
    controller = stage.controller([(-5.0, 5.0), (-1.0, 1.0)], slew=2000.0)
    wanted, plant = 3.0 * scan(400), Mirror(3)
    last = np.zeros(2)
    for k, row in enumerate(wanted):
        measured = plant.read()
        if k % 7 == 3:
            measured[k % 2] = np.nan
        drives = controller.step(row, measured)
        assert (np.abs(drives) <= [5.0, 1.0]).all()
        assert (np.abs(drives - last) <= 2000.0 * DT * (1.0 + 1e-12)).all()
        last = drives
        plant.hold(drives)
    assert (controller.missing_count == 57).all()
    assert controller.saturated_count[1] > 0
    assert (controller.step([np.nan, 0.0], plant.read()) == last).all()
    assert (controller.rejected_count == 1).all()
    controller.hold = True
    assert (controller.step([0.0, 0.0], [9.0, 9.0]) == last).all()


@pytest.mark.parametrize(
    "bad",
    [
        {"references": [0.0, 0.0], "feedforward": [0.1, np.nan]},
        {"references": [0.0, 0.0], "targets": [np.nan, 0.0], "feedforward": [0.1, 0.1]},
        {"references": [np.nan, 0.0], "feedforward": [0.1, 0.1]},
    ],
)
def test_what_is_not_finite_is_not_remembered(
    bad: dict[str, Any], stage: mh.MultiAxisStage
) -> None:
    controller = stage.controller((-5.0, 5.0))
    for _ in range(50):
        last = controller.step([0.0, 0.0], [0.0, 0.0])
    assert (controller.step(measurements=[0.0, 0.0], **bad) == last).all()
    assert (controller.rejected_count == 1).all()
    assert np.isfinite(controller.step([0.0, 0.0], [0.0, 0.0])).all()
    assert np.isfinite(controller.disturbance).all()
    twin = pickle.loads(pickle.dumps(controller))
    assert (twin.step([0.1, 0.0], [0.0, 0.0]) == controller.step([0.1, 0.0], [0.0, 0.0])).all()


def test_gains_of_controllers_that_are_led_are_bounded(stage: mh.MultiAxisStage) -> None:
    single = list(stage.controller((-5.0, 5.0)).controllers)
    single[1].set_gains(kp=1.0, ki=3.0)
    with pytest.raises(ValueError, match=r"^ki\[1\]: expected 0 where a stage leads"):
        mh.control.MultiAxisController(single, stage=stage)


def test_run_is_step_bit_for_bit_and_states_go_on(stage: mh.MultiAxisStage) -> None:
    one, other = stage.controller((-5.0, 5.0)), stage.controller((-5.0, 5.0))
    wanted = scan(300)
    measured = wanted + 1e-3 * np.random.default_rng(5).standard_normal(wanted.shape)
    stepped = np.array([one.step(*pair) for pair in zip(wanted, measured, strict=True)])
    out = np.empty_like(wanted)
    assert other.run(wanted, measured, out=out) is out
    assert (out == stepped).all()
    assert (other.disturbance == one.disturbance).all()
    assert (other.disturbance != 0.0).any()
    twins = [copy.copy(one), pickle.loads(pickle.dumps(one))]
    fresh = stage.controller((-5.0, 5.0))
    fresh.state = one.state
    rest = one.run(wanted[::-1], measured[::-1])
    for twin in [*twins, fresh]:
        assert (twin.run(wanted[::-1], measured[::-1]) == rest).all()
    assert one.stage == stage


def test_less_of_the_disturbance_can_be_taken_away(stage: mh.MultiAxisStage) -> None:
    controller = stage.controller((-5.0, 5.0))
    for axis in range(2):
        controller.set_gains(axis, kp=0.5, ki=0.0)
    assert controller.kp.tolist() == [0.5, 0.5]
    wanted = scan()
    half = missed(controller, Mirror(7, gain=1.03), wanted)
    whole = missed(stage.controller((-5.0, 5.0)), Mirror(7, gain=1.03), wanted)
    assert (half > 1.2 * whole).all()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda one: one.controller((5.0, -5.0)), "limits"),
        (lambda one: one.controller([(-5.0, 5.0)]), "limits: expected 2 rows, got 1"),
        (lambda one: one.controller((-5.0, 5.0), ahead=0), "ahead: expected 1 to 512 samples"),
        (
            lambda one: one.controller((-5.0, 5.0), peak_sensitivity=9.0),
            "peak_sensitivity: expected 1.05 to 5, got 9.0",
        ),
        (lambda one: one.controller((-5.0, 5.0), slew=-1.0), "slew"),
        (lambda one: one.controller((-5.0, 5.0)).step([0.0], [0.0, 0.0]), "references: expected"),
        (
            lambda one: mh.control.MultiAxisController(
                [mh.control.HybridController(None, kp=1.0, ki=0.0, dt=DT, limits=(-5.0, 5.0))] * 2,
                stage=one,
            ),
            r"^controllers\[0\]: expected a feed-forward that is given,",
        ),
        (
            lambda one: mh.control.MultiAxisController(
                one.controller((-5.0, 5.0)).controllers, peak_sensitivity=1.5
            ),
            "peak_sensitivity: expected None without a stage, got 1.5",
        ),
        (
            lambda one: one.controller((-5.0, 5.0)).set_gains(0, kp=1.0, ki=5.0),
            "ki: expected 0 where a stage leads",
        ),
        (
            lambda one: one.controller((-5.0, 5.0)).set_gains(0, kp=1.5, ki=0.0),
            "kp: expected 0 to 1 where a stage leads",
        ),
        (
            lambda one: one.controller((-5.0, 5.0)).set_feedforward(0, None),
            "feedforward: expected no other one where a stage leads",
        ),
    ],
)
def test_what_does_not_fit_is_refused(
    call: Callable[[Any], object], message: str, stage: mh.MultiAxisStage
) -> None:
    with pytest.raises((ValueError, TypeError), match=message):
        call(stage)


def test_only_square_stages_have_a_controller() -> None:
    wide = mh.MultiAxisStage(
        [[0.5]],
        [[0.1, 0.2]],
        [[1.0]],
        [[0.0, 0.0]],
        bw=[[]],
        cq=np.zeros((0, 1)),
        dq=np.zeros((0, 2)),
        operators=[],
        dt=DT,
    )
    with pytest.raises(
        ValueError, match="stage: expected a stage with as many drives as positions"
    ):
        wide.controller((-1.0, 1.0))
