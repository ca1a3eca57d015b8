"""The loops of a tuning against python-control, its words, and what it is asked for."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from support import Array
from test_tuning import A1, DT, FLEXURE, MODEL, P3, open_loop, varied


def everywhere(tuning: mh.control.Tuning) -> Array:
    made: Array = np.geomspace(0.1, 0.5 / tuning.dt, 4000)
    return made


@pytest.mark.parametrize("part", [A1, P3, {**A1, "dead_time": 1.5 * DT}, FLEXURE, {}])
def test_the_loops_over_frequency_are_those_of_python_control(part: dict[str, Any]) -> None:
    tuning = mh.control.tune(MODEL, dt=DT, **part)
    frequencies = everywhere(tuning)
    z = np.exp(2j * np.pi * frequencies * DT)
    low, high = MODEL.slope_range
    for slope in (low, 0.5 * (low + high), high):
        expected = open_loop(tuning, slope, **part)(z)
        loop = tuning.open_loop(frequencies, slope)
        assert loop.dtype == np.complex128
        # polynomials with poles near 1 are inexact at low frequencies
        np.testing.assert_allclose(loop, expected, rtol=1e-6)
        s = tuning.sensitivity(frequencies, slope)
        np.testing.assert_allclose(s, 1.0 / (1.0 + expected), rtol=1e-5)
        t = tuning.complementary_sensitivity(frequencies, slope)
        np.testing.assert_allclose(s + t, 1.0, rtol=0, atol=1e-12)
    np.testing.assert_array_equal(
        tuning.open_loop(frequencies), tuning.open_loop(frequencies, high)
    )


@pytest.mark.parametrize("part", [A1, FLEXURE])
def test_the_worst_sensitivity_is_that_of_the_whole_family(part: dict[str, Any]) -> None:
    tuning = mh.control.tune(MODEL, dt=DT, **part)
    frequencies = everywhere(tuning)
    z = np.exp(2j * np.pi * frequencies * DT)
    family = [open_loop(tuning, 1.0, **one)(z) for one in varied(part)]
    slopes = np.linspace(*MODEL.slope_range, 400)[:, None]
    expected = np.max([(1.0 / np.abs(1.0 + slopes * one)).max(axis=0) for one in family], axis=0)
    worst = tuning.worst_sensitivity(frequencies)
    # the twin has slopes 0.2 % apart
    np.testing.assert_allclose(worst, expected, rtol=1e-3)
    assert 0.99 * tuning.peak_sensitivity < worst.max() <= tuning.peak_sensitivity * (1 + 1e-9)


def test_a_tuning_keeps_its_loops_and_words_after_pickle() -> None:
    tuning = mh.control.tune(MODEL, dt=DT, **FLEXURE, frequency_uncertainty=0.02)
    frequencies = everywhere(tuning)
    for again in (pickle.loads(pickle.dumps(tuning)), copy.deepcopy(tuning)):
        for name in ("open_loop", "sensitivity", "complementary_sensitivity", "worst_sensitivity"):
            values = [getattr(one, name)(frequencies) for one in (tuning, again)]
            np.testing.assert_array_equal(values[0], values[1])
        assert again.explanation == tuning.explanation and again.tried == tuning.tried
        assert (again.dt, again.peak_sensitivity_limit) == (DT, 1.7)
        assert again.at_min_slope.gain_margin == tuning.at_min_slope.gain_margin


STRUCTURES = ("proportional-integral", "low-pass", "active damping", "notch")


@pytest.mark.parametrize("structure", STRUCTURES)
def test_a_structure_can_be_asked_for(structure: Any) -> None:
    stage = mh.Stage(MODEL, **FLEXURE)
    tuning = stage.tune(DT, structure=structure)
    assert tuning.structure == structure
    assert (tuning.kp < 0.0) == (structure == "active damping")
    assert tuning.worst_sensitivity(everywhere(tuning)).max() <= 1.7 * (1.0 + 1e-9)
    assert tuning.ki <= stage.tune(DT).ki * 1.05
    assert "This structure was asked for." in tuning.explanation
    same = mh.control.tune(MODEL, dt=DT, structure=structure, **FLEXURE)
    assert (same.kp, same.ki) == (tuning.kp, tuning.ki)


def test_less_uncertainty_allows_more_integral() -> None:
    stage = mh.Stage(MODEL, **FLEXURE)
    known = stage.tune(DT, frequency_uncertainty=0.0, damping_uncertainty=1.0)
    default, unknown = stage.tune(DT), stage.tune(DT, frequency_uncertainty=0.15)
    assert known.ki > default.ki > unknown.ki
    given = stage.tune(DT, frequency_uncertainty=0.05, damping_uncertainty=2.0, structure=None)
    assert (given.kp, given.ki, given.tried) == (default.kp, default.ki, default.tried)
    assert "15 % either way" in unknown.explanation and "either way" not in known.explanation


def short(number: float) -> str:
    """Four digits, without an exponent."""
    return np.format_float_positional(float(f"{number:.3e}"), trim="-")


def test_the_explanation_says_what_was_chosen_and_what_it_reaches() -> None:
    tuning = mh.control.tune(MODEL, dt=DT, **FLEXURE)
    for said in (
        "A notch before both gains takes out the resonance at 800 Hz.",
        *(f"{short(ki)} with " for _, ki in tuning.tried),
        "of 1.7 allowed",
        "5 % either way and damping by a factor of 2 either way",
        f"up to {short(tuning.rejection_bandwidth)} Hz",
        f"bandwidth of {short(tuning.noise_bandwidth)} Hz",
    ):
        assert said in tuning.explanation
    plain = mh.control.tune(MODEL, dt=DT, **A1).explanation
    assert "nothing else was tried" in plain and "mode frequencies" not in plain


WORDS = '"proportional-integral", "low-pass", "active damping" or "notch"'


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"frequency_uncertainty": 0.6}, ValueError, "frequency_uncertainty: expected a share"),
        ({"damping_uncertainty": 0.5}, ValueError, "damping_uncertainty: expected a factor"),
        ({"structure": "pid"}, ValueError, f'structure: expected {WORDS}, got "pid"'),
        ({"structure": 0.0}, TypeError, f"structure: expected {WORDS}, got 0.0"),
        ({"damping_uncertainty": "2"}, TypeError, "damping_uncertainty: expected a number"),
    ],
)
def test_wrong_demands_are_named(change: dict[str, Any], error: Any, message: str) -> None:
    with pytest.raises(error) as caught:
        mh.control.tune(MODEL, dt=DT, **FLEXURE, **change)
    assert str(caught.value).startswith(message) and ", got " in str(caught.value)
    message = r'^structure: expected "proportional-integral" for dynamics without .*, got "notch"$'
    with pytest.raises(ValueError, match=message):
        mh.control.tune(MODEL, dt=DT, structure="notch", **A1)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (([0.0],), r"frequencies\[0\]: expected a finite number above 0"),
        (([1.0, 5001.0],), r"frequencies\[1\]: expected a number from 0.0 to 5000.0, got 5001.0"),
        (([[1.0]],), "frequencies: expected a one-dimensional array"),
        (([1.0], 0.0), "slope: expected a finite number above 0"),
    ],
)
def test_frequencies_that_no_loop_has_are_named(arguments: Any, message: str) -> None:
    tuning = mh.control.tune(MODEL, dt=DT, **A1)
    for method in (tuning.open_loop, tuning.sensitivity, tuning.complementary_sensitivity):
        with pytest.raises(ValueError, match=message):
            method(*arguments)
    if len(arguments) == 1:
        with pytest.raises(ValueError, match=message):
            tuning.worst_sensitivity(*arguments)
