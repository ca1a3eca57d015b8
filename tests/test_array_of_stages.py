"""Arrays of stages: what each stage gives alone, time that goes on, controllers, files."""

from __future__ import annotations

import copy
import json
import math
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support import Array, bits, parameter_of

DT = 1e-3
LIMITS = (-300.0, 400.0)
MODEL = mh.paper.table_1_recovered()
DUHEM = mh.Duhem.from_bouc_wen(2e-3, 0.01, 0.9, 0.4)
CREEP = mh.plant.Creep([0.02, 0.01], [0.005, 0.1])
SHIFT = mh.plant.LoopShift(0.0, 500.0, (-0.05, 0.02), 0.05, 0.5)
MAP = ([-1.0, 0.0, 2.0], [1.0, 0.0, -1.8])

STAGES = [
    mh.Stage(MODEL, limits=LIMITS, duhem=DUHEM, creep=CREEP, slew=2e5),
    mh.Stage(MODEL, limits=(-500.0, 500.0), output_map=MAP, creep=CREEP),
    mh.Stage(MODEL, limits=LIMITS, loop_shift=SHIFT, duhem=DUHEM),
    mh.Stage(MODEL, limits=LIMITS, dynamics=mh.plant.SecondOrder(200.0, 0.5), dead_time=1e-3),
]
M = len(STAGES)
MIRROR = mh.ActuatorArray(STAGES)
MAKERS: dict[str, Callable[[], mh.ForwardArray | mh.InverseArray]] = {
    "forward": lambda: MIRROR.forward(dt=DT),
    "inverse": lambda: MIRROR.inverse(dt=DT),
}
CHAIN: dict[str, Any] = {"neighbours": [(0, 1), (1, 2), (2, 3)], "max_difference": 0.25}


@pytest.fixture(params=MAKERS)
def make(request: pytest.FixtureRequest) -> Callable[[], mh.ForwardArray | mh.InverseArray]:
    return MAKERS[request.param]


def references(rows: int = 150, seed: int = 2) -> Array:
    """Return positions within reach."""
    walk = np.cumsum(np.random.default_rng(seed).normal(scale=0.3, size=(rows, M)), axis=0)
    return 0.8 * np.sin(walk)


def driven(drives: Array) -> Array:
    """Return where stages without their dynamics come to, from rest."""
    still = mh.ActuatorArray([stage.replace(dynamics=None, dead_time=0.0) for stage in STAGES])
    return still.forward(dt=DT).run(drives)


# ---- bit for bit


@given(st.lists(st.integers(0, M - 1), min_size=1, max_size=6), st.integers(0, 99), st.booleans())
def test_array_equals_independent_streams(order: list[int], seed: int, inverse: bool) -> None:
    stages = [STAGES[i] for i in order]
    x = np.random.default_rng(seed).normal(scale=2.0 if inverse else 150.0, size=(30, len(order)))
    x[7, 0], x[9, -1] = math.nan, -1e300
    mirror = mh.ActuatorArray(stages)

    def new() -> mh.ForwardArray | mh.InverseArray:
        return mirror.inverse(dt=DT) if inverse else mirror.forward(dt=DT)

    singles = [stage.inverse(DT) if inverse else stage.forward(DT) for stage in stages]
    expected = np.array([one.run(column) for one, column in zip(singles, x.T.copy(), strict=True)])
    ran, shared, stepped = new(), new(), new()
    assert bits(ran.run(x)) == bits(np.ascontiguousarray(expected.T))
    assert bits(shared.run(x, threads=2)) == bits(np.ascontiguousarray(expected.T))
    for row, outputs in zip(x, expected.T, strict=True):
        ahead = stepped.peek(row)
        assert bits(stepped.step(row)) == bits(ahead) == bits(np.ascontiguousarray(outputs))
    for stream in (ran, shared, stepped):
        assert stream.state == [one.state for one in singles]
        assert stream.rejected.tolist() == [one.rejected for one in singles]
        if isinstance(stream, mh.InverseArray):
            saturated = [one.saturated for one in singles if isinstance(one, mh.StageInverse)]
            assert stream.saturated.tolist() == saturated


def test_forward_of_inverse_is_the_target() -> None:
    targets = references()
    inverse = MIRROR.inverse(dt=DT)
    assert abs(driven(inverse.run(targets)) - targets).max() < 1e-12
    assert not inverse.saturated.any()


def test_a_state_survives_pickle_and_json_bit_for_bit(
    make: Callable[[], mh.ForwardArray | mh.InverseArray],
) -> None:
    stream, x = make(), references()
    stream.run(x[:70])
    state, twins = stream.state, [pickle.loads(pickle.dumps(stream)), copy.deepcopy(stream)]
    expected = stream.run(x[70:])
    twins.append(make())
    twins[-1].state = json.loads(json.dumps(state))
    for other in twins:
        assert bits(other.run(x[70:])) == bits(expected)


def test_a_wrong_state_is_named_and_nothing_happens(
    make: Callable[[], mh.ForwardArray | mh.InverseArray],
) -> None:
    stream = make()
    stream.run(references(20))
    good = stream.state
    later = copy.deepcopy(good)
    later[2]["dt"] = 2 * DT
    for state, message in [
        (later, "actuator 2: state.dt: expected 0.001, got 0.002"),
        (good[1:] + good[:1], "actuator 0: state.model: expected the fingerprint"),
        ([*good[:3], {}], "actuator 3: state: expected what .state returned"),
    ]:
        with pytest.raises(ValueError) as caught:
            stream.state = state
        assert str(caught.value).startswith(message), str(caught.value)
        assert stream.state == good


def test_what_was_driven_is_followed(
    make: Callable[[], mh.ForwardArray | mh.InverseArray],
) -> None:
    stream, drives = make(), np.array([[100.0] * M, [100.0] * M, [-50.0] * M])
    stream.follow(drives)
    for m, stage in enumerate(STAGES):
        single = (stage.forward if isinstance(stream, mh.ForwardArray) else stage.inverse)(DT)
        single.follow(drives[:, m].tolist())
        assert stream.state[m] == single.state


# ---- what it is made of


def test_stages_are_kept_once_and_in_order(tmp_path: Path) -> None:
    mirror = mh.ActuatorArray([*STAGES, copy.deepcopy(STAGES[0])])
    assert mirror.models == (*STAGES, STAGES[0]) and mirror.models[0] is mirror.models[M]
    assert repr(mirror) == "<ActuatorArray of 5 actuators, 4 stages>"
    assert mirror[1] == STAGES[1] and mirror[:M] == MIRROR and hash(mirror[:M]) == hash(MIRROR)
    assert mirror.set_model(-1, STAGES[2]).models == (*STAGES, STAGES[2])
    assert pickle.loads(pickle.dumps(mirror)) == mirror
    mirror.save(tmp_path / "mirror.json")
    assert mh.ActuatorArray.load(tmp_path / "mirror.json") == mirror
    saved = json.loads((tmp_path / "mirror.json").read_text())
    assert saved["actuators"] == [0, 1, 2, 3, 0] and len(saved["models"]) == 4
    assert {model["schema"] for model in saved["models"]} == {"mpi_hyst/stage/1"}
    assert repr(MIRROR.inverse(dt=DT)) == "<InverseArray of 4 actuators by turning_points>"
    assert MIRROR.forward(dt=DT).method == ["turning_points"] * M


def test_a_file_of_both_kinds_is_refused(tmp_path: Path) -> None:
    mh.ActuatorArray(STAGES[:1]).save(tmp_path / "stages.json")
    mh.ActuatorArray([MODEL]).save(tmp_path / "models.json")
    files = [json.loads((tmp_path / f"{kind}.json").read_text()) for kind in ("stages", "models")]
    files[0]["models"] += files[1]["models"]
    files[0]["actuators"] = [0, 1]
    (tmp_path / "both.json").write_text(json.dumps(files[0]))
    with pytest.raises(ValueError, match=r"both.json: models\[1\]: expected a Stage, as models"):
        mh.ActuatorArray.load(tmp_path / "both.json")
    files[0]["models"][0]["limits"] = [1.0, 0.0]
    (tmp_path / "both.json").write_text(json.dumps(files[0]))
    with pytest.raises(ValueError, match=r"both.json: models\[0\]: limits"):
        mh.ActuatorArray.load(tmp_path / "both.json")


OF_MODELS = mh.ActuatorArray([MODEL])
NEGATIVE = mh.PrandtlIshlinskii([1.0, -2.0], [0.0, 1.0])
WRONG: list[tuple[Callable[[], object], type[Exception], str]] = [
    (
        lambda: mh.ActuatorArray([STAGES[0], STAGES[1], MODEL]),  # type: ignore[arg-type]
        TypeError,
        "models[2]: expected a Stage, as models[0] is one, got ModifiedPrandtlIshlinskii",
    ),
    (
        lambda: mh.ActuatorArray([MODEL, STAGES[1]]),  # type: ignore[arg-type]
        TypeError,
        "models[1]: expected a PrandtlIshlinskii or ModifiedPrandtlIshlinskii, as models[0] is",
    ),
    (
        MIRROR.forward,
        TypeError,
        "dt: expected the sampling interval in seconds for an array of stages, got None",
    ),
    (lambda: MIRROR.inverse(LIMITS), TypeError, "dt: expected the sampling interval in seconds"),
    (lambda: MIRROR.inverse(dt=-1.0), ValueError, "dt: expected a finite number above 0"),
    (
        lambda: OF_MODELS.forward(dt=DT),
        ValueError,
        "dt: expected none for an array of models, got 0.001",
    ),
    (lambda: OF_MODELS.inverse(LIMITS, dt=DT), ValueError, "dt: expected none for an array of"),
    (
        lambda: MIRROR.forward(dt=DT, method="bank"),
        ValueError,
        'method: expected None for stages, got "bank"',
    ),
    (
        lambda: MIRROR.inverse((-400.0, 10.0), dt=DT),
        ValueError,
        "actuator 0: limits[0]: expected a number from -300.0 to 400.0, got -400.0",
    ),
    (lambda: MIRROR.set_model(0, MODEL), TypeError, "model: expected a Stage, as the others are"),
    (
        lambda: OF_MODELS.set_model(0, STAGES[0]),
        TypeError,
        "model: expected a PrandtlIshlinskii or a ModifiedPrandtlIshlinskii, got <Stage",
    ),
    (
        lambda: mh.ActuatorArray([STAGES[0], mh.Stage(NEGATIVE)]).inverse(dt=DT),
        mh.NotInvertibleError,
        "actuator 1: the model is not invertible",
    ),
    (
        lambda: mh.ActuatorArray([mh.Stage(MODEL)]).controller(DT),
        ValueError,
        "limits[0]: expected finite limits of every drive",
    ),
    (lambda: OF_MODELS.controller(DT), ValueError, "limits[0]: expected finite limits of every"),
    (OF_MODELS.bracket, TypeError, "limits: expected two numbers (low, high) or an array of"),
    (MIRROR.bracket, ValueError, "actuator 0: duhem: expected no knots"),
    (
        lambda: mh.ActuatorArray([mh.Stage(MODEL)]).bracket(),
        ValueError,
        "actuator 0: limits: expected (low, high), got None, and the stage has none",
    ),
]


@pytest.mark.parametrize(("call", "kind", "message"), WRONG)
def test_what_is_wrong_is_named(
    call: Callable[[], object], kind: type[Exception], message: str
) -> None:
    with pytest.raises(kind) as caught:
        call()
    assert str(caught.value).startswith(message), str(caught.value)
    name = message.split("actuator 1: ")[0].split("actuator 0: ")[-1].split(":")[0].split("[")[0]
    assert parameter_of(caught.value) == (name or None)


def test_limits_are_those_of_the_stages_unless_they_are_given() -> None:
    limits = MIRROR.inverse(dt=DT).limits
    assert limits is not None and limits.tolist() == [list(one.limits or ()) for one in STAGES]
    narrow = MIRROR.inverse((-10.0, 20.0), dt=DT)
    assert narrow.step([99.0, 99.0, -99.0, -99.0]).tolist() == [20.0, -10.0, -10.0, -10.0]
    assert mh.ActuatorArray([mh.Stage(MODEL)]).inverse(dt=DT).limits is None


def test_limits_beyond_what_was_identified_are_warned_of_once() -> None:
    drive = mh.signals.decaying_triangle(100.0, 1.0, cycles=5, rate=1000)
    found = mh.identify(drive, MODEL.forward().run(drive), operators=10)
    mirror = mh.ActuatorArray([found.stage] * 2)
    limits = mirror.inverse(dt=DT).limits
    assert limits is not None and limits.tolist() == [[-100.0, 100.0]] * 2
    for make in (mirror.inverse, mirror.controller):
        with pytest.warns(UserWarning, match="beyond the identified drives"):
            made = make(dt=DT, limits=(-150.0, 150.0))
        copied = pickle.loads(pickle.dumps(made))  # its maker has been warned
        assert copied.state == made.state
        assert pickle.loads(pickle.dumps(copied)).state == made.state


def test_another_hysteresis_takes_over(
    make: Callable[[], mh.ForwardArray | mh.InverseArray],
) -> None:
    stream, x = make(), references()
    stream.run(x[:50])
    weights = 1.1 * MODEL.weights
    other = mh.ModifiedPrandtlIshlinskii(weights, MODEL.r, MODEL.ra, MODEL.rb, MODEL.rc)
    stream.set_model(1, other)
    copied = pickle.loads(pickle.dumps(stream))
    assert copied.state == stream.state
    assert bits(copied.run(x[50:])) == bits(stream.run(x[50:]))
    before = stream.state
    with pytest.raises(ValueError, match="actuator: expected a number below 4, got 4"):
        stream.set_model(M, other)
    with pytest.raises(ValueError, match="model: expected"):
        stream.set_model(0, mh.PrandtlIshlinskii([1.0], [0.0]))
    with pytest.raises(TypeError, match="model: expected a PrandtlIshlinskii"):
        stream.set_model(0, STAGES[0])  # type: ignore[arg-type]
    assert stream.state == before


def test_stages_without_what_drifts_are_bracketed() -> None:
    stages = [mh.Stage(MODEL, limits=LIMITS, output_map=MAP, creep=CREEP), mh.Stage(MODEL)]
    mirror, limits = mh.ActuatorArray(stages), [LIMITS, (-200.0, 100.0)]
    bracket, singles = mirror.bracket(limits), [stages[0].bracket(), stages[1].bracket(limits[1])]
    rows = np.array([[10.0, -20.0], [200.0, 50.0], [30.0, -190.0]])
    for row in rows:
        low, high = bracket.step(row)
        assert [*zip(low, high, strict=True)] == [
            one.step(u) for one, u in zip(singles, row, strict=True)
        ]
    assert pickle.loads(pickle.dumps(bracket)).state == bracket.state
    assert mirror[:1].bracket().limits.tolist() == [list(LIMITS)]
    drives, left = mirror.demagnetize(limits, slew=2000.0, rate=1000.0)
    models = mh.ActuatorArray([MODEL] * 2).demagnetize(limits, slew=2000.0, rate=1000.0)
    assert bits(drives) == bits(models[0]) and left[1] == models[1][1] and left[0] != models[1][0]
    assert np.isnan(MIRROR.demagnetize((-200.0, 200.0), slew=2e3, rate=1e3)[1][0])  # a Duhem one


# ---- the controller


def events() -> st.SearchStrategy[list[tuple[str, list[float]]]]:
    reference = st.lists(st.floats(-2.0, 2.0), min_size=M, max_size=M)
    word = st.sampled_from(["step"] * 12 + ["hold", "release", "stop", "bad", "limits"])
    return st.lists(st.tuples(word, reference), min_size=1, max_size=30)


def happen(controller: mh.control.ArrayController, word: str, reference: list[float]) -> bool:
    """Let something happen; whether a sample passes."""
    match word:
        case "hold":
            controller.hold = True
        case "release":
            controller.hold = False
        case "stop":
            controller.stop(1e4, [10.0, -10.0, 0.0, 5.0])
        case "bad":
            controller.step([math.nan, *reference[1:]])
        case "limits":
            controller.step([10.0 * one for one in reference])
        case _:
            controller.step(reference, [0.9 * one for one in reference])
    return word in ("step", "bad", "limits")


@given(events())
def test_drives_stay_within_limits_and_slew_and_positions_are_those_of_the_stages(
    events: list[tuple[str, list[float]]],
) -> None:
    controller = MIRROR.controller(DT, ki=100.0, **CHAIN)
    low, high = controller.limits.T
    drives, positions = [controller.drive], [controller.position]
    for event in events:
        if happen(controller, *event):
            drives.append(controller.drive)
            positions.append(controller.position)
            assert ((low <= drives[-1]) & (drives[-1] <= high)).all()
            assert abs(drives[-1] - drives[-2])[0] <= 2e5 * DT
    assert abs(driven(np.array(drives)[1:]) - np.array(positions)[1:]).max(initial=0.0) < 1e-11


@given(events(), st.integers(0, 30))
def test_a_restored_controller_goes_on_bit_for_bit(
    events: list[tuple[str, list[float]]], cut: int
) -> None:
    controller = MIRROR.controller(DT, ki=100.0, slew=1e5, **CHAIN)
    for event in events[:cut]:
        happen(controller, *event)
    twins = [pickle.loads(pickle.dumps(controller)), copy.deepcopy(controller)]
    twins.append(MIRROR.controller(DT, ki=100.0, slew=1e5, **CHAIN))
    twins[-1].state = json.loads(json.dumps(controller.state))
    for event in events[cut:]:
        for one in (controller, *twins):
            happen(one, *event)
    assert all(one.state == controller.state for one in twins)


def test_a_block_is_its_samples_and_peek_looks_ahead() -> None:
    reference = references()
    reference[40, 2] = math.nan
    measurement = 0.9 * reference
    stepped, ran = (MIRROR.controller(DT, ki=100.0, **CHAIN) for _ in range(2))
    for r, y in zip(reference, measurement, strict=True):
        before, ahead = stepped.state, stepped.peek(r, y)
        assert stepped.state == before
        assert bits(stepped.step(r, y)) == bits(ahead)
    drives = ran.run(reference, measurement)
    assert bits(drives[-1]) == bits(stepped.drive) and ran.state == stepped.state


def test_neighbours_do_not_creep_apart() -> None:
    controller = MIRROR.controller(DT, slew=1e7, bumpless_time=0.0, **CHAIN)
    steep = np.repeat([[-1.5, -0.5, 0.5, 1.5]], 400, axis=0)
    at = driven(controller.run(np.vstack([np.zeros((5, M)), steep])))
    assert abs(np.diff(at[6:], axis=1)).max() <= 0.25
    assert controller.pair_limited_count >= 399
    controller.hold = True
    controller.run(steep)
    assert abs(np.diff(controller.position)).max() > 0.25  # creep goes on while the drives stay


def test_limits_and_slew_are_those_of_the_stages_unless_they_are_given() -> None:
    controller = MIRROR.controller(DT, bumpless_time=0.0)
    assert controller.limits.tolist() == [list(stage.limits or ()) for stage in STAGES]
    far = [99.0, -99.0, 99.0, 99.0]
    first, second = controller.run([far, far])
    assert abs(second - first)[0] == pytest.approx(200.0)  # 2e5 V/s
    assert second[1:].tolist() == [500.0, 400.0, 400.0]
    assert pickle.loads(pickle.dumps(controller)).state == controller.state
    slow = MIRROR.controller(DT, (-100.0, 100.0), slew=1e4, bumpless_time=0.0)
    assert abs(np.diff(slow.run([far, far]), axis=0)).max() == pytest.approx(10.0)
    assert slow.limits.tolist() == [[-100.0, 100.0]] * M
    free = mh.ActuatorArray([STAGES[1]]).controller(DT, bumpless_time=0.0)
    assert free.run([[-99.0], [-99.0]])[1, 0] == 500.0


def test_the_controller_takes_another_hysteresis_without_a_jump() -> None:
    controller = MIRROR.controller(DT)
    for _ in range(20):
        controller.step(np.full(M, 0.5))
    weights = 1.1 * MODEL.weights
    other = mh.ModifiedPrandtlIshlinskii(weights, MODEL.r, MODEL.ra, MODEL.rb, MODEL.rc)
    before = controller.drive
    controller.set_model(2, other)
    copied = pickle.loads(pickle.dumps(controller))
    assert copied.state == controller.state
    moved = controller.step(np.full(M, 0.5)) - before
    assert bits(copied.step(np.full(M, 0.5))) == bits(controller.drive)
    assert 0.0 < abs(moved[2]) < 20.0
    for _ in range(20):
        controller.step(np.full(M, 0.5))
    assert abs(controller.position - 0.5).max() < 1e-12


def test_the_loop_closes_on_what_only_the_sensors_know_of() -> None:
    plant = mh.ActuatorArray([one.replace(dynamics=None, dead_time=0.0) for one in STAGES])
    forward, controller = plant.forward(dt=DT), MIRROR.controller(DT, ki=200.0)
    measured = np.zeros(M)
    for _ in range(300):
        measured = forward.step(controller.step(np.full(M, 0.4), measured)) + 0.05
    assert abs(measured - 0.4).max() < 1e-6
