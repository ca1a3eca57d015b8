"""Identification: weight laws, cross-validation, held-out records, standard errors."""

from __future__ import annotations

from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from test_identify import PAPER_RATIOS, THRESHOLDS, actuator, delayed, error, sweep


def test_quadratic_weights_come_back_within_1e_4_and_ratios_within_1e_6() -> None:
    u = sweep(6000, cycles=20)
    y = delayed(actuator(12.5, -3.0).forward().run(u), 2.35)
    found = mh.identify(u, y, thresholds=THRESHOLDS, weights="quadratic")
    # the recovered weights follow four numbers within the print rounding: 2e-7 of a weight
    assert found.ratios == pytest.approx(PAPER_RATIOS, abs=1e-6)
    np.testing.assert_allclose(found.model.weights, actuator().weights, rtol=1e-4)
    assert np.abs(np.diff(found.model.weights[1:], 3)).max() < 1e-17
    assert found.kkt_residual < 1e-12


def test_15_nm_of_noise_and_an_unseen_record() -> None:
    u = sweep(12_000, cycles=20)
    clean = actuator().forward()
    y = clean.run(u) + np.random.default_rng(2).normal(0.0, 0.015, u.size)
    fixed: dict[str, Any] = {"input_offset": 0.0, "dead_time": 0.0, "thresholds": THRESHOLDS}
    found = mh.identify(u, y, weights="quadratic", **fixed)
    assert found.ratios == pytest.approx(PAPER_RATIOS, abs=0.005)
    np.testing.assert_allclose(found.model.weights, actuator().weights, rtol=0.05)
    amplitudes = [450.0, 100.0, 320.0, 60.0, 210.0, 400.0]
    unseen = np.concatenate([a * np.sin(np.arange(1000) / 500 * 2 * np.pi) for a in amplitudes])
    residual = found.predict(unseen) - actuator().forward().run(unseen)
    residual -= residual.mean()  # the offset of the sensor, which every record has of its own
    # the target that is stated: 0.7 nm rms, 2.5 nm at most
    assert np.sqrt(np.mean(residual**2)) < 0.0007 and np.abs(residual).max() < 0.0025


def test_standard_errors_cover_the_truth_as_often_as_they_say() -> None:
    u = sweep(2000, cycles=12)
    clean = actuator().forward().run(u)
    true = [*PAPER_RATIOS, *actuator().weights]
    covered = []
    for seed in range(60):
        y = clean + np.random.default_rng(seed).normal(0.0, 0.015, u.size)
        fixed: dict[str, Any] = {"input_offset": 0.0, "dead_time": 0.0, "thresholds": THRESHOLDS}
        found = mh.identify(u, y, weights="quadratic", **fixed)
        estimate = np.array([*found.ratios, *found.model.weights])
        std = np.array([*found.ratios_std, *found.weights_std])
        # A weight at its bound has no standard error; here almost none is.
        inside = np.abs(estimate - true) <= 1.96 * std
        covered.append(np.where(np.isnan(std), np.nan, inside))
    share = np.nanmean(covered, axis=0)
    # 95 %; of 60 runs the share of one parameter varies by 0.028 (1 sigma), here 4 of them
    assert share.min() > 0.83
    assert 0.91 < share.mean() < 0.99


def test_split_weights_fit_what_one_weight_cannot() -> None:
    u = sweep(3000)
    below = actuator().weights.copy()
    below[1:] *= 0.5
    thresholds = (THRESHOLDS, 0.95 * THRESHOLDS, 0.30 * THRESHOLDS, 0.35 * THRESHOLDS)
    true = mh.ModifiedPrandtlIshlinskii(actuator().weights, *thresholds, weights_negative=below)
    y = true.forward().run(u)
    fixed: dict[str, Any] = {"thresholds": THRESHOLDS, "input_offset": 0.0, "dead_time": 0.0}
    found = mh.identify(u, y, weights="split", **fixed)
    assert isinstance(found.model, mh.ModifiedPrandtlIshlinskii) and found.model.split
    assert found.model.weights[0] == found.model.weights_negative[0]
    assert found.weights_negative_std.shape == (20,) and found.model.invertible
    assert error(found, u, y) < 1e-8
    assert mh.identify(u, y, weights="free", **fixed).fit.rmse > 1e-3
    assert mh.identify(u, y, **fixed).weights_law == "split"  # what cross-validation chooses
    with pytest.raises(ValueError, match=r"^weights: .* the conventional model"):
        mh.identify(u, y, model="conventional", weights="split")


def test_inner_problem_agrees_with_scipy() -> None:
    optimize = pytest.importorskip("scipy.optimize", reason="scipy is not installed")
    u = sweep(800)
    y = actuator().forward().run(u) + np.random.default_rng(1).normal(0.0, 0.05, u.size)
    fixed: dict[str, Any] = {"ratios": PAPER_RATIOS, "input_offset": 0.0, "dead_time": 0.0}
    found = mh.identify(u, y, thresholds=THRESHOLDS, weights="free", smoothness=0.0, **fixed)
    columns = np.stack([mh.CoupledPlay(r, 0.95 * r, 0.3 * r, 0.35 * r).run(u) for r in THRESHOLDS])
    centred = columns.T - columns.T.mean(axis=0)
    expected, norm = optimize.nnls(centred, y - y.mean())
    np.testing.assert_allclose(found.model.weights, expected, rtol=1e-6, atol=1e-12)
    assert found.fit.rmse == pytest.approx(norm / np.sqrt(u.size), rel=1e-9)
    boxed = optimize.lsq_linear(centred, y - y.mean(), (0.0, np.inf), method="bvls")
    assert found.fit.mse == pytest.approx(2 * boxed.cost / u.size, rel=1e-9)
    assert found.kkt_residual < 1e-12
    assert found.model.weights.min() == 0.0  # else the bounds were not tried
    # Without noise no bound is met: plain least squares.
    clean = actuator().forward().run(u)
    plain = np.linalg.lstsq(centred, clean - clean.mean(), rcond=None)[0]
    free = mh.identify(u, clean, thresholds=THRESHOLDS, weights="free", **fixed)
    np.testing.assert_allclose(free.model.weights, plain, rtol=1e-8)


def test_validation_of_other_records_and_of_the_rest() -> None:
    u = sweep(2000)
    y = actuator().forward().run(u)
    y_noisy = y + np.random.default_rng(3).normal(0.0, 0.01, u.size)
    other = 30.0 + sweep(1000, 300.0, 5)
    measured = 7.0 + actuator().forward().run(other)
    fixed: dict[str, Any] = {"ratios": PAPER_RATIOS, "input_offset": 0.0, "dead_time": 0.0}
    fixed["thresholds"] = THRESHOLDS
    found = mh.identify(u, y_noisy, validate=(other, measured, 50), **fixed)
    assert found.validation is not None and found.validation.samples == 950
    residual = (measured - found.predict(other))[50:]
    assert found.validation.rmse == pytest.approx(residual.std(), rel=1e-6)
    assert found.validation.range == pytest.approx(np.ptp(measured[50:]), rel=1e-12)
    two = mh.identify(u, y_noisy, validate=[(other, measured), (u, y)], **fixed)
    assert [quality.samples for quality in two.validation_records] == [1000, 2000]
    rest = mh.identify(u, y_noisy, validate=0.25, **fixed)
    assert rest.fit.samples == 1500 and rest.validation is not None
    left = (y_noisy - rest.predict(u))[1500:]
    assert rest.validation.samples == 500
    assert rest.validation.rmse == pytest.approx(np.sqrt(np.mean(left**2)), rel=1e-9)
    assert mh.identify(u, y, **fixed).validation is None
    assert mh.identify(u[:1500], y_noisy[:1500], **fixed).model == rest.model


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"weights": "cubic"}, '^weights: expected "auto", "free", .* or "split", got "cubic"$'),
        ({"smoothness": -1.0}, r"^smoothness: expected a finite number >= 0 .*, got -1\.0$"),
        ({"smoothness": np.nan}, "^smoothness: expected a finite number >= 0 .*, got NaN$"),
        (
            {"thresholds": "log"},
            '^thresholds: expected "uniform", "quantiles", "geometric" or an array, got',
        ),
        ({"operators": "auto", "thresholds": [0.0, 1.0]}, "^operators: expected a number"),
        ({"validate": 1.5}, r"^validate: expected a share between 0 and 1, got 1\.5$"),
        ({"validate": ([1.0, 2.0], [1.0])}, "^validate: y: expected 2 samples, got 1$"),
    ],
)
def test_wrong_choices_are_named(keywords: dict[str, Any], message: str) -> None:
    u = sweep(400)
    with pytest.raises(ValueError, match=message):
        mh.identify(u, u, **keywords)
    with pytest.raises(TypeError, match=r'^smoothness: expected a number >= 0 or "auto", got'):
        mh.identify(u, u, smoothness="much")  # type: ignore[arg-type]
    with pytest.raises(TypeError, match=r"^validate: expected \(u, y\)"):
        mh.identify(u, u, validate=[1.0])  # type: ignore[arg-type]


def test_operators_by_cross_validation() -> None:
    u = sweep(2000)
    r = np.array([0.0, 125.0, 250.0, 375.0])
    true = mh.ModifiedPrandtlIshlinskii.from_ratios(
        [4e-3, 1e-3, 5e-4, 5e-4], r, ra=0.95, rb=0.3, rc=0.35
    )
    y = true.forward().run(u) + np.random.default_rng(4).normal(0.0, 0.01, u.size)
    found = mh.identify(u, y, operators="auto", input_offset=0.0, dead_time=0.0)
    assert found.model.operators == 4
    counts = [4, 6, 8, 12, 16, 20, 24, 32, 40, 48, 64, 80]
    assert [count for count, _ in found.cross_validation] == counts
    assert not mh.identify(u, y, operators=4, input_offset=0.0, dead_time=0.0).cross_validation


def test_20_operators_are_doubled_where_that_predicts_better() -> None:
    u = sweep(3000)
    known: dict[str, Any] = {"ratios": PAPER_RATIOS, "input_offset": 0.0, "dead_time": 0.0}
    noise = np.random.default_rng(6).normal(0.0, 0.0005, u.size)
    y = actuator().forward().run(u) + noise
    found, given = mh.identify(u, y, **known), mh.identify(u, y, operators=20, **known)
    assert [count for count, _ in found.cross_validation] == [20, 40]
    assert not given.cross_validation
    np.testing.assert_array_equal(found.model.weights, given.model.weights)
    # Of forty plays every other one has the weight: twenty lie where there is none.
    r = np.abs(u).max() / 40 * np.arange(40)
    weights = np.where(np.arange(40) % 2 == 1, 4e-4, 0.0) + np.where(np.arange(40) == 0, 4e-3, 0.0)
    ra, rb, rc = PAPER_RATIOS
    true = mh.ModifiedPrandtlIshlinskii.from_ratios(weights, r, ra=ra, rb=rb, rc=rc)
    y = true.forward().run(u) + noise
    found, given = mh.identify(u, y, **known), mh.identify(u, y, operators=20, **known)
    assert found.model.operators == 40 and [n for n, _ in found.cross_validation] == [20, 40, 80]
    assert found.fit.rmse < 0.00055 < 0.001 < given.fit.rmse
    assert mh.identify(u, y, thresholds=r, **known).model.operators == 40
