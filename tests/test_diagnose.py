"""Findings: each defect of a record is named, and what has none is left alone."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import Array

ACTUATOR = mh.paper.table_1_recovered()
NOISE = 0.015  # um, of the paper's gauges
MADE = mh.signals.excitation(-500.0, 500.0, slew=2000.0, rate=500.0)
DRIVE, SKIP = MADE.drive, MADE.initialization_samples


def measured(u: Array, seed: int, sigma: float = NOISE) -> Array:
    return ACTUATOR.forward().run(u) + np.random.default_rng(seed).normal(0.0, sigma, u.size)


def names(found: list[mh.results.Finding]) -> list[str]:
    return [finding.code for finding in found]


def fitted(u: Array, y: Array, skip: int = SKIP, **options: Any) -> list[mh.results.Finding]:
    found = mh.identify(u, y, skip=skip, **options)
    return mh.diagnose(u, y, found.model, skip=skip, dead_time=found.dead_time_samples or 0.0)


# ---- what has no defect


@settings(max_examples=4)  # each is a fit
@given(
    seed=st.integers(0, 2**32 - 1),
    sigma=st.sampled_from([0.0, 1e-4, 5e-3, NOISE]),
    operators=st.integers(4, 20),
    shape=st.sampled_from(["triangle", "sine"]),
    lag=st.integers(0, 4),
)
def test_a_clean_record_and_its_fit_have_none(
    seed: int, sigma: float, operators: int, shape: Any, lag: int
) -> None:
    made = mh.signals.excitation(-500.0, 500.0, slew=2000.0, rate=500.0, shape=shape)
    y = measured(made.drive, seed, sigma)
    y = np.concatenate([np.full(lag, y[0]), y[: y.size - lag]])
    assert names(fitted(made.drive, y, made.initialization_samples, operators=operators)) == []


@given(st.integers(0, 2**32 - 1))
def test_the_true_model_has_none(seed: int) -> None:
    assert mh.diagnose(DRIVE, measured(DRIVE, seed), ACTUATOR, skip=SKIP) == []


# ---- every defect, through a fit


def drifted(y: Array) -> Array:
    # half of that may go by unseen: split weights, where cross-validation takes them, hide a part
    return y + 0.2 * np.arange(y.size) / y.size


def crept(y: Array) -> Array:
    return y + 0.05 * np.log1p(np.arange(y.size))


def spiked(y: Array) -> Array:
    spoilt: Array = y.copy()
    spoilt[3000] += 0.3
    return spoilt


def clipped(y: Array) -> Array:
    return np.minimum(y, 2.5)


@pytest.mark.parametrize(
    ("spoil", "name"),
    [
        (drifted, "drift"),
        (crept, "drift"),
        (spiked, "outliers"),
        (clipped, "clipped_output"),
    ],
)
@pytest.mark.parametrize("seed", range(2))
def test_what_is_wrong_with_an_output_is_named(
    spoil: Callable[[Array], Array], name: str, seed: int
) -> None:
    found = fitted(DRIVE, spoil(measured(DRIVE, seed)))
    assert name in names(found)
    finding = next(finding for finding in found if finding.code == name)
    assert finding.value > finding.limit > 0 and finding.record is None
    assert finding.message and f": value {finding.value:.3f}" in repr(finding)
    assert f"<Finding {finding.code}, {finding.severity}: " in repr(finding)


def test_a_lag_that_no_delay_takes_up_is_named() -> None:
    u = np.concatenate(
        [mh.signals.decaying_triangle(500.0, f, cycles=6, rate=2000) for f in (1.0, 5.0, 20.0)]
    )
    y = measured(u, 3)
    lagging = np.interp(np.arange(u.size) - 1.5, np.arange(u.size), y)
    assert "rate_effects" in names(fitted(u, lagging, 0, dead_time=0.0))
    assert "rate_effects" not in names(fitted(u, lagging, 0))


def test_full_strokes_alone_are_named() -> None:
    u = mh.signals.sine(500.0, 1.0, seconds=8.0, rate=500.0)
    assert "no_minor_loops" in names(fitted(u, measured(u, 4), 500))


def test_too_many_operators_are_named() -> None:
    options: dict[str, Any] = {"operators": 50, "weights": "free", "dead_time": 0.0}
    assert "collinear_operators" in names(fitted(DRIVE, measured(DRIVE, 5), **options))


def test_thresholds_beyond_the_input_are_named() -> None:
    found = fitted(DRIVE, measured(DRIVE, 6), thresholds=np.arange(0.0, 700.0, 25.0), dead_time=0.0)
    finding = next(finding for finding in found if finding.code == "unreached_threshold")
    # the input offset is fitted: within a few volts of zero
    assert finding.value in (6.0, 7.0) and finding.limit == 0.0


def test_a_short_record_is_named() -> None:
    u, y = DRIVE[SKIP::40], measured(DRIVE, 7)[SKIP::40]
    assert "too_few_samples" in names(fitted(u, y, 0))


def test_a_clipped_monitor_is_named() -> None:
    u = np.maximum(DRIVE, -300.0)
    assert "clipped_input" in names(fitted(u, measured(DRIVE, 8)))


def test_the_record_at_fault_is_numbered() -> None:
    good, bad = measured(DRIVE, 9), spiked(measured(DRIVE, 10)) + 7.0
    found = mh.diagnose([(DRIVE, good), (DRIVE, bad)], None, ACTUATOR, skip=SKIP)
    assert [(finding.code, finding.record) for finding in found] == [("outliers", 1)]
    assert "sample 3000 " in found[0].message and "record 1, " in repr(found[0])
    assert mh.diagnose([(DRIVE, good)], None, ACTUATOR, skip=[SKIP]) == []


def test_a_measured_stack() -> None:
    major, decaying = (
        mh.datasets.piezo_stack("major_loops"),
        mh.datasets.piezo_stack("decaying_loops"),
    )
    records = [(major.u[:8000], major.y[:8000]), (decaying.u[:3850], decaying.y[:3850])]
    skips = [1000, 400]
    found = mh.identify(records, skip=skips, operators=16)
    told = mh.diagnose(
        records, None, found.model, skip=skips, dead_time=found.dead_time_samples or 0.0
    )
    # 40 periods in 40 s, in which the stack drifts by 0.3 % of its range; all of one speed
    assert [(finding.code, finding.record) for finding in told] == [
        ("identical_loops", 0),
        ("rate_dependence_not_told", None),
        ("drift", 0),
    ]
    assert found.verdict == mh.results.verdict(told) == "amber"
    # its README: on full loops alone the lag is invisible
    told = fitted(*records[0], skips[0], operators=16)
    assert {"no_minor_loops", "drift"} <= set(names(told))
    # and not so where minor loops are: without the delay the residual follows the speed
    found = mh.identify(records, skip=skips, operators=16, dead_time=0.0)
    told = mh.diagnose(records, None, found.model, skip=skips)
    assert ("rate_effects", 1) in [(finding.code, finding.record) for finding in told]


# ---- loop width


@given(st.floats(1.0, 200.0), st.integers(0, 2**32 - 1))
def test_the_loop_of_a_play_is_twice_its_threshold_wide(r: float, seed: int) -> None:
    z = mh.Play(r).run(DRIVE)
    width = mh.results.loop_width(DRIVE[SKIP:], z[SKIP:])
    # a part of 20 V holds five samples of 4 V: the two ways are half of a step apart
    assert width == pytest.approx(2.0 * r, abs=2.0)
    noisy = z[SKIP:] + np.random.default_rng(seed).normal(0.0, 1.0, z.size - SKIP)
    # five samples of either way in each of 50 parts: 0.63 rms, the largest of 50 at 5 sigma
    assert mh.results.loop_width(DRIVE[SKIP:], noisy) == pytest.approx(width, abs=3.5)


def test_the_loop_of_a_line_has_no_width_and_half_a_loop_none() -> None:
    assert mh.results.loop_width(DRIVE, 2.0 * DRIVE + 3.0) == pytest.approx(0.0, abs=1e-9)
    assert mh.results.loop_width(DRIVE[:300], DRIVE[:300]) is None
    assert mh.results.loop_width([], []) is None
    with pytest.raises(ValueError, match=r"^y: expected"):
        mh.results.loop_width(DRIVE, DRIVE[1:])
    with pytest.raises(ValueError, match=r"^u\[1\]: expected .* got NaN"):
        mh.results.loop_width([0.0, math.nan], [0.0, 1.0])


# ---- wrong input


@pytest.mark.parametrize(
    ("arguments", "options", "kind", "message"),
    [
        ((DRIVE, DRIVE[1:], ACTUATOR), {}, ValueError, "y: expected"),
        ((DRIVE, None, ACTUATOR), {}, TypeError, "u: expected an array with y beside it"),
        ((DRIVE, DRIVE, None), {}, TypeError, "model: expected a PrandtlIshlinskii or a Mod"),
        ((DRIVE, DRIVE, ACTUATOR.weights), {}, TypeError, "model: expected .* got array"),
        (
            (DRIVE, DRIVE, ACTUATOR),
            {"dead_time": -1.0},
            ValueError,
            "dead_time: expected .* got -1.0",
        ),
        (
            (DRIVE, DRIVE, ACTUATOR),
            {"dead_time": math.nan},
            ValueError,
            "dead_time: expected .* got NaN",
        ),
        ((DRIVE, DRIVE, ACTUATOR), {"skip": -1}, ValueError, "skip: expected .* got -1"),
        ((DRIVE, DRIVE, ACTUATOR), {"skip": 10**6}, ValueError, "skip: expected"),
        (
            (DRIVE, np.append(DRIVE[1:], math.inf), ACTUATOR),
            {},
            ValueError,
            r"y\[\d+\]: .* got inf",
        ),
        (([], None, ACTUATOR), {}, ValueError, "records: expected at least one"),
        (([(DRIVE, DRIVE), (DRIVE, 0.0 * DRIVE)], None, ACTUATOR), {}, ValueError, "record 1: y"),
    ],
)
def test_wrong_arguments_are_named(
    arguments: tuple[Any, ...], options: dict[str, Any], kind: type[Exception], message: str
) -> None:
    with pytest.raises(kind, match=f"^{message}"):
        mh.diagnose(*arguments, **options)
