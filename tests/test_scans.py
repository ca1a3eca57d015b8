"""Rasters, spirals and Lissajous figures: laws of what they sample, and a stage that follows."""

from __future__ import annotations

import copy
import math
import pickle
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpi_hyst.trajectories import Lissajous, Raster, Spiral
from scipy.integrate import cumulative_simpson

centers = st.tuples(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0))
rasters = st.builds(
    lambda width, height, lines, rate, share, to_and_fro, steps, center: Raster(
        width,
        height,
        lines,
        line_rate=rate,
        turnaround=share,
        bidirectional=to_and_fro,
        steps=steps,
        center=center,
    ),
    *(st.floats(1.0, 50.0), st.floats(0.0, 50.0), st.integers(1, 8), st.floats(0.5, 200.0)),
    *(st.floats(0.05, 0.9), st.booleans(), st.booleans(), centers),
)
spirals = st.builds(
    lambda radius, turns, rate, inner, center: Spiral(
        radius, radius / turns, **rate, inner_radius=inner * radius, center=center
    ),
    *(st.floats(1.0, 20.0), st.floats(1.0, 30.0)),
    st.builds(lambda f: {"frequency": f}, st.floats(0.5, 200.0))
    | st.builds(lambda v: {"speed": v}, st.floats(1.0, 1e3)),
    *(st.floats(0.05, 0.5), centers),
)
figures = st.builds(
    lambda ax, ay, fx, ratio, seconds, phase, center: Lissajous(
        (ax, ay), (fx, ratio * fx), seconds=seconds / fx, phase=phase, center=center
    ),
    *(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0), st.floats(0.5, 200.0), st.floats(0.5, 2.0)),
    *(st.floats(0.0, 5.0), st.floats(-math.pi, math.pi), centers),
)
Scan = Raster | Spiral | Lissajous


def fastest(scan: Scan) -> float:
    """How long the shortest of what a scan does takes, in seconds."""
    if isinstance(scan, Raster):
        sweep = (1.0 if scan.bidirectional else 0.5) / scan.line_rate
        return sweep * scan.turnaround
    if isinstance(scan, Lissajous):
        return 0.25 / max(scan.frequencies)
    if scan.speed is None:
        assert scan.frequency is not None
        return 0.25 / scan.frequency
    return min(scan.pitch, scan.inner_radius) / scan.speed


@given(rasters | spirals | figures)
def test_velocity_and_position_are_integrals_from_rest(scan: Scan) -> None:
    dt = min(fastest(scan) / 100.0, scan.duration / 500)
    samples = min(math.ceil(scan.duration / dt), 40_000)
    for axis, center in zip((scan.x, scan.y), scan.center, strict=True):
        position, velocity, acceleration = axis.sample(dt, samples * dt)
        assert velocity[0] == acceleration[0] == 0.0
        for below, above in ((position, velocity), (velocity, acceleration)):
            integral = below[0] + cumulative_simpson(above, dx=dt, initial=0.0)
            # Simpson's rule errs where the third derivative jumps
            scale = np.abs(below - below[0]).max() + abs(center) * 1e-9 + 1e-12
            assert np.abs(integral - below).max() <= 1e-3 * scale


@given(rasters | spirals | figures, st.integers(1, 500))
def test_axes_have_the_same_times_and_end_at_rest(scan: Scan, parts: int) -> None:
    dt = scan.duration / parts
    x, y = scan.x.sample(dt), scan.y.sample(dt)
    assert len({array.size for array in (*x, *y)}) == 1
    for _, velocity, acceleration in (x, y):
        assert velocity[0] == velocity[-1] == acceleration[0] == acceleration[-1] == 0.0
    assert scan.x.duration == scan.y.duration == scan.duration


@given(rasters)
def test_an_image_can_be_made_of_the_lines(raster: Raster) -> None:
    dt = raster.line_duration / 20.3
    x, velocity, acceleration = raster.x.sample(dt)
    y = raster.y.sample(dt)[0]
    trace, retrace = raster.line_index(dt), raster.line_index(dt, retrace=True)
    assert trace.size == x.size and trace.dtype == np.int64
    pitch = raster.height / raster.lines
    for index, sign in ((trace, 1.0), (retrace, -1.0)):
        if raster.bidirectional and sign < 0.0:
            assert np.all(index == -1)
            continue
        assert set(index[index >= 0]) == set(range(raster.lines))
        for line in range(raster.lines):
            there = index == line
            assert 20 <= np.count_nonzero(there) <= 21
            assert np.all(np.diff(np.flatnonzero(there)) == 1)
            way = (-1.0) ** line if raster.bidirectional else sign
            np.testing.assert_allclose(velocity[there], way * raster.speed, rtol=1e-9)
            np.testing.assert_allclose(np.abs(acceleration[there]).max(), 0.0, atol=1e-3)
            inside = np.abs(x[there] - raster.center[0])
            assert inside.max() <= raster.width / 2 * (1 + 1e-9)
            middle = raster.center[1] - raster.height / 2 + (line + 0.5) * pitch
            assert np.abs(y[there] - middle).max() <= 0.5 * pitch + 1e-9
            if raster.steps:
                np.testing.assert_allclose(y[there], middle, atol=1e-9)
    reach = np.abs(x - raster.center[0]).max()
    assert reach <= (raster.width / 2 + raster.overscan) * (1 + 1e-12)
    assert np.abs(velocity).max() <= raster.speed * (1 + 1e-12)
    assert np.abs(acceleration).max() <= raster.acceleration * (1 + 1e-12)


def test_a_raster_is_what_its_equations_say() -> None:
    raster = Raster(10.0, 8.0, 4, line_rate=5.0, turnaround=0.2)
    assert raster.speed == 125.0 and raster.line_duration == pytest.approx(0.08)
    assert raster.overscan == pytest.approx(11 / 32 * 125.0 * 0.02)
    assert raster.acceleration == pytest.approx(15 / 4 * 125.0 / 0.02)
    # 8 sweeps, the last without its turn, and 11/16 of a turn at both ends
    assert raster.duration == pytest.approx(0.8 - 0.02 + 2 * 0.02 * 11 / 16)
    _, velocity, _ = raster.y.sample(1e-4)
    assert np.abs(velocity).max() == pytest.approx(8.0 / 0.8)


@given(spirals)
def test_a_spiral_has_one_rate_between_its_inner_radius_and_its_end(spiral: Spiral) -> None:
    dt = spiral.duration / 1000
    (x, vx, _), (y, vy, _) = spiral.x.sample(dt), spiral.y.sample(dt)
    x, y = x - spiral.center[0], y - spiral.center[1]
    r, time = np.hypot(x, y), np.arange(x.size) * dt
    there = (time >= spiral.steady[0]) & (time <= spiral.steady[1])
    if spiral.speed is not None:
        assert spiral.frequency is None
        np.testing.assert_allclose(np.hypot(vx, vy)[there], spiral.speed, rtol=1e-9)
    else:
        assert spiral.frequency is not None
        rate = (x * vy - y * vx)[there] / r[there] ** 2
        np.testing.assert_allclose(rate, 2 * np.pi * spiral.frequency, rtol=1e-6)
    assert r[there].min(initial=np.inf) >= spiral.inner_radius * (1 - 1e-9)
    assert r.max() == pytest.approx(spiral.radius, rel=1e-9)
    # the angle grows by a turn per pitch
    theta = 2 * np.pi * r / spiral.pitch
    np.testing.assert_allclose(r * np.cos(theta), x, atol=1e-9 * spiral.radius)
    np.testing.assert_allclose(r * np.sin(theta), y, atol=1e-9 * spiral.radius)


@given(st.floats(1.0, 20.0), st.floats(4.0, 200.0), st.floats(1.0, 1e3), st.floats(0.05, 0.5))
def test_a_fast_spiral_is_gentle_at_its_centre(
    radius: float, turns: float, speed: float, inner: float
) -> None:
    spiral = Spiral(radius, radius / turns, speed=speed, inner_radius=inner * radius)
    dt = spiral.duration / 5000
    acceleration = np.hypot(spiral.x.sample(dt)[2], spiral.y.sample(dt)[2])
    factor = 1.2 if spiral.inner_radius >= spiral.pitch else 1.5
    assert acceleration.max() <= factor * speed**2 / spiral.inner_radius


@given(figures)
def test_a_figure_is_its_sines(figure: Lissajous) -> None:
    dt = figure.duration / 700
    begin, end = figure.steady
    time = np.arange(701) * dt
    there = (time >= begin) & (time <= end)
    phases = (figure.phase, 0.0)
    for i, axis in enumerate((figure.x, figure.y)):
        position, velocity, acceleration = axis.sample(dt)
        a, w = figure.amplitudes[i], 2 * np.pi * figure.frequencies[i]
        expected = figure.center[i] + a * np.sin(w * (time[there] - begin) + phases[i])
        np.testing.assert_allclose(position[there], expected, rtol=0, atol=1e-10)
        assert np.abs(position - figure.center[i]).max() <= abs(a) * (1 + 1e-12) + 1e-12
        assert np.abs(velocity).max() <= abs(a) * w * (1 + 1e-12)
        assert np.abs(acceleration).max() <= 1.04 * abs(a) * w**2


def test_a_stage_follows_every_axis() -> None:
    stage = mh.Stage(
        mh.paper.table_1_recovered(),
        limits=(-500.0, 500.0),
        dynamics=mh.plant.SecondOrder(900.0, 0.05),
    )
    scans: list[Scan] = [
        Raster(2.0, 1.0, 4, line_rate=20.0),
        Raster(2.0, 1.0, 4, line_rate=20.0, steps=True, bidirectional=True),
        Spiral(1.0, 0.1, speed=20.0),
        Spiral(1.0, 0.1, frequency=20.0),
        Lissajous((1.0, 1.0), (31.0, 30.0), seconds=0.2),
    ]
    dt = 1e-4
    for axis in [axis for scan in scans for axis in (scan.x, scan.y)]:
        wanted = axis.sample(dt)[0]
        drive = stage.precompensate(axis, dt, lead_in=0.1)
        np.testing.assert_array_equal(drive, stage.precompensate(wanted, dt, lead_in=0.1))
        position = stage.forward(dt).run(drive)[-wanted.size :]
        assert np.abs(position - wanted).max() < 1e-3, axis


VALUES: list[Any] = [
    Raster(3.0, 2.0, 4, line_rate=1.0),
    Raster(3.0, 2.0, 4, line_rate=1.0, turnaround=0.3),
    Raster(3.0, 2.0, 4, line_rate=1.0, steps=True),
    Raster(3.0, 2.0, 4, line_rate=1.0, bidirectional=True, center=(1.0, 2.0)),
    Spiral(3.0, 0.5, speed=2.0),
    Spiral(3.0, 0.5, frequency=2.0),
    Spiral(3.0, 0.5, frequency=2.0, inner_radius=0.6, center=(1.0, 2.0)),
    Lissajous((3.0, 2.0), (1.0, 1.5), seconds=1.0),
    Lissajous((3.0, 2.0), (1.0, 1.5), seconds=1.0, phase=0.5, lead_in=3.0, center=(1.0, 2.0)),
]
VALUES += [axis for scan in VALUES for axis in (scan.x, scan.y)]


@pytest.mark.parametrize("value", VALUES, ids=repr)
def test_scans_compare_hash_pickle_and_show_themselves(value: Any) -> None:
    for again in (pickle.loads(pickle.dumps(value)), copy.deepcopy(value)):
        assert again == value and hash(again) == hash(value)
    assert sum(value == other for other in VALUES) == 1
    assert eval(repr(value), vars(mh.trajectories)) == value
    if isinstance(value, mh.trajectories.ScanAxis):
        assert getattr(value.scan, value.name) == value


RASTER: dict[str, Any] = {"width": 3.0, "height": 2.0, "lines": 4, "line_rate": 1.0}
SPIRAL: dict[str, Any] = {"radius": 3.0, "pitch": 0.5, "speed": 2.0}
FIGURE: dict[str, Any] = {"amplitudes": (3.0, 2.0), "frequencies": (1.0, 1.5), "seconds": 1.0}


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Raster(**{**RASTER, "width": math.nan}), "width: expected a finite number above"),
        (lambda: Raster(**{**RASTER, "height": -1.0}), "height: expected a finite number, 0 or m"),
        (
            lambda: Raster(**{**RASTER, "lines": 0}),
            "lines: expected a whole number of at least one",
        ),
        (lambda: Raster(**{**RASTER, "lines": 2**40}), "lines: expected 1 to 2^27"),
        (lambda: Raster(**{**RASTER, "line_rate": 0.0}), "line_rate: expected a finite number ab"),
        (lambda: Raster(**RASTER, turnaround=1.0), "turnaround: expected a share above 0 and bel"),
        (lambda: Raster(**RASTER, center=(0.0, math.inf)), "center: expected a finite number"),
        (lambda: Raster(**RASTER).x.sample(1e-9), "dt: expected at most 134217728 samples (2^27)"),
        (lambda: Raster(**RASTER).line_index(1e-9), "dt: expected at most 134217728 samples"),
        (lambda: Raster(**RASTER).line_index(0.0), "dt: expected a finite number above 0"),
        (lambda: Spiral(**{**SPIRAL, "radius": 0.0}), "radius: expected a finite number above 0"),
        (lambda: Spiral(**{**SPIRAL, "pitch": 4.0}), "pitch: expected at most the radius, 3.0"),
        (lambda: Spiral(**{**SPIRAL, "speed": -1.0}), "speed: expected a finite number above 0"),
        (lambda: Spiral(3.0, 0.5, frequency=0.0), "frequency: expected a finite number above 0"),
        (lambda: Spiral(**SPIRAL, frequency=1.0), "frequency: expected a frequency or a speed"),
        (lambda: Spiral(3.0, 0.5), "frequency: expected a frequency or a speed, got neither"),
        (lambda: Spiral(**SPIRAL, inner_radius=2.0), "inner_radius: expected above 0, at most"),
        (
            lambda: Lissajous(**{**FIGURE, "amplitudes": (math.nan, 1.0)}),
            "amplitudes: expected a finite number",
        ),
        (
            lambda: Lissajous(**{**FIGURE, "frequencies": (1.0, 0.0)}),
            "frequencies: expected a finite number above 0",
        ),
        (
            lambda: Lissajous(**{**FIGURE, "seconds": -1.0}),
            "seconds: expected a finite number, 0 or more",
        ),
        (lambda: Lissajous(**FIGURE, lead_in=0.0), "lead_in: expected a finite number above 0"),
        (lambda: Lissajous(**FIGURE, phase=math.inf), "phase: expected a finite number"),
    ],
)
def test_what_no_scan_can_have_is_named(make: Any, message: str) -> None:
    with pytest.raises(ValueError) as caught:
        make()
    assert str(caught.value).startswith(message) and ", got " in str(caught.value)
    assert caught.value.parameter == message.split(":")[0]  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Raster("3", 2.0, 4, line_rate=1.0), "width: expected a number, got '3'"),  # type: ignore[arg-type]
        (lambda: Raster(**{**RASTER, "center": 1.0}), "center: expected two numbers (x, y)"),
        (lambda: Spiral(**{**SPIRAL, "center": (1, 2, 3)}), "center: expected two numbers (x, y)"),
        (
            lambda: Lissajous(**{**FIGURE, "amplitudes": 3.0}),
            "amplitudes: expected two numbers (x, y), got 3.0",
        ),
        (
            lambda: Lissajous(**{**FIGURE, "frequencies": "ab"}),
            "frequencies: expected two numbers (x, y), got 'ab'",
        ),
    ],
)
def test_what_is_of_another_kind_is_named(make: Any, message: str) -> None:
    with pytest.raises(TypeError) as caught:
        make()
    assert str(caught.value).startswith(message)
