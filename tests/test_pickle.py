"""Whatever runs or results has a repr, and goes on after pickle and deepcopy as before."""

from __future__ import annotations

import copy
import math
import pickle
from collections.abc import Callable
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from mpi_hyst import _core

DT = 1e-4
LIMITS = (-500.0, 500.0)
MODEL = mh.paper.table_1_recovered()
SPLIT = mh.ModifiedPrandtlIshlinskii.from_ratios(
    [4e-3, 3e-4], [0.0, 25.0], ra=0.95, rb=0.3, rc=0.35, weights_negative=[3e-3, 2e-4]
)
CONVENTIONAL = mh.PrandtlIshlinskii([1.0, 0.5], [0.0, 2.0], input_offset=0.5)
LAG, RESONANCE = mh.plant.FirstOrder(279.0), mh.plant.SecondOrder(2000.0, 0.03)
STAGE = mh.Stage(
    MODEL,
    limits=LIMITS,
    dead_time=1e-4,
    dynamics=[RESONANCE, LAG],
    creep=mh.plant.Creep([0.01], [0.5]),
    loop_shift=mh.plant.LoopShift(0.0, 500.0, (-0.2, 0.1), 0.2, 0.5),
    relaxing_plays=mh.plant.RelaxingPlays([0.0, 90.0], [0.05], [[1e-4, 2e-4]]),
    slow_gain=mh.plant.SlowGain(500.0, -0.02, 1.0, 2.0),
    temperature=mh.plant.TemperatureTerm(0.02, 60.0, 25.0),
    noise=0.016,
)
U = mh.signals.decaying_triangle(500.0, 1.0, cycles=6, rate=200)
Y = MODEL.forward().run(U) + np.random.default_rng(0).normal(0.0, 0.01, U.size)


def identified() -> mh.results.Identification:
    return mh.identify(U, Y, operators=4, ratios=(0.95, 0.3, 0.35), input_offset=0.0, dead_time=0.0)


def error_bounds() -> mh.results.ErrorBounds:
    stage = identified().stage
    return stage.precompensate([0.0, 0.1], DT, lead_in=0.1, return_error=True)[1]


def dynamics() -> mh.results.DynamicsIdentification:
    u = np.where(np.arange(300) < 10, 0.0, 400.0)
    y = mh.plant.SecondOrder(800.0, 0.05).response(MODEL.forward().run(u), DT)
    return mh.identify_dynamics(u, y, MODEL, dt=DT)


def controller(**options: Any) -> mh.control.HybridController:
    return mh.control.HybridController(
        MODEL.inverse(LIMITS), kp=5.0, ki=6e3, dt=DT, limits=LIMITS, **options
    )


def run() -> mh.plant.Run:
    return mh.plant.Run(
        [0.0, 2.0, 0.0], [0.0, 1.5, 0.25], [0.0, 1.75, 0.0], [9.0, 0.0, -9.0], period=2
    )


OSCILLATOR = mh.plant.HystereticOscillator(
    0.5, 5.0, 2.5e4, mh.Duhem.from_bouc_wen(2.5e4, 1e3, 0.8, -1.1)
)


def oscillator() -> mh.results.OscillatorIdentification:
    u = mh.signals.chirp(60.0, 5.0, 100.0, seconds=0.5, rate=1000)
    y = OSCILLATOR.response(u, dt=1e-3)
    return mh.identify_oscillator(u, y, dt=1e-3, hold="zero", knots=3)


def axes_stage() -> mh.MultiAxisStage:
    matrices: tuple[Any, ...] = ([[0.8]], [[0.2]], [[1.0]], [[0.0]])
    inside: dict[str, Any] = {"bw": [[0.1]], "cq": [[0.1]], "dq": [[1.0]]}
    return mh.MultiAxisStage(*matrices, **inside, operators=[([0.5], [1.0])], dt=DT)


def identified_axes() -> mh.results.AxesIdentification:
    u = np.random.default_rng(1).standard_normal((1200, 1))
    y = axes_stage().forward().run(u)
    return mh.identify_axes(u, y, dt=DT, order=1, hysteresis="none")


def real_time() -> mh.realtime.LoopReport:
    plant = mh.plant.Plant(STAGE, dt=1e-3)
    rest: dict[str, Any] = {"rest_drive": 0.0, "rest_rate": 1e4}
    return mh.realtime.run(STAGE, plant, [0.5], rate=1000, seconds=0.02, **rest)


LOOP: dict[str, Any] = {
    **{"kp": 0.0, "ki": 0.0, "slope": 1.0, "dynamics": LAG, "bandwidth": 100.0},
    **{"dt": 1e-3},
}


def experiment() -> list[mh.signals.ExperimentPart]:
    return mh.signals.experiment(-5.0, 5.0, slew=200.0, rate=1e3, cycles=2, rest=0.1)


def finite(x: float) -> float:
    return x if math.isfinite(x) else 0.0


VALUES: dict[str, Callable[[], Any]] = {
    "PrandtlIshlinskii": lambda: CONVENTIONAL,
    "ModifiedPrandtlIshlinskii": lambda: SPLIT,
    "ActuatorArray": lambda: mh.ActuatorArray([MODEL, MODEL, SPLIT]),
    "FirstOrder": lambda: LAG,
    "Udp": lambda: mh.realtime.Udp("127.0.0.1:47001", local="127.0.0.1:47002"),
    "SharedMemory": lambda: mh.realtime.SharedMemory("/dev/shm/stage"),
    "SecondOrder": lambda: RESONANCE,
    "Antiresonance": lambda: mh.plant.Antiresonance(RESONANCE, RESONANCE),
    "Modes": lambda: mh.plant.Modes([0.75, 0.25], [RESONANCE, mh.plant.SecondOrder(900.0, 0.02)]),
    "StateSpace": lambda: mh.plant.StateSpace([[-5.0, 1.0], [0.0, -2.0]], [0, 2], [1, 0], 0.5),
    "Creep": lambda: mh.plant.Creep([0.01, 0.02], [0.1, 1.0]),
    "Notch": lambda: mh.control.Notch(800.0, 0.02, 1.0),
    "LowPass": lambda: mh.control.LowPass(200.0, 0.7),
    "Lead": lambda: mh.control.Lead(100.0, 900.0),
    "Biquad": lambda: mh.control.Biquad([0.5, 0.5, 0.0], [-0.1, 0.0]),
    "HystereticOscillator": lambda: OSCILLATOR,
    "MultiAxisStage": axes_stage,
    "RelaxingPlays": lambda: mh.plant.RelaxingPlays([0.0, 9.0], [0.1], [[0.1, 0.2]], origin=3.0),
    "SlowGain": lambda: mh.plant.SlowGain(500.0, -0.02, 1.0, 2.0),
    "TemperatureTerm": lambda: mh.plant.TemperatureTerm(0.02, 60.0, 25.0),
    "LoopShift": lambda: mh.plant.LoopShift(0.0, 500.0, (-0.2, 0.1), 0.2, 0.5),
    "Stage": lambda: STAGE,
    "Sine": lambda: mh.trajectories.Sine(3.0, 1.0, offset=0.5),
    "RoundedTriangle": lambda: mh.trajectories.RoundedTriangle(3.0, 1.0, corner=0.1),
    "PointToPoint": lambda: mh.trajectories.PointToPoint(
        [0.0, 3.0], velocity=100.0, acceleration=1e4, jerk=1e6, dwell=0.5
    ),
    "Raster": lambda: mh.trajectories.Raster(9.0, 7.0, 3, line_rate=5.0, steps=True),
    "Spiral": lambda: mh.trajectories.Spiral(5.0, 0.5, speed=40.0, center=(1.0, -1.0)),
    "Lissajous": lambda: mh.trajectories.Lissajous((5.0, 4.0), (3.0, 4.0), seconds=1.0, phase=0.5),
    "ScanAxis": lambda: mh.trajectories.Spiral(5.0, 0.5, frequency=4.0).y,
}
"""Objects that compare equal to an equal one."""

RESULTS: dict[str, Callable[[], Any]] = {
    "Preview": lambda: mh.control.preview(RESONANCE, DT, ahead=4),
    "Quality": lambda: identified().fit,
    "ErrorBounds": error_bounds,
    "LeftOutLoop": lambda: identified().leave_one_loop_out(U, Y)[0],
    "Finding": lambda: mh.diagnose(U[:20], Y[:20], MODEL)[0],
    "Identification": identified,
    "DynamicsIdentification": dynamics,
    "PlacesIdentification": lambda: mh.identify_places(
        U, [], [(0, 0, k, Y[k] - Y[0]) for k in range(1, len(Y))], dt=DT, operators=4
    ),
    "Comparison": lambda: mh.compare(U, Y, operators=4),
    "ComparedModel": lambda: mh.compare(U, Y, operators=4).rows[1],
    "ManyIdentifications": lambda: mh.identify_many(U, np.column_stack([Y, Y]), operators=4),
    "Metrics": lambda: run().metrics,
    "Run": run,
    "Tuning": lambda: mh.control.tune(MODEL, dt=DT, dynamics=LAG),
    "Margins": lambda: mh.control.tune(MODEL, dt=DT, dynamics=LAG).at_min_slope,
    "Excitation": lambda: mh.signals.excitation(-5.0, 5.0, slew=20.0, rate=500.0),
    "ExperimentPart": lambda: experiment()[0],
    "ExperimentSegment": lambda: experiment()[1].segments[1],
    "ControllerTerms": lambda: controller().terms,
    "OscillatorIdentification": oscillator,
    "AxesIdentification": identified_axes,
    "LoopReport": lambda: real_time(),
    "LoopTimes": lambda: real_time().compute,
}
"""Objects that have attributes alone."""

RUNNING: dict[str, tuple[Callable[[], Any], Callable[[Any, float], Any]]] = {
    "Play": (lambda: mh.Play(0.5), lambda one, x: one.step(x)),
    "CoupledPlay": (lambda: mh.CoupledPlay(1.0, 0.8, 0.3, 0.4), lambda one, x: one.step(x)),
    "Duhem": (lambda: OSCILLATOR.hysteresis, lambda one, x: one.step(1e-3 * x)),
    "DuhemInverse": (lambda: OSCILLATOR.hysteresis.inverse(0.5), lambda one, x: one.step(x)),
    "MultiAxisForward": (
        lambda: axes_stage().forward(),
        lambda one, x: one.step([x])[0],
    ),
    "OscillatorForward": (lambda: OSCILLATOR.forward(DT), lambda one, x: one.step(x)),
    "Forward": (
        lambda: CONVENTIONAL.forward(initial=[0.25, 0.25]),
        lambda one, x: one.step(x),
    ),
    "Inverse": (lambda: MODEL.inverse(LIMITS), lambda one, x: one.step(x)),
    "ForwardArray": (
        lambda: mh.ActuatorArray([MODEL, SPLIT]).forward(),
        lambda one, x: one.step([x, -x]).tolist(),
    ),
    "InverseArray": (
        lambda: mh.ActuatorArray([MODEL, SPLIT]).inverse(limits=[(-9.0, 9.0), LIMITS]),
        lambda one, x: one.step([x, -x]).tolist(),
    ),
    "Filter": (
        lambda: mh.control.Filter(mh.control.Notch(800.0, 0.02, 1.0), DT),
        lambda one, x: one.step(x),
    ),
    "StageForward": (lambda: STAGE.forward(DT), lambda one, x: one.step(x)),
    "StageInverse": (lambda: STAGE.inverse(DT), lambda one, x: one.step(x)),
    "BracketArray": (
        lambda: mh.ActuatorArray([MODEL, SPLIT]).bracket(limits=[(-9.0, 9.0), LIMITS]),
        lambda one, x: [side.tolist() for side in one.step([x, -x])],
    ),
    "ArrayController": (
        lambda: mh.ActuatorArray([MODEL, SPLIT]).controller(
            DT, [(-9.0, 9.0), LIMITS], ki=5.0, leak=1.0, slew=1e6, reconstruction=[[1.0], [0.5]],
            neighbours=[(0, 1)], max_difference=0.5, start_drive=[1.0, 2.0],
        ),
        lambda one, x: one.step([0.1 * x, -x], [x]).tolist(),
    ),
    "Bracket": (lambda: MODEL.bracket(LIMITS), lambda one, x: one.step(x)),
    "HybridController": (
        lambda: controller(slew=1e6, preview=mh.control.Preview([0.5, 0.5], 1)),
        lambda one, x: one.step(x, 0.5 * x),
    ),
    "RecursiveIdentifier": (
        lambda: mh.RecursiveIdentifier(MODEL, forgetting=0.99),
        lambda one, x: one.update(x, 0.01 * x),
    ),
    "Plant": (
        lambda: mh.plant.Plant(
            MODEL, dynamics=RESONANCE, amplifier_bandwidth=279.0, dead_time=1.5e-4, noise=0.01,
            limits=LIMITS, dt=DT, seed=3, dac_bits=12, adc_bits=16, adc_range=(-4.0, 4.0),
        ),
        lambda one, x: one.step(100.0 * x),
    ),
    "MultiAxisPlant": (
        lambda: mh.plant.MultiAxisPlant(
            [mh.plant.Plant(MODEL, noise=0.01, limits=LIMITS, dt=DT, seed=k) for k in (1, 2)],
            [[1.0, 0.1], [0.0, 1.0]],
        ),
        lambda one, x: one.step([100.0 * x, 50.0]).tolist(),
    ),
    "MultiAxisController": (
        lambda: mh.control.MultiAxisController(
            [controller(slew=s, preview=mh.control.Preview([0.5, 0.5], 1)) for s in (1e6, None)],
            [[1.0, 0.1], [0.0, 1.0]],
        ),
        lambda one, x: one.step([x, 0.5], [0.5 * x, 0.2]).tolist(),
    ),
    "Observer": (
        lambda: mh.control.Observer(MODEL, dynamics=RESONANCE, noise=0.016, drift=0.5, dt=DT),
        lambda one, x: one.step(100.0 * x, x),
    ),
    "RepetitiveControl": (
        lambda: mh.control.RepetitiveControl(100, **LOOP),
        lambda one, x: one.step(x),
    ),
    "IterativeLearning": (
        lambda: mh.control.IterativeLearning(np.sin(np.arange(100) / 100 * 2 * np.pi), **LOOP),
        lambda one, x: (one.update(np.full(100, finite(x))), one.target.tolist()),
    ),
}  # fmt: skip
"""Objects that go on: how one is made, and a step of it."""

INPUTS = [0.5, 2.0, -1.5, 0.25, float("nan"), 1.0]

COPIES: dict[str, Callable[[Any], Any]] = {
    "pickle": lambda one: pickle.loads(pickle.dumps(one)),
    "oldest protocol": lambda one: pickle.loads(pickle.dumps(one, 2)),
    "deepcopy": copy.deepcopy,
}


def test_every_class_is_here() -> None:
    classes = {
        name
        for name in _core.__all__
        if isinstance(value := getattr(_core, name), type) and not issubclass(value, Exception)
    }
    assert classes == {*VALUES, *RESULTS, *RUNNING, "Functions", "Stop"}


def test_addresses_of_this_process_are_copied_but_not_pickled() -> None:
    functions = mh.realtime.Functions(4096, 8192)
    assert repr(functions) == "Functions(0x1000, 0x2000, context=0x0)"
    assert copy.deepcopy(functions) is functions
    with pytest.raises(TypeError, match="cannot pickle"):
        pickle.dumps(functions)


def test_a_stop_is_that_of_a_loop_of_this_process() -> None:
    stop = mh.realtime.Stop()
    assert repr(stop) == "<Stop: not requested>"
    assert copy.deepcopy(stop) is stop
    stop.request()
    assert repr(stop) == "<Stop: requested>"
    with pytest.raises(TypeError, match="cannot pickle"):
        pickle.dumps(stop)


@pytest.mark.parametrize("name", [*VALUES, *RESULTS, *RUNNING])
def test_it_names_a_module_from_which_it_can_be_imported(name: str) -> None:
    value = getattr(_core, name)
    module = value.__module__.removeprefix("mpi_hyst").lstrip(".")
    assert getattr(getattr(mh, module) if module else mh, name) is value


@pytest.mark.parametrize("again", COPIES.values(), ids=COPIES)
@pytest.mark.parametrize("make", VALUES.values(), ids=VALUES)
def test_a_value_is_equal_again(make: Callable[[], Any], again: Callable[[Any], Any]) -> None:
    one = make()
    other = again(one)
    assert other == one and repr(other) == repr(one) and hash(other) == hash(one)


def attributes(one: Any) -> dict[str, str]:
    """What an object shows; numbers by all their digits."""
    found = {}
    for name in dir(type(one)):
        if not name.startswith("_") and not callable(value := getattr(one, name)):
            found[name] = repr(value.tolist() if isinstance(value, np.ndarray) else value)
    return found


@pytest.mark.parametrize("again", COPIES.values(), ids=COPIES)
@pytest.mark.parametrize("make", RESULTS.values(), ids=RESULTS)
def test_a_result_says_the_same_again(make: Callable[[], Any], again: Callable[[Any], Any]) -> None:
    one = make()
    assert attributes(one) and attributes(again(one)) == attributes(one)


@pytest.mark.parametrize("again", COPIES.values(), ids=COPIES)
@pytest.mark.parametrize("name", RUNNING)
def test_what_runs_goes_on_as_if_nothing_had_been(name: str, again: Callable[[Any], Any]) -> None:
    make, step = RUNNING[name]
    one = make()
    for x in INPUTS:
        step(one, x)
    other = again(one)
    assert repr(other) == repr(one) and "object at" not in repr(one)
    assert [repr(step(other, x)) for x in INPUTS] == [repr(step(one, x)) for x in INPUTS]
    if hasattr(one, "reset"):
        one.reset()
        other.reset()
        assert [repr(step(other, x)) for x in INPUTS] == [repr(step(one, x)) for x in INPUTS]


def test_a_prediction_is_the_same_again() -> None:
    found = identified()
    again = pickle.loads(pickle.dumps(found))
    for one, other in zip(
        found.predict(U, return_std=True), again.predict(U, return_std=True), strict=True
    ):
        assert np.array_equal(one, other)
