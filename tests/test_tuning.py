"""Gains of the feedback: against python-control, and what every tuning keeps."""

from __future__ import annotations

import math
from typing import Any

import control
import mpi_hyst as mh
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm
from scipy.signal import ss2tf
from support import Array

DT = 1e-4
MODEL = mh.paper.table_1_recovered()
A1: dict[str, Any] = {"dynamics": mh.plant.SecondOrder(400.0, 0.95)}
P3: dict[str, Any] = {"dynamics": mh.plant.SecondOrder(2000.0, 0.03), "amplifier_bandwidth": 279.0}

frequencies = st.floats(20.0, 4000.0)
parts = st.fixed_dictionaries(
    {
        "dynamics": st.none()
        | st.builds(mh.plant.FirstOrder, frequencies)
        | st.builds(mh.plant.SecondOrder, frequencies, st.floats(0.01, 2.0)),
        "amplifier_bandwidth": st.none() | frequencies,
        "dead_time": st.sampled_from([0.0, 0.5e-4, 1e-4, 2.25e-4, 5e-4]),
    }
)
models = st.builds(
    lambda w, rest: mh.PrandtlIshlinskii([w, *(w * r for r in rest)], list(range(1 + len(rest)))),
    st.floats(1e-4, 1e2),
    st.lists(st.floats(0.0, 1.0), max_size=4),
)


def held(state: Any, share: float) -> Any:
    """Exactly: for this share of an interval the drive before still acts, then the one of now."""
    phi = expm(state.A * DT)
    gains = [
        integral(state, (1 - share) * DT),
        expm(state.A * (1 - share) * DT) @ integral(state, share * DT),
    ]
    parts = [ss2tf(phi, gain, state.C, np.zeros((1, 1))) for gain in gains]
    numerator = np.r_[parts[0][0][0], 0.0] + np.r_[0.0, parts[1][0][0]]
    return control.tf(numerator, np.r_[parts[0][1], 0.0], DT)


def integral(state: Any, time: float) -> Array:
    """What a constant input of 1 makes of the state in this time, from rest."""
    order = len(state.A)
    both = np.block([[state.A, state.B], [np.zeros((1, order + 1))]])
    made: Array = expm(both * time)[:order, order:]
    return made


def open_loop(
    tuning: mh.control.Tuning,
    slope: float,
    *,
    dynamics: mh.plant.SecondOrder | mh.plant.FirstOrder | None = None,
    amplifier_bandwidth: float | None = None,
    dead_time: float = 0.0,
) -> Any:
    """The loop as python-control has it."""
    continuous = control.tf([1.0], [1.0])
    if isinstance(dynamics, mh.plant.SecondOrder):
        w = 2 * np.pi * dynamics.frequency
        continuous *= control.tf([w**2], [1.0, 2 * dynamics.damping * w, w**2])
    elif dynamics is not None:
        continuous *= control.tf([1.0], [dynamics.time_constant, 1.0])
    if amplifier_bandwidth is not None:
        continuous *= control.tf([1.0], [1 / (2 * np.pi * amplifier_bandwidth), 1.0])
    whole, share = math.floor(dead_time / DT), dead_time / DT % 1.0
    if dynamics is None and amplifier_bandwidth is None:
        plant = control.tf([1 - share, share], [1.0, 0.0, 0.0], DT)
    else:
        plant = held(control.ss(continuous), share)
    plant *= control.tf([1.0], [1.0, *[0.0] * whole], DT)
    law = control.tf([tuning.kp + DT * tuning.ki, -tuning.kp], [1.0, -1.0], DT)
    for one in tuning.filters:
        section = one.section(DT)
        law *= control.tf(section.b, [1.0, *section.a], DT)
    return control.minreal(slope * law * plant, verbose=False)


def varied(part: dict[str, Any]) -> list[dict[str, Any]]:
    """Return a linear part as it is known, and with modes that may be, if one is lightly damped."""
    mode = part.get("dynamics")
    if not isinstance(mode, mh.plant.SecondOrder) or mode.damping >= 0.5:
        return [part]
    others = [(1.0, 1.0), *((f, d) for f in (0.95, 1.0, 1.05) for d in (0.5, 2.0))]
    return [
        {**part, "dynamics": mh.plant.SecondOrder(f * mode.frequency, d * mode.damping)}
        for f, d in others
    ]


def sensitivity_peak(loop: Any) -> float:
    """On a dense grid, denser where the plant resonates or the loop is close to -1."""
    half = math.pi / DT
    frequencies = np.geomspace(1e-5 * half, half, 20_000)
    for _ in range(3):
        distance = np.abs(1.0 + loop(np.exp(1j * frequencies * DT)))
        worst = int(np.argmin(distance))
        low, high = frequencies[max(worst - 1, 0)], frequencies[min(worst + 1, len(distance) - 1)]
        frequencies = np.linspace(low, high, 2001)
    return float(1.0 / distance.min())


@pytest.mark.parametrize(
    "part", [A1, P3, {**A1, "dead_time": 1.5 * DT}, {"amplifier_bandwidth": 50.0}, {}]
)
@pytest.mark.parametrize("limit", [1.3, 1.7])
def test_margins_are_those_of_python_control(part: dict[str, Any], limit: float) -> None:
    tuning = mh.control.tune(MODEL, dt=DT, peak_sensitivity=limit, **part)
    for margins in (tuning.at_min_slope, tuning.at_max_slope):
        loop = open_loop(tuning, margins.slope, **part)
        # by response: the roots of its polynomials are too inexact with poles near 1
        omega = np.geomspace(1e-4, 1.0, 8_000) * math.pi / DT
        response = control.frd(loop, omega, smooth=True)
        gains, phases, _, _, crossovers, _ = control.stability_margins(response, returnall=True)
        # it interpolates between its frequencies, 1e-3 apart
        assert margins.peak_sensitivity == pytest.approx(sensitivity_peak(loop), rel=1e-5)
        assert margins.phase_margin == pytest.approx(np.abs(phases).min(), rel=1e-4)
        assert margins.crossover == pytest.approx(crossovers.max() / (2 * np.pi), rel=1e-4)
        half = float(np.real(loop(-1.0 + 0j)))
        there = [gain for gain in gains if gain > 1.0] + ([-1.0 / half] if half < 0.0 else [])
        assert margins.gain_margin == pytest.approx(min(there), rel=1e-4)
        assert np.abs(control.feedback(loop, 1).poles()).max() < 1.0


@settings(max_examples=6)
@given(parts, models, st.floats(1.1, 3.0))
def test_the_bound_is_kept_and_met_and_the_loop_is_stable(
    part: dict[str, Any], model: mh.PrandtlIshlinskii, limit: float
) -> None:
    tuning = mh.control.tune(model, dt=DT, peak_sensitivity=limit, **part)
    assert tuning.kp >= 0.0 or tuning.structure == "active damping"
    assert tuning.ki > 0.0
    assert tuning.peak_sensitivity <= limit
    # the greatest ki meets the bound but for what the search leaves
    assert tuning.peak_sensitivity > limit * (1.0 - 1e-3)
    low, high = model.slope_range
    assert (tuning.at_min_slope.slope, tuning.at_max_slope.slope) == (low, high)
    for share in (0.0, 0.3, 1.0):
        for one in varied(part):
            loop = open_loop(tuning, low + share * (high - low), **one)
            assert np.abs(control.feedback(loop, 1).poles()).max() < 1.0
            # the grid of the twin may miss a little of a sharp peak, never add
            assert sensitivity_peak(loop) < limit * (1.0 + 1e-6)
    for margins in (tuning.at_min_slope, tuning.at_max_slope):
        assert margins.peak_sensitivity <= tuning.peak_sensitivity * (1.0 + 1e-9)
        assert margins.gain_margin > limit / (limit - 1.0) * (1.0 - 1e-6)
        least_phase = 2 * math.degrees(math.asin(0.5 / limit))
        assert margins.phase_margin > least_phase * (1.0 - 1e-6)


@pytest.mark.parametrize("part", [A1, {**A1, "dead_time": 1.5 * DT}])
def test_no_other_gains_with_more_integral_keep_the_bound(part: dict[str, Any]) -> None:
    tuning = mh.control.tune(MODEL, dt=DT, **part)
    steeper = open_loop(tuning, 1.0, **part)
    z = np.exp(1j * np.geomspace(1e-4, np.pi, 4000))
    plant = steeper(z) / (tuning.kp + DT * tuning.ki / (1 - 1 / z))
    slopes = np.linspace(*MODEL.slope_range, 9)[:, None]
    ki = 1.01 * DT * tuning.ki
    for kp in np.linspace(0.0, 3.0 * tuning.kp, 151):
        loop = slopes * (kp + ki / (1 - 1 / z)) * plant
        assert (1.0 / np.abs(1.0 + loop)).max() > 1.7


def test_more_sensitivity_allows_more_integral() -> None:
    gains: Array = np.array(
        [
            mh.control.tune(MODEL, dt=DT, peak_sensitivity=m, **P3).ki
            for m in (1.2, 1.4, 1.7, 2.0, 3.0)
        ]
    )
    assert np.all(np.diff(gains) > 0.0)


def test_gains_scale_with_the_slope_and_split_models_count_both_weights() -> None:
    tuning = mh.control.tune(mh.PrandtlIshlinskii([1.0, 0.5], [0.0, 1.0]), dt=DT, **A1)
    other = mh.control.tune(mh.PrandtlIshlinskii([1e-3, 0.5e-3], [0.0, 1.0]), dt=DT, **A1)
    assert (other.kp, other.ki) == pytest.approx((1e3 * tuning.kp, 1e3 * tuning.ki), rel=1e-6)
    ratios = {"ra": 1.0, "rb": 1.0, "rc": 1.0}
    split = mh.ModifiedPrandtlIshlinskii.from_ratios(
        [1.0, 0.1], [0.0, 1.0], **ratios, weights_negative=[1.0, 0.5]
    )
    assert split.slope_range == (1.0, 1.5)
    again = mh.control.tune(split, dt=DT, **A1)
    assert (again.kp, again.ki) == (tuning.kp, tuning.ki)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"peak_sensitivity": 1.0}, "peak_sensitivity: expected 1.05 to 5, got 1.0"),
        ({"peak_sensitivity": math.nan}, "peak_sensitivity: expected 1.05 to 5, got NaN"),
        ({"dt": 0.0}, "dt: expected a finite number above 0"),
        ({"dt": 1e4, "amplifier_bandwidth": 1.0}, "dt: expected at most 1e6 time constants"),
        ({"dead_time": 0.1001}, "dead_time: expected"),
        ({"dead_time": -1.0}, "dead_time: expected"),
        ({"amplifier_bandwidth": -1.0}, "amplifier_bandwidth: expected a finite number above 0"),
    ],
)
def test_wrong_arguments_are_named(change: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError) as caught:
        mh.control.tune(MODEL, **{"dt": DT, **A1, **change})
    assert str(caught.value).startswith(message) and ", got " in str(caught.value)


def test_models_without_a_range_of_slopes_are_refused() -> None:
    with pytest.raises(mh.NotInvertibleError, match=r"the model is not invertible: its slope"):
        mh.control.tune(mh.PrandtlIshlinskii([1.0, -1.5], [0.0, 1.0]), dt=DT)
    with pytest.raises(TypeError, match=r"^stage: expected a PrandtlIshlinskii or a Modified"):
        mh.control.tune(0.006, dt=DT)  # type: ignore[arg-type]


def test_a_plant_knows_everything_but_the_sensitivity() -> None:
    plant = mh.plant.Plant(
        MODEL,
        dynamics=mh.plant.SecondOrder(2000.0, 0.03),
        amplifier_bandwidth=279.0,
        dead_time=2e-4,
        dt=DT,
    )
    expected = mh.control.tune(
        MODEL,
        dt=1e-4,
        dynamics=mh.plant.SecondOrder(2000.0, 0.03),
        amplifier_bandwidth=279.0,
        dead_time=2e-4,
    )
    tuning = mh.control.tune(plant)
    assert (tuning.kp, tuning.ki) == (expected.kp, expected.ki)
    with pytest.raises(TypeError, match="stage: expected a stage or model beside other keywords"):
        mh.control.tune(plant, dt=1e-4)
    with pytest.raises(TypeError, match="dt: expected the sampling interval in seconds, got None"):
        mh.control.tune(MODEL)


FLEXURE: dict[str, Any] = {"dynamics": mh.plant.SecondOrder(800.0, 0.02), "dead_time": DT}


def test_a_lightly_damped_stage_gets_ten_times_the_bandwidth() -> None:
    tuning = mh.control.tune(MODEL, dt=DT, **FLEXURE)
    assert tuning.structure == "notch" and len(tuning.filters) == 1
    ki = dict(tuning.tried)
    assert ki["notch"] > 10.0 * ki["proportional-integral"]
    assert {"low-pass", "active damping"} <= set(ki)
    low, high = MODEL.slope_range
    rejected, followed = [], []
    for one in varied(FLEXURE):
        for slope in (low, high):
            loop = open_loop(tuning, slope, **one)
            assert sensitivity_peak(loop) < 1.7 * (1.0 + 1e-6)
            frequencies = np.linspace(1.0, 5000.0, 200_000)
            response = loop(np.exp(2j * np.pi * frequencies * DT))
            rejected.append(frequencies[np.argmax(np.abs(1.0 / (1.0 + response)) > 0.5**0.5)])
            followed.append(np.mean(np.abs(response / (1.0 + response)) ** 2) * 5000.0)
    assert min(rejected) > 80.0
    # the grid is 0.025 Hz apart
    assert tuning.rejection_bandwidth == pytest.approx(min(rejected), abs=0.05)
    # of the dynamics as they are known, with the greatest slope
    assert tuning.noise_bandwidth == pytest.approx(followed[1], rel=1e-2)


def test_a_controller_of_a_stage_has_the_filters_that_were_tuned() -> None:
    stage = mh.Stage(MODEL, limits=(-500.0, 500.0), **FLEXURE)
    tuning, controller = stage.tune(DT), stage.controller(DT)
    assert controller.filters == tuple(one.section(DT) for one in tuning.filters)
    assert (controller.kp, controller.ki) == (tuning.kp, tuning.ki)
    # gains of one's own stand alone
    assert stage.controller(DT, kp=0.0, ki=10.0).filters == ()


def test_a_controller_takes_a_tuning_of_its_stage() -> None:
    stage = mh.Stage(MODEL, limits=(-500.0, 500.0), **FLEXURE)
    cautious = stage.tune(DT, peak_sensitivity=1.2)
    controller = stage.controller(DT, tuning=cautious)
    assert (controller.kp, controller.ki) == (cautious.kp, cautious.ki)
    assert controller.filters == tuple(one.section(DT) for one in cautious.filters)
    assert controller.ki < stage.controller(DT).ki
    with pytest.raises(
        ValueError, match=r"tuning: expected one for dt = 0.0002, got one for 0.0001"
    ):
        stage.controller(2.0 * DT, tuning=cautious)
    with pytest.raises(ValueError, match=r"tuning: expected None beside kp and ki"):
        stage.controller(DT, kp=0.0, ki=10.0, tuning=cautious)
    other = stage.replace(dead_time=2.0 * DT)
    with pytest.raises(ValueError, match=r"tuning: expected one of this stage, .* another stage"):
        other.controller(DT, tuning=cautious)
    with pytest.raises(TypeError, match=r"tuning: expected"):
        stage.controller(DT, tuning=1.2)  # type: ignore[arg-type]
