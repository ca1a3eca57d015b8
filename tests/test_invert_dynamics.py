"""Feed-forward through inverse dynamics: over whole records, and by a window of references."""

from __future__ import annotations

import math
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support import Array

DT = 1e-4
A1 = mh.plant.SecondOrder(400.0, 0.95)
LIGHT = mh.plant.SecondOrder(800.0, 0.02)
MODEL = mh.paper.table_1_recovered()
P3: dict[str, Any] = {"dynamics": mh.plant.SecondOrder(2000.0, 0.03), "amplifier_bandwidth": 279.0}

frequencies = st.floats(50.0, 3000.0)
modes = st.builds(mh.plant.SecondOrder, frequencies, st.floats(0.01, 1.5))
linear_parts = st.builds(mh.plant.FirstOrder, frequencies) | modes | st.tuples(modes, modes)


def rows(dynamics: Any, inputs: Array, dead_time: float = 0.0) -> Array:
    """The positions that are read as the inputs are put out."""
    stage = mh.Stage(mh.PrandtlIshlinskii([1.0], [0.0]), dynamics=dynamics, dead_time=dead_time)
    return stage.forward(DT).run(inputs)


def smooth(samples: int, frequency: float = 20.0) -> Array:
    """A motion that begins at rest."""
    motion: Array = 1.0 - np.cos(2 * np.pi * frequency * DT * np.arange(samples))
    return motion


# ---- over whole records


@given(linear_parts, st.integers(0, 5))
def test_the_position_behind_the_inputs_is_the_reference(part: Any, delay: int) -> None:
    reference = smooth(1500)
    part = list(part) if isinstance(part, tuple) else part
    inputs = mh.control.invert_dynamics(reference, DT, dynamics=part, dead_time=delay * DT)
    missed = np.abs(rows(part, inputs, delay * DT) - reference)
    # Its acceleration begins with a step. The smoothing rounds it over a few samples; slow modes
    # need large inputs, which the smoothing makes dearer.
    assert missed[delay + 100 : -50].max() < 2e-3


@pytest.mark.parametrize("dynamics", [A1, LIGHT])
def test_a_triangle_is_followed_and_does_not_ring(dynamics: mh.plant.SecondOrder) -> None:
    reference = mh.signals.triangle(35.0, 10.0, seconds=0.5, rate=1 / DT)
    inputs = mh.control.invert_dynamics(reference, DT, dynamics=dynamics)
    missed = rows(dynamics, inputs) - reference
    # 0.005 % of 100 um, after the start.
    assert np.sqrt(np.mean(missed[200:-20] ** 2)) < 5e-3
    assert np.abs(np.diff(inputs)).max() < 5.0


def test_the_sines_of_the_benchmark() -> None:
    for frequency in (5.0, 20.0, 100.0):
        reference = 3.3 * smooth(6000, frequency)
        inputs = mh.control.invert_dynamics(reference, DT, dynamics=A1)
        assert np.abs(rows(A1, inputs) - reference)[500:-50].max() < 5e-4  # um


def test_inputs_begin_where_the_dynamics_rest() -> None:
    reference = 5.0 + smooth(300)
    inputs = mh.control.invert_dynamics(reference, DT, dynamics=A1, start=5.0)
    assert inputs[0] == pytest.approx(5.0, abs=0.05)
    assert np.array_equal(inputs, mh.control.invert_dynamics(reference, DT, dynamics=A1))


def test_trajectories_are_sampled() -> None:
    scan = mh.trajectories.RoundedTriangle(3.0, 10.0, corner=0.01)
    got = mh.control.invert_dynamics(scan, DT, **P3)
    assert np.array_equal(got, mh.control.invert_dynamics(scan.sample(DT)[0], DT, **P3))


def test_precompensate_is_that_of_the_stage() -> None:
    stage = mh.Stage(MODEL, dynamics=A1, limits=(-500.0, 500.0))
    reference = smooth(500)
    drive = mh.control.precompensate(stage, reference, DT)
    assert np.array_equal(drive, stage.precompensate(reference, DT))
    assert np.abs(stage.forward(DT).run(drive) - reference)[100:].max() < 1e-3


# ---- by a window of references


@given(modes, st.lists(st.floats(-3.0, 3.0), min_size=1, max_size=4), st.integers(2, 8))
def test_preview_follows_polynomials_exactly(
    mode: mh.plant.SecondOrder, cubic: list[float], ahead: int
) -> None:
    made = mh.control.preview(mode, DT, ahead=ahead)
    # of order one over the record, so that no derivative dwarfs the others
    polynomial = np.polynomial.Polynomial(cubic)(np.polynomial.Polynomial([0.0, 1e-3]))
    settled = round(30.0 / (2 * np.pi * mode.frequency * min(mode.damping, 0.3)) / DT)
    k = np.arange(settled + 50)
    window = k[:, None] + ahead - np.arange(made.coefficients.size)
    # From far behind: the polynomial has been followed for ever.
    held = polynomial(window - settled) @ made.coefficients
    missed = np.abs(rows(mode, held) - polynomial(k - settled))[-20:]
    scale = np.abs(made.coefficients).sum() * np.abs(polynomial(window - settled)).max()
    assert missed.max() < 1e-6 * (1.0 + scale)


PREVIEW_ERRORS = [
    # ahead, then at most so much at 1, 20 and 100 Hz: the table of PreviewCoefficients
    (A1, None, 2, (2e-12, 2e-7, 1e-4)),
    (A1, None, 4, (2e-12, 4e-11, 4e-7)),
    (A1, None, 8, (2e-12, 4e-11, 6e-7)),
    (P3["dynamics"], 279.0, 4, (2e-12, 1e-12, 1e-8)),
    (LIGHT, None, 4, (2e-12, 1e-11, 1e-7)),
]


@pytest.mark.parametrize(("dynamics", "bandwidth", "ahead", "limits"), PREVIEW_ERRORS)
def test_errors_of_preview_are_as_documented(
    dynamics: mh.plant.SecondOrder,
    bandwidth: float | None,
    ahead: int,
    limits: tuple[float, ...],
) -> None:
    made = mh.control.preview(dynamics, DT, ahead=ahead, amplifier_bandwidth=bandwidth)
    for frequency, limit in zip((1.0, 20.0, 100.0), limits, strict=True):
        assert made.error(frequency) < limit


def test_the_error_of_a_preview_is_that_of_a_sine() -> None:
    made = mh.control.preview(A1, DT, ahead=2)
    frequency = 300.0
    t = DT * np.arange(4000)
    r = np.sin(2 * np.pi * frequency * t)
    window = np.arange(4000)[:, None] + made.ahead - np.arange(made.coefficients.size)
    held = np.sin(2 * np.pi * frequency * DT * window) @ made.coefficients
    missed = (rows(A1, held) - r)[2000:]
    assert np.abs(missed).max() == pytest.approx(made.error(frequency), rel=0.02)


good: dict[str, Any] = {"reference": np.zeros(20), "dt": DT, "dynamics": A1}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"reference": [0.0, math.nan] * 9}, "reference[1]: expected a finite number"),
        ({"reference": np.zeros((4, 4))}, "reference: expected a one-dimensional array"),
        ({"dt": 0.0}, "dt: expected a finite number above 0"),
        ({"dt": math.nan}, "dt: expected a finite number above 0"),
        ({"dead_time": -1.0}, "dead_time: expected"),
        ({"start": math.inf}, "start: expected a finite number"),
        ({"amplifier_bandwidth": 0.0}, "amplifier_bandwidth: expected a finite number above 0"),
        ({"seconds": 1.0}, "seconds: expected None for samples"),
    ],
)
def test_wrong_arguments_are_named(change: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError) as caught:
        mh.control.invert_dynamics(**{**good, **change})
    assert str(caught.value).startswith(message) and ", got " in str(caught.value)


def test_wrong_kinds_are_named() -> None:
    with pytest.raises(TypeError, match=r"^dynamics: expected FirstOrder, SecondOrder"):
        mh.control.invert_dynamics(np.zeros(20), DT, dynamics=400.0)  # type: ignore[arg-type]
    wrong = mh.Stage(mh.PrandtlIshlinskii([1.0, -2.0], [0.0, 1.0]))
    with pytest.raises(mh.NotInvertibleError):
        mh.control.precompensate(wrong, np.zeros(20), DT)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"ahead": 1001}, "ahead: expected at most 1000 samples, got 1001"),
        ({"ahead": -1}, "ahead: expected a number of samples, got -1"),
        ({"ahead": 4, "window": 4}, "window: expected more references than lie ahead, got 4"),
        ({"degree": 8}, "degree: expected less than the number of references in the window"),
        ({"band": 0.0}, "band: expected a frequency above 0"),
    ],
)
def test_wrong_windows_are_named(change: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError) as caught:
        mh.control.preview(A1, DT, **{"ahead": 4, **change})
    assert str(caught.value).startswith(message)
