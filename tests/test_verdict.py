"""Every defect of a record is found on stages of different physics, and gone by its hint."""

from __future__ import annotations

import pickle
from itertools import pairwise
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from stages import BENCHES, RATE, Bench
from support import Array

OPTIONS: dict[str, Any] = {"operators": 8, "weights": "free", "dt": 1.0 / RATE}


def fitted(u: Array, y: Array, **options: Any) -> mh.results.Identification:
    return mh.identify(u, y, **{**OPTIONS, **options})


def codes(found: mh.results.Identification) -> set[str]:
    return {finding.code for finding in found.warnings}


def finding(found: mh.results.Identification, code: str) -> mh.results.Finding:
    assert code in codes(found), found.warnings
    return next(one for one in found.warnings if one.code == code)


def times(u: Array) -> Array:
    return np.arange(u.size) / RATE


each = pytest.mark.parametrize("bench", BENCHES, ids=lambda bench: bench.name)


@each
def test_a_clean_record_is_green(bench: Bench) -> None:
    u, skip = bench.drive()
    found = fitted(u, bench.measured(u), skip=skip, times=times(u), operators=12)
    assert (found.verdict, found.warnings) == ("green", [])
    assert repr(found).startswith("<Identification: green, dead time ")
    assert pickle.loads(pickle.dumps(found)).verdict == "green"


@each
def test_a_position_of_the_wrong_sign(bench: Bench) -> None:
    u, skip = bench.drive()
    found = fitted(u, -bench.measured(u), skip=skip)
    assert found.verdict == "red"
    # what follows from it is not told
    assert codes(found) == {"wrong_sign", "poor_fit"}
    wrong = finding(found, "wrong_sign")
    assert wrong.severity == "red" and wrong.value < wrong.limit < 0.0
    assert (
        "--negate-output" in wrong.hint
        and "with the sign of the position turned 0." in wrong.message
    )
    assert pickle.loads(pickle.dumps(found)).warnings[0].severity == "red"


@each
def test_loops_that_are_traversed_backwards(bench: Bench) -> None:
    u, skip = bench.drive()
    found = fitted(bench.measured(u), u, skip=skip)
    backwards = finding(found, "loop_backwards")
    assert found.verdict == backwards.severity == "red"
    assert backwards.value > backwards.limit and "columns are swapped" in backwards.hint


@each
def test_a_poor_fit(bench: Bench) -> None:
    u, skip = bench.drive()
    y = bench.measured(u)
    swaying = np.ptp(y) * np.sin(2.0 * np.pi * 0.37 * times(u))
    for size, verdict in ((0.04, "amber"), (0.1, "red")):
        found = fitted(u, y + size * swaying, skip=skip)
        poor = finding(found, "poor_fit")
        assert found.verdict == poor.severity == verdict
        # a sine has 0.7 of its amplitude rms; weights take a part of it up
        assert 0.5 * size < poor.value < 0.75 * size


@each
def test_what_is_no_noise_counts_from_a_thousandth_of_the_range_on(bench: Bench) -> None:
    u, skip = bench.drive()
    y = bench.measured(u)
    swaying = np.ptp(y) * np.sin(2.0 * np.pi * 3.0 * times(u))
    assert codes(fitted(u, y + 5e-4 * swaying, skip=skip)) == set()
    coloured = finding(fitted(u, y + 3e-3 * swaying, skip=skip), "residual_coloured")
    assert coloured.severity == "amber" and coloured.value == pytest.approx(2.5e-3, rel=0.3)


def test_noise_is_no_poor_fit() -> None:
    bench = BENCHES[0]
    u, skip = bench.drive()
    y = bench.position(u)
    noisy = y + np.random.default_rng(4).normal(0.0, 0.03 * np.ptp(y), u.size)
    found = fitted(u, noisy, skip=skip, operators=4)
    assert found.fit.nrmse > 0.025 and found.verdict == "green"


def test_rows_in_another_order() -> None:
    u = mh.signals.decaying_triangle(100.0, 0.5, cycles=6, rate=RATE)
    play = mh.PrandtlIshlinskii([1.0], [40.0]).forward()
    y = u + play.run(u)
    order = np.random.default_rng(5).permutation(u.size)
    assert finding(fitted(u[order], y[order]), "poor_fit").hint.count("order of time") == 1
    assert "poor_fit" not in codes(fitted(u, y))


@each
def test_a_monitor_of_the_drive_has_no_hysteresis(bench: Bench) -> None:
    u, skip = bench.drive()
    monitor = 0.1 * u + np.random.default_rng(6).normal(0.0, 1e-5 * np.ptp(u), u.size)
    none = finding(fitted(u, monitor, skip=skip), "no_hysteresis")
    assert abs(none.value) < none.limit == 0.001 and "monitor" in none.hint
    assert "no_hysteresis" not in codes(fitted(u, bench.measured(u), skip=skip))


@pytest.mark.parametrize("dt", [0.02, 0.04, 0.1, 1.0, 30.0])
def test_slow_records_are_fitted_by_default(dt: float) -> None:
    bench = BENCHES[0]
    u, skip = bench.drive()
    assert mh.identify(u, bench.measured(u), operators=8, skip=skip, dt=dt).fit.nrmse < 0.005


def test_a_chirp_does_not_begin_with_a_transient() -> None:
    # A model without the mode leaves most where the chirp passes it: in the middle.
    u = mh.signals.chirp(1.0, 10.0, 400.0, seconds=2.0, rate=2000)
    t = np.arange(u.size) / 2000.0
    passes = 0.05 * u * np.exp(-(((t - 0.5) / 0.1) ** 2))
    found = mh.identify(u, u + passes, operators=4, weights="free", dt=1 / 2000)
    assert "start_up_transient" not in codes(found)


@each
def test_two_equal_readings_are_chance(bench: Bench) -> None:
    u, skip = bench.drive()
    u, skip = u[::25].copy(), skip // 25
    y = bench.measured(u)
    middle = int(np.argmax(np.abs(np.diff(u)[skip + 20 : -20]))) + skip + 20
    y[middle + 1] = y[middle]
    assert "stuck_output" not in codes(fitted(u, y, skip=skip, operators=4))
    y[middle + 1 : middle + 4] = y[middle]
    assert "stuck_output" in codes(fitted(u, y, skip=skip, operators=4))


@each
def test_a_beginning_that_lies_on_no_loop(bench: Bench) -> None:
    u, _ = bench.drive()
    y = bench.measured(u)
    transient = 0.2 * np.ptp(y) * np.exp(-times(u) / 0.1)
    found = fitted(u, y + transient)
    start = finding(found, "start_up_transient")
    assert found.verdict != "green" and start.value > start.limit
    assert start.sample is not None and 100 < start.sample < 1000
    assert start.hint.endswith(f"--skip {start.sample}")
    # the fit hides a part of a transient, which shows once the rest is skipped
    again = fitted(u, y + transient, skip=start.sample)
    if "start_up_transient" in codes(again):
        again = fitted(u, y + transient, skip=finding(again, "start_up_transient").sample)
    assert "start_up_transient" not in codes(again) and again.fit.rmse < found.fit.rmse / 2.0


@each
def test_missing_samples_and_uneven_times(bench: Bench) -> None:
    u, skip = bench.drive()
    y, t = bench.measured(u), times(u)
    middle = u.size // 2
    kept = np.r_[0:middle, middle + 3 : u.size]
    gap = finding(fitted(u[kept], y[kept], skip=skip, times=t[kept]), "time_gap")
    assert gap.value == pytest.approx(4.0) and gap.sample == middle
    assert f"{t[middle + 3]:.6f} s" in gap.message
    # what was recorded before it has none
    before = slice(0, middle)
    assert "time_gap" not in codes(fitted(u[before], y[before], skip=skip, times=t[before]))
    uneven = t + np.random.default_rng(5).uniform(-0.4, 0.4, t.size) / RATE
    found = fitted(np.interp(uneven, t, u), np.interp(uneven, t, y), skip=skip, times=uneven)
    jitter = finding(found, "time_jitter")
    assert jitter.value == pytest.approx(0.23, abs=0.03) and found.verdict == "amber"
    assert "time_gap" not in codes(found)
    # times that are written with few digits
    assert fitted(u, y, skip=skip, times=np.round(t / 9e-5) * 9e-5).verdict == "green"


@each
def test_a_dead_time_of_a_fifth_of_a_period(bench: Bench) -> None:
    u, skip = bench.drive()
    late = 100
    y = np.r_[np.full(late, bench.measured(u)[0]), bench.measured(u)[:-late]]
    found = fitted(u, y, skip=skip + late)
    dead_time = finding(found, "implausible_dead_time")
    assert 0.1 == dead_time.limit < dead_time.value < 0.3
    assert "implausible_dead_time" not in codes(fitted(u[:-late], y[late:], skip=skip))


@each
def test_what_the_residual_follows(bench: Bench) -> None:
    u, skip = bench.drive()
    there_and_back = np.r_[u, u[::-1]]
    y = bench.measured(there_and_back)
    part = (there_and_back - bench.low) / (bench.high - bench.low)
    span, t = np.ptp(y), times(there_and_back)
    # With the terms that explain them there would be nothing to follow.
    without: dict[str, Any] = {"dynamics": None, "creep": None, "loop_shift": None}
    without |= {"input_map": None, "output_map": None}
    lines: dict[str, Any] = {"model": "conventional", "skip": skip} | without
    for code, more in (
        ("input_effects", 0.3 * part**2),
        ("amplitude_effects", 0.05 * swings(there_and_back, bench)),
        ("drift", 0.05 * t / t[-1]),
    ):
        found = fitted(there_and_back, y + span * more, **lines)
        assert code in codes(found), (code, found.warnings)
        assert found.verdict in ("amber", "red")
    faster = np.r_[u, u[::-8], u[::8]]
    late = np.interp(np.arange(faster.size) - 1.5, np.arange(faster.size), bench.measured(faster))
    assert "rate_effects" in codes(fitted(faster, late, skip=skip, dead_time=0.0, **without))
    # following the hints: none of it is left
    clean = fitted(there_and_back, y, skip=skip)
    followed = {"input_effects", "amplitude_effects", "drift", "rate_effects"}
    assert not followed & codes(clean)
    assert not followed & codes(fitted(faster, late, skip=skip))


def swings(u: Array, bench: Bench) -> Array:
    """Return the height of the last finished swing, as a share of the range."""
    turns = np.flatnonzero(np.diff(np.sign(np.diff(u)))) + 1
    heights = np.zeros(u.size)
    for first, last in pairwise(turns):
        heights[last:] = abs(u[last] - u[first])
    return heights / (bench.high - bench.low)


@each
def test_one_loop_again_and_again(bench: Bench) -> None:
    u, skip = bench.drive()
    many = np.r_[u, bench.cycles(30)]
    repeated = finding(fitted(many, bench.measured(many), skip=skip), "identical_loops")
    assert repeated.severity == "amber" and 0.6 == repeated.limit < repeated.value < 0.8
    assert "loops are the same" in repeated.message
    few = np.r_[u, bench.cycles(5)]
    assert "identical_loops" not in codes(fitted(few, bench.measured(few), skip=skip))
    alone = bench.cycles(12)
    found = fitted(alone, bench.measured(alone), skip=400)
    assert "no_minor_loops" in codes(found) and "identical_loops" not in codes(found)
    assert "no_minor_loops" not in codes(fitted(few, bench.measured(few), skip=skip))


@each
def test_a_signal_at_the_end_of_its_converter(bench: Bench) -> None:
    u, skip = bench.drive()
    y = bench.measured(u)
    highest = bench.high - 0.2 * (bench.high - bench.low)
    found = fitted(np.minimum(u, highest), y, skip=skip)
    drive = finding(found, "clipped_input")
    assert found.verdict == drive.severity == "red"
    assert drive.sample is not None and u[drive.sample] >= highest
    level = float(np.quantile(y, 0.9))
    found = fitted(u, np.minimum(y, level), skip=skip)
    position = finding(found, "clipped_output")
    assert found.verdict == position.severity == "red"
    assert position.sample is not None and y[position.sample] >= level


@each
def test_a_drive_beyond_the_identified_range(bench: Bench) -> None:
    u, skip = bench.drive()
    middle = 0.5 * (bench.low + bench.high)
    further = middle + 1.3 * (u - middle)
    y = bench.measured(u)
    found = fitted(u, y, skip=skip, validate=(further, bench.position(further), skip))
    beyond = finding(found, "extrapolation")
    assert beyond.value == pytest.approx(0.15) and found.verdict == "red"
    assert "held-out record 0: the drive reaches" in beyond.message
    with pytest.warns(UserWarning, match=r"^u: the drive reaches .* beyond the identified"):
        found.predict(further)
    assert "extrapolation" not in codes(fitted(u, y, skip=skip, validate=(u, y, skip)))


def test_the_verdict_of_a_list() -> None:
    bench = BENCHES[0]
    u, skip = bench.drive()
    y, model = bench.measured(u), mh.paper.table_1_recovered()
    assert mh.results.verdict(mh.diagnose(u, y, model, skip=skip)) == "green"
    alone = bench.cycles(8)
    assert mh.results.verdict(mh.diagnose(alone, bench.measured(alone), model)) == "amber"
    turned = mh.diagnose(u, -y, model, skip=skip)
    assert [one.code for one in turned] == ["wrong_sign", "poor_fit"]
    assert mh.results.verdict(turned) == "red"
    with pytest.raises(TypeError, match=r"^findings: expected a list of Finding"):
        mh.results.verdict(["red"])  # type: ignore[list-item]


def test_times_are_checked() -> None:
    bench = BENCHES[0]
    u, _ = bench.drive()
    y = bench.measured(u)
    for wrong, message in (
        (times(u)[1:], r"^times: expected .* samples, got"),
        (np.full(u.size, np.nan), r"^times\[0\]: expected a finite number"),
        ([times(u), times(u)], r"^times: expected one array for each of 1 records, got 2"),
        (times(u)[::-1].copy(), r"^times\[1\]: expected a time after that of the sample before"),
        (np.floor(100.0 * times(u)) / 100.0, r"^times\[1\]: .* 0.0 s; .* and give dt"),
        (np.r_[times(u)[:9], times(u)[8:-1]], r"^times\[9\]: expected a time after"),
        (1e3 * times(u), r"^times: expected steps of dt, 0.001 s, .* got steps of 1.0000e0 s"),
        (0.4 * times(u), r"^times: expected steps of dt"),
        (1.3 * times(u), r"got steps of 1.3000e-3 s: give that as dt, or leave the times out"),
    ):
        with pytest.raises(ValueError, match=message):
            fitted(u, y, times=wrong)
    with pytest.raises(ValueError, match=r"^record 1: times: expected steps of dt"):
        mh.identify([(u, y), (u, y)], dt=1.0 / RATE, times=[times(u), 10.0 * times(u)])
    # they give no sampling interval
    assert mh.identify(u, y, times=times(u), operators=4).dt == []


def test_a_stage_keeps_how_severe_a_warning_is() -> None:
    bench = BENCHES[0]
    u, skip = bench.drive()
    y = bench.measured(u)
    known = fitted(u, np.minimum(y, np.quantile(y, 0.9)), skip=skip).stage.identified
    assert known is not None
    kept = {one["code"]: one["severity"] for one in known["warnings"]}
    assert kept["clipped_output"] == "red"
