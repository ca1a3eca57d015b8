"""A stage whose loops change their size while the drive cycles: laws, twin, identification."""

from __future__ import annotations

import math
import pickle
from pathlib import Path
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpi_hyst._cli.stage import is_static
from mpi_hyst._report.models import linear_parts
from reference.slow_gain import SlowGain
from stack_stage import (
    DT,
    LIMITS,
    MAPS,
    ROUNDING,
    assert_a_file_keeps,
    assert_a_hold_in_parts_is_a_hold,
    assert_forward_of_inverse_is_the_target,
    assert_open_loop_follows_a_raster,
    assert_peek_tells_the_next_step,
    assert_restored,
    drives,
    hysteresis,
    reference_model,
)
from support import Array, parameter_of

GAIN = mh.plant.SlowGain(85.0, -0.04, 30.0, 0.5)
SHIFT = mh.plant.LoopShift(65.0, 85.0, (-6.0, 2.5), 0.05, 0.4)


def stage(**parts: Any) -> mh.Stage:
    return mh.Stage(hysteresis(), **{"limits": LIMITS, "slow_gain": GAIN, **parts})


def twin(gain: mh.plant.SlowGain, dt: float) -> SlowGain:
    return SlowGain(gain.half_range, gain.amplitude, gain.zero, gain.time_constant, dt)


def finite(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high, allow_nan=False)


def gains() -> st.SearchStrategy[mh.plant.SlowGain]:
    # Half ranges that every move exceeds and that none does, from fast to slow.
    return st.builds(
        mh.plant.SlowGain, finite(10.0, 500.0), finite(-0.5, 0.5), finite(-50.0, 150.0),
        finite(1e-4, 10.0),
    )  # fmt: skip


@given(gains(), drives())
def test_the_stage_is_its_equations(gain: mh.plant.SlowGain, us: list[float]) -> None:
    plain, changed = reference_model(), twin(gain, DT)
    expected = [changed.step(u, plain.step(u)) for u in us]
    got = stage(slow_gain=gain).forward(DT).run(us)
    np.testing.assert_allclose(got, expected, rtol=0, atol=ROUNDING)


@given(gains(), drives())
def test_forward_of_inverse_is_the_target(gain: mh.plant.SlowGain, us: list[float]) -> None:
    creep = mh.plant.Creep([0.01, 0.02], [0.01, 1.0])
    made = stage(slow_gain=gain, creep=creep, loop_shift=SHIFT, **MAPS)
    assert_forward_of_inverse_is_the_target(made, us)


@given(gains(), drives())
def test_peek_changes_nothing_and_tells_the_next_step(
    gain: mh.plant.SlowGain, us: list[float]
) -> None:
    made = stage(slow_gain=gain, loop_shift=SHIFT, **MAPS)
    assert_peek_tells_the_next_step(made, us)


@given(gains(), drives())
def test_a_hold_in_parts_is_a_hold(gain: mh.plant.SlowGain, us: list[float]) -> None:
    made = stage(slow_gain=gain)
    assert_a_hold_in_parts_is_a_hold(made, us)


@pytest.mark.parametrize("shift", [None, SHIFT])
def test_a_restored_state_continues_bit_for_bit(shift: mh.plant.LoopShift | None) -> None:
    made = stage(creep=mh.plant.Creep([0.01], [0.5]), loop_shift=shift, **MAPS)
    assert_restored(made)


def test_open_loop_follows_a_raster_of_a_stage_that_is_written_apart() -> None:
    assert_open_loop_follows_a_raster(stage, lambda dt: {"slow_gain": twin(GAIN, dt)})


def test_a_stage_keeps_its_gain(tmp_path: Path) -> None:
    made = stage()
    assert made.slow_gain == GAIN and stage(slow_gain=None).slow_gain is None
    assert "slow gain" in repr(made) and "slow gain" not in repr(stage(slow_gain=None))
    assert made.replace(slow_gain=None) == stage(slow_gain=None) != made
    assert_a_file_keeps(made, "slow_gain", tmp_path / "stage.json")


def test_ranges_count_the_gain_and_the_bracket_leaves_it_out() -> None:
    with_gain, without = stage(), stage(slow_gain=None)
    changed, plain = with_gain.position_range, without.position_range
    assert changed is not None and plain is not None
    (low, high), (lowest, highest) = changed, plain
    assert low > lowest and high < highest
    assert high == pytest.approx(30.0 + 0.96 * (highest - 30.0), rel=1e-12)
    brackets = [one.bracket() for one in (with_gain, without)]
    for u in (20.0, 90.0, 10.0):
        assert brackets[0].step(u) == brackets[1].step(u)


def test_the_command_line_names_the_gain_and_needs_the_time() -> None:
    assert linear_parts(stage()) == ["slow gain -4.000 %, time constant 0.5000 s"]
    assert not is_static(stage()) and is_static(stage(slow_gain=None))


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"half_range": 0.0}, ValueError, "half_range: expected a number above 0"),
        ({"half_range": "wide"}, TypeError, "half_range: expected a number"),
        ({"amplitude": -0.6}, ValueError, "amplitude: expected a number from -0.5 to 0.5"),
        ({"zero": math.inf}, ValueError, "zero: expected a finite number"),
        ({"time_constant": 0.0}, ValueError, "time_constant: expected a finite number above 0"),
    ],
)
def test_wrong_numbers_are_named(
    change: dict[str, Any], error: type[Exception], message: str
) -> None:
    good: dict[str, Any] = {"half_range": 1.0, "amplitude": 0.1, "zero": 0.0, "time_constant": 1.0}
    with pytest.raises(error) as caught:
        mh.plant.SlowGain(**{**good, **change})
    assert str(caught.value).startswith(message) and ", got " in str(caught.value)
    assert parameter_of(caught.value) == next(iter(change))


def test_what_is_no_slow_gain_is_refused() -> None:
    with pytest.raises(TypeError, match="slow_gain: expected a SlowGain") as caught:
        stage(slow_gain=30.0)
    assert parameter_of(caught.value) == "slow_gain"


def cycles() -> tuple[Array, Array, mh.plant.SlowGain]:
    """Return two minutes of loops of several sizes at rest in between, and what changes them."""
    dt, t = 0.02, 0.02 * np.arange(6000)
    size = np.select([t < 50.0, t < 65.0], [60.0, 0.0], 40.0 - 0.4 * (t - 65.0))
    u = 65.0 + size * np.sin(2.0 * np.pi * 0.5 * t)
    gain = mh.plant.SlowGain(60.0, -0.02, 0.0, 12.0)
    forward = mh.Stage(hysteresis(), slow_gain=gain).forward(dt)
    forward.settle(u[0])
    noise = np.random.default_rng(1).normal(0.0, 0.01, u.size)
    return u, forward.run(u) + noise, gain


PLAIN: dict[str, Any] = {
    **{"dt": 0.02, "operators": 20, "input_offset": 0.0, "dead_time": 0.0, "dynamics": None},
    **{"creep": None, "loop_shift": None, "input_map": None, "output_map": None, "smoothness": 0.0},
}


@pytest.mark.parametrize("asked", [12.0, "fit"])
def test_identify_finds_the_gain(asked: Any) -> None:
    u, y, truth = cycles()
    found = mh.identify(u, y, slow_gain=asked, **PLAIN)
    gain, (of_amplitude, of_tau) = found.slow_gain, found.slow_gain_std
    assert gain is not None and gain.half_range == pytest.approx(0.5 * np.ptp(u))
    # kappa m is what counts, and m goes with the square of the half range.
    amplitude = gain.amplitude * (truth.half_range / gain.half_range) ** 2
    assert amplitude == pytest.approx(truth.amplitude, abs=4.0 * of_amplitude)
    assert 0.0 < of_amplitude < 0.05 * abs(gain.amplitude)
    assert gain.time_constant == pytest.approx(truth.time_constant, abs=4.0 * of_tau)
    assert (of_tau > 0.0) == (asked == "fit")
    # A play that no drive moves stands for an offset: what that moves stays below the noise.
    assert 0.5 * abs(truth.amplitude) * abs(gain.zero) < 0.01
    # um: noise of 0.01, and what twenty even thresholds leave of a hysteresis that has others
    assert found.fit.rmse < 0.012
    assert mh.identify(u, y, **PLAIN).fit.rmse > 0.05
    # The stage does what the fit predicts.
    assert found.stage.slow_gain == gain
    stream = found.stage.forward(0.02)
    stream.settle(u[0])
    np.testing.assert_allclose(stream.run(u), found.predict(u), rtol=0, atol=1e-9)
    assert pickle.loads(pickle.dumps(found)).slow_gain == gain


def test_a_gain_that_is_not_there_is_not_found() -> None:
    u, _, _ = cycles()
    noise = np.random.default_rng(2).normal(0.0, 0.01, u.size)
    found = mh.identify(u, hysteresis().forward().run(u) + noise, slow_gain=12.0, **PLAIN)
    assert found.slow_gain is not None
    assert abs(found.slow_gain.amplitude) < 4.0 * found.slow_gain_std[0]


def tired(u: Array, gain: mh.plant.SlowGain | None) -> Array:
    """Return the positions of a stage that was at rest before."""
    forward = mh.Stage(hysteresis(), slow_gain=gain).forward(0.02)
    forward.settle(u[0])
    return forward.run(u)


def several_sizes() -> tuple[Array, Array]:
    """Return a minute and a half of loops that grow again, with a rest, and noise."""
    t = 0.02 * np.arange(4500)
    sizes = np.array([60.0, 60.0, 60.0, 25.0, 45.0, 0.0, 35.0, 60.0, 50.0])
    u = 65.0 + sizes[(t / 10.0).astype(int)] * np.sin(2.0 * np.pi * 0.5 * t)
    return u, np.random.default_rng(2).normal(0.0, 0.01, u.size)


def test_a_gain_is_chosen_where_it_predicts_better() -> None:
    u, noise = several_sizes()
    # Another time constant than the one that is tried, other sizes and another frequency.
    gain = mh.plant.SlowGain(60.0, -0.02, 0.0, 20.0)
    t = 0.02 * np.arange(3000)
    other = 65.0 + (50.0 - 0.5 * t) * np.sin(2.0 * np.pi * 0.8 * t)
    found = mh.identify(u, tired(u, gain) + noise, dt=0.02)
    assert found.slow_gain is not None and found.slow_gain.time_constant == 30.0
    without = mh.identify(u, tired(u, gain) + noise, dt=0.02, slow_gain=None)
    off, off_without = (
        np.std(np.asarray(one.predict(other, dt=0.02)) - tired(other, gain))
        for one in (found, without)
    )
    assert off < 0.5 * off_without


def test_a_gain_is_not_chosen_where_there_is_none() -> None:
    u, noise = several_sizes()
    assert mh.identify(u, tired(u, None) + noise, dt=0.02).slow_gain is None


def test_a_gain_is_not_chosen_where_no_record_lasts_as_long() -> None:
    u, noise = several_sizes()
    part = slice(1100, 2500)  # 28 s
    y = tired(u, mh.plant.SlowGain(60.0, -0.04, 0.0, 12.0)) + noise
    assert mh.identify(u[part], y[part], dt=0.02).slow_gain is None


def test_a_gain_needs_seconds() -> None:
    u, y, _ = cycles()
    with pytest.raises(ValueError, match="dt: expected") as caught:
        mh.identify(u, y, slow_gain=12.0, **{**PLAIN, "dt": None})
    assert parameter_of(caught.value) == "dt"
    wrong: Any
    for wrong, error in ((0.0, ValueError), ("slow", TypeError)):
        with pytest.raises(error, match="slow_gain: expected") as refused:
            mh.identify(u, y, slow_gain=wrong, **PLAIN)
        assert parameter_of(refused.value) == "slow_gain"
