"""Test signals: their samples, and arguments that no signal can have."""

from __future__ import annotations

import math
from collections.abc import Callable

import mpi_hyst as mh
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpi_hyst import signals
from support import Array

PERIODIC = [signals.sine, signals.triangle]


def test_sine_is_the_sine() -> None:
    t = np.arange(2500) / 1000.0
    expected = 7.0 + 3.0 * np.sin(2 * np.pi * 4.0 * t)
    got = signals.sine(3.0, 4.0, seconds=2.5, rate=1000.0, offset=7.0)
    # the phase reaches 63 rad, known to 1e-14
    np.testing.assert_allclose(got, expected, rtol=0, atol=1e-13)


def test_triangle_has_straight_sides_and_the_stated_slope() -> None:
    got = signals.triangle(3.0, 0.5, seconds=4.0, rate=100.0, offset=-1.0)
    t = np.arange(400) / 100.0
    expected = np.interp(t, [0.0, 0.5, 1.5, 2.5, 3.5, 4.0], [-1.0, 2.0, -4.0, 2.0, -4.0, -1.0])
    np.testing.assert_allclose(got, expected, rtol=0, atol=1e-14)  # phase below 4 cycles


def test_decaying_triangle_shrinks_to_nothing_and_demagnetises() -> None:
    u = signals.decaying_triangle(500.0, 1.0, cycles=40, rate=1000.0)
    assert u.shape == (40_000,)
    assert np.array_equal(u[:1000], signals.triangle(500.0, 1.0, seconds=1.0, rate=1000.0))
    peaks = np.abs(u.reshape(40, 1000)).max(axis=1)
    assert np.all(np.diff(peaks[1:]) < 0.0) and peaks[-1] < 10.0
    actuator = mh.paper.table_1_recovered().forward()
    unknown = abs(actuator.run([500.0, 0.0])[-1])
    actuator.run(u)
    assert abs(actuator.step(0.0)) < 0.01 * unknown


@given(st.floats(0.0, 1e3), st.floats(0.1, 100.0), st.floats(0.0, 0.5), st.floats(-100.0, 100.0))
def test_signals_start_at_their_offset_and_keep_within_their_swing(
    amplitude: float, frequency: float, seconds: float, offset: float
) -> None:
    made = [f(amplitude, frequency, seconds=seconds, rate=1e3, offset=offset) for f in PERIODIC]
    cycles = seconds * frequency
    made.append(
        signals.decaying_triangle(amplitude, frequency, cycles=cycles, rate=1e3, offset=offset)
    )
    for samples in made:
        assert samples.dtype == np.float64 and samples.flags.c_contiguous
        assert abs(samples.size - 1e3 * seconds) <= 0.5 + 1e-6
        assert samples.size == 0 or samples[0] == offset
        # offset + amplitude x (at most 1), rounded
        assert np.all(np.abs(samples - offset) <= amplitude + 1e-12 * (amplitude + abs(offset)))


def test_the_default_rate_is_10_khz() -> None:
    assert signals.sine(1.0, 1.0, seconds=0.5).size == 5000
    assert signals.triangle(1.0, 1.0, seconds=0.5).size == 5000
    assert signals.decaying_triangle(1.0, 2.0, cycles=3).size == 15_000


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: signals.sine(1, 1, seconds=1, rate=0), "rate: expected a finite number above 0"),
        (lambda: signals.sine(1, 1, seconds=1, rate=math.inf), "rate: expected a finite number"),
        (lambda: signals.sine(1, -1, seconds=1), "frequency: expected a finite number above 0"),
        (lambda: signals.sine(math.nan, 1, seconds=1), "amplitude: expected a finite number"),
        (lambda: signals.triangle(1, 1, seconds=-1), "seconds: expected a finite number, 0"),
        (lambda: signals.triangle(1, 1, seconds=math.nan), "seconds: expected a finite number"),
        (lambda: signals.triangle(1, 1, seconds=1e12), "seconds: expected at most"),
        (lambda: signals.triangle(1, 1, seconds=1, offset=math.inf), "offset: expected a finite"),
        (lambda: signals.decaying_triangle(1, 1, cycles=-2), "cycles: expected a finite number, 0"),
        (lambda: signals.decaying_triangle(1, 0, cycles=2), "frequency: expected a finite"),
    ],
)
def test_what_no_signal_can_have_is_named(make: Callable[[], Array], message: str) -> None:
    with pytest.raises(ValueError, match=f"^{message}.*, got "):
        make()
