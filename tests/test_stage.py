"""The stage as one object: what it promises, on stages that are simulated apart from it."""

import copy
import pickle
from pathlib import Path
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
import reference
from reference.stages import ReferenceStage
from support import Array, parameter_of

DT = 1e-4


def hysteresis() -> mh.ModifiedPrandtlIshlinskii:
    """About 15 % of hysteresis over 0 to 150 V and 100 um."""
    r = 7.5 * np.arange(20)
    w = np.where(np.arange(20) == 0, 0.53, 0.02 * 0.9 ** np.arange(20))
    return mh.ModifiedPrandtlIshlinskii.from_ratios(w, r, ra=0.95, rb=0.3, rc=0.35)


def reference_model(model: mh.ModifiedPrandtlIshlinskii) -> reference.ModifiedPrandtlIshlinskii:
    """The same model as a plain loop."""
    return reference.ModifiedPrandtlIshlinskii(model.weights, model.r, model.ra, model.rb, model.rc)


def lightly_damped(**changes: object) -> mh.Stage:
    """0 to 150 V, 100 um, 800 Hz, 0.02, creep of 1.2 % per decade, one sample of dead time."""
    parts: dict[str, object] = {
        "limits": (-10.0, 150.0),
        "dynamics": mh.plant.SecondOrder(800.0, 0.02),
        "creep": mh.plant.Creep.logarithmic(0.012, 0.01, 100.0, 8),
        "dead_time": DT,
    }
    return mh.Stage(hysteresis(), **{**parts, **changes})  # type: ignore[arg-type]


def raster(seconds: float, stroke: float = 70.0, frequency: float = 10.0) -> Array:
    t = DT * np.arange(round(seconds / DT))
    triangle: Array = stroke * 2.0 * np.abs((t * frequency + 0.5) % 1.0 - 0.5)
    return triangle


def test_open_loop_raster_of_a_lightly_damped_creeping_stage() -> None:
    # 0.02 % of the stroke of 100 um. The reference stage is written in numpy from its equations.
    reference = raster(1.0)
    drive = lightly_damped().precompensate(reference, DT)
    assert drive.shape == reference.shape
    creep = mh.plant.Creep.logarithmic(0.012, 0.01, 100.0, 8)
    terms = zip(creep.amplitudes, creep.time_constants, strict=True)
    truth = ReferenceStage(reference_model(hysteresis()), 800.0, 0.02, creep=terms, delay=1, dt=DT)
    error = np.array(truth.run(drive.tolist())) - reference
    assert np.sqrt(np.mean(error**2)) < 2e-4 * 100.0


def test_identified_stage_leads_a_sine_within_15_nm() -> None:
    # Plant A1 of the paper: 400 Hz, 0.95, 16 nm of noise. No number is given by hand.
    plant = mh.paper.plant("A1", seed=5)
    u = mh.signals.decaying_triangle(500.0, 1.0, cycles=12, rate=1.0 / DT)
    found = mh.identify(u, plant.run(u)[0], dt=DT, dynamics=2)
    target = mh.signals.sine(3.0, 20.0, seconds=0.2, rate=1.0 / DT)
    plant.reset()
    with pytest.warns(UserWarning, match="begins in motion"):
        drive = found.stage.precompensate(target, DT)
    position = plant.run(drive)[1]
    # After the first period: a sine begins with a velocity, which a stage at rest does not have.
    assert np.max(np.abs(position - target)[500:]) < 0.015
    plant.reset()
    position = plant.run(found.stage.precompensate(target, DT, lead_in=0.02))[1][200:]
    assert np.max(np.abs(position - target)) < 0.009


@pytest.mark.parametrize("skip", [0, 600])
def test_a_history_is_taken_over(skip: int) -> None:
    # Fitted from rest or behind a full stroke: the actuator is then used after a full stroke.
    parts: dict[str, Any] = {"dynamics": None, "creep": None, "dead_time": 0.0}
    bench = lightly_damped(**parts).plant(DT)
    record = mh.signals.excitation(0.0, 150.0, slew=5000.0, rate=1.0 / DT)
    assert record.initialization_samples == 600
    found = mh.identify(record.drive, bench.run(record.drive)[0], dt=DT, skip=skip)
    stroke = np.concatenate([np.linspace(0.0, 150.0, 600), np.linspace(150.0, 0.0, 600)])
    target = 20.0 + 10.0 * np.sin(0.005 * np.arange(3000))
    errors = []
    for history in ((), (0.0, 150.0, 0.0)):
        bench.reset()
        bench.run(stroke)
        drive = found.stage.precompensate(target, DT, history=history, lead_in=0.05)
        errors.append(np.abs(bench.run(drive)[1][500:] - target).max())
    assert errors[1] < 0.05  # um
    # Behind the stroke the loops alone were seen: a model of them may begin as if after a stroke.
    assert skip == 600 or errors[0] > 0.5
    with pytest.raises(ValueError, match=r"history\[1\]: expected a number from") as raised:
        found.stage.precompensate(target, DT, history=[0.0, 151.0])
    assert parameter_of(raised.value) == "history"


def test_one_dead_time_for_record_plant_controller_and_precompensate() -> None:
    dead_time = 3 * DT
    stage = lightly_damped(
        dynamics=mh.plant.SecondOrder(400.0, 0.95), creep=None, dead_time=dead_time
    )
    u = 75.0 + mh.signals.decaying_triangle(70.0, 5.0, cycles=10, rate=1.0 / DT)
    u = np.concatenate([np.linspace(0.0, 75.0, 500), u])
    rows = stage.forward(DT).run(u)
    # A plant: its rows, and its readings one row later.
    measured, position = stage.plant(DT).run(u)
    np.testing.assert_allclose(position, rows, atol=1e-9)
    np.testing.assert_allclose(measured, rows, atol=1e-9)
    plant = stage.plant(DT)
    readings = [plant.step(drive) for drive in u]
    np.testing.assert_allclose(readings[:-1], rows[1:], atol=1e-9)
    # Identification of the record finds it.
    found = mh.identify(u, rows, dt=DT, dynamics=2)
    lag = dead_time + 2 * 0.95 / (2 * np.pi * 400.0)
    mode = found.stage.dynamics
    assert isinstance(mode, mh.plant.SecondOrder)
    assert found.stage.dead_time + 2 * mode.damping / (2 * np.pi * mode.frequency) == pytest.approx(
        lag, abs=0.1 * DT
    )
    # The drive for a reference aims ahead by it.
    reference = 30.0 - 30.0 * np.cos(2 * np.pi * 10.0 * DT * np.arange(4000))
    np.testing.assert_allclose(
        stage.forward(DT).run(stage.precompensate(reference, DT)), reference, atol=0.02
    )
    # A controller with preview leaves no lag of it either, with no feedback to help.
    controller = stage.controller(DT, feedforward="preview", kp=0.0, ki=0.0)
    assert controller.preview is not None
    plant, ahead = stage.plant(DT), controller.preview.ahead
    early = np.concatenate([reference[ahead:], np.full(ahead, reference[-1])])
    for k, r in enumerate(early):
        assert abs(plant.position - reference[k]) < 0.1 or k < 200
        plant.step(controller.step(r, plant.measured))


def test_a_stage_file_reads_back_bit_for_bit(tmp_path: Path) -> None:
    stage = lightly_damped(noise=0.02, output_map=([0.0, 50.0, 100.0], [0.0, 51.0, 100.0]))
    stage.save(tmp_path / "stage.json")
    assert mh.load(tmp_path / "stage.json") == stage
    assert pickle.loads(pickle.dumps(stage)) == stage == copy.deepcopy(stage)


def test_a_reference_that_begins_elsewhere_needs_a_lead_in() -> None:
    stage, reference = lightly_damped(), 10.0 + raster(0.2)
    with pytest.raises(
        ValueError, match=r"reference\[0\]: expected the position .* `lead_in`"
    ) as raised:
        stage.precompensate(reference, DT)
    assert parameter_of(raised.value) == "reference"
    drive = stage.precompensate(reference, DT, lead_in=0.05)
    assert drive.size == reference.size + 500
    # Smooth from rest into the motion of the raster, so that there is nothing to catch up with.
    assert abs(np.diff(drive[:500], prepend=0.0)).max() < 0.4
    position = stage.forward(DT).run(drive)[500:]
    assert abs(position - reference)[:400].max() < 0.02  # um, of 100


def test_limits_of_the_stage_bind_everything() -> None:
    stage = lightly_damped()
    for make in (stage.inverse, stage.controller):
        with pytest.raises(
            ValueError, match=r"limits\[1\]: expected a number from -10.0 to 150.0, got 151.0"
        ):
            make(DT, limits=(0.0, 151.0))


def test_only_who_goes_beyond_the_records_is_warned_and_no_copy() -> None:
    drive = mh.signals.decaying_triangle(60.0, 1.0, cycles=6, rate=200)
    fit = {"operators": 6, "weights": "quadratic", "input_offset": 0.0, "dead_time": 0.0}
    found = mh.identify(drive, hysteresis().forward().run(drive), dt=0.005, **fit)  # type: ignore[arg-type]
    stage, wide = found.stage, (-90.0, 90.0)
    makers = (stage.inverse, lambda _, limits: stage.bracket(limits=limits), stage.controller)
    for make in makers:
        with pytest.warns(
            UserWarning, match="limits: .* is beyond the identified drives"
        ) as caught:
            one = make(0.005, limits=wide)
            copies = copy.deepcopy(one), pickle.loads(pickle.dumps(one))
        assert len(caught) == 1
        assert {repr(other) for other in copies} == {repr(one)}


def test_dt_is_required() -> None:
    for make in (
        lightly_damped().forward,
        lightly_damped().inverse,
        lightly_damped().plant,
        lightly_damped().controller,
    ):
        with pytest.raises(TypeError, match="dt"):
            make()  # type: ignore[call-arg]


def test_streams_copy_pickle_and_restore() -> None:
    stage = lightly_damped()
    for stream in (stage.forward(DT), stage.inverse(DT)):
        stream.run(raster(0.05))
        twins = [copy.deepcopy(stream), pickle.loads(pickle.dumps(stream))]
        expected = stream.run(raster(0.05))
        for twin in twins:
            np.testing.assert_array_equal(twin.run(raster(0.05)), expected)
    other = lightly_damped(dead_time=0.0, creep=None)
    with pytest.raises(ValueError, match=r"state.model: expected the fingerprint"):
        other.inverse(DT).state = stage.inverse(DT).state


def test_behind_an_amplifier_the_lagged_targets_are_reached() -> None:
    stage = lightly_damped(amplifier_bandwidth=250.0)
    left = float(np.exp(-2.0 * np.pi * 250.0 * DT))
    inverse = stage.inverse(DT, amplifier=True)
    plain = stage.replace(amplifier_bandwidth=None, dynamics=None, dead_time=0.0).forward(DT)
    voltage = lagged = 0.0
    for target in raster(0.2):
        voltage = left * voltage + (1.0 - left) * inverse.step(target)
        lagged = left * lagged + (1.0 - left) * target
        assert abs(plain.step(voltage) - lagged) < 1e-10
    for again in (copy.copy(inverse), pickle.loads(pickle.dumps(inverse))):
        assert again.state == inverse.state and again.step(20.0) == copy.copy(inverse).step(20.0)
    without = stage.inverse(DT)
    with pytest.raises(ValueError, match=r"^state"):
        without.state = inverse.state


def test_a_preview_leads_through_the_amplifier_last() -> None:
    stage = lightly_damped(amplifier_bandwidth=250.0, noise=0.0)
    controller = stage.controller(DT, feedforward="preview")
    again = pickle.loads(pickle.dumps(controller))
    wanted = np.concatenate([np.zeros(200), raster(0.3)])
    runs = [mh.plant.simulate(one, stage.plant(DT), wanted) for one in (controller, again)]
    np.testing.assert_array_equal(runs[0].drive, runs[1].drive)
    missed = runs[0].position - wanted
    # With the amplifier inverted first it was seventeen times as much.
    assert np.std(missed[1000:]) < 1e-4 * 70.0


def test_follow_takes_over_the_history() -> None:
    stage = lightly_damped(dynamics=None, dead_time=0.0)
    forward, inverse = stage.forward(DT), stage.inverse(DT)
    before = raster(0.3)
    forward.follow(before)
    inverse.follow(before)
    target = forward.position + raster(0.1, stroke=20.0)
    np.testing.assert_allclose(forward.run(inverse.run(target)), target, atol=1e-9)


@pytest.mark.parametrize(
    "parts",
    [{"dead_time": 0.0}, {"dynamics": mh.plant.FirstOrder(50.0)}, {"amplifier_bandwidth": 50.0}],
)
def test_a_stage_has_its_own_parts(parts: dict[str, Any]) -> None:
    stage = mh.Stage(mh.PrandtlIshlinskii([1.0], [0.0]), dead_time=1e-3)
    expected = "stage: expected a model beside the parts of a stage, got a Stage, which has its own"
    with pytest.raises(TypeError, match=expected):
        mh.plant.Plant(stage, dt=1e-3, **parts)
    with pytest.raises(TypeError, match=expected):
        mh.control.tune(stage, dt=1e-3, **parts)
    none_given: dict[str, Any] = dict.fromkeys(parts)
    assert mh.plant.Plant(stage, dt=1e-3, **none_given).run([1.0, 1.0])[0].shape == (2,)
    with pytest.raises(ValueError, match="amplifier_bandwidth: expected"):
        mh.plant.Plant(stage, dt=1e-3, amplifier_bandwidth=-1.0)
