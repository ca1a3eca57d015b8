"""Identification of linear dynamics behind a known hysteresis, and how it doubts itself."""

from __future__ import annotations

import math
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from stack_stage import hysteresis
from support import Array

DT = 1e-4
NOISE = 0.016
"""um rms, as on the benchmark plants."""

MODEL = mh.paper.table_1_recovered()


def codes(found: mh.results.DynamicsIdentification) -> list[str]:
    return [finding.code for finding in found.warnings]


# ---- records


def chirp(samples: int, amplitude: float = 150.0, last: float = 4500.0) -> Array:
    """A sweep from 5 Hz, linear in time."""
    t, seconds = np.arange(samples) * DT, samples * DT
    signal: Array = amplitude * np.sin(2 * np.pi * (5.0 + (last - 5.0) * t / (2 * seconds)) * t)
    return signal


def steps(samples: int, amplitude: float = 400.0) -> Array:
    """Up and down again, four times."""
    place = np.arange(samples) % (samples // 4)
    return np.where(place < samples // 8, 0.0, amplitude)


FINE = 10
"""Parts of an interval: the dead times below are tenths of one, so that a delay is a shift."""


def held(v: Array, delay: float) -> Array:
    """Each value held over an interval, later by the delay in intervals, at rest before."""
    fine = np.repeat(v, FINE)
    return np.concatenate([np.full(round(FINE * delay), v[0]), fine])[: fine.size]


Dynamics = mh.plant.SecondOrder | mh.plant.FirstOrder


def plant(u: Array, dynamics: Dynamics, delay: float, seed: int | None = None) -> Array:
    """Rows of a record: y is read as u is put out."""
    y = dynamics.response(held(MODEL.forward().run(u), delay), DT / FINE)[::FINE]
    if seed is not None:
        y = y + np.random.default_rng(seed).normal(0.0, NOISE, u.size)
    return y


def second(found: mh.results.DynamicsIdentification) -> mh.plant.SecondOrder:
    assert isinstance(found.dynamics, mh.plant.SecondOrder)
    return found.dynamics


RECORDS = {"chirp": chirp, "steps": steps}

CASES = [
    (400.0, 0.02, 1.3),
    (400.0, 0.9, 0.0),
    (1000.0, 0.3, 3.0),
    (2000.0, 0.02, 2.0),
    (2000.0, 0.6, 0.4),
    (3000.0, 0.1, 1.0),
]


@pytest.mark.parametrize(("frequency", "damping", "delay"), CASES)
@pytest.mark.parametrize("record", RECORDS)
def test_without_noise_second_order_comes_back(
    record: str, frequency: float, damping: float, delay: float
) -> None:
    u = RECORDS[record](4000)
    y = plant(u, mh.plant.SecondOrder(frequency, damping), delay)
    found = mh.identify_dynamics(u, y, MODEL, dt=DT)
    # where a search ends: squared errors near 1e-26 of the range
    assert second(found).frequency == pytest.approx(frequency, rel=1e-9)
    assert second(found).damping == pytest.approx(damping, rel=1e-8)
    assert found.dead_time / DT == pytest.approx(delay, abs=1e-8)
    assert found.gain == pytest.approx(1.0, rel=1e-9) and abs(found.output_offset) < 1e-9
    assert codes(found) == [] and found.creep is None
    assert found.fit.rmse < 1e-11 * np.ptp(y)


@pytest.mark.parametrize("record", RECORDS)
@pytest.mark.parametrize("frequency", [100.0, 279.0, 1000.0])
def test_without_noise_a_lag_comes_back(record: str, frequency: float) -> None:
    u = RECORDS[record](4000)
    found = mh.identify_dynamics(
        u, plant(u, mh.plant.FirstOrder(frequency), 0.7), MODEL, dt=DT, order=1
    )
    assert isinstance(found.dynamics, mh.plant.FirstOrder)
    assert found.dynamics.frequency == pytest.approx(frequency, rel=1e-9)
    assert found.dead_time / DT == pytest.approx(0.7, abs=1e-8)
    assert found.damping_std == 0.0 and codes(found) == []


@pytest.mark.parametrize(("frequency", "damping", "delay"), CASES)
def test_with_16_nm_of_noise_a_chirp_of_a_second_tells_enough(
    frequency: float, damping: float, delay: float
) -> None:
    u = chirp(10_000)
    y = plant(u, mh.plant.SecondOrder(frequency, damping), delay, seed=7)
    found = mh.identify_dynamics(u, y, MODEL, dt=DT)
    # the accuracy that feed-forward of the dynamics asks for
    assert second(found).frequency == pytest.approx(frequency, rel=0.005)
    assert second(found).damping == pytest.approx(damping, rel=0.03)
    assert found.dead_time / DT == pytest.approx(delay, abs=0.05)
    # rms of 10000 samples is known to 0.7 %
    assert found.noise == pytest.approx(NOISE, rel=0.03)
    assert codes(found) == []


@pytest.mark.parametrize(
    ("frequency", "damping", "delay"), [case for case in CASES if case[1] <= 0.3]
)
def test_with_16_nm_of_noise_steps_tell_enough_of_a_resonance(
    frequency: float, damping: float, delay: float
) -> None:
    u = steps(10_000)
    y = plant(u, mh.plant.SecondOrder(frequency, damping), delay, seed=8)
    found = mh.identify_dynamics(u, y, MODEL, dt=DT)
    assert second(found).frequency == pytest.approx(frequency, rel=0.005)
    assert second(found).damping == pytest.approx(damping, rel=0.03)
    assert found.dead_time / DT == pytest.approx(delay, abs=0.05)


def test_standard_deviations_are_those_of_many_records() -> None:
    runs, u = 120, chirp(1000)
    true = np.array([800.0, 0.15, 1.4 * DT])
    clean = plant(u, mh.plant.SecondOrder(800.0, 0.15), 1.4)
    rng = np.random.default_rng(11)
    estimates, stds = [], []
    for _ in range(runs):
        y = clean + rng.normal(0.0, NOISE, u.size)
        found = mh.identify_dynamics(u, y, MODEL, dt=DT)
        estimates.append((second(found).frequency, second(found).damping, found.dead_time))
        stds.append((found.frequency_std, found.damping_std, found.dead_time_std))
    errors, spread = np.array(estimates) - true, np.array(stds)
    # the standard deviation of 120 draws is known to 6.5 %: three of those
    np.testing.assert_allclose(errors.std(axis=0), spread.mean(axis=0), rtol=0.2)
    # no bias beyond three standard deviations of the mean
    assert (np.abs(errors.mean(axis=0)) < 3.0 * spread.mean(axis=0) / math.sqrt(runs)).all()
    # 95 % of 120: 114 +- 2.4, three of those
    covered = (np.abs(errors) < 1.96 * spread).sum(axis=0)
    assert ((covered >= 107) & (covered <= 120)).all()


def test_covariance_names_its_rows() -> None:
    u = chirp(2000)
    y = plant(u, mh.plant.SecondOrder(800.0, 0.15), 1.4, seed=2)
    found = mh.identify_dynamics(u, y, MODEL, dt=DT, creep=[0.05])
    names = ["gain", "dead_time", "frequency", "damping", "creep[0]", "output_offset"]
    assert found.parameters == names
    assert found.covariance.shape == (6, 6)
    np.testing.assert_allclose(found.covariance, found.covariance.T)
    stds = [found.dead_time_std, found.frequency_std, found.damping_std, *found.creep_std]
    np.testing.assert_allclose(np.sqrt(np.diag(found.covariance))[1:5], stds)
    assert found.creep_std.shape == (1,)
    fixed = mh.identify_dynamics(u, y, MODEL, dt=DT, dead_time=1.4 * DT)
    assert (
        fixed.dead_time == 1.4 * DT
        and fixed.dead_time_std == 0.0
        and "dead_time" not in fixed.parameters
    )


def test_creep_is_fitted_with_the_dynamics() -> None:
    u = steps(20_000)
    creep = mh.plant.Creep([0.03, 0.05], [0.02, 0.2])
    clean = creep.response(plant(u, mh.plant.SecondOrder(900.0, 0.05), 1.0), DT)
    exact = mh.identify_dynamics(u, clean, MODEL, dt=DT, creep=creep.time_constants)
    assert exact.creep is not None
    np.testing.assert_allclose(exact.creep.amplitudes, creep.amplitudes, rtol=1e-6)
    y = clean + np.random.default_rng(4).normal(0.0, NOISE, u.size)
    found = mh.identify_dynamics(u, y, MODEL, dt=DT, creep=[0.02, 0.2])
    assert found.creep is not None
    np.testing.assert_allclose(found.creep.amplitudes, creep.amplitudes, rtol=0.05)
    assert second(found).frequency == pytest.approx(900.0, rel=0.005)
    assert second(found).damping == pytest.approx(0.05, rel=0.03)
    assert codes(found) == []
    without = mh.identify_dynamics(u, y, MODEL, dt=DT)
    assert "residual_coloured" in codes(without)
    assert without.fit.rmse > 1.5 * found.fit.rmse
    counted = mh.identify_dynamics(u, y, MODEL, dt=DT, creep=2)
    assert counted.creep is not None
    np.testing.assert_allclose(counted.creep.time_constants, [2 / 30, 2 / 3], rtol=1e-12)


def test_predict_is_the_whole_cascade() -> None:
    u = 30.0 + chirp(4000)
    creep = mh.plant.Creep([0.04], [0.02])
    moved = MODEL.forward().run(u)
    # at rest at its first value before the record
    creeping = held(creep.response(moved - moved[0], DT), 1.5)
    moving = mh.plant.SecondOrder(900.0, 0.1).response(creeping, DT / FINE)[::FINE]
    y = 7.0 + 0.98 * (moved[0] * 1.04 + moving)
    found = mh.identify_dynamics(u, y, MODEL, dt=DT, creep=[0.02], skip=100)
    assert found.gain == pytest.approx(0.98, rel=1e-6)
    assert found.output_offset == pytest.approx(7.0, abs=1e-6)
    np.testing.assert_allclose(found.predict(u), y, rtol=0, atol=1e-8)
    assert found.fit.samples == 3900 and found.model is MODEL and found.dt == DT
    residual = np.abs(found.predict(u) - y)[100:].max()
    assert found.fit.max_error == pytest.approx(residual, abs=1e-12)
    assert found.predict([]).shape == (0,)
    with pytest.raises(ValueError, match=r"^u\[1\]: expected a finite number"):
        found.predict([1.0, math.nan])
    assert "SecondOrder" in repr(found) and found.evaluations > 0


# ---- what makes the numbers doubtful is named


@pytest.mark.parametrize("seed", [1, 3, 4, 5])
@pytest.mark.parametrize(("frequency", "damping"), [(2000.0, 0.03), (400.0, 0.95)])
def test_a_record_that_does_not_reach_the_resonance_says_so(
    frequency: float, damping: float, seed: int
) -> None:
    # noise alone feigns sharp resonances here, some of them with small standard deviations
    u = mh.signals.triangle(450.0, 1.0, seconds=1.0, rate=1 / DT)
    y = plant(u, mh.plant.SecondOrder(frequency, damping), 0.0, seed=seed)
    found = mh.identify_dynamics(u, y, MODEL, dt=DT)
    assert "resonance_not_excited" in codes(found)
    # so it claims no resonance, but keeps the lag of the record
    assert found.dynamics is None or second(found).damping == 1.0
    lag = 2.0 * damping / (2.0 * math.pi * frequency)
    if found.dynamics is None:
        lag += DT / 2.0  # of the held input, which a dead time alone has to make up for
    assert found.lag == pytest.approx(lag, abs=4.0 * found.lag_std)


def test_another_gain_says_so() -> None:
    u = chirp(3000)
    y = 1.1 * plant(u, mh.plant.SecondOrder(800.0, 0.1), 0.0)
    found = mh.identify_dynamics(u, y, MODEL, dt=DT)
    assert found.gain == pytest.approx(1.1, rel=1e-9) and codes(found) == ["gain_not_one"]


def test_what_is_not_modelled_colours_the_residual() -> None:
    u = chirp(3000)
    y = plant(u, mh.plant.SecondOrder(800.0, 0.1), 0.0, seed=6)
    hum = 0.03 * np.sin(2 * np.pi * 50.0 * DT * np.arange(u.size))
    found = mh.identify_dynamics(u, y + hum, MODEL, dt=DT)
    assert codes(found) == ["residual_coloured"]
    coloured = found.warnings[0]
    assert coloured.value == pytest.approx(0.03 / np.sqrt(2.0) / np.ptp(y), rel=0.1)
    # Far below the noise a long record tells it as surely, and it does not matter.
    assert coloured.value > coloured.limit
    faint = mh.identify_dynamics(u, y + 0.3 * coloured.limit / coloured.value * hum, MODEL, dt=DT)
    assert codes(faint) == []


@pytest.mark.parametrize("time_constant", [5.0, 0.01])
def test_creep_that_a_record_is_too_short_for_is_not_told(time_constant: float) -> None:
    u = chirp(3000)
    y = plant(u, mh.plant.SecondOrder(800.0, 0.1), 0.0, seed=6)
    found = mh.identify_dynamics(u, y, MODEL, dt=DT, creep=[time_constant])
    assert codes(found) == ["creep_undetermined"]


# ---- wrong input


def refusal(kind: type[Exception], *arguments: Any, **options: Any) -> str:
    with pytest.raises(kind) as caught:
        mh.identify_dynamics(*arguments, **{"dt": DT, **options})
    assert type(caught.value) is kind
    return str(caught.value)


def test_wrong_input_is_named() -> None:
    u = chirp(500)
    y = plant(u, mh.plant.SecondOrder(800.0, 0.1), 0.0)
    bad = y.copy()
    bad[3] = math.nan
    flat = np.full(500, 2.0)
    assert refusal(ValueError, u, y[1:], MODEL) == "y: expected 500 samples, got 499"
    assert refusal(ValueError, u, bad, MODEL).startswith("y[3]: expected a finite number")
    assert refusal(ValueError, flat, y, MODEL).startswith("u: expected fitted samples that vary")
    dead = mh.PrandtlIshlinskii([1.0], [500.0])
    assert refusal(ValueError, u, y, dead).startswith("output of the model: expected fitted samp")
    for dt in (0.0, -1e-4, math.nan, math.inf):
        assert refusal(ValueError, u, y, MODEL, dt=dt).startswith("dt: expected a finite number of")
    assert refusal(ValueError, u[:9], y[:9], MODEL) == (
        "records: expected at least 10 fitted samples (twice the unknowns), got 9"
    )
    assert refusal(ValueError, u, y, MODEL, order=3) == "order: expected 1 or 2, got 3"
    assert refusal(ValueError, u, y, MODEL, skip=500).startswith("skip: expected fewer than the 5")
    assert refusal(ValueError, u, y, MODEL, skip=-1).startswith("skip: expected a number of sampl")
    for delay in (-1.0, 500.0, math.nan):
        message = refusal(ValueError, u, y, MODEL, dead_time=delay * DT)
        assert message.startswith(
            "dead_time: expected a number >= 0 below the length of the shortest record"
        )
    assert refusal(TypeError, u, y, MODEL, dead_time="none").startswith(
        'dead_time: expected "fit" or a n'
    )
    assert refusal(ValueError, u, y, MODEL, creep=3).startswith("creep: expected a number of terms")
    assert refusal(ValueError, u, y, MODEL, creep=0).startswith("creep: expected a number of terms")
    message = refusal(ValueError, u, y, MODEL, creep=[0.1, 0.1])
    assert message.startswith("creep[1]: expected time constants in seconds")
    assert refusal(TypeError, u, y, 3.0).startswith("model: expected a PrandtlIshlinskii or a Mod")


@pytest.mark.parametrize("seed", [1, 2])
def test_what_is_found_by_default_never_leads(seed: int) -> None:
    # A mode beyond half the rate of the samples, behind an amplifier: dynamics that answer before
    # the drive fit it best, and nothing can run those.
    dt, finer = 1e-3, 20
    mode = mh.plant.SecondOrder(850.0, 0.03)
    truth = mh.Stage(hysteresis(), amplifier_bandwidth=369.0, dynamics=mode)
    t = np.arange(12_000) * dt
    decaying = 60.0 * np.exp(-t / 6.0) * np.sin(2.0 * np.pi * t)
    chirp = 50.0 * np.sin(2.0 * np.pi * (5.0 * t[:4000] + 5.0 * t[:4000] ** 2))
    u = 60.0 + np.concatenate([decaying, chirp])
    y = truth.forward(dt / finer).run(np.repeat(u, finer))[::finer]
    noise = 0.02 * np.random.default_rng(seed).standard_normal(u.size)
    found = mh.identify(u, y + noise, dt=dt)
    assert found.dead_time is not None and found.dead_time >= 0.0
    assert "negative_dead_time" not in {warning.code for warning in found.warnings}
    assert np.isfinite(found.stage.forward(dt).run(u)).all()
