"""References with their derivatives: laws of what they sample."""

from __future__ import annotations

import math
import pickle
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpi_hyst.trajectories import PointToPoint, RoundedTriangle, Sine

numbers = st.floats(-5.0, 5.0)
sines = st.builds(lambda a, f, o: Sine(a, f, offset=o), numbers, st.floats(0.5, 200.0), numbers)
triangles = st.builds(
    lambda a, f, share, o: RoundedTriangle(a, f, corner=share / f, offset=o),
    *(numbers, st.floats(0.5, 200.0), st.floats(0.05, 0.499), numbers),
)
moves = st.builds(
    lambda points, v, a, j, dwell: PointToPoint(
        points, velocity=v, acceleration=a, jerk=j, dwell=dwell
    ),
    st.lists(st.floats(-10.0, 10.0), min_size=1, max_size=4),
    *(st.floats(1.0, 1e3), st.floats(1e1, 1e6), st.floats(1e3, 1e9), st.floats(0.0, 0.1)),
)


@given(sines | triangles)
def test_derivatives_are_those_of_the_position(trajectory: Sine | RoundedTriangle) -> None:
    dt = trajectory.period / 2000
    position, velocity, acceleration = trajectory.sample(dt, 1.5 * trajectory.period)
    assert position.size == velocity.size == acceleration.size == 3000
    for below, above in ((position, velocity), (velocity, acceleration)):
        slope = (below[2:] - below[:-2]) / (2 * dt)
        # dt^2 / 6 of a third derivative: corners are at least 100 samples long, and smooth
        tolerance = 0.01 * np.abs(above).max() + 1e-12 / dt
        assert np.abs(slope - above[1:-1]).max() <= tolerance


def test_sine_is_the_sine() -> None:
    position, velocity, acceleration = Sine(3.0, 2.0, offset=1.0).sample(1e-3, 1.0)
    w, t = 4 * np.pi, np.arange(1000) * 1e-3
    np.testing.assert_allclose(position, 1.0 + 3.0 * np.sin(w * t), rtol=0, atol=1e-13)
    np.testing.assert_allclose(velocity, 3.0 * w * np.cos(w * t), rtol=0, atol=1e-12)
    np.testing.assert_allclose(acceleration, -3.0 * w * w * np.sin(w * t), rtol=0, atol=1e-11)


@given(triangles)
def test_a_rounded_triangle_keeps_within_its_swing_and_repeats(triangle: RoundedTriangle) -> None:
    position, velocity, _ = triangle.sample(triangle.period / 400, 2 * triangle.period)
    # the phase is known to a few roundings
    atol = 1e-12 * (1.0 + abs(triangle.amplitude) + abs(triangle.offset))
    np.testing.assert_allclose(position[400:], position[:400], rtol=0, atol=atol)
    assert position[100] == pytest.approx(triangle.offset + triangle.amplitude, abs=atol)
    assert np.abs(position - triangle.offset).max() <= abs(triangle.amplitude) + atol
    side = triangle.amplitude / (triangle.period / 4 - 5 / 32 * triangle.corner)
    assert np.abs(velocity).max() == pytest.approx(abs(side), rel=1e-12)


@given(moves, st.integers(1, 200))
def test_moves_stay_within_limits_and_end_exactly(trajectory: PointToPoint, parts: int) -> None:
    dt = max(trajectory.duration / parts, 1e-6)
    position, velocity, acceleration = trajectory.sample(dt)
    assert position[0] == trajectory.points[0] and position[-1] == trajectory.points[-1]
    assert velocity[-1] == 0.0 and acceleration[-1] == 0.0
    assert trajectory.points.min() <= position.min() and position.max() <= trajectory.points.max()
    assert np.abs(velocity).max() <= trajectory.velocity * (1 + 1e-12)
    assert np.abs(acceleration).max() <= trajectory.acceleration * (1 + 1e-12)
    assert np.abs(np.diff(acceleration)).max(initial=0.0) <= trajectory.jerk * dt * (1 + 1e-9)


def test_moves_rest_at_their_points() -> None:
    trajectory = PointToPoint([0, 3, 1], velocity=100, acceleration=1e4, jerk=1e6, dwell=0.1)
    position, velocity, _ = trajectory.sample(1e-3, 0.3)
    # 3 um at 100 um/s and twice 10 ms of jerk, then 0.1 s of rest
    assert np.all(position[50:150] == 3.0) and np.all(velocity[50:150] == 0.0)
    assert np.all(position[191:] == 1.0) and trajectory.duration == pytest.approx(0.19)


VALUES = [
    Sine(3.0, 1.0),
    Sine(3.0, 1.0, offset=0.5),
    RoundedTriangle(3.0, 1.0, corner=0.1),
    RoundedTriangle(3.0, 1.0, corner=0.2),
    PointToPoint([0.0, 1.0], velocity=1.0, acceleration=1.0, jerk=1.0),
    PointToPoint([0.0, 1.0], velocity=1.0, acceleration=1.0, jerk=1.0, dwell=0.5),
]


@pytest.mark.parametrize("value", VALUES, ids=repr)
def test_trajectories_compare_hash_pickle_and_show_themselves(value: Any) -> None:
    again = pickle.loads(pickle.dumps(value))
    assert again == value and hash(again) == hash(value)
    assert sum(value == other for other in VALUES) == 1
    assert eval(repr(value), vars(mh.trajectories)) == value


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Sine(math.nan, 1.0), "amplitude: expected a finite number"),
        (lambda: Sine(1.0, 0.0), "frequency: expected a finite number above 0"),
        (lambda: RoundedTriangle(1.0, 1.0, corner=0.6), "corner: expected at most half a period"),
        (lambda: PointToPoint([], velocity=1, acceleration=1, jerk=1), "points: expected at least"),
        (lambda: PointToPoint([0], velocity=0, acceleration=1, jerk=1), "velocity: expected a fin"),
        (
            lambda: PointToPoint([0], velocity=1, acceleration=1, jerk=1, dwell=-1),
            "dwell: expected a number of seconds",
        ),
        (lambda: Sine(1.0, 1.0).sample(0.0), "dt: expected a finite number above 0"),
        (lambda: Sine(1.0, 1.0).sample(1e-3, math.nan), "seconds: expected a number of seconds"),
    ],
)
def test_what_no_trajectory_can_have_is_named(make: Any, message: str) -> None:
    with pytest.raises(ValueError) as caught:
        make()
    assert str(caught.value).startswith(message) and ", got " in str(caught.value)
