"""Feed-forward through inverse dynamics: what it makes exact, and what it leaves behind."""

from __future__ import annotations

import math
import warnings
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support import Array

DT = 1e-4
A1 = mh.plant.SecondOrder(400.0, 0.95)
MODEL = mh.paper.table_1_recovered()
P3: dict[str, Any] = {"dynamics": mh.plant.SecondOrder(2000.0, 0.03), "amplifier_bandwidth": 279.0}

frequencies = st.floats(50.0, 4000.0)


def terms(dynamics: mh.plant.SecondOrder | mh.plant.FirstOrder | None, pole: float | None) -> Array:
    """1, a_1, a_2, a_3 of the inverse, from the equations."""
    inverse = np.array([1.0])
    if isinstance(dynamics, mh.plant.SecondOrder):
        w = 2 * np.pi * dynamics.frequency
        inverse = np.array([1.0, 2 * dynamics.damping / w, 1 / w**2])
    elif dynamics is not None:
        inverse = np.array([1.0, dynamics.time_constant])
    if pole is not None:
        inverse = np.convolve(inverse, [1.0, 1 / (2 * np.pi * pole)])
    return inverse


def exact_target(inverse: Array, polynomial: np.polynomial.Polynomial, t: Array) -> Array:
    """1 + a_1 d/dt + .. of a polynomial of time."""
    total = np.zeros_like(t)
    for m, a in enumerate(inverse):
        total += a * (polynomial.deriv(m) if m else polynomial)(t)
    return total


linear_parts = st.tuples(
    st.none()
    | st.builds(mh.plant.FirstOrder, frequencies)
    | st.builds(mh.plant.SecondOrder, frequencies, st.floats(0.01, 2.0)),
    st.none() | frequencies,
    st.just(0.0) | st.floats(0.0, 6.0),
)
cubics = st.lists(st.floats(-3.0, 3.0), min_size=1, max_size=4)


# ---- samples


@given(linear_parts, cubics, st.integers(6, 20))
def test_the_shaped_target_of_a_polynomial_is_exact(
    part: tuple[Any, Any, float], cubic: list[float], window: int
) -> None:
    dynamics, pole, delay = part
    # of order one over the record, so that no derivative dwarfs the others
    polynomial = np.polynomial.Polynomial(cubic)(np.polynomial.Polynomial([0.0, 1 / (40 * DT)]))
    t = np.arange(40) * DT
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # short records of slow dynamics: followed, or not
        got = mh.control.invert_dynamics(
            polynomial(t),
            DT,
            dynamics=dynamics,
            amplifier_bandwidth=pole,
            delay=delay,
            window=window,
        )
    inverse = terms(dynamics, pole)
    aimed = np.minimum(t + (0.5 + delay) * DT, t[-1])
    expected = exact_target(inverse, polynomial, aimed)
    # the weights are a_m / dt^m, of which a rounding error is left
    scale = 10.0 * sum(a / DT**m for m, a in enumerate(inverse))
    np.testing.assert_allclose(got, expected, rtol=0, atol=1e-13 * scale * 4.0**3)


@given(linear_parts, cubics, st.integers(0, 8))
def test_preview_is_exact_for_polynomials(
    part: tuple[Any, Any, float], cubic: list[float], ahead: int
) -> None:
    dynamics, pole, delay = part
    made = mh.control.preview(dynamics, DT, ahead=ahead, amplifier_bandwidth=pole, delay=delay)
    polynomial = np.polynomial.Polynomial(cubic)(np.polynomial.Polynomial([0.0, 1 / (40 * DT)]))
    window = (made.ahead - np.arange(made.coefficients.size)) * DT
    inverse = terms(dynamics, pole)
    expected = exact_target(inverse, polynomial, np.array([(0.5 + delay) * DT]))[0]
    got = made.coefficients @ polynomial(window)
    # a rounding of every product
    tolerance = 1e-13 * np.abs(made.coefficients).sum() * (1.0 + np.abs(polynomial(window)).max())
    assert got == pytest.approx(expected, abs=tolerance)


def test_preview_and_samples_agree() -> None:
    r = np.cumsum(np.random.default_rng(5).normal(size=60))
    with pytest.warns(UserWarning, match="too rough"):
        targets = mh.control.invert_dynamics(r, DT, dynamics=A1)
    made = mh.control.preview(A1, DT, ahead=4)
    for k in range(4, 55):
        window = r[k + 4 - np.arange(8)]
        assert targets[k] == pytest.approx(made.coefficients @ window, abs=1e-10)


PREVIEW_ERRORS = [
    # ahead, then at most so much at 1, 20 and 100 Hz: the table of Shaper::preview
    (A1, None, 2, (2e-12, 1e-7, 6e-5)),
    (A1, None, 4, (2e-12, 3e-11, 3e-7)),
    (A1, None, 8, (2e-12, 4e-10, 5e-6)),
    (P3["dynamics"], 279.0, 2, (2e-12, 6e-9, 4e-6)),
    (P3["dynamics"], 279.0, 4, (2e-12, 3e-12, 1e-8)),
    (P3["dynamics"], 279.0, 8, (2e-12, 2e-11, 2e-7)),
]


@pytest.mark.parametrize(("dynamics", "pole", "ahead", "limits"), PREVIEW_ERRORS)
def test_errors_of_preview_are_as_documented(
    dynamics: mh.plant.SecondOrder, pole: float | None, ahead: int, limits: tuple[float, ...]
) -> None:
    made = mh.control.preview(dynamics, DT, ahead=ahead, amplifier_bandwidth=pole)
    lead = 0.5 * DT
    for frequency, limit in zip((1.0, 20.0, 100.0), limits, strict=True):
        s = 2j * np.pi * frequency
        window = np.exp(s * (made.ahead - np.arange(made.coefficients.size)) * DT)
        inverse = terms(dynamics, pole) @ s ** np.arange(3 if pole is None else 4)
        error = abs(made.coefficients @ window / (inverse * np.exp(s * lead)) - 1.0)
        assert made.error(frequency) == pytest.approx(error, abs=1e-13)
        assert error < limit
    # at 100 Hz the limit is that of truncation, no looser than needed
    assert error > 0.2 * limits[-1]


stages = st.floats(200.0, 1000.0) | st.tuples(st.floats(200.0, 1000.0), st.floats(0.2, 1.0))


@given(stages, st.integers(0, 5))
def test_dynamics_applied_to_the_shaped_target_reproduce_the_reference(
    stage: float | tuple[float, float], delay: int
) -> None:
    dynamics = (
        mh.plant.FirstOrder(stage) if isinstance(stage, float) else mh.plant.SecondOrder(*stage)
    )
    scan = mh.trajectories.Sine(1.0, 20.0)
    target = mh.control.invert_dynamics(scan, DT, dynamics=dynamics, delay=delay, seconds=0.3)
    position = dynamics.response(np.concatenate([np.zeros(delay), target]), DT)[: target.size]
    # the position that a target leads to is read at the next sample; 0.2 s fade the start
    missed = np.abs(position[2000:-1] - scan.sample(DT, 0.3)[0][2001:]).max()
    # z-transforms of exp(-p k) are 1 / (exp(q) - exp(-p)): relative to what dynamics and hold
    # promise the error is q (q + 2 p) / 24 of a lag, q^2 / 24 of two poles, and odd terms p^3 q
    q, p = 2 * np.pi * 20.0 * DT, 2 * np.pi * dynamics.frequency * DT
    lag = isinstance(dynamics, mh.plant.FirstOrder)
    assert missed < 1.1 * q * math.hypot(q, 2 * p if lag else 0.0) / 24 + 0.02 * q * p**3


# ---- the drive


def closed_loop(reference: Array, target: Array, noise: float = 0.0) -> Array:
    """Position of plant A1 at the sampling instants: exact inverse, kp 60, ki 0.6, 560 V."""
    w, zeta = 2 * np.pi * A1.frequency, A1.damping
    poles = np.exp((-zeta + np.array([1j, -1j]) * math.sqrt(1 - zeta**2)) * w * DT)
    # the recursion with these poles that has the step response of the block
    step = A1.response([1.0, 1.0], DT)
    a1, a2 = -poles.sum().real, poles.prod().real
    b1, b2 = step[0], step[1] - step[0] + a1 * step[0]
    inverse, actuator = MODEL.inverse((-560.0, 560.0)), MODEL.forward()
    noises = noise * np.random.default_rng(1).standard_normal(reference.size)
    y1 = y2 = v1 = v2 = total = 0.0
    positions = np.empty(reference.size)
    for k, (r, desired) in enumerate(zip(reference.tolist(), target.tolist(), strict=True)):
        positions[k] = b1 * v1 + b2 * v2 - a1 * y1 - a2 * y2
        error = r - float(positions[k]) - float(noises[k])
        total += error
        drive = min(max(inverse.step(desired) + 60.0 * error + 0.6 * total, -560.0), 560.0)
        y2, y1, v2, v1 = y1, float(positions[k]), v1, actuator.step(drive)
    return positions


@pytest.mark.parametrize("frequency", [5.0, 10.0, 15.0, 20.0, 50.0, 100.0])
def test_the_sines_of_the_benchmark_without_noise(frequency: float) -> None:
    scan, seconds = mh.trajectories.Sine(3.3, frequency), 0.6
    reference = scan.sample(DT, seconds)[0]
    target = mh.control.invert_dynamics(scan, DT, dynamics=A1, seconds=seconds)
    missed = np.abs(closed_loop(reference, target) - reference)
    # the sine starts with a velocity, which the integral of the feedback forgets within 0.3 s:
    # then the hold alone is left, (pi F dt)^2 / 6 of 3.3 um
    assert missed[3000:].max() < 0.02e-3 + 3.3 * (np.pi * frequency * DT) ** 2 / 6
    # as the table counts, after the first period: 4.9 nm at 100 Hz, of its 9.6 nm with noise
    first_period = round(1 / frequency / DT)
    assert missed[first_period:].max() < 5e-3
    plain = np.abs(closed_loop(reference, reference) - reference)
    assert plain[first_period:].max() > 100 * missed[first_period:].max()


def test_the_benchmark_with_noise() -> None:
    scan = mh.trajectories.Sine(3.3, 20.0)
    reference, target = (
        scan.sample(DT, 0.5)[0],
        mh.control.invert_dynamics(scan, DT, dynamics=A1, seconds=0.5),
    )
    missed = np.abs(closed_loop(reference, target, noise=0.016) - reference)
    # the table has 8.3 nm, its seed another: what is left is noise through the feedback
    assert missed[500:].max() < 12e-3


def test_precompensate_is_the_inverse_of_the_shaped_target() -> None:
    scan = mh.trajectories.RoundedTriangle(3.0, 10.0, corner=0.01)
    samples = scan.sample(DT)[0]
    limits = (-500.0, 500.0)
    for options in ({"dynamics": A1}, P3, {"delay": 1.5, "dynamics": A1}):
        for course in (scan, samples):
            drive = mh.control.precompensate(MODEL, course, DT, limits=limits, **options)
            target = mh.control.invert_dynamics(course, DT, **options)
            assert np.array_equal(drive, MODEL.inverse(limits).run(target))
    assert np.array_equal(
        mh.control.precompensate(MODEL, samples, DT), MODEL.inverse().run(samples)
    )
    assert np.array_equal(mh.control.precompensate(MODEL, scan, DT), MODEL.inverse().run(samples))


def test_samples_of_a_smooth_trajectory_shape_as_the_trajectory_does() -> None:
    scan = mh.trajectories.Sine(3.3, 20.0)
    exact, sampled = (
        mh.control.invert_dynamics(scan, DT, dynamics=A1),
        mh.control.invert_dynamics(scan.sample(DT)[0], DT, dynamics=A1),
    )
    inner = slice(4, -5)
    # truncation, 2e-11 of the target
    np.testing.assert_allclose(sampled[inner], exact[inner], rtol=0, atol=1e-9)
    # at the ends the window lies to one side
    np.testing.assert_allclose(sampled[:-1], exact[:-1], rtol=0, atol=1e-6)


def test_an_identification_gives_dynamics_and_delay() -> None:
    u = np.where(np.arange(500) < 10, 0.0, 400.0)
    y = mh.plant.SecondOrder(800.0, 0.05).response(MODEL.forward().run(u), dt=DT)
    found = mh.identify_dynamics(u, np.concatenate([[0.0, 0.0], y[:-2]]), MODEL, dt=DT)
    scan = mh.trajectories.Sine(1.0, 20.0)
    got = mh.control.invert_dynamics(scan, DT, dynamics=found)
    assert np.array_equal(
        got, mh.control.invert_dynamics(scan, DT, dynamics=found.dynamics, delay=found.delay)
    )
    without = mh.control.invert_dynamics(scan, DT, dynamics=found, delay=0.0)
    assert np.array_equal(without, mh.control.invert_dynamics(scan, DT, dynamics=found.dynamics))
    assert found.delay == pytest.approx(2.0, abs=1e-6)
    made = mh.control.preview(found, DT, ahead=6)
    assert made.coefficients.sum() == pytest.approx(1.0) and made.coefficients.size == 8
    with pytest.raises(ValueError, match=r"^dt: expected the sampling interval of the identific"):
        mh.control.invert_dynamics(scan, 2 * DT, dynamics=found)
    creeping = mh.identify_dynamics(u, y, MODEL, dt=DT, delay=0.0, creep=[0.01])
    with pytest.raises(ValueError, match=r"^dynamics: expected no creep"):
        mh.control.precompensate(MODEL, scan, DT, dynamics=creeping)
    mh.control.tune(MODEL, dt=DT, dynamics=creeping)


def test_what_is_too_rough_is_said() -> None:
    slow, fast = (mh.signals.triangle(3.0, f, seconds=2.0 / f) for f in (1.0, 500.0))
    mh.control.invert_dynamics(slow, DT, dynamics=A1)
    with pytest.warns(UserWarning, match="smoothed over 8 samples, and the position misses sample"):
        mh.control.precompensate(MODEL, fast, DT, dynamics=A1)


good: dict[str, Any] = {"trajectory": np.zeros(20), "dt": DT, "dynamics": A1}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"trajectory": [0.0, math.nan] * 9}, "trajectory[1]: expected a finite number"),
        ({"trajectory": np.zeros(5)}, "trajectory: expected at least as many samples as the wind"),
        ({"trajectory": np.zeros((4, 4))}, "trajectory: expected a one-dimensional array"),
        ({"dt": 0.0}, "dt: expected a finite number above 0"),
        ({"dt": math.nan}, "dt: expected a finite number above 0"),
        ({"window": 1}, "window: expected 2 to 1000 samples"),
        ({"window": 2}, "window: expected more samples than the order"),
        ({"window": -3}, "window: expected a number of samples"),
        ({"delay": -1.0}, "delay: expected 0 to 2^20 samples"),
        ({"amplifier_bandwidth": 0.0}, "amplifier_bandwidth: expected a finite number above 0"),
        ({"seconds": 1.0}, "seconds: expected None for samples"),
        (
            {"dynamics": mh.plant.SecondOrder(1e-90, 0.5), "dt": 1e-80},
            "dt: expected a sampling interval",
        ),
    ],
)
def test_wrong_arguments_are_named(change: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError) as caught:
        mh.control.invert_dynamics(**{**good, **change})
    assert str(caught.value).startswith(message) and ", got " in str(caught.value)


def test_wrong_kinds_are_named() -> None:
    with pytest.raises(
        TypeError, match=r"^dynamics: expected a SecondOrder, a FirstOrder or a Dyn"
    ):
        mh.control.invert_dynamics(np.zeros(20), DT, dynamics=400.0)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match=r"^model: expected a PrandtlIshlinskii or a Modified"):
        mh.control.precompensate("A1", np.zeros(20), DT)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"^seconds: expected a duration of 0 to"):
        mh.control.invert_dynamics(mh.trajectories.Sine(1.0, 1.0), DT, dynamics=A1, seconds=-1.0)
    wrong = mh.PrandtlIshlinskii([1.0, -2.0], [0.0, 1.0])
    with pytest.raises(mh.NotInvertibleError):
        mh.control.precompensate(wrong, np.zeros(20), DT)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"ahead": 1001}, "ahead: expected at most 1000 samples, got 1001"),
        ({"ahead": -1}, "ahead: expected a number of samples, got -1"),
        ({"ahead": 4, "window": 4}, "window: expected more references than lie ahead, got 4"),
        ({"degree": 8}, "degree: expected less than the number of references in the window"),
        ({"degree": 1}, "degree: expected at least 1 and the order of dynamics and amplifier"),
    ],
)
def test_wrong_windows_are_named(change: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError) as caught:
        mh.control.preview(A1, DT, **{"ahead": 4, **change})
    assert str(caught.value).startswith(message)
