"""Scans one after the other: what `precompensate` gives, with nothing forgotten in between."""

from __future__ import annotations

import json
import subprocess
import sys
import time
import warnings
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from support import Array

DT = 1e-3
CREEP = mh.plant.Creep.logarithmic(0.012, 0.01, 100.0, 8)
SLOW = mh.Stage(
    mh.paper.table_1_recovered(),
    limits=(-500.0, 500.0),
    creep=CREEP,
    loop_shift=mh.plant.LoopShift(0.0, 500.0, (0.02, 0.01), 0.5, 0.3),
    relaxing_plays=mh.plant.RelaxingPlays([0.0, 90.0], [0.05], [[1e-5, 2e-5]]),
    slow_gain=mh.plant.SlowGain(500.0, -0.02, 0.0, 0.5),
    duhem=mh.Duhem.from_bouc_wen(0.002, 0.5, 0.9, 0.4),
    input_map=([-500.0, 0.0, 500.0], [-480.0, 0.0, 510.0]),
)
FAST = SLOW.replace(
    dynamics=mh.plant.SecondOrder(80.0, 0.9), dead_time=2e-3, amplifier_bandwidth=150.0, slew=1e5
)
SOFT = 1.5 * np.sin(np.linspace(0.0, np.pi, 500)) ** 2  # from rest to rest
WAVE = mh.signals.sine(1.5, 2.0, seconds=0.5, rate=1 / DT)


def scanner(**stages: mh.Stage) -> mh.scan.Scanner:
    return mh.scan.Scanner(stages or {"x": SLOW, "y": FAST}, DT)


# ---- what it gives


@pytest.mark.parametrize("stage", [SLOW, SLOW.replace(limits=(-500.0, 400.0))])
def test_the_first_scan_is_that_of_precompensate(stage: mh.Stage) -> None:
    drives = scanner(x=stage).run({"x": WAVE})
    np.testing.assert_array_equal(drives["x"], stage.precompensate(WAVE, DT))


def test_dynamics_are_inverted_as_by_precompensate() -> None:
    begun = scanner(y=FAST)
    rising = np.linspace(0.0, 1.0, 200) ** 2
    # Fast and slow part are each behind the lag of the amplifier: two roundings.
    expected = FAST.precompensate(rising, DT)
    np.testing.assert_allclose(begun.run({"y": rising})["y"], expected, rtol=0, atol=1e-12 * 500.0)


def test_what_was_driven_before_counts() -> None:
    begun = scanner()
    put_out: dict[str, list[Array]] = {"x": [], "y": []}
    for gain in (1.0, 0.3, -1.2):
        drives = begun.run({"x": gain * WAVE, "y": -gain * WAVE}, lead_in=0.05)
        begun.wait(0.2)
        for name, drive in drives.items():
            put_out[name] += [drive, np.full(200, drive[-1])]
    later = begun.run({"x": 0.5 * WAVE, "y": 0.4 * WAVE}, lead_in=0.05)
    assert later["x"].size == later["y"].size == 550
    for name, stage, gain in (("x", SLOW, 0.5), ("y", FAST, 0.4)):
        bench = stage.forward(DT)
        bench.run(np.concatenate(put_out[name]))
        reached = bench.run(later[name])[50:]
        # The slow stage is followed to rounding, the modes of the fast one as their inverse can.
        assert np.abs(reached - gain * WAVE).max() < (1e-12 if stage is SLOW else 2e-3)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # the first step from where it was
            forgetful = stage.precompensate(gain * WAVE, DT, lead_in=0.05)
        bench = stage.forward(DT)
        bench.run(np.concatenate(put_out[name]))
        assert np.abs(bench.run(forgetful)[50:] - gain * WAVE).max() > 0.02


def test_an_axis_that_is_not_named_keeps_its_drive() -> None:
    begun = scanner()
    begun.run({"y": WAVE}, lead_in=0.05)
    held = begun.drives["y"]
    drives = begun.run({"x": WAVE})
    assert list(drives) == ["x", "y"] and drives["y"].size == WAVE.size
    assert set(drives["y"]) == {held}
    followed = scanner(y=FAST)
    first = followed.run({"y": WAVE}, lead_in=0.05)["y"]
    followed.wait(WAVE.size * DT)
    assert followed.state["axes"]["y"] == begun.state["axes"]["y"] and first[-1] == held


def test_follow_and_start_say_what_was_before() -> None:
    drives = scanner().run({"x": WAVE})
    told = scanner()
    told.follow({"x": drives["x"][:100]})
    told.follow({"x": drives["x"][100:], "y": np.zeros(WAVE.size)})
    begun = scanner()
    begun.run({"x": WAVE})
    assert told.drives == begun.drives
    later = told.run({"x": 0.5 * WAVE}, lead_in=0.05)["x"]
    expected = begun.run({"x": 0.5 * WAVE}, lead_in=0.05)["x"]
    np.testing.assert_allclose(later, expected, rtol=0.0, atol=1e-9)  # V: positions are rounded
    resting = mh.scan.Scanner({"x": SLOW}, DT, start={"x": 120.0})
    at = resting.positions["x"]
    drive = resting.run({"x": at + 0.2 * WAVE}, lead_in=0.05)["x"]
    assert abs(drive[0] - 120.0) < 0.1  # V: the lead-in begins where the stage is
    bench = SLOW.forward(DT)
    assert bench.settle(120.0) == at
    assert np.abs(bench.run(drive)[50:] - at - 0.2 * WAVE).max() < 1e-12


def test_positions_have_the_static_gain_of_the_modes() -> None:
    twice = mh.Stage(
        SLOW.hysteresis,
        limits=SLOW.limits,
        dynamics=mh.plant.StateSpace([[-300.0]], [600.0], [1.0], 0.0),
    )
    resting = mh.scan.Scanner({"x": twice}, DT, start={"x": 200.0})
    single = SLOW.hysteresis.forward().step(200.0)
    assert resting.positions["x"] == pytest.approx(2.0 * single, rel=1e-12)


def test_what_could_not_be_written_is_not_remembered() -> None:
    def broken(_: object) -> None:
        raise OSError("no card")

    begun, put_out = scanner(), list[dict[str, Array]]()
    drives = begun.run({"x": WAVE}, write=put_out.append)
    assert len(put_out) == 1 and put_out[0] is drives
    before = begun.state
    with pytest.raises(OSError, match="no card"):
        begun.run({"x": -WAVE}, lead_in=0.05, write=broken)
    assert begun.state == before
    again = begun.run({"x": -WAVE}, lead_in=0.05)
    other = scanner()
    other.run({"x": WAVE})
    np.testing.assert_array_equal(again["x"], other.run({"x": -WAVE}, lead_in=0.05)["x"])


def test_threads_take_turns() -> None:
    begun, order, inside = scanner(), list[str](), list[str]()
    moves = {axis: {axis: np.full(20, 0.3)} for axis in "xy"}

    def move(axis: str) -> None:
        def write(_: object) -> None:
            inside.append(axis)
            time.sleep(0.01)  # another thread would come in
            assert inside == [axis]
            order.append(inside.pop())

        for _ in range(4):
            begun.run(moves[axis], lead_in=0.05, write=write)

    with ThreadPoolExecutor(2) as pool:
        for future in [pool.submit(move, axis) for axis in "xy"]:
            future.result()
    assert sorted(order) == ["x"] * 4 + ["y"] * 4
    alone = scanner()
    for axis in order:
        alone.run(moves[axis], lead_in=0.05)
    assert alone.state == begun.state


def test_trajectories_are_taken() -> None:
    scan = mh.trajectories.PointToPoint([0.0, 1.0], velocity=20.0, acceleration=2e3, jerk=4e5)
    sampled = scanner(x=SLOW).run({"x": scan.sample(DT)[0]})
    np.testing.assert_array_equal(scanner(x=SLOW).run({"x": scan})["x"], sampled["x"])


def test_a_scan_in_motion_is_told() -> None:
    quick = mh.signals.sine(0.3, 30.0, seconds=0.2, rate=1 / DT)
    with pytest.warns(
        UserWarning, match=r"positions\['x'\]: begin in motion.*give a lead_in"
    ) as told:
        scanner(x=FAST.replace(slew=1e6)).run({"x": quick})
    assert [Path(one.filename).name for one in told] == ["test_scan.py"]


# ---- from end to end


SOFT_STACK = mh.Stage(
    mh.PrandtlIshlinskii([0.1, 0.05, 0.05], [0.0, 10.0, 40.0]), limits=(0.0, 150.0)
)
LAGS = {"dynamics": mh.plant.SecondOrder(300.0, 0.7), "amplifier_bandwidth": 400.0}


@pytest.mark.parametrize("creep", [None, CREEP])
@pytest.mark.parametrize("upwards", [True, False])
def test_a_ramp_leads_from_one_end_of_the_range_to_the_other(
    creep: mh.plant.Creep | None, upwards: bool
) -> None:
    stage = SOFT_STACK.replace(creep=creep)
    begun, bench = scanner(x=stage), stage.forward(DT)
    assert stage.position_range is not None
    low, high = stage.position_range if upwards else stage.position_range[::-1]
    for ramp in (np.linspace(low, high, 300), np.linspace(high, low, 300)):
        reached = bench.run(begun.run({"x": ramp}, lead_in=0.1)["x"])[100:]
        assert np.abs(reached - ramp).max() < 1e-9 * abs(high - low)


def test_a_ramp_of_a_lagging_stage_begins_at_the_end_of_its_range() -> None:
    stage = SOFT_STACK.replace(**LAGS)
    bench = stage.forward(DT)
    assert stage.position_range is not None
    low, high = stage.position_range
    for begun, ramp in (
        (scanner(x=stage), np.linspace(low, high, 300)[:290]),
        (scanner(x=stage), np.linspace(high, low, 300)[:290]),
    ):
        bench.settle(0.0)
        drives = begun.run({"x": ramp}, lead_in=0.1)["x"]
        assert np.abs(bench.run(drives)[100:] - ramp).max() < 2e-3 * (high - low)


def test_where_a_scan_may_begin_is_told() -> None:
    reach = r"positions that the stage reaches, 2\.5 to 27\.5 um"
    advice = "begin farther within them, or give a longer lead_in"
    driven = scanner(x=SOFT_STACK)
    driven.follow({"x": [150.0, 0.0]})
    swinging = scanner(x=SOFT_STACK.replace(dynamics=mh.plant.SecondOrder(20.0, 0.05)))
    for begun, scan in ((driven, np.linspace(1.0, 20.0, 100)), (swinging, np.full(150, 27.5))):
        before = begun.state
        with pytest.raises(ValueError, match=rf"x'\]: the lead-in leaves the {reach}: {advice}"):
            begun.run({"x": scan}, lead_in=0.1)
        assert begun.state == before
    swinging.run({"x": np.full(150, 27.5)}, lead_in=0.2)
    driven.run({"x": np.linspace(2.5, 20.0, 100)}, lead_in=0.1)


# ---- what it refuses


@pytest.mark.parametrize(
    ("positions", "message"),
    [
        (
            {"x": 0.1 * WAVE, "y": 9.0 * SOFT},
            r"positions\['y'\]: expected positions that the stage",
        ),
        ({"x": 0.1 * WAVE, "y": SOFT[:-1]}, "positions: expected all axes equally long"),
        ({"x": 0.1 * WAVE, "z": WAVE}, r"positions: expected axes of \('x', 'y'\), got 'z'"),
        (
            {"x": 0.1 * WAVE, "y": [0.0, np.nan]},
            r"positions\['y'\]: reference\[1\]: expected a fin",
        ),
        ({"x": 0.1 * WAVE, "y": []}, r"positions\['y'\]: reference"),
        (
            {"x": 0.1 * WAVE, "y": SOFT + 1.0},
            r"positions\['y'\]: expected to begin where the stage",
        ),
        (
            {"x": 0.1 * WAVE, "y": np.r_[np.zeros(99), np.full(50, 0.4)]},
            r"positions\['y'\]: .* move faster than",
        ),
        (
            {"x": np.linspace(0.0, 3.3, 500)},
            r"positions\['x'\]: expected positions that .* are not",
        ),
        ({}, "positions: expected at least one axis, got none"),
    ],
)
def test_a_refused_scan_changes_nothing(positions: dict[str, Any], message: str) -> None:
    begun = scanner()
    begun.run({"x": WAVE, "y": WAVE}, lead_in=0.05)
    begun.run({"x": np.zeros(60), "y": np.zeros(60)}, lead_in=0.05)
    before = begun.state
    with pytest.raises(ValueError, match=message):
        begun.run(positions)
    assert begun.state == before


@pytest.mark.parametrize(
    ("arguments", "kind", "message"),
    [
        (({},), ValueError, "stages: expected a dictionary of stages by axis"),
        (({"x": 3},), TypeError, r"stages\['x'\]: expected a Stage, got 3"),
        (
            ({"x": mh.Stage(mh.paper.table_1_recovered())},),
            ValueError,
            r"stages\['x'\]: expected a stage with limits",
        ),
        (({"x": SLOW}, {"z": 0.0}), ValueError, r"start: expected axes of \('x',\), got 'z'"),
        (({"x": SLOW}, {"x": 900.0}), ValueError, r"start\['x'\]: expected a drive in \[-500"),
    ],
)
def test_what_a_scanner_cannot_be_made_of(
    arguments: tuple[Any, ...], kind: type[Exception], message: str
) -> None:
    stages, start = (*arguments, None)[:2]
    with pytest.raises(kind, match=message):
        mh.scan.Scanner(stages, DT, start=start)


@pytest.mark.parametrize("dt", [0.0, -1.0, np.nan, "fast"])
def test_a_sampling_interval_is_checked(dt: Any) -> None:
    for stage in (SLOW, FAST):
        with pytest.raises((ValueError, TypeError), match="dt"):
            mh.scan.Scanner({"x": stage}, dt)


def test_times_and_drives_are_checked() -> None:
    begun = scanner()
    for seconds in (-1.0, np.nan, np.inf):
        with pytest.raises(ValueError, match="seconds: expected a finite time"):
            begun.wait(seconds)
    before = begun.state
    with pytest.raises(ValueError, match="drives"):
        begun.follow({"x": [0.0, 1.0], "y": [0.0, 501.0]})
    assert begun.state == before


# ---- from process to process


def test_another_process_goes_on(tmp_path: Path) -> None:
    SLOW.save(tmp_path / "x.json")
    FAST.save(tmp_path / "y.json")
    begun = scanner()
    begun.run({"x": WAVE, "y": 0.5 * WAVE}, lead_in=0.05)
    begun.save(tmp_path / "scanner.json")
    code = (
        "import mpi_hyst as mh, numpy as np\n"
        "stages = {name: mh.load(f'{name}.json') for name in 'xy'}\n"
        "scanner = mh.scan.Scanner(stages, 1e-3)\n"
        "scanner.load('scanner.json')\n"
        "wave = mh.signals.sine(1.5, 2.0, seconds=0.5, rate=1000.0)\n"
        "np.savez('drives.npz', **scanner.run({'x': -wave}, lead_in=0.05))\n"
        "scanner.save('scanner.json')\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, cwd=tmp_path)
    here = begun.run({"x": -WAVE}, lead_in=0.05)
    with np.load(tmp_path / "drives.npz") as there:
        for name in "xy":
            np.testing.assert_array_equal(there[name], here[name])
    back = scanner()
    back.load(tmp_path / "scanner.json")
    assert back.state == begun.state
    assert {path.suffix for path in tmp_path.iterdir()} == {".json", ".npz"}


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"dt": 2e-3}, "state: expected dt = 0.001, got 0.002"),
        ({"axes": {}}, r"state: expected the axes \('x', 'y'\), got \(\)"),
        ({"format": "other"}, "state: expected the state of a scanner"),
        ({"version": 2}, "state: expected the state of a scanner"),
        ({"axes": {"x": {}, "y": {}}}, r"axes\['x'\]: expected the state of an axis"),
    ],
)
def test_another_file_is_refused(changed: dict[str, Any], message: str, tmp_path: Path) -> None:
    begun = scanner()
    begun.run({"x": WAVE})
    before = begun.state
    path = tmp_path / "scanner.json"
    path.write_text(json.dumps({**before, **changed}), "utf-8")
    with pytest.raises(ValueError, match=f"scanner.json: {message}"):
        begun.load(path)
    assert begun.state == before
    path.write_text("{", "utf-8")
    with pytest.raises(ValueError, match=r"scanner.json: "):
        begun.load(path)
    assert begun.state == before


def test_the_state_of_another_stage_is_refused() -> None:
    begun, other = scanner(), scanner(x=SLOW, y=FAST.replace(creep=None))
    other.run({"x": WAVE})
    before = begun.state
    with pytest.raises(ValueError, match=r"axes\['y'\]: "):
        begun.state = other.state
    assert begun.state == before
