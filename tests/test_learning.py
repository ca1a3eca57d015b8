"""Learning and observation from Python: the faces of what the Rust tests judge."""

from __future__ import annotations

import json
import math
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest

STAGE = mh.plant.SecondOrder(400.0, 0.95)
LOOP: dict[str, Any] = {"kp": 60.0, "ki": 6e3, "slope": 5e-3, "dynamics": STAGE, "dt": 1e-4}
WAVE = np.sin(2 * np.pi * np.arange(500) / 500)


def test_learning_shrinks_the_error_of_a_lag_that_it_believes_wrong() -> None:
    believed = mh.plant.SecondOrder(420.0, 0.76)
    open_loop: dict[str, Any] = {
        "kp": 0.0,
        "ki": 0.0,
        "slope": 1.0,
        "dynamics": believed,
        "dt": 1e-4,
    }
    learning = mh.control.IterativeLearning(WAVE, bandwidth=400.0, **open_loop)
    assert learning.convergence_rate() < learning.convergence_rate(dynamics=STAGE) < 0.5
    for _ in range(5):
        position = STAGE.response(np.tile(learning.target, 2), dt=1e-4)[499:-1]
        assert learning.update(WAVE - position)
    assert learning.rmse[0] > 0.05
    assert learning.rmse[-1] < 1e-3
    assert np.all(learning.max_error >= learning.rmse)


def test_a_target_is_not_to_be_written_to() -> None:
    learning = mh.control.IterativeLearning(WAVE, bandwidth=150.0, **LOOP)
    with pytest.raises(ValueError, match="read-only"):
        learning.target[0] = 1.0


LIGHT = mh.Stage(
    mh.ModifiedPrandtlIshlinskii.from_ratios(
        np.r_[0.4, np.full(9, 0.04)], 15.0 * np.arange(10), ra=0.9, rb=0.45, rc=0.6
    ),
    limits=(0.0, 150.0),
    slew=2e4,
    dead_time=1e-4,
    dynamics=mh.plant.SecondOrder(800.0, 0.02),
    noise=0.002,
)
"""Lightly damped, as it is believed: 100 um, 10 kHz."""
TRUE = LIGHT.replace(
    hysteresis=mh.ModifiedPrandtlIshlinskii.from_ratios(
        np.r_[0.43, np.full(9, 0.046)], 15.0 * np.arange(10), ra=0.8, rb=0.5, rc=0.6
    ),
    dynamics=mh.plant.SecondOrder(824.0, 0.015),
)
"""As it is: other weights, a mode 3 % higher with three quarters of the damping."""
N = 1000
FAST = 12.0 * np.arcsin(0.98 * np.sin(2 * np.pi * np.arange(N) / N - 0.5 * np.pi))


def periods(
    learning: mh.control.IterativeLearning | None, number: int, drift: float = 0.0
) -> tuple[list[float], mh.plant.Run]:
    """The true rms error of each period of a raster whose middle drifts, and the last run."""
    controller = LIGHT.controller(1e-4)
    plant = TRUE.plant(1e-4, seed=3)
    lead = np.linspace(0.0, 25.0 + FAST[0], 3 * N)
    mh.plant.simulate(controller, plant, lead)
    errors = []
    for period in range(number):
        middle = 25.0 + drift * (period + np.arange(N) / N)
        correction = np.zeros(N) if learning is None else learning.correction
        reference = middle + FAST
        run = mh.plant.simulate(controller, plant, reference, target=reference + correction)
        if learning is not None and period > 0:  # the first one arrives from the lead-in
            learning.update(run.reference - run.measured)
        errors.append(float(np.sqrt(np.mean((run.reference - run.position) ** 2))))
    return errors, run


def test_a_raster_is_learned_while_its_slow_axis_drifts() -> None:
    learning = LIGHT.iterative_learning(FAST, 1e-4)
    without, _ = periods(None, 3, drift=0.5)
    with_it, run = periods(learning, 12, drift=0.5)
    assert min(with_it[-3:]) < 0.3 * without[-1]
    assert run.drive.min() >= 0.0
    assert run.drive.max() <= 150.0


def test_learning_goes_on_another_day() -> None:
    """Saved as text, loaded into new objects: the corrections are there from the first period."""
    learning = LIGHT.iterative_learning(FAST, 1e-4)
    first, _ = periods(learning, 9)
    kept = json.dumps(learning.state)
    again = LIGHT.iterative_learning(FAST, 1e-4)
    again.state = json.loads(kept)
    second, _ = periods(again, 4)
    assert second[2] < 1.3 * first[-1]
    assert second[2] < 0.4 * first[1]


def test_no_drive_leaves_limits_or_slew_while_learning() -> None:
    """A raster that the stage cannot reach, learned in both ways: drives stay where they may be."""
    wild = 3.0 * FAST  # beyond both ends of the stroke
    for scheme in ("iterative", "repetitive"):
        controller, plant = LIGHT.controller(1e-4), TRUE.plant(1e-4, seed=1)
        drives = [controller.drive]
        iterative = LIGHT.iterative_learning(40.0 + wild, 1e-4)
        repetitive = LIGHT.repetitive_control(N, 1e-4)
        for _ in range(8):
            around: dict[str, Any] = {"repetitive": repetitive}
            if scheme == "iterative":
                around = {"target": iterative.target}
            run = mh.plant.simulate(controller, plant, 40.0 + wild, **around)
            iterative.update(run.reference - run.measured)
            drives.extend(run.drive)
        assert np.all((np.array(drives) >= 0.0) & (np.array(drives) <= 150.0))
        assert np.abs(np.diff(drives)).max() <= 2e4 * 1e-4 * (1.0 + 1e-12)
        assert controller.saturated_count > 1000


def test_repetitive_control_chooses_how_far_it_learns() -> None:
    """As far as it converges on every mode that the true one may be."""
    usual = LIGHT.repetitive_control(N, 1e-4)
    assert usual.bandwidth > 500.0
    assert usual.convergence_rate(dynamics=mh.plant.SecondOrder(760.0, 0.01)) < 1.0
    assert usual.convergence_rate(dynamics=mh.plant.SecondOrder(840.0, 0.01)) < 1.0
    with pytest.raises(ValueError, match="kp: expected gains at which the loop is stable also"):
        LIGHT.repetitive_control(N, 1e-4, frequency_uncertainty=0.2, damping_uncertainty=4.0)


def test_an_observer_follows_its_model_and_leaves_no_static_error() -> None:
    actuator = mh.paper.table_1_recovered()
    observer = mh.control.Observer(
        actuator, dynamics=STAGE, noise=0.016, drift=0.5, dead_time=1e-4, dt=1e-4
    )
    drive = 400.0 * np.sin(2 * np.pi * 20.0 * 1e-4 * np.arange(1500))
    held = np.concatenate([[0.0], drive])  # the dead time is one sample
    position = STAGE.response(actuator.forward().run(held), dt=1e-4)[1:]
    # a step takes the drive that was held until now, so its estimate is the next row of a record
    estimates = [observer.step(u, math.nan) for u in drive]
    np.testing.assert_allclose(estimates, position, atol=1e-12)  # rounding only
    assert observer.rejected == len(drive)
    observer.reset()
    for _ in range(100_000):
        estimate = observer.step(0.0, 0.1)
    assert abs(estimate - 0.1) < 1e-9
    assert abs(observer.disturbance - 0.1) < 1e-9
    assert 0.0 < observer.position_gain < 1.0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"kp": 1e5}, "kp: expected gains at which the loop is stable, got 100000.0"),
        ({"ki": math.nan}, "ki: expected a finite number >= 0"),
        ({"slope": -1.0}, "slope: expected a finite number >= 0"),
        ({"dead_time": -1.0}, "dead_time: expected"),
        ({"dt": 0.0}, "dt: expected a finite number above 0"),
        ({"bandwidth": 0.0}, "bandwidth: expected a finite number above 0"),
    ],
)
def test_a_loop_that_cannot_learn_is_refused(change: dict[str, float], message: str) -> None:
    options = {**LOOP, "bandwidth": 150.0, **change}
    for build in (
        lambda: mh.control.IterativeLearning(WAVE, **options),
        lambda: mh.control.RepetitiveControl(500, **options),
    ):
        with pytest.raises(ValueError) as caught:
            build()
        assert str(caught.value).startswith(message)


@pytest.mark.parametrize(
    ("build", "kind", "message"),
    [
        (
            lambda: mh.control.IterativeLearning(
                WAVE, **{**LOOP, "dynamics": 400.0}, bandwidth=150.0
            ),
            TypeError,
            "dynamics: expected FirstOrder, SecondOrder, Antiresonance, Modes, StateSpace, a list "
            "of them in series, or an object of scipy.signal or control, got 400.0",
        ),
        (
            lambda: mh.control.IterativeLearning([0.0, math.inf], bandwidth=150.0, **LOOP),
            ValueError,
            "target[1]: expected a finite number",
        ),
        (
            lambda: mh.control.IterativeLearning(
                WAVE, bandwidth=150.0, target_limits=(1.0, 0.0), **LOOP
            ),
            ValueError,
            "target_limits[1]: expected finite limits, the high one above the low one, got 0.0",
        ),
        (
            lambda: mh.control.IterativeLearning(WAVE, bandwidth=150.0, **LOOP).update(WAVE[1:]),
            ValueError,
            "error: expected 500",
        ),
        (
            lambda: mh.control.IterativeLearning(WAVE, noise=-1.0, **LOOP),
            ValueError,
            "noise: expected a finite number >= 0, got -1.0",
        ),
        (
            lambda: mh.control.IterativeLearning(WAVE, slope_uncertainty=0.5, **LOOP),
            ValueError,
            "slope_uncertainty: expected a factor from 1 to 100, got 0.5",
        ),
        (
            lambda: mh.control.RepetitiveControl(500, frequency_uncertainty=0.6, **LOOP),
            ValueError,
            "frequency_uncertainty: expected a share from 0 to 0.5, got 0.6",
        ),
        (
            lambda: mh.control.RepetitiveControl(7, bandwidth=150.0, **LOOP),
            ValueError,
            "period: expected 8 to 2^22 samples, got 7",
        ),
        (
            lambda: mh.control.RepetitiveControl(500, bandwidth=150.0, settle=-1, **LOOP),
            ValueError,
            "settle: expected a whole number of at least zero, got -1",
        ),
        (
            lambda: mh.control.RepetitiveControl(10**12, bandwidth=150.0, **LOOP),
            ValueError,
            "period: expected 8 to 2^22 samples, got 1000000000000",
        ),
        (
            lambda: mh.control.IterativeLearning([1.0], bandwidth=150.0, **LOOP),
            ValueError,
            "target: expected at least two samples of a period, got 1",
        ),
        (
            lambda: mh.control.IterativeLearning(
                WAVE, bandwidth=150.0, target_limits=(math.nan, 1.0), **LOOP
            ),
            ValueError,
            "target_limits[0]: expected finite limits, the high one above the low one, got NaN",
        ),
        (
            lambda: mh.control.Observer(
                mh.paper.table_1(), dynamics=STAGE, noise=0.0, drift=1.0, dt=1e-4
            ),
            ValueError,
            "noise: expected a finite number above 0",
        ),
        (
            lambda: mh.control.Observer(3, dynamics=STAGE, noise=1.0, drift=1.0, dt=1e-4),  # type: ignore[arg-type]
            TypeError,
            "stage: expected a PrandtlIshlinskii or a ModifiedPrandtlIshlinskii, got 3",
        ),
    ],
)
def test_wrong_input_is_named(build: Any, kind: type[Exception], message: str) -> None:
    with pytest.raises(kind) as caught:
        build()
    assert str(caught.value).startswith(message)
