"""Linear dynamics: against their twin, as values, and what they refuse."""

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
from reference import dynamics as twin

DT = 1e-4

INPUTS = np.random.default_rng(3).uniform(-3.0, 3.0, 100)

positive = st.floats(1.0, 4000.0)


@given(positive, st.floats(1e-3, 20.0) | st.sampled_from([1.0, 1.0 - 1e-12, 1.0 + 1e-12]))
def test_second_order_is_its_differential_equation(frequency: float, damping: float) -> None:
    got = mh.plant.SecondOrder(frequency, damping).response(INPUTS, DT)
    # the twin squares its series, so its error grows with the norm of the matrix, and a resonance
    # of little damping keeps the errors of 100 samples: 1e-13 of outputs up to 30
    tolerance = 1e-11 * (1.0 + damping)
    expected = twin.second_order(frequency, damping, INPUTS.tolist(), DT)
    np.testing.assert_allclose(got, expected, rtol=0, atol=tolerance)


@given(positive)
def test_first_order_is_its_differential_equation(frequency: float) -> None:
    expected = twin.first_order(frequency, INPUTS.tolist(), DT)
    lag = mh.plant.FirstOrder(frequency)
    np.testing.assert_allclose(lag.response(INPUTS, DT), expected, rtol=0, atol=1e-13)
    again = mh.plant.FirstOrder.from_time_constant(lag.time_constant)
    assert again.frequency == pytest.approx(frequency, rel=1e-15)


def test_creep_is_its_differential_equation() -> None:
    amplitudes, taus = [0.05, -0.02, 0.1], [1e-3, 0.01, 2.0]
    expected = twin.creep(amplitudes, taus, INPUTS.tolist(), DT)
    got = mh.plant.Creep(amplitudes, taus).response(INPUTS, DT)
    np.testing.assert_allclose(got, expected, rtol=0, atol=1e-13)


def test_logarithmic_creep_grows_by_gamma_per_decade() -> None:
    creep = mh.plant.Creep.logarithmic(0.015, start=0.01, end=1000.0, terms=10)
    position = 2.0 * creep.response(np.ones(2000), 0.01)
    after = {seconds: position[round(100 * seconds) - 1] for seconds in (0.5, 1, 2, 5, 10, 20)}
    for seconds, there in after.items():
        # ripple and tails: below 1 % of gamma here
        law = 2.0 * (1.0 + 0.015 * math.log10(seconds / 0.01))
        assert there == pytest.approx(law, abs=2.0 * 0.015 * 0.01)


VALUES = [
    mh.plant.SecondOrder(400.0, 0.95),
    mh.plant.SecondOrder(400.0, 0.9),
    mh.plant.FirstOrder(279.0),
    mh.plant.FirstOrder(280.0),
    mh.plant.Creep([0.01], [0.1]),
    mh.plant.Creep([0.01], [0.2]),
    mh.plant.LoopShift(75.0, 60.0, (-3.0, 0.5), 0.2, 0.5),
    mh.plant.LoopShift(75.0, 60.0, (0.5, -3.0), 0.2, 0.5),
]


@pytest.mark.parametrize("value", VALUES, ids=repr)
def test_parameters_compare_hash_copy_and_show_themselves(value: Any) -> None:
    for twin_of in (pickle.loads(pickle.dumps(value)), copy.copy(value), copy.deepcopy(value)):
        assert twin_of == value and hash(twin_of) == hash(value)
    assert sum(value == other for other in VALUES) == 1
    assert eval(repr(value), vars(mh.plant)) == value


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: mh.plant.SecondOrder(-400.0, 0.5), "frequency: expected a finite number above 0"),
        (
            lambda: mh.plant.SecondOrder(400.0, math.nan),
            "damping: expected a finite number above 0",
        ),
        (lambda: mh.plant.FirstOrder(0.0), "frequency: expected a finite number above 0"),
        (lambda: mh.plant.FirstOrder.from_time_constant(0.0), "time_constant: expected a finite"),
        (lambda: mh.plant.Creep([0.1], [0.1, 0.2]), "time_constants: expected as many"),
        (
            lambda: mh.plant.Creep([0.1, 0.1], [0.2, 0.1]),
            "time_constants[1]: expected time constants",
        ),
        (
            lambda: mh.plant.Creep.logarithmic(0.1, 1.0, 0.5, 3),
            "end: expected a time after start, got",
        ),
        (
            lambda: mh.plant.Creep.logarithmic(0.1, 0.1, 0.5, 0),
            "terms: expected a whole number of at",
        ),
        (
            lambda: mh.plant.SecondOrder(1.0, 1.0).response([1.0], 0.0),
            "dt: expected a finite number",
        ),
        (
            lambda: mh.plant.SecondOrder(1.0, 1.0).response([0.0, math.inf], DT),
            "u[1]: expected a finite",
        ),
    ],
)
def test_wrong_parameters_are_named(make: Any, message: str) -> None:
    with pytest.raises(ValueError) as caught:
        make()
    assert str(caught.value).startswith(message) and ", got " in str(caught.value)


def of_the_stack(**settings: Any) -> mh.results.Identification:
    """Fit dynamics of second order to slow loops, which tell no resonance."""
    records = [mh.datasets.piezo_stack(name) for name in ("major_loops", "decaying_loops")]
    return mh.identify(
        [(one.u, one.y) for one in records],
        skip=[one.skip for one in records],
        dt=records[0].dt,
        operators=16,
        weights="free",
        ratios="fit",
        dynamics=2,
        **settings,
    )


def test_what_ends_at_an_edge_is_told_without_a_number_that_is_none() -> None:
    # A dead time that is too long makes up for itself with a mode as fast as may be.
    found = of_the_stack(dead_time=0.02)
    assert isinstance(found.dynamics, mh.plant.Modes)
    fastest = found.dynamics.modes[-1]
    assert fastest.frequency == pytest.approx(0.5 / mh.datasets.piezo_stack("major_loops").dt)
    assert math.isnan(found.lag_std)
    told = {one.code: one.message for one in found.warnings}
    assert "edge of its domain" in told["resonance_not_excited"]
    assert not any("NaN" in message for message in told.values())


def test_dynamics_that_were_asked_for_never_lead() -> None:
    # Their lag and a dead time below zero go against each other: nothing can run the latter.
    found, known = of_the_stack(), of_the_stack(dead_time=0.0)
    assert found.dead_time == 0.0
    assert found.dynamics == known.dynamics and found.fit.rmse == known.fit.rmse
    told = {one.code: one for one in found.warnings}
    assert told["negative_dead_time"].value == pytest.approx(-1.5)
    assert "leads the drive by 1.50 samples or more" in told["negative_dead_time"].message
    assert "negative_dead_time" not in {one.code for one in known.warnings}
    assert np.isfinite(found.stage.forward(0.005).run([0.0, 1.0, 2.0])).all()
