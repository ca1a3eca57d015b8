"""Experiments: drives within limits and slew that tell a whole stage."""

from __future__ import annotations

from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpi_hyst import signals

STAGE: dict[str, Any] = {"slew": 2000.0, "rate": 1000.0, "fast_rate": 10_000.0}


@st.composite
def experiments(draw: st.DrawFn) -> dict[str, Any]:
    """The arguments of an experiment."""
    low, width = draw(st.floats(-1e3, 1e3)), draw(st.floats(1e-3, 1e3))
    high, rate = low + width, draw(st.floats(1001.0, 2000.0))
    width = high - low
    return {
        "low": low,
        "high": high,
        "slew": draw(st.floats(1.0, 20.0)) * width,
        "rate": rate,
        "cycles": draw(st.integers(1, 8)),
        "shape": draw(st.sampled_from(["triangle", "sine"])),
        "center": low + width * draw(st.floats(0.2, 0.8)),
        "start": min(low + width * draw(st.floats(0.0, 1.0)), high),
        "rest": 0.1,
        "fast_signal": draw(st.sampled_from(["chirp", "multisine"])),
        "fast_amplitude": 0.5 * width * draw(st.floats(1e-3, 1.0)),
        "fast_frequency": rate * draw(st.floats(0.05, 0.5)),
    }


@given(experiments())
def test_limits_and_slew_are_kept_and_every_part_comes_home(options: dict[str, Any]) -> None:
    for part in signals.experiment(**options):
        assert part.drive[0] == options["start"] == part.drive[-1]
        assert options["low"] <= part.drive.min() and part.drive.max() <= options["high"]
        rounding = 2e-15 * max(abs(options["low"]), abs(options["high"]))
        step = np.abs(np.diff(part.drive)).max()
        assert step <= options["slew"] / part.rate * (1 + 2e-12) + rounding


@given(experiments())
def test_segments_follow_each_other_and_say_what_is_in_them(options: dict[str, Any]) -> None:
    for part in signals.experiment(**options):
        stops = [0, *(segment.stop for segment in part.segments)]
        assert [segment.start for segment in part.segments] == stops[:-1]
        assert stops[-1] == part.drive.size
        for segment in part.segments:
            own = part.drive[segment.start : segment.stop]
            assert segment.range == (own.min(), own.max())
            led_in = part.drive[max(segment.start - 1, 0) : segment.stop]
            steps = np.abs(np.diff(led_in)).max(initial=0.0)
            assert segment.max_slew == steps * part.rate


@pytest.mark.parametrize(
    ("limits", "options"),
    [
        ((0.0, 150.0), STAGE),
        ((-500.0, 500.0), {**STAGE, "slew": 2e4}),
        ((0.0, 3.6), {**STAGE, "slew": 100.0}),
        ((0.0, 150.0), {"slew": 2000.0, "rate": 1000.0}),  # a slow stage, all at 1 kHz
    ],
)
def test_the_default_experiment_takes_less_than_two_minutes(
    limits: tuple[float, float], options: dict[str, Any]
) -> None:
    fast, loops = signals.experiment(*limits, **options)
    assert fast.drive.size / fast.rate + loops.drive.size / loops.rate < 120.0
    assert (loops.drive.min(), loops.drive.max()) == limits
    assert np.ptp(fast.drive) <= 0.0101 * (limits[1] - limits[0])
    top = next(segment for segment in fast.segments if segment.name == "chirp").frequencies[1]
    assert top == 0.4 * fast.rate
    rests = next(segment for segment in loops.segments if segment.name == "rests")
    still = np.diff(loops.drive[rests.start : rests.stop]) == 0.0
    assert still.sum() / loops.rate == pytest.approx(40.0, abs=0.01)


def test_joined_parts_are_one_drive() -> None:
    options: dict[str, Any] = {"slew": 2000.0, "rate": 1000.0}
    parts = signals.experiment(0.0, 150.0, **options)
    (whole,) = signals.experiment(0.0, 150.0, **options, joined=True)
    np.testing.assert_array_equal(whole.drive, np.concatenate([part.drive for part in parts]))
    assert [one.name for one in whole.segments] == [
        one.name for part in parts for one in part.segments
    ]
    skipped = parts[0].drive.size + parts[1].initialization_samples
    assert whole.initialization_samples == skipped


def stage(limits: tuple[float, float]) -> mh.Stage:
    """40 operators, 100 um, 800 Hz and 0.02, amplifier, creep, one sample of dead time, noise."""
    reach = max(map(abs, limits))
    r = reach * np.arange(40) / 40
    w = np.concatenate([[1.0], 0.05 * np.exp(-2.0 * r[1:] / reach)])
    model = mh.ModifiedPrandtlIshlinskii.from_ratios(w, r, ra=0.9, rb=0.5, rc=0.6)
    stroke = np.ptp(model.forward().run([limits[1], limits[0]]))
    return mh.Stage(
        mh.ModifiedPrandtlIshlinskii.from_ratios(w * 100.0 / stroke, r, ra=0.9, rb=0.5, rc=0.6),
        limits=limits,
        dead_time=1e-4,
        amplifier_bandwidth=5000.0,
        dynamics=mh.plant.SecondOrder(800.0, 0.02),
        creep=mh.plant.Creep.logarithmic(0.012, 0.01, 100.0, 8),
        noise=0.02,
    )


def raster(stroke: float, bottom: float) -> np.ndarray[Any, np.dtype[np.float64]]:
    """10 Hz at 10 kHz for a second, its corners rounded."""
    t = 1e-4 * np.arange(10_000)
    rounded = np.arcsin(0.98 * np.sin(2 * np.pi * 10.0 * t)) / np.arcsin(0.98)
    return np.asarray(bottom + 0.5 * stroke * (1.0 + rounded))


@pytest.mark.parametrize(
    ("limits", "slew", "bottom", "bound"),
    # 0.055 and 0.013 % of the stroke were measured
    [
        pytest.param((0.0, 150.0), 2e3, 15.0, 0.1, marks=pytest.mark.slow),
        ((-500.0, 500.0), 2e4, -35.0, 0.03),
    ],
)
def test_a_creeping_lightly_damped_stage_is_known_from_its_experiment(
    limits: tuple[float, float], slew: float, bottom: float, bound: float
) -> None:
    truth = stage(limits)
    parts = signals.experiment(*limits, **{**STAGE, "slew": slew})[::-1]
    # Played one after the other: what was played before has left no more than the tolerances.
    records = [
        (part.drive, truth.plant(1.0 / part.rate, seed=seed).run(part.drive)[0])
        for seed, part in enumerate(parts)
    ]
    dt = [1.0 / part.rate for part in parts]
    identified = mh.identify(records, dt=dt)
    found = identified.stage
    mode = found.dynamics
    assert isinstance(mode, mh.plant.SecondOrder)
    assert mode.frequency == pytest.approx(800.0, rel=2e-3)
    assert mode.damping == pytest.approx(0.02, rel=0.1)
    # An amplifier of 5 kHz, a third of a sample, is hardly told from a dead time: their sum is.
    bandwidth = found.amplifier_bandwidth
    assert bandwidth is not None and found.dead_time is not None
    lag = 1.0 / (2 * np.pi * 5e3)
    assert found.dead_time + 1.0 / (2 * np.pi * bandwidth) == pytest.approx(1e-4 + lag, abs=1e-5)
    assert found.dead_time == pytest.approx(1e-4, abs=2e-5)
    assert "dead_time_confounded" in [finding.code for finding in identified.warnings]
    reference = raster(70.0, bottom)
    drive = found.precompensate(reference, dt=1e-4, lead_in=0.1)
    error = truth.forward(1e-4).run(drive)[-reference.size :] - reference
    # of a stroke of 100 um, so 1 um is 1 %
    assert np.sqrt(np.mean(error**2)) < bound


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"frequencies": (10.0, 1.0)}, "frequencies: expected two numbers above 0, the lower one"),
        ({"rate": 100.0}, "rate: expected at least "),
        ({"rest": -1.0}, "rest: expected a finite number, 0 or more"),
        ({"fast_rate": 0.0}, "fast_rate: expected a finite number above 0"),
        (
            {"fast_frequency": 6e3},
            "fast_frequency: expected a number from 4.0 to half of `fast_rate`, ",
        ),
        (
            {"fast_amplitude": 76.0},
            "fast_amplitude: expected a number above 0, at most half of the",
        ),
        ({"fast_signal": "noise"}, 'fast_signal: expected "chirp" or "multisine"'),
        ({"shape": "square"}, 'shape: expected "triangle" or "sine"'),
        ({"slew": 0.0}, "slew: expected a finite number above 0"),
        ({"start": 151.0}, "start: expected a number from low = 0.0 to high = 150.0"),
        ({"cycles": 0}, "cycles: expected a whole number of at least one"),
        ({"joined": True}, "fast_rate: expected 1000.0 Hz, the rate of the loops"),
    ],
)
def test_what_no_experiment_can_have_is_named(changed: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=f"^{message}.*, got "):
        signals.experiment(0.0, 150.0, **{**STAGE, **changed})
