"""Feed-forward through inverse dynamics: stable inversion of whole references, and previews."""

from __future__ import annotations

import math
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import signal
from support import Array

DT = 1e-4
A1 = mh.plant.SecondOrder(400.0, 0.95)
MODEL = mh.paper.table_1_recovered()
P3: dict[str, Any] = {"dynamics": mh.plant.SecondOrder(2000.0, 0.03), "amplifier_bandwidth": 279.0}
LIMITS = (-500.0, 500.0)

frequencies = st.floats(50.0, 4000.0)
second_orders = st.builds(mh.plant.SecondOrder, frequencies, st.floats(0.01, 2.0))
lags = st.builds(mh.plant.FirstOrder, frequencies)


def moves(samples: int = 600, height: float = 1.0) -> Array:
    """A smooth way there and back, from rest to rest."""
    return height * np.sin(np.pi * np.arange(samples) / samples) ** 4


System = tuple[Array, Array, Array, Array, float]


def sampled(dynamics: mh.plant.SecondOrder, bandwidth: float | None) -> System:
    """The dynamics behind a hold, by scipy."""
    w = 2 * np.pi * dynamics.frequency
    denominator = np.array([1 / w**2, 2 * dynamics.damping / w, 1.0])
    if bandwidth is not None:
        denominator = np.convolve(denominator, [1 / (2 * np.pi * bandwidth), 1.0])
    system: System = signal.cont2discrete(signal.tf2ss([1.0], denominator), DT)
    return system


# ---- whole references


@given(second_orders | lags, st.integers(0, 5))
def test_dynamics_undo_their_inverse(
    dynamics: mh.plant.SecondOrder | mh.plant.FirstOrder, delay: int
) -> None:
    reference = moves()
    held = mh.control.invert_dynamics(
        np.concatenate([reference, np.zeros(20)]), DT, dynamics=dynamics, dead_time=delay * DT
    )
    position = dynamics.response(np.concatenate([np.zeros(delay), held]), DT)[: reference.size]
    # the share of the second differences of the input leaves less than this of a smooth motion
    assert np.abs(position - reference)[delay + 1 :].max() < 1e-4


def test_a_series_of_dynamics_is_inverted() -> None:
    reference, series = moves(), [A1, mh.plant.FirstOrder(279.0)]
    held = mh.control.invert_dynamics(reference, DT, dynamics=series)
    position = signal.dlsim(sampled(A1, 279.0), held)[1][:, 0]
    assert np.abs(position - reference).max() < 1e-4


def test_a_trajectory_is_its_samples() -> None:
    scan = mh.trajectories.Sine(3.3, 20.0)
    exact = mh.control.invert_dynamics(scan, DT, dynamics=A1, seconds=0.1)
    sampled = mh.control.invert_dynamics(scan.sample(DT, 0.1)[0], DT, dynamics=A1)
    np.testing.assert_array_equal(exact, sampled)
    assert mh.control.invert_dynamics(scan, DT, dynamics=A1).size == 500  # one period


def test_what_was_identified_gives_dynamics_and_dead_time() -> None:
    u = np.where(np.arange(500) < 10, 0.0, 400.0)
    y = mh.plant.SecondOrder(800.0, 0.05).response(MODEL.forward().run(u), dt=DT)
    found = mh.identify_dynamics(u, np.concatenate([[0.0, 0.0], y[:-2]]), MODEL, dt=DT)
    assert found.dead_time == pytest.approx(2.0 * DT, abs=1e-10)
    linear: dict[str, Any] = {"dynamics": found.dynamics, "dead_time": found.dead_time}
    held = mh.control.invert_dynamics(moves(), DT, **linear)
    plain = mh.control.invert_dynamics(moves(), DT, dynamics=found.dynamics)
    np.testing.assert_allclose(held[:-20], plain[2:-18], atol=1e-3)
    made = mh.control.preview(ahead=6, dt=DT, **linear)
    assert made.coefficients.sum() == pytest.approx(1.0)
    mh.control.tune(MODEL, dt=DT, **linear)


# ---- drives


def test_precompensate_is_that_of_the_stage() -> None:
    scan = mh.trajectories.RoundedTriangle(3.0, 10.0, corner=0.01)
    for options in ({"dynamics": A1}, P3, {"dead_time": 1.5 * DT, "dynamics": A1}):
        stage = mh.Stage(MODEL, limits=LIMITS, **options)
        drive = mh.control.precompensate(stage, scan, DT, lead_in=0.05)
        assert np.array_equal(drive, stage.precompensate(scan, DT, lead_in=0.05))
        assert np.array_equal(drive, stage.precompensate(scan.sample(DT)[0], DT, lead_in=0.05))
        position = stage.forward(DT).run(drive)[-1000:]
        assert np.abs(position - scan.sample(DT)[0]).max() < 5e-3


def test_hysteresis_alone_is_inverted_exactly() -> None:
    reference = moves(height=2.0)
    drive = mh.control.precompensate(mh.Stage(MODEL), reference, DT)
    assert np.array_equal(drive, MODEL.inverse().run(reference))


def test_drives_that_are_held_back_are_told() -> None:
    stage = mh.Stage(MODEL, limits=(-100.0, 100.0))
    with pytest.warns(UserWarning, match=r"^reference: \d+ of 600 drives were held back by the li"):
        mh.control.precompensate(stage, moves(height=2.0), DT)
    stage = mh.Stage(MODEL, limits=LIMITS, slew=100.0)
    with pytest.warns(UserWarning, match=r"drives were held back by the slew rate"):
        mh.control.precompensate(stage, moves(height=2.0), DT)


# ---- previews


def test_a_preview_leads_a_loop_through_the_inverse() -> None:
    stage = mh.Stage(MODEL, limits=(-560.0, 560.0), dynamics=A1)
    reference = mh.signals.sine(3.3, 20.0, seconds=0.3)
    errors = []
    for feedforward in ("inverse", "preview"):
        run = stage.simulate(reference, DT, feedforward=feedforward, kp=60.0, ki=6000.0)
        errors.append(np.abs(run.reference - run.position)[1000:-20].max())
    assert 20.0 * errors[1] < errors[0]


@pytest.mark.parametrize("ahead", [2, 4, 8])
def test_the_error_of_a_preview_is_that_of_its_response(ahead: int) -> None:
    for dynamics, bandwidth in ((A1, None), (P3["dynamics"], 279.0)):
        made = mh.control.preview(dynamics, DT, ahead=ahead, amplifier_bandwidth=bandwidth)
        errors = [made.error(frequency) for frequency in (1.0, 20.0, 100.0)]
        assert errors == sorted(errors) and errors[-1] < 1e-2
        for frequency, told in zip((1.0, 20.0, 100.0), errors, strict=True):
            z = np.exp(2j * np.pi * frequency * DT)
            target = made.coefficients @ z ** (made.ahead - np.arange(made.coefficients.size))
            a, b, c, _, _ = sampled(dynamics, bandwidth)
            position = (c @ np.linalg.solve(z * np.eye(len(a)) - a, b))[0, 0] * target
            assert told == pytest.approx(abs(position - 1.0), abs=1e-9)


# ---- wrong input

good: dict[str, Any] = {"reference": np.zeros(20), "dt": DT, "dynamics": A1}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"reference": [0.0, math.nan] * 9}, "reference[1]: expected a finite number"),
        ({"reference": np.zeros((4, 4))}, "reference: expected a one-dimensional array"),
        ({"dt": 0.0}, "dt: expected a finite number"),
        ({"dt": math.nan}, "dt: expected a finite number"),
        ({"dead_time": -1.0}, "dead_time: expected"),
        ({"amplifier_bandwidth": 0.0}, "amplifier_bandwidth: expected a finite number"),
        ({"seconds": 1.0}, "seconds: expected None for samples"),
    ],
)
def test_wrong_arguments_are_named(change: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError) as caught:
        mh.control.invert_dynamics(**{**good, **change})
    assert str(caught.value).startswith(message) and ", got " in str(caught.value)


def test_wrong_kinds_are_named() -> None:
    with pytest.raises(TypeError, match=r"^dynamics: expected FirstOrder, SecondOrder,"):
        mh.control.invert_dynamics(np.zeros(20), DT, dynamics=400.0)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="Stage"):
        mh.control.precompensate("A1", np.zeros(20), DT)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"^seconds: expected a number of seconds"):
        mh.control.invert_dynamics(mh.trajectories.Sine(1.0, 1.0), DT, dynamics=A1, seconds=-1.0)
    wrong = mh.PrandtlIshlinskii([1.0, -2.0], [0.0, 1.0])
    with pytest.raises(mh.NotInvertibleError):
        mh.Stage(wrong).precompensate(np.zeros(20), DT)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"ahead": 1001}, "ahead: expected at most 1000 samples, got 1001"),
        ({"ahead": -1}, "ahead: expected a number of samples, got -1"),
        ({"ahead": 4, "window": 4}, "window: expected more references than lie ahead, got 4"),
        ({"degree": 8}, "degree: expected less than the number of references in the window"),
    ],
)
def test_wrong_windows_are_named(change: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError) as caught:
        mh.control.preview(A1, DT, **{"ahead": 4, **change})
    assert str(caught.value).startswith(message)
