"""Identification: smooth weights, what cross-validation chooses, and what noise leaves unknown."""

from __future__ import annotations

from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from support import Array
from test_identify import PAPER_RATIOS, THRESHOLDS, actuator, delayed, sweep

KNOWN: dict[str, Any] = {"ratios": PAPER_RATIOS, "input_offset": 0.0, "dead_time": 0.0}


def noisy(rms: float, samples: int = 2000) -> tuple[Array, Array]:
    u = sweep(samples, cycles=16)
    return u, actuator().forward().run(u) + np.random.default_rng(1).normal(0.0, rms, u.size)


def penalised(u: Array, y: Array, smoothness: float, *, split: bool) -> tuple[Array, Array]:
    """Regressor and data, the second differences of all weights but w_0 below them."""
    plays = np.stack([mh.CoupledPlay(r, 0.95 * r, 0.3 * r, 0.35 * r).run(u) for r in THRESHOLDS]).T
    differences = np.diff(np.eye(19), 2, axis=0)
    none = np.zeros_like(differences)
    if split:
        # The identity has one weight for both sides.
        columns = np.hstack(
            [plays[:, :1], np.maximum(plays[:, 1:], 0), np.minimum(plays[:, 1:], 0)]
        )
        rows = np.block([[differences, none], [none, differences]])
    else:
        columns, rows = plays, differences
    rows = np.hstack([np.zeros((len(rows), 1)), rows])
    scale = np.sqrt(smoothness * np.sum((u - u.mean()) ** 2))
    a = np.vstack([columns - columns.mean(axis=0), scale * rows])
    return a, np.concatenate([y - y.mean(), np.zeros(len(rows))])


@pytest.mark.parametrize("weights", ["free", "split"])
@pytest.mark.parametrize("smoothness", [1e-4, 1e-1])
def test_the_penalised_problem_agrees_with_scipy(weights: Any, smoothness: float) -> None:
    optimize = pytest.importorskip("scipy.optimize", reason="scipy is not installed")
    u, y = noisy(0.3, 600)
    keywords: dict[str, Any] = {"thresholds": THRESHOLDS, "weights": weights, **KNOWN}
    found = mh.identify(u, y, smoothness=smoothness, **keywords)
    assert isinstance(found.model, mh.ModifiedPrandtlIshlinskii)
    both = [found.model.weights, found.model.weights_negative[1:]]
    got = np.concatenate(both if weights == "split" else both[:1])
    a, b = penalised(u, y, smoothness, split=weights == "split")
    expected, norm = optimize.nnls(a, b)
    np.testing.assert_allclose(got, expected, rtol=1e-6, atol=1e-12)
    assert np.sum((a @ got - b) ** 2) == pytest.approx(norm**2, rel=1e-9)
    boxed = optimize.lsq_linear(a, b, (0.0, np.inf), method="bvls")
    assert norm**2 == pytest.approx(2 * boxed.cost, rel=1e-9)
    assert found.kkt_residual < 1e-12
    # The fit is that of the data alone.
    residual = (a @ got - b)[: u.size]
    assert found.fit.mse == pytest.approx(np.mean(residual**2), rel=1e-9)
    # Without noise no bound is met: plain least squares.
    clean = actuator().forward().run(u)
    a, b = penalised(u, clean, smoothness, split=weights == "split")
    plain = mh.identify(u, clean, smoothness=smoothness, **keywords).model
    lstsq = np.linalg.lstsq(a, b, rcond=None)[0]
    assert lstsq.min() > 0.0
    np.testing.assert_allclose(plain.weights, lstsq[:20], rtol=1e-8)


def test_smoothness_by_cross_validation_helps_weights_and_predictions() -> None:
    u, y = noisy(0.05)
    keywords: dict[str, Any] = {"thresholds": THRESHOLDS, "weights": "free", **KNOWN}
    free, smooth = (mh.identify(u, y, smoothness=s, **keywords) for s in (0.0, "auto"))
    true = actuator()
    errors = [np.abs(found.model.weights - true.weights).max() for found in (free, smooth)]
    assert errors[1] < 0.5 * errors[0]
    unseen = sweep(1500, 350.0, 5)
    left = [np.std(found.predict(unseen) - true.forward().run(unseen)) for found in (free, smooth)]
    assert left[1] < left[0]
    assert np.all(smooth.weights_std[1:] < np.nan_to_num(free.weights_std[1:], nan=np.inf))
    table = dict(smooth.smoothness_validation)
    assert list(table) == [0.0, *(10.0**k for k in range(-6, 3))]
    assert table[smooth.smoothness] == min(table.values()) < table[0.0]
    assert (free.smoothness, free.smoothness_validation) == (0.0, [])


def test_the_weight_law_by_cross_validation() -> None:
    u, y = noisy(0.015)
    found = mh.identify(u, y, thresholds=THRESHOLDS, **KNOWN)
    assert found.weights_law == "quadratic"
    assert [law for law, _ in found.weights_validation] == ["quadratic", "free", "split"]
    assert (
        found.model == mh.identify(u, y, thresholds=THRESHOLDS, weights="quadratic", **KNOWN).model
    )
    # Weights that no quadratic follows.
    uneven = np.where(np.arange(20) % 3, 1e-3, 0.0)
    thresholds = (THRESHOLDS, 0.95 * THRESHOLDS, 0.30 * THRESHOLDS, 0.35 * THRESHOLDS)
    true = mh.ModifiedPrandtlIshlinskii([4e-3, *uneven[1:]], *thresholds)
    y = true.forward().run(u) + np.random.default_rng(2).normal(0.0, 0.015, u.size)
    found = mh.identify(u, y, thresholds=THRESHOLDS, **KNOWN)
    assert found.weights_law == "free" and not mh.identify(u, y, weights="free").weights_validation


def test_noise_leaves_of_the_ratios_what_the_standard_errors_say() -> None:
    # Everything searched, 15 nm of noise: the bound of Cramer and Rao is 0.0053, 0.0045 and 0.0034.
    u = sweep(6000, cycles=20)
    clean = delayed(actuator(12.5, -3.0).forward().run(u), 2.35)
    errors, bounds, weights = [], [], []
    for seed in range(4):
        y = clean + np.random.default_rng(seed).normal(0.0, 0.015, u.size)
        found = mh.identify(u, y, thresholds=THRESHOLDS)
        errors.append(np.abs(np.subtract(found.ratios, PAPER_RATIOS)))
        bounds.append(found.ratios_std)
        weights.append(np.abs(found.model.weights / actuator().weights - 1.0).max())
    assert np.all(np.median(errors, axis=0) < 0.007)
    np.testing.assert_allclose(np.median(bounds, axis=0), [0.0053, 0.0045, 0.0034], rtol=0.1)
    # Of 12 normal deviates the largest is beyond 3.7 times in a hundred runs less than once.
    assert np.all(np.array(errors) < 3.7 * np.array(bounds))
    assert np.max(weights) < 0.07
