"""What a stage refuses, announces or keeps within bounds."""

from __future__ import annotations

import copy
import linecache
import pickle
import warnings
from pathlib import Path
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from support import parameter_of

DT = 1e-4
MODEL = mh.paper.table_1_recovered()
LIMITS = (-500.0, 500.0)
MODE = mh.plant.SecondOrder(400.0, 0.95)
FALLING = ([-5.0, 5.0], [5.0, -5.0])
BACKWARDS = ([-900.0, 900.0], [900.0, -900.0])


def stage(**parts: Any) -> mh.Stage:
    return mh.Stage(MODEL, **{"limits": LIMITS, "dynamics": MODE, **parts})


def triangle() -> np.ndarray[Any, np.dtype[np.float64]]:
    return mh.signals.decaying_triangle(300.0, 4.0, cycles=4, rate=1000.0)


# ---- feedback needs a position that rises


@pytest.mark.parametrize("falls", [{"output_map": FALLING}, {"input_map": BACKWARDS}])
def test_a_stage_that_falls_is_refused_under_feedback(falls: Any) -> None:
    falling = stage(**falls)
    for use in (falling.tune, falling.controller):
        with pytest.raises(ValueError, match="output_map: expected a position") as raised:
            use(DT)
        assert parameter_of(raised.value) == "output_map"
    # open loop it is followed as any other
    reference = 1.0 - np.cos(0.01 * np.arange(2000))
    drive = falling.precompensate(reference, DT)
    assert abs(falling.forward(DT).run(drive) - reference).max() < 1e-3


def test_two_falling_maps_rise() -> None:
    assert stage(output_map=FALLING, input_map=BACKWARDS).tune(DT).kp > 0.0


# ---- one sampling interval


def test_what_was_made_for_another_dt_is_refused() -> None:
    one = stage()
    gains: dict[str, Any] = {"kp": 1.0, "ki": 1e3, "dt": DT, "limits": LIMITS}
    message = "expected one made for the sampling interval of 0.0001 s, got one for 0.001 s"
    with pytest.raises(ValueError, match=f"feedforward: {message}"):
        mh.control.HybridController(one.inverse(1e-3), **gains)
    with pytest.raises(ValueError, match=f"preview: {message}"):
        mh.control.HybridController(one.inverse(DT), preview=one.preview(1e-3), **gains)
    saved = pickle.loads(pickle.dumps(one.preview(1e-3)))
    with pytest.raises(ValueError, match=f"preview: {message}"):
        mh.control.HybridController(None, preview=saved, **gains)
    controller = mh.control.HybridController(one.inverse(DT), **gains)
    with pytest.raises(ValueError, match=f"feedforward: {message}"):
        controller.set_feedforward(one.inverse(1e-3))
    observer = stage(noise=0.01).observer(1e-3, drift=0.1)
    with pytest.raises(ValueError, match=f"observer: {message}"):
        mh.plant.simulate(controller, one.plant(DT), np.zeros(100), observer=observer)


# ---- limits


def test_limits_of_controller_and_plant_may_not_differ() -> None:
    controller = stage().controller(DT)
    with pytest.raises(ValueError, match="controller: expected limits within those of the plant"):
        mh.plant.simulate(controller, stage(limits=(-100.0, 100.0)).plant(DT), np.zeros(100))


def test_the_chain_begins_with_the_limits() -> None:
    stream = stage(limits=(-100.0, 100.0), dynamics=None).forward(DT)
    assert stream.step(300.0) == stage(dynamics=None).forward(DT).step(100.0)
    assert stream.clamped == 1 and stream.rejected == 0
    other = copy.deepcopy(stream)
    assert other.clamped == 1 and other.step(50.0) == stream.step(50.0)


def test_limits_beyond_what_was_identified_are_said() -> None:
    identified = mh.identify(triangle(), MODEL.forward().run(triangle()), dt=1e-3).stage
    with pytest.warns(UserWarning, match=r"limits: .* is beyond the identified drives"):
        identified.inverse(1e-3, limits=(-400.0, 400.0))


# ---- a drive from rest


def test_a_step_at_the_beginning_is_said() -> None:
    sine = mh.signals.sine(0.2, 100.0, seconds=0.1, rate=1 / DT)
    with pytest.warns(UserWarning, match="reference: begins in motion, so the drive begins with a"):
        stage().precompensate(sine, DT)
    drive = stage().precompensate(sine, DT, lead_in=0.05)
    assert abs(np.diff(drive, prepend=0.0)).max() < 10.0  # V
    error = stage().forward(DT).run(drive)[500:] - sine
    assert abs(error).max() < 1e-3  # um, from the first sample on


# ---- gains, previews


def test_gains_come_together_and_ahead_with_a_preview() -> None:
    cases: list[tuple[dict[str, Any], str]] = [({"kp": 100.0}, "ki"), ({"ki": 1e3}, "kp")]
    for gains, missing in cases:
        with pytest.raises(ValueError, match=f"{missing}: expected a number beside") as raised:
            stage().controller(DT, **gains)
        assert parameter_of(raised.value) == missing
    with pytest.raises(ValueError, match="ahead: expected None without feedforward"):
        stage().controller(DT, ahead=4)


def test_zeros_in_the_right_half_plane_get_a_longer_preview() -> None:
    # (1 - s/w0) in front of a mode: its inverse must act long before the reference moves.
    w0, w = 2 * np.pi * 200.0, 2 * np.pi * 300.0
    zero = mh.plant.StateSpace.from_transfer_function(
        [-1.0 / w0, 1.0], [1.0 / w**2, 2 * 0.3 / w, 1.0]
    )
    # Behind a mode of 400 Hz eight samples halve the drives that four make of a corner.
    assert stage().preview(DT).ahead == 8
    reference = mh.signals.sine(1.0, 10.0, seconds=0.5, rate=1 / DT)
    run = stage(dynamics=zero).simulate(reference, DT, period=1000)
    assert run.settled is not None and run.settled.max_position_error < 0.01


# ---- identified stages


def test_dynamics_are_not_counted_twice() -> None:
    y = stage(limits=None).forward(1e-3).run(triangle())
    without = mh.identify(triangle(), y, dt=1e-3, dead_time=1e-3).stage
    # Identified without dynamics, the dead time holds their lag, whatever it is that lags.
    doubled: list[tuple[str, dict[str, Any]]] = [
        ("dynamics", {"dynamics": MODE}),
        ("dynamics", {"dynamics": MODE, "dead_time": 1e-3}),
        ("amplifier_bandwidth", {"amplifier_bandwidth": 200.0}),
        ("dead_time", {"dead_time": 2e-3}),
    ]
    for name, changes in doubled:
        with pytest.raises(ValueError, match=f"{name}: expected .* the lag that was") as raised:
            without.replace(**changes)
        assert parameter_of(raised.value) == name
    split = without.replace(dynamics=MODE, dead_time=1e-3 - 2 * 0.95 / (2 * np.pi * 400.0))
    # What was found of the dead time alone is no longer known.
    assert without.identified is not None and split.identified is not None
    assert len(without.identified["covariance"]) > 0 and split.identified["covariance"] == []
    assert split.drive_range == without.drive_range


def test_an_identified_stage_is_equal_to_its_copies(tmp_path: Path) -> None:
    # White noise tells nothing of creep: its standard deviation is no number.
    y = stage(limits=None).forward(1e-3).run(triangle())
    found = mh.identify(triangle(), y, dt=1e-3, dynamics=2, creep="auto").stage
    found.save(tmp_path / "stage.json")
    assert found == found.replace() == mh.load(tmp_path / "stage.json")
    assert found == copy.deepcopy(found) == pickle.loads(pickle.dumps(found))
    assert found.identified is not None
    for warning in found.identified["warnings"]:
        assert isinstance(warning["value"], float) and isinstance(warning["limit"], float)


def test_a_hysteresis_takes_what_was_identified_with_it() -> None:
    found = mh.identify(triangle(), MODEL.forward().run(triangle()), dt=1e-3).stage
    assert found.replace(slew=1e5).identified == found.identified
    assert found.replace(hysteresis=MODEL).identified is None


def test_a_state_of_another_sampling_interval_is_refused() -> None:
    for part in ({}, {"creep": mh.plant.Creep.logarithmic(0.012, 0.01, 100.0, 4)}):
        one, other = (stage(**part).inverse(dt) for dt in (DT, 1e-3))
        with pytest.raises(ValueError, match=r"state\.dt: expected 0\.001, got 0\.0001") as raised:
            other.state = one.state
        assert parameter_of(raised.value) == "state"


def test_a_copied_preview_knows_its_error() -> None:
    made = stage(dead_time=2.5 * DT, amplifier_bandwidth=2e3).preview(DT)
    for copied in (copy.deepcopy(made), pickle.loads(pickle.dumps(made))):
        assert copied.error(100.0) == pytest.approx(made.error(100.0), rel=1e-6)
        np.testing.assert_array_equal(copied.coefficients, made.coefficients)


def test_a_map_that_is_none_is_named() -> None:
    for name in ("input_map", "output_map"):
        maps: dict[str, Any] = {name: ([0.0, 1.0, 2.0], [0.0, 1.0, 0.5])}
        with pytest.raises(ValueError, match=rf"{name}: y\[2\]: expected") as raised:
            stage(**maps)
        assert parameter_of(raised.value) == name


def test_a_dead_time_without_dt_is_left_out_and_said() -> None:
    y = np.concatenate([np.zeros(3), MODEL.forward().run(triangle())])[: triangle().size]
    without = mh.identify(triangle(), y)
    unused = r"dead_time: (2\.99\d|3\.000) samples are not part of the stage"
    with pytest.warns(UserWarning, match=unused):
        left = without.stage
    assert left.dead_time == 0.0 and left.identified is not None
    assert left.identified["warnings"][-1]["code"] == "dead_time_left_out"


def test_a_warning_shows_the_line_that_calls() -> None:
    y = np.concatenate([np.zeros(3), MODEL.forward().run(triangle())])[: triangle().size]
    found = mh.identify(triangle(), y)
    sine = mh.signals.sine(0.2, 100.0, seconds=0.1, rate=1 / DT)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        _ = found.stage
        found.predict(2.0 * triangle())
        stage().precompensate(sine, DT)
    assert {one.filename for one in caught} == {__file__}
    shown = [linecache.getline(__file__, one.lineno).strip() for one in caught]
    assert shown == [
        "_ = found.stage",
        "found.predict(2.0 * triangle())",
        "stage().precompensate(sine, DT)",
    ]


# ---- memory


@pytest.mark.parametrize(
    "maps",
    [
        {"input_map": ([-500.0, 0.0, 500.0], [-100.0, 0.0, 500.0])},
        {"output_map": ([-5.0, 0.0, 5.0], [-10.0, 0.0, 10.0])},
        {"output_map": FALLING, "input_map": ([-500.0, 0.0, 500.0], [400.0, 0.0, -500.0])},
    ],
)
def test_a_bracket_holds_the_position_behind_maps(maps: Any) -> None:
    mapped = stage(dynamics=None, **maps)
    random = np.random.default_rng(2)
    for _ in range(50):
        truth, bracket = mapped.forward(DT), mapped.bracket()
        truth.run(random.uniform(*LIMITS, 5))
        for drive in random.uniform(*LIMITS, 5):
            position, (low, high) = truth.step(drive), bracket.step(drive)
            assert low - 1e-12 <= position <= high + 1e-12
            assert bracket.width == high - low
    twin = pickle.loads(pickle.dumps(bracket))
    assert twin.step(30.0) == bracket.step(30.0)


def test_everything_that_runs_is_primed_with_what_was_driven() -> None:
    drives = np.array([100.0, -200.0, 50.0])
    makers: list[Any] = [
        lambda: mh.Play(10.0),
        lambda: mh.CoupledPlay(10.0, 8.0, 3.0, 4.0),
        lambda: MODEL.forward(),
        lambda: stage().forward(DT),
        lambda: stage().plant(DT),
    ]
    for make in makers:
        primed, stepped = make(), make()
        primed.follow(drives)
        for drive in drives:
            getattr(stepped, "advance", stepped.step)(drive)
        assert primed.state == stepped.state
        with pytest.raises(ValueError, match=r"\[1\]: expected a finite number"):
            primed.follow([0.0, np.nan, 1.0])
        assert primed.state == stepped.state


def test_arrays_and_identifiers_are_primed_too() -> None:
    drives = np.array([100.0, -200.0, 50.0])
    array, rows = mh.ActuatorArray([MODEL, MODEL]), np.column_stack([drives, -drives])
    primed, stepped = array.forward(), array.forward()
    primed.follow(rows)
    stepped.run(rows)
    assert primed.state == stepped.state
    inverse, single = array.inverse(LIMITS), MODEL.inverse(LIMITS)
    inverse.follow(rows)
    single.follow(-drives)
    assert inverse.state[1] == single.state
    with pytest.raises(ValueError, match=r"actuator 1: drives\[0\]: expected"):
        inverse.follow([[0.0, 501.0]])
    learner, other = mh.RecursiveIdentifier(MODEL), mh.RecursiveIdentifier(MODEL)
    learner.follow(drives)
    assert (learner.model.weights == MODEL.weights).all()
    for drive in drives:
        other.update(drive, np.nan)
    assert learner.state["outputs"] == other.state["outputs"]
