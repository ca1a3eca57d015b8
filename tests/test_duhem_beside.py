"""A stage with a Duhem operator beside its plays: laws, a plain twin, identification."""

from __future__ import annotations

import copy
import math
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from law_stages import DT as LAW_DT
from law_stages import Stage, alike, lagged, measured, named, varied, way
from law_stages import loops as loops_of
from mpi_hyst._cli.stage import is_static
from mpi_hyst._report.models import linear_parts
from reference.duhem import Duhem
from stack_stage import (
    DT,
    LIMITS,
    ROUNDING,
    assert_a_file_keeps,
    assert_forward_of_inverse_is_the_target,
    assert_peek_tells_the_next_step,
    assert_restored,
    drives,
    hysteresis,
    reference_model,
)
from support import Array, parameter_of

OFFSET = 10.0
KNOTS, RISING, FALLING = [-30.0, 0.0, 30.0], [0.9, 0.5, 0.1], [0.1, 0.5, 0.7]
MAPS: dict[str, Any] = {
    "input_map": ([-20.0, 40.0, 150.0], [-20.0, 45.0, 150.0]),
    "output_map": ([-50.0, 60.0, 200.0], [-50.0, 55.0, 200.0]),
}


def stage(**parts: Any) -> mh.Stage:
    duhem = mh.Duhem(KNOTS, RISING, FALLING)
    return mh.Stage(hysteresis(OFFSET), **{"limits": LIMITS, "duhem": duhem, **parts})


@given(drives())
def test_the_stage_is_its_equations(us: list[float]) -> None:
    plays, beside = reference_model(), Duhem(KNOTS, RISING, FALLING)
    xs = [u - OFFSET for u in [max(LIMITS[0], 0.0), *us]]
    expected = [plays.step(x) + beside.step(x) for x in xs][1:]
    np.testing.assert_allclose(stage().forward(DT).run(us), expected, rtol=0, atol=ROUNDING)


@given(drives())
def test_forward_of_inverse_is_the_target(us: list[float]) -> None:
    made = stage(creep=mh.plant.Creep([0.01, 0.02], [0.01, 1.0]), **MAPS)
    assert_forward_of_inverse_is_the_target(made, us)


@given(drives())
def test_peek_changes_nothing_and_tells_the_next_step(us: list[float]) -> None:
    assert_peek_tells_the_next_step(stage(**MAPS), us)


@given(drives(), st.integers(2, 5))
def test_rate_and_sampling_independence(us: list[float], parts: int) -> None:
    once, often = stage().forward(DT), stage().forward(DT)
    last = us[0]
    for u in us:
        for part in range(1, parts):
            often.step(last + (u - last) * part / parts)
        assert once.step(u) == pytest.approx(often.step(u), abs=ROUNDING)
        last = u


def test_a_restored_state_continues_bit_for_bit() -> None:
    shift = mh.plant.LoopShift(65.0, 85.0, (-6.0, 2.5), 0.05, 0.4)
    made = stage(loop_shift=shift, **MAPS)
    us = 60.0 + 60.0 * np.sin(0.05 * np.arange(300))
    for stream, saved, other in assert_restored(made):
        # the last number says whether the drive rose
        wrong = copy.deepcopy(saved)
        inner = wrong["stream"].get("quasi_static", wrong["stream"])
        inner["loop_shift"][-1] = 0.0
        with pytest.raises(
            ValueError, match="1 where x rose last, or -1, as the last number, got 0"
        ):
            stream.state = wrong
        np.testing.assert_array_equal(stream.run(us), other.run(us))


def test_a_stage_keeps_its_operator(tmp_path: Path) -> None:
    made, plays = stage(), stage(duhem=None)
    assert made.duhem is not None and plays.duhem is None
    assert made.duhem.knots.tolist() == KNOTS and made.duhem.falling.tolist() == FALLING
    assert "Duhem operator" in repr(made) and "Duhem" not in repr(plays)
    assert made.replace(duhem=None) == plays != made
    assert_a_file_keeps(made, "duhem", tmp_path / "stage.json")
    # What is given is its parameters: a stage begins at rest.
    used = mh.Duhem(KNOTS, RISING, FALLING)
    used.step(100.0)
    assert stage(duhem=used) == made and made.duhem.step(0.0) == 0.0


def test_reports_name_the_operator() -> None:
    assert linear_parts(stage()) == ["Duhem operator of 3 knots"]
    assert is_static(stage())


def test_what_is_no_operator_is_refused() -> None:
    with pytest.raises(TypeError, match=r"duhem: expected a mh\.Duhem") as caught:
        stage(duhem=30.0)
    assert parameter_of(caught.value) == "duhem"
    with pytest.raises(ValueError, match="duhem: expected") as caught_value:
        stage().bracket()
    assert parameter_of(caught_value.value) == "duhem"


def bouc_wen(u: Array, beta: float, gamma: float) -> Array:
    """Return 40 z of z' = v' - beta |v'| z - gamma v' |z|, v = u / 50, by small Euler steps."""
    parts, z, v, found = 40, 0.0, 0.0, []
    for end in u / 50.0:
        dv = (end - v) / parts
        for _ in range(parts):
            mid = z + 0.5 * (dv - beta * abs(dv) * z - gamma * dv * abs(z))
            z += dv - beta * abs(dv) * mid - gamma * dv * abs(mid)
        v = end
        found.append(40.0 * z)
    return np.array(found)


def loops() -> Array:
    """Return loops of several sizes."""
    t = np.arange(3000) / 500.0
    size = np.select([t < 2.0, t < 4.0], [50.0, 25.0], 50.0 - 20.0 * (t - 4.0))
    return size * np.sin(2.0 * np.pi * t)


QUASI_STATIC: dict[str, Any] = {
    **{"dt": 2e-3, "operators": 20, "dead_time": 0.0, "dynamics": None, "creep": None},
    **{"loop_shift": None, "input_map": None, "output_map": None},
}


def test_identify_chooses_the_operator_where_plays_fail() -> None:
    u = loops()
    y = 0.3 * u + bouc_wen(u, 1.4, 0.6)
    y += np.random.default_rng(1).normal(0.0, 2e-4 * np.ptp(y), u.size)
    plays = mh.identify(u, y, duhem=None, **QUASI_STATIC)
    found = mh.identify(u, y, **QUASI_STATIC)
    assert plays.duhem is None and plays.stage.duhem is None
    assert found.duhem is not None
    assert found.fit.rmse < 0.3 * plays.fit.rmse
    # The stage does what the fit predicts.
    stream = found.stage.forward(2e-3)
    stream.settle(u[0])
    np.testing.assert_allclose(stream.run(u), found.predict(u), rtol=0, atol=1e-9)
    again = pickle.loads(pickle.dumps(found))
    np.testing.assert_array_equal(again.duhem.rising, found.duhem.rising)
    # From where it was.
    near = mh.identify(u, y, duhem=found.duhem, **QUASI_STATIC)
    assert near.fit.rmse < 1.05 * found.fit.rmse


@pytest.mark.parametrize("record", [varied, alike])
def test_identify_finds_what_the_piezo_form_subtracts(record: Callable[[Stage], Array]) -> None:
    kind = named("Bouc-Wen")
    u, other = record(kind), loops_of(kind, [0.7, 0.9, 0.35, 0.6])
    found = mh.identify(u, measured(kind, u), dt=LAW_DT)
    plays = mh.identify(u, measured(kind, u), dt=LAW_DT, duhem=None)
    assert found.duhem is not None and found.duhem.rising.max() < 0.0
    true = kind.position(other)
    with_it, without = (np.std(fit.predict(other) - true) for fit in (found, plays))
    assert with_it < 3e-4 * np.ptp(true) and with_it < 0.1 * without
    # It has an inverse.
    inverse, forward = found.stage.inverse(LAW_DT), found.stage.forward(LAW_DT)
    targets = np.linspace(-20.0, 20.0, 200)
    np.testing.assert_allclose(
        forward.run(inverse.run(targets))[50:], targets[50:], rtol=0, atol=1e-9
    )


def test_what_adds_to_the_drive_is_found_on_like_loops() -> None:
    # The position is steepest after a turn: the loops are traversed backwards, and what plays
    # leave looks like a drift.
    kind = Stage("backwards", -50.0, 50.0, lambda u: u + 0.5 * bouc_wen(u, 1.0, 0.6))
    u, other = alike(kind), loops_of(kind, [0.7, 0.9, 0.35, 0.6])
    found = mh.identify(u, measured(kind, u), dt=LAW_DT)
    true = kind.position(other)
    assert found.duhem is not None
    assert np.std(found.predict(other) - true) < 5e-4 * np.ptp(true)


@pytest.mark.parametrize("drive", [alike, varied])
def test_an_operator_alone_is_found_and_inverted(drive: Callable[[Stage], Array]) -> None:
    # Plays beside it would have no slope after a turn, and no inverse.
    def position(u: Array) -> Array:
        return mh.Duhem.from_bouc_wen(0.8, 0.02, 0.8, 0.3).run(u)

    kind = Stage("alone", -50.0, 50.0, position)
    u, other = drive(kind), loops_of(kind, [0.7, 0.9, 0.35, 0.6])
    found = mh.identify(u, measured(kind, u), dt=LAW_DT)
    true = position(other)
    assert found.duhem is not None and found.model.weights[0] < 1e-5
    assert np.std(found.predict(other) - true) < 2e-4 * np.ptp(true)
    stage = found.stage.replace(dynamics=None, dead_time=0.0, creep=None)
    targets = np.linspace(0.0, 0.3 * np.ptp(true), 200)
    reached = stage.forward(LAW_DT).run(stage.inverse(LAW_DT).run(targets))
    np.testing.assert_allclose(reached, targets, rtol=0, atol=1e-10)


def test_a_mode_that_rings_in_the_chirp_does_not_hide_an_operator() -> None:
    # What plays leave of the chirp grows towards its low end: no transient that spoils the loops.
    truth = mh.Stage(
        mh.PrandtlIshlinskii([0.02], [0.0]),
        duhem=mh.Duhem.from_bouc_wen(0.5, 0.05, 0.8, 0.3),
        dynamics=mh.plant.SecondOrder(330.0, 0.02),
    )
    parts = mh.signals.experiment(
        -50.0, 50.0, slew=1e3, rate=500.0, fast_rate=5e3, cycles=8, rest=4.0
    )
    rng, noise = np.random.default_rng(3), 1e-2
    positions = [truth.forward(1.0 / part.rate).run(part.drive) for part in parts]
    records = [
        (part.drive, y + rng.normal(0.0, noise, y.size))
        for part, y in zip(parts, positions, strict=True)
    ]
    found = mh.identify(records, dt=[1.0 / part.rate for part in parts])
    assert found.duhem is not None
    assert found.fit.rmse < 1.1 * noise


def test_an_operator_that_leaves_more_than_noise_of_like_loops_is_left_out() -> None:
    # Many operators follow loops of one size. That which was taken here missed others by 1.3 %.
    def position(u: Array) -> Array:
        x = 75.0 * np.tanh((u + 0.065 * bouc_wen(u, 2.0, 0.25)) / 75.0)
        creep = 0.05493 * lagged(x, 1.376) + 0.02746 * lagged(x, 0.1476) - 0.0824 * x[0]
        return np.asarray(x + creep, float)

    kind = Stage("bent, with creep", 0.0, 100.0, position)
    u, other = alike(kind), loops_of(kind, [0.95, 0.5, 0.8, 0.35, 0.7])
    found = mh.identify(u, measured(kind, u, 5), dt=LAW_DT)
    assert found.duhem is None
    true = position(other)
    assert np.std(found.predict(other) - true) < 6e-3 * np.ptp(true)


def test_of_both_directions_the_one_that_predicts_better_is_taken() -> None:
    operator = (0.3692610938, 0.0138559287, 0.6269512447, -0.2514947166)
    plays = mh.PrandtlIshlinskii([0.8, 0.05, 0.05], [0.0, 8.0, 25.0])

    def position(u: Array) -> Array:
        return plays.forward().run(u) + mh.Duhem.from_bouc_wen(*operator).run(u)

    kind = Stage("beside plays", -50.0, 50.0, position)
    u, other = varied(kind), loops_of(kind, [0.7, 0.9, 0.35, 0.6])
    found = mh.identify(u, measured(kind, u), dt=LAW_DT, duhem="fit")
    assert found.duhem is not None and found.duhem.rising.min() > 0.0
    true = position(other)
    assert np.std(found.predict(other) - true) < 1e-3 * np.ptp(true)


def test_a_fit_without_an_inverse_is_red() -> None:
    kind = named("plays")
    u = varied(kind)
    steep = mh.Duhem.from_bouc_wen(-5.0, 0.03, 0.8, -0.3)
    found = mh.identify(u, measured(kind, u), dt=LAW_DT, duhem=steep)
    (finding,) = (finding for finding in found.warnings if finding.code == "no_inverse")
    assert found.verdict == "red" and finding.value < 0.0
    with pytest.raises(ValueError, match="duhem: expected a Duhem operator that falls less"):
        found.stage.inverse(LAW_DT)
    with pytest.raises(ValueError, match="duhem: expected a Duhem operator that falls less"):
        found.stage.controller(LAW_DT)


def leaking_decay() -> tuple[Array, Array]:
    """Return decaying loops of a stage whose charge leaks off: no operator is true there."""
    r = np.linspace(0.0, 40.0, 33)
    weights = np.r_[0.6, 0.025 * np.exp(-r[1:] / 20.0)]
    plays = mh.ModifiedPrandtlIshlinskii.from_ratios(weights, r, ra=1.0, rb=1.0, rc=1.0)
    t = np.arange(2500) * LAW_DT
    decay = 50.0 + 50.0 * np.linspace(1.0, 0.1, t.size) * np.sin(2.0 * np.pi * t)
    u = np.concatenate([way([0.0, 50.0], 100.0), decay])
    x = plays.forward().run(u)
    clean = x - 0.9 * lagged(x - x[0], 25.0)
    return u, clean + np.random.default_rng(1).normal(0.0, 5e-4 * np.ptp(clean), u.size)


@pytest.mark.parametrize("duhem", ["auto", "fit"])
def test_an_operator_that_would_run_away_is_refused(duhem: Any) -> None:
    u, y = leaking_decay()
    found = mh.identify(u, y, dt=LAW_DT, duhem=duhem)
    assert found.duhem is None and found.verdict != "green"
    outcomes = [one["outcome"] for one in found.terms_tried if one["term"] == "Duhem operator"]
    assert outcomes == ["stands_for_other"]


def test_an_operator_that_runs_away_is_red_where_it_was_given() -> None:
    u, y = leaking_decay()
    rising = [0.027, 0.212, 0.244, 0.266, 0.279]
    near = mh.Duhem([-6.0, -3.0, 0.0, 14.7, 29.3], rising, [0.319, 0.282, 0.268, 0.282, 0.304])
    found = mh.identify(u, y, dt=LAW_DT, duhem=near)
    (runs,) = (one for one in found.warnings if one.code == "operator_runs_away")
    assert found.verdict == "red" and runs.value > runs.limit == 0.05


def test_plays_that_adapt_take_no_operator_beside_them() -> None:
    plays = mh.PrandtlIshlinskii([0.8, 0.05, 0.05], [0.0, 5.0, 20.0])
    falls = mh.Duhem.from_bouc_wen(-0.4, 0.03, 0.8, -0.3)
    stage = mh.Stage(plays, duhem=falls, limits=(-50.0, 50.0), noise=1e-3)
    reference = 20.0 * np.sin(2.0 * np.pi * np.arange(200) * DT)
    identifier = mh.RecursiveIdentifier(plays, forgetting=0.999)
    with pytest.raises(ValueError, match="identifier: expected None for a stage with a Duhem"):
        mh.plant.simulate(stage.controller(DT), stage.plant(DT), reference, identifier=identifier)


def test_a_map_that_is_asked_for_stays_beside_the_operator() -> None:
    u = loops()
    h = 0.3 * u + bouc_wen(u, 1.4, 0.6)
    y = h - 1e-3 * h**2
    asked = {**QUASI_STATIC, "output_map": "smooth"}
    found = mh.identify(u, y, duhem="fit", **asked)
    assert found.duhem is not None and found.stage.output_map is not None
    assert found.fit.rmse < 0.5 * mh.identify(u, y, duhem="fit", **QUASI_STATIC).fit.rmse


def test_identify_leaves_the_operator_out_where_plays_are_right() -> None:
    u = loops()
    y = hysteresis(OFFSET).forward().run(u)
    y += np.random.default_rng(2).normal(0.0, 2e-4 * np.ptp(y), u.size)
    found = mh.identify(u, y, **QUASI_STATIC)
    plays = mh.identify(u, y, duhem=None, **QUASI_STATIC)
    assert found.duhem is None and found.fit.rmse == plays.fit.rmse


def test_wrong_options_are_named() -> None:
    u = loops()
    wrong: Any = math.pi
    with pytest.raises(
        TypeError, match=r'duhem: expected None, "auto", "fit" or a mh\.Duhem'
    ) as caught:
        mh.identify(u, u, duhem=wrong)
    assert parameter_of(caught.value) == "duhem"
    knots = list(np.arange(9.0))
    with pytest.raises(ValueError, match="knots: expected a whole number from 2 to 5"):
        mh.identify(u, u, duhem=mh.Duhem(knots, [1.0] * 9, [1.0] * 9))


def test_loops_that_drift_apart_leave_no_range() -> None:
    drifting = mh.Duhem([-1.0, 1.0], [0.1, 0.1], [0.2, 0.2])
    line = mh.PrandtlIshlinskii([1.0], [0.0])
    stage = mh.Stage(line, limits=(0.0, 10.0), duhem=drifting)
    assert stage.position_range is None
    with pytest.raises(ValueError, match="expected a stage that reaches positions after any loops"):
        mh.scan.Scanner({"x": stage}, DT)


def test_remanence_within_what_a_stage_reaches_is_no_limit_of_a_scan() -> None:
    beside = mh.Duhem.from_bouc_wen(1.0, 0.5, 0.5, 0.5)
    stage = mh.Stage(mh.PrandtlIshlinskii([0.2], [0.0]), limits=(0.0, 20.0), duhem=beside)
    assert stage.position_range is not None
    low, high = stage.position_range
    scanner = mh.scan.Scanner({"x": stage}, DT)
    wanted = low + (high - low) * np.array([0.5, 0.99, 0.3, 0.05])
    scanner.run({"x": wanted}, lead_in=0.1)
