"""Plants: against their plain twin, the laws of converters, noise, repeatability, wrong input."""

from __future__ import annotations

import math
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
import reference
from hypothesis import given
from hypothesis import strategies as st
from reference import plants as twin
from support import BAD, Array

IDENTITY = mh.PrandtlIshlinskii([1.0], [0.0])
ACTUATOR = mh.paper.table_1_recovered()
DT = 1e-4

WALK = np.random.default_rng(5).uniform(-600.0, 600.0, 500)


def everything(**changes: Any) -> mh.plant.Plant:
    given: dict[str, Any] = {
        "dynamics": mh.plant.SecondOrder(900.0, 0.1),
        "amplifier_bandwidth": 279.0,
        "creep": mh.plant.Creep.logarithmic(0.02, start=1e-3, end=1.0, terms=6),
        "dead_time": 2.5e-4,
        "noise": 0.016,
        "limits": (-500.0, 500.0),
        "dac_bits": 16,
        "adc_bits": 24,
        "adc_range": (-4.0, 4.0),
        "seed": 3,
        "dt": DT,
    }
    return mh.plant.Plant(ACTUATOR, **{**given, **changes})


# ---- the plain twin

SLOW = mh.signals.triangle(3.3, 1.0, seconds=2.0)
"""20 000 samples."""
FAST = mh.signals.sine(3.0, 10.0, seconds=0.4)
"""With an amplifier the twin takes 23 sub-steps per sample: a fifth of the samples."""


@pytest.mark.parametrize(("pole", "ref"), [(None, SLOW), (279.0, FAST)])
def test_a_closed_loop_is_that_of_the_plain_twin(pole: float | None, ref: Array) -> None:
    frequency, damping = (400.0, 0.95) if pole is None else (2000.0, 0.03)
    kp, ki = (60.0, 0.6) if pole is None else (5.0, 0.657)
    plant = mh.plant.Plant(
        ACTUATOR,
        dynamics=mh.plant.SecondOrder(frequency, damping),
        amplifier_bandwidth=pole,
        limits=(-560.0, 560.0),
        dt=DT,
    )
    other = twin.Plant(
        reference.paper_actuator(),
        frequency,
        damping,
        DT,
        amplifier_bandwidth=pole,
        sub_steps=plant.sub_steps,
    )
    columns = ("w_prime", "r_prime", "ra_prime", "rb_prime", "rc_prime")
    table = (reference.TABLE_2[name] for name in columns)
    bank = reference.ModifiedPrandtlIshlinskii(*table)
    feed_forward = mh.paper.table_2().forward()
    run = mh.plant.simulate(twin.PositionalLaw(feed_forward.step, kp, ki), plant, ref)
    law = twin.PositionalLaw(bank.step, kp, ki)
    measured, position, drive = twin.closed_loop(other, law, ref.tolist())
    assert np.ptp(run.position) > 5.9  # um: the loop moves the actuator over its range
    # roundings of 1e-13 V, which the loop neither adds up nor amplifies
    np.testing.assert_allclose(run.measured, measured, rtol=0, atol=1e-9)
    np.testing.assert_allclose(run.position, position, rtol=0, atol=1e-9)
    np.testing.assert_allclose(run.drive, drive, rtol=0, atol=1e-7)


def test_converters_are_those_of_the_plain_twin() -> None:
    """Open loop: in a closed one, a rounding that flips a code would be a step of the converter."""
    plant = mh.plant.Plant(
        ACTUATOR,
        dynamics=mh.plant.SecondOrder(400.0, 0.95),
        limits=(-400.0, 560.0),
        dac_bits=12,
        adc_bits=14,
        adc_range=(-0.4, 1.0),
        dt=DT,
    )
    other = twin.Plant(
        reference.paper_actuator(),
        400.0,
        0.95,
        DT,
        dac=twin.Converter(12, -400.0, 560.0),
        adc=twin.Converter(14, -0.4, 1.0),
    )
    # the plant rests at the level next to zero, the twin at zero: let it go there
    for _ in range(500):
        other.step(0.0)
    measured, position = plant.run(WALK)
    for k, u in enumerate(WALK.tolist()):
        # what is left of the start after 50 ms: exp(-100); roundings of volts
        assert position[k] == pytest.approx(other.position, rel=0, abs=1e-12)
        assert measured[k] == pytest.approx(twin.Converter(14, -0.4, 1.0)(position[k]), abs=1e-12)
        other.step(u)
    assert plant.overrange > 0 and plant.clamped > 0


# ---- the laws of converters, through a plant whose position is its drive; names as in Rust

converters = st.tuples(st.integers(1, 24), st.floats(-1000.0, 1000.0), st.floats(1e-3, 2000.0)).map(
    lambda drawn: (drawn[0], drawn[1], drawn[1] + drawn[2])
)
share = st.floats(-1.0, 2.0) | st.sampled_from([0.0, 0.5, 1.0])


class Converter:
    """Either converter of a plant."""

    def __init__(self, bits: int, low: float, high: float) -> None:
        self.low, self.high, self.step = low, high, (high - low) / (2**bits - 1)
        self.rounding = 8.0 * np.finfo(float).eps * max(abs(low), abs(high))
        self.dac = mh.plant.Plant(IDENTITY, dt=DT, dac_bits=bits, limits=(low, high))
        self.adc = mh.plant.Plant(IDENTITY, dt=DT, adc_bits=bits, adc_range=(low, high))

    def at(self, share: float) -> float:
        return self.low + share * (self.high - self.low)

    def level(self, value: float) -> float:
        level = self.adc.step(value)
        assert level == self.dac.step(value)
        return level


@given(converters, share)
def test_an_output_is_on_the_grid(converter: tuple[int, float, float], x: float) -> None:
    under = Converter(*converter)
    level = under.level(under.at(x))
    code = (level - under.low) / under.step
    assert abs(code - round(code)) * under.step <= under.rounding
    assert under.level(level) == level


@given(converters, share)
def test_an_output_is_within_half_a_step(converter: tuple[int, float, float], x: float) -> None:
    under = Converter(*converter)
    value = under.at(x)
    within = min(max(value, under.low), under.high)
    assert abs(under.level(value) - within) <= 0.5 * under.step + under.rounding


@given(converters, share, share)
def test_a_converter_is_monotone(converter: tuple[int, float, float], x: float, y: float) -> None:
    under = Converter(*converter)
    assert under.level(under.at(min(x, y))) <= under.level(under.at(max(x, y)))


@given(converters, share)
def test_a_converter_clamps(converter: tuple[int, float, float], x: float) -> None:
    under = Converter(*converter)
    assert under.low <= under.level(under.at(x)) <= under.high
    assert (under.level(under.low), under.level(under.high)) == (under.low, under.high)
    assert (under.level(-1e100), under.level(1e100)) == (under.low, under.high)
    assert min(under.dac.clamped, under.adc.overrange) >= 2


@given(st.floats(-20.0, 20.0), st.sampled_from(BAD))
def test_nan_is_held_and_counted(drive: float, bad: float) -> None:
    plant = mh.plant.Plant(IDENTITY, dt=DT, limits=(-10.0, 10.0), dac_bits=8)
    put_out = plant.step(drive)
    assert (plant.step(bad), plant.drive, plant.rejected) == (put_out, put_out, 1)
    assert plant.clamped == (abs(drive) > 10.0)


# ---- noise


def test_noise_has_its_rms_and_is_white_and_normal() -> None:
    plant = mh.plant.Plant(IDENTITY, dt=DT, noise=0.016, seed=11)
    measured, position = plant.run(np.zeros(100_000))
    assert not position.any()
    normal, n = measured / 0.016, measured.size
    # five standard deviations of each estimate: of the mean, the variance, the kurtosis
    assert abs(normal.mean()) < 5.0 / math.sqrt(n)
    assert abs((normal**2).mean() - 1.0) < 5.0 * math.sqrt(2.0 / n)
    assert abs((normal**4).mean() - 3.0) < 5.0 * math.sqrt(96.0 / n)
    for lag in (1, 2, 10):
        assert abs((normal[lag:] * normal[:-lag]).mean()) < 5.0 / math.sqrt(n)


def test_a_seed_has_its_numbers() -> None:
    """Part of the interface: those of the test of the same name in Rust."""
    plant = mh.plant.Plant(IDENTITY, dt=DT, noise=1.0)
    first = [plant.measured, plant.step(0.0), plant.step(0.0)]
    assert first == [-0.29280329860470816, -0.7131206168144315, -0.1053211603531886]


# ---- time


def test_the_measurement_of_now_is_that_before_the_drive() -> None:
    plant = mh.plant.Plant(IDENTITY, dt=DT, dead_time=2.0 * DT)
    assert [plant.step(u) for u in (1.0, 2.0, 3.0, 4.0)] == [0.0, 0.0, 1.0, 2.0]
    assert plant.measured == plant.position == 2.0


def test_a_reset_plant_and_one_of_the_same_seed_give_the_same_numbers() -> None:
    plant = everything()
    start = plant.measured
    first = plant.run(WALK)
    assert plant.clamped > 0
    twin_of_now = plant.copy()
    assert np.array_equal(twin_of_now.run(WALK), plant.run(WALK))
    plant.reset()
    assert (plant.measured, plant.clamped, plant.rejected) == (start, 0, 0)
    assert np.array_equal(plant.run(WALK), first)
    assert np.array_equal(everything().run(WALK), first)
    measured, position = everything(seed=4).run(WALK)
    assert np.array_equal(position, first[1]) and not np.array_equal(measured, first[0])


def test_run_is_step_in_a_loop() -> None:
    drives = np.concatenate([WALK[:50], BAD, WALK[50:100]])
    plant, other = everything(), everything()
    measured, position = plant.run(drives)
    for k, u in enumerate(drives.tolist()):
        # row k is read before drive k is put out; the two ways add up their parts in another order
        assert other.position == pytest.approx(position[k], rel=0, abs=1e-14)
        assert other.measured == measured[k]
        assert other.step(u) == other.measured
    assert plant.rejected == other.rejected == len(BAD)


def test_a_plant_rests_where_the_drive_is_nearest_to_zero() -> None:
    assert mh.plant.Plant(IDENTITY, dt=DT, limits=(2.0, 3.0)).position == 2.0
    plant = everything(noise=0.0)
    rest, drive = plant.position, plant.drive
    measured, position = plant.run(np.zeros(1000))
    assert (position == rest).all() and (measured == plant.measured).all() and plant.drive == drive


def test_linear_parts_are_their_responses() -> None:
    """Without an amplifier a plant is the model, then the response of each block."""
    creep = mh.plant.Creep([0.1], [0.01])
    stage = mh.plant.SecondOrder(900.0, 0.1)
    _, position = mh.plant.Plant(ACTUATOR, dynamics=stage, creep=creep, dt=DT).run(WALK)
    displacement = ACTUATOR.forward().run(WALK)
    expected = creep.response(stage.response(displacement, DT), DT)
    # the parts are added up in another order: roundings of up to 8 um
    np.testing.assert_allclose(position, expected, rtol=0, atol=1e-13)


# ---- wrong input


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"dynamics": 400.0}, TypeError, "dynamics: expected FirstOrder, SecondOrder, "),
        (
            {"amplifier_bandwidth": 0.0},
            ValueError,
            "amplifier_bandwidth: expected a finite number above 0",
        ),
        ({"creep": 0.01}, TypeError, "creep: expected a Creep, got 0.01"),
        ({"dead_time": -1.0}, ValueError, "dead_time: expected"),
        ({"noise": math.nan}, ValueError, "noise: expected a finite number >= 0, got NaN"),
        ({"dac_bits": 33}, ValueError, "dac_bits: expected a whole number from 1 to 32, got 33"),
        ({"dac_bits": 0}, ValueError, "dac_bits: expected a whole number of at least one, got 0"),
        ({"dac_bits": 8, "limits": None}, ValueError, "limits: expected .low, high. for the 8"),
        ({"adc_bits": 16.5}, ValueError, "adc_bits: expected a whole number of at least one, got"),
        ({"adc_range": None}, ValueError, "adc_range: expected .low, high. for adc_bits"),
        ({"adc_bits": None}, ValueError, "adc_bits: expected the bits that span adc_range"),
        ({"adc_range": 5.0}, TypeError, "adc_range: expected two numbers .low, high., got 5.0"),
        ({"limits": (1.0, 1.0)}, ValueError, r"limits\[1\]: expected a number above the low limit"),
        ({"limits": (math.nan, 1.0)}, ValueError, r"limits\[0\]: expected a finite number"),
        ({"dt": 0.0}, ValueError, "dt: expected a finite number > 0"),
        ({"seed": -1}, ValueError, "seed: expected a whole number of at least zero, got -1"),
    ],
)
def test_what_no_plant_can_have_is_named(
    arguments: dict[str, Any], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=f"^{message}"):
        everything(**arguments)


def test_the_hysteresis_must_be_a_model() -> None:
    with pytest.raises(TypeError, match=r"^stage: expected a"):
        mh.plant.Plant(ACTUATOR.forward(), dt=DT)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"^drives: expected a one-dimensional array"):
        everything().run([[1.0]])


def test_benchmark_plants_are_known_by_name() -> None:
    with pytest.raises(ValueError, match=r'^name: expected "A1" or "P3", got "B"'):
        mh.paper.plant("B")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r'^name: expected "A1" or "P3", got "a1"'):
        mh.paper.gains("a1")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"^seed: expected a whole number"):
        mh.paper.plant("A1", seed=-3)


def noise_of(plant: mh.plant.Plant) -> Array:
    measured, position = plant.run(np.zeros(20_000))
    return measured - position


def test_benchmark_plants_are_those_of_the_table() -> None:
    given = {"A1": (400.0, 0.95, None, 0.0160), "P3": (2000.0, 0.03, 279.0, 0.0164)}
    names: list[Any] = ["A1", "P3"]
    for name in names:
        frequency, damping, pole, rms = given[name]
        plant = mh.paper.plant(name, seed=2)
        assert (plant.limits, plant.dt) == ((-560.0, 560.0), 1e-4)
        stage = mh.plant.SecondOrder(frequency, damping)
        other = mh.plant.Plant(
            ACTUATOR, dynamics=stage, amplifier_bandwidth=pole, limits=(-560, 560), dt=DT
        )
        assert np.array_equal(plant.run(WALK)[1], other.run(WALK)[1])
        # 20 000 samples tell an rms to 0.5 %
        assert noise_of(plant).std() == pytest.approx(rms, rel=0.02)
