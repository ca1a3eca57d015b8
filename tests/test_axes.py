"""Several axes: plants that move each other, controllers behind a static decoupling."""

from __future__ import annotations

import math

import mpi_hyst as mh
import numpy as np
import pytest
from axes import CROSSTALK, DT, LAG, LIMITS, controllers, made, plants, raster, walk

# ---- what decoupling is for


def test_with_decoupling_a_raster_along_x_hardly_moves_y() -> None:
    largest = {}
    preview = mh.control.preview(LAG, DT, ahead=4)
    for name, decoupling in (("none", None), ("inverse", np.linalg.inv(CROSSTALK))):
        stage = mh.plant.MultiAxisPlant(plants(2), CROSSTALK)
        axes = mh.control.MultiAxisController(controllers(2, preview=preview), decoupling)
        x, y = mh.plant.simulate(axes, stage, raster(), period=500)
        assert x.settled is not None and y.settled is not None
        largest[name] = 1e3 * y.settled.max_position_error  # nm
        assert x.settled.max_position_error < 0.1
    assert largest["none"] > 20.0
    assert largest["none"] > 10.0 * largest["inverse"]


def test_tip_tilt_and_piston_of_a_mirror_on_three_actuators() -> None:
    # at 120 degrees, 10 mm from the centre: tip and tilt in urad, piston in um
    angles = np.deg2rad([90.0, 210.0, 330.0])
    places = np.column_stack([np.cos(angles), np.sin(angles), np.ones(3)])
    height_of = places * [10e-3, 10e-3, 1.0]
    coupling = np.linalg.inv(height_of)
    mirror = mh.plant.MultiAxisPlant(plants(3), coupling)
    preview = mh.control.preview(LAG, DT, ahead=4)
    axes = mh.control.MultiAxisController(controllers(3, preview=preview), height_of)
    tip = mh.trajectories.Sine(150.0, 20.0).sample(DT, 0.2)[0]  # urad: 1.5 um at the actuators
    reference = np.column_stack([tip, np.zeros(tip.size), np.full(tip.size, 0.5)])
    runs = mh.plant.simulate(axes, mirror, reference, period=500)
    assert len(runs) == 3
    errors = [run.settled.max_position_error for run in runs if run.settled is not None]
    assert errors[0] < 1.0 and errors[1] < 1.0 and errors[2] < 0.01  # urad, urad, um
    np.testing.assert_allclose(mirror.position, coupling @ [one.position for one in mirror.plants])


# ---- the plant


def test_a_plant_of_several_axes_is_its_plants_and_a_product() -> None:
    stage, single = mh.plant.MultiAxisPlant(plants(2, 0.016), CROSSTALK), plants(2, 0.016)
    assert stage.dt == DT and len(stage) == 2
    assert stage.limits.tolist() == [list(LIMITS)] * 2
    for drives in [*walk(50, 2, 600.0), np.array([math.nan, 100.0])]:
        shown = stage.step(drives)
        noise = [one.step(u) - one.position for one, u in zip(single, drives, strict=True)]
        position = CROSSTALK @ [one.position for one in single]
        np.testing.assert_allclose(stage.position, position, rtol=0, atol=1e-13)
        np.testing.assert_allclose(shown, position + noise, rtol=0, atol=1e-13)
        assert np.array_equal(shown, stage.measured) and np.array_equal(shown, stage.read())
        assert stage.drive.tolist() == [one.drive for one in single]


def test_with_the_identity_a_plant_of_several_axes_is_its_plants() -> None:
    options = {"dac_bits": 12, "adc_bits": 16, "adc_range": (-4.0, 4.0)}
    stage, single = (
        mh.plant.MultiAxisPlant(plants(3, 0.016, **options), np.eye(3)),
        plants(3, 0.016, **options),
    )
    drives = walk(40, 3, 600.0)
    measured, position = stage.run(drives)
    for i, one in enumerate(single):
        y, p = one.run(drives[:, i])
        assert np.array_equal(measured[:, i], y) and np.array_equal(position[:, i], p)
        assert one.state == stage.plants[i].state


def test_a_plant_of_several_axes_goes_on_from_its_state() -> None:
    stage = mh.plant.MultiAxisPlant(plants(2, 0.016), CROSSTALK)
    first = [stage.step(u).tolist() for u in walk(10, 2, 500.0)]
    saved, other = stage.state, stage.copy()
    onwards = [stage.step(u).tolist() for u in walk(20, 2, 400.0)]
    assert [other.step(u).tolist() for u in walk(20, 2, 400.0)] == onwards
    stage.state = saved
    assert [stage.step(u).tolist() for u in walk(20, 2, 400.0)] == onwards
    stage.reset()
    assert [stage.step(u).tolist() for u in walk(10, 2, 500.0)] == first
    with pytest.raises(ValueError, match=r"^state: expected the coupling and the number"):
        mh.plant.MultiAxisPlant(plants(2, 0.016), np.eye(2)).state = saved


# ---- the controller


def test_with_the_identity_every_axis_is_a_single_controller() -> None:
    axes, single = mh.control.MultiAxisController(controllers(2)), controllers(2)
    references, measurements = walk(100, 2, 3.0), walk(100, 2, 3.0)
    measurements[7, 1] = references[9, 0] = math.nan
    for r, y in zip(references, measurements, strict=True):
        assert axes.step(r, y).tolist() == [
            one.step(*z) for one, *z in zip(single, r, y, strict=True)
        ]
    assert [one.state for one in axes.controllers] == [one.state for one in single]
    assert axes.missing_count.tolist() == [0, 1] and axes.rejected_count.tolist() == [1, 0]


def test_arrays_are_bit_for_bit_like_steps() -> None:
    references, measurements = walk(50, 2, 3.0), walk(50, 2, 3.0)
    by_steps = made()
    drives = np.array([by_steps.step(r, y) for r, y in zip(references, measurements, strict=True)])
    for out in (
        None,
        np.empty((50, 2)),
        np.empty((2, 50)).T,
        "references",
        "measurements",
        "overlap",
    ):
        axes, r, y = made(), references.copy(), measurements.copy()
        if isinstance(out, str) and out == "overlap":
            both = np.empty((51, 2))
            both[:50] = r
            r, out = both[:50], both[1:]
        elif isinstance(out, str):
            out = {"references": r, "measurements": y}[out]
        got = axes.run(r, y, out=out)
        assert out is None or got is out
        assert np.array_equal(got, drives)
        assert axes.state == by_steps.state


def test_a_plan_is_a_step_when_it_is_committed() -> None:
    one, other, out = made(), made(), np.empty(2)
    for r, y in zip(walk(20, 2, 3.0), walk(20, 2, 2.0), strict=True):
        before = one.state
        peeked = one.peek(r, y)
        assert one.plan(r, y, out) is out
        assert one.state == before
        assert one.commit() and not one.commit()
        row = r.copy()
        assert other.step(row, y, out=row) is row
        assert row.tolist() == out.tolist() == peeked.tolist() == one.drive.tolist()
        assert one.state == other.state


def test_targets_and_volts_are_those_of_the_axes_and_of_the_actuators() -> None:
    single = controllers(2, kp=0.0, ki=0.0, bumpless_time=0.0)
    decoupling = np.linalg.inv(CROSSTALK)
    axes = mh.control.MultiAxisController(single, decoupling)
    for _ in range(2):
        drives = axes.step([0.0, 0.0], [0.0, 0.0], targets=[1.0, 0.5])
        wanted = decoupling @ [1.0, 0.5]
        twin = [one.step(0.0, 0.0, target=y) for one, y in zip(single, wanted, strict=True)]
    np.testing.assert_allclose(drives, twin, rtol=0, atol=1e-9)
    assert axes.step([0.0, 0.0], [0.0, 0.0], feedforward=[30.0, 40.0]).tolist() == [30.0, 40.0]


def test_a_bad_reading_stays_with_the_actuators_that_need_it() -> None:
    axes = mh.control.MultiAxisController(controllers(2), [[1.0, 0.0], [0.2, 1.0]])
    axes.step([1.0, 1.0], [0.0, math.nan])
    assert axes.missing_count.tolist() == [0, 1]
    axes.step([1.0, 1.0], [math.inf, 0.0])
    assert axes.missing_count.tolist() == [1, 2]


def test_all_axes_hold_and_stop_together() -> None:
    axes = made()
    for _ in range(100):
        drives = axes.step([1.0, 0.5], [0.0, 0.0])
    axes.hold = True
    assert axes.hold and axes.step([3.0, 3.0], [0.0, 0.0]).tolist() == drives.tolist()
    axes.hold = False
    with pytest.raises(ValueError, match=r"^rest_drives\[1\]: expected a number from -560.0 to"):
        axes.stop(1e7, [0.0, 561.0])
    axes.stop(1e7, [5.0, -5.0])
    for _ in range(20):
        drives = axes.step([math.nan, 0.0], [math.nan, 0.0])
    assert drives.tolist() == [5.0, -5.0]
    axes.stop(1e7)
    for _ in range(20):
        drives = axes.step([0.0, 0.0], [0.0, 0.0])
    assert drives.tolist() == axes.drive.tolist() == [0.0, 0.0]
    axes.start_at([7.0, 8.0])
    assert axes.drive.tolist() == [7.0, 8.0]
    axes.reset()
    assert axes.step([1.0, 1.0], [0.0, 0.0]).tolist() == [7.0, 8.0]
