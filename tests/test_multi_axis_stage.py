"""Several axes with hysteresis in front of or inside shared dynamics: equations, identification."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from reference import axes as reference
from reference import duhem as reference_duhem
from support import Array

DT = 1e-3
MATRICES: dict[str, Any] = {
    "a": [[0.6, 0.3, 0.0], [-0.3, 0.6, 0.1], [0.0, 0.0, 0.5]],
    "b": [[0.2, 0.0], [0.1, 0.3], [0.0, 0.4]],
    "bw": [[0.05, 0.0], [0.0, -0.04], [0.02, 0.03]],
    "c": [[1.0, 0.0, 0.2], [0.0, 1.0, -0.1]],
    "d": [[0.0, 0.01], [0.02, 0.0]],
    "cq": [[0.3, 0.0, 0.0], [0.0, 0.2, 0.1]],
    "dq": [[1.0, 0.0], [0.0, 0.8]],
}
PLAYS = ([0.1, 0.4], [0.7, -0.2])
KNOTS = ([-1.0, 0.0, 1.0], [1.4, 1.0, 0.6], [0.6, 1.0, 1.4])
OFFSET = [0.5, -0.5]


def stage(**changes: Any) -> mh.MultiAxisStage:
    operators = [PLAYS, mh.Duhem(*KNOTS)]
    parts = {**MATRICES, "operators": operators, "output_offset": OFFSET, "dt": DT, **changes}
    return mh.MultiAxisStage(**parts)


def drive(samples: int, seed: int) -> Array:
    noise = np.random.default_rng(seed).standard_normal((samples, 2))
    return np.column_stack([np.convolve(one, np.ones(8) / 3.0, "same") for one in noise.T])


def expected(u: Array) -> Array:
    operators: list[Any] = [reference.Plays(*PLAYS), reference_duhem.Duhem(*KNOTS)]
    found: Any = reference.positions(MATRICES, operators, OFFSET, u.tolist())
    return np.asarray(found)


def test_positions_are_those_of_the_equations() -> None:
    u = drive(400, 1)
    forward = stage().forward()
    y = forward.run(u)
    assert np.abs(y - expected(u)).max() < 1e-13
    one, out = stage().forward(), np.empty(2)
    for row, wanted in zip(u, y, strict=True):
        assert one.step(row, out=out) is out and (out == wanted).all()
    forward.reset()
    filled = np.empty((400, 2))
    assert forward.run(u, out=filled) is filled and (filled == y).all()


def test_sub_steps_are_steps_with_the_drives_held() -> None:
    u = drive(100, 3)
    several = stage(sub_steps=3)
    y = several.forward().run(u)
    assert np.abs(y - expected(np.repeat(u, 3, axis=0))[::3]).max() < 1e-13
    forward = several.forward()
    later = np.array([forward.advance(row) for row in u])
    reached = later - u @ np.array(MATRICES["d"]).T
    assert np.abs(reached[:-1] - (y[1:] - u[1:] @ np.array(MATRICES["d"]).T)).max() < 1e-13
    assert (several.sub_steps, stage().sub_steps) == (3, 1)
    assert repr(several).endswith("dt 0.001 s in 3 sub-steps>") and several != stage()
    copy = pickle.loads(pickle.dumps(several))
    assert copy == several and copy.sub_steps == 3
    with pytest.raises(ValueError, match="sub_steps: expected 1 to 1000 steps in a sample, got 0"):
        stage(sub_steps=0)


def test_sub_steps_of_an_oscillator() -> None:
    hysteresis = mh.Duhem.from_bouc_wen(2.5e4, 1e3, 0.8, -1.1)
    oscillator = mh.plant.HystereticOscillator(0.5, 5.0, 2.5e4, hysteresis)
    noise = np.random.default_rng(5).standard_normal(2000)
    u = 100.0 * np.convolve(noise, np.hanning(16) / 2.0, "same")  # N, up to 80 Hz
    y = oscillator.response(u, dt=DT, sub_steps=40)

    def missed(sub_steps: int) -> float:
        stage = oscillator.axes(DT, sub_steps=sub_steps)
        return float((stage.forward().run(u[:, None])[:, 0] - y).std())

    assert missed(4) < 0.1 * missed(1) < 0.01 * y.std()

    wanted = y * np.clip(np.arange(y.size) / 200.0, 0.0, 1.0)

    def missed_in_a_loop(sub_steps: int) -> float:
        controller = oscillator.axes(DT, sub_steps=sub_steps).controller((-2e3, 2e3))
        plant, now, errors = oscillator.forward(DT, sub_steps=20), 0.0, []
        for k in range(wanted.size - controller.ahead):
            errors.append(now - wanted[k])
            now = plant.advance(controller.step([wanted[k + controller.ahead]], [now])[0])
        return float(np.std(errors))

    assert missed_in_a_loop(4) < 0.6 * missed_in_a_loop(1)
    with pytest.raises(ValueError, match="dt: expected sub-steps so short beside a period"):
        oscillator.axes(0.05)


def test_a_saved_state_goes_on_bit_for_bit() -> None:
    u = drive(60, 2)
    one, other = stage().forward(), stage().forward()
    one.run(u[:30])
    other.state = one.state
    assert (one.run(u[30:]) == other.run(u[30:])).all()


def test_a_stage_in_a_file(tmp_path: Path) -> None:
    path = tmp_path / "axes.json"
    stage().save(path)
    assert mh.MultiAxisStage.load(path) == stage()
    path.write_text("{}", "utf-8")
    with pytest.raises(ValueError, match=r'axes\.json: schema: expected "mpi_hyst/multi_axis'):
        mh.MultiAxisStage.load(path)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: stage(b=[[1.0, 0.0]]), "b: expected as many rows as a, got 1"),
        (lambda: stage(a=[1.0]), r"a: expected a matrix, got shape \(1,\)"),
        (lambda: stage(a=np.eye(3)), "a: expected eigenvalues inside the unit circle, got 1.0"),
        (lambda: stage(dt=0.0), "dt: expected a finite number above 0 .*, got 0.0"),
        (lambda: stage(operators=[PLAYS, 3.0]), r"operators\[1\]: expected a mh.Duhem, or a pair"),
        (
            lambda: stage(operators=[PLAYS, ([-1.0], [1.0])]),
            r"operators\[1\]: .*thresholds\[0\]: expected a number from 0 to 1e50, got -1.0",
        ),
        (lambda: stage().forward().step([1.0]), r"u: expected an array of shape \(2,\), got"),
        (
            lambda: stage().forward().run([[1.0, 2.0]], out=np.empty((1, 3))),
            "out: expected a C-cont",
        ),
    ],
)
def test_wrong_arguments_are_named(call: Callable[[], object], message: str) -> None:
    with pytest.raises((ValueError, TypeError), match=message):
        call()


def plant(u: Array, hysteresis: bool) -> Array:
    """Two coupled modes behind plays, or without them, written without the package."""
    bw = np.array(MATRICES["bw"]) * (8.0 if hysteresis else 0.0)
    matrices = {**MATRICES, "bw": bw.tolist(), "cq": np.zeros((2, 3)).tolist()}
    operators = [reference.Plays([0.3, 0.8, 1.5], [0.5, 0.4, 0.3]) for _ in range(2)]
    found: Any = reference.positions(matrices, operators, OFFSET, u.tolist())
    return np.asarray(found)


def records(hysteresis: bool) -> tuple[list[Array], list[Array]]:
    u = [drive(1500, seed) for seed in (3, 4, 5)]
    noise = np.random.default_rng(6)
    return u, [plant(one, hysteresis) + 1e-3 * noise.standard_normal((1500, 2)) for one in u]


def test_plays_are_found_and_predict() -> None:
    u, y = records(hysteresis=True)
    found = mh.identify_axes(u, y, dt=DT, order=3, skip=20)
    assert found.hysteresis != "none"
    assert (found.held_out_errors < 0.3 * found.linear_errors).all()
    test = drive(1000, 7)
    missed = found.model.forward().run(test) - plant(test, hysteresis=True)
    assert (missed[20:].std(axis=0) < 0.02 * found.deviations).all()
    assert "hysteresis_inside_not_told" not in {finding.code for finding in found.warnings}
    assert "Tried" in found.summary()


def test_a_linear_stage_has_no_hysteresis() -> None:
    u, y = records(hysteresis=False)
    found = mh.identify_axes(u, y, dt=DT)
    assert found.verdict == "amber" and found.hysteresis == "none"
    assert {finding.code for finding in found.warnings} == {"hysteresis_inside_not_told"}
    assert (found.errors < 1.2e-3).all()
    assert max(abs(np.linalg.eigvals(found.model.a))) < 1.0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"y": np.zeros(30)}, r"y: expected an array of shape \(samples, channels\), got shape"),
        ({"y": np.zeros((29, 1))}, "y: expected 30 samples, got 29"),
        ({"u": [np.zeros((30, 1))] * 2}, "y: expected as many records as u has, 2, got 1"),
        ({"dt": -1.0}, "dt: expected a finite number of seconds above 0, got -1.0"),
        ({"skip": 30}, "skip"),
        ({"order": 99}, "samples|order"),
        ({"hysteresis": "many"}, 'hysteresis: expected "auto", "none", "plays" or "duhem"'),
        ({"place": 3}, 'place: expected "auto", "in_front" or "inside"'),
    ],
)
def test_wrong_records_are_named(change: dict[str, Any], message: str) -> None:
    ramp = np.arange(30.0)[:, None]
    arguments: dict[str, Any] = {"u": ramp, "y": ramp, "dt": DT, **change}
    with pytest.raises((ValueError, TypeError), match=message):
        mh.identify_axes(**arguments)


def test_a_reference_is_followed_by_the_plant() -> None:
    """Open loop, on a plant written without the package, by the drives of an identified model."""
    u, y = records(hysteresis=True)
    model = mh.identify_axes(u, y, dt=DT, order=3, skip=20, hysteresis="plays").model
    linear = mh.identify_axes(u, y, dt=DT, order=3, skip=20, hysteresis="none").model
    time = np.arange(1200) * DT
    soft = np.clip((time - 0.1) / 0.1, 0.0, 1.0) ** 2
    wanted = np.column_stack([soft * np.sin(30.0 * time), 0.6 * soft * np.sin(50.0 * time)])

    def missed(stage: mh.MultiAxisStage) -> Array:
        reference = stage.output_offset + wanted
        drives, told = stage.precompensate(reference)
        assert (told < 5e-3 * wanted.std(axis=0)).all()
        error = plant(drives, hysteresis=True) - reference
        # Offsets of records from rest are told apart from the plays' by few samples alone.
        return np.asarray((error - error.mean(axis=0)).std(axis=0) / wanted.std(axis=0))

    assert (missed(model) < 0.05).all()
    assert (missed(linear) > 0.1).all()


def test_drives_are_found_where_hysteresis_acts_on_the_motion() -> None:
    hysteresis = mh.Duhem.from_bouc_wen(2.5e4, 1e3, 0.8, -1.1)
    oscillator = mh.plant.HystereticOscillator(0.5, 5.0, 2.5e4, hysteresis)
    t = DT * np.arange(1400)
    swell = 0.25 * (1.0 + np.tanh((t - 0.3) / 0.05)) * (1.0 - np.tanh((t - 1.0) / 0.05))
    for frequency in (5.0, 25.0):
        wanted = 3e-4 * swell * np.sin(2.0 * np.pi * frequency * t)  # m
        for sub_steps in (1, 4):
            stage = oscillator.axes(DT, sub_steps=sub_steps)
            drives, missed = stage.precompensate(wanted[:, None])
            reached = oscillator.response(drives[:, 0].copy(), dt=DT, sub_steps=40)
            assert missed[0] < 1e-2 * wanted.std(), (frequency, sub_steps)
            assert (reached - wanted).std() < 1e-2 * wanted.std(), (frequency, sub_steps)


def test_records_may_be_arrays_of_more_dimensions() -> None:
    """Realisations, periods, samples, channels, as public benchmarks have them."""
    u = np.stack([drive(600, 1), drive(600, 2), drive(600, 3)])
    y = np.stack([stage().forward().run(one) for one in u])

    def model(u: Any, y: Any) -> mh.MultiAxisStage:
        return mh.identify_axes(u, y, dt=DT, order=3, hysteresis="plays", place="in_front").model

    found = model(list(u), list(y))
    assert model(u, y) == found
    periods = [one.reshape(3, 4, 150, 2) for one in (u, y)]
    assert model(*periods) == found
    with pytest.raises(ValueError, match=r"u: expected an array of shape \(samples, channels\)"):
        model(u.reshape(1, 3, 4, 150, 2), y)


def test_an_exact_linear_model_takes_no_operators_for_rounding() -> None:
    u = drive(600, 1)
    y = stage(bw=np.zeros((3, 2))).forward().run(u)
    found = mh.identify_axes(u, y, dt=DT)
    assert (found.hysteresis, found.verdict) == ("none", "green")
    assert [one["chosen"] for one in found.tried].count(True) == 1


def way(to: Array, samples: int = 400) -> Array:
    """From 0 to a point, at rest at both ends."""
    share = np.clip((np.arange(samples) - 100.0) / 150.0, 0.0, 1.0)
    return np.asarray((0.5 - 0.5 * np.cos(np.pi * share))[:, None] * to)


def test_a_reference_goes_on_where_the_last_one_ended() -> None:
    one = stage()
    bench, to = one.forward(), np.array([1.0, -0.6])
    first = one.output_offset + way(to)
    bench.run(one.precompensate(first)[0])
    second = first[-1] - way(to)
    before = bench.state
    drives, missed = one.precompensate(second, start=bench)
    assert bench.state == before
    reached = bench.run(drives)
    rms = np.sqrt(((reached - second) ** 2).mean(axis=0))
    assert missed == pytest.approx(rms, abs=1e-12)
    assert (missed < 1e-3).all()
    # From rest it begins elsewhere.
    with pytest.warns(UserWarning, match=r"reference\[0, 0\]: begins at .* where the stage is at"):
        assert (one.precompensate(second)[1] > 1e-2).all()


def test_drives_of_a_reference_are_held_at_limits() -> None:
    one = stage()
    wanted = one.output_offset + way(np.array([1.0, -0.6]))
    free, missed = one.precompensate(wanted)
    low, high = free.min(axis=0), free.max(axis=0)
    with pytest.warns(mh.HeldBackWarning, match=r"reference: \d+ of 800 .* by the limits"):
        held, more = one.precompensate(wanted, limits=np.column_stack([0.5 * low, 0.5 * high]))
    assert (held >= 0.5 * low).all() and (held <= 0.5 * high).all()
    assert (more > missed).all()
    wide = (float(low.min()) - 1.0, float(high.max()) + 1.0)
    assert (one.precompensate(wanted, limits=wide)[0] == free).all()


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"limits": (1.0, -1.0)}, r"limits\[0\]: expected a low limit below a high one"),
        ({"limits": [(0.0, 1.0)]}, "limits: expected 2 rows, got 1"),
        ({"limits": "wide"}, "limits: expected"),
        ({"start": None, "limits": (0.0, np.nan)}, r"limits\[0\]: expected .* both finite"),
        ({"start": 0.5}, "start: expected .*MultiAxisForward"),
    ],
)
def test_wrong_beginnings_and_limits_are_named(given: dict[str, Any], message: str) -> None:
    with pytest.raises((ValueError, TypeError), match=message):
        stage().precompensate(np.zeros((300, 2)), **given)


def test_a_stream_of_another_stage_is_no_beginning() -> None:
    other = stage(output_offset=[1.0, 1.0]).forward()
    with pytest.raises(ValueError, match="start: expected a stream of this stage, got one of anot"):
        stage().precompensate(np.zeros((300, 2)), start=other)


def test_only_square_stages_have_an_inverse() -> None:
    wide = stage(c=[[1.0, 0.0, 0.2]], d=[[0.0, 0.01]], output_offset=[0.0])
    with pytest.raises(ValueError, match="reference: expected a stage with as many drives"):
        wide.precompensate(np.zeros((10, 1)))
    with pytest.raises(ValueError, match=r"reference: expected an array of shape \(samples, 2\)"):
        stage().precompensate(np.zeros((10, 1)))
