"""A controller with an observer and learning of its own."""

from __future__ import annotations

import copy
import json
import math
import pickle

import mpi_hyst as mh
import numpy as np
import pytest
from support import Array

DT, PERIOD = 1e-4, 200


@pytest.fixture(scope="module")
def stage() -> mh.Stage:
    return mh.Stage(
        mh.paper.table_1_recovered(),
        limits=(-500.0, 500.0),
        dynamics=mh.plant.SecondOrder(800.0, 0.1),
        dead_time=DT,
        noise=0.005,
    )


@pytest.fixture(scope="module")
def reference() -> Array:
    return np.asarray(mh.signals.sine(1.5, 1.0 / (PERIOD * DT), seconds=12 * PERIOD * DT))


def worn(stage: mh.Stage) -> mh.plant.Plant:
    """Return the stage with another gain than the model has."""
    model = mh.paper.table_1_recovered()
    steeper = mh.ModifiedPrandtlIshlinskii.from_ratios(
        1.08 * model.weights, model.r, ra=0.95, rb=0.3, rc=0.35
    )
    return stage.replace(hysteresis=steeper).plant(DT, seed=3)


def test_one_object_is_its_parts_joined(stage: mh.Stage, reference: Array) -> None:
    whole = stage.controller(DT, drift=0.5, period=PERIOD)
    controller = stage.controller(DT)
    observer = stage.observer(DT, drift=0.5)
    learning = stage.repetitive_control(PERIOD, DT)
    plant, twin = worn(stage), worn(stage)
    for r in reference[: 3 * PERIOD]:
        seen = observer.step(controller.drive, plant.measured)
        # With the first period to settle, learning by hand rests as long as in the controller.
        correction = learning.step(r - plant.measured, r)
        drive = controller.step(r, seen, correction=correction)
        assert whole.step(r, twin.measured) == drive
        plant.step(drive), twin.step(drive)
    assert whole.observer is not None
    assert whole.repetitive is not None
    # The errors of the start are none that the joined one sees.
    assert whole.repetitive.state | {"supervision": learning.state["supervision"]} == learning.state
    assert whole.observer.disturbance == pytest.approx(observer.disturbance, abs=1e-12)


def test_parts_of_a_simulation_are_parts_of_the_controller(
    stage: mh.Stage, reference: Array
) -> None:
    whole = stage.controller(DT, feedforward="preview", drift=0.5, period=PERIOD)
    run = mh.plant.simulate(whole, worn(stage), reference)
    observer, learning = stage.observer(DT, drift=0.5), stage.repetitive_control(PERIOD, DT)
    lone = stage.controller(DT, feedforward="preview")
    again = mh.plant.simulate(lone, worn(stage), reference, observer=observer, repetitive=learning)
    assert np.array_equal(run.drive, again.drive)
    assert whole.repetitive is not None
    assert learning.state == whole.repetitive.state
    assert lone.repetitive is None
    longer = np.tile(reference, 3)  # periods: a fast feedback leaves learning small steps
    run = mh.plant.simulate(stage.controller(DT, drift=0.5, period=PERIOD), worn(stage), longer)
    errors = np.std((run.position - longer).reshape(-1, PERIOD), axis=1)
    assert errors[-2] < 0.3 * errors[1], errors


def test_an_array_of_corrections_is_added_to_the_target(stage: mh.Stage, reference: Array) -> None:
    wave = reference[:PERIOD]
    learning = stage.iterative_learning(wave, DT)
    errors = []
    for _ in range(8):
        corrections = np.tile(learning.correction, 3)
        controller = stage.controller(DT, feedforward="preview")
        run = mh.plant.simulate(
            controller, worn(stage), reference[: 3 * PERIOD], correction=corrections
        )
        errors.append(float(np.std(run.position[-PERIOD:] - wave)))
        learning.update(wave - run.measured[-PERIOD:])
    assert errors[-1] < 0.2 * errors[0], errors
    none = mh.plant.simulate(
        stage.controller(DT), worn(stage), reference, correction=np.zeros(reference.size)
    )
    assert np.array_equal(
        none.drive, mh.plant.simulate(stage.controller(DT), worn(stage), reference).drive
    )
    with pytest.raises(ValueError, match=r"^correction: expected 2400 samples as in the ref"):
        mh.plant.simulate(stage.controller(DT), worn(stage), reference, correction=[0.0])


@pytest.mark.parametrize(
    "parts", [{"drift": 0.5}, {"period": PERIOD}, {"drift": 0.5, "period": 150}]
)
def test_states_and_pickles_go_on_bit_for_bit(
    stage: mh.Stage, reference: Array, parts: dict[str, float]
) -> None:
    controller = stage.controller(DT, feedforward="preview", **parts)  # type: ignore[arg-type]
    plant = worn(stage)
    for r in reference[:300]:
        plant.step(controller.step(r, plant.measured))
    text = json.dumps(controller.state)
    twins = [pickle.loads(pickle.dumps(controller)), copy.deepcopy(controller)]
    twins.append(stage.controller(DT, feedforward="preview", **parts))  # type: ignore[arg-type]
    twins[-1].state = json.loads(text)
    for k, r in enumerate(reference[300:600]):
        measured = math.nan if k % 50 == 7 else plant.measured
        planned = controller.plan(r, measured)
        assert controller.peek(r, measured) == planned
        assert controller.commit()
        assert all(twin.step(r, measured) == planned for twin in twins)
        plant.step(planned)
    assert all(twin.state == controller.state for twin in twins)
    with pytest.raises(ValueError, match=r"^state"):
        stage.controller(DT, feedforward="preview").state = controller.state


def test_the_observer_stands_in_for_missing_measurements(stage: mh.Stage) -> None:
    controller = stage.controller(DT, drift=0.5)
    plant = stage.plant(DT, seed=1)
    for k in range(600):
        measured = math.nan if 300 <= k < 308 else plant.measured
        plant.step(controller.step(1e-3 * k, measured))
        assert controller.missing_count == min(max(k - 299, 0), 8)
        assert controller.terms.reference == 1e-3 * k, "the loop goes on"
    assert controller.observer is not None
    assert controller.observer.rejected == 8
    assert plant.position == pytest.approx(0.6, abs=0.02)


def test_a_glitch_of_the_sensor_does_not_reach_the_drive(stage: mh.Stage) -> None:
    def drives(glitch: bool, gate: float | None) -> tuple[Array, int]:
        controller, plant = stage.controller(DT, max_measurement_step=gate), stage.plant(DT)
        found = np.empty(400)
        for k in range(400):
            measured = plant.measured + (0.5 if glitch and k == 300 else 0.0)
            found[k] = controller.step(1.0, measured)
            plant.step(found[k])
        return found, controller.implausible_count

    calm, none = drives(False, 0.1)
    gated, one = drives(True, 0.1)
    open_, unseen = drives(True, None)
    assert (none, one, unseen) == (0, 1, 0)
    assert abs(gated - calm).max() < 0.1 * abs(open_ - calm).max()
    with pytest.raises(ValueError, match="max_measurement_step: expected"):
        stage.controller(DT, max_measurement_step=-1.0)


def test_a_correction_that_is_none_holds_the_drive(stage: mh.Stage) -> None:
    controller = stage.controller(DT)
    for _ in range(100):
        drive = controller.step(1.0, 0.9)
    assert controller.step(1.0, 0.9, correction=math.nan) == drive
    assert controller.rejected_count == 1


def test_what_does_not_fit_is_named(stage: mh.Stage, reference: Array) -> None:
    inverse = stage.inverse(DT)
    options = {"kp": 1.0, "ki": 10.0, "dt": DT, "limits": (-500.0, 500.0)}
    for name, wrong in (("observer", 1), ("repetitive", "fast")):
        with pytest.raises(TypeError, match=rf"^{name}: expected a mh\.control\."):
            mh.control.HybridController(inverse, **options, **{name: wrong})  # type: ignore[arg-type]
    slow = stage.observer(2 * DT, drift=0.5)
    with pytest.raises(
        ValueError, match=r"^observer.dt: expected 0\.0001, the sampling interval of the controller"
    ):
        mh.control.HybridController(inverse, **options, observer=slow)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"^repetitive: expected a controller with a feed-forward"):
        stage.controller(DT, feedforward="given", period=PERIOD)
    whole = stage.controller(DT, drift=0.5)
    with pytest.raises(ValueError, match=r"^observer: expected None for a controller that has one"):
        mh.plant.simulate(whole, stage.plant(DT), reference, observer=stage.observer(DT, drift=1.0))
    with pytest.raises(ValueError, match=r"^controllers\[1\]: expected a controller without obs"):
        mh.control.MultiAxisController([stage.controller(DT), whole])
    with pytest.raises(ValueError, match=r"^drift: "):
        stage.controller(DT, drift=-1.0)
    with pytest.raises(ValueError, match=r"^period: "):
        stage.controller(DT, period=3)
    with pytest.raises(ValueError, match=r"^noise"):
        stage.replace(noise=None).controller(DT, drift=0.5)


def test_a_second_simulation_goes_on_where_the_period_begins(
    stage: mh.Stage, reference: Array
) -> None:
    controller = stage.controller(DT, feedforward="preview", period=PERIOD)
    plant = worn(stage)
    longer = np.tile(reference, 3)
    runs = [mh.plant.simulate(controller, plant, longer) for _ in range(2)]
    first, second = (np.std((run.position - longer).reshape(-1, PERIOD), axis=1) for run in runs)
    assert second[2] < 1.5 * first[-2] < 0.5 * first[1]
